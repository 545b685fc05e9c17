//! Breaks the library on purpose, a place at a time, and looks which tests notice.
//!
//! `cargo run --release -p beamfix-mutants -- --sample 400 --seed 1` copies the project to
//! `target/mutants/tree`, builds its tests once with all chosen breaks in them, looks which test runs through which break, and then runs
//! these tests with one break on, the quickest first, until one fails. What no test notices stands in the table at the end.

mod places;
mod run;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::Parser;
use places::{Mutant, Walk};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use syn::visit_mut::VisitMut;

#[derive(Parser)]
struct Options {
    /// How many breaks, spread over all rooms of `src/` by their size; 0 takes all.
    #[arg(long, default_value_t = 400)]
    sample: usize,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only files whose path begins so: `src/matching/icp`.
    #[arg(long, default_value = "src/")]
    within: String,
    /// How many tests run at a time.
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// Tests that take longer than this, in seconds, are not asked.
    #[arg(long, default_value_t = 20)]
    slowest: u64,
    /// What has been found is kept here, a line a break; what stands there is not run again. Remove it when code or tests have changed.
    #[arg(long, default_value = "target/mutants/found.tsv")]
    found: PathBuf,
}

fn main() -> Result<()> {
    let options = Options::parse();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(2)
        .context("the project's root")?;
    std::env::set_current_dir(root)?;
    let sources = sources()?;
    let within = |path: &str| path.starts_with(&options.within) && !path.ends_with("/tests.rs");
    let mut all = Vec::new();
    for (path, text) in sources.iter().filter(|(path, _)| within(path)) {
        let mut walk = Walk::new(path, all.last().map_or(1, |m: &Mutant| m.id + 1), None);
        walk.visit_file_mut(&mut syn::parse_file(text)?);
        all.append(&mut walk.found);
    }
    let files: BTreeSet<&str> = all.iter().map(|mutant| &mutant.file[..]).collect();
    println!("{} places in {} files", all.len(), files.len());
    let mut chosen = choose(&all, &options);
    let tree = root.join("target/mutants/tree");
    copy(&tree)?;
    loop {
        put_in(&tree, &sources, (&all, &chosen))?;
        let refused = refused(&tree, &chosen)?;
        if refused.is_empty() {
            break;
        }
        println!("{} of {} do not compile", refused.len(), chosen.len());
        chosen.retain(|id| !refused.contains(id));
    }
    println!("{} breaks are built in", chosen.len());
    let mutants: Vec<Mutant> = all
        .into_iter()
        .filter(|mutant| chosen.contains(&mutant.id))
        .collect();
    run::all(
        &tree,
        &mutants,
        &options.found,
        options.jobs,
        options.slowest,
    )
}

/// The library's files, in order, with their text.
fn sources() -> Result<Vec<(String, String)>> {
    let listed = Command::new("git")
        .args(["ls-files", "src/*.rs"])
        .output()?;
    ensure!(listed.status.success(), "git ls-files failed");
    String::from_utf8(listed.stdout)?
        .lines()
        .map(|path| {
            Ok((
                path.to_string(),
                std::fs::read_to_string(path).with_context(|| path.to_string())?,
            ))
        })
        .collect()
}

/// From each room as many as its share of all places, at least one.
fn choose(all: &[Mutant], options: &Options) -> BTreeSet<u32> {
    if options.sample == 0 {
        return all.iter().map(|mutant| mutant.id).collect();
    }
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(options.seed);
    let rooms: BTreeSet<&str> = all.iter().map(|mutant| room(&mutant.file)).collect();
    let mut chosen = BTreeSet::new();
    for room_name in rooms {
        let mut of_room: Vec<u32> = all
            .iter()
            .filter(|m| room(&m.file) == room_name)
            .map(|m| m.id)
            .collect();
        let share = (of_room.len() * options.sample).div_ceil(all.len());
        of_room.shuffle(&mut random);
        chosen.extend(of_room.into_iter().take(share));
    }
    chosen
}

