//! What a board says, as ROS 2 is to understand it: small numbers, each reckoned by hand.

use beamfix::geometry::Pose;
use beamfix::scan::Mount;
use beamfix_app::link::{self, FRAME};
use beamfix_app::telemetry::{
    self, Health, LidarState, Mounted, Piece, Ready, Reset, Task, Telemetry, Verdict,
};
use beamfix_bridge::convert::{Converter, mount};
use beamfix_bridge::message::Message;
use host_tests::report::ros::message::{LaserScan, Time};

const MS: i64 = 1_000_000;

fn framed(message: &Telemetry) -> Vec<u8> {
    let mut frame = heapless::Vec::<u8, FRAME>::new();
    assert!(link::append(message, &mut frame));
    frame.to_vec()
}

/// Number `k`, at the end of revolution `k` of a lidar that turns ten times a second.
fn pose(k: u16, at: [f32; 3], verdict: Verdict) -> Telemetry {
    Telemetry::Pose(telemetry::Pose {
        sequence: k,
        time_us: 100_000 * u32::from(k),
        pose: at,
        covariance: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        verdict,
        inliers: 300,
        beams: 400,
        residual: 0.01,
    })
}

/// Which came 5 ms after the revolution's end; that of number 0 was at one second.
fn say(converter: &mut Converter, k: u16, message: &Telemetry) -> Vec<Message> {
    converter.push(&framed(message), 1_005 * MS + 100 * MS * i64::from(k))
}

fn ready(task: Task) -> Telemetry {
    Telemetry::Ready(Ready {
        version: beamfix_app::VERSION,
        beams: 456,
        reset: Reset::Power,
        mount: Mounted {
            pose: [0.1, -0.02, core::f32::consts::FRAC_PI_2],
            upside_down: true,
        },
        lidar: "ld06".parse().expect("short"),
        task,
    })
}

/// The answer to the question what it is.
fn asked(task: Task) -> Telemetry {
    let Telemetry::Ready(ready) = ready(task) else {
        unreachable!();
    };
    Telemetry::Ready(Ready {
        reset: Reset::Asked,
        ..ready
    })
}

fn at_ms(time: Time) -> f64 {
    f64::from(time.sec) * 1e3 + f64::from(time.nanosec) * 1e-6
}

#[test]
fn odometry_has_frames_covariance_and_speed() {
    let mut converter = Converter::new(Task::Odometry);
    say(&mut converter, 0, &pose(0, [0.0; 3], Verdict::First));
    // A quarter of a turn to the left on a circle of 1 m.
    let quarter = core::f32::consts::FRAC_PI_2;
    let messages = say(
        &mut converter,
        1,
        &pose(1, [1.0, 1.0, quarter], Verdict::Measured),
    );
    let [
        Message::Transforms(transforms),
        Message::Odometry(odometry),
        Message::Diagnostics(told),
    ] = &messages[..]
    else {
        panic!("{messages:?}");
    };
    assert_eq!(
        (odometry.header.frame_id, odometry.child_frame_id),
        ("odom", "base_link")
    );
    assert_eq!(at_ms(odometry.header.stamp), 1105.0);
    assert_eq!(odometry.pose.position, [1.0, 1.0, 0.0]);
    let half = core::f64::consts::FRAC_1_SQRT_2;
    for (got, wanted) in odometry.pose.orientation.iter().zip([0.0, 0.0, half, half]) {
        assert!((got - wanted).abs() < 1e-7, "{odometry:?}");
    }
    let unknown = 1e6;
    assert_eq!(
        odometry.pose_covariance,
        [
            [1.0, 2.0, 0.0, 0.0, 0.0, 4.0],
            [2.0, 3.0, 0.0, 0.0, 0.0, 5.0],
            [0.0, 0.0, unknown, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, unknown, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, unknown, 0.0],
            [4.0, 5.0, 0.0, 0.0, 0.0, 6.0],
        ]
    );
    // In the robot's frame: π/2 m forward in 0.1 s.
    let speed = f64::from(quarter) / 0.1;
    for (got, wanted) in odometry
        .twist
        .as_flattened()
        .iter()
        .zip([speed, 0.0, 0.0, 0.0, 0.0, speed])
    {
        assert!((got - wanted).abs() < 1e-4, "{odometry:?}");
    }
    assert!((0..6).all(|k| odometry.twist_covariance[k][k] == unknown));
    let [transform] = &transforms[..] else {
        panic!("{transforms:?}");
    };
    assert_eq!(
        (transform.header.frame_id, transform.child_frame_id),
        ("odom", "base_link")
    );
    assert_eq!(transform.transform.position, odometry.pose.position);
    assert_eq!(at_ms(transform.header.stamp), 1105.0);
    assert_eq!(
        (told.status[0].level, &told.status[0].message[..]),
        (0, "the pose is measured")
    );
}

