//! Counting instructions: exact in QEMU with `-icount shift=6,sleep=off`, where each takes 64 ns of its time.

use beamfix_emulated::Machine;

/// The CMSDK dual timer: 32 bits, 40 ns a tick, so 2.6 G instructions before it wraps.
pub struct Timer;

const BASE: *mut u32 = core::ptr::without_provenance_mut(0x4000_2000);
const LOAD: usize = 0;
const VALUE: usize = 1;
const CONTROL: usize = 2;
/// Enabled, free-running, 32 bits, not divided.
const RUN: u32 = 0x82;

impl Timer {
    /// Since [`Machine::restart`], 40 ns each; wraps.
    pub fn ticks(&self) -> u32 {
        // SAFETY: registers of the timer, which nothing else uses.
        u32::MAX - unsafe { BASE.wrapping_add(VALUE).read_volatile() }
    }
}

impl Machine for Timer {
    fn restart(&mut self) {
        // SAFETY: registers of the timer, which nothing else uses.
        unsafe {
            BASE.wrapping_add(CONTROL).write_volatile(0);
            BASE.wrapping_add(LOAD).write_volatile(u32::MAX);
            BASE.wrapping_add(CONTROL).write_volatile(RUN);
        }
    }

    fn instructions(&self) -> u32 {
        (u64::from(self.ticks()) * 40 / 64) as u32
    }
}
