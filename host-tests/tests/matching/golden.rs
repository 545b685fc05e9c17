//! The bits of the matchers of scans and of what they stand on, as they are kept.

use super::staged::pair;
use crate::common::{field_of, kept::Kept, points_from};
use beamfix::{
    geometry::Pose,
    linalg::Sym3,
    matching::{
        correlative::{CorrelativeConfig, Correlator, pyramid::Pyramid},
        icp::modular::{
            self, Limits, Stages, Workspace,
            correspondence::{BruteForce, Closest, ClosestCompatible, NormalShooting, Projection},
            minimisation::{Constrained, PointToLine, PointToPoint},
            rejection::{
                Boundary, Distance, Doubles, MedianMultiple, Trimmed, Visibility, WorstShare,
            },
            selection::{All, EveryNth, Features, NormalSpace, Random},
            weighting::{
                self, Cauchy, Constant, GemanMcClure, Huber, Normals, RangeUncertainty, Tukey,
            },
        },
        icp::{self, IcpConfig, Reference, Search},
        virtual_scan::VirtualScan,
    },
    scan::ScanPoint,
    sensor_model::likelihood_field::FieldModel,
};
use beamfix_sim::{Noise, TruePose, scenes};

const BEAMS: usize = 360;

#[test]
fn matchers_give_the_bits_that_are_kept() {
    let mut kept = Kept::of("matching");
    algebra(&mut kept);
    fast(&mut kept);
    staged(&mut kept);
    correlative(&mut kept);
    virtual_scan(&mut kept);
    kept.check();
}

fn algebra(kept: &mut Kept) {
    let mut noise = Noise::new(3, 51);
    for _ in 0..50 {
        let mut number = || noise.even(-2.0, 2.0) as f32;
        let v = [number(), number(), number()];
        let w = [number(), number(), number()];
        let small = Sym3::diagonal(0.01, 0.02, 0.03);
        let a = Sym3::outer(v).plus(&Sym3::outer(w)).plus(&small);
        let b = Sym3::outer(w).scaled(0.3).plus(&small);
        kept.push(
            "products",
            (
                a.times(w),
                a.quadratic(w),
                a.congruent(&b),
                a.about(v[0], w[1]),
            ),
        );
        kept.push("inverses", (a.inverse(), a.solve(w), a.root()));
        kept.push("scales", (a.scaled(v[0]), a.theta_scaled(v[1])));
        kept.push("eigenvalues", a.eigen());
        if let Some(root) = a.root() {
            kept.push("roots", (root.times(v), root.determinant()));
        }
    }
}

/// The fast matcher: good and bad guesses, one start and several, scenes of all kinds, beams that hit what moves.
fn fast(kept: &mut Kept) {
    let mut lines = Box::new(Reference::<BEAMS>::new());
    let mut matched = |name: &str, reference: &[ScanPoint], current: &[ScanPoint], guess: Pose| {
        lines.assign(reference);
        kept.push(
            name,
            icp::align(&lines, current, guess, &IcpConfig::DEFAULT),
        );
        let global = IcpConfig {
            search: Search::Global,
            ..IcpConfig::DEFAULT
        };
        let several = icp::align(&lines, current, guess, &global);
        kept.push(&format!("{name}, several starts"), several);
    };
    for seed in 0..12 {
        for (name, metres, degrees) in [
            ("icp, near", 0.02, 1.0),
            ("icp, off", 0.15, 8.0),
            ("icp, far", 0.6, 25.0),
        ] {
            let (reference, mut current, _, guess) = pair(seed, metres, degrees);
            matched(name, &reference, &current, guess);
            let mut noise = Noise::new(seed, 52);
            for point in current.iter_mut().skip(20 * seed as usize).take(60) {
                let nearer = f64::from(point.range()) * noise.even(0.3, 0.8);
                *point = ScanPoint::at(point.bearing(), nearer as u16);
            }
            matched("icp, people", &reference, &current, guess);
            // Noise of 2 % of the range.
            let noisy = |points: &[ScanPoint], noise: &mut Noise| -> Vec<ScanPoint> {
                let one = |p: &ScanPoint| {
                    let mm = f64::from(p.range()) * (1.0 + noise.normal(0.02));
                    ScanPoint::at(p.bearing(), mm as u16)
                };
                points.iter().map(one).collect()
            };
            let (far, near) = (noisy(&reference, &mut noise), noisy(&current, &mut noise));
            matched("icp, noise by the range", &far, &near, guess);
        }
    }
    let mut noise = Noise::new(1, 53);
    for (name, world) in [
        ("icp, corridor", scenes::corridor()),
        ("icp, flat", scenes::flat()),
    ] {
        let at = TruePose::new(0.0, 0.1, 0.3);
        for beams in [60, 180, 360] {
            let reference = points_from(&world, at, beams, &mut noise);
            let moved = at.then(TruePose::new(0.05, 0.02, 0.03));
            let current = points_from(&world, moved, beams, &mut noise);
            matched(name, &reference, &current, Pose::new(0.03, 0.0, 0.02));
        }
    }
}

