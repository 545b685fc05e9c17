//! Frames: how long they can get, and what they say about a match.

use beamfix::{
    config::ConfigError,
    linalg::{Covariance, Sym3},
    matching::MatchError,
    odometry::{Refusal, Step},
};
use beamfix_app::{
    AppConfig, BEAMS, CONFIG, link,
    telemetry::{
        Found, HEALTH_FRAME, Health, POSE_FRAME, Pose, QUALITY_FRAME, Quality, Ready, Reset,
        Telemetry, Verdict, Weak,
    },
};
use beamfix_sim::encoder::{Echo, Encoder as _, ld06::Sensor};
use host_tests::board::commands::Commands;

/// No zero byte in it.
const WORST: f32 = f32::from_bits(0xbf9d_3f71);

fn quality(found: Result<Found, [f32; 2]>) -> Quality {
    Quality {
        sequence: u16::MAX,
        verdict: Verdict::TooFewCorrespondences,
        found,
    }
}

#[test]
fn no_frame_is_longer_than_it_may_be() {
    let pose = Pose {
        sequence: u16::MAX,
        time_us: u32::MAX,
        pose: [WORST; 3],
        covariance: [WORST; 6],
        verdict: Verdict::TooFewCorrespondences,
        inliers: u16::MAX,
        beams: u16::MAX,
        residual: WORST,
    };
    let health = Health {
        packets: u32::MAX,
        check_errors: u32::MAX,
        skipped_bytes: u32::MAX,
        beams_refused: u32::MAX,
        matches_refused: u32::MAX,
        commands: u32::MAX,
        command_errors: u32::MAX,
        bytes_lost: u32::MAX,
        motor_restarts: u8::MAX,
        ..Health::default()
    };
    let found = Found {
        score: WORST,
        inliers: u16::MAX,
        overlap: u16::MAX,
        beams: u16::MAX,
        residual: WORST,
        covariance: [WORST; 6],
        weak: Some(Weak {
            direction: [WORST; 3],
            sigma: WORST,
            lever: WORST,
        }),
        iterations: u8::MAX,
        starts: u8::MAX,
        rival: WORST,
    };
    for (message, most) in [
        (Telemetry::Pose(pose), POSE_FRAME),
        (Telemetry::Health(health), HEALTH_FRAME),
        (Telemetry::Quality(quality(Ok(found))), QUALITY_FRAME),
        (Telemetry::Quality(quality(Err([WORST; 2]))), QUALITY_FRAME),
    ] {
        let mut frame = heapless::Vec::<u8, 128>::new();
        assert!(link::append(&message, &mut frame));
        println!("{} bytes, at most {most}", frame.len());
        assert!(frame.len() <= most, "{message:?}: {} bytes", frame.len());
        let mut receiver = link::Receiver::new();
        let mut back = frame.iter().filter_map(|&byte| receiver.push(byte));
        assert_eq!(back.next(), Some(message));
    }
}

/// What a board sends that is asked for everything, while its lidar stands and sees so far (mm) at a time (µs) in each direction (rad).
fn sent(turns: u32, mm: impl Fn(f64, f64) -> Option<f64>) -> Vec<Telemetry> {
    let mut bytes = Vec::new();
    let mut sensor = Sensor::ld06();
    while sensor.next_time_us() < f64::from(turns) * 1e5 {
        let echo = |range_mm| Echo {
            range_mm,
            intensity: 200,
        };
        sensor.fire(&mut |time, bearing| mm(time, bearing).map(echo), &mut bytes);
    }
    let mut app = Box::new(beamfix_app::App::<BEAMS>::new(AppConfig {
        record: true,
        scans: true,
        quality: true,
        ..CONFIG
    }));
    let mut receiver = link::Receiver::new();
    let mut messages = Vec::new();
    let mut sent = app.ready(Reset::Other).to_vec();
    app.lidar_all(&bytes, |out| sent.extend_from_slice(out));
    messages.extend(sent.iter().filter_map(|&byte| receiver.push(byte)));
    assert_eq!(receiver.counters().errors, 0);
    messages
}

