//! Every choice of every stage of ICP finds a known motion; what each is worth.

use crate::common::points_from;
use beamfix::{
    geometry::Pose,
    matching::{
        MatchError,
        icp::modular::{
            self, Limits, Stages, Workspace,
            correspondence::{
                BruteForce, Closest, ClosestCompatible, Correspond, NormalShooting, Projection,
            },
            minimisation::{Constrained, Minimise, PointToLine, PointToPoint},
            rejection::{
                Boundary, Distance, Doubles, MedianMultiple, Reject, Trimmed, Visibility,
                WorstShare,
            },
            selection::{All, EveryNth, Features, NormalSpace, Random, Select},
            weighting::{
                self, Cauchy, Constant, GemanMcClure, Huber, Normals, RangeUncertainty, Tukey,
                Weigh,
            },
        },
        icp::{self, IcpConfig, Reference},
    },
    scan::ScanPoint,
};
use beamfix_sim::{Noise, TruePose, scenes};

const BEAMS: usize = 360;
const SEEDS: u64 = 20;

/// A pair of scans in an office and a guess off by up to `metres` and `degrees`: reference, current, motion, guess.
pub fn pair(
    seed: u64,
    metres: f64,
    degrees: f64,
) -> (Vec<ScanPoint>, Vec<ScanPoint>, TruePose, Pose) {
    let world = scenes::office(seed);
    let mut noise = Noise::new(seed, 1);
    let place = scenes::office_place(&world, 0.6, &mut noise);
    let motion = TruePose::new(
        noise.even(-0.1, 0.1),
        noise.even(-0.1, 0.1),
        noise.even(-0.1, 0.1),
    );
    let off = degrees.to_radians();
    let guess = TruePose::new(
        motion.x + noise.even(-metres, metres),
        motion.y + noise.even(-metres, metres),
        motion.theta + noise.even(-off, off),
    );
    let reference = points_from(&world, place, BEAMS, &mut noise);
    let current = points_from(&world, place.then(motion), BEAMS, &mut noise);
    (reference, current, motion, guess.into())
}

/// Median and largest error over the seeds (mm, degrees).
#[derive(Debug)]
struct Errors {
    median: (f64, f64),
    worst: (f64, f64),
}

fn errors<S, C, W, R, M>(stages: Stages<S, C, W, R, M>) -> Errors
where
    S: Select + Clone,
    C: Correspond + Clone,
    W: Weigh + Clone,
    R: Reject + Clone,
    M: Minimise + Clone,
{
    let mut workspace = Box::new(Workspace::<BEAMS>::new());
    let mut stages = stages;
    let (mut metres, mut degrees) = (Vec::new(), Vec::new());
    for seed in 0..SEEDS {
        let (reference, current, motion, guess) = pair(seed, 0.05, 2.0);
        let found = modular::align(&reference, &current, guess, &mut stages, &mut workspace)
            .unwrap_or_else(|e| panic!("seed {seed}: {e}"));
        let off = motion.between(found.pose.into());
        metres.push(1000.0 * off.distance());
        degrees.push(off.theta.to_degrees().abs());
    }
    metres.sort_by(f64::total_cmp);
    degrees.sort_by(f64::total_cmp);
    let half = SEEDS as usize / 2;
    Errors {
        median: (metres[half], degrees[half]),
        worst: (metres[2 * half - 1], degrees[2 * half - 1]),
    }
}

/// The choice that stays where another stage is varied: closest points, lines, the least that a clean scene wants.
fn plain() -> Stages<All, Closest, Constant, MedianMultiple, PointToLine> {
    Stages::default()
}

/// Checks one variation: median error (mm, degrees) and worst.
fn check(name: &str, errors: Errors, median: (f64, f64), worst: (f64, f64)) {
    println!(
        "{name:28} median {:5.2} mm {:.3}°  worst {:5.2} mm {:.3}°",
        errors.median.0, errors.median.1, errors.worst.0, errors.worst.1
    );
    assert!(
        errors.median.0 < median.0 && errors.median.1 < median.1,
        "{name}: {errors:?}"
    );
    assert!(
        errors.worst.0 < worst.0 && errors.worst.1 < worst.1,
        "{name}: {errors:?}"
    );
}

