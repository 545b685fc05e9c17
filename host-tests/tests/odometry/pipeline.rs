//! One pipeline: what a board makes of bytes, wheels and gyroscope, the tool makes of a recording of them.

use beamfix::geometry::{EgoMotion, Pose};
use beamfix::lidar::Protocol as _;
use beamfix::lidar::ld06::check_code;
use beamfix::lidar::parsers::Ldrobot;
use beamfix::odometry::{Odometry, OdometryConfig};
use beamfix::pipeline::Late;
use beamfix::scan::Scan;
use beamfix_app::command::Command;
use beamfix_app::telemetry::{self, Telemetry};
use beamfix_app::{App, AppConfig, BEAMS, CONFIG, link};
use beamfix_sim::encoder::ld06::Sensor;
use beamfix_sim::robot::WheelErrors;
use beamfix_sim::{Drive, Settings, TruePose, drive};
use host_tests::board::Replay;
use host_tests::board::commands::Commands;
use host_tests::formats;
use host_tests::formats::capture::log::{self, Revolution};
use host_tests::formats::capture::{self, Content, Recorder};
use host_tests::golden::difference;
use host_tests::pipeline::{Pipeline, follow};

/// A drive with the lidar at the robot's centre, as the firmware has it.
fn driven(seconds: f64) -> Drive {
    driven_on(seconds, WheelErrors::DEFAULT)
}

/// The same on wheels that err like this.
fn driven_on(seconds: f64, wheels: WheelErrors) -> Drive {
    let settings = Settings {
        seconds,
        mount: TruePose::new(0.0, 0.0, 0.0),
        wheels,
        ..Settings::DEFAULT
    };
    drive(&settings, &mut Sensor::ld06())
}

/// Poses of the firmware's application.
fn on_board(bytes: &[u8]) -> Vec<Pose> {
    let mut commands = Commands::new();
    commands.lidar(bytes);
    let replay = Replay::on_host(&commands, BEAMS);
    let poses = replay.poses().map(|pose| {
        let [x, y, theta] = pose.pose;
        Pose { x, y, theta }
    });
    poses.collect()
}

fn revolutions(bytes: &[u8]) -> Vec<Revolution> {
    log::revolutions("ld06", bytes).expect("an LD06").0
}

#[test]
fn an_interrupted_recording_gives_the_boards_poses() {
    let drive = driven(8.0);
    let frames: Vec<&[u8]> = drive
        .frames
        .iter()
        .scan(0, |start, &(end, _)| {
            let frame = &drive.bytes[*start..end];
            *start = end;
            Some(frame)
        })
        .collect();
    // 375 frames a second; 1.5 s are 15 revolutions, so that what follows goes on in the same direction.
    for (pause, lost) in [(0, 0), (562, 1), (375, 0)] {
        for at in [1000, 1010, 1037] {
            let bytes = [&frames[..at], &frames[at + pause..]].concat().concat();
            let mut pipeline = Pipeline::<BEAMS>::new(OdometryConfig::DEFAULT);
            let poses: Vec<Pose> = revolutions(&bytes)
                .iter()
                .map(|revolution| pipeline.step(&revolution.beams, None).pose)
                .collect();
            let board = on_board(&bytes);
            assert_eq!(difference(&board, &poses), None, "{pause} frames from {at}");
            assert!(poses.len() + lost + pause / 37 >= 76, "{}", poses.len());
        }
    }
}

#[test]
fn the_poses_do_not_depend_on_the_capacity_that_holds_the_beams() {
    fn poses<const N: usize>(revolutions: &[Revolution]) -> Vec<Pose> {
        let mut odometry = Box::new(Odometry::<N>::new(OdometryConfig::DEFAULT));
        let mut scan = Box::new(Scan::<N>::new());
        let follow = revolutions.iter().map(|revolution| {
            scan.clear();
            for &beam in &revolution.beams {
                scan.push(beam).expect("room");
            }
            odometry.update(&scan, EgoMotion::UNKNOWN).pose
        });
        follow.collect()
    }
    let revolutions = revolutions(&driven(12.0).bytes);
    let wanted = poses::<456>(&revolutions);
    assert_eq!(difference(&wanted, &poses::<457>(&revolutions)), None);
    assert_eq!(difference(&wanted, &poses::<720>(&revolutions)), None);
    assert_eq!(difference(&wanted, &poses::<1024>(&revolutions)), None);
    // One that does not hold all directions has others.
    assert!(difference(&wanted, &poses::<451>(&revolutions)).is_some());
}

/// What a robot sends its board besides the lidar's bytes.
#[derive(Debug, Clone, Copy)]
struct Senses {
    /// Time between two poses of the wheels, and a message that is lost.
    wheels_ms: Option<u32>,
    lost: Option<u32>,
    /// Time between two rates of the gyroscope.
    gyro_ms: Option<u32>,
}

