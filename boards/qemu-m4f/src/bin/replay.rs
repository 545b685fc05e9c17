//! The application over a recording; see `beamfix_emulated::replay`.
#![no_std]
#![no_main]

use beamfix_app::{Board, CONFIG};
use beamfix_emulated::{finish, replay, stack::Stack};
use qemu_m4f::clock::Timer;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut APP: Board = Board::new(CONFIG);
    finish(replay::run(APP, &mut Timer, &Stack::paint()))
}
