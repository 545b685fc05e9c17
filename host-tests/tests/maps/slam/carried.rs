//! A robot that is carried elsewhere while it maps: the map goes on apart, and is joined where it is known where to.

use beamfix::{
    odometry::OdometryConfig,
    slam::{Slam192k, SlamConfig},
};
use beamfix_sim::{course::Course, noise::Noise, pose::TruePose, scene::Scene, world::World};
use host_tests::{
    formats::{Log, Recorded},
    mapping::{self, Settings, Tier},
};

use super::drive::{Driven, drive_and_carry, path};
use host_tests::mapping::building::{ROUND, TWINS, ring, twins};

/// Drives of each kind.
const SEEDS: u64 = 20;
/// A pose that is farther off in the map (m) is wrong: by a wrong loop it would be metres.
const WRONG: f64 = 0.5;

/// What became of the scans after the carrying.
struct Outcome {
    driven: Driven,
    /// Largest error of a scan that is in the map in the end, of one that was told as in the map when it came in (m).
    worst: f64,
    is_joined: bool,
    /// Scans from the carrying to where the robot is located again.
    lost: usize,
}

fn carried(world: &World, before: &[TruePose], after: &[TruePose], seed: u64) -> Outcome {
    let truth = [before, after].concat();
    let mut slam = Box::new(Slam192k::new(SlamConfig::DEFAULT));
    let drift = [0.0, 0.0005, -0.0005][seed as usize % 3];
    let at = before.len();
    let driven = drive_and_carry(&mut slam, world, &truth, &[at], drift, seed);
    let off = |k: usize| {
        let (pose, truth) = (driven.mapped[k], truth[k]);
        (f64::from(pose.x) - truth.x).hypot(f64::from(pose.y) - truth.y)
    };
    let in_map = (0..truth.len()).filter(|&k| driven.in_map[k]);
    let worst = in_map.map(off).fold(0.0, f64::max);
    let is_joined = driven.in_map.iter().all(|is| *is);
    assert!(driven.located[..at].iter().all(|is| *is), "seed {seed}");
    assert!(!driven.located[at], "seed {seed}: located at once");
    let lost = driven.located[at..].iter().take_while(|is| !**is).count();
    println!(
        "seed {seed}: joined {is_joined}, located after {lost} scans, {worst:.3} m off: {:?}",
        slam.counters()
    );
    Outcome {
        driven,
        worst,
        is_joined,
        lost,
    }
}

#[test]
fn a_robot_carried_elsewhere_is_joined_again() {
    let world = ring();
    let round = path(&ROUND, 2);
    let half = round.len() / 2;
    let mut joined = 0;
    for seed in 0..SEEDS {
        let mut noise = Noise::new(seed, 41);
        // Somewhere else in the ring, and in half of the drives the other way round.
        let from = (noise.even(0.1, 0.9) * half as f64) as usize;
        let mut after = round[from..from + half / 2].to_vec();
        if seed % 2 == 1 {
            after.reverse();
            for pose in &mut after {
                pose.theta += core::f64::consts::PI;
            }
        }
        let before = (noise.even(1.05, 1.5) * half as f64) as usize;
        let outcome = carried(&world, &round[..before], &after, seed);
        assert!(
            outcome.worst < WRONG,
            "seed {seed}: {} m off",
            outcome.worst
        );
        assert_eq!(outcome.driven.mapped.len(), before + after.len());
        joined += u32::from(outcome.is_joined && outcome.lost < after.len());
    }
    assert!(joined >= 18, "{joined} of {SEEDS} joined again");
}

#[test]
fn a_robot_carried_into_one_of_two_rooms_alike_is_joined_to_the_right_one() {
    let world = twins();
    let round = path(&TWINS, 1);
    let mut joined = 0;
    for seed in 0..SEEDS {
        let mut noise = Noise::new(seed, 42);
        // From anywhere into the middle of one of the rooms, then round both of them.
        let room = usize::from(seed % 2 == 1);
        let deep = |pose: &TruePose| pose.y > 4.0 && (pose.x > 7.0) == (room == 1);
        let from = round.iter().position(deep).expect("in the room");
        let mut after = [&round[from..], &round[..from]].concat();
        let turned = noise.even(-0.3, 0.3);
        after.iter_mut().for_each(|pose| pose.theta += turned);
        let before = [
            &round[..],
            &round[..noise.even(0.0, 0.9 * round.len() as f64) as usize],
        ]
        .concat();
        let outcome = carried(&world, &before, &after, seed);
        assert!(
            outcome.worst < WRONG,
            "seed {seed}: {} m off",
            outcome.worst
        );
        joined += u32::from(outcome.is_joined && outcome.lost < after.len());
    }
    assert!(joined >= 18, "{joined} of {SEEDS} joined again");
}

