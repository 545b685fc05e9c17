//! Lidar bytes in at GPIO4, requests to it out at GPIO5, frames out at GPIO21 and commands in at GPIO20 (the board's USB bridge), the motor's
//! PWM at GPIO6: see `beamfix_esp`.
#![no_std]
#![no_main]

use beamfix_app::{AppConfig, Lidar as _, OdometryWith, Place, Row, chosen};
use defmt_rtt as _;
use esp_hal::main;
use static_cell::ConstStaticCell;

esp_bootloader_esp_idf::esp_app_desc!();

/// The lidar: a name of `beamfix lidars`; BEAMFIX_LIDAR=NAME builds for another.
type Lidar = Row<{ chosen("ld06") }>;
/// The task, and the most beams of a revolution.
type Robot = OdometryWith<Lidar, { Lidar::BEAMS }>;

/// As this crate's features want it.
const HERE: AppConfig = Lidar::CONFIG
    .for_features(cfg!(feature = "demo"), cfg!(feature = "mavlink"))
    .checked();

#[main]
fn main() -> ! {
    static APP: ConstStaticCell<Place<Robot>> = ConstStaticCell::new(Place::EMPTY);
    beamfix_esp::start::<Lidar, _, _>(APP.take().odometry::<Lidar>(&HERE), &HERE)
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    defmt::error!("{}", defmt::Display2Format(info));
    esp_hal::system::software_reset()
}
