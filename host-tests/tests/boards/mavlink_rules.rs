//! What an autopilot relies on, a test a rule, on the messages themselves: `docs/mavlink.md` has the rules.

use std::f32::consts::{FRAC_PI_2, PI};

use beamfix::{
    geometry::{Pose, Twist},
    scan::{Beam, Bearing, Mount, NoReturn, Range, Scan},
};
use beamfix_app::{
    App, AppConfig, BEAMS, CONFIG, Output,
    mavlink::{self, Autopilot, Limits, Told, UNKNOWN_CM},
    telemetry::{self, Reset, Verdict},
};
use beamfix_sim::encoder::{Echo, Encoder as _, ld06::Sensor};

const MAVLINK: AppConfig = AppConfig {
    output: Output::Mavlink,
    ..CONFIG
};

fn mounted(x: f32, y: f32, theta: f32, upside_down: bool) -> AppConfig {
    let mut config = MAVLINK;
    config.odometry.points.mount = Mount {
        robot_from_lidar: Pose::new(x, y, theta),
        upside_down,
    };
    config
}

/// A revolution of 360 beams; `range` has each one's, by its bearing at the lidar (whole degrees, counter-clockwise).
fn scan(range: impl Fn(i32) -> Range) -> Scan<BEAMS> {
    let mut scan = Scan::new();
    for degree in 0..360 {
        let beam = Beam {
            bearing: Bearing::from_radians((degree as f32).to_radians()),
            range: range(degree),
            time_us: 277 * degree as u32,
            quality: 200,
        };
        scan.push(beam).expect("room");
    }
    scan
}

/// The sectors with something in them, and how far it is (cm).
fn found(config: &AppConfig, scan: &Scan<BEAMS>) -> Vec<(usize, u16)> {
    let limits = Limits::of(config);
    let told = mavlink::obstacles(scan, &limits, 0);
    (told.distances.iter().enumerate())
        .filter(|(_, cm)| **cm <= told.max_distance)
        .map(|(sector, cm)| (sector, *cm))
        .collect()
}

#[test]
fn obstacles_are_where_they_are_seen_from_the_robot() {
    // Something 1 m away in one direction at the lidar, nothing anywhere else. Sectors of 5° clockwise from forward: 18 is right, 54 left.
    let one = |at: i32| {
        scan(move |degree| match degree == at {
            true => Range::from_mm(1000),
            false => Range::none(NoReturn::TooFar),
        })
    };
    let right = 270;
    //   lidar on the robot           seen at   sector, cm
    for (config, at, wanted) in [
        (mounted(0.0, 0.0, 0.0, false), right, (18, 100)),
        (mounted(0.0, 0.0, PI, false), right, (54, 100)),
        (mounted(0.0, 0.0, 0.0, true), right, (54, 100)),
        (mounted(0.0, 0.0, FRAC_PI_2, false), right, (0, 100)),
        (mounted(0.0, 0.0, FRAC_PI_2, true), right, (36, 100)),
        // In front of the robot's centre, looking forward: what is ahead is farther from the centre, what is at the side is ahead.
        (mounted(0.5, 0.0, 0.0, false), 0, (0, 150)),
        (mounted(1.0, 0.0, 0.0, false), right, (9, 141)),
        (mounted(0.0, -0.4, 0.0, false), right, (18, 140)),
        (mounted(0.0, 0.4, 0.0, false), right, (18, 60)),
    ] {
        let mount = config.odometry.points.mount;
        let seen = found(&config, &one(at));
        // Rounding may take a centimetre.
        assert!(
            matches!(seen[..], [(sector, cm)] if sector == wanted.0 && cm.abs_diff(wanted.1) <= 1),
            "{mount:?}: {seen:?}, not {wanted:?}"
        );
    }
}

