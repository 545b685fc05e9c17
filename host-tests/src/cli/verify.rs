//! `verify`: the same poses, bit for bit, here and on every emulated board.

use std::process::ExitCode;

use anyhow::Result;
use beamfix::geometry::Pose;
use beamfix_app::BEAMS;
use host_tests::board::{BOARDS, Board, Replay, emulator::Count, slam};
use host_tests::golden::{self, Golden};
use host_tests::mapping::{Tier, building};
use serde_json::{Value, json};

use super::output;

/// Replay the golden logs on the host and on every emulated board, and compare every bit of every pose.
#[derive(clap::Args)]
pub struct Args {
    /// Only these boards.
    #[arg(long, value_name = "NAME", conflicts_with = "host")]
    board: Vec<String>,
    /// Only the host, no board.
    #[arg(long)]
    host: bool,
    /// Write the golden files from what the host finds now.
    #[arg(long)]
    bless: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Exit status where bits differ, as opposed to work that could not be done.
const DIFFERENT: u8 = 1;

/// Replays and compares.
pub fn run(args: &Args) -> Result<ExitCode> {
    let boards: Vec<&Board> = match (args.host, &args.board[..]) {
        (true, _) => Vec::new(),
        (false, []) => BOARDS.iter().collect(),
        (false, names) => names
            .iter()
            .map(|name| Board::named(name))
            .collect::<Result<_>>()?,
    };
    let runs = golden::all()?;
    let mut table = Vec::new();
    for run in &runs {
        let here = run.poses();
        if args.bless {
            run.bless(&here)?;
        }
        let wanted = run.kept()?;
        table.push(Row::new(run, "host", &wanted, &here));
        table.push(Row::new(
            run,
            "host, firmware",
            &wanted,
            &poses(&Replay::on_host(&run.commands, BEAMS)),
        ));
        for board in &boards {
            let bar = output::progress(here.len(), board.name);
            bar.tick();
            let there = board.replay(&run.commands, Count::None)?;
            bar.finish_and_clear();
            // Where there is no room for a whole revolution, it is the host with so little room that must agree.
            match board.beams {
                BEAMS => table.push(Row::new(run, board.name, &wanted, &poses(&there))),
                beams => {
                    let wanted = poses(&Replay::on_host(&run.commands, beams));
                    let machine = format!("{}, {beams} beams", board.name);
                    table.push(Row::new(run, &machine, &wanted, &poses(&there)));
                }
            }
        }
    }
    if !args.bless && boards.iter().any(|board| board.name == "m4f") {
        table.push(mapped());
    }
    let same = table.iter().all(|row| row.difference.is_none());
    let mut text: Vec<String> = table.iter().map(Row::text).collect();
    if runs.len() < 2 {
        text.push("left out: intel-1000, ../shared is not there".to_owned());
    }
    text.push(
        if same {
            "every bit is the same"
        } else {
            "NOT the same"
        }
        .to_owned(),
    );
    let value = json!({"same": same, "runs": table.iter().map(Row::json).collect::<Vec<_>>()});
    output::report(args.json, &value, &text.join("\n"))?;
    Ok(if same {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(DIFFERENT)
    })
}

/// SLAM in the simulated building, in just the RAM of its tier: host and board compared.
fn mapped() -> Row {
    /// Round once, with the loop closed.
    const ROUNDS: usize = 1;
    let (log, _) = building::log(ROUNDS, 1);
    let measured = slam::measure(Tier::Of192k, &log, usize::MAX);
    let (hash, difference) = match &measured {
        Ok(costs) => (costs.hash.to_string(), None),
        Err(error) => (String::new(), Some(format!("{error:#}"))),
    };
    Row {
        run: "building",
        machine: "m4f, slam 192k".to_owned(),
        scans: log.scans.len(),
        hash,
        difference,
    }
}

/// One run on one machine.
struct Row {
    run: &'static str,
    machine: String,
    scans: usize,
    hash: String,
    difference: Option<String>,
}

impl Row {
    fn new(run: &Golden, machine: &str, wanted: &[Pose], found: &[Pose]) -> Self {
        Self {
            run: run.name,
            machine: machine.to_owned(),
            scans: found.len(),
            hash: golden::hash(found).to_string(),
            difference: golden::difference(wanted, found),
        }
    }

    fn text(&self) -> String {
        let Self {
            run,
            machine,
            scans,
            hash,
            difference,
        } = self;
        let verdict = difference.as_deref().unwrap_or("same");
        format!("{run:<12} {machine:<15} {scans:>5} scans  {hash}  {verdict}")
    }

    fn json(&self) -> Value {
        json!({
            "run": self.run, "machine": self.machine, "scans": self.scans, "pose_hash": self.hash,
            "same": self.difference.is_none(), "difference": self.difference,
        })
    }
}

fn poses(replay: &Replay) -> Vec<Pose> {
    replay
        .poses()
        .map(|sent| Pose {
            x: sent.pose[0],
            y: sent.pose[1],
            theta: sent.pose[2],
        })
        .collect()
}
