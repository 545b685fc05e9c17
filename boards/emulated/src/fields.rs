//! One scan against a likelihood field, counted.
//!
//! `input.bin`, little endian: the field as `beamfix::sensor_model::likelihood_field::stored` has it, padded to
//! [`FIELD`] bytes; the pose `f32 x, y, theta`; `u32` beams, then for each `u16` bearing (1/65536 turn), `u16` range (mm).
//! `output.bin`, `u32` each: sum of the score, its instructions; sum of four places of the search's inner loop, its
//! instructions; the poses of Newton's method and of the search as three
//! `f32` each, with the instructions, the passes over the beams or the bytes looked up; at the end the peak stack (bytes).

use beamfix::{
    geometry::Pose,
    matching::{
        correlative::{CorrelativeConfig, Correlator, pyramid::Pyramid, sum_four},
        field::{self, FieldConfig},
    },
    scan::{Bearing, ScanPoint},
    sensor_model::likelihood_field::{Field as _, stored},
};
use semihosting::{
    fs::File,
    io::{self, Write as _},
};

use crate::{INPUT, Machine, OUTPUT, bench::pose_from, read_full, stack::Stack};

/// Bytes of the field: 64 by 64 cells fit.
pub const FIELD: usize = stored::HEADER + 64 * 64;
/// Most beams.
pub const BEAMS: usize = 360;

/// How the search is configured: every board and the host alike.
pub const SEARCH: CorrelativeConfig = CorrelativeConfig {
    position_range: 0.7,
    heading_range: 0.2094,
    ..CorrelativeConfig::DEFAULT
};

/// How Newton's method is: all beams in each pass, so that passes can be counted.
pub const NEWTON: FieldConfig = FieldConfig {
    coarse_stride: 1,
    ..FieldConfig::DEFAULT
};

/// The memory that it needs.
pub struct Fields {
    field: [u8; FIELD],
    pyramid: [u8; 400],
    points: heapless::Vec<ScanPoint, BEAMS>,
    correlator: Correlator<96>,
    indices: heapless::Vec<u32, BEAMS>,
}

impl Fields {
    /// Nothing read yet.
    #[allow(clippy::new_without_default, reason = "for statics")]
    pub const fn new() -> Self {
        Self {
            field: [0; FIELD],
            pyramid: [0; 400],
            points: heapless::Vec::new(),
            correlator: Correlator::new(),
            indices: heapless::Vec::new(),
        }
    }

    /// Matches the scan of `input.bin`.
    pub fn run(&mut self, machine: &mut impl Machine, stack: &Stack) -> io::Result<()> {
        let mut input = File::open(INPUT)?;
        let mut output = File::create(OUTPUT)?;
        read_full(&mut input, &mut self.field)?;
        let mut pose = [0; 12];
        read_full(&mut input, &mut pose)?;
        let pose = pose_from(&pose);
        let mut word = [0; 4];
        read_full(&mut input, &mut word)?;
        for _ in 0..u32::from_le_bytes(word) {
            let mut beam = [0; 4];
            read_full(&mut input, &mut beam)?;
            let [b0, b1, r0, r1] = beam;
            let point = ScanPoint::at(
                Bearing(u16::from_le_bytes([b0, b1])),
                u16::from_le_bytes([r0, r1]),
            );
            let _ = self.points.push(point);
        }
        // The host looks that they are a field.
        let mut out = |words: &[u32]| {
            words
                .iter()
                .try_for_each(|word| output.write_all(&word.to_le_bytes()))
        };
        let cells = stored_len(&self.field);
        if let Ok(field) = stored::parse(self.field.get(..cells).unwrap_or(&[])) {
            machine.restart();
            let score = field.score(&self.points, pose);
            out(&[score.sum, machine.instructions()])?;
            self.indices.clear();
            for point in &self.points {
                let _ = self.indices.push(u32::from(point.bearing().0) * 3000 >> 16);
            }
            machine.restart();
            let sums = sum_four(field.grid().cells(), &self.indices);
            out(&[sums.iter().sum(), machine.instructions()])?;
            machine.restart();
            let found = field::align(&field, &self.points, pose, &NEWTON);
            let instructions = machine.instructions();
            out(&bits(found.map(|found| found.pose)))?;
            out(&[
                instructions,
                found.map_or(0, |found| found.iterations.into()),
            ])?;
            if let Ok(pyramid) = Pyramid::new(field, &mut self.pyramid) {
                machine.restart();
                let found = self
                    .correlator
                    .align(&pyramid.local(), &self.points, pose, &SEARCH);
                let instructions = machine.instructions();
                out(&bits(found.map(|found| found.pose)))?;
                out(&[instructions, self.correlator.lookups() as u32])?;
            }
        }
        out(&[stack.peak()])
    }
}

/// Header and cells, without the padding.
fn stored_len(bytes: &[u8]) -> usize {
    let side = |at: usize| match bytes.get(at..at + 2) {
        Some(&[low, high]) => usize::from(u16::from_le_bytes([low, high])),
        _ => 0,
    };
    stored::HEADER + side(6) * side(8)
}

fn bits<E>(pose: Result<Pose, E>) -> [u32; 3] {
    pose.map_or([0; 3], |pose| {
        [pose.x, pose.y, pose.theta].map(f32::to_bits)
    })
}
