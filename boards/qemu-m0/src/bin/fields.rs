//! A scan against a likelihood field, counted; see `beamfix_emulated::fields`.
#![no_std]
#![no_main]

use beamfix_emulated::{fields::Fields, finish, stack::Stack};
use qemu_m0::clock::Timer;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut FIELDS: Fields = Fields::new();
    finish(FIELDS.run(&mut Timer, &Stack::paint()))
}
