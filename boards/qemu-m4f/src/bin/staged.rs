//! Pairs of scans, matched by the default choice of every stage and counted; see `beamfix_emulated::bench`.
#![no_std]
#![no_main]

use beamfix_emulated::{bench::Bench, finish, stack::Stack};
use beamfix_selftest::pairs::Staged;
use qemu_m4f::clock::Timer;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut BENCH: Bench<360, Staged<360>> = Bench::new(Staged::new());
    finish(BENCH.run(&mut Timer, &Stack::paint()))
}
