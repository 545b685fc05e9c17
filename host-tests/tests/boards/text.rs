//! Telemetry as lines for a terminal.

use beamfix_app::{
    telemetry::{Health, Pose, Telemetry, Truth, Verdict},
    text::append,
};

fn line(message: &Telemetry) -> String {
    let mut out = heapless::Vec::<u8, 192>::new();
    append(message, &mut out);
    String::from_utf8(out.to_vec()).expect("ASCII")
}

#[test]
fn lines_say_what_the_message_does() {
    let pose = Pose {
        sequence: 3,
        time_us: 5,
        pose: [1.2345, -0.0567, -0.5],
        covariance: [16e-6, 0.0, 25e-6, 0.0, 0.0, 1e-6],
        verdict: Verdict::Measured,
        inliers: 201,
        beams: 450,
        residual: 0.01,
    };
    assert_eq!(
        line(&Telemetry::Pose(pose)),
        "x 1.235 m, y -0.057 m, heading -28.65 deg  +- 4.0 5.0 mm 0.06 deg  measured 201/450\r\n"
    );
    let truth = Truth {
        sequence: 3,
        pose: [f32::NAN, 1e30, -0.0004],
    };
    assert_eq!(
        line(&Telemetry::Truth(truth)),
        "  really x 0.000 m, y 2147483.647 m, heading -0.02 deg\r\n"
    );
}

#[test]
fn the_longest_lines_fit() {
    let worst = Pose {
        sequence: u16::MAX,
        time_us: u32::MAX,
        pose: [-9999.999, -9999.999, -3.1],
        covariance: [1e3, 0.0, 1e3, 0.0, 0.0, 9.0],
        verdict: Verdict::TooFewCorrespondences,
        inliers: 999,
        beams: 999,
        residual: 0.01,
    };
    assert!(line(&Telemetry::Pose(worst)).ends_with("999/999\r\n"));
    let health = Health {
        packets: u32::MAX,
        check_errors: u32::MAX,
        bytes_lost: u32::MAX,
        beams_refused: u32::MAX,
        matches_refused: u32::MAX,
        ..Health::default()
    };
    assert!(line(&Telemetry::Health(health)).ends_with("matches 4294967295\r\n"));
    let mut small = heapless::Vec::<u8, 40>::new();
    append(&Telemetry::Health(health), &mut small);
    assert!(small.is_empty());
}
