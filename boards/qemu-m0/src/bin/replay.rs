//! The application over a recording; see `beamfix_emulated::replay`.
#![no_std]
#![no_main]

use beamfix_app::{CONFIG, Place, SmallBoard};
use beamfix_emulated::{finish, replay, stack::Stack};
use qemu_m0::clock::Timer;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut APP: Place<SmallBoard> = Place::EMPTY;
    finish(replay::run(APP.app(&CONFIG), &mut Timer, &Stack::paint()))
}
