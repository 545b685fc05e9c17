//! Runs the tests: once as they are, then with each break.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};

use crate::places::Mutant;
use crate::room;

/// What breaks should be noticed by: the library's own tests, and those of the host that call nothing else. Tests of the tool and of boards
/// run other programs, which are not broken.
const PROGRAMS: [&str; 4] = ["lidar", "maps", "matching", "odometry"];

struct Test {
    program: PathBuf,
    name: String,
    time: Duration,
    /// Breaks that it comes by.
    seen: BTreeSet<u32>,
}

pub fn all(tree: &Path, mutants: &[Mutant], found: &Path, jobs: usize, slowest: u64) -> Result<()> {
    let programs = build(tree)?;
    let tests = baseline(tree, &programs, jobs, Duration::from_secs(slowest))?;
    println!(
        "{} tests, {:.0} s",
        tests.len(),
        tests
            .iter()
            .map(|test| test.time.as_secs_f64())
            .sum::<f64>()
    );
    let mut known: BTreeMap<String, String> = std::fs::read_to_string(found)
        .unwrap_or_default()
        .lines()
        .filter_map(|line| {
            line.split_once('\t')
                .map(|(key, by)| (key.to_string(), by.to_string()))
        })
        .collect();
    let file = Mutex::new(
        std::fs::OpenOptions::new()
            .append(true)
            .create(true)
            .open(found)?,
    );
    let open: Vec<&Mutant> = mutants
        .iter()
        .filter(|mutant| !known.contains_key(&key(mutant)))
        .collect();
    let next = AtomicUsize::new(0);
    let results = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                while let Some(mutant) = open.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let by = caught_by(tree, mutant, &tests);
                    let line = format!("{}\t{by}\n", key(mutant));
                    print!("{line}");
                    let _ = file.lock().map(|mut file| file.write_all(line.as_bytes()));
                    if let Ok(mut results) = results.lock() {
                        results.push((key(mutant), by));
                    }
                }
            });
        }
    });
    known.extend(results.into_inner().unwrap_or_default());
    table(mutants, &known);
    Ok(())
}

fn key(mutant: &Mutant) -> String {
    format!(
        "{}:{}:{} {}: {}",
        mutant.file, mutant.line, mutant.column, mutant.function, mutant.what
    )
}

fn build(tree: &Path) -> Result<Vec<PathBuf>> {
    let mut arguments = vec![
        "test",
        "--release",
        "--no-run",
        "--message-format",
        "json",
        "-p",
        "beamfix",
        "-p",
        "host-tests",
        "--lib",
    ];
    for program in PROGRAMS {
        arguments.extend(["--test", program]);
    }
    let built = Command::new("cargo")
        .args(arguments)
        .current_dir(tree)
        .env("CARGO_TARGET_DIR", tree.join("../build"))
        .stderr(Stdio::inherit())
        .output()?;
    ensure!(built.status.success(), "the tests do not build");
    let mut programs = Vec::new();
    for line in String::from_utf8_lossy(&built.stdout).lines() {
        let message: serde_json::Value = serde_json::from_str(line)?;
        if message["profile"]["test"] == true
            && let Some(path) = message["executable"].as_str()
        {
            programs.push(PathBuf::from(path));
        }
    }
    Ok(programs)
}