#[test]
fn unknown_is_never_free() {
    let limits = Limits::of(&MAVLINK);
    //   what a sector's beams say, in turn                               what the sector is
    let (min, max) = (mavlink::obstacles(&scan(|_| Range::from_mm(0)), &limits, 0)).pipe(|told| {
        assert!(
            told.distances.iter().all(|cm| *cm == UNKNOWN_CM),
            "{told:?}"
        );
        (told.min_distance, told.max_distance)
    });
    assert_eq!((min, max), (5, 1200), "an LD06's limits, from 5 cm on");
    let (far, near) = (
        Range::none(NoReturn::TooFar),
        Range::none(NoReturn::TooNear),
    );
    let unknown = [
        Range::none(NoReturn::Nothing),
        Range::none(NoReturn::Doubtful),
        Range::none(NoReturn::Filtered),
        Range::none(NoReturn::Sensor(3)),
    ];
    for (beams, wanted) in [
        (vec![far], max + 1),
        (vec![Range::from_mm(12_001)], max + 1),
        (vec![near], min),
        (vec![Range::from_mm(10)], min),
        (vec![far, near], min),
        (vec![far, Range::from_mm(3000)], 300),
        (vec![Range::from_mm(2999), far, Range::from_mm(3000)], 299),
    ]
    .into_iter()
    .chain(unknown.iter().flat_map(|unknown| {
        [
            (vec![*unknown], UNKNOWN_CM),
            (vec![far, *unknown], UNKNOWN_CM),
            (vec![far, *unknown, Range::from_mm(3000)], 300),
        ]
    })) {
        let told = mavlink::obstacles(&scan(|k| beams[k as usize % beams.len()]), &limits, 0);
        assert!(
            told.distances.iter().all(|cm| *cm == wanted),
            "{beams:?}: {told:?}, not {wanted}"
        );
    }
    // Half of the view: of the sectors at its ends a part is unknown.
    let half = scan(|degree| match degree < 180 {
        true => far,
        false => Range::none(NoReturn::Nothing),
    });
    let told = mavlink::obstacles(&half, &limits, 0);
    assert_eq!(
        told.distances.iter().filter(|cm| **cm == max + 1).count(),
        35,
        "{told:?}"
    );
}

/// For a value in an expression.
trait Pipe: Sized {
    fn pipe<R>(self, f: impl FnOnce(Self) -> R) -> R {
        f(self)
    }
}
impl<T> Pipe for T {}

fn told(autopilot: Autopilot) -> Told {
    Told {
        pose: telemetry::Pose {
            sequence: 3,
            time_us: 0,
            pose: [1.0, 2.0, 0.5],
            covariance: [0.01, 0.001, 0.02, 0.0001, 0.0002, 0.0003],
            verdict: Verdict::Measured,
            inliers: 300,
            beams: 400,
            residual: 0.01,
        },
        twist: Some(Twist::ZERO),
        resets: 7,
        autopilot,
    }
}

#[test]
fn what_a_flat_lidar_cannot_know_is_told_as_not_known() {
    // z, roll, pitch; vz, roll and pitch rates.
    const UNKNOWN: [usize; 3] = [11, 15, 18];
    let px4 = mavlink::odometry(&told(Autopilot::Px4), 0);
    for covariance in [px4.pose_covariance, px4.velocity_covariance] {
        // PX4 takes its own parameters for all axes where one is not finite.
        assert!(
            covariance.iter().all(|value| value.is_finite()),
            "{covariance:?}"
        );
        for at in UNKNOWN {
            assert!(covariance[at] >= 10.0, "{at}: {covariance:?}");
        }
        for at in [0, 6, 20] {
            assert!(
                covariance[at] > 0.0 && covariance[at] < 0.1,
                "{at}: {covariance:?}"
            );
        }
    }
    // ArduPilot adds up all axes: what is measured must stay what it is.
    let ardupilot = mavlink::odometry(&told(Autopilot::ArduPilot), 0).pose_covariance;
    let squares: f32 = [0, 6, 11]
        .iter()
        .map(|at| ardupilot[*at] * ardupilot[*at])
        .sum();
    // Its error is the cube root of that (m): below 0.1.
    assert!(squares < 0.001, "{ardupilot:?}");
    assert_eq!(px4.reset_counter, 7);
}

#[test]
fn the_time_never_goes_back() {
    let mut link = mavlink::Link::new();
    let (mut clock, mut last) = (0u64, 0);
    // Three hours in steps of seven minutes, and the clock of 32 bits wraps twice.
    for _ in 0..26 {
        clock += 420_000_000;
        link.set_time(clock as u32);
        assert_eq!(link.now_us(), clock);
        assert!(link.now_us() > last);
        last = link.now_us();
    }
    // A clock that is set back a little stands.
    link.set_time((clock - 1000) as u32);
    assert_eq!(link.now_us(), clock);
    let told = mavlink::odometry(&told(Autopilot::Px4), clock);
    assert_eq!(told.time_usec, clock);
}

