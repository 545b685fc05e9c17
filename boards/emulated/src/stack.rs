//! How deep the stack has been: it is painted at the start and looked at later.

const PAINT: u32 = 0xc5c5_c5c5;

/// The unused part of the stack.
pub struct Stack {
    bottom: *mut u32,
    top: *mut u32,
}

impl Stack {
    /// Paints the memory from `bottom` to just below the frame of the caller. `top` is where the stack begins.
    ///
    /// # Safety
    /// Nothing else may use the memory between `bottom` and the stack pointer, and both must be aligned to 4.
    #[inline(never)]
    pub unsafe fn paint(bottom: *mut u32, top: *mut u32) -> Self {
        let here = 0u32;
        // Room for this function's own frame and what it calls.
        let end = (&raw const here).cast_mut().wrapping_sub(32);
        let mut word = bottom;
        while word < end {
            unsafe { word.write_volatile(PAINT) };
            word = word.wrapping_add(1);
        }
        Self { bottom, top }
    }

    /// Deepest stack since the painting (bytes).
    pub fn peak(&self) -> u32 {
        let mut word = self.bottom;
        while word < self.top && unsafe { word.read_volatile() } == PAINT {
            word = word.wrapping_add(1);
        }
        (self.top as usize - word as usize) as u32
    }
}