/// Each test by itself, quickest first; those that fail as things are, or take too long, are not asked.
fn baseline(
    tree: &Path,
    programs: &[PathBuf],
    jobs: usize,
    slowest: Duration,
) -> Result<Vec<Test>> {
    let mut names = Vec::new();
    for program in programs {
        let listed = Command::new(program)
            .args(["--list", "--format", "terse"])
            .output()?;
        // Without what counts instructions: a break costs some, wherever it is.
        for line in String::from_utf8_lossy(&listed.stdout).lines() {
            if let Some(name) = line.strip_suffix(": test")
                && !name.starts_with("host_cost")
            {
                names.push((program.clone(), name.to_string()));
            }
        }
    }
    let next = AtomicUsize::new(0);
    let tests = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for job in 0..jobs {
            let (next, names, tests) = (&next, &names, &tests);
            scope.spawn(move || {
                let seen_in = tree.join(format!("../seen-{job}"));
                while let Some((program, name)) = names.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let _ = std::fs::remove_file(&seen_in);
                    let began = Instant::now();
                    let passed = passes(tree, program, name, 0, Some(&seen_in), slowest);
                    let time = began.elapsed();
                    if passed != Some(true) {
                        println!(
                            "not asked: {name} ({})",
                            if passed.is_none() {
                                "too slow"
                            } else {
                                "fails"
                            }
                        );
                        continue;
                    }
                    let seen = std::fs::read_to_string(&seen_in).unwrap_or_default();
                    let seen = seen.lines().filter_map(|id| id.parse().ok()).collect();
                    if let Ok(mut tests) = tests.lock() {
                        tests.push(Test {
                            program: program.clone(),
                            name: name.clone(),
                            time,
                            seen,
                        });
                    }
                }
            });
        }
    });
    let mut tests = tests
        .into_inner()
        .ok()
        .context("a test's thread ended early")?;
    tests.sort_by_key(|test| test.time);
    Ok(tests)
}

/// `None`: it did not end in time.
fn passes(
    tree: &Path,
    program: &Path,
    name: &str,
    mutant: u32,
    seen: Option<&Path>,
    limit: Duration,
) -> Option<bool> {
    let mut command = Command::new(program);
    command
        .args(["--exact", name, "--test-threads", "1"])
        .env("BEAMFIX_MUTANT", mutant.to_string())
        .env("RUST_BACKTRACE", "0")
        .current_dir(tree.join("host-tests"))
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    if let Some(seen) = seen {
        command.env("BEAMFIX_MUTANT_SEEN", seen);
    }
    let mut child = command.spawn().ok()?;
    let began = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return Some(status.success()),
            Ok(None) if began.elapsed() > limit => {
                let _ = child.kill();
                let _ = child.wait();
                return None;
            }
            Ok(None) => std::thread::sleep(Duration::from_millis(2)),
            Err(_) => return None,
        }
    }
}

/// The test that notices this break, `time` before it where the test does not end, `-` where none does.
fn caught_by(tree: &Path, mutant: &Mutant, tests: &[Test]) -> String {
    let mut reached = false;
    for test in tests.iter().filter(|test| test.seen.contains(&mutant.id)) {
        reached = true;
        match passes(
            tree,
            &test.program,
            &test.name,
            mutant.id,
            None,
            test.time * 8 + Duration::from_secs(5),
        ) {
            Some(true) => {}
            Some(false) => return test.name.clone(),
            None => return format!("time {}", test.name),
        }
    }
    if reached {
        "-".into()
    } else {
        "- (no test comes by)".into()
    }
}

fn table(mutants: &[Mutant], known: &BTreeMap<String, String>) {
    let mut rooms: BTreeMap<&str, [usize; 3]> = BTreeMap::new();
    let mut missed = Vec::new();
    for mutant in mutants {
        let Some(by) = known.get(&key(mutant)) else {
            continue;
        };
        let counts = rooms.entry(room(&mutant.file)).or_default();
        counts[0] += 1;
        if by.starts_with('-') {
            missed.push(format!(
                "{} {}",
                key(mutant),
                by.trim_start_matches("- ").trim_start_matches('-')
            ));
        } else {
            counts[1] += 1;
            counts[2] += usize::from(by.starts_with("time"));
        }
    }
    println!("\nnot noticed:");
    for line in &missed {
        println!("  {line}");
    }
    println!(
        "\n{:<14} {:>6} {:>8} {:>10} {:>6}",
        "room", "breaks", "noticed", "by time", "share"
    );
    let mut sum = [0; 3];
    for (room, counts) in &rooms {
        println!(
            "{room:<14} {:>6} {:>8} {:>10} {:>4.0} %",
            counts[0],
            counts[1],
            counts[2],
            100.0 * counts[1] as f64 / counts[0].max(1) as f64
        );
        for (total, count) in sum.iter_mut().zip(counts) {
            *total += count;
        }
    }
    println!(
        "{:<14} {:>6} {:>8} {:>10} {:>4.0} %",
        "all",
        sum[0],
        sum[1],
        sum[2],
        100.0 * sum[1] as f64 / sum[0].max(1) as f64
    );
}
