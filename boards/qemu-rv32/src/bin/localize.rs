//! The application in a map in flash; see `beamfix_emulated::localize`.
#![no_std]
#![no_main]

use beamfix_emulated::{finish, localize::Localize};
use qemu_rv32 as _;

/// What `BEAMFIX_FIELD` named when this was built.
static TABLE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/field.bin"));

#[riscv_rt::entry]
fn main() -> ! {
    static mut LOCALIZE: Localize = Localize::new();
    let localize = &raw mut LOCALIZE;
    // SAFETY: only the start-up code calls `main`, once.
    let localize = unsafe { &mut *localize };
    finish(localize.run(TABLE))
}
