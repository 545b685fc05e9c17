//! `replay --mode localize`: where the robot is in a map, over a recorded log.

use anyhow::{Context, Result};
use beamfix::geometry::Pose;
use beamfix::localization::{Localizer, LocalizerConfig, Verdict as Localization};
use beamfix::matching::correlative::pyramid::Pyramid;
use beamfix::pipeline::{Estimate as _, MapLocalizer, Verdict};
use beamfix::scan::PointsConfig;
use host_tests::formats::Log;
use host_tests::formats::field::FieldFile;
use host_tests::pipeline::follow;
use host_tests::report::hash::PoseHash;
use host_tests::sized;
use serde_json::json;

use super::args::Args;
use super::{Done, add_context};
use crate::cli::output;

/// What a replay in a map came to.
struct Outcome {
    scans: usize,
    /// Scans with a pose that the map confirms.
    tracked: usize,
    /// Scans whose pose is predicted by odometry alone.
    doubtful: usize,
    /// Times the pose was lost.
    lost: u32,
    searches: u32,
    /// Candidates of the scan that agreed best with one of them, and how well (a share of its beams).
    candidates: Option<(u8, f32)>,
    refused_beams: u32,
    hash: PoseHash,
    last: Pose,
}

/// Localizes the log with room for `size` beams a revolution, and reports.
pub fn run(args: &Args, log: &Log, size: usize) -> Result<Done> {
    let outcome = sized!(size, in_map(args, log))?;
    let mut value = json!({
        "scans": outcome.scans, "refused": outcome.scans - outcome.tracked, "keyframes": 0, "loops": 0,
        "tracked": outcome.tracked, "doubtful": outcome.doubtful, "lost": outcome.lost, "searches": outcome.searches,
        "beams": size, "refused_beams": outcome.refused_beams, "pose_hash": outcome.hash.to_string(),
    });
    add_context(&mut value, args, log, outcome.last);
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
    Ok(Done {
        scans: outcome.scans,
        measured: outcome.tracked,
        references: None,
        candidates: outcome.candidates,
    })
}

/// Localizes every scan; a scan without a pose repeats the last one, marked as a guess.
fn in_map<const N: usize>(args: &Args, log: &Log) -> Result<Outcome> {
    let path = args.map.as_deref().context("--map is missing")?;
    let mut remarks = Vec::new();
    let file = FieldFile::read(path, &mut remarks)?;
    output::remark(&remarks);
    let field = file.field()?;
    let mut buffer = vec![0; Pyramid::bytes(field.grid().shape())];
    let pyramid = Pyramid::new(field, &mut buffer)?;
    let mount = args.mount_of(log);
    let points = PointsConfig {
        mount,
        ..PointsConfig::DEFAULT
    };
    let localizer = Localizer::<96>::new(pyramid, LocalizerConfig::DEFAULT);
    let mut localizer = MapLocalizer::<N, 96>::new(localizer, points);
    if let Some(start) = args.start {
        localizer.start_at(start);
    }
    let mut trajectory = args.open_trajectory()?;
    let count = args.count(log.scans.len());
    let bar = output::progress(count, "localizing");
    let mut leave = args.leave(log, true)?;
    let (mut tracked, mut doubtful) = (0, 0);
    let mut candidates: Option<(u8, f32)> = None;
    let ego = (count, args.uses_wheels());
    let followed = follow(log, ego, localizer, &mut |scan, pose, located| {
        match located.verdict() {
            Verdict::Measured => tracked += 1,
            Verdict::Predicted => doubtful += 1,
            Verdict::Unknown => {}
        }
        if let Localization::Choosing {
            candidates: count,
            best,
        } = located.outcome
            && candidates.is_none_or(|(_, before)| best > before)
        {
            candidates = Some((count, best));
        }
        if located.pose.is_some() {
            let is_measured = located.verdict() == Verdict::Measured;
            leave.push(scan, pose, located.covariance, is_measured)?;
        }
        if let Some(file) = &mut trajectory {
            let is_guess = located.verdict() != Verdict::Measured;
            file.push(&scan.stamp, pose, is_guess)?;
        }
        bar.inc(1);
        Ok(())
    })?;
    bar.finish_and_clear();
    if let Some(file) = trajectory {
        file.finish()?;
    }
    let caption = format!("{count} scans, pose hash {}", followed.hash);
    let title = format!("beamfix: {} localized", args.name());
    leave.finish(args, (title, caption), Some(file.field()?))?;
    let counters = followed.estimator.localizer().counters();
    Ok(Outcome {
        scans: followed.scans,
        tracked,
        doubtful,
        lost: counters.lost,
        searches: counters.searches,
        candidates,
        refused_beams: followed.refused_beams,
        hash: followed.hash,
        last: followed.last,
    })
}
