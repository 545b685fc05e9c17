//! The application over a recording; see `beamfix_emulated::replay`.
#![no_std]
#![no_main]

use beamfix_app::{CONFIG, SmallBoard};
use beamfix_emulated::{finish, replay, stack::Stack};
use qemu_m0::clock::Timer;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut APP: SmallBoard = SmallBoard::new(CONFIG);
    finish(replay::run(APP, &mut Timer, &Stack::paint()))
}
