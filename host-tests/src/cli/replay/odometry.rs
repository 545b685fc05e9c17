//! `replay --mode odometry`: motion from scan to scan, over a recorded log; alone, or below a rolling map.

use anyhow::Result;
use beamfix::geometry::Pose;
use beamfix::odometry::{Odometry, Step};
use beamfix::pipeline::{Estimate as _, Estimator, Mapper64k};
use host_tests::formats::Log;
use host_tests::pipeline::{Followed, config, follow, is_measured, sparse_odometry};
use host_tests::{size, sized};
use serde_json::json;

use super::args::Args;
use super::{Done, add_context};
use crate::cli::output;

/// Replays the log with room for `size` beams a revolution and so many directions, and reports.
pub fn run(args: &Args, log: &Log, (size, directions): (usize, usize)) -> Result<Done> {
    let width = size::beam_width(log.scans.iter().map(|scan| &scan.beams[..]));
    let outcome = match width {
        Some(width) => {
            output::remark(&[format!(
                "beams {:.1}° apart are a ring of rangers: the last {} scans together are what the next one is matched against",
                width.to_degrees(),
                size::GATHERED
            )]);
            let odometry = sparse_odometry(args.mount_of(log), width);
            replay(args, log, (odometry, "odometry"), step, |_| 0)
        }
        None => sized!(size, turning(args, log, directions)),
    }?;
    report(args, log, size, &outcome)
}

/// Replays the log through the rolling map of the tier of 64 KB, with so many directions, and reports.
pub fn run_rolling(args: &Args, log: &Log, directions: usize) -> Result<Done> {
    let mapper = Mapper64k::new(config(args.mount_of(log), directions));
    let outcome = replay::<_, 512>(
        args,
        log,
        (mapper, "rolling map"),
        |step| &step.odometry,
        |mapper| mapper.odometry().counters().lost,
    )?;
    report(args, log, 512, &outcome)
}

fn step(step: &Step) -> &Step {
    step
}

fn report(args: &Args, log: &Log, size: usize, outcome: &Followed<Counted>) -> Result<Done> {
    let &Counted {
        keyframes,
        lost,
        measured,
    } = &outcome.estimator;
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
        candidates: None,
    })
}

/// Keyframes made and given up, and how many poses are measured.
struct Counted {
    keyframes: u32,
    lost: u32,
    measured: usize,
}

/// A lidar that turns, with room for N beams a revolution and so many directions.
fn turning<const N: usize>(args: &Args, log: &Log, directions: usize) -> Result<Followed<Counted>> {
    let odometry = Odometry::<N>::new(config(args.mount_of(log), directions));
    let lost = |odometry: &Odometry<N>| odometry.counters().lost;
    replay(args, log, (odometry, "odometry"), step, lost)
}

/// Replays with an estimator of this name; `of` is what its odometry says, `lost` counts the keyframes that it has given up.
fn replay<E: Estimator<N>, const N: usize>(
    args: &Args,
    log: &Log,
    (estimator, name): (E, &str),
    of: impl Fn(&E::Step) -> &Step,
    lost: impl Fn(&E) -> u32,
) -> Result<Followed<Counted>> {
    let mut trajectory = args.open_trajectory()?;
    let (mut measured, mut keyframes) = (0, 0);
    let count = args.count(log.scans.len());
    let bar = output::progress(count, "replaying");
    let is_turning = size::beam_width(log.scans.iter().map(|scan| &scan.beams[..])).is_none();
    let mut leave = args.leave(log, is_turning)?;
    let ego = (count, args.uses_wheels());
    let followed = follow(log, ego, estimator, &mut |scan, pose, told| {
        let step = of(told);
        let is_measured = is_measured(step);
        measured += usize::from(is_measured);
        keyframes += u32::from(step.keyframe);
        if let Some(file) = &mut trajectory {
            file.push(&scan.stamp, pose, !is_measured)?;
        }
        leave.push(scan, pose, told.covariance(), is_measured)?;
        bar.inc(1);
        Ok(())
    })?;
    bar.finish_and_clear();
    let caption = format!("{count} scans, pose hash {}", followed.hash);
    let title = format!("beamfix: {name} over {}", args.name());
    leave.finish(args, (title, caption), None)?;
    if let Some(file) = trajectory {
        file.finish()?;
    }
    Ok(followed.map(|estimator| Counted {
        keyframes,
        lost: lost(&estimator),
        measured,
    }))
}
