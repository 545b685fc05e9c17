//! `bench`: pairs of scans on an emulated board, with the instructions that they take.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Result, ensure};
use host_tests::board::{
    Board,
    bench::{self, Outcome, Which},
};
use host_tests::formats::pairs::{self, Pair};
use host_tests::report::hash::PoseHash;
use serde_json::json;

use super::output;

/// Match pairs of scans on an emulated board and count the instructions exactly.
///
/// Exit status 1 where the board's poses differ from those found here.
#[derive(clap::Args)]
pub struct Args {
    /// m4f, m0 or rv32.
    #[arg(long, value_name = "NAME", default_value = "m4f")]
    board: String,
    /// The pairs, in the binary format for boards; without it forty in simulated offices.
    file: Option<PathBuf>,
    /// The matcher whose stages are choices, each the default one, instead of the odometry's; on m4f.
    #[arg(long)]
    staged: bool,
    /// Make the figures of the simulated pairs, on every board, the golden ones.
    #[arg(long, conflicts_with_all = ["file", "staged", "board"])]
    bless: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Builds, runs, reports.
pub fn run(args: &Args) -> Result<ExitCode> {
    if args.bless {
        println!("{}", serde_json::to_string_pretty(&bench::bless()?)?);
        return Ok(ExitCode::SUCCESS);
    }
    let board = Board::named(&args.board)?;
    let list = match &args.file {
        Some(file) => {
            let list = pairs::read_binary(file)?;
            ensure!(!list.pairs.is_empty(), "{}: no pairs", file.display());
            list
        }
        None => bench::simulated(),
    };
    let which = if args.staged {
        Which::Staged
    } else {
        Which::Fused
    };
    let (outcomes, stack) = bench::on_board(board, &list, which)?;
    let same = hash(&outcomes) == hash(&bench::on_host(&list, which));

    let prepare = sorted(outcomes.iter().map(|outcome| outcome.prepare));
    let matched = sorted(outcomes.iter().map(|outcome| outcome.matched));
    let total = sorted(outcomes.iter().map(|o| o.prepare + o.matched));
    let found = || {
        list.pairs
            .iter()
            .zip(&outcomes)
            .filter(|(_, outcome)| outcome.found)
    };
    let mm = sorted(found().map(|(pair, outcome)| error(pair, outcome).0));
    let deg = sorted(found().map(|(pair, outcome)| error(pair, outcome).1));
    // As `tools/pairs_eval.py` has it.
    let right = found()
        .filter(|(pair, outcome)| {
            let (mm, deg) = error(pair, outcome);
            mm < 50.0 && deg < 1.0
        })
        .count();
    let hash = hash(&outcomes).to_string();
    let value = json!({
        "board": board.name, "pairs": outcomes.len(),
        "prepare_instructions": quantile(&prepare, 0.5), "match_instructions": quantile(&matched, 0.5),
        "match_instructions_max": quantile(&matched, 1.0),
        "total_instructions": quantile(&total, 0.5), "total_instructions_max": quantile(&total, 1.0),
        "error_mm_median": quantile(&mm, 0.5), "error_mm_p90": quantile(&mm, 0.9),
        "error_deg_median": quantile(&deg, 0.5), "error_deg_p90": quantile(&deg, 0.9),
        "right": right, "found": mm.len(), "stack_bytes": stack, "pose_hash": hash, "same_as_host": same,
    });
    let text = format!(
        "{} ({}): {right} of {} pairs right, {} poses given\n\
         instructions  preparation {}, match {}, both {} (at most {}); stack {stack} bytes\n\
         error         median {:.2} mm {:.4} deg, p90 {:.2} mm {:.4} deg\n\
         poses         {hash}, {} on this computer",
        board.name,
        board.core,
        outcomes.len(),
        mm.len(),
        show(quantile(&prepare, 0.5)),
        show(quantile(&matched, 0.5)),
        show(quantile(&total, 0.5)),
        show(quantile(&total, 1.0)),
        quantile(&mm, 0.5).unwrap_or(f64::NAN),
        quantile(&deg, 0.5).unwrap_or(f64::NAN),
        quantile(&mm, 0.9).unwrap_or(f64::NAN),
        quantile(&deg, 0.9).unwrap_or(f64::NAN),
        if same { "the same bits" } else { "DIFFERENT" },
    );
    output::report(args.json, &value, &text)?;
    Ok(if same {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

/// Distance (mm) and rotation (degrees) from the truth.
fn error(pair: &Pair, outcome: &Outcome) -> (f64, f64) {
    let (pose, truth) = (outcome.pose, pair.truth);
    let [dx, dy, rotation] = [
        (pose.x, truth.x),
        (pose.y, truth.y),
        (pose.theta, truth.theta),
    ]
    .map(|(a, b)| f64::from(a) - f64::from(b));
    let rotation = libm::atan2(libm::sin(rotation), libm::cos(rotation));
    (1e3 * libm::hypot(dx, dy), rotation.abs().to_degrees())
}

fn hash(outcomes: &[Outcome]) -> PoseHash {
    let mut hash = PoseHash::new();
    for outcome in outcomes {
        hash.push(outcome.pose);
    }
    hash
}

fn sorted<T: PartialOrd>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut values: Vec<T> = values.collect();
    values.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    values
}

/// The value that the share `q` of all does not exceed; `None` where there is none.
fn quantile<T: Copy>(sorted: &[T], q: f64) -> Option<T> {
    let last = sorted.len().checked_sub(1)?;
    sorted.get((q * last as f64).round() as usize).copied()
}

fn show(count: Option<u32>) -> String {
    count.map_or("-".into(), |count| count.to_string())
}
