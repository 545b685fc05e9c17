//! Pairs of scans on an emulated board, or here: poses and instructions.

use anyhow::{Result, ensure};
use beamfix::{
    geometry::Pose,
    scan::{Beam, Scan},
};
use beamfix_selftest::pairs::{Matcher, Pairs, Staged};
use serde::{Deserialize, Serialize};

use super::{
    Board,
    card::keep,
    emulator::{self, Count},
};
use crate::formats::pairs::{self, Pair};
use beamfix_sim::{Noise, Still, TruePose, scenes};

/// Every board with every matcher that has room on it.
pub const ALL: [(&str, Which); 4] = [
    ("m4f", Which::Fused),
    ("m0", Which::Fused),
    ("rv32", Which::Fused),
    ("m4f", Which::Staged),
];

/// Most beams of a scan: what the smallest board has room for.
pub const BEAMS: usize = 360;

/// Which matcher.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Which {
    /// The odometry's, in integers.
    Fused,
    /// The one whose stages are choices, each the default one.
    Staged,
}

/// What a pair costs: medians over a list.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Figures {
    /// The board.
    pub board: String,
    /// The matcher.
    pub matcher: Which,
    /// Instructions from the beams of both scans to a reference and points.
    pub prepare: u32,
    /// Instructions of the match.
    pub matched: u32,
    /// Instructions of the dearest match.
    pub matched_max: u32,
    /// Painted peak stack (bytes).
    pub stack_bytes: u32,
}

impl Figures {
    /// Of what [`on_board`] gave.
    #[must_use]
    pub fn new(board: &Board, matcher: Which, outcomes: &[Outcome], stack_bytes: u32) -> Self {
        let sorted = |of: fn(&Outcome) -> u32| {
            let mut values: Vec<u32> = outcomes.iter().map(of).collect();
            values.sort_unstable();
            values
        };
        let (prepare, matched) = (sorted(|o| o.prepare), sorted(|o| o.matched));
        let middle = |values: &[u32]| values.get(values.len() / 2).copied().unwrap_or(0);
        Self {
            board: board.name.into(),
            matcher,
            prepare: middle(&prepare),
            matched: middle(&matched),
            matched_max: matched.last().copied().unwrap_or(0),
            stack_bytes,
        }
    }
}

/// Measures the [`simulated`] pairs everywhere and makes the figures the golden ones: `host-tests/golden/bench.json`.
pub fn bless() -> Result<Vec<Figures>> {
    let list = simulated();
    let mut figures = Vec::new();
    for (name, which) in ALL {
        let board = Board::named(name)?;
        let (outcomes, stack) = on_board(board, &list, which)?;
        figures.push(Figures::new(board, which, &outcomes, stack));
    }
    keep("bench.json", &figures)?;
    Ok(figures)
}

/// Forty pairs of 360 beams in furnished offices, each in one of its own; the guess off by up to 5 cm and 3 degrees.
#[must_use]
pub fn simulated() -> pairs::Pairs {
    let still = Still::full_turn(BEAMS);
    let mut list = pairs::Pairs::default();
    for seed in 0..40 {
        let world = scenes::office(seed);
        let mut noise = Noise::new(seed, 1);
        let place = scenes::office_place(&world, 0.6, &mut noise);
        let mut draw = |most: f64| noise.even(-most, most);
        let truth = TruePose::new(draw(0.1), draw(0.1), draw(0.1));
        let guess = TruePose::new(
            truth.x + draw(0.05),
            truth.y + draw(0.05),
            truth.theta + draw(0.05),
        );
        let reference = list.scans.len();
        for at in [place, place.then(truth)] {
            list.scans.push(still.scan(&world, at, &mut noise));
        }
        list.pairs.push(Pair {
            id: seed as i64,
            level: 1,
            reference,
            current: reference + 1,
            guess: guess.into(),
            truth: truth.into(),
        });
    }
    list
}

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
pub fn on_board(board: &Board, list: &pairs::Pairs, which: Which) -> Result<(Vec<Outcome>, u32)> {
    let program = match which {
        Which::Fused => "bench",
        Which::Staged => "staged",
    };
    ensure!(
        which == Which::Fused || board.name == "m4f",
        "{}: only m4f has the room and the FPU for the staged matcher",
        board.name
    );
    let elf = board.build(program)?;
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
pub fn on_host(list: &pairs::Pairs, which: Which) -> Vec<Outcome> {
    match which {
        Which::Fused => matched(&mut *Box::new(Pairs::<BEAMS>::new()), list),
        Which::Staged => matched(&mut *Box::new(Staged::<BEAMS>::new()), list),
    }
}

fn matched(matcher: &mut impl Matcher<BEAMS>, list: &pairs::Pairs) -> Vec<Outcome> {
    let mut scan = Box::new(Scan::<BEAMS>::new());
    list.pairs
        .iter()
        .map(|pair| {
            fill(&mut scan, &list.scans[pair.reference]);
            matcher.set_reference(&scan);
            fill(&mut scan, &list.scans[pair.current]);
            matcher.set_current(&scan);
            let found = matcher.align(pair.guess);
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
