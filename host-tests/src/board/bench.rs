//! Pairs of scans on an emulated board, or here: poses and instructions.

use anyhow::{Result, ensure};
use beamfix::{
    geometry::Pose,
    scan::{Beam, Scan},
};
use beamfix_app::pairs::Pairs;

use super::{
    Board,
    emulator::{self, Count},
};
use crate::readers::pairs;

/// Most beams of a scan: what the smallest board has room for.
pub const BEAMS: usize = 360;

/// What became of a pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// The pose found, or the guess where there is none.
    pub pose: Pose,
    /// Whether there is one.
    pub found: bool,
    /// Instructions from the beams of both scans to a reference and points; 0 here.
    pub prepare: u32,
    /// Instructions of the match; 0 here.
    pub matched: u32,
}

/// Matches all pairs on a board; gives the peak stack (bytes) too.
pub fn on_board(board: &Board, list: &pairs::Pairs) -> Result<(Vec<Outcome>, u32)> {
    let elf = board.build("bench")?;
    let output = emulator::run(board, &elf, &input(list)?, Count::Exact)?;
    let mut words = output
        .chunks_exact(4)
        .map(|word| word.try_into().expect("four bytes"));
    let (words, stack) = {
        let words: Vec<[u8; 4]> = words.by_ref().collect();
        let (stack, words) = words
            .split_last()
            .map_or(([0; 4], Vec::new()), |(last, rest)| (*last, rest.to_vec()));
        (words, u32::from_le_bytes(stack))
    };
    ensure!(
        words.len() == 6 * list.pairs.len(),
        "{}: {} words came back for {} pairs",
        board.name,
        words.len(),
        list.pairs.len()
    );
    let outcomes = words
        .chunks_exact(6)
        .map(|outcome| {
            let [x, y, theta] = [1, 2, 3].map(|k| f32::from_le_bytes(outcome[k]));
            Outcome {
                pose: Pose { x, y, theta },
                found: outcome[0] != [0; 4],
                prepare: u32::from_le_bytes(outcome[4]),
                matched: u32::from_le_bytes(outcome[5]),
            }
        })
        .collect();
    Ok((outcomes, stack))
}

/// The same, here.
#[must_use]
pub fn on_host(list: &pairs::Pairs) -> Vec<Outcome> {
    let mut pairs = Box::new(Pairs::<BEAMS>::new());
    let mut scan = Box::new(Scan::<BEAMS>::new());
    list.pairs
        .iter()
        .map(|pair| {
            fill(&mut scan, &list.scans[pair.reference]);
            pairs.set_reference(&scan);
            fill(&mut scan, &list.scans[pair.current]);
            pairs.set_current(&scan);
            let found = pairs.align(pair.guess);
            Outcome {
                pose: found.map_or(pair.guess, |found| found.pose),
                found: found.is_ok(),
                prepare: 0,
                matched: 0,
            }
        })
        .collect()
}

fn fill(scan: &mut Scan<BEAMS>, beams: &[Beam]) {
    scan.clear();
    for &beam in beams {
        let _ = scan.push(beam);
    }
}

/// The list as the board's program reads it: `boards/emulated/src/bench.rs`.
fn input(list: &pairs::Pairs) -> Result<Vec<u8>> {
    let beams = list.scans.iter().map(Vec::len).max().unwrap_or(0);
    ensure!(
        beams <= BEAMS && list.scans.iter().all(|scan| scan.len() == beams),
        "a board takes scans of the same number of beams, at most {BEAMS}; here are up to {beams}"
    );
    let mut bytes = Vec::from((beams as u32).to_le_bytes());
    for pair in &list.pairs {
        let Pose { x, y, theta } = pair.guess;
        bytes.extend([x, y, theta].into_iter().flat_map(f32::to_le_bytes));
        for scan in [pair.reference, pair.current] {
            for beam in &list.scans[scan] {
                bytes.extend(beam.bearing.0.to_le_bytes());
                bytes.extend(beam.range.mm().unwrap_or(0).to_le_bytes());
            }
        }
    }
    Ok(bytes)
}