/// `src/matching/icp/projective/score.rs` is in the room `matching`, `src/pipeline.rs` in `pipeline`.
pub fn room(file: &str) -> &str {
    file.strip_prefix("src/")
        .unwrap_or(file)
        .split('/')
        .next()
        .map_or(file, |name| name.trim_end_matches(".rs"))
}

/// The project as it is checked in or changed, without what is built and without the library's sources, which [`put_in`] writes.
fn copy(tree: &Path) -> Result<()> {
    std::fs::create_dir_all(tree)?;
    let status = Command::new("sh")
        .arg("-c")
        .arg("git ls-files -co --exclude-standard | grep -v '^src/' | tar -cf - -T - | tar -xf - -C \"$0\"")
        .arg(tree)
        .status()?;
    ensure!(status.success(), "the project could not be copied");
    Ok(())
}

/// Writes the library's sources with the chosen breaks; files whose text stays the same keep their time, so that they are not built
/// again.
fn put_in(
    tree: &Path,
    sources: &[(String, String)],
    (all, chosen): (&[Mutant], &BTreeSet<u32>),
) -> Result<()> {
    for (path, text) in sources {
        let mut here = all.iter().filter(|mutant| mutant.file == *path).peekable();
        let first = here.peek().map_or(0, |mutant| mutant.id);
        let mut broken = if here.any(|mutant| chosen.contains(&mutant.id)) {
            let mut file = syn::parse_file(text)?;
            Walk::new(path, first, Some(chosen)).visit_file_mut(&mut file);
            prettyplease::unparse(&file)
        } else {
            text.clone()
        };
        if path == "src/lib.rs" {
            broken = format!(
                "#![allow(warnings)]\n{broken}\nextern crate std;\n#[doc(hidden)] pub mod mutant;\n"
            );
        }
        write(&tree.join(path), &broken)?;
    }
    write(&tree.join("src/mutant.rs"), include_str!("switch.rs"))
}

fn write(path: &Path, text: &str) -> Result<()> {
    if std::fs::read_to_string(path).is_ok_and(|old| old == text) {
        return Ok(());
    }
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    std::fs::write(path, text).with_context(|| path.display().to_string())
}

/// How the question for a break begins in the text.
const ASKS: &str = "mutant::on(";

/// The break that a text which begins with [`ASKS`] asks for.
fn asked(text: &str) -> Option<u32> {
    text.strip_prefix(ASKS)?.split("u32").next()?.parse().ok()
}

/// Breaks that the compiler refuses: each error is put to the break that begins last before it, the first of the file to one that
/// comes before all.
fn refused(tree: &Path, chosen: &BTreeSet<u32>) -> Result<BTreeSet<u32>> {
    let checked = Command::new("cargo")
        .args([
            "check",
            "--release",
            "-p",
            "beamfix",
            "--features",
            "embedded-io,embedded-storage,internals",
            "--message-format",
            "json",
        ])
        .current_dir(tree)
        .env("CARGO_TARGET_DIR", tree.join("../build"))
        .output()?;
    let mut refused = BTreeSet::new();
    for line in String::from_utf8_lossy(&checked.stdout).lines() {
        let message: serde_json::Value = serde_json::from_str(line)?;
        if message["message"]["level"] != "error" {
            continue;
        }
        for span in message["message"]["spans"].as_array().into_iter().flatten() {
            let (Some(file), Some(end)) = (span["file_name"].as_str(), span["byte_end"].as_u64())
            else {
                continue;
            };
            let text = std::fs::read_to_string(tree.join(file)).unwrap_or_default();
            let (before, after) = text.split_at((end as usize).min(text.len()));
            refused.extend(before.rfind(ASKS).map_or_else(
                || after.find(ASKS).and_then(|at| asked(&after[at..])),
                |at| asked(&before[at..]),
            ));
        }
    }
    ensure!(
        checked.status.success() || !refused.is_empty(),
        "{}",
        String::from_utf8_lossy(&checked.stderr)
    );
    Ok(refused.intersection(chosen).copied().collect())
}