/// Each pose and the quality that must follow it.
fn pairs(messages: &[Telemetry]) -> Vec<(Pose, Quality)> {
    let poses = messages.iter().enumerate().filter_map(|(k, message)| {
        let Telemetry::Pose(pose) = message else {
            return None;
        };
        let Some(Telemetry::Quality(quality)) = messages.get(k + 1) else {
            panic!("pose {} has no quality", pose.sequence);
        };
        assert_eq!(
            (quality.sequence, quality.verdict),
            (pose.sequence, pose.verdict)
        );
        Some((*pose, *quality))
    });
    poses.collect()
}

#[test]
fn frames_in_the_handbook_are_what_the_crate_makes() {
    let page = include_str!("../../../docs/telemetry.md");
    let has = |frame: &[u8]| {
        let hex: Vec<String> = frame.iter().map(|byte| format!("{byte:02x}")).collect();
        let words: Vec<&str> = page.split_whitespace().collect();
        assert!(words.join(" ").contains(&hex.join(" ")), "{hex:?}");
    };
    let pose = Pose {
        sequence: 300,
        time_us: 2_987_673,
        pose: [1.5, -0.25, 0.5],
        covariance: [0.0625, 0.0, 0.0625, 0.0, 0.0, 0.03125],
        verdict: Verdict::Measured,
        inliers: 427,
        beams: 450,
        residual: 0.007_812_5,
    };
    let mut frame = heapless::Vec::<u8, 128>::new();
    assert!(link::append(&Telemetry::Pose(pose), &mut frame));
    has(&frame);
    let mut wheels = Commands::new();
    wheels.wheels(beamfix::geometry::Pose::new(1.5, -0.25, 0.5));
    has(wheels.bytes());
    assert!(page.contains(&format!("This page is version {}.", beamfix_app::VERSION)));
}

#[test]
fn a_board_that_is_asked_what_it_is_answers_without_starting() {
    let mut app = Box::new(beamfix_app::App::<BEAMS>::new(CONFIG));
    let mut receiver = link::Receiver::new();
    let mut ready = |sent: &[u8]| -> Vec<Ready> {
        let messages = sent.iter().filter_map(|&byte| receiver.push(byte));
        let ready = |message| match message {
            Telemetry::Ready(ready) => Some(ready),
            _ => None,
        };
        messages.filter_map(ready).collect()
    };
    let [started] = &ready(app.ready(Reset::Power))[..] else {
        panic!("no start");
    };
    let mut questions = Commands::new();
    for _ in 0..3 {
        questions.ask_ready();
    }
    let mut sent = Vec::new();
    app.command_all(questions.bytes(), |out| sent.extend_from_slice(out));
    let answer = Ready {
        reset: Reset::Asked,
        ..started.clone()
    };
    // No more than two between two revolutions.
    assert_eq!(ready(&sent), [answer.clone(), answer]);
    assert_eq!(app.health().commands, 3);
}

#[test]
fn everything_that_is_asked_for_is_sent_and_nothing_is_cut() {
    let messages = sent(20, |_, bearing| {
        Some(3000.0 / libm::cos(bearing).abs().max(libm::sin(bearing).abs()))
    });
    let pairs = pairs(&messages);
    assert!(pairs.len() >= 17, "{} poses", pairs.len());
    for (k, (pose, quality)) in pairs.iter().enumerate() {
        assert_eq!(usize::from(pose.sequence), k);
        let Ok(found) = quality.found else {
            assert_eq!((k, quality.verdict), (0, Verdict::First));
            continue;
        };
        assert_eq!(
            (found.inliers, found.beams, found.residual),
            (pose.inliers, pose.beams, pose.residual)
        );
        assert!(found.score > 0.9 && found.overlap > 400, "{found:?}");
        assert_eq!(found.weak, None, "a room is determined in all directions");
    }
    let count = |of: fn(&Telemetry) -> bool| messages.iter().filter(|message| of(message)).count();
    let packets = 20 * 450 / 12;
    let scans = count(|message| matches!(message, Telemetry::Scan(_)));
    assert!((packets - 1..=packets).contains(&scans), "{scans} packets");
    let raw: usize = messages
        .iter()
        .map(|message| match message {
            Telemetry::Raw(raw) => raw.bytes.len(),
            _ => 0,
        })
        .sum();
    assert!(raw + 47 >= 47 * packets, "{raw} bytes");
}

