//! Pairs of scans, matched one after the other.

use beamfix::geometry::{Pose, Twist};
use beamfix::matching::icp::{self, IcpConfig, Reference};
use beamfix::matching::{Match, MatchError};
use beamfix::scan::{Beam, Points, PointsConfig, Scan};

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
