//! Everything that matches against maps, for `prove-no-panic`; see `beamfix_emulated::maps`.
#![no_std]
#![no_main]

use beamfix_emulated::maps::Maps;
use qemu_m0 as _;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut MAPS: Maps = Maps::new();
    MAPS.forever()
}