#[test]
fn a_corridor_says_along_what_it_is_weak() {
    // Along x, 2 m wide; the lidar sees 12 m.
    let messages = sent(20, |_, bearing| {
        let mm = 1000.0 / libm::sin(bearing).abs();
        (mm < 12_000.0).then_some(mm)
    });
    let mut weak = 0;
    for (pose, quality) in pairs(&messages).iter().skip(1) {
        let Ok(found) = quality.found else {
            continue;
        };
        let Weak {
            direction, lever, ..
        } = found.weak.expect("a corridor has one");
        assert!(direction[0].abs() > 0.98, "{direction:?}");
        // The mean range between two walls 1 m away, seen as far as 12 m: 1/sin of the bearing, averaged.
        assert!((1.5..3.0).contains(&lever), "{lever} m");
        let [xx, _, yy, ..] = found.covariance;
        assert!(xx > 100.0 * yy, "{pose:?}");
        weak += 1;
    }
    assert!(weak >= 15, "{weak} matches");
}

#[test]
fn a_refusal_says_its_numbers() {
    // After half a second something covers all of the lidar but a crack.
    let messages = sent(20, |time, bearing| {
        (time < 5e5 || bearing.abs() < 0.05).then_some(2000.0 / libm::cos(bearing).abs().max(0.5))
    });
    let pairs = pairs(&messages);
    let refused: Vec<_> = pairs
        .iter()
        .filter(|(pose, _)| pose.verdict == Verdict::TooFewBeams)
        .collect();
    assert!(refused.len() >= 12, "{pairs:?}");
    for (_, quality) in refused {
        let Err([found, needed]) = quality.found else {
            panic!("{quality:?}");
        };
        assert!(found < needed && found > 0.0, "{found} of {needed}");
    }
}

#[test]
fn every_refusal_has_its_own_name() {
    let config = ConfigError::OutOfRange {
        setting: "min_score",
        value: 2.0,
        min: 0.0,
        max: 1.0,
    };
    let (found, needed) = (3, 30);
    let errors = [
        MatchError::TooFewBeams { found, needed },
        MatchError::TooFewLines { found, needed },
        MatchError::TooFewCorrespondences { found, needed },
        MatchError::BadGuess,
        MatchError::BadConfig(config),
        MatchError::NothingFound { min_score: 0.3 },
        MatchError::Degenerate,
        MatchError::Unlikely { score: 0.1 },
        MatchError::NotConverged { step: 0.1 },
        MatchError::Ambiguous { ratio: 0.9 },
    ];
    let refusals = errors.map(Refusal::NoMatch).into_iter().chain([
        Refusal::First,
        Refusal::TooFar {
            distance: 1.0,
            rotation: 0.1,
        },
    ]);
    for refusal in refusals {
        let step = Step {
            pose: beamfix::geometry::Pose::IDENTITY,
            covariance: Covariance(Sym3::diagonal(1.0, 1.0, 1.0)),
            outcome: Err(refusal),
            keyframe: false,
        };
        let name = format!("{:?}", Verdict::of(&step));
        let told = format!("{refusal:?}").replace("NoMatch(", "");
        assert!(told.starts_with(&name), "{refusal:?} is told as {name}");
    }
}
