//! `scenes`: every simulated scene that has deceived an odometry, and what comes of it now.

use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::{Result, bail};
use beamfix_sim::catalogue::{self, Entry, Must};
use host_tests::report::scene::{self, Outcome, Runs};
use serde_json::{Value, json};

use super::output;

/// Run the odometry through a table of simulated scenes: error, refused, normalised error, wrong and confident.
#[derive(clap::Args)]
pub struct Args {
    /// Only scenes whose names contain this; may be given several times.
    #[arg(long, value_name = "NAME")]
    scene: Vec<String>,
    /// Scenes of up to an hour, too.
    #[arg(long)]
    long: bool,
    /// Runs of each scene.
    #[arg(long, default_value_t = 2)]
    seeds: u64,
    /// The other half of the seeds: one half is for choosing, this one for deciding.
    #[arg(long)]
    held_out: bool,
    /// Work on so many scenes at a time.
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// The rolling map of the tier of 64 KB instead of the odometry alone.
    #[arg(long)]
    rolling: bool,
    /// One line a scan: time, pose, truth, sigmas, outcome.
    #[arg(long)]
    trace: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// First seeds of the two halves.
const HALVES: [u64; 2] = [1, 100_001];

/// Runs the scenes that are asked for, and reports.
pub fn run(args: &Args) -> Result<ExitCode> {
    let mut entries = catalogue::all();
    if args.long || !args.scene.is_empty() {
        entries.extend(catalogue::long());
    }
    if !args.scene.is_empty() {
        let exact = |entry: &Entry| args.scene.iter().any(|name| name == entry.name);
        let chosen = |entry: &Entry| {
            exact(entry) || args.scene.iter().any(|name| entry.name.contains(&name[..]))
        };
        // The full name of a scene means that one only.
        let all_exact = args.scene.iter().all(|name| {
            catalogue::all()
                .iter()
                .chain(&catalogue::long())
                .any(|entry| entry.name == name)
        });
        entries.retain(|entry| {
            if all_exact {
                exact(entry)
            } else {
                chosen(entry)
            }
        });
    }
    if entries.is_empty() {
        bail!("no scene has {} in its name", args.scene.join(" or "));
    }
    if args.seeds == 0 {
        bail!("--seeds 0: must be above 0");
    }
    let first = HALVES[usize::from(args.held_out)];
    let seeds: Vec<u64> = (first..first + args.seeds).collect();
    let rows = rows(args, &entries, &seeds);
    let mut text = format!(
        "{:<42} {:>6} {:>7} {:>7} {:>7} {:>7} {:>6} {:>5} {:>8} {:>8} {:>5}\n",
        "scene", "scans", "end m", "deg", "worst m", "deg", "refus%", "lost", "nees", "end", "w+c"
    );
    for row in &rows {
        text.push_str(&row.line());
    }
    let broken = rows.iter().filter(|row| row.confident > 0).count();
    let missed = rows.iter().filter(|row| !row.kept).count();
    text.push_str(&format!(
        "{} scenes, {} seeds each: {broken} wrong and confident at some time, {missed} not as they must be",
        rows.len(),
        args.seeds
    ));
    let values: Vec<Value> = rows.iter().map(Row::json).collect();
    let value = json!({
        "seeds": seeds, "scenes": values, "wrong_and_confident": broken, "not_as_they_must_be": missed,
    });
    output::report(args.json, &value, &text)?;
    Ok(ExitCode::SUCCESS)
}

/// A scene's outcomes, put together.
struct Row {
    name: &'static str,
    must: Must,
    scans: u32,
    refused: u32,
    lost: u32,
    /// Of all seeds: largest error at the end, mean signed heading at the end, largest error of all.
    last: (f64, f64),
    mean_turned: f64,
    largest: (f64, f64),
    nees: f64,
    last_nees: f64,
    confident: u32,
    first_confident: Option<(f64, f64, f64)>,
    kept: bool,
    hashes: Vec<String>,
}

impl Row {
    fn new(entry: &Entry, outcomes: &[Outcome]) -> Self {
        let most = |of: fn(&Outcome) -> f64| outcomes.iter().map(of).fold(0.0, f64::max);
        let count = outcomes.len() as f64;
        let squares = outcomes.iter().fold((0.0, 0), |(sum, n), outcome| {
            (sum + outcome.squares.0, n + outcome.squares.1)
        });
        Self {
            name: entry.name,
            must: entry.must,
            scans: outcomes.iter().map(|o| o.scans).sum(),
            refused: outcomes.iter().map(|o| o.refused).sum(),
            lost: outcomes.iter().map(|o| o.lost).sum(),
            last: (most(|o| o.last.0), most(|o| o.last.1.abs())),
            mean_turned: outcomes.iter().map(|o| o.last.1).sum::<f64>() / count,
            largest: (most(|o| o.largest.0), most(|o| o.largest.1)),
            nees: squares.0 / f64::from(squares.1.max(1)),
            last_nees: outcomes.iter().map(|o| o.last_square).sum::<f64>() / count,
            confident: outcomes.iter().map(|o| o.confident).sum(),
            first_confident: outcomes.iter().find_map(|o| o.first_confident),
            kept: outcomes.iter().all(|o| o.kept(entry.must)),
            hashes: outcomes.iter().map(|o| o.hash.to_string()).collect(),
        }
    }

