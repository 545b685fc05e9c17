//! How deep the stack has been: it is painted at the start and looked at later.

const PAINT: u32 = 0xc5c5_c5c5;

/// The unused part of the stack.
pub struct Stack {
    bottom: *mut u32,
    top: *mut u32,
}

impl Stack {
    /// Paints what is not used yet. Once, at the start.
    #[inline(never)]
    pub fn paint() -> Self {
        // cortex-m-rt and riscv-rt name them alike: the end of the statics, and where the stack begins. Nothing uses
        // a heap.
        unsafe extern "C" {
            static mut __sheap: u32;
            static mut _stack_start: u32;
        }
        let bottom = &raw mut __sheap;
        let here = 0u32;
        // Room for this function's own frame.
        let end = (&raw const here).cast_mut().wrapping_sub(32);
        let mut word = bottom;
        while word < end {
            // SAFETY: between the statics and the stack nothing lives.
            unsafe { word.write_volatile(PAINT) };
            word = word.wrapping_add(1);
        }
        Self {
            bottom,
            top: &raw mut _stack_start,
        }
    }

    /// Deepest stack since the painting (bytes).
    pub fn peak(&self) -> u32 {
        let mut word = self.bottom;
        // SAFETY: this memory is only ever written by the stack.
        while word < self.top && unsafe { word.read_volatile() } == PAINT {
            word = word.wrapping_add(1);
        }
        (self.top as usize - word as usize) as u32
    }
}
