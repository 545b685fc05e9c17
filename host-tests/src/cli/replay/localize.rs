//! `replay --mode localize`: where the robot is in a map, over a recorded log.

use std::io::Write;

use anyhow::{Context, Result};
use beamfix::geometry::{Pose, Twist};
use beamfix::localization::{Localizer, LocalizerConfig, Verdict};
use beamfix::matching::correlative::pyramid::Pyramid;
use beamfix::scan::{Points, PointsConfig, Scan};
use beamfix_sim::TruePose;
use host_tests::formats::Log;
use host_tests::formats::field::FieldFile;
use host_tests::report::hash::PoseHash;
use host_tests::report::picture;
use host_tests::report::track::{At, Track};
use host_tests::sized;
use serde_json::json;

use super::args::{Args, DRAWN};
use crate::cli::output;

/// Bytes that a search may look up between two scans: a fifth of a second of an M4F at 168 MHz.
const BUDGET: u32 = 10_000_000;

/// What a replay in a map came to.
#[derive(Default)]
struct Outcome {
    scans: usize,
    /// Scans with a pose that the map confirms.
    tracked: usize,
    /// Scans whose pose is predicted by odometry alone.
    doubtful: usize,
    /// Times the pose was lost.
    lost: u32,
    searches: u32,
    refused_beams: usize,
    hash: PoseHash,
    last: Pose,
}

/// Localizes the log with room for `size` beams a revolution, and reports.
pub fn run(args: &Args, log: &Log, size: usize) -> Result<()> {
    let outcome = sized!(size, in_map(args, log))?;
    let value = json!({
        "scans": outcome.scans, "refused": outcome.scans - outcome.tracked, "keyframes": 0, "loops": 0,
        "tracked": outcome.tracked, "doubtful": outcome.doubtful, "lost": outcome.lost, "searches": outcome.searches,
        "beams": size, "refused_beams": outcome.refused_beams, "skipped": log.skipped,
        "pose_hash": outcome.hash.to_string(),
    });
    let Pose { x, y, theta } = outcome.last;
    let text = format!(
        "{} scans, {} with a pose, {} doubtful, {} times lost, {} searches\n\
         last pose {x:.3} m {y:.3} m {:.2}°\npose hash {}",
        outcome.scans,
        outcome.tracked,
        outcome.doubtful,
        outcome.lost,
        outcome.searches,
        theta.to_degrees(),
        outcome.hash
    );
    output::report(args.json, &value, &text)?;
    Ok(())
}

/// Localizes every scan; a scan without a pose repeats the last one.
fn in_map<const N: usize>(args: &Args, log: &Log) -> Result<Outcome> {
    let path = args.map.as_deref().context("--map is missing")?;
    let file = FieldFile::read(path)?;
    let field = file.field()?;
    let mut buffer = vec![0; Pyramid::bytes(field.grid().shape())];
    let pyramid = Pyramid::new(field, &mut buffer)?;
    let mut robot = Box::new(Localizer::<96>::new(pyramid, LocalizerConfig::DEFAULT));
    let mount = args.mount_of(log);
    if let Some(start) = args.start {
        robot.start_at(start * mount.robot_from_lidar);
    }
    let mut trajectory = args.trajectory.as_deref().map(output::create).transpose()?;
    let count = args.count(log.scans.len());
    let bar = output::progress(count, "localizing");
    let mut outcome = Outcome {
        scans: count,
        ..Outcome::default()
    };
    let (mut scan, mut points) = (Box::new(Scan::<N>::new()), Box::new(Points::<N>::new()));
    let mut before: Option<Pose> = None;
    let mut track = Track::new(
        TruePose::default(),
        mount.robot_from_lidar,
        (count / DRAWN).max(1),
    );
    for recorded in &log.scans[..count] {
        scan.clear();
        for &beam in &recorded.beams {
            outcome.refused_beams += usize::from(scan.push(beam).is_err());
        }
        let wheels = args.prior.of(recorded.wheels);
        let robot_motion = match (before, wheels) {
            (Some(before), Some(now)) => before.between(now),
            _ => Pose::IDENTITY,
        };
        before = wheels;
        let motion = mount.lidar_motion(robot_motion);
        points.assign(
            &scan,
            Twist::from_motion(motion, scan.duration()),
            &PointsConfig {
                mount,
                ..PointsConfig::DEFAULT
            },
        );
        match robot.update(points.as_slice(), motion) {
            Verdict::Tracking(..) => outcome.tracked += 1,
            Verdict::Doubtful(_) => outcome.doubtful += 1,
            Verdict::Searching | Verdict::Choosing { .. } => {}
        }
        robot.step(BUDGET);
        if let Some(pose) = robot.pose() {
            outcome.last = pose * mount.robot_from_lidar.inverse();
            if args.picture.is_some() {
                let us = recorded.beams.last().map_or(0, |beam| beam.time_us);
                let at = At {
                    time: f64::from(us) * 1e-6,
                    estimate: outcome.last,
                    truth: None,
                    wheels: None,
                };
                track.push(at, &recorded.beams);
            }
        }
        outcome.hash.push(outcome.last);
        if let Some(file) = &mut trajectory {
            let Pose { x, y, theta } = outcome.last;
            writeln!(file, "{} {x} {y} {theta}", recorded.stamp)?;
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    if let Some(mut file) = trajectory {
        file.flush()?;
    }
    if let Some(path) = &args.picture {
        let caption = format!("{count} scans, pose hash {}", outcome.hash);
        let title = format!("beamfix: {} localized", args.name());
        picture::save(&track.map(title, caption, None), path)?;
    }
    outcome.lost = robot.counters().lost;
    outcome.searches = robot.counters().searches;
    Ok(outcome)
}
