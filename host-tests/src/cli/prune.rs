//! `prune`: which keyframes a map can do without.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Result;
use beamfix::grid::{Grid, occupancy};
use host_tests::formats::{self, Log};
use host_tests::mapping::{self, Map, Pruning, Settings};
use host_tests::report::relations::{self, Errors};
use serde_json::json;

use super::output;

/// Compare what pruning to half of the keyframes costs: by information, every second one, random ones.
///
/// Maps a log in the tier of 512k, then again with room for half as many keyframes as that one kept. Prints the error of
/// every scan's pose in the end by relations checked by hand, and how much of the walls is lost: cells of 5 cm occupied in
/// the map that is not pruned, without one within 10 cm in the other.
#[derive(clap::Args)]
pub struct Args {
    /// The log.
    log: PathBuf,
    /// Its relations: lines `t1 t2 x y z roll pitch yaw`.
    #[arg(long, value_name = "FILE")]
    relations: PathBuf,
    /// Keyframes that are left, as a share of those of the map that is not pruned.
    #[arg(long, default_value_t = 0.5)]
    share: f64,
    /// Seeds of the random ones.
    #[arg(long, default_value_t = 5)]
    seeds: u64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Maps, prunes, compares.
pub fn run(args: &Args) -> Result<ExitCode> {
    let log = formats::read(&args.log)?;
    let bar = output::progress(3 + args.seeds as usize, "maps");
    let (whole, map) = mapped(&log, &args.relations, None)?;
    bar.inc(1);
    let kept = map.keyframes.len();
    let most = (args.share * kept as f64) as usize;
    let mut rows = vec![("not pruned", vec![(whole, 0.0)])];
    for (name, ways) in [
        ("information", vec![Pruning::Information]),
        ("every second", vec![Pruning::Alternate]),
        ("random", (1..=args.seeds).map(Pruning::Random).collect()),
    ] {
        let mut found = Vec::new();
        for way in ways {
            let (errors, pruned) = mapped(&log, &args.relations, Some((most, way)))?;
            found.push((errors, lost(&map, &pruned)));
            bar.inc(1);
        }
        rows.push((name, found));
    }
    bar.finish_and_clear();
    type Found = (Errors, f64);
    let mean =
        |of: &[Found], what: fn(&Found) -> f64| of.iter().map(what).sum::<f64>() / of.len() as f64;
    let mut text = format!("{kept} keyframes, pruned to {most}\n");
    let mut list = Vec::new();
    let informed = mean(&rows[1].1, |found| found.1);
    for (name, found) in &rows {
        let metres = mean(found, |found| found.0.metres);
        let degrees = mean(found, |found| found.0.degrees);
        let lost = mean(found, |found| found.1);
        text += &format!(
            "{name:<13} {metres:.4} m {degrees:.3} deg, {:.2} of not pruned; {:.2} % of the walls lost, {:.2} of information's\n",
            metres / whole.metres,
            100.0 * lost,
            lost / informed
        );
        list.push(json!({
            "keyframes": name, "runs": found.len(), "metres": metres, "degrees": degrees, "walls_lost": lost,
        }));
    }
    let value = json!({"kept": kept, "most": most, "rows": list});
    output::report(args.json, &value, text.trim_end())?;
    Ok(ExitCode::SUCCESS)
}

/// Share of the occupied cells of one map that have none within two cells in the other.
fn lost(whole: &Map, pruned: &Map) -> f64 {
    const NEAR: i32 = 2;
    let (Some(whole), Some(pruned)) = (&whole.grid, &pruned.grid) else {
        return 1.0;
    };
    let is_wall = |grid: &Grid<Vec<u8>>, x, y| grid.get(x, y).is_some_and(occupancy::is_occupied);
    let (mut walls, mut gone) = (0, 0);
    for y in 0..i32::from(whole.shape().height()) {
        for x in 0..i32::from(whole.shape().width()) {
            if !is_wall(whole, x, y) {
                continue;
            }
            walls += 1;
            let (px, py) = pruned.shape().cell_of(whole.shape().middle_of(x, y));
            let mut around = (-NEAR..=NEAR).flat_map(|dy| (-NEAR..=NEAR).map(move |dx| (dx, dy)));
            gone += i32::from(!around.any(|(dx, dy)| is_wall(pruned, px + dx, py + dy)));
        }
    }
    f64::from(gone) / f64::from(walls.max(1))
}

/// A map, and the errors of its poses.
fn mapped(log: &Log, relations: &Path, pruning: Option<(usize, Pruning)>) -> Result<(Errors, Map)> {
    let settings = Settings::of_all(log, pruning);
    let map = mapping::run(log, &settings, &mut || {})?;
    let poses: Vec<_> = map
        .scans
        .iter()
        .filter_map(|scan| Some((scan.stamp.parse().ok()?, scan.pose.into())))
        .collect();
    Ok((relations::errors(poses, relations, f64::INFINITY)?, map))
}