/// A drive with wheels and gyroscope at their own rates, all on one clock; from second to second of `covered` the lidar
/// sees nothing.
fn recorded(drive: &Drive, senses: Senses, covered: (f64, f64)) -> Vec<u8> {
    let mut events: Vec<(u64, Content)> = Vec::new();
    let mut start = 0;
    let mut frames = Vec::new();
    for &(end, measured_us) in &drive.frames {
        let mut frame = drive.bytes[start..end].to_vec();
        if (covered.0..covered.1).contains(&(measured_us * 1e-6)) {
            for point in frame[6..42].chunks_exact_mut(3) {
                point[..2].copy_from_slice(&[0, 0]);
            }
            frame[46] = check_code(&frame[..46]);
        }
        // 47 bytes of ten bits at 230 400 baud.
        frames.push((measured_us as u64 + 2040, frame));
        start = end;
    }
    events.extend(
        frames
            .iter()
            .map(|(us, frame)| (*us, Content::Bytes(frame))),
    );
    let at = |ms: u32| {
        let seconds = f64::from(ms) * 1e-3;
        let next = drive
            .moments
            .partition_point(|moment| moment.time <= seconds);
        drive.moments[next.saturating_sub(1)]
    };
    let end_ms = (drive.moments.last().expect("a drive").time * 1e3) as u32;
    if let Some(every) = senses.wheels_ms {
        for ms in (0..end_ms).step_by(every as usize) {
            if senses.lost != Some(ms / every) {
                events.push((u64::from(ms) * 1000, Content::Wheels(at(ms).wheels.into())));
            }
        }
    }
    if let Some(every) = senses.gyro_ms {
        for ms in (every..end_ms).step_by(every as usize) {
            let turned = at(ms - every).truth.between(at(ms).truth).theta;
            let rate = (turned * 1e3 / f64::from(every)) as f32;
            // The mean over the time before it was the rate in its middle.
            events.push((u64::from(ms - every / 2) * 1000, Content::Gyro(rate)));
        }
    }
    events.sort_by_key(|&(us, _)| us);
    let mut recorder = Recorder::new(Vec::new()).expect("memory");
    recorder.push(0, Content::Lidar("ld06")).expect("memory");
    for (us, content) in events {
        recorder.push(us, content).expect("memory");
    }
    recorder.finish().expect("memory")
}

/// The application over a capture, its clock starting at any time: what it sends, all of it asked for.
fn board_over(capture: &[u8], start_us: u32) -> Vec<Telemetry> {
    let mut app = Box::new(App::<BEAMS>::new(AppConfig {
        record: true,
        quality: true,
        ..CONFIG
    }));
    let mut sent = Vec::new();
    let command = |app: &mut App<BEAMS>, command: Command, sent: &mut Vec<u8>| {
        let mut frame = heapless::Vec::<u8, 128>::new();
        assert!(link::append(&command, &mut frame));
        app.command_all(&frame, |out| sent.extend_from_slice(out));
    };
    let mut slices = [1usize, 7, 32, 3, 60].into_iter().cycle();
    for piece in capture::pieces(capture) {
        let us = piece.time_us.expect("written") as u32;
        app.set_time(start_us.wrapping_add(us));
        match piece.content {
            // As they come out of a buffer: any number at a time, later ones later.
            Content::Bytes(mut bytes) => {
                let mut later_us = us;
                while !bytes.is_empty() {
                    let count = slices.next().expect("endless").min(bytes.len());
                    app.lidar_all(&bytes[..count], |out| sent.extend_from_slice(out));
                    bytes = &bytes[count..];
                    later_us += 150;
                    app.set_time(start_us.wrapping_add(later_us));
                }
            }
            Content::Wheels(Pose { x, y, theta }) => {
                command(&mut app, Command::Wheels { x, y, theta }, &mut sent);
            }
            Content::Gyro(rate) => command(&mut app, Command::Gyro { rate }, &mut sent),
            _ => {}
        }
    }
    command(&mut app, Command::Health, &mut sent);
    let mut receiver = link::Receiver::new();
    let messages = sent
        .iter()
        .filter_map(|&byte| receiver.push(byte))
        .collect();
    assert_eq!(receiver.counters().errors, 0);
    messages
}

fn poses(messages: &[Telemetry]) -> Vec<Pose> {
    let poses = messages.iter().filter_map(|message| match message {
        Telemetry::Pose(telemetry::Pose { pose, .. }) => Some(*pose),
        _ => None,
    });
    poses.map(|[x, y, theta]| Pose { x, y, theta }).collect()
}

