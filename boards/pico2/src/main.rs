//! LD06 bytes in at GP5, commands at GP1, frames out at GP0, the motor's PWM at GP6: see `beamfix_rp`.
#![no_std]
#![no_main]

use beamfix_app::{AppConfig, Board, CONFIG};
use cortex_m_rt::{entry, exception};
use defmt_rtt as _;
use panic_probe as _;
use rp235x_hal::block::ImageDef;

/// What the boot ROM looks for: a secure program for the Arm cores.
#[unsafe(link_section = ".start_block")]
#[used]
static IMAGE_DEF: ImageDef = ImageDef::secure_exe();

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
