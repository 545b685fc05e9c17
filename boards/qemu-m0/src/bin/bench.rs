//! Pairs of scans, matched and counted; see `beamfix_emulated::bench`.
#![no_std]
#![no_main]

use beamfix_emulated::{bench::Bench, finish, stack::Stack};
use beamfix_selftest::pairs::Pairs;
use qemu_m0::clock::Timer;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut BENCH: Bench<360, Pairs<360>> = Bench::new(Pairs::new());
    finish(BENCH.run(&mut Timer, &Stack::paint()))
}
