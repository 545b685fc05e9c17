//! Counting instructions: in QEMU with `-icount shift=6,sleep=off` each takes 64 ns, and SysTick ticks at 16 MHz.

use beamfix_emulated::Machine;

/// SysTick: 24 bits, so 16 M instructions before it wraps.
pub struct Timer;

const BASE: *mut u32 = core::ptr::without_provenance_mut(0xe000_e010);
const CONTROL: usize = 0;
const RELOAD: usize = 1;
const VALUE: usize = 2;
const LONGEST: u32 = 0x00ff_ffff;

impl Machine for Timer {
    fn restart(&mut self) {
        // SAFETY: registers of SysTick, which nothing else uses.
        unsafe {
            BASE.add(CONTROL).write_volatile(0);
            BASE.add(RELOAD).write_volatile(LONGEST);
            BASE.add(VALUE).write_volatile(0);
            // Runs from the core's clock, without an interrupt.
            BASE.add(CONTROL).write_volatile(5);
        }
    }

    fn instructions(&self) -> u32 {
        // SAFETY: as above.
        let ticks = LONGEST - (unsafe { BASE.add(VALUE).read_volatile() } & LONGEST);
        // 64 ns an instruction, 62.5 ns a tick.
        (u64::from(ticks) * 125 / 128) as u32
    }
}
