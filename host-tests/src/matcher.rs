//! Pairs of scans, matched one after the other.

use beamfix::geometry::{Pose, Twist};
use beamfix::matching::icp::{self, IcpConfig, Reference};
use beamfix::matching::{Match, MatchError};
use beamfix::scan::{Beam, Points, PointsConfig, Scan, ScanPoint};
use beamfix_sim::TruePose;

use crate::formats::pairs::{Pair, Pairs};

/// A matcher with its memory.
pub struct Matcher<const N: usize> {
    scan: Scan<N>,
    /// Places hit by the current scan.
    pub points: Points<N>,
    /// Places hit by the reference.
    pub reference_points: Points<N>,
    reference: Reference<N>,
}

impl<const N: usize> Matcher<N> {
    /// Nothing to match yet.
    #[must_use]
    pub fn new() -> Box<Self> {
        Box::new(Self {
            scan: Scan::new(),
            points: Points::new(),
            reference_points: Points::new(),
            reference: Reference::new(),
        })
    }

    /// Matches a pair; `observe` is shown the estimate after every pass.
    // A function of its own, so that its instructions can be counted: `tests/matching/host_cost.rs`.
    #[inline(never)]
    pub fn run(
        &mut self,
        list: &Pairs,
        pair: &Pair,
        config: &IcpConfig,
        observe: impl FnMut(Pose),
    ) -> Result<Match, MatchError> {
        place(
            &mut self.scan,
            &list.scans[pair.reference],
            &mut self.reference_points,
        );
        self.reference.assign(self.reference_points.as_slice());
        place(&mut self.scan, &list.scans[pair.current], &mut self.points);
        icp::align_observed(
            &self.reference,
            self.points.as_slice(),
            pair.guess,
            config,
            observe,
        )
    }

    /// The lines that the current points are matched to.
    #[must_use]
    pub fn reference(&self) -> &Reference<N> {
        &self.reference
    }
}

fn place<const N: usize>(scan: &mut Scan<N>, beams: &[Beam], points: &mut Points<N>) {
    scan.clear();
    for &beam in beams.iter().take(N) {
        // N are taken: they fit.
        let _ = scan.push(beam);
    }
    points.assign(scan, Twist::ZERO, &PointsConfig::DEFAULT);
}

/// A point placed with `pose` (m), and its correspondence as the matcher finds it: the foot on the line that the reference
/// has in that direction, unless the weighted distance is beyond the gate (mm).
#[must_use]
pub fn correspondence<const N: usize>(
    reference: &Reference<N>,
    pose: Pose,
    point: &ScanPoint,
    gate: f64,
) -> ([f64; 2], Option<[f64; 2]>) {
    let [x, y] = metres_of(point.x(), point.y());
    let at = TruePose::from(pose).then(TruePose::new(x, y, 0.0));
    let turn = libm::atan2(at.y, at.x) / core::f64::consts::TAU + 1.0;
    let index = (turn * N as f64 + 0.5) as usize % N.max(1);
    let line = reference.lines().get(index).filter(|line| line.is_some());
    let foot = line.and_then(|line| {
        let (mx, my) = (f64::from(line.mx), f64::from(line.my));
        let [qx, qy] = metres_of(line.qx, line.qy);
        let (dx, dy) = (at.x - qx, at.y - qy);
        let weighted_mm = (mx * dx + my * dy) / 1024.0 * 1000.0;
        let along = (mx * dx + my * dy) / (mx * mx + my * my);
        let near = dx.abs() < 8.0 && dy.abs() < 8.0;
        (near && weighted_mm.abs() < gate).then_some([at.x - along * mx, at.y - along * my])
    });
    ([at.x, at.y], foot)
}

/// A place in millimetres, in metres.
#[must_use]
pub fn metres_of(x: i16, y: i16) -> [f64; 2] {
    [f64::from(x) * 1e-3, f64::from(y) * 1e-3]
}
