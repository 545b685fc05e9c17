//! Lidar bytes in at GP5, requests to it out at GP4, commands at GP1, frames out at GP0, the motor's PWM at GP6: see `beamfix_rp`.
#![no_std]
#![no_main]

use beamfix_app::{AppConfig, Lidar as _, OdometryWith, Place, Row, chosen};
use cortex_m_rt::{entry, exception};
use defmt_rtt as _;
use panic_probe as _;

/// The second stage of the boot: makes the flash readable as memory.
#[unsafe(link_section = ".boot2")]
#[used]
static BOOT2: [u8; 256] = rp2040_boot2::BOOT_LOADER_GENERIC_03H;

/// The lidar: a name of `beamfix lidars`; BEAMFIX_LIDAR=NAME builds for another.
type Lidar = Row<{ chosen("ld06") }>;
/// The task, and the most beams of a revolution.
type Robot = OdometryWith<Lidar, { Lidar::BEAMS }>;

/// As this crate's features want it.
const HERE: AppConfig = Lidar::CONFIG
    .for_features(cfg!(feature = "demo"), cfg!(feature = "mavlink"))
    .checked();

#[entry]
fn main() -> ! {
    static mut APP: Place<Robot> = Place::EMPTY;
    beamfix_rp::start::<Lidar, _, _>(APP.odometry::<Lidar>(&HERE), &HERE)
}

/// Wakes the loop up: nothing else to do.
#[exception]
fn SysTick() {}
