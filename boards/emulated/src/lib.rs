//! Programs for emulated boards that read a file and write a file through semihosting, and count instructions.
//!
//! Both files lie in the directory in which the emulator was started. The same programs run on every machine;
//! a [`Machine`] is what they differ in.
#![no_std]

pub mod bench;
pub mod bytes;
#[cfg(feature = "demo")]
pub mod demo;
pub mod drivers;
pub mod fields;
pub mod localize;
pub mod mapping;
pub mod maps;
mod panic;
pub mod pipeline;
pub mod replay;
pub mod slam;
pub mod stack;
pub mod stages;
pub mod start;

use semihosting::{fs::File, io, io::Read as _};

/// What the programs read.
pub const INPUT: &core::ffi::CStr = c"input.bin";
/// What they write.
pub const OUTPUT: &core::ffi::CStr = c"output.bin";

/// A counter of executed instructions.
pub trait Machine {
    /// Starts to count from 0. Always in the same phase of the counter, so that the same code gives the same count.
    fn restart(&mut self);

    /// Instructions executed since [`Machine::restart`].
    fn instructions(&self) -> u32;
}

/// Leaves the emulator: status 0, or 1 after a line that says what failed.
pub fn finish(result: io::Result<()>) -> ! {
    match result {
        Ok(()) => semihosting::process::exit(0),
        Err(error) => {
            semihosting::eprintln!("input.bin or output.bin: {error:?}");
            semihosting::process::exit(1)
        }
    }
}

/// Fills `buffer`; `false` at the end of the file.
fn read_full(file: &mut File, buffer: &mut [u8]) -> io::Result<bool> {
    let mut filled = 0;
    while let Some(rest) = buffer.get_mut(filled..).filter(|rest| !rest.is_empty()) {
        let n = file.read(rest)?;
        if n == 0 {
            return Ok(false);
        }
        filled += n;
    }
    Ok(true)
}
