//! `replay --mode odometry`: motion from scan to scan, over a recorded log.

use anyhow::Result;
use beamfix::geometry::Pose;
use beamfix::odometry::{Counters, Odometry, Refusal};
use beamfix_sim::TruePose;
use host_tests::formats::Log;
use host_tests::pipeline::{Followed, config, follow};
use host_tests::report::picture;
use host_tests::report::track::{At, Track};
use host_tests::sized;
use serde_json::json;

use super::args::{Args, DRAWN};
use super::{Done, add_context};
use crate::cli::output;

/// Replays the log with room for `size` beams a revolution and so many directions, and reports.
pub fn run(args: &Args, log: &Log, (size, directions): (usize, usize)) -> Result<Done> {
    let outcome = sized!(size, replay(args, log, directions))?;
    let (counters, measured) = outcome.estimator;
    let Counters {
        keyframes, lost, ..
    } = counters;
    let scans = outcome.scans;
    // A scan before the first reference has no pose of its own either.
    let refused = scans - measured;
    let mut value = json!({
        "scans": scans, "refused": refused, "keyframes": keyframes, "lost": lost, "loops": 0,
        "beams": size, "refused_beams": outcome.refused_beams, "pose_hash": outcome.hash.to_string(),
    });
    add_context(&mut value, args, log, outcome.last);
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
    // The first reference alone is a pose by definition, and the work is done only where it was all there was.
    let is_matched = measured > 1 || scans == 1;
    Ok(Done {
        scans,
        measured: if is_matched { measured } else { 0 },
        references: Some(keyframes),
    })
}

/// The counters, and how many poses are measured.
type Counted = (Counters, usize);

fn replay<const N: usize>(args: &Args, log: &Log, directions: usize) -> Result<Followed<Counted>> {
    let mount = args.mount_of(log);
    let mut trajectory = args.open_trajectory()?;
    let mut measured = 0;
    let count = args.count(log.scans.len());
    let bar = output::progress(count, "replaying");
    let mut track = Track::new(
        TruePose::default(),
        mount.robot_from_lidar,
        (count / DRAWN).max(1),
    );
    let start = log.scans.iter().find_map(|scan| scan.wheels);
    let odometry = Odometry::<N>::new(config(mount, directions));
    let ego = (count, args.uses_wheels());
    let followed = follow(log, ego, odometry, &mut |scan, pose, step| {
        let is_first = step.keyframe && step.outcome == Err(Refusal::First);
        let is_measured = step.outcome.is_ok() || is_first;
        measured += usize::from(is_measured);
        if let Some(file) = &mut trajectory {
            file.push(&scan.stamp, pose, !is_measured)?;
        }
        if args.picture.is_some() {
            let us = scan.beams.last().map_or(0, |beam| beam.time_us);
            let wheels = start
                .zip(scan.wheels)
                .map(|(start, now)| start.between(now));
            let at = At {
                time: f64::from(us) * 1e-6,
                estimate: pose,
                truth: None,
                wheels,
            };
            track.push(at, &scan.beams);
        }
        bar.inc(1);
        Ok(())
    })?;
    bar.finish_and_clear();
    if let Some(path) = &args.picture {
        let name = args.name();
        let caption = format!("{count} scans, pose hash {}", followed.hash);
        picture::save(
            &track.map(format!("beamfix: odometry over {name}"), caption, None),
            path,
        )?;
    }
    if let Some(file) = trajectory {
        file.finish()?;
    }
    Ok(followed.map(|odometry| (odometry.counters(), measured)))
}
