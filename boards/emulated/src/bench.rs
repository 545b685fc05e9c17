//! Pairs of scans, matched and counted.
//!
//! `input.bin`, little endian: `u32` beams of a scan, then per pair the guess `f32 x, y, theta` and twice, for the
//! reference and the current scan, for every beam `u16` bearing (1/65536 turn), `u16` range (mm, 0 for none).
//! `output.bin`: per pair `u32` whether there is a pose, `f32 x, y, theta`, `u32` instructions of the preparation and
//! of the match; at the end `u32` peak stack (bytes).

use beamfix::{
    geometry::Pose,
    scan::{Beam, Bearing, Range, Scan},
};
use beamfix_selftest::pairs::Matcher;
use semihosting::{
    fs::File,
    io::{self, Write as _},
};

use crate::{INPUT, Machine, OUTPUT, read_full, stack::Stack};

/// The memory that a bench needs.
pub struct Bench<const N: usize, M> {
    scan: Scan<N>,
    matcher: M,
}

impl<const N: usize, M> Bench<N, M> {
    /// Nothing read yet.
    pub const fn new(matcher: M) -> Self {
        Self {
            scan: Scan::new(),
            matcher,
        }
    }
}

impl<const N: usize, M: Matcher<N>> Bench<N, M> {
    /// Matches all pairs of `input.bin`.
    pub fn run(&mut self, machine: &mut impl Machine, stack: &Stack) -> io::Result<()> {
        let mut input = File::open(INPUT)?;
        let mut output = File::create(OUTPUT)?;
        let mut word = [0; 4];
        read_full(&mut input, &mut word)?;
        let beams = u32::from_le_bytes(word);
        let mut guess = [0; 12];
        while read_full(&mut input, &mut guess)? {
            self.read_scan(&mut input, beams)?;
            machine.restart();
            self.matcher.set_reference(&self.scan);
            let reference = machine.instructions();
            self.read_scan(&mut input, beams)?;
            machine.restart();
            self.matcher.set_current(&self.scan);
            let prepare = reference + machine.instructions();
            let guess = pose_from(&guess);
            machine.restart();
            let found = self.matcher.align(guess);
            let matched = machine.instructions();
            let pose = found.map_or(guess, |found| found.pose);
            output.write_all(&u32::from(found.is_ok()).to_le_bytes())?;
            for value in [pose.x, pose.y, pose.theta] {
                output.write_all(&value.to_le_bytes())?;
            }
            output.write_all(&prepare.to_le_bytes())?;
            output.write_all(&matched.to_le_bytes())?;
        }
        output.write_all(&stack.peak().to_le_bytes())
    }

    fn read_scan(&mut self, input: &mut File, beams: u32) -> io::Result<()> {
        self.scan.clear();
        for _ in 0..beams {
            let mut beam = [0; 4];
            read_full(input, &mut beam)?;
            let [b0, b1, r0, r1] = beam;
            // The host has looked that they all fit.
            let _ = self.scan.push(Beam {
                bearing: Bearing(u16::from_le_bytes([b0, b1])),
                range: Range::from_mm(u16::from_le_bytes([r0, r1]).into()),
                time_us: 0,
                quality: 0,
            });
        }
        Ok(())
    }
}

pub(crate) fn pose_from(bytes: &[u8; 12]) -> Pose {
    let [x, y, theta] = core::array::from_fn(|k| {
        let word = bytes
            .chunks_exact(4)
            .nth(k)
            .and_then(|word| word.try_into().ok());
        f32::from_le_bytes(word.unwrap_or_default())
    });
    Pose { x, y, theta }
}