#[test]
fn a_refused_pose_is_told_and_an_unknown_one_is_no_pose() {
    let mut converter = Converter::new(Task::Odometry);
    say(&mut converter, 0, &pose(0, [0.0; 3], Verdict::First));
    let messages = say(
        &mut converter,
        1,
        &pose(1, [0.1, 0.0, 0.0], Verdict::Ambiguous),
    );
    // Predicted, with the covariance that the board tells: it is still the best that is known.
    let [
        Message::Transforms(_),
        Message::Odometry(_),
        Message::Diagnostics(told),
    ] = &messages[..]
    else {
        panic!("{messages:?}");
    };
    assert_eq!(
        (told.status[0].level, &told.status[0].message[..]),
        (1, "the pose is only predicted: Ambiguous")
    );
    // Told once.
    let messages = say(
        &mut converter,
        2,
        &pose(2, [0.2, 0.0, 0.0], Verdict::Ambiguous),
    );
    assert!(
        matches!(
            &messages[..],
            [Message::Transforms(_), Message::Odometry(_)]
        ),
        "{messages:?}"
    );

    let mut converter = Converter::new(Task::Localization);
    let messages = say(&mut converter, 0, &pose(0, [0.0; 3], Verdict::Searching));
    let [Message::Diagnostics(told)] = &messages[..] else {
        panic!("{messages:?}");
    };
    assert_eq!(
        (told.status[0].level, &told.status[0].message[..]),
        (2, "nobody knows the pose: Searching")
    );
    // Not a number: damaged in a way that the check code does not see, or a defective board.
    let messages = say(
        &mut converter,
        1,
        &pose(1, [f32::NAN, 0.0, 0.0], Verdict::Measured),
    );
    assert!(messages.is_empty(), "{messages:?}");
}

#[test]
fn a_board_that_answers_what_it_is_goes_on_and_one_that_starts_begins_anew() {
    let mut converter = Converter::new(Task::Odometry);
    say(&mut converter, 0, &pose(0, [0.0; 3], Verdict::First));
    assert!(!converter.is_known);
    let messages = say(&mut converter, 0, &asked(Task::Localization));
    assert!(matches!(&messages[..], [Message::Mount(_)]), "{messages:?}");
    assert_eq!((converter.is_known, converter.starts), (true, 0));
    // The numbers go on, so that what is lost is seen; and the pose is one in the map.
    let messages = say(&mut converter, 3, &pose(3, [0.0; 3], Verdict::Measured));
    assert!(
        messages
            .iter()
            .any(|message| matches!(message, Message::Pose(_))),
        "{messages:?}"
    );
    assert_eq!(converter.missing, 2);
    say(&mut converter, 4, &ready(Task::Odometry));
    assert_eq!(converter.starts, 1);
    say(&mut converter, 9, &pose(9, [0.0; 3], Verdict::Measured));
    assert_eq!(converter.missing, 2);
}

#[test]
fn a_defective_lidar_and_silence_are_told() {
    let mut converter = Converter::new(Task::Odometry);
    let health = Health {
        lidar: LidarState::Silent,
        bytes_lost: 7,
        ..Health::default()
    };
    let messages = say(&mut converter, 0, &Telemetry::Health(health));
    let [Message::Diagnostics(told)] = &messages[..] else {
        panic!("{messages:?}");
    };
    assert_eq!(
        (told.status[0].level, &told.status[0].message[..]),
        (2, "the lidar: Silent")
    );
    assert!(
        told.status[0]
            .values
            .contains(&("bytes lost", "7".to_owned()))
    );
    assert!(converter.silence(3_000 * MS).is_some());
    assert!(converter.silence(3_010 * MS).is_none());
}

#[test]
fn in_a_map_the_wheels_frame_is_placed_and_without_wheels_the_robot() {
    let mut converter = Converter::new(Task::Odometry);
    let messages = say(&mut converter, 0, &ready(Task::Localization));
    // Head down, looking left: turned about z, then over.
    let [Message::Mount(laser)] = &messages[..] else {
        panic!("{messages:?}");
    };
    assert_eq!(
        (laser.header.frame_id, laser.child_frame_id),
        ("base_link", "laser")
    );
    assert_eq!(
        laser.transform.position.map(|v| v as f32),
        [0.1, -0.02, 0.0]
    );
    let half = core::f64::consts::FRAC_1_SQRT_2;
    for (got, wanted) in laser
        .transform
        .orientation
        .iter()
        .zip([half, half, 0.0, 0.0])
    {
        assert!((got - wanted).abs() < 1e-7, "{laser:?}");
    }
    let messages = say(
        &mut converter,
        0,
        &pose(0, [2.0, 3.0, 0.0], Verdict::Measured),
    );
    let [
        Message::Transforms(both),
        Message::Pose(pose_in_map),
        Message::Diagnostics(_),
    ] = &messages[..]
    else {
        panic!("{messages:?}");
    };
    assert_eq!(pose_in_map.header.frame_id, "map");
    let frames: Vec<_> = both
        .iter()
        .map(|t| (t.header.frame_id, t.child_frame_id, t.transform.position))
        .collect();
    assert_eq!(
        frames,
        [
            ("map", "odom", [0.0; 3]),
            ("odom", "base_link", [2.0, 3.0, 0.0])
        ]
    );

    // Wheels 50 ms before and after the next pose: between them the robot was at x = 0.5.
    for (ms, x) in [(1055, 0.0), (1155, 1.0)] {
        let Some(Message::Transforms(moved)) = converter.wheels(Pose::new(x, 0.0, 0.0), ms * MS)
        else {
            panic!("no transform of the wheels");
        };
        assert_eq!(
            (moved[0].header.frame_id, moved[0].child_frame_id),
            ("odom", "base_link")
        );
        assert_eq!(at_ms(moved[0].header.stamp), ms as f64);
    }
    let messages = say(
        &mut converter,
        1,
        &pose(1, [2.5, 3.0, 0.0], Verdict::Measured),
    );
    let Some(Message::Transforms(one)) = messages.first() else {
        panic!("{messages:?}");
    };
    let frames: Vec<_> = one
        .iter()
        .map(|t| (t.header.frame_id, t.child_frame_id, t.transform.position))
        .collect();
    assert_eq!(frames, [("map", "odom", [2.0, 3.0, 0.0])]);
    // By odometry the board's own pose is the transform.
    assert!(
        Converter::new(Task::Odometry)
            .wheels(Pose::IDENTITY, 0)
            .is_none()
    );
}

