//! How an odometry does in a simulated scene: how far off, refused, and whether it says so.

use beamfix::{
    geometry::Pose,
    linalg::Sym3,
    odometry::{OdometryConfig, Step},
    scan::Mount,
};
use beamfix_sim::{
    Revolution, Scene, TruePose,
    catalogue::{Entry, Must},
    pose::wrap,
};

use super::hash::PoseHash;
use crate::{pipeline::Pipeline, size, sized};

/// A pose farther off than this (m, deg) is wrong ...
const WRONG: (f64, f64) = (0.05, 1.0);
/// ... and confident if its squared error, normalised by the covariance, is above this: 3 is ideal.
const CONFIDENT: f64 = 25.0;

/// What came of one scene with one seed.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// Scans given.
    pub scans: u32,
    /// Scans without a match of their own, the first one not counted.
    pub refused: u32,
    /// Keyframes given up.
    pub lost: u32,
    /// Distance driven (m).
    pub driven: f64,
    /// Error at the end: distance (m), and signed heading (deg).
    pub last: (f64, f64),
    /// Largest errors of all scans (m, deg).
    pub largest: (f64, f64),
    /// Sum of the normalised squared errors of the accepted scans by degree of freedom, and their number.
    pub squares: (f64, u32),
    /// Normalised squared error at the end by degree of freedom.
    pub last_square: f64,
    /// Accepted scans that are wrong and confident.
    pub confident: u32,
    /// Time (s), error (m, deg) of the first of them.
    pub first_confident: Option<(f64, f64, f64)>,
    /// Over all poses.
    pub hash: PoseHash,
}

impl Outcome {
    /// Mean normalised squared error of the accepted scans by degree of freedom: 1 is ideal, more is too confident.
    #[must_use]
    pub fn nees(&self) -> f64 {
        self.squares.0 / f64::from(self.squares.1.max(1))
    }

    /// Whether what the scene asks for came true.
    #[must_use]
    pub fn kept(&self, must: Must) -> bool {
        let within = |(a, b): (f64, f64), (m, d): (f64, f64)| a <= m && b.abs() <= d;
        self.confident == 0
            && match must {
                Must::Follow(metres, degrees) => within(self.last, (metres, degrees)),
                Must::Hold(metres, degrees) => within(self.largest, (metres, degrees)),
                Must::Tell => true,
            }
    }

    /// Takes a step in: where the robot really is, in the frame in which it started.
    pub fn push(&mut self, time: f64, step: &Step, truth: TruePose) {
        let [x, y, turned] = [
            f64::from(step.pose.x) - truth.x,
            f64::from(step.pose.y) - truth.y,
            wrap(f64::from(step.pose.theta) - truth.theta),
        ];
        let (metres, degrees) = (libm::hypot(x, y), turned.to_degrees());
        self.last = (metres, degrees);
        self.largest = (
            self.largest.0.max(metres),
            self.largest.1.max(degrees.abs()),
        );
        let square = normalised(&step.covariance.0, [x, y, turned]);
        self.last_square = square / 3.0;
        if step.outcome.is_err() {
            return;
        }
        self.squares.0 += square / 3.0;
        self.squares.1 += 1;
        if (metres > WRONG.0 || degrees.abs() > WRONG.1) && square > CONFIDENT {
            self.confident += 1;
            self.first_confident.get_or_insert((time, metres, degrees));
        }
    }
}

/// Runs a scene with one seed; `change` changes the default settings.
pub fn run(
    entry: &Entry,
    seed: u64,
    change: impl Fn(OdometryConfig) -> OdometryConfig,
    observe: impl FnMut(f64, &Step, TruePose),
) -> Outcome {
    let scene = (entry.make)(seed);
    let scans = scene.run(seed);
    drive(&scene, &scans, change, observe)
}

/// Runs a scene whose scans are there; `change` changes the default settings.
pub fn drive(
    scene: &Scene,
    scans: &[Revolution],
    change: impl Fn(OdometryConfig) -> OdometryConfig,
    mut observe: impl FnMut(f64, &Step, TruePose),
) -> Outcome {
    let config = change(OdometryConfig::DEFAULT.with_mount(Mount {
        robot_from_lidar: scene.mount.into(),
        ..Mount::DEFAULT
    }));
    let size = size::fitting(scans.iter().map(|scan| &scan.beams[..]));
    sized!(size, follow(scene, scans, config, &mut observe))
}

/// Follows the robot with room for N beams a revolution.
fn follow<const N: usize>(
    scene: &Scene,
    scans: &[Revolution],
    config: OdometryConfig,
    observe: &mut dyn FnMut(f64, &Step, TruePose),
) -> Outcome {
    let mut pipeline = Pipeline::<N>::new(config);
    let mut outcome = Outcome::default();
    let mut before = scene.course.truth(0.0);
    let Some(origin) = scans.first().map(|scan| scan.truth) else {
        return outcome;
    };
    for revolution in scans {
        let step = pipeline.step(&revolution.beams, revolution.wheels.map(Pose::from));
        let truth = origin.between(revolution.truth);
        outcome.push(revolution.end, &step, truth);
        observe(revolution.end, &step, truth);
        outcome.driven += before.between(revolution.truth).distance();
        before = revolution.truth;
    }
    let counters = pipeline.counters();
    outcome.hash = pipeline.hash;
    (outcome.scans, outcome.refused, outcome.lost) =
        (counters.scans, counters.refused, counters.lost);
    outcome
}

/// `eᵀ C⁻¹ e` in `f64`: a covariance may know one direction a million times better than another one.
fn normalised(c: &Sym3, [x, y, t]: [f64; 3]) -> f64 {
    let [xx, xy, xt, yy, yt, tt] = [c.xx, c.xy, c.xt, c.yy, c.yt, c.tt].map(f64::from);
    // Cholesky, and forward substitution: the square is that of the solution.
    let a = libm::sqrt(xx);
    let (b, c) = (xy / a, xt / a);
    let d = libm::sqrt(yy - b * b);
    let e = (yt - b * c) / d;
    let f = libm::sqrt(tt - c * c - e * e);
    let u = x / a;
    let v = (y - b * u) / d;
    let w = (t - c * u - e * v) / f;
    let square = u * u + v * v + w * w;
    // The first pose is exact, and so is its covariance.
    if square.is_nan() && x == 0.0 && y == 0.0 && t == 0.0 {
        return 0.0;
    }
    if square.is_nan() {
        f64::INFINITY
    } else {
        square
    }
}
