//! The application over a recording; see `beamfix_emulated::replay`.
#![no_std]
#![no_main]

use beamfix::odometry::OdometryConfig;
use beamfix_app::App;
use beamfix_emulated::{finish, replay, stack::Stack};
use qemu_rv32::clock::Timer;

#[riscv_rt::entry]
fn main() -> ! {
    static mut APP: App<480> = App::new(OdometryConfig::DEFAULT);
    // SAFETY: only the start-up code calls `main`, once.
    let app = unsafe { &mut *(&raw mut APP) };
    finish(replay::run(app, &mut Timer::default(), &Stack::paint()))
}