/// What 1 cm of noise on 360 beams of two scans leaves: about 1 mm and 0.02 degrees; twice that in the median, and the
/// worst of twenty six times.
const FINE: ((f64, f64), (f64, f64)) = ((2.0, 0.04), (6.0, 0.12));
/// A quarter of the points: twice as much.
const FEW: ((f64, f64), (f64, f64)) = ((4.0, 0.08), (12.0, 0.24));
/// Points are never hit twice: along a wall a scan may stay off by a beam's spacing, 35 mm at 2 m, which is 1 degree.
const POINTS: ((f64, f64), (f64, f64)) = ((10.0, 0.2), (35.0, 1.0));

#[test]
fn every_selection_finds_the_motion() {
    let p = plain;
    macro_rules! with {
        ($choice:expr) => {
            errors(Stages {
                selection: $choice,
                correspondence: p().correspondence,
                weighting: p().weighting,
                rejection: p().rejection,
                minimisation: p().minimisation,
                limits: Limits::DEFAULT,
            })
        };
    }
    check("all", with!(All), FINE.0, FINE.1);
    check("every 4th", with!(EveryNth(4)), FEW.0, FEW.1);
    check("random quarter", with!(Random::default()), FEW.0, FEW.1);
    check("features", with!(Features::default()), FEW.0, FEW.1);
    check(
        "normal space, 90",
        with!(NormalSpace::default()),
        FEW.0,
        FEW.1,
    );
}

#[test]
fn every_correspondence_finds_the_motion() {
    let p = plain;
    macro_rules! with {
        ($choice:expr) => {
            errors(Stages {
                selection: p().selection,
                correspondence: $choice,
                weighting: p().weighting,
                rejection: p().rejection,
                minimisation: p().minimisation,
                limits: Limits::DEFAULT,
            })
        };
    }
    check("closest", with!(Closest::default()), FINE.0, FINE.1);
    check("closest, brute force", with!(BruteForce), FINE.0, FINE.1);
    check(
        "closest compatible",
        with!(ClosestCompatible::default()),
        FINE.0,
        FINE.1,
    );
    check(
        "normal shooting",
        with!(NormalShooting::default()),
        FINE.0,
        FINE.1,
    );
    check(
        "projection",
        with!(Projection::<BEAMS>::new()),
        FINE.0,
        FINE.1,
    );
}

#[test]
fn every_weighting_finds_the_motion() {
    let p = plain;
    macro_rules! with {
        ($choice:expr) => {
            errors(Stages {
                selection: p().selection,
                correspondence: p().correspondence,
                weighting: $choice,
                // The weights alone: only what is absurdly far is rejected.
                rejection: Distance { most: 0.3 },
                minimisation: p().minimisation,
                limits: Limits::DEFAULT,
            })
        };
    }
    let range = RangeUncertainty::default();
    // Those that let outliers in pay for it.
    check("constant", with!(Constant), FEW.0, FEW.1);
    check(
        "distance",
        with!(weighting::Distance::default()),
        FEW.0,
        FEW.1,
    );
    check("normals", with!(Normals), FEW.0, FEW.1);
    check("range uncertainty", with!(range), FEW.0, FEW.1);
    check("Huber", with!(Huber::default()), FINE.0, FINE.1);
    check("Cauchy", with!(Cauchy::default()), FINE.0, FINE.1);
    check(
        "Geman–McClure",
        with!(GemanMcClure::default()),
        FINE.0,
        FINE.1,
    );
    check("Tukey", with!(Tukey::default()), FINE.0, FINE.1);
    check(
        "range, then Geman–McClure",
        with!((range, GemanMcClure::default())),
        FINE.0,
        FINE.1,
    );
}

#[test]
fn every_rejection_finds_the_motion() {
    let p = plain;
    macro_rules! with {
        ($choice:expr) => {
            errors(Stages {
                selection: p().selection,
                correspondence: p().correspondence,
                weighting: p().weighting,
                rejection: $choice,
                minimisation: p().minimisation,
                limits: Limits::DEFAULT,
            })
        };
    }
    let gate = Distance { most: 0.2 };
    check("distance", with!(gate), FEW.0, FEW.1);
    check("worst tenth", with!(WorstShare::default()), FEW.0, FEW.1);
    check("median", with!(MedianMultiple::default()), FINE.0, FINE.1);
    check(
        "doubles and distance",
        with!((gate, Doubles::default())),
        FEW.0,
        FEW.1,
    );
    check(
        "boundary and distance",
        with!((gate, Boundary)),
        FEW.0,
        FEW.1,
    );
    check(
        "visibility and distance",
        with!((gate, Visibility)),
        FEW.0,
        FEW.1,
    );
    check("trimmed", with!(Trimmed::default()), FINE.0, FINE.1);
}

