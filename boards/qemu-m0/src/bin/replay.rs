//! The application over a recording; see `beamfix_emulated::replay`.
#![no_std]
#![no_main]

use beamfix::odometry::OdometryConfig;
use beamfix_app::App;
use beamfix_emulated::{finish, replay, stack::Stack};
use qemu_m0::clock::Timer;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut APP: App<480> = App::new(OdometryConfig::DEFAULT);
    finish(replay::run(APP, &mut Timer, &Stack::paint()))
}
