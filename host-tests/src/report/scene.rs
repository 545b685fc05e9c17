//! How an odometry does in a simulated scene: how far off, refused, and whether it says so.

use beamfix::{
    geometry::{EgoMotion, Pose},
    linalg::Sym3,
    odometry::{Counters, Odometry, OdometryConfig, Step},
    pipeline::{Estimator, RollingMapper, Tracker},
    scan::{Mount, Scan},
};
use beamfix_sim::{
    Revolution, Scene, TruePose,
    catalogue::{Entry, Must},
    pose::wrap,
};

use super::hash::PoseHash;
use crate::{pipeline::push_scan, size, sized};

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

/// What runs over a scene's scans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Runs {
    /// The odometry.
    #[default]
    Odometry,
    /// The rolling map of [`Mapper64k`](beamfix::pipeline::Mapper64k), with room for the scene's lidar.
    Rolling,
}

/// Runs a scene with one seed; `change` changes the default settings.
pub fn run(
    entry: &Entry,
    (seed, runs): (u64, Runs),
    change: impl Fn(OdometryConfig) -> OdometryConfig,
    observe: impl FnMut(f64, &Step, TruePose),
) -> Outcome {
    let scene = (entry.make)(seed);
    let scans = scene.run(seed);
    drive(&scene, (&scans, runs), change, observe)
}

/// Runs a scene whose scans are there; `change` changes the default settings.
pub fn drive(
    scene: &Scene,
    (scans, runs): (&[Revolution], Runs),
    change: impl Fn(OdometryConfig) -> OdometryConfig,
    mut observe: impl FnMut(f64, &Step, TruePose),
) -> Outcome {
    let config = change(OdometryConfig::DEFAULT.with_mount(Mount {
        robot_from_lidar: scene.mount.into(),
        ..Mount::DEFAULT
    }));
    let size = size::fitting(scans.iter().map(|scan| &scan.beams[..]));
    sized!(size, choose(scene, (scans, runs), config, &mut observe))
}

/// Follows the robot with room for N beams a revolution.
fn choose<const N: usize>(
    scene: &Scene,
    (scans, runs): (&[Revolution], Runs),
    config: OdometryConfig,
    observe: &mut dyn FnMut(f64, &Step, TruePose),
) -> Outcome {
    let config = OdometryConfig {
        directions: N as u16,
        ..config
    };
    match runs {
        Runs::Odometry => {
            let odometry = Odometry::<N>::new(config);
            follow(scene, scans, odometry, Odometry::counters, observe)
        }
        Runs::Rolling => {
            let rolling = Rolling::<N>(RollingMapper::new(config));
            let counters = |rolling: &Rolling<N>| rolling.0.odometry().counters();
            follow(scene, scans, rolling, counters, observe)
        }
    }
}

/// A rolling map that says its pose and covariance in place of its odometry's.
struct Rolling<const N: usize>(RollingMapper<N, 36, 180, 512>);

impl<const N: usize> Estimator<N> for Rolling<N> {
    type Step = Step;

    fn update(&mut self, scan: &Scan<N>, ego: EgoMotion) -> Step {
        let step = self.0.update(scan, ego);
        Step {
            pose: step.pose,
            covariance: step.covariance,
            ..step.odometry
        }
    }
}

/// Follows the robot with an estimator.
fn follow<E: Estimator<N, Step = Step>, const N: usize>(
    scene: &Scene,
    scans: &[Revolution],
    estimator: E,
    counters: impl Fn(&E) -> Counters,
    observe: &mut dyn FnMut(f64, &Step, TruePose),
) -> Outcome {
    // On the heap: a few scans are too much for a thread's stack in debug builds.
    let mut tracker = Box::new(Tracker::<E, N>::new(estimator));
    let mut outcome = Outcome::default();
    let mut before = scene.course.truth(0.0);
    let Some(origin) = scans.first().map(|scan| scan.truth) else {
        return outcome;
    };
    for revolution in scans {
        let truth = origin.between(revolution.truth);
        let wheels = revolution.wheels.map(Pose::from);
        push_scan(&mut tracker, &revolution.beams, wheels, |ready| {
            outcome.push(revolution.end, ready.step, truth);
            outcome.hash.push(ready.step.pose);
            observe(revolution.end, ready.step, truth);
        });
        outcome.driven += before.between(revolution.truth).distance();
        before = revolution.truth;
    }
    let counters = counters(tracker.estimator());
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