    fn line(&self) -> String {
        let mark = if self.kept { "" } else { "  !" };
        let confident = self.first_confident.map_or(String::new(), |(at, m, deg)| {
            format!(" from {at:.1} s: {m:.2} m, {deg:.1} deg")
        });
        format!(
            "{:<42} {:>6} {:>7.3} {:>7.2} {:>7.3} {:>7.2} {:>6.1} {:>5} {:>8.2} {:>8.2} {:>5}{mark}{confident}\n",
            self.name,
            self.scans,
            self.last.0,
            self.mean_turned,
            self.largest.0,
            self.largest.1,
            100.0 * f64::from(self.refused) / f64::from(self.scans.max(1)),
            self.lost,
            self.nees,
            self.last_nees,
            self.confident,
        )
    }

    fn json(&self) -> Value {
        json!({
            "scene": self.name, "must": format!("{:?}", self.must), "as_it_must_be": self.kept,
            "scans": self.scans, "refused": self.refused, "lost": self.lost,
            "final_error_m": self.last.0, "final_error_deg": self.last.1,
            "mean_signed_error_deg": self.mean_turned,
            "max_error_m": self.largest.0, "max_error_deg": self.largest.1,
            "nees": self.nees, "final_nees": self.last_nees, "wrong_and_confident": self.confident,
            "pose_hashes": self.hashes,
        })
    }
}

/// Runs all scenes, in their order, on as many threads as are asked for.
fn rows(args: &Args, entries: &[Entry], seeds: &[u64]) -> Vec<Row> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    let bar = output::progress(entries.len(), "scenes");
    let work = || {
        while let Some(entry) = entries.get(next.fetch_add(1, Ordering::Relaxed)) {
            let outcomes: Vec<Outcome> = seeds.iter().map(|&seed| one(args, entry, seed)).collect();
            let row = Row::new(entry, &outcomes);
            if let Ok(mut done) = done.lock() {
                done.push(row);
            }
            bar.inc(1);
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..args.threads {
            scope.spawn(work);
        }
        work();
    });
    bar.finish_and_clear();
    let mut rows = done.into_inner().unwrap_or_default();
    let place = |name| entries.iter().position(|entry| entry.name == name);
    rows.sort_by_key(|row| place(row.name));
    rows
}

fn one(args: &Args, entry: &Entry, seed: u64) -> Outcome {
    let runs = match args.rolling {
        true => Runs::Rolling,
        false => Runs::Odometry,
    };
    scene::run(
        entry,
        (seed, runs),
        |config| config,
        |time, step, truth| {
            if args.trace {
                let p = step.pose;
                let c = step.covariance.0;
                let outcome = match &step.outcome {
                    Ok(found) => format!(
                        "ok score {:.2} residual {:.4} inliers {} overlap {} of {} degenerate {:?}",
                        found.score,
                        found.residual,
                        found.inliers,
                        found.overlap,
                        found.beams,
                        found.degenerate_direction
                    ),
                    Err(refusal) => format!("{refusal:?}"),
                };
                eprintln!(
                    "{time:.3} pose {:.3} {:.3} {:.2} off {:.3} {:.3} {:.2} sigma {:.3} {:.3} {:.2} {}{outcome}",
                    p.x,
                    p.y,
                    p.theta.to_degrees(),
                    f64::from(p.x) - truth.x,
                    f64::from(p.y) - truth.y,
                    beamfix_sim::pose::wrap(f64::from(p.theta) - truth.theta).to_degrees(),
                    f64::from(c.xx).sqrt(),
                    f64::from(c.yy).sqrt(),
                    f64::from(c.tt).sqrt().to_degrees(),
                    if step.keyframe { "K " } else { "" },
                );
            }
        },
    )
}
