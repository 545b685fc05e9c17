//! The application in a map in flash; see `beamfix_emulated::localize`.
#![no_std]
#![no_main]

use beamfix_emulated::{finish, localize::Localize};
use qemu_m4f as _;

/// What `BEAMFIX_FIELD` named when this was built.
static TABLE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/field.bin"));

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut LOCALIZE: Localize = Localize::new();
    finish(LOCALIZE.run(TABLE))
}
