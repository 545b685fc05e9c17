//! `regress`: many recordings against what they gave before.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::UNIX_EPOCH;

use anyhow::{Context, Result, bail, ensure};
use host_tests::regress::{self, Change, Entry, Outcome, Outcomes, Shard};
use host_tests::report::relations;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::output;

/// Replay many recordings and compare poses and accuracy with a baseline.
///
/// The manifest is a YAML list: `log` (from the manifest's folder on), and if need be `name`, `options` of replay, and
/// `relations` (true motions between two moments, `time time x y z roll pitch yaw` a line). Exit status 0 where all poses
/// are the baseline's, 1 where some are not or a replay failed. What is done is kept: a run that was stopped goes on.
#[derive(clap::Args)]
pub struct Args {
    /// The manifest.
    manifest: PathBuf,
    /// What the recordings gave before. Default: beside the manifest, ending in .baseline.json.
    #[arg(long, value_name = "FILE")]
    baseline: Option<PathBuf>,
    /// Make what comes out the baseline; with a shard or a name, its part of it.
    #[arg(long)]
    bless: bool,
    /// Only the I-th of N parts of the manifest, to share it among machines.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Only this recording.
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Print the names of the recordings and replay nothing.
    #[arg(long)]
    list: bool,
    /// Replays side by side. Default: the machine's cores.
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// Where what is done is kept.
    #[arg(long, value_name = "DIR", default_value = "target/beamfix/regress")]
    state: PathBuf,
    /// Replay all again, also what is done.
    #[arg(long)]
    fresh: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// A line of what is done: the outcome of a recording, a program and options that are these.
#[derive(Serialize, Deserialize)]
struct Kept {
    name: String,
    key: String,
    outcome: Outcome,
}

/// Replays what is not done yet, and reports.
pub fn run(args: &Args) -> Result<ExitCode> {
    let all = regress::manifest(&args.manifest)?;
    let shard = args.shard.unwrap_or(Shard::ALL);
    let chosen: Vec<&Entry> = all
        .iter()
        .enumerate()
        .filter(|(place, entry)| {
            shard.holds(*place) && args.only.as_ref().is_none_or(|name| *name == entry.name)
        })
        .map(|(_, entry)| entry)
        .collect();
    if let (Some(name), true) = (&args.only, chosen.is_empty()) {
        bail!("{}: no recording is called {name}", args.manifest.display());
    }
    if args.list {
        let names: Vec<&str> = chosen.iter().map(|entry| &entry.name[..]).collect();
        output::report(args.json, &json!({ "names": names }), &names.join("\n"))?;
        return Ok(ExitCode::SUCCESS);
    }
    let path = args
        .baseline
        .clone()
        .unwrap_or_else(|| args.manifest.with_extension("baseline.json"));
    let mut baseline = regress::baseline(&path)?;
    let outcomes = outcomes(args, &chosen)?;

    let mut text = format!(
        "{:<40} {:>7} {:>7} {:>5} {:>9} {:>8}  {:<16}",
        "recording", "scans", "refused", "lost", "m", "deg", "poses"
    );
    let mut rows = Vec::new();
    let mut counts = BTreeMap::new();
    for (name, now) in &outcomes {
        let before = baseline.get(name);
        let change = Change::of(now, before);
        *counts.entry(change.word()).or_insert(0_u32) += 1;
        text += &line(name, now, before, change);
        rows.push(json!({
            "name": name, "change": change.word(), "outcome": now, "before": before,
        }));
    }
    let count = |change: Change| counts.get(change.word()).copied().unwrap_or(0);
    text += &format!(
        "\n{} recordings: {} same, {} changed, {} new, {} failed",
        outcomes.len(),
        count(Change::Same),
        count(Change::Changed),
        count(Change::New),
        count(Change::Failed)
    );
    let value = json!({
        "recordings": rows, "same": count(Change::Same), "changed": count(Change::Changed),
        "new": count(Change::New), "failed": count(Change::Failed),
    });
    let failed = count(Change::Failed);
    if args.bless {
        ensure!(
            failed == 0,
            "{failed} replays failed: no baseline is made of that"
        );
        let whole = args.shard.is_none() && args.only.is_none();
        if whole {
            baseline.clear();
        }
        baseline.extend(outcomes);
        regress::bless(&path, &baseline)?;
    }
    output::report(args.json, &value, &text)?;
    let is_good = failed == 0 && (args.bless || count(Change::Changed) == 0);
    Ok(ExitCode::from(u8::from(!is_good)))
}

fn line(name: &str, now: &Outcome, before: Option<&Outcome>, change: Change) -> String {
    let show = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.4}"));
    let mut line = format!(
        "\n{name:<40} {:>7} {:>7} {:>5} {:>9} {:>8}  {:<16} {}",
        now.scans,
        now.refused,
        now.lost,
        show(now.metres),
        now.degrees
            .map_or("-".into(), |value| format!("{value:.3}")),
        now.pose_hash,
        change.word()
    );
    if let Some(error) = &now.error {
        line += &format!(": {error}");
    }
    if let (Change::Changed, Some(before)) = (change, before) {
        line += &format!(
            ": {} refused, {} lost, {} m before",
            before.refused,
            before.lost,
            show(before.metres)
        );
    }
    line
}

