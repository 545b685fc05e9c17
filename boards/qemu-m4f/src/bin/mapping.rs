//! Everything that maps, for `prove-no-panic`; see `beamfix_emulated::mapping`.
#![no_std]
#![no_main]

use beamfix_emulated::mapping::Mapping;
use qemu_m4f as _;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut MAPPING: Mapping = Mapping::new();
    MAPPING.forever()
}
