//! A robot that drives through a world with odometry that drifts.

use std::collections::BTreeMap;

use beamfix::{
    geometry::Pose,
    linalg::{Covariance, Sym3},
    slam::{Placed, Slam},
};
use beamfix_sim::{noise::Noise, pose::TruePose, world::World};

use crate::common;

/// From one scan to the next (m).
pub const STEP: f64 = 0.25;

/// Poses along a closed path of corners, `rounds` times over; the robot turns on the spot at each.
pub fn path(corners: &[[f64; 2]], rounds: usize) -> Vec<TruePose> {
    let mut poses = Vec::new();
    let mut heading: Option<f64> = None;
    for k in 0..rounds * corners.len() {
        let (a, b) = (corners[k % corners.len()], corners[(k + 1) % corners.len()]);
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let towards = dy.atan2(dx);
        let turn = beamfix_sim::pose::wrap(towards - heading.unwrap_or(towards));
        let turns = (turn.abs() / 0.3).ceil() as usize;
        for t in 1..=turns {
            let part = turn * (t as f64 / turns as f64 - 1.0);
            poses.push(TruePose::new(a[0], a[1], towards + part));
        }
        let steps = (dx.hypot(dy) / STEP).round() as usize;
        for s in 1..=steps {
            let share = s as f64 / steps as f64;
            poses.push(TruePose::new(a[0] + share * dx, a[1] + share * dy, towards));
        }
        heading = Some(towards);
    }
    poses
}

/// What became of a drive.
pub struct Driven {
    /// Whether each scan is in the map in the end, and was when it came in.
    pub in_map: Vec<bool>,
    pub located: Vec<bool>,
    /// Pose of each scan in the end, and by odometry.
    pub mapped: Vec<Pose>,
    pub odometry: Vec<Pose>,
}

impl Driven {
    /// Largest distance of a pose from the truth (m): by SLAM and by odometry.
    pub fn errors(&self, truth: &[TruePose]) -> (f64, f64) {
        let largest = |poses: &[Pose]| {
            let off = |(pose, truth): (&Pose, &TruePose)| {
                (f64::from(pose.x) - truth.x).hypot(f64::from(pose.y) - truth.y)
            };
            poses.iter().zip(truth).map(off).fold(0.0, f64::max)
        };
        (largest(&self.mapped), largest(&self.odometry))
    }
}

/// Drives along `truth`; odometry turns by `drift` (rad/m) too much, and tells twice that.
pub fn drive<const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>(
    slam: &mut Slam<K, E, L, B, V>,
    world: &World,
    truth: &[TruePose],
    drift: f64,
    seed: u64,
) -> Driven {
    drive_and_carry(slam, world, truth, &[], drift, seed)
}

/// The same; before the poses `carried` the robot is carried there, which odometry knows no more of than that it happened.
pub fn drive_and_carry<
    const K: usize,
    const E: usize,
    const L: usize,
    const B: usize,
    const V: usize,
>(
    slam: &mut Slam<K, E, L, B, V>,
    world: &World,
    truth: &[TruePose],
    carried: &[usize],
    drift: f64,
    seed: u64,
) -> Driven {
    let mut noise = Noise::new(seed, 3);
    let narrow = |pose: TruePose| Pose::new(pose.x as f32, pose.y as f32, pose.theta as f32);
    let mut merged = BTreeMap::new();
    let (mut odometry, mut covariance) = (truth[0], Covariance::default());
    let mut placed: Vec<Placed> = Vec::new();
    let mut driven = Driven {
        in_map: Vec::new(),
        located: Vec::new(),
        mapped: Vec::new(),
        odometry: Vec::new(),
    };
    for (k, &place) in truth.iter().enumerate() {
        if carried.contains(&k) {
            // What odometry tells that was covered for a second: 2.6 m, and any heading.
            let Sym3 { xx, yy, tt, .. } = covariance.0;
            covariance = Covariance(Sym3 {
                xx: xx + 2.6,
                yy: yy + 2.6,
                tt: tt + 3.2,
                ..covariance.0
            });
        } else if k > 0 {
            let motion = truth[k - 1].between(place);
            let length = motion.x.hypot(motion.y);
            let before = odometry;
            let error = TruePose::new(0.0, 0.0, drift * length);
            odometry = odometry.then(motion).then(error);
            let told = (4.0 * drift * drift * length * length) as f32;
            let (dx, dy) = (
                (odometry.x - before.x) as f32,
                (odometry.y - before.y) as f32,
            );
            let Sym3 {
                xx,
                xy,
                xt,
                yy,
                yt,
                tt,
            } = covariance.0;
            // An error of heading before is one of position here.
            covariance = Covariance(Sym3 {
                xx: xx - 2.0 * dy * xt + dy * dy * tt + 1e-6,
                xy: xy + dx * xt - dy * yt - dx * dy * tt,
                xt: xt - dy * tt,
                yy: yy + 2.0 * dx * yt + dx * dx * tt + 1e-6,
                yt: yt + dx * tt,
                tt: tt + told,
            });
        }
        let points = common::points_from(world, place, 360, &mut noise);
        let at = slam.update(narrow(odometry), &covariance, Pose::IDENTITY, &points);
        placed.push(at.expect("a keyframe"));
        driven.odometry.push(narrow(odometry));
        driven.located.push(slam.is_located());
        slam.step(50_000);
        note(slam, &mut merged);
    }
    while slam.step(50_000) {
        note(slam, &mut merged);
    }
    for mut at in placed {
        while let Some((into, motion)) = merged.get(&at.keyframe) {
            at = Placed {
                keyframe: *into,
                motion: *motion * at.motion,
            };
        }
        let mut nodes = slam.graph().nodes();
        let node = nodes.find(|(_, node)| node.id == at.keyframe);
        let is_in_map = node.is_some_and(|(slot, _)| slam.is_in_map(slot));
        driven.in_map.push(is_in_map);
        driven
            .mapped
            .push(slam.pose(&at).expect("a keyframe that is there"));
    }
    driven
}

fn note<const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>(
    slam: &mut Slam<K, E, L, B, V>,
    merged: &mut BTreeMap<u32, (u32, Pose)>,
) {
    if let Some(gone) = slam.take_merged() {
        merged.insert(gone.gone, (gone.into, gone.motion));
    }
}
