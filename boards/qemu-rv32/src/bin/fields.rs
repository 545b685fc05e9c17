//! A scan against a likelihood field, counted; see `beamfix_emulated::fields`.
#![no_std]
#![no_main]

use beamfix_emulated::{fields::Fields, finish, stack::Stack};
use qemu_rv32::clock::Timer;

#[riscv_rt::entry]
fn main() -> ! {
    static mut FIELDS: Fields = Fields::new();
    let fields = &raw mut FIELDS;
    // SAFETY: only the start-up code calls `main`, once.
    let fields = unsafe { &mut *fields };
    finish(fields.run(&mut Timer::default(), &Stack::paint()))
}
