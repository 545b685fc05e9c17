//! `beamfix_link.py` reads what the firmware sends, and writes what it understands.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command as Program,
};

use beamfix_app::{
    command::Command,
    link,
    telemetry::{
        Cost, Found, Gyro, Health, LidarState, MotorState, Mounted, Piece, Pose, Quality, Raw,
        Ready, Reset, Task, Telemetry, Truth, Verdict, Weak, Wheels, Zero,
    },
};
use serde_json::Value;

/// The file, and Python; `None`, after a line that says so, where there is none.
fn python() -> Option<(Program, PathBuf)> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../boards/telemetry/beamfix_link.py");
    let works = Program::new("python3").arg("--version").output();
    if !works.is_ok_and(|output| output.status.success()) {
        println!("left out: python3 is not installed");
        return None;
    }
    let mut python = Program::new("python3");
    python.arg("-B");
    Some((python, file))
}

/// Every kind of message, with small and large numbers, zeros and long lists.
fn messages() -> Vec<Telemetry> {
    const THIRD: f32 = 1.0 / 3.0;
    let verdicts = [
        Verdict::Measured,
        Verdict::Keyframe,
        Verdict::First,
        Verdict::TooFewBeams,
        Verdict::TooFewLines,
        Verdict::TooFewCorrespondences,
        Verdict::Degenerate,
        Verdict::NotConverged,
        Verdict::Ambiguous,
        Verdict::TooFar,
        Verdict::Refused,
        Verdict::NothingFound,
        Verdict::Unlikely,
        Verdict::BadGuess,
        Verdict::BadConfig,
        Verdict::Doubtful,
        Verdict::Searching,
        Verdict::Choosing,
    ];
    let mut all = vec![];
    for (reset, upside_down, task) in [
        (Reset::Power, false, Task::Odometry),
        (Reset::Watchdog, true, Task::Localization),
        (Reset::Other, false, Task::Odometry),
        (Reset::Asked, false, Task::Odometry),
    ] {
        let mount = Mounted {
            pose: [0.1, -THIRD, 3.0],
            upside_down,
        };
        all.push(Telemetry::Ready(Ready {
            version: beamfix_app::VERSION,
            beams: 456,
            reset,
            mount,
            lidar: "rplidar-ultradense".try_into().expect("room"),
            task,
        }));
    }
    for (k, verdict) in verdicts.into_iter().enumerate() {
        all.push(Telemetry::Pose(Pose {
            sequence: [0, 127, 128, 16_383, 16_384, u16::MAX][k % 6],
            time_us: [0, 255, 1 << 21, u32::MAX][k % 4],
            pose: [0.0, -THIRD, f32::MIN_POSITIVE],
            covariance: [1e-9, -0.0, 1e9, THIRD, f32::MAX, 0.5],
            verdict,
            inliers: 300,
            beams: 450,
            residual: THIRD,
        }));
    }
    let motors = [
        MotorState::Free,
        MotorState::SpinningUp,
        MotorState::Steady,
        MotorState::Off,
    ];
    let states = [
        LidarState::Unknown,
        LidarState::Silent,
        LidarState::Noise,
        LidarState::Standing,
        LidarState::Turning,
        LidarState::Blind,
        LidarState::Starting,
        LidarState::Defective,
    ];
    for (k, lidar) in states.into_iter().enumerate() {
        all.push(Telemetry::Health(Health {
            packets: u32::MAX,
            bytes_lost: 128,
            lidar,
            motor: motors[k % 4],
            motor_restarts: 255,
            ..Health::default()
        }));
    }
    all.push(Telemetry::Cost(Cost {
        instructions: 531_843,
        stack_bytes: 2960,
    }));
    for bytes in [&[][..], &[0; 47], &[0x54, 0x2c, 0, 255]] {
        let bytes = heapless::Vec::from_slice(bytes).expect("room");
        all.push(Telemetry::Raw(Raw { time_us: 7, bytes }));
    }
    for turn_start in [None, Some(0), Some(11)] {
        let ranges_mm = heapless::Vec::from_slice(&[0, 1, 127, 128, 12_000, 65_535]).expect("room");
        all.push(Telemetry::Scan(Piece {
            turn_start,
            first: 65_535,
            last: 0,
            ranges_mm,
        }));
    }
    all.push(Telemetry::Truth(Truth {
        sequence: 9,
        pose: [1.0, 2.0, 3.0],
    }));
    let found = |weak| Found {
        score: THIRD,
        inliers: 1,
        overlap: 2,
        beams: 3,
        residual: 0.0,
        covariance: [THIRD; 6],
        weak,
        iterations: 9,
        starts: 1,
        rival: 0.25,
    };
    let weak = Weak {
        direction: [0.6, 0.8, 0.0],
        sigma: 2.0,
        lever: 1.5,
    };
    for found in [Ok(found(None)), Ok(found(Some(weak))), Err([3.0, 30.0])] {
        all.push(Telemetry::Quality(Quality {
            sequence: 1,
            verdict: Verdict::Measured,
            found,
        }));
    }
    all.push(Telemetry::Wheels(Wheels {
        time_us: 1,
        pose: [THIRD; 3],
    }));
    all.push(Telemetry::Gyro(Gyro {
        time_us: 1,
        rate: -THIRD,
    }));
    all.push(Telemetry::Zero(Zero {
        time_us: u32::MAX,
        zero_cdeg: 35_999,
    }));
    all
}