/// The messages of a stream: number in the sequence, and what it is.
fn messages(bytes: &[u8]) -> Vec<(u8, u32)> {
    let (mut rest, mut found) = (bytes, Vec::new());
    while let [0xfd, length, 0, _, sequence, _, _, a, b, c, ..] = *rest {
        found.push((sequence, u32::from_le_bytes([a, b, c, 0])));
        rest = &rest[12 + usize::from(length)..];
    }
    assert!(rest.is_empty(), "{} bytes are no message", rest.len());
    found
}

const HEARTBEAT: u32 = 0;
const OBSTACLE_DISTANCE: u32 = 330;
const ODOMETRY: u32 = 331;

#[test]
fn one_sequence_counts_all_messages_and_heartbeats_come_without_a_lidar() {
    let mut app = Box::new(App::<BEAMS>::new(MAVLINK));
    let mut sent = app.ready(Reset::Power).to_vec();
    // Ten seconds of silence, with the loop's looks; then three of a lidar.
    for tick in 0..500u32 {
        app.set_time(20_000 * tick);
        sent.extend_from_slice(app.tick());
    }
    let beats = messages(&sent);
    assert!(beats.iter().all(|(_, kind)| *kind == HEARTBEAT));
    assert_eq!(beats.len(), 10, "one at the start and one each second");
    let mut bytes = Vec::new();
    let mut sensor = Sensor::ld06();
    while sensor.next_time_us() < 3e6 {
        sensor.fire(
            &mut |_, _| {
                Some(Echo {
                    range_mm: 2000.0,
                    intensity: 200,
                })
            },
            &mut bytes,
        );
    }
    for (k, piece) in bytes.chunks(352).enumerate() {
        app.set_time(10_000_000 + 20_000 * k as u32);
        sent.extend_from_slice(app.tick());
        app.lidar_all(piece, |out| sent.extend_from_slice(out));
    }
    let all = messages(&sent);
    for (k, (sequence, _)) in all.iter().enumerate() {
        assert_eq!(*sequence, k as u8, "message {k} of {}", all.len());
    }
    let count = |wanted| all.iter().filter(|(_, kind)| *kind == wanted).count();
    assert!(count(ODOMETRY) >= 27 && count(ODOMETRY) == count(OBSTACLE_DISTANCE));
    assert!(
        (12..=14).contains(&count(HEARTBEAT)),
        "{}",
        count(HEARTBEAT)
    );
}

#[test]
fn a_keyframe_given_up_counts_as_a_reset() {
    let mut app = Box::new(App::<BEAMS>::new(MAVLINK));
    let mut sent = app.ready(Reset::Power).to_vec();
    let mut sensor = Sensor::ld06();
    let mut bytes = Vec::new();
    // A room, a cover for two seconds, and another room: narrower, seen from elsewhere.
    while sensor.next_time_us() < 8e6 {
        sensor.fire(
            &mut |time, bearing| {
                let (turned, long, wide) = match time < 4e6 {
                    true => (bearing, 2000.0, 2800.0),
                    false => (bearing + 0.7, 900.0, 5200.0),
                };
                let to_wall = (long / libm::sin(turned).abs()).min(wide / libm::cos(turned).abs());
                (!(2e6..4e6).contains(&time)).then_some(Echo {
                    range_mm: to_wall,
                    intensity: 200,
                })
            },
            &mut bytes,
        );
    }
    app.lidar_all(&bytes, |out| sent.extend_from_slice(out));
    // The field comes after the covariances: the counter is the third last byte of the extended message, unless zeros were cut off.
    let mut rest = &sent[..];
    let mut counters = Vec::new();
    while let [0xfd, length, ..] = *rest {
        let payload = &rest[10..10 + usize::from(length)];
        if rest[7..10] == ODOMETRY.to_le_bytes()[..3] {
            counters.push(payload.get(230).copied().unwrap_or(0));
        }
        rest = &rest[12 + usize::from(length)..];
    }
    let (first, last) = (counters.first(), counters.last());
    assert_eq!((first, last), (Some(&0), Some(&1)), "{counters:?}");
}
