//! `replay --mode slam`: odometry and pose graph over a recorded log, in the memory of a tier.

use anyhow::{Result, bail};
use beamfix::geometry::Pose;
use beamfix::slam::{Counters, SlamConfig};
use host_tests::formats::{Log, ros_map};
use host_tests::mapping::{self, Settings};
use host_tests::pipeline::config;
use host_tests::report::hash::PoseHash;
use serde_json::json;

use super::args::{Args, Tier};
use super::{Done, add_context};
use crate::cli::output;

/// Cells of the map that is written (m): what a map server's maps usually have.
const RESOLUTION: f32 = 0.05;

/// Replays the log with so many directions, and reports.
pub fn run(args: &Args, log: &Log, directions: usize) -> Result<Done> {
    let tier = match args.tier {
        Some(Tier::Large) => mapping::Tier::Of192k,
        Some(Tier::Huge) | None => mapping::Tier::Of512k,
        Some(Tier::Small | Tier::Middle) => {
            bail!("--tier: slam needs the memory of 192k or 512k, a rolling map that of 64k")
        }
    };
    let mut trajectory = args.open_trajectory()?;
    let count = args.count(log.scans.len());
    let settings = Settings {
        tier,
        odometry: config(args.mount_of(log), directions),
        slam: SlamConfig::DEFAULT,
        scans: (count, args.uses_wheels()),
        pruning: None,
        resolution: args.map_out.is_some().then_some(RESOLUTION),
    };
    let bar = output::progress(count, "mapping");
    let map = mapping::run(log, &settings, &mut || bar.inc(1))?;
    bar.finish_and_clear();
    let mut hash = PoseHash::new();
    let mut leave = args.leave(log, true)?;
    for (scan, recorded) in map.scans.iter().zip(&log.scans) {
        hash.push(scan.pose);
        leave.push(recorded, scan.pose, None, scan.is_measured)?;
        if let Some(file) = &mut trajectory {
            file.push(&scan.stamp, scan.pose, !scan.is_measured)?;
        }
    }
    if let Some(file) = trajectory {
        file.finish()?;
    }
    let title = format!("beamfix: {} mapped", args.name());
    let caption = format!(
        "{count} scans, {} loops closed, pose hash {hash}",
        map.counters.loops
    );
    leave.finish(args, (title, caption), None)?;
    if let Some((path, grid)) = args.map_out.as_deref().zip(map.grid.as_ref()) {
        ros_map::write(grid, path)?;
    }
    let Counters {
        keyframes,
        no_room,
        pruned,
        tried,
        refused: no_match,
        waited,
        loops,
        dropped,
        solved,
        carried,
        joined,
    } = map.counters;
    let (scans, kept, bytes) = (map.scans.len(), map.keyframes.len(), map.bytes);
    let measured = map.scans.iter().filter(|scan| scan.is_measured).count();
    let not_located = map.scans.iter().filter(|scan| !scan.is_located).count();
    let refused = scans - measured;
    let last = map.scans.last().map_or(Pose::IDENTITY, |scan| scan.pose);
    let beams = match tier {
        mapping::Tier::Of64k => 512,
        mapping::Tier::Of192k => 720,
        mapping::Tier::Of512k => 1024,
    };
    let mut value = json!({
        "scans": scans, "refused": refused, "keyframes": keyframes, "lost": 0, "loops": loops,
        "keyframes_kept": kept, "keyframes_pruned": pruned, "keyframes_without_room": no_room,
        "matches_tried": tried, "matches_refused": no_match, "loops_waited": waited, "loops_dropped": dropped,
        "solved": solved, "carried": carried, "joined": joined, "not_located": not_located,
        "slam_bytes": bytes.0, "tier_bytes": bytes.1,
        "beams": beams, "refused_beams": map.refused_beams,
        "pose_hash": hash.to_string(),
    });
    add_context(&mut value, args, log, last);
    let Pose { x, y, theta } = last;
    let text = format!(
        "{scans} scans, {refused} refused, {keyframes} keyframes ({kept} kept, {pruned} pruned, {no_room} without room)\n\
         {loops} loops closed and {dropped} dropped of {tried} matches tried; the graph solved {solved} times\n\
         carried {carried} times, joined again {joined} times; {not_located} scans without a place in the map\n\
         {} bytes of graph, keyframes and working memory; {} with the odometry and a revolution\n\
         last pose {x:.3} m {y:.3} m {:.2}°\npose hash {hash}",
        bytes.0,
        bytes.1,
        theta.to_degrees(),
    );
    output::report(args.json, &value, &text)?;
    // As with odometry: the first keyframe alone is a pose by definition.
    let is_matched = measured > 1 || scans == 1;
    Ok(Done {
        scans,
        measured: if is_matched { measured } else { 0 },
        references: Some(keyframes),
        candidates: None,
    })
}
