//! The library alone over bytes of a lidar; see `beamfix_emulated::pipeline`.
#![no_std]
#![no_main]

use beamfix_emulated::{
    finish,
    pipeline::{self, Robot},
};
use qemu_m0 as _;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut ROBOT: Robot = pipeline::new();
    finish(pipeline::run(ROBOT))
}
