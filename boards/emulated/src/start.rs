//! Finding oneself in a known map, counted.
//!
//! `input.bin`, little endian: `u32` bytes of the field and then these, as `beamfix::sensor_model::likelihood_field::stored`
//! has it; `u32` budget of a step; then the scans, each `f32 x, y, theta` moved since the one before and `u32` beams,
//! for each `u16` bearing (1/65536 turn), `u16` range (mm).
//! `output.bin`, `u32` each: for every scan, up to the first after which the pose is known, whether it is, the pose as three
//! `f32`, the instructions of `update`, the calls of `step`, the instructions of the longest and of all. At the end the
//! bytes looked up, the bytes of the localizer and of the pyramid, the peak stack (bytes); then of a particle filter that
//! starts at the found pose with the last scan, by the proposal from the motion and by the improved one, the instructions
//! and the pose as three `f32`; and its bytes.

use core::mem::size_of;

use beamfix::{
    geometry::Pose,
    localization::{
        Localizer, LocalizerConfig,
        particles::{Motion, ParticleConfig, ParticleFilter, Proposal},
    },
    matching::correlative::pyramid::Pyramid,
    scan::{Bearing, ScanPoint},
    sensor_model::likelihood_field::{Field as _, LikelihoodField, stored},
};
use semihosting::{
    fs::File,
    io::{self, Write as _},
};

use crate::{INPUT, Machine, OUTPUT, bench::pose_from, read_full, stack::Stack};

/// Most bytes of the field: a flat of 20 m by 16 m in cells of 5 cm.
pub const FIELD: usize = stored::HEADER + 400 * 320;
/// Points of a scan that the localizer keeps.
pub const POINTS: usize = 96;
/// Particles.
pub const PARTICLES: usize = 16;
/// Most beams of a scan.
pub const BEAMS: usize = 450;
/// Most bytes of the pyramid.
const PYRAMID: usize = 9000;

/// The memory that it needs.
pub struct Start {
    field: [u8; FIELD],
    pyramid: [u8; PYRAMID],
    points: heapless::Vec<ScanPoint, BEAMS>,
}

impl Start {
    /// Nothing read yet.
    #[allow(clippy::new_without_default, reason = "for statics")]
    pub const fn new() -> Self {
        Self {
            field: [0; FIELD],
            pyramid: [0; PYRAMID],
            points: heapless::Vec::new(),
        }
    }

    /// Finds the pose of `input.bin`'s scans.
    pub fn run(&mut self, machine: &mut impl Machine, stack: &Stack) -> io::Result<()> {
        let mut input = File::open(INPUT)?;
        let mut output = File::create(OUTPUT)?;
        let bytes = (read_word(&mut input)? as usize).min(FIELD);
        let field = self.field.get_mut(..bytes).unwrap_or_default();
        read_full(&mut input, field)?;
        let budget = read_word(&mut input)?;
        let mut out = |words: &[u32]| {
            words
                .iter()
                .try_for_each(|word| output.write_all(&word.to_le_bytes()))
        };
        // The host looks that it is a field.
        let Ok(field) = stored::parse(field) else {
            return Ok(());
        };
        let pyramid_bytes = Pyramid::bytes(field.shape());
        let Ok(pyramid) = Pyramid::new(field, &mut self.pyramid) else {
            return Ok(());
        };
        let mut robot = Localizer::<POINTS>::new(pyramid, LocalizerConfig::DEFAULT);
        let mut motion = [0; 12];
        while robot.pose().is_none() && read_full(&mut input, &mut motion)? {
            read_points(&mut input, &mut self.points)?;
            machine.restart();
            robot.update(&self.points, pose_from(&motion));
            let update = machine.instructions();
            let (mut steps, mut longest, mut all) = (0u32, 0u32, 0u32);
            loop {
                machine.restart();
                let done = robot.step(budget);
                let step = machine.instructions();
                (steps, longest) = (steps + 1, longest.max(step));
                all = all.wrapping_add(step);
                if done {
                    break;
                }
            }
            let pose = robot.pose().unwrap_or(Pose::IDENTITY);
            let [x, y, theta] = [pose.x, pose.y, pose.theta].map(f32::to_bits);
            let known = u32::from(robot.pose().is_some());
            out(&[known, x, y, theta, update, steps, longest, all])?;
        }
        out(&[
            robot.counters().lookups as u32,
            size_of::<Localizer<'static, POINTS>>() as u32,
            pyramid_bytes as u32,
            stack.peak(),
        ])?;
        let pose = robot.pose().unwrap_or(Pose::IDENTITY);
        for proposal in [Proposal::Motion, Proposal::Improved] {
            out(&weighed(machine, field, &self.points, pose, proposal))?;
        }
        out(&[size_of::<ParticleFilter<'static, PARTICLES, POINTS>>() as u32])
    }
}

/// Instructions of a scan that particles around a pose are weighed with, and their mean. On its own: its memory is not part
/// of the search's stack.
#[inline(never)]
fn weighed(
    machine: &mut impl Machine,
    field: LikelihoodField<&[u8]>,
    points: &[ScanPoint],
    pose: Pose,
    proposal: Proposal,
) -> [u32; 4] {
    let config = ParticleConfig {
        proposal,
        ..ParticleConfig::DEFAULT
    };
    let mut filter = ParticleFilter::<PARTICLES, POINTS>::new(field, config);
    filter.start_at(pose, (0.05, 0.05));
    filter.moved(&Motion::by_wheels(Pose::new(0.0, 0.0, 0.05), 0.2));
    machine.restart();
    let belief = filter.update(points);
    let instructions = machine.instructions();
    let [x, y, theta] = [belief.pose.x, belief.pose.y, belief.pose.theta].map(f32::to_bits);
    [instructions, x, y, theta]
}

fn read_word(input: &mut File) -> io::Result<u32> {
    let mut word = [0; 4];
    read_full(input, &mut word)?;
    Ok(u32::from_le_bytes(word))
}

fn read_points(input: &mut File, points: &mut heapless::Vec<ScanPoint, BEAMS>) -> io::Result<()> {
    points.clear();
    for _ in 0..read_word(input)? {
        let mut beam = [0; 4];
        read_full(input, &mut beam)?;
        let [b0, b1, r0, r1] = beam;
        let bearing = Bearing(u16::from_le_bytes([b0, b1]));
        let _ = points.push(ScanPoint::at(bearing, u16::from_le_bytes([r0, r1])));
    }
    Ok(())
}