/// Four beams of revolution `k`, from straight ahead on, in steps of `quarter` (1/65 536 turn).
fn revolution(converter: &mut Converter, k: u16, quarter: i32) -> Vec<Message> {
    let mut messages = Vec::new();
    for n in 0..4 {
        let bearing = (quarter * n) as u16;
        let piece = Piece {
            turn_start: (n == 0).then_some(0),
            first: bearing,
            last: bearing,
            ranges_mm: [[1000, 2000, 0, 4000][n as usize]].into_iter().collect(),
        };
        messages.extend(say(converter, k, &Telemetry::Scan(piece)));
    }
    messages
}

/// The scan of two revolutions and the poses at their ends.
fn scan(quarter: i32) -> LaserScan<'static> {
    let mut converter = Converter::new(Task::Odometry);
    say(&mut converter, 0, &ready(Task::Odometry));
    say(&mut converter, 0, &pose(0, [0.0; 3], Verdict::First));
    assert!(revolution(&mut converter, 0, quarter).is_empty());
    say(&mut converter, 1, &pose(1, [0.0; 3], Verdict::Measured));
    let messages = revolution(&mut converter, 1, quarter);
    let [Message::Scan(scan)] = &messages[..] else {
        panic!("{messages:?}");
    };
    // One whose pose was lost has no time.
    assert!(revolution(&mut converter, 2, quarter).is_empty());
    scan.clone()
}

#[test]
fn a_clockwise_scan_is_stamped_at_its_end_and_runs_back_in_time() {
    let scan = scan(-16_384);
    assert_eq!(scan.header.frame_id, "laser");
    assert_eq!(at_ms(scan.header.stamp), 1105.0);
    assert!(
        (scan.scan_time - 0.1).abs() < 1e-6 && (scan.time_increment + 0.025).abs() < 1e-6,
        "{scan:?}"
    );
    assert_eq!(scan.ranges, [4.0, f32::INFINITY, 2.0, 1.0]);
    let turn = core::f32::consts::TAU;
    assert!(
        (scan.angle_min - 0.25 * turn).abs() < 1e-6 && (scan.angle_max - turn).abs() < 1e-6,
        "{scan:?}"
    );
    assert!((scan.angle_increment - 0.25 * turn).abs() < 1e-6);
    // An LD06's.
    assert_eq!((scan.range_min, scan.range_max), (0.02, 12.0));
    assert!(scan.intensities.is_empty());
}

#[test]
fn a_counter_clockwise_scan_is_stamped_at_its_start_and_runs_forward() {
    let scan = scan(16_384);
    assert!((at_ms(scan.header.stamp) - 1030.0).abs() < 1e-3, "{scan:?}");
    assert!((scan.time_increment - 0.025).abs() < 1e-6, "{scan:?}");
    assert_eq!(scan.ranges, [1.0, 2.0, f32::INFINITY, 4.0]);
    assert!(
        scan.angle_min.abs() < 1e-6
            && (scan.angle_max - 0.75 * core::f32::consts::TAU).abs() < 1e-6
    );
}

#[test]
fn a_lidar_that_stands_upright_is_only_turned() {
    let told = Mount {
        robot_from_lidar: Pose::new(0.0, 0.0, core::f32::consts::PI),
        upside_down: false,
    };
    let [x, y, z, w] = mount(told, 0).transform.orientation;
    assert!(x == 0.0 && y == 0.0 && (z.abs() - 1.0).abs() < 1e-7 && w.abs() < 1e-7);
}

#[test]
fn what_cannot_be_is_said_in_one_line() {
    for (arguments, word) in [
        (&["/nowhere/at/all"][..], "/nowhere/at/all"),
        (&["/dev/null", "--odom", "wheel_odom"], "the same topic"),
        (&["/dev/null", "--map", "/nowhere.yaml"], "/nowhere.yaml"),
    ] {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_beamfix-bridge"))
            .args(arguments)
            .output()
            .expect("the bridge");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(
            said.trim_end().lines().count() == 1 && said.contains(word),
            "{said}"
        );
    }
}
