//! Every choice of every stage of ICP, and the virtual scan, linked once so that `prove-no-panic` sees them, and so that
//! a program with one choice a stage can be seen not to have the others.
//!
//! No file, no measurement: points come from outside, and what is found goes there.

use core::hint::black_box;

use beamfix::{
    geometry::Pose,
    matching::{
        icp::modular::{
            self, Stages, Workspace,
            correspondence::{
                BruteForce, Closest, ClosestCompatible, Correspond, NormalShooting, Projection,
            },
            minimisation::{Constrained, Minimise, PointToLine, PointToPoint},
            rejection::{
                self, Boundary, Doubles, MedianMultiple, Nothing, Reject, Trimmed, Visibility,
                WorstShare,
            },
            selection::{All, EveryNth, Features, NormalSpace, Random, Select},
            weighting::{
                self, Cauchy, Constant, GemanMcClure, Huber, Normals, RangeUncertainty, Tukey,
                Weigh,
            },
        },
        virtual_scan::VirtualScan,
    },
    scan::ScanPoint,
};

/// Points of a scan that are used.
const POINTS: usize = 32;

/// The memory that it needs.
pub struct Choices {
    workspace: Workspace<POINTS>,
    seen: VirtualScan<POINTS>,
}

impl Choices {
    /// Nothing in it.
    #[allow(clippy::new_without_default, reason = "for statics")]
    pub const fn new() -> Self {
        Self {
            workspace: Workspace::new(),
            seen: VirtualScan::new(),
        }
    }

    /// Calls every choice for ever, with what the compiler does not know.
    pub fn forever(&mut self) -> ! {
        let points = black_box([ScanPoint::default(); POINTS]);
        let guess = black_box(Pose::IDENTITY);
        loop {
            black_box(self.run(&points, guess));
        }
    }

    /// Calls every choice once, each beside the default ones.
    fn run(&mut self, points: &[ScanPoint], guess: Pose) -> f32 {
        self.seen.assign(guess, [(points, guess); 2]);
        let line = PointToLine;
        self.align(
            points,
            guess,
            All,
            Closest::default(),
            Constant,
            Trimmed::default(),
            line,
        ) + self.align(
            points,
            guess,
            EveryNth::default(),
            BruteForce,
            Huber::default(),
            Nothing,
            line,
        ) + self.align(
            points,
            guess,
            Random::default(),
            ClosestCompatible::default(),
            (Cauchy::default(), Normals),
            (Boundary, rejection::Distance::default()),
            PointToPoint,
        ) + self.align(
            points,
            guess,
            Features::default(),
            NormalShooting::default(),
            (GemanMcClure::default(), weighting::Distance::default()),
            (WorstShare::default(), MedianMultiple::default()),
            Constrained,
        ) + self.align(
            points,
            guess,
            NormalSpace::default(),
            Projection::<POINTS>::new(),
            (Tukey::default(), RangeUncertainty::default()),
            (Visibility, Doubles::default()),
            line,
        )
    }

    #[allow(clippy::too_many_arguments, reason = "one a stage")]
    fn align(
        &mut self,
        points: &[ScanPoint],
        guess: Pose,
        selection: impl Select,
        correspondence: impl Correspond,
        weighting: impl Weigh,
        rejection: impl Reject,
        minimisation: impl Minimise,
    ) -> f32 {
        let mut stages = Stages {
            selection,
            correspondence,
            weighting,
            rejection,
            minimisation,
            limits: modular::Limits::DEFAULT,
        };
        let found = modular::align(
            self.seen.as_slice(),
            points,
            guess,
            &mut stages,
            &mut self.workspace,
        );
        found.map_or(0.0, |found| found.pose.x)
    }
}
