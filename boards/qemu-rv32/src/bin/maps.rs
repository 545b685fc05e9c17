//! Everything that matches against maps, for `prove-no-panic`; see `beamfix_emulated::maps`.
#![no_std]
#![no_main]

use beamfix_emulated::maps::Maps;
use qemu_rv32 as _;

#[riscv_rt::entry]
fn main() -> ! {
    static mut MAPS: Maps = Maps::new();
    let maps = &raw mut MAPS;
    // SAFETY: only the start-up code calls `main`, once.
    let maps = unsafe { &mut *maps };
    maps.forever()
}