/// With every broken number as the bits of the `f32` that it was: JSON's reader here rounds the last digit of an `f64` at times.
fn in_f32(value: Value) -> Value {
    match value {
        Value::Number(number) if number.is_f64() => {
            let number = number.as_f64().unwrap_or(f64::NAN) as f32;
            format!("{:08x}", number.to_bits()).into()
        }
        Value::Array(list) => list.into_iter().map(in_f32).collect(),
        Value::Object(fields) => (fields.into_iter())
            .map(|(name, value)| (name, in_f32(value)))
            .collect::<serde_json::Map<_, _>>()
            .into(),
        other => other,
    }
}

#[test]
fn python_reads_every_message() {
    let Some((mut python, file)) = python() else {
        return;
    };
    let messages = messages();
    let mut bytes = Vec::new();
    for (k, message) in messages.iter().enumerate() {
        let mut frame = heapless::Vec::<u8, { link::FRAME }>::new();
        assert!(link::append(message, &mut frame));
        bytes.extend_from_slice(&frame);
        // Damage between the frames is counted and costs none of them.
        if k % 7 == 3 {
            frame[2] ^= 0x10;
            bytes.extend_from_slice(&frame);
        }
    }
    let damaged = (0..messages.len()).filter(|k| k % 7 == 3).count();
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("every-message.bin");
    fs::write(&path, &bytes).expect("the frames");
    let output = python
        .arg(file)
        .arg("--json")
        .arg(&path)
        .output()
        .expect("python starts");
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{complaint}");
    assert!(
        complaint.contains(&format!(
            "{} frames, {damaged} damaged, 0 of a later",
            messages.len()
        )),
        "{complaint}"
    );
    let text = String::from_utf8(output.stdout).expect("text");
    let mut lines = text.lines();
    for message in &messages {
        let wanted = serde_json::to_value(message).expect("JSON");
        let got: Value = serde_json::from_str(lines.next().unwrap_or("null")).expect("JSON");
        assert_eq!(in_f32(got), in_f32(wanted));
    }
    assert_eq!(lines.next(), None);
}

#[test]
fn the_firmware_understands_pythons_commands() {
    let Some((mut python, file)) = python() else {
        return;
    };
    let script = "import sys; sys.path.insert(0, sys.argv[1]); import beamfix_link as b; \
        sys.stdout.buffer.write(b.wheels(1.5, -0.25, 3.0) + b.lidar(bytes(range(94))) + b.ask_health() \
        + b.send(raw=True, quality=True) + b.gyro(-0.5) + b.start_at(1.0, 2.0, -0.5) + b.ask_ready() + b.choose('ydlidar-g2'))";
    let folder = file.parent().expect("a folder");
    let output = python
        .args(["-c", script])
        .arg(folder)
        .output()
        .expect("python starts");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let bytes: Vec<u8> = (0..94).collect();
    let mut receiver = link::Receiver::new();
    let mut got = 0;
    for byte in output.stdout {
        let Some(command) = receiver.push::<Command>(byte) else {
            continue;
        };
        let wanted = match got {
            0 => Command::Wheels {
                x: 1.5,
                y: -0.25,
                theta: 3.0,
            },
            1 => Command::Lidar(&bytes),
            2 => Command::Health,
            3 => Command::Send {
                raw: true,
                scans: false,
                quality: true,
            },
            4 => Command::Gyro { rate: -0.5 },
            5 => Command::StartAt {
                x: 1.0,
                y: 2.0,
                theta: -0.5,
            },
            6 => Command::Ready,
            _ => Command::Choose {
                lidar: "ydlidar-g2",
            },
        };
        assert_eq!(command, wanted);
        got += 1;
    }
    assert_eq!((got, receiver.counters().errors), (8, 0));
}
