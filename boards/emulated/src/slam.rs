//! Mapping over recorded scans, counted.
//!
//! `input.bin`, little endian: for every scan `u16` beams, `u16` 1 where the wheels tell something, their pose as three
//! `f32`, `u32` time of the scan's end (µs), then its beams as `beamfix_app::command::beam_bytes` has them.
//! `output.bin`, `u32` each: for every scan the pose in the map as three `f32`, the instructions of the update (the beams
//! read from the file among them) and of the slice of work after it. Then the work that is left is done, and each keyframe follows: its number, its pose, 0.
//! At the end the longest piece of work, the bytes of the tier's statics, the peak stack, 0, 0.

use beamfix::{
    geometry::Pose,
    pipeline::{Estimate as _, Estimator, Mapper, RollingMapper, Tracker},
    scan::Beam,
    slam::SLICE,
};
use beamfix_app::command;
use semihosting::{
    fs::File,
    io::{self, Write as _},
};

use crate::{INPUT, Machine, OUTPUT, bench::pose_from, read_full, stack::Stack};

/// Beams read at a time.
const CHUNK: usize = 8;

/// An estimator that maps, whose keyframes may move.
pub trait Maps<const N: usize>: Estimator<N> {
    /// The keyframes at the end: number and pose.
    fn keyframes(&self) -> impl Iterator<Item = (u32, Pose)>;
}

impl<const N: usize, const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>
    Maps<N> for Mapper<N, K, E, L, B, V>
{
    fn keyframes(&self) -> impl Iterator<Item = (u32, Pose)> {
        let keyframes = self.slam().keyframes();
        keyframes.map(|(number, _, pose)| (number, pose))
    }
}

impl<const N: usize, const K: usize, const B: usize, const V: usize> Maps<N>
    for RollingMapper<N, K, B, V>
{
    /// They stay where they were first.
    fn keyframes(&self) -> impl Iterator<Item = (u32, Pose)> {
        core::iter::empty()
    }
}

/// Maps what `input.bin` tells.
pub fn run<M: Maps<N>, const N: usize>(
    tracker: &mut Tracker<M, N>,
    machine: &mut impl Machine,
    stack: &Stack,
) -> io::Result<()> {
    let mut input = File::open(INPUT)?;
    let mut output = File::create(OUTPUT)?;
    let (mut longest, mut pose) = (0, [0; 3]);
    let mut head = [0; 20];
    while read_full(&mut input, &mut head)? {
        let [b0, b1, w0, w1, rest @ ..] = head;
        let [wheels @ .., t0, t1, t2, t3] = rest;
        if u16::from_le_bytes([w0, w1]) == 1 {
            let end_us = u32::from_le_bytes([t0, t1, t2, t3]);
            tracker.push_wheels(end_us, pose_from(&wheels));
        }
        let beams = Beams {
            file: &mut input,
            left: u16::from_le_bytes([b0, b1]).into(),
            chunk: [0; 9 * CHUNK],
            at: 9 * CHUNK,
        };
        machine.restart();
        tracker.push_scan(beams, |revolution| {
            // Where the robot was carried the last pose stays, as on the host.
            if let Some(found) = revolution.step.pose() {
                pose = [found.x, found.y, found.theta].map(f32::to_bits);
            }
        });
        let update = machine.instructions();
        machine.restart();
        tracker.estimator_mut().work(SLICE);
        let work = machine.instructions();
        longest = work.max(longest);
        let [x, y, theta] = pose;
        write(&mut output, [x, y, theta, update, work])?;
    }
    let mapper = tracker.estimator_mut();
    loop {
        machine.restart();
        let done = mapper.work(SLICE);
        longest = machine.instructions().max(longest);
        if done {
            break;
        }
    }
    for (number, pose) in mapper.keyframes() {
        let [x, y, theta] = [pose.x, pose.y, pose.theta].map(f32::to_bits);
        write(&mut output, [number, x, y, theta, 0])?;
    }
    let bytes = size_of::<Tracker<M, N>>() as u32;
    write(&mut output, [longest, bytes, stack.peak(), 0, 0])
}

/// Apart, so that its memory is not on the stack during a match.
#[inline(never)]
fn write(output: &mut File, words: [u32; 5]) -> io::Result<()> {
    let mut bytes = [0; 20];
    for (bytes, word) in bytes.chunks_exact_mut(4).zip(words) {
        bytes.copy_from_slice(&word.to_le_bytes());
    }
    output.write_all(&bytes)
}

/// The beams of a scan, read as they are asked for.
struct Beams<'a> {
    file: &'a mut File,
    left: usize,
    chunk: [u8; 9 * CHUNK],
    at: usize,
}

impl Iterator for Beams<'_> {
    type Item = Beam;

    fn next(&mut self) -> Option<Beam> {
        if self.left == 0 {
            return None;
        }
        if self.at >= self.chunk.len() {
            let bytes = 9 * self.left.min(CHUNK);
            // A file that ends here gives beams without range: the host looks that it is whole.
            read_full(self.file, self.chunk.get_mut(..bytes)?).ok()?;
            self.at = 0;
        }
        let bytes = self.chunk.get(self.at..)?.get(..9)?;
        self.at += 9;
        self.left -= 1;
        command::beams(bytes).next()
    }
}
