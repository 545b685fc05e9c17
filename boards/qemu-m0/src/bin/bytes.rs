//! What a byte of the lidar costs besides matches; see `beamfix_emulated::bytes`.
#![no_std]
#![no_main]

use beamfix_app::ring::Ring;
use beamfix_emulated::bytes::{self, App};
// Its critical sections.
use cortex_m as _;
use qemu_m0::clock::Timer;

static LIDAR: Ring<256> = Ring::new();
static COMMANDS: Ring<32> = Ring::new();

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut APP: App = bytes::new();
    bytes::forever(APP, (&LIDAR, &COMMANDS), Timer)
}
