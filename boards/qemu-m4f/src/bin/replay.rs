//! The application over a recording; see `beamfix_emulated::replay`.
#![no_std]
#![no_main]

use beamfix_app::{Board, CONFIG, Place};
use beamfix_emulated::{finish, replay, stack::Stack};
use qemu_m4f::clock::Timer;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut APP: Place<Board> = Place::EMPTY;
    finish(replay::run(APP.app(&CONFIG), &mut Timer, &Stack::paint()))
}