fn staged(kept: &mut Kept) {
    let mut workspace = Box::new(Workspace::<BEAMS>::new());
    let pairs: Vec<_> = (0..3).map(|seed| pair(seed, 0.08, 4.0)).collect();
    macro_rules! with {
        ($name:expr; $($stage:ident: $choice:expr),*) => {
            for (reference, current, _, guess) in &pairs {
                let plain: Stages<All, Closest, Constant, MedianMultiple, PointToLine> = Stages::default();
                let mut stages = stages!(plain; $($stage: $choice),*);
                let found = modular::align(reference, current, *guess, &mut stages, &mut workspace);
                kept.push($name, found);
            }
        };
    }
    macro_rules! stages {
        ($plain:expr; selection: $choice:expr) => {
            stages!(
                $plain,
                $choice,
                $plain.correspondence,
                $plain.weighting,
                $plain.rejection,
                $plain.minimisation
            )
        };
        ($plain:expr; correspondence: $choice:expr) => {
            stages!(
                $plain,
                $plain.selection,
                $choice,
                $plain.weighting,
                $plain.rejection,
                $plain.minimisation
            )
        };
        ($plain:expr; weighting: $choice:expr) => {
            stages!(
                $plain,
                $plain.selection,
                $plain.correspondence,
                $choice,
                Distance { most: 0.3 },
                $plain.minimisation
            )
        };
        ($plain:expr; rejection: $choice:expr) => {
            stages!(
                $plain,
                $plain.selection,
                $plain.correspondence,
                $plain.weighting,
                $choice,
                $plain.minimisation
            )
        };
        ($plain:expr; minimisation: $choice:expr) => {
            stages!(
                $plain,
                $plain.selection,
                $plain.correspondence,
                $plain.weighting,
                Trimmed::default(),
                $choice
            )
        };
        ($plain:expr, $a:expr, $b:expr, $c:expr, $d:expr, $e:expr) => {
            Stages {
                selection: $a,
                correspondence: $b,
                weighting: $c,
                rejection: $d,
                minimisation: $e,
                limits: Limits::DEFAULT,
            }
        };
    }
    with!("staged, all"; selection: All);
    with!("staged, every 3rd"; selection: EveryNth(3));
    with!("staged, random"; selection: Random::default());
    with!("staged, normal space"; selection: NormalSpace::default());
    with!("staged, features"; selection: Features::default());
    with!("staged, brute force"; correspondence: BruteForce);
    with!("staged, compatible"; correspondence: ClosestCompatible::default());
    with!("staged, shooting"; correspondence: NormalShooting::default());
    with!("staged, projection"; correspondence: Projection::<BEAMS>::new());
    with!("staged, by distance"; weighting: weighting::Distance::default());
    with!("staged, by normals"; weighting: Normals);
    with!("staged, by range"; weighting: RangeUncertainty::default());
    with!("staged, Huber"; weighting: Huber::default());
    with!("staged, Cauchy"; weighting: Cauchy::default());
    with!("staged, Geman-McClure"; weighting: GemanMcClure::default());
    with!("staged, Tukey"; weighting: Tukey::default());
    let gate = Distance { most: 0.2 };
    with!("staged, gate"; rejection: gate);
    with!("staged, worst share"; rejection: WorstShare::default());
    with!("staged, doubles"; rejection: (gate, Doubles::default()));
    with!("staged, boundary"; rejection: (gate, Boundary));
    with!("staged, visibility"; rejection: (gate, Visibility));
    with!("staged, trimmed"; rejection: Trimmed::default());
    with!("staged, constrained"; minimisation: Constrained);
    with!("staged, to points"; minimisation: PointToPoint);
}

fn correlative(kept: &mut Kept) {
    let mut correlator = Correlator::<120>::new();
    for seed in 0..5 {
        let (reference, current, motion, guess) = pair(seed, 0.2, 10.0);
        let field = field_of(&reference, 0.05, &FieldModel::DEFAULT);
        let mut buffer = vec![0; Pyramid::bytes(field.grid().shape())];
        let pyramid = Pyramid::new(field.as_slice(), &mut buffer).expect("fits");
        for (name, pyramid) in [
            ("correlative", pyramid),
            ("correlative, local", pyramid.local()),
        ] {
            let config = CorrelativeConfig::DEFAULT;
            kept.push(name, correlator.align(&pyramid, &current, guess, &config));
            kept.push(name, correlator.lookups());
            let found = correlator.align(&pyramid, &current, motion.into(), &config);
            kept.push(name, found);
        }
    }
    let mut noise = Noise::new(4, 54);
    let points = points_from(
        &scenes::corridor(),
        TruePose::new(0.0, 0.2, 0.3),
        360,
        &mut noise,
    );
    let field = field_of(&points, 0.05, &FieldModel::DEFAULT);
    let mut buffer = vec![0; Pyramid::bytes(field.grid().shape())];
    let pyramid = Pyramid::new(field.as_slice(), &mut buffer)
        .expect("fits")
        .local();
    let guess = Pose::new(0.11, 0.03, 0.01);
    let found = correlator.align(&pyramid, &points, guess, &CorrelativeConfig::DEFAULT);
    kept.push("correlative, corridor", found);
}

fn virtual_scan(kept: &mut Kept) {
    for seed in 0..5 {
        let world = scenes::office(seed);
        let mut noise = Noise::new(seed, 55);
        let place = scenes::office_place(&world, 0.6, &mut noise);
        let keyframes: Vec<(Vec<ScanPoint>, Pose)> = (0..5)
            .map(|_| {
                let off = TruePose::new(
                    noise.even(-0.6, 0.6),
                    noise.even(-0.6, 0.6),
                    noise.even(-3.0, 3.0),
                );
                (
                    points_from(&world, place.then(off), BEAMS, &mut noise),
                    off.into(),
                )
            })
            .collect();
        let mut scan = Box::new(VirtualScan::<BEAMS>::new());
        scan.assign(
            Pose::new(0.1, 0.0, 0.2),
            keyframes.iter().map(|(p, pose)| (p.as_slice(), *pose)),
        );
        kept.push("virtual scan", scan.as_slice());
    }
}
