//! `replay --mode slam`: odometry and pose graph over a recorded log, in the memory of a tier.

use std::collections::BTreeMap;

use anyhow::{Result, bail};
use beamfix::geometry::{EgoMotion, Pose};
use beamfix::odometry::{Odometry, Refusal, Step};
use beamfix::pipeline::Estimator;
use beamfix::scan::{Mount, Scan};
use beamfix::slam::{Counters, Placed, Slam, Slam192k, Slam512k, SlamConfig};
use host_tests::formats::Log;
use host_tests::pipeline::{config, follow};
use host_tests::report::hash::PoseHash;
use host_tests::sized;
use serde_json::json;

use super::args::{Args, Tier};
use super::{Done, add_context};
use crate::cli::output;

/// What a replay came to.
struct Outcome {
    scans: usize,
    measured: usize,
    refused_beams: u32,
    kept: usize,
    bytes: usize,
    counters: Counters,
    hash: PoseHash,
    last: Pose,
}

/// Work between two scans, in hundreds of instructions: with the odometry's 0.5 M, 1.5 M a scan.
const BUDGET: u32 = 10_000;

/// Replays the log with room for `size` beams a revolution and so many directions, and reports.
pub fn run(args: &Args, log: &Log, (size, directions): (usize, usize)) -> Result<Done> {
    let outcome = match args.tier {
        Some(Tier::Large) => sized!(size, small(args, log, directions))?,
        Some(Tier::Huge) | None => sized!(size, large(args, log, directions))?,
        Some(Tier::Small | Tier::Middle) => {
            bail!("--tier: slam needs the memory of 192k or 512k")
        }
    };
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
    } = outcome.counters;
    let refused = outcome.scans - outcome.measured;
    let mut value = json!({
        "scans": outcome.scans, "refused": refused, "keyframes": keyframes, "lost": 0, "loops": loops,
        "keyframes_kept": outcome.kept, "keyframes_pruned": pruned, "keyframes_without_room": no_room,
        "matches_tried": tried, "matches_refused": no_match, "loops_waited": waited, "loops_dropped": dropped,
        "solved": solved, "slam_bytes": outcome.bytes,
        "beams": size, "refused_beams": outcome.refused_beams,
        "pose_hash": outcome.hash.to_string(),
    });
    add_context(&mut value, args, log, outcome.last);
    let Pose { x, y, theta } = outcome.last;
    let text = format!(
        "{} scans, {refused} refused, {keyframes} keyframes ({} kept, {pruned} pruned, {no_room} without room)\n\
         {loops} loops closed and {dropped} dropped of {tried} matches tried; the graph solved {solved} times\n\
         {} bytes of graph, keyframes and working memory\n\
         last pose {x:.3} m {y:.3} m {:.2}°\npose hash {}",
        outcome.scans,
        outcome.kept,
        outcome.bytes,
        theta.to_degrees(),
        outcome.hash
    );
    output::report(args.json, &value, &text)?;
    // As with odometry: the first keyframe alone is a pose by definition.
    let is_matched = outcome.measured > 1 || outcome.scans == 1;
    Ok(Done {
        scans: outcome.scans,
        measured: if is_matched { outcome.measured } else { 0 },
        references: Some(keyframes),
    })
}

fn small<const N: usize>(args: &Args, log: &Log, directions: usize) -> Result<Outcome> {
    let slam = Box::new(Slam192k::new(SlamConfig::DEFAULT));
    replay::<N, _, _, _, _, _>(args, log, directions, slam)
}

fn large<const N: usize>(args: &Args, log: &Log, directions: usize) -> Result<Outcome> {
    let slam = Box::new(Slam512k::new(SlamConfig::DEFAULT));
    replay::<N, _, _, _, _, _>(args, log, directions, slam)
}

/// Odometry with SLAM over its points.
struct Mapper<
    'a,
    const N: usize,
    const K: usize,
    const E: usize,
    const L: usize,
    const B: usize,
    const V: usize,
> {
    odometry: Odometry<N>,
    mount: Mount,
    slam: &'a mut Slam<K, E, L, B, V>,
    places: &'a mut Places,
}

