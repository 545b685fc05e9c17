//! Finding oneself in a known map, counted; see `beamfix_emulated::start`.
#![no_std]
#![no_main]

use beamfix_emulated::{finish, stack::Stack, start::Start};
use qemu_m4f::clock::Timer;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut START: Start = Start::new();
    finish(START.run(&mut Timer, &Stack::paint()))
}
