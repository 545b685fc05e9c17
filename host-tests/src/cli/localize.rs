//! `replay --mode localize`: where the robot is in a map, over a recorded log.

use std::io::Write;

use anyhow::{Context, Result};
use beamfix::geometry::{Pose, Twist};
use beamfix::grid::occupancy;
use beamfix::localization::{Localizer, LocalizerConfig, Verdict};
use beamfix::matching::correlative::pyramid::Pyramid;
use beamfix::scan::{Mount, Points, PointsConfig, Scan};
use beamfix::sensor_model::likelihood_field::{FieldModel, LikelihoodField, Profile};
use host_tests::formats::Log;
use host_tests::formats::ros_map;
use host_tests::report::hash::PoseHash;

use super::output;
use super::replay::Args;

/// Bytes that a search may look up between two scans: a fifth of a second of an M4F at 168 MHz.
const BUDGET: u32 = 10_000_000;

/// What a replay in a map came to.
#[derive(Default)]
pub struct Outcome {
    pub scans: usize,
    /// Scans with a pose that the map confirms.
    pub tracked: usize,
    /// Scans whose pose is predicted by odometry alone.
    pub doubtful: usize,
    /// Times the pose was lost.
    pub lost: u32,
    pub searches: u32,
    pub refused_beams: usize,
    pub hash: PoseHash,
    pub last: Pose,
}

/// Localizes every scan; a scan without a pose repeats the last one.
pub fn replay<const N: usize>(args: &Args, log: &Log) -> Result<Outcome> {
    let path = args
        .map
        .as_deref()
        .context("--mode localize needs --map MAP.yaml")?;
    let map = ros_map::read(path)?;
    let squares = ros_map::squares(&map, occupancy::is_occupied);
    let profile = Profile::new(&FieldModel::DEFAULT);
    let cells = vec![0; map.shape().len()];
    let field = LikelihoodField::from_map(&map.as_slice(), &squares, &profile, cells)?;
    let mut buffer = vec![0; Pyramid::bytes(map.shape())];
    let pyramid = Pyramid::new(field.as_slice(), &mut buffer)?;
    let mut robot = Box::new(Localizer::<96>::new(pyramid, LocalizerConfig::DEFAULT));
    let mount = Mount {
        robot_from_lidar: args.mount.unwrap_or(log.robot_from_lidar),
        ..Mount::DEFAULT
    };
    if let Some(start) = args.start {
        robot.start_at(start * mount.robot_from_lidar);
    }
    let mut trajectory = args.trajectory.as_deref().map(output::create).transpose()?;
    let count = args
        .scans
        .map_or(log.scans.len(), |most| most.min(log.scans.len()));
    let bar = output::progress(count, "localizing");
    let mut outcome = Outcome {
        scans: count,
        ..Outcome::default()
    };
    let (mut scan, mut points) = (Box::new(Scan::<N>::new()), Box::new(Points::<N>::new()));
    let mut before: Option<Pose> = None;
    for recorded in &log.scans[..count] {
        scan.clear();
        for &beam in &recorded.beams {
            outcome.refused_beams += usize::from(scan.push(beam).is_err());
        }
        let wheels = recorded.wheels.filter(|_| args.uses_wheels());
        let robot_motion = match (before, wheels) {
            (Some(before), Some(now)) => before.between(now),
            _ => Pose::IDENTITY,
        };
        before = wheels;
        let motion = mount.lidar_motion(robot_motion);
        points.assign(
            &scan,
            Twist::from_motion(motion, scan.duration()),
            &PointsConfig::DEFAULT,
        );
        match robot.update(points.as_slice(), motion) {
            Verdict::Tracking(..) => outcome.tracked += 1,
            Verdict::Doubtful(_) => outcome.doubtful += 1,
            Verdict::Searching | Verdict::Choosing { .. } => {}
        }
        robot.step(BUDGET);
        if let Some(pose) = robot.pose() {
            outcome.last = pose * mount.robot_from_lidar.inverse();
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
    outcome.lost = robot.counters().lost;
    outcome.searches = robot.counters().searches;
    Ok(outcome)
}
