//! The board alone, without a lidar; see `beamfix_emulated::demo`.
#![no_std]
#![no_main]

use beamfix_app::{Board, Place};
use beamfix_emulated::{demo, finish};
// The machine's memory and start.
use qemu_m4f as _;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut APP: Place<Board> = Place::EMPTY;
    finish(demo::run(APP.app(&demo::TEXT)))
}
