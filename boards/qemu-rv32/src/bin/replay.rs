//! The application over a recording; see `beamfix_emulated::replay`.
#![no_std]
#![no_main]

use beamfix_app::{Board, CONFIG, Place};
use beamfix_emulated::{finish, replay, stack::Stack};
use qemu_rv32::clock::Timer;

#[riscv_rt::entry]
fn main() -> ! {
    static mut APP: Place<Board> = Place::EMPTY;
    let app = &raw mut APP;
    // SAFETY: only the start-up code calls `main`, once.
    let app = unsafe { &mut *app }.app(&CONFIG);
    finish(replay::run(app, &mut Timer::default(), &Stack::paint()))
}