/// The tool over a capture.
fn tool_over(capture: Vec<u8>) -> Vec<Pose> {
    let content = formats::bytes::Content {
        bytes: capture,
        cut: None,
    };
    let log = log::parse("test", content, "ld06").expect("an LD06");
    let mut poses = Vec::new();
    let odometry = Odometry::<BEAMS>::new(CONFIG.odometry);
    follow(&log, (usize::MAX, true), odometry, &mut |_, pose, _| {
        poses.push(pose);
        Ok(())
    })
    .expect("nothing fails");
    poses
}

#[test]
fn a_boards_drive_with_wheels_and_gyroscope_replays_to_the_same_bits() {
    let drive = driven(12.0);
    for senses in [
        Senses {
            wheels_ms: Some(37),
            lost: Some(90),
            gyro_ms: None,
        },
        Senses {
            wheels_ms: Some(200),
            lost: None,
            gyro_ms: Some(10),
        },
        Senses {
            wheels_ms: None,
            lost: None,
            gyro_ms: Some(20),
        },
    ] {
        let sent = recorded(&drive, senses, (0.0, 0.0));
        // The board's clock wraps on the way.
        let messages = board_over(&sent, u32::MAX - 5_000_000);
        let echoes = messages
            .iter()
            .filter(|message| matches!(message, Telemetry::Wheels(_) | Telemetry::Gyro(_)))
            .count();
        assert!(echoes > 50, "{senses:?}: {echoes}");
        let mut frames = Vec::new();
        for message in &messages {
            let mut frame = heapless::Vec::<u8, 256>::new();
            assert!(link::append(message, &mut frame));
            frames.extend_from_slice(&frame);
        }
        let capture = capture::telemetry::capture(&frames).expect("a board's frames");
        // The pose's covariance is that of the way since the start, not that of its last match.
        let since_start = messages.iter().rev().find_map(|message| match message {
            Telemetry::Pose(pose) => Some(pose.covariance),
            _ => None,
        });
        let of_match = messages.iter().rev().find_map(|message| match message {
            Telemetry::Quality(quality) => quality.found.ok().map(|found| found.covariance),
            _ => None,
        });
        let (since_start, of_match) = (since_start.expect("poses"), of_match.expect("matches"));
        assert!(
            since_start[5] > 2.0 * of_match[5],
            "{since_start:?} {of_match:?}"
        );
        let (board, tool) = (poses(&messages), tool_over(capture));
        assert!(board.len() > 110, "{}", board.len());
        assert_eq!(difference(&board, &tool), None, "{senses:?}");
        // And wheels and gyroscope have a say.
        let without = tool_over(recorded(
            &drive,
            Senses {
                wheels_ms: None,
                lost: None,
                gyro_ms: None,
            },
            (0.0, 0.0),
        ));
        assert!(difference(&board, &without).is_some(), "{senses:?}");
    }
}

