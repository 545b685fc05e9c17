//! LD06 bytes in at GP5, commands at GP1, frames out at GP0, the motor's PWM at GP6: see `beamfix_rp`.
#![no_std]
#![no_main]

use beamfix_app::{AppConfig, Board, CONFIG};
use cortex_m_rt::{entry, exception};
use defmt_rtt as _;
use panic_probe as _;

/// The second stage of the boot: makes the flash readable as memory.
#[unsafe(link_section = ".boot2")]
#[used]
static BOOT2: [u8; 256] = rp2040_boot2::BOOT_LOADER_GENERIC_03H;

/// As this crate's features want it.
const HERE: AppConfig = CONFIG.for_features(cfg!(feature = "demo"), cfg!(feature = "mavlink"));

#[entry]
fn main() -> ! {
    static mut APP: Board = Board::new(HERE);
    beamfix_rp::start(APP, &HERE)
}

/// Wakes the loop up: nothing else to do.
#[exception]
fn SysTick() {}
