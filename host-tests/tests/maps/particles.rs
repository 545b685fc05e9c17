//! Localization by particles in a simulated home: tracking, finding, being carried, rooms alike, and any input.

use super::localization::{Place, drive, place, scan};
use crate::common::field_of_world;
use beamfix::{
    geometry::{EgoMotion, Pose},
    grid::{Grid, Shape},
    localization::particles::{
        Belief, Motion, ParticleConfig, ParticleFilter, Proposal, Verdict, Weighting,
    },
    pipeline::{Estimate as _, Estimator as _, ParticleLocalizer},
    scan::{Beam, Bearing, PointsConfig, Range, Scan, ScanPoint},
    sensor_model::{
        BeamModel,
        beam_model::BeamTable,
        likelihood_field::{FieldModel, LikelihoodField},
    },
};
use beamfix_sim::{home, noise::Noise, pose::TruePose, world::World};
use proptest::prelude::*;

type Filter<'a> = ParticleFilter<'a, 2000, 96>;

fn config(proposal: Proposal, particles: u16, seed: u32) -> ParticleConfig {
    ParticleConfig {
        proposal,
        particles,
        seed,
        ..ParticleConfig::DEFAULT
    }
}

fn off(belief: &Belief, truth: TruePose) -> f64 {
    truth.between(belief.pose.into()).distance()
}

/// A step of the robot, and what the filter makes of it.
fn follow(
    filter: &mut Filter<'_>,
    place: &Place,
    pose: &mut TruePose,
    noise: &mut Noise,
) -> Belief {
    let wheels;
    (*pose, wheels) = drive(place, *pose, noise);
    filter.moved(&Motion::by_wheels(wheels, 0.1));
    filter.update(&scan(&place.world, *pose, noise))
}

/// Mean error (m) of a drive from a known pose on, and the share of its scans after which the pose was known.
fn tracked(place: &Place, weighting: Weighting<'_>, config: ParticleConfig) -> (f64, f64) {
    const SCANS: u32 = 100;
    let mut noise = Noise::new(config.seed.into(), 21);
    let mut pose = home::home_place(&place.world, &place.map, 0.25, &mut noise);
    let mut filter = Filter::new(place.field.as_slice(), config).weighed_by(weighting);
    filter.start_at(pose.into(), (0.05, 0.05));
    let (mut metres, mut known) = (0.0, 0.0);
    for _ in 0..SCANS {
        let belief = follow(&mut filter, place, &mut pose, &mut noise);
        metres += off(&belief, pose).min(1.0);
        known += f64::from(u8::from(belief.verdict == Verdict::Known));
        let sum: f32 = filter.particles().map(|(_, weight)| weight).sum();
        assert!((sum - 1.0).abs() < 1e-4, "weights sum to {sum}");
        let most = filter.particles().count() as f32;
        assert!(belief.effective > 0.999 && belief.effective < most + 0.01);
    }
    (metres / f64::from(SCANS), known / f64::from(SCANS))
}

#[test]
fn tracks_by_either_proposal_and_either_sensor_model() {
    let place = place();
    let table = BeamTable::new(&BeamModel::DEFAULT);
    let beams = Weighting::BeamModel(&table);
    for (what, weighting, proposal, particles) in [
        ("wheels", Weighting::LikelihoodField, Proposal::Motion, 200),
        ("match", Weighting::LikelihoodField, Proposal::Improved, 8),
        ("wheels, beam model", beams, Proposal::Motion, 200),
        ("match, beam model", beams, Proposal::Improved, 8),
    ] {
        let (mut metres, mut known) = (0.0, 0.0);
        for seed in 0..5 {
            let (m, k) = tracked(&place, weighting, config(proposal, particles, seed));
            (metres, known) = (metres + m / 5.0, known + k / 5.0);
        }
        println!("{what}, {particles} particles: {metres:.4} m, known {known:.3}");
        assert!(metres < 0.05 && known > 0.9, "{what}");
    }
}

