//! The board alone, without a lidar; see `beamfix_emulated::demo`.
#![no_std]
#![no_main]

use beamfix_app::{Board, Place};
use beamfix_emulated::{demo, finish};
// The machine's memory and start.
use qemu_rv32 as _;

#[riscv_rt::entry]
fn main() -> ! {
    static mut APP: Place<Board> = Place::EMPTY;
    let app = &raw mut APP;
    // SAFETY: only the start-up code calls `main`, once.
    let app = unsafe { &mut *app }.app(&demo::TEXT);
    finish(demo::run(app))
}
