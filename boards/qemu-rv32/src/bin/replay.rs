//! The application over a recording; see `beamfix_emulated::replay`.
#![no_std]
#![no_main]

use beamfix_app::{Board, CONFIG};
use beamfix_emulated::{finish, replay, stack::Stack};
use qemu_rv32::clock::Timer;

#[riscv_rt::entry]
fn main() -> ! {
    static mut APP: Board = Board::new(CONFIG);
    let app = &raw mut APP;
    // SAFETY: only the start-up code calls `main`, once.
    let app = unsafe { &mut *app };
    finish(replay::run(app, &mut Timer::default(), &Stack::paint()))
}