#[test]
fn every_minimisation_reaches_its_accuracy() {
    let p = plain;
    macro_rules! with {
        ($choice:expr, $rejection:expr) => {
            errors(Stages {
                selection: p().selection,
                correspondence: p().correspondence,
                weighting: p().weighting,
                rejection: $rejection,
                minimisation: $choice,
                limits: Limits {
                    // Points slide slowly along walls.
                    max_iterations: 100,
                    ..Limits::DEFAULT
                },
            })
        };
    }
    let median = MedianMultiple::default();
    check("point to line", with!(PointToLine, median), FINE.0, FINE.1);
    check("constrained", with!(Constrained, median), FINE.0, FINE.1);
    check(
        "point to point",
        with!(PointToPoint, Trimmed::default()),
        POINTS.0,
        POINTS.1,
    );
}

#[test]
fn the_two_point_to_line_minima_are_one() {
    let mut workspace = Box::new(Workspace::<BEAMS>::new());
    for seed in 0..SEEDS {
        let (reference, current, _, guess) = pair(seed, 0.05, 2.0);
        let mut newton = plain();
        let mut closed = Stages {
            selection: All,
            correspondence: Closest::default(),
            weighting: Constant,
            rejection: MedianMultiple::default(),
            minimisation: Constrained,
            limits: Limits::DEFAULT,
        };
        let a = modular::align(&reference, &current, guess, &mut newton, &mut workspace);
        let b = modular::align(&reference, &current, guess, &mut closed, &mut workspace);
        let (a, b) = (a.expect("newton").pose, b.expect("closed").pose);
        let off = a.between(b);
        // A pair at the gate may be in for one and out for the other: a hundredth of a hundred pairs' centimetre.
        assert!(
            off.distance() < 5e-4 && off.theta.abs() < 2e-4,
            "seed {seed}: {off:?}"
        );
    }
}

#[test]
fn the_fast_search_gives_the_same_bits_as_brute_force() {
    let mut workspace = Box::new(Workspace::<BEAMS>::new());
    for seed in 0..SEEDS {
        let (reference, current, _, guess) = pair(seed, 0.2, 8.0);
        let mut fast = plain();
        let mut slow = Stages {
            selection: All,
            correspondence: BruteForce,
            weighting: Constant,
            rejection: MedianMultiple::default(),
            minimisation: PointToLine,
            limits: Limits::DEFAULT,
        };
        let a = modular::align(&reference, &current, guess, &mut fast, &mut workspace);
        let b = modular::align(&reference, &current, guess, &mut slow, &mut workspace);
        assert_eq!(a, b, "seed {seed}");
    }
}

/// The fast matcher's choices with a wider kernel.
fn fused(scale: f32) -> modular::Projective<BEAMS> {
    modular::Projective {
        weighting: (RangeUncertainty::default(), GemanMcClure { scale }),
        ..Stages::projective()
    }
}

#[test]
fn the_fused_path_is_these_stages_in_integers() {
    let mut workspace = Box::new(Workspace::<BEAMS>::new());
    let mut lines = Box::new(Reference::<BEAMS>::new());
    let (mut metres, mut degrees) = (0.0f64, 0.0f64);
    for seed in 0..50 {
        let (reference, current, _, guess) = pair(seed, 0.02, 1.0);
        lines.assign(&reference);
        let a = icp::align(&lines, &current, guess, &IcpConfig::DEFAULT)
            .unwrap_or_else(|e| panic!("seed {seed}, fused: {e}"));
        let b = modular::align(
            &reference,
            &current,
            guess,
            &mut modular::Projective::<BEAMS>::projective(),
            &mut workspace,
        )
        .unwrap_or_else(|e| panic!("seed {seed}, staged: {e}"));
        let off = TruePose::from(a.pose).between(b.pose.into());
        metres = metres.max(off.distance());
        degrees = degrees.max(off.theta.to_degrees().abs());
        assert!(
            // Both are about 1.5 mm from the truth, by lines laid in two ways.
            off.distance() < 0.003 && off.theta.to_degrees().abs() < 0.05,
            "seed {seed}: {} mm, {} degrees",
            1000.0 * off.distance(),
            off.theta.to_degrees()
        );
    }
    println!(
        "fused and staged differ by at most {:.2} mm, {degrees:.3} degrees",
        1000.0 * metres
    );
}

