//! A lidar's driver, counted; see `beamfix_emulated::drivers`.
#![no_std]
#![no_main]

use beamfix_emulated::{drivers, finish, stack::Stack};
use qemu_m0::clock::Timer;

#[cortex_m_rt::entry]
fn main() -> ! {
    finish(drivers::run(&mut Timer, &Stack::paint()))
}
