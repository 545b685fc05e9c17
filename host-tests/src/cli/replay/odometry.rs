//! `replay --mode odometry`: motion from scan to scan, over a recorded log.

use std::io::Write;

use anyhow::Result;
use beamfix::geometry::Pose;
use beamfix::odometry::{Counters, OdometryConfig};
use beamfix_sim::TruePose;
use host_tests::formats::Log;
use host_tests::pipeline::Pipeline;
use host_tests::report::hash::PoseHash;
use host_tests::report::picture;
use host_tests::report::track::{At, Track};
use host_tests::sized;
use serde_json::json;

use super::args::{Args, DRAWN};
use crate::cli::output;

/// What a replay came to.
struct Outcome {
    counters: Counters,
    refused_beams: usize,
    hash: PoseHash,
    last: Pose,
}

/// Replays the log with room for `size` beams a revolution, and reports.
pub fn run(args: &Args, log: &Log, size: usize) -> Result<()> {
    let outcome = sized!(size, replay(args, log))?;
    let Counters {
        scans,
        refused,
        keyframes,
        lost,
    } = outcome.counters;
    let value = json!({
        "scans": scans, "refused": refused, "keyframes": keyframes, "lost": lost, "loops": 0,
        "beams": size, "refused_beams": outcome.refused_beams, "skipped": log.skipped, "bad_readings": log.odd.bad,
        "pose_hash": outcome.hash.to_string(),
    });
    let Pose { x, y, theta } = outcome.last;
    let mut text = format!(
        "{scans} scans, {refused} refused, {keyframes} keyframes, {lost} times lost\n\
         last pose {x:.3} m {y:.3} m {:.2}°\npose hash {}",
        theta.to_degrees(),
        outcome.hash
    );
    if outcome.refused_beams > 0 {
        text += &format!(
            "\n{} beams found no room: this configuration has {size} a revolution",
            outcome.refused_beams
        );
    }
    output::report(args.json, &value, &text)?;
    Ok(())
}

fn replay<const N: usize>(args: &Args, log: &Log) -> Result<Outcome> {
    let mount = args.mount_of(log);
    let config = OdometryConfig::DEFAULT.with_mount(mount);
    let mut pipeline = Pipeline::<N>::new(config);
    let mut trajectory = args.trajectory.as_deref().map(output::create).transpose()?;
    let count = args.count(log.scans.len());
    let bar = output::progress(count, "replaying");
    let mut last = Pose::IDENTITY;
    let mut track = Track::new(
        TruePose::default(),
        mount.robot_from_lidar,
        (count / DRAWN).max(1),
    );
    let start = log.scans.first().and_then(|scan| scan.wheels);
    for scan in &log.scans[..count] {
        let wheels = args.prior.of(scan.wheels);
        last = pipeline.step(&scan.beams, wheels).pose;
        if let Some(file) = &mut trajectory {
            writeln!(file, "{} {} {} {}", scan.stamp, last.x, last.y, last.theta)?;
        }
        if args.picture.is_some() {
            let us = scan.beams.last().map_or(0, |beam| beam.time_us);
            let wheels = start
                .zip(scan.wheels)
                .map(|(start, now)| start.between(now));
            let at = At {
                time: f64::from(us) * 1e-6,
                estimate: last,
                truth: None,
                wheels,
            };
            track.push(at, &scan.beams);
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    if let Some(path) = &args.picture {
        let name = args.name();
        let caption = format!("{count} scans, pose hash {}", pipeline.hash);
        picture::save(
            &track.map(format!("beamfix: odometry over {name}"), caption, None),
            path,
        )?;
    }
    if let Some(mut file) = trajectory {
        file.flush()?;
    }
    Ok(Outcome {
        counters: pipeline.counters(),
        refused_beams: pipeline.refused_beams,
        hash: pipeline.hash,
        last,
    })
}