/// Where scans were placed, and which keyframes were merged into which.
#[derive(Default)]
struct Places {
    /// For each scan its keyframe, if there was one, and the lidar by odometry.
    scans: Vec<(Option<Placed>, Pose)>,
    merged: BTreeMap<u32, (u32, Pose)>,
}

impl Places {
    fn note<const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>(
        &mut self,
        slam: &mut Slam<K, E, L, B, V>,
    ) {
        if let Some(gone) = slam.take_merged() {
            self.merged.insert(gone.gone, (gone.into, gone.motion));
        }
    }
}

impl<const N: usize, const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>
    Estimator<N> for Mapper<'_, N, K, E, L, B, V>
{
    type Step = Step;

    fn update(&mut self, scan: &Scan<N>, ego: EgoMotion) -> Step {
        let step = self.odometry.update(scan, ego);
        let lidar = step.pose * self.mount.robot_from_lidar;
        let points = self.odometry.points().as_slice();
        let from = self.mount.robot_from_lidar;
        let placed = self.slam.update(step.pose, &step.covariance, from, points);
        self.places.scans.push((placed, lidar));
        self.slam.step(BUDGET);
        self.places.note(self.slam);
        step
    }
}

/// Runs odometry and SLAM over the log; at the end, when every keyframe has its last pose, each scan has one by the
/// keyframe that it was placed in.
fn replay<
    const N: usize,
    const K: usize,
    const E: usize,
    const L: usize,
    const B: usize,
    const V: usize,
>(
    args: &Args,
    log: &Log,
    directions: usize,
    mut slam: Box<Slam<K, E, L, B, V>>,
) -> Result<Outcome> {
    let mount = args.mount_of(log);
    let mut trajectory = args.open_trajectory()?;
    let count = args.count(log.scans.len());
    let bar = output::progress(count, "mapping");
    let mut places = Places::default();
    // Stamp of each scan, and whether a match gave its pose.
    let mut stamps = Vec::with_capacity(count);
    let mapper = Mapper::<N, K, E, L, B, V> {
        odometry: Odometry::new(config(mount, directions)),
        mount,
        slam: &mut slam,
        places: &mut places,
    };
    let followed = follow(
        log,
        (count, args.uses_wheels()),
        mapper,
        &mut |scan, _, step| {
            let is_first = step.keyframe && step.outcome == Err(Refusal::First);
            stamps.push((scan.stamp.clone(), step.outcome.is_ok() || is_first));
            bar.inc(1);
            Ok(())
        },
    )?
    .map(|_| ());
    while slam.step(BUDGET) {
        places.note(&mut slam);
    }
    bar.finish_and_clear();
    let nodes = slam.graph().nodes();
    let poses: BTreeMap<u32, Pose> = nodes.map(|(_, node)| (node.id, node.pose)).collect();
    let (mut hash, mut last) = (PoseHash::new(), Pose::IDENTITY);
    for ((stamp, is_measured), (place, odometry)) in stamps.iter().zip(&places.scans) {
        let lidar = match *place {
            // Before the first keyframe there is nothing but odometry.
            None => *odometry,
            Some(Placed {
                mut keyframe,
                mut motion,
            }) => {
                while let Some((into, between)) = places.merged.get(&keyframe) {
                    (keyframe, motion) = (*into, *between * motion);
                }
                poses[&keyframe] * motion
            }
        };
        last = lidar * mount.robot_from_lidar.inverse();
        hash.push(last);
        if let Some(file) = &mut trajectory {
            file.push(stamp, last, !is_measured)?;
        }
    }
    if let Some(file) = trajectory {
        file.finish()?;
    }
    Ok(Outcome {
        scans: followed.scans,
        measured: stamps
            .iter()
            .filter(|(_, is_measured)| *is_measured)
            .count(),
        refused_beams: followed.refused_beams,
        kept: slam.graph().len(),
        bytes: size_of::<Slam<K, E, L, B, V>>(),
        counters: slam.counters(),
        hash,
        last,
    })
}