#[test]
fn trimming_estimates_the_overlap() {
    let mut workspace = Box::new(Workspace::<BEAMS>::new());
    for share in [0.5, 0.6, 0.7, 0.8, 0.9, 1.0] {
        let mut worst = 0.0f64;
        for seed in 0..SEEDS {
            let (reference, mut current, motion, guess) = pair(seed, 0.05, 2.0);
            // The rest of the scan sees what was not there: nearer, and all over the place.
            let mut noise = Noise::new(seed, 2);
            let kept = (share * current.len() as f64) as usize;
            for point in current.iter_mut().skip(kept) {
                let nearer = f64::from(point.range()) * noise.even(0.3, 0.8);
                *point = ScanPoint::at(point.bearing(), nearer as u16);
            }
            let mut stages = Stages {
                selection: All,
                correspondence: Closest::default(),
                weighting: Constant,
                rejection: Trimmed::default(),
                minimisation: PointToLine,
                limits: Limits::DEFAULT,
            };
            let found = modular::align(&reference, &current, guess, &mut stages, &mut workspace)
                .unwrap_or_else(|e| panic!("{share}, seed {seed}: {e}"));
            let off = motion.between(found.pose.into());
            assert!(off.distance() < 0.03, "{share}, seed {seed}: {found:?}");
            let estimate = f64::from(stages.rejection.overlap);
            worst = worst.max((estimate - share).abs());
        }
        println!("overlap {share}: the estimate is off by at most {worst:.3}");
        assert!(worst < 0.1, "{share}: {worst}");
    }
}

#[test]
fn what_cannot_be_matched_is_refused() {
    let mut workspace = Box::new(Workspace::<BEAMS>::new());
    let (reference, current, _, guess) = pair(1, 0.0, 0.0);
    let mut align = |reference: &[ScanPoint], current: &[ScanPoint], guess: Pose| {
        modular::align(reference, current, guess, &mut plain(), &mut workspace).map(|m| m.pose)
    };
    let few = Err(MatchError::TooFewBeams {
        found: 10,
        needed: 30,
    });
    assert_eq!(align(&reference, &current[..10], guess), few);
    let few = Err(MatchError::TooFewLines {
        found: 0,
        needed: 30,
    });
    assert_eq!(align(&[], &current, guess), few);
    let nowhere = Pose {
        x: f32::NAN,
        ..guess
    };
    assert_eq!(
        align(&reference, &current, nowhere),
        Err(MatchError::BadGuess)
    );
}

#[test]
fn a_corridor_is_weak_along_it_and_keeps_the_guess() {
    let world = scenes::corridor();
    let mut workspace = Box::new(Workspace::<BEAMS>::new());
    for seed in 0..SEEDS {
        let mut noise = Noise::new(seed, 1);
        let reference = points_from(&world, TruePose::default(), BEAMS, &mut noise);
        let motion = TruePose::new(0.1, 0.05, 0.03);
        let current = points_from(&world, motion, BEAMS, &mut noise);
        let guess = Pose::new(0.05, 0.0, 0.0);
        let found = modular::align(
            &reference,
            &current,
            guess,
            &mut fused(0.05),
            &mut workspace,
        )
        .unwrap_or_else(|e| panic!("seed {seed}: {e}"));
        let weak = found
            .degenerate_direction
            .unwrap_or_else(|| panic!("seed {seed}: {found:?}"));
        assert!(weak.direction[0].abs() > 0.98, "seed {seed}: {weak:?}");
        // Along the corridor only the guess is known, to 0.3 m; across it the scan tells to a centimetre at most.
        let [x, y, _] = weak.direction;
        let across = found.covariance.0.quadratic([-y, x, 0.0]);
        assert!(weak.sigma > 0.2 && across < 1e-4, "seed {seed}: {found:?}");
        let pose = TruePose::from(found.pose);
        assert!((pose.x - 0.05).abs() < 0.01, "seed {seed}: {found:?}");
        assert!(
            (pose.y - motion.y).abs() < 0.01 && (pose.theta - motion.theta).abs() < 0.005,
            "seed {seed}: {found:?}"
        );
    }
}