#[test]
fn matches_need_a_fifth_of_the_particles_that_wheels_need_for_the_same_error() {
    let place = place();
    let error = |proposal, particles| {
        let drives = 0..10;
        let sum: f64 = drives
            .map(|seed| {
                let config = config(proposal, particles, seed);
                tracked(&place, Weighting::LikelihoodField, config).0
            })
            .sum();
        println!("{proposal:?} {particles}: {:.4} m", sum / 10.0);
        sum / 10.0
    };
    for few in [4, 16] {
        let improved = error(Proposal::Improved, few);
        assert!(improved <= error(Proposal::Motion, 5 * few));
    }
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_one_others() {
    let place = place();
    let run = |seed| {
        let mut noise = Noise::new(1, 22);
        let mut pose = home::home_place(&place.world, &place.map, 0.25, &mut noise);
        let mut filter = Filter::new(place.field.as_slice(), config(Proposal::Improved, 8, seed));
        filter.start_at(pose.into(), (0.05, 0.05));
        let mut beliefs = Vec::new();
        for _ in 0..10 {
            beliefs.push(follow(&mut filter, &place, &mut pose, &mut noise));
        }
        (beliefs, filter.particles().collect::<Vec<_>>())
    };
    assert_eq!(run(3), run(3));
    assert_ne!(run(3).0, run(4).0);
}

/// Starts without a pose, or with a rough one: how many were known and right after so many scans, and how many known and
/// wrong at any time.
fn found(place: &Place, particles: u16, rough: Option<(f32, f32)>) -> (u32, u32) {
    let (mut right, mut wrong) = (0, 0);
    for seed in 0..20 {
        let mut noise = Noise::new(seed.into(), 23);
        let mut pose = home::home_place(&place.world, &place.map, 0.25, &mut noise);
        let config = config(Proposal::Improved, particles, seed);
        let mut filter = Filter::new(place.field.as_slice(), config);
        if let Some((position, heading)) = rough {
            let shift = TruePose::new(
                noise.normal(position.into()),
                noise.normal(position.into()),
                noise.normal(heading.into()),
            );
            let told = TruePose::new(pose.x + shift.x, pose.y + shift.y, pose.theta + shift.theta);
            filter.start_at(told.into(), (position, heading));
        }
        let (mut is_right, mut is_wrong) = (false, false);
        for _ in 0..20 {
            let belief = follow(&mut filter, place, &mut pose, &mut noise);
            if belief.verdict == Verdict::Known {
                is_right = off(&belief, pose) < 0.2;
                is_wrong |= off(&belief, pose) > 0.5;
            }
        }
        right += u32::from(is_right && !is_wrong);
        wrong += u32::from(is_wrong);
    }
    (right, wrong)
}

#[test]
fn a_rough_pose_becomes_a_known_one() {
    let place = place();
    let (right, wrong) = found(&place, 200, Some((0.4, 0.3)));
    println!("told to 0.4 m and 0.3 rad: of 20 starts {right} right, {wrong} wrong");
    // All over the map hardly any particle is near: that is for a localizer.
    let (all, all_wrong) = found(&place, 2000, None);
    println!("all over the map: of 20 starts {all} right, {all_wrong} wrong");
    assert!(right >= 19 && wrong == 0 && all_wrong <= 1);
}

#[test]
fn a_robot_that_was_carried_is_told() {
    let place = place();
    for proposal in [Proposal::Improved, Proposal::Motion] {
        let particles = match proposal {
            Proposal::Improved => 16,
            Proposal::Motion => 200,
        };
        let (mut told, mut wrong, mut scans_until) = (0, 0, 0);
        for seed in 0..20 {
            let mut noise = Noise::new(seed.into(), 24);
            let mut pose = home::home_place(&place.world, &place.map, 0.25, &mut noise);
            let mut filter = Filter::new(place.field.as_slice(), config(proposal, particles, seed));
            filter.start_at(pose.into(), (0.05, 0.05));
            for _ in 0..10 {
                follow(&mut filter, &place, &mut pose, &mut noise);
            }
            // By hand, elsewhere: the wheels say nothing of it.
            let from = pose;
            while from.between(pose).distance() < 3.0 {
                pose = home::home_place(&place.world, &place.map, 0.25, &mut noise);
            }
            let mut is_told = false;
            for k in 0..10 {
                let belief = follow(&mut filter, &place, &mut pose, &mut noise);
                is_told |= belief.pose().is_none();
                scans_until += u32::from(!is_told);
                let is_wrong = belief.verdict == Verdict::Known && off(&belief, pose) > 0.5;
                if is_wrong {
                    println!("{proposal:?}, seed {seed}: known and wrong {k} scans after");
                }
                wrong += u32::from(is_wrong && is_told);
            }
            told += u32::from(is_told);
        }
        println!(
            "{proposal:?}: told {told} of 20, after {:.1} scans, {wrong} scans known and wrong after that",
            f64::from(scans_until) / 20.0
        );
        assert!(
            told == 20 && scans_until <= 60 && wrong == 0,
            "{proposal:?}"
        );
    }
}

/// Two rooms of 4 m by 3 m alike, with a wall between them, and the field of both.
fn twins() -> (World, LikelihoodField<Vec<u8>>) {
    let mut world = World::default();
    for x in [0.0, 5.0] {
        let corners = [[x, 0.0], [x + 4.0, 0.0], [x + 4.0, 3.0], [x, 3.0]];
        for k in 0..4 {
            world.line(corners[k], corners[(k + 1) % 4]);
        }
        world.block([x + 0.8, 2.0], [x + 1.6, 3.0]);
        world.column([x + 3.2, 0.7], 0.2);
    }
    let field = field_of_world(&world, [-0.5, -0.5], [9.5, 3.5], 0.05, &FieldModel::DEFAULT);
    (world, field)
}

#[test]
fn two_rooms_alike_are_not_told_apart() {
    let (world, field) = twins();
    let mut both = 0;
    for seed in 0..20 {
        let mut noise = Noise::new(seed.into(), 25);
        let config = config(Proposal::Improved, 100, seed);
        let mut filter = Filter::new(field.as_slice(), config);
        // In either room: the mean between them is in the wall.
        let either = [Pose::new(2.0, 1.4, 0.0), Pose::new(7.0, 1.4, 0.0)];
        filter.start_at_any(&either, (0.1, 0.1));
        let mut pose = TruePose::new(2.0, 1.4, 0.0);
        let mut known = 0;
        for k in 0..20 {
            let motion = TruePose::new(0.08, 0.0, 0.1);
            pose = pose.then(motion);
            filter.moved(&Motion::by_wheels(motion.into(), 0.1));
            let belief = filter.update(&scan(&world, pose, &mut noise));
            known += u32::from(k > 3 && belief.verdict == Verdict::Known);
        }
        let left: f32 = filter
            .particles()
            .filter(|(pose, _)| pose.x < 4.5)
            .map(|(_, weight)| weight)
            .sum();
        println!("seed {seed}: {left:.2} of the weight in one room, known {known} of 16");
        both += u32::from(known == 0 && left > 0.02 && left < 0.98);
    }
    assert!(both >= 18, "{both} of 20");
}

#[test]
fn standing_still_is_counted_once() {
    let place = place();
    let mut noise = Noise::new(1, 26);
    let pose = home::home_place(&place.world, &place.map, 0.25, &mut noise);
    let mut filter = Filter::new(place.field.as_slice(), config(Proposal::Improved, 8, 1));
    filter.start_at(pose.into(), (0.05, 0.05));
    for _ in 0..40 {
        filter.moved(&Motion::by_wheels(Pose::IDENTITY, 0.1));
        let belief = filter.update(&scan(&place.world, pose, &mut noise));
        assert!(off(&belief, pose) < 0.1);
    }
    assert_eq!(filter.counts().0, 1);
}

fn any_pose() -> impl Strategy<Value = Pose> {
    let number = || {
        prop_oneof![
            4 => -3.0f32..3.0,
            1 => prop::num::f32::ANY,
        ]
    };
    (number(), number(), number()).prop_map(|(x, y, theta)| Pose { x, y, theta })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn any_scan_and_any_motion_give_a_finite_belief(
        start in any_pose(),
        sigmas in (any::<f32>(), any::<f32>()),
        steps in prop::collection::vec(
            (any_pose(), any::<f32>(), prop::collection::vec((any::<u16>(), 0u16..32_000), 0..60)),
            1..8
        ),
        is_improved in any::<bool>(),
        by_beams in any::<bool>(),
        seed in any::<u32>(),
    ) {
        let (_, field) = twins();
        let proposal = if is_improved { Proposal::Improved } else { Proposal::Motion };
        let table = BeamTable::new(&BeamModel::DEFAULT);
        let mut filter = ParticleFilter::<5, 32>::new(field.as_slice(), config(proposal, 9, seed));
        if by_beams {
            filter = filter.weighed_by(Weighting::BeamModel(&table));
        }
        filter.start_at(start, sigmas);
        for (motion, share, beams) in steps {
            filter.moved(&Motion::by_wheels(motion, share));
            let points: Vec<ScanPoint> = beams
                .into_iter()
                .map(|(bearing, range)| ScanPoint::at(Bearing(bearing), range))
                .collect();
            let belief = filter.update(&points);
            prop_assert!(belief.pose.is_finite(), "{:?}", belief);
            prop_assert!(belief.covariance.to_array().iter().all(|v| v.is_finite()), "{:?}", belief);
            prop_assert!(belief.effective >= 0.0 && belief.effective < 5.01, "{:?}", belief);
            let is_in_use = filter.particles().count() <= 5;
            prop_assert!(is_in_use);
        }
    }
}

#[test]
fn maps_scans_and_times_that_say_nothing_give_no_pose() {
    let shape = Shape::new(40, 40, 0.05, Pose::IDENTITY).expect("good");
    let scale = FieldModel::DEFAULT.scale();
    for byte in [0, 1, scale.unexplored, 255] {
        let cells = vec![byte; shape.len()];
        let grid = Grid::new(shape, cells).expect("fits");
        let field = LikelihoodField::new(grid, scale).expect("small");
        let filter = ParticleFilter::<8, 96>::new(field.as_slice(), ParticleConfig::DEFAULT);
        let mut localizer =
            ParticleLocalizer::<360, 8, 96>::new(filter, 0.2, PointsConfig::DEFAULT);
        // Time running backwards, wheels that are no number, every second scan without a return and the others empty.
        for k in 0..12u32 {
            let mut scan = Scan::<360>::new();
            for beam in 0..if k % 3 == 0 { 0 } else { 90 } {
                let beam = Beam {
                    bearing: Bearing(beam * 728),
                    range: Range::from_mm(if k % 3 == 1 { 0 } else { 2500 }),
                    time_us: 1_000_000u32.wrapping_sub(400_000 * k) + u32::from(beam),
                    quality: 0,
                };
                scan.push(beam).expect("room");
            }
            let wheels = [f32::NAN, 0.1, 40.0][k as usize % 3];
            let ego = EgoMotion {
                wheels: Some(Pose::new(wheels, 0.0, 0.0)),
                rotation: (k % 2 == 0).then_some(f32::INFINITY),
            };
            let belief = localizer.update(&scan, ego);
            assert!(belief.pose.is_finite(), "{byte} {k}: {belief:?}");
            assert_ne!(belief.verdict, Verdict::Known, "{byte} {k}: {belief:?}");
        }
    }
}