#[test]
fn wheels_of_any_rate_and_a_gyroscope_lead_through_a_cover_that_blinds_the_lidar() {
    /// What the simulated robot does at most: m/s, m/s², rad/s, rad/s².
    const SPEED: f64 = 0.65;
    const ACCELERATION: f64 = 0.6;
    const TURN: f64 = 1.4;
    const TURN_ACCELERATION: f64 = 5.0;
    /// Its wheels' counters are read so often (s).
    const PERIOD: f64 = 0.01;
    /// What the last match before the cover and the one at its edge may be off together (m, rad): a centimetre and half
    /// a degree each, an LD06's noise on a few surfaces.
    const MATCH: (f64, f64) = (0.02, 0.02);
    // In these seconds the robot turns hard.
    let (from, to) = (10.0, 11.5);
    // Wheels without errors of their own: what is left is what the pipeline makes of their messages.
    let wheels = WheelErrors {
        scale: [0.0; 2],
        noise: 0.0,
        slips_per_s: 0.0,
        ..WheelErrors::DEFAULT
    };
    let drive = driven_on(to + 0.2, wheels);
    let revolutions = revolutions(&drive.bytes);
    let moment = |k: usize| drive.moments[revolutions[k].ends_at - 1];
    let last_before = |seconds: f64| {
        (0..revolutions.len())
            .rfind(|&k| moment(k).time < seconds)
            .expect("a revolution")
    };
    // The way is measured from the last revolution that sees all, so that no drift of before counts, to the last one that
    // sees nothing.
    let (first, last) = (last_before(from), last_before(to));
    let off = |senses| {
        let poses = tool_over(recorded(&drive, senses, (from, to)));
        let driven = moment(first).truth.between(moment(last).truth);
        let told = TruePose::from(poses[first]).between(poses[last].into());
        let off = driven.between(told);
        (off.distance(), off.theta.abs())
    };
    // After the last message the motion is believed to be as even as it was between the last two: the velocity is that
    // of half the time between messages ago, and changes for as long as that time again at most.
    let by_wheels = |wheels_ms: u32| {
        let every = f64::from(wheels_ms) * 1e-3;
        let turned = TURN_ACCELERATION * every * every + TURN * PERIOD;
        let moved = ACCELERATION * every * every + SPEED * PERIOD + SPEED * every * turned;
        (MATCH.0 + moved, MATCH.1 + turned)
    };
    let none = Senses {
        wheels_ms: None,
        lost: None,
        gyro_ms: None,
    };
    let gyro_ms = Some(10);
    let mut cases: Vec<(Senses, (f64, f64))> = Vec::new();
    // A message that is lost in the middle of the cover is made up for by the next one.
    for (wheels_ms, lost) in [(10, None), (100, Some(105)), (200, None), (200, Some(53))] {
        let senses = Senses {
            wheels_ms: Some(wheels_ms),
            lost,
            gyro_ms: None,
        };
        let allowed = by_wheels(wheels_ms);
        cases.push((senses, allowed));
        // The gyroscope's rates are true, and come often: the heading is as it was before the cover.
        cases.push((Senses { gyro_ms, ..senses }, (allowed.0, MATCH.1)));
    }
    // A gyroscope alone tells nothing of the distance.
    cases.push((Senses { gyro_ms, ..none }, (SPEED * (to - from), MATCH.1)));
    let blind = off(none);
    let mut failed = Vec::new();
    for (senses, allowed) in cases {
        let found = off(senses);
        println!("{senses:?}: {found:.3?}, allowed {allowed:.3?}, blind {blind:.3?}");
        // The cover must matter, or nothing is shown.
        if found.0 > allowed.0 || found.1 > allowed.1 || blind.1 < 2.0 * allowed.1 {
            failed.push((senses, found, allowed));
        }
    }
    assert!(failed.is_empty(), "blind {blind:?}: {failed:?}");
}

#[test]
fn no_bytes_are_no_packet() {
    let drive = driven(3.0);
    let mut board = beamfix::Pipeline::new(
        beamfix::lidar::ld06::Parser::new(),
        Odometry::<BEAMS>::new(OdometryConfig::DEFAULT),
    );
    let mut sink = Frames(0);
    let mut start = 0;
    for &(end, _) in &drive.frames {
        board.push(&drive.bytes[start..end], &mut sink);
        // As a board may ask whose ring is empty.
        assert_eq!(board.push_packet(&[], &mut sink), 0);
        start = end;
    }
    assert_eq!(sink.0, drive.frames.len());
}

/// Counts packets.
struct Frames(usize);

impl<P> beamfix::pipeline::Sink<P, Odometry<BEAMS>, BEAMS> for Frames {
    fn revolution(&mut self, _: beamfix::Revolution<'_, Odometry<BEAMS>, BEAMS>) {}

    fn packet(&mut self, _: &P) {
        self.0 += 1;
    }
}

#[test]
fn a_pipeline_that_is_set_up_in_its_place_is_as_new() {
    type Robot = beamfix::Pipeline<Late<Ldrobot>, Odometry<BEAMS>, BEAMS>;
    let drive = driven(4.0);
    let config = OdometryConfig::DEFAULT;
    let follow = |robot: &mut Robot| {
        let mut steps = Vec::new();
        for (k, bytes) in drive.bytes.chunks(1000).enumerate() {
            let now_us = 50_000 * k as u32;
            robot.set_time(now_us);
            let tracker = robot.tracker_mut();
            tracker.push_wheels(now_us, Pose::new(0.001 * k as f32, 0.0, 0.0));
            tracker.push_gyro(now_us, 0.01);
            robot.push(bytes, &mut |revolution: beamfix::Revolution<_, BEAMS>| {
                steps.push(format!("{:?}", revolution.step));
            });
        }
        steps.push(format!("{:?}", robot.lidar().counters()));
        steps.push(format!("{:?}", robot.tracker()));
        steps
    };
    let mut robot = Box::new(Robot::ZERO);
    let before = follow(&mut robot);
    assert_eq!(before.len(), 2, "without a parser there are no steps");
    let mut new = Box::new(Robot::new(
        Late::Given(Ldrobot::new()),
        Odometry::new(config),
    ));
    let wanted = follow(&mut new);
    assert!(wanted.len() > 30, "{}", wanted.len());
    // The second time after a drive, which leaves nothing behind.
    for _ in 0..2 {
        robot.set_up(Ldrobot::new(), config);
        let steps = follow(&mut robot);
        assert!(
            steps == wanted,
            "{:?}",
            steps.iter().zip(&wanted).find(|(a, b)| a != b)
        );
    }
}
