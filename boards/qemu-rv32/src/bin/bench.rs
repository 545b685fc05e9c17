//! Pairs of scans, matched and counted; see `beamfix_emulated::bench`.
#![no_std]
#![no_main]

use beamfix_emulated::{bench::Bench, finish, stack::Stack};
use beamfix_selftest::pairs::Pairs;
use qemu_rv32::clock::Timer;

#[riscv_rt::entry]
fn main() -> ! {
    static mut BENCH: Bench<360, Pairs<360>> = Bench::new(Pairs::new());
    let bench = &raw mut BENCH;
    // SAFETY: only the start-up code calls `main`, once.
    let bench = unsafe { &mut *bench };
    finish(bench.run(&mut Timer::default(), &Stack::paint()))
}
