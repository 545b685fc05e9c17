//! Counting instructions: QEMU with `-icount shift=0,sleep=off` keeps `minstret`.

use beamfix_emulated::Machine;

/// The count of retired instructions, its lower half: 4 G before it wraps.
#[derive(Default)]
pub struct Timer {
    start: u32,
}

impl Machine for Timer {
    fn restart(&mut self) {
        self.start = riscv::register::minstret::read() as u32;
    }

    fn instructions(&self) -> u32 {
        (riscv::register::minstret::read() as u32).wrapping_sub(self.start)
    }
}