#[test]
fn a_room_that_only_looks_like_the_known_one_is_not_taken_for_it() {
    let world = twins();
    let round = path(&TWINS, 1);
    // The first room and its corridor alone are known; then the robot wakes in the second.
    let is_first = |pose: &&TruePose| pose.x < 5.0;
    let known: Vec<TruePose> = round.iter().take_while(is_first).copied().collect();
    let deep = round.iter().position(|pose| pose.y > 4.0 && pose.x > 7.0);
    let after = &round[deep.expect("in the room")..];
    for seed in 0..SEEDS {
        let outcome = carried(&world, &known, after, seed);
        assert!(
            outcome.worst < WRONG,
            "seed {seed}: {} m off",
            outcome.worst
        );
    }
}

/// A drive round the ring, a flight to its other end, and half a round: a log, the truth, and the scan at which the flight
/// begins. Covered, the lidar sees nothing on the way.
fn flown(seed: u64, covered: bool) -> (Log, Vec<TruePose>, usize) {
    let [[x, y], rest @ ..] = ROUND;
    let way = [&rest[..], &[[x, y]]].concat();
    let before = Course::at(TruePose::new(x, y, 0.0)).through(&way).rest(0.5);
    let seconds = before.seconds();
    let heading = [3.1, 1.5][seed as usize % 2];
    let flight = before
        .truth(seconds)
        .between(TruePose::new(22.75, 16.75, heading));
    let course = before
        .carried(flight, 2.0)
        .rest(0.5)
        .through(&[[1.25, 16.75], [1.25, 1.25]]);
    let scene = Scene {
        mount: TruePose::default(),
        covers: if covered {
            vec![(seconds, seconds + 2.0)]
        } else {
            Vec::new()
        },
        ..Scene::new(ring(), course)
    };
    let (mut log, mut truth, mut at) = (Log::default(), Vec::new(), 0);
    for revolution in scene.run(seed) {
        at += usize::from(revolution.end < seconds);
        truth.push(revolution.truth);
        log.scans.push(Recorded {
            stamp: format!("{:.6}", revolution.end),
            wheels: revolution.wheels.map(Into::into),
            beams: revolution.beams,
        });
    }
    (log, truth, at)
}

#[test]
fn odometry_tells_that_the_robot_was_carried() {
    for (seed, covered) in [(0, true), (1, false)] {
        let (log, truth, at) = flown(seed, covered);
        let settings = Settings {
            tier: Tier::Of192k,
            odometry: OdometryConfig::DEFAULT,
            slam: SlamConfig::DEFAULT,
            scans: (log.scans.len(), true),
            pruning: None,
            resolution: None,
        };
        let map = mapping::run(&log, &settings, &mut || {}).expect("mapped");
        let counters = map.counters;
        let start = truth[0];
        let worst = |poses: &mut dyn Iterator<Item = (usize, beamfix::geometry::Pose)>| {
            poses.fold(0.0, |worst: f64, (k, pose)| {
                let place = start.then(TruePose::new(pose.x.into(), pose.y.into(), 0.0));
                worst.max((place.x - truth[k].x).hypot(place.y - truth[k].y))
            })
        };
        let scans = || map.scans.iter().enumerate();
        let told = scans().filter(|(_, scan)| scan.is_located && scan.is_measured);
        let online = worst(&mut told.map(|(k, scan)| (k, scan.online)));
        let measured = scans().filter(|(_, scan)| scan.is_measured);
        let mapped = worst(&mut measured.map(|(k, scan)| (k, scan.pose)));
        let lost = map.scans[at..]
            .iter()
            .filter(|scan| !scan.is_located)
            .count();
        println!(
            "seed {seed}: {online:.3} m online, {mapped:.3} m in the end, {lost} scans lost: {counters:?}"
        );
        assert!(
            counters.carried >= 1 && counters.joined >= 1,
            "{counters:?}"
        );
        assert!(online < WRONG && mapped < WRONG, "{online} m, {mapped} m");
        assert!((10..400).contains(&lost), "{lost} scans lost");
    }
}
