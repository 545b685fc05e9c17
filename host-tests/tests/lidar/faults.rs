//! Captures that were once decoded wrongly: `../shared/faults`.

use beamfix::lidar::{Model, Packet, Protocol};
use host_tests::decode::{self, WithParser, with_parser};
use host_tests::formats::capture;
use host_tests::shared;

/// A UTM-30LX read as an URG-04LX: walls at -135, 0 and +135 degrees, a quarter of a degree from value to value.
#[test]
fn a_utm_30lx_is_laid_out_by_its_own_steps() {
    let Some(path) = shared::file("faults/utm-30lx-md.txt") else {
        return;
    };
    let bytes = std::fs::read(path).expect("readable");
    for lidar in ["scip", "utm-30lx", "auto"] {
        let mut rows = Vec::new();
        let summary = decode::decode(lidar, &bytes, &mut |row| rows.push(row));
        assert!(summary.expect("known").packets > 0, "{lidar}");
        let (first, last) = (rows[0].angle_deg, rows[rows.len() - 1].angle_deg);
        assert!((first + 135.0).abs() < 0.01, "{lidar}: {first}");
        assert!((last - 135.0).abs() < 0.01, "{lidar}: {last}");
        for pair in rows.windows(2) {
            let step = pair[1].angle_deg - pair[0].angle_deg;
            assert!((step - 0.25).abs() < 0.001, "{lidar}: {step}");
            // 40 revolutions a second.
            let passed = pair[1].time_us - pair[0].time_us;
            assert!((17..=18).contains(&passed), "{lidar}: {passed} µs");
        }
    }
}

/// Time-of-flight YDLIDARs spin at 3 Hz more than their frames say.
#[test]
fn a_ydlidar_tg_at_10_hz_says_so() {
    struct Speeds<'a>(&'a [u8]);

    impl WithParser for Speeds<'_> {
        type Output = Vec<f32>;

        fn run<P: Protocol>(self, mut parser: P) -> Vec<f32> {
            let packets = self.0.iter().filter_map(|&byte| parser.push(byte));
            packets.filter_map(|packet| packet.speed_rpm()).collect()
        }
    }

    let Some(path) = shared::file("faults/ydlidar-tg-10hz.bin") else {
        return;
    };
    let bytes = std::fs::read(path).expect("readable");
    let speeds = with_parser(&Model::YDLIDAR_TG, Speeds(&bytes));
    assert!(!speeds.is_empty());
    assert!(speeds.iter().all(|rpm| *rpm == 600.0), "{speeds:?}");
}

/// The geometry is the unit's own where it has told it, and never a guess.
#[test]
fn scip_steps_are_asked_for_or_read_from_the_echo() {
    use beamfix::lidar::scip;

    let line = |text: &str| {
        format!(
            "{text}{}\n",
            char::from(scip::check_character(text.as_bytes()))
        )
    };
    let scan = |last: u16| {
        let values = "0Dh".repeat(usize::from(last) + 1);
        let mut text = format!("MD0000{last:04}01000\n{}{}", line("99"), line("0000"));
        for start in (0..values.len()).step_by(64) {
            text += &line(&values[start..values.len().min(start + 64)]);
        }
        text + "\n"
    };
    let angles = |text: String| {
        let mut parser = scip::Parser::for_model(&Model::HOKUYO_URG04LX);
        let packets: Vec<_> = text.bytes().filter_map(|byte| parser.push(byte)).collect();
        let first = packets.first().and_then(|packet| packet.samples().next());
        (
            first.map(|sample| (f64::from(sample.angle_deg) * 100.0).round() / 100.0),
            parser.counters().check_errors,
        )
    };
    // 384 of 1024 steps lie before the front; 540 of 1440.
    assert_eq!(angles(scan(725)), (Some(225.0), 0));
    assert_eq!(angles(scan(1080)), (Some(225.0), 0));
    // A unit's own words come first.
    let told: String = [
        "DMIN:20",
        "DMAX:4000",
        "ARES:512",
        "AMIN:0",
        "AMAX:511",
        "AFRT:256",
        "SCAN:600",
    ]
    .iter()
    .map(|field| {
        let code = char::from(scip::check_character(field.as_bytes()));
        format!("{field};{code}\n")
    })
    .collect();
    let told = format!("PP\n{}{told}\n", line("00"));
    assert_eq!(angles(told.clone() + &scan(511)).0, Some(180.0));
    // Nobody knows how a scan of 2000 steps lies, nor one beyond what the unit told.
    assert_eq!(angles(scan(2000)).0, None);
    assert_eq!(angles(told + &scan(725)).0, None);
}

/// A capture of three hours, a piece every ten minutes: the lidar's clock of 32 bits wraps after 71.6 minutes.
#[test]
fn times_go_on_after_71_minutes() {
    let mut recorder = capture::Recorder::new(Vec::new()).expect("memory");
    let ten_minutes_us = 600_000_000;
    let frame: Vec<u8> = (0..8)
        .flat_map(|_| [0x3e, 0x01, 0x2d, 0xa0, 0x0f])
        .collect();
    for k in 0..18 {
        recorder
            .push(k * ten_minutes_us, capture::Content::Bytes(&frame))
            .expect("memory");
    }
    let file = recorder.finish().expect("memory");
    let mut times = Vec::new();
    let decoded = decode::decode("rplidar-scan", &file, &mut |row| times.push(row.time_us));
    decoded.expect("known");
    assert_eq!(times.len(), 18 * 8);
    assert!(times.is_sorted(), "{times:?}");
    let last = 17 * ten_minutes_us;
    assert!(times[times.len() - 1].abs_diff(last) < 100_000, "{times:?}");
}