/// Outcomes of all of these: kept ones, and the others replayed side by side.
fn outcomes(args: &Args, entries: &[&Entry]) -> Result<Outcomes> {
    let program = std::env::current_exe().context("this program")?;
    fs::create_dir_all(&args.state).with_context(|| args.state.display().to_string())?;
    let stem = args.manifest.file_stem().unwrap_or_default();
    let state = args.state.join(format!("{}.jsonl", stem.to_string_lossy()));
    let mut kept: BTreeMap<String, Kept> = BTreeMap::new();
    if args.fresh {
        let _ = fs::remove_file(&state);
    } else if let Ok(text) = fs::read_to_string(&state) {
        // A line that was cut short when the machine stopped is done again.
        let lines = text
            .lines()
            .filter_map(|line| serde_json::from_str(line).ok());
        kept.extend(lines.map(|line: Kept| (line.name.clone(), line)));
    }
    let file = OpenOptions::new().create(true).append(true).open(&state);
    let file: Mutex<File> = Mutex::new(file.with_context(|| state.display().to_string())?);
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Outcomes::new());
    let bar = output::progress(entries.len(), "replaying");
    let work = || {
        while let Some(entry) = entries.get(next.fetch_add(1, Ordering::Relaxed)) {
            let key = key(entry, &program);
            let outcome = match kept.get(&entry.name).filter(|line| line.key == key) {
                Some(line) => line.outcome.clone(),
                None => {
                    let outcome = replay(entry, &program, &args.state);
                    let line = Kept {
                        name: entry.name.clone(),
                        key,
                        outcome: outcome.clone(),
                    };
                    // Where this cannot be kept, it is only done again.
                    if let (Ok(mut file), Ok(text)) = (file.lock(), serde_json::to_string(&line)) {
                        let _ = writeln!(file, "{text}");
                    }
                    outcome
                }
            };
            if let Ok(mut done) = done.lock() {
                done.insert(entry.name.clone(), outcome);
            }
            bar.inc(1);
        }
    };
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = args.jobs.unwrap_or(cores).clamp(1, entries.len().max(1));
    std::thread::scope(|scope| {
        for _ in 1..jobs {
            scope.spawn(work);
        }
        work();
    });
    bar.finish_and_clear();
    Ok(done.into_inner().unwrap_or_default())
}

/// What an outcome depends on: the program, the recording, the options, the relations.
fn key(entry: &Entry, program: &Path) -> String {
    let state = |path: &Path| {
        let data = fs::metadata(path).ok();
        let modified = data.as_ref().and_then(|data| data.modified().ok());
        let nanos = modified.and_then(|time| time.duration_since(UNIX_EPOCH).ok());
        format!(
            "{}:{}",
            data.map_or(0, |data| data.len()),
            nanos.map_or(0, |time| time.as_nanos())
        )
    };
    let relations = entry.relations.as_deref().map(state).unwrap_or_default();
    format!(
        "{} {} {} {relations} {:?}",
        state(program),
        entry.log.display(),
        state(&entry.log),
        entry.options
    )
}

/// Replays a recording in a process of its own: what breaks there ends nothing here.
fn replay(entry: &Entry, program: &Path, folder: &Path) -> Outcome {
    try_replay(entry, program, folder).unwrap_or_else(|error| Outcome {
        error: Some(format!("{error:#}")),
        ..Outcome::default()
    })
}

fn try_replay(entry: &Entry, program: &Path, folder: &Path) -> Result<Outcome> {
    let name: String = entry
        .name
        .chars()
        .map(|c| if c.is_alphanumeric() { c } else { '_' })
        .collect();
    let trajectory = folder.join(format!("{name}-{}.txt", std::process::id()));
    let run = Command::new(program)
        .arg("replay")
        .arg(&entry.log)
        .args(&entry.options)
        .arg("--json")
        .arg("--trajectory")
        .arg(&trajectory)
        .output()
        .context("this program could not be run again")?;
    let track = fs::read_to_string(&trajectory).unwrap_or_default();
    let _ = fs::remove_file(&trajectory);
    if !run.status.success() {
        let said = String::from_utf8_lossy(&run.stderr);
        bail!("{}", said.lines().last().unwrap_or("no word of why").trim());
    }
    let told: Value = serde_json::from_slice(&run.stdout).context("what replay printed")?;
    let number = |name: &str| told[name].as_u64().unwrap_or(0);
    let mut outcome = Outcome {
        pose_hash: told["pose_hash"].as_str().unwrap_or_default().to_owned(),
        scans: number("scans"),
        refused: number("refused"),
        lost: number("lost"),
        ..Outcome::default()
    };
    if let Some(path) = &entry.relations {
        let track = track.lines().filter_map(relations::placed).collect();
        let errors = relations::errors(track, path, f64::INFINITY)?;
        (outcome.metres, outcome.degrees) = (Some(errors.metres), Some(errors.degrees));
    }
    Ok(outcome)
}
