//! The board alone, without a lidar; see `beamfix_emulated::demo`.
#![no_std]
#![no_main]

use beamfix_app::Board;
use beamfix_emulated::{demo, finish};
// The machine's memory and start.
use qemu_rv32 as _;

#[riscv_rt::entry]
fn main() -> ! {
    static mut APP: Board = Board::new(demo::TEXT);
    let app = &raw mut APP;
    // SAFETY: only the start-up code calls `main`, once.
    finish(demo::run(unsafe { &mut *app }))
}
