//! What is encoded is what is decoded, for every model; and what damage does to it.

use std::collections::HashSet;
use std::f64::consts::TAU;

use beamfix::lidar::model::{Camsense, Correction, Parallax};
use beamfix::lidar::{Family, Model, Packet, Protocol};
use beamfix::scan::{Assembler, Beam};
use beamfix_sim::encoder::{self, Echo, damage};
use host_tests::decode::{self, WithParser, with_parser};
use host_tests::formats::capture;
use proptest::prelude::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A beam as it was measured.
#[derive(Debug, Clone, Copy)]
struct Fired {
    time_us: f64,
    bearing: f64,
    echo: Option<Echo>,
}

/// Whether the angle depends on the distance.
///
/// The simulated sensor looks where the distance of the beam before would have it; near or behind a gap that is off by
/// more than the format.
fn triangulates(model: &Model) -> bool {
    match model.family {
        Family::Ldrobot(parallax) => parallax != Parallax::None,
        Family::Ydlidar(samples) => samples.correction != Correction::None,
        Family::Camsense(sensor) => matches!(sensor, Camsense::X1 | Camsense::X2),
        family => family == Family::RplidarUltra,
    }
}

/// What a sensor measures in a smooth room with gaps, and what it sends.
fn fire(model: &Model, beams: usize, seed: u64) -> (Vec<Fired>, Vec<u8>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let phase = rng.random_range(0.0..TAU);
    let nearest =
        f64::from(model.min_range_mm).max(if triangulates(model) { 1200.0 } else { 400.0 });
    let farthest = f64::from(model.max_range_mm).min(7000.0);
    let mut sensor = encoder::for_model(model);
    let (mut fired, mut line) = (Vec::new(), Vec::new());
    for _ in 0..beams {
        let mut look = |time_us: f64, bearing: f64| {
            let wave = 0.5 + 0.3 * (2.0 * bearing + phase).sin() + 0.1 * (5.0 * bearing).cos();
            let range_mm = nearest + (farthest - nearest) * wave;
            let intensity = rng.random_range(8..=255);
            let echo = (rng.random_range(0..10) > 0).then_some(Echo {
                range_mm,
                intensity,
            });
            fired.push(Fired {
                time_us,
                bearing,
                echo,
            });
            echo
        };
        sensor.fire(&mut look, &mut line);
    }
    (fired, line)
}

/// Beams of a stream, with the numbers of those that start a turn.
struct Beams<'a>(&'a [u8]);

impl WithParser for Beams<'_> {
    type Output = (Vec<Beam>, Vec<usize>, u32, Option<f32>);

    fn run<P: Protocol>(self, mut parser: P) -> Self::Output {
        let (mut beams, mut starts, mut speed) = (Vec::new(), Vec::new(), None);
        for &byte in self.0 {
            if let Some(packet) = parser.push(byte) {
                starts.extend(packet.revolution_start().map(|k| beams.len() + k));
                beams.extend(packet.beams());
                speed = packet.speed_rpm().or(speed);
            }
        }
        let counters = parser.counters();
        (
            beams,
            starts,
            counters.skipped_bytes + counters.check_errors,
            speed,
        )
    }
}

/// Largest error of a range (mm) that the format itself makes.
fn resolution(family: Family, mm: f64) -> f64 {
    match family {
        // Differences to distances that have lost up to 4 bits.
        Family::RplidarUltra => 1.0 + mm / 500.0,
        Family::RplidarUltraDense => 4.0,
        Family::RplidarExpress => 2.0,
        Family::Ydlidar(_) => 1.5,
        Family::Ldrobot(_) | Family::Camsense(_) => 1.1,
        // Rounded to quarters, then to whole millimetres.
        _ => 0.64,
    }
}

fn check_model(model: &Model, seed: u64) {
    let (fired, line) = fire(model, 2500, seed);
    let (beams, starts, bad, speed) = with_parser(model, Beams(&line));
    let name = model.name;
    assert_eq!(bad, 0, "{name}");
    assert!(
        beams.len() >= 2500 - 3 * 360,
        "{name}: {} beams",
        beams.len()
    );
    let seconds = fired[fired.len() - 1].time_us * 1e-6;
    let bits_per_s = 10.0 * line.len() as f64 / seconds;
    assert!(
        bits_per_s <= f64::from(model.baud),
        "{name}: {bits_per_s} bits/s"
    );
    if let Some(rpm) = speed {
        let sent = 6.0 * f32::from(model.revolutions_per_10s);
        assert!((rpm - sent).abs() < 1.6, "{name}: {rpm} rpm, not {sent}");
    }
    let (mut lost, mut is_first) = (0, true);
    let offset = f64::from(beams[0].time_us) - fired[0].time_us;
    for (k, (beam, fired)) in beams.iter().zip(&fired).enumerate() {
        let late = f64::from(beam.time_us) - fired.time_us - offset;
        // Half a millisecond each way is what a stamp can be off before pace and phase are learnt.
        assert!(late.abs() < 1100.0, "{name} {k}: {late} µs late");
        let Some(echo) = fired.echo else {
            assert!(!beam.range.is_some(), "{name} {k}: {beam:?}");
            continue;
        };
        let Ok(mm) = beam.range.mm() else {
            lost += 1;
            continue;
        };
        let off = (f64::from(mm) - echo.range_mm).abs();
        assert!(
            off <= resolution(model.family, echo.range_mm),
            "{name} {k}: {mm} {echo:?}"
        );
        let bearing = f64::from(beam.bearing.0) / 65_536.0 * TAU;
        let off = (bearing - fired.bearing + 1.5 * TAU).rem_euclid(TAU) - 0.5 * TAU;
        let is_guess = std::mem::take(&mut is_first) && triangulates(model);
        let allowed = if triangulates(model) { 0.2 } else { 0.06 };
        let off = off.to_degrees().abs();
        assert!(is_guess || off < allowed, "{name} {k}: {off}°");
        let has_quality = !matches!(
            model.family,
            Family::RplidarExpress
                | Family::RplidarDense
                | Family::RplidarUltra
                | Family::Scip(_)
                | Family::Sick
        ) && !matches!(model.family, Family::Ydlidar(samples) if samples.bytes == 2);
        if has_quality {
            let expected = match model.family {
                Family::RplidarScan => echo.intensity >> 2,
                _ => echo.intensity,
            };
            let coarse = if model.family == Family::RplidarUltraDense {
                7
            } else {
                0
            };
            assert!(
                beam.quality.abs_diff(expected) <= coarse,
                "{name} {k}: {beam:?} {echo:?}"
            );
        }
    }
    // Ultra capsules cannot say a difference that is too large for ten bits.
    let may_lose = if model.family == Family::RplidarUltra {
        beams.len() / 20
    } else {
        0
    };
    assert!(lost <= may_lose, "{name}: {lost} lost");
    // A turn starts where the sensor's own angle falls.
    if !matches!(model.family, Family::Scip(_) | Family::Sick) {
        let turns = beams.len() as f64 * f64::from(model.revolutions_per_10s)
            / 10.0
            / f64::from(model.points_per_s);
        assert!(
            (starts.len() as f64 - turns).abs() <= 1.5,
            "{name}: {} of {turns}",
            starts.len()
        );
    }
}

#[test]
fn every_model_comes_back() {
    for model in Model::ALL {
        check_model(model, 1);
    }
}

#[test]
fn turns_fit_the_scan_that_the_model_asks_for() {
    for model in Model::ALL {
        let per_turn = usize::from(model.beams_per_revolution);
        let (_, line) = fire(model, 3 * per_turn + 400, 2);
        let (beams, starts, ..) = with_parser(model, Beams(&line));
        let mut assembler = Box::new(Assembler::<3500>::new());
        let mut longest = 0;
        for (k, beam) in beams.iter().enumerate() {
            if assembler.push(*beam, starts.contains(&k)) {
                longest = longest.max(assembler.scan().len());
            }
        }
        assert!(
            longest > 0 && longest <= per_turn,
            "{}: {longest} beams",
            model.name
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn any_room_comes_back(seed in any::<u64>(), k in 0..Model::ALL.len()) {
        check_model(&Model::ALL[k], seed);
    }

    #[test]
    fn any_bytes_are_survived(
        k in 0..Model::ALL.len(),
        bytes in prop::collection::vec(
            prop_oneof![
                prop::sample::select(&[0x54u8, 0x2c, 0xaa, 0x55, 0xa5, 0x5a, 0xfa, 0xa0, 0x02, 0x80, 0x61, 0xad, 0x0a, b'M', b'D'][..]),
                any::<u8>(),
            ], 0..3000),
    ) {
        with_parser(&Model::ALL[k], Beams(&bytes));
    }
}

/// Bearings and ranges of each packet of a stream.
struct Packets<'a>(&'a [u8]);

impl WithParser for Packets<'_> {
    type Output = Vec<Vec<(u16, u16)>>;

    fn run<P: Protocol>(self, mut parser: P) -> Self::Output {
        let packets = self.0.iter().filter_map(|&byte| parser.push(byte));
        let pair = |beam: Beam| (beam.bearing.0, beam.range.mm().unwrap_or(0));
        packets
            .map(|packet| packet.beams().map(pair).collect())
            .collect()
    }
}

#[test]
fn express_capsules_keep_what_240_faults_leave() {
    const RUNS: u64 = 64;
    let model = &Model::RPLIDAR_EXPRESS;
    let (_, clean) = fire(model, 1500 * 32, 3);
    let sent: HashSet<_> = with_parser(model, Packets(&clean)).into_iter().collect();
    let (mut points, mut wrong) = (0, 0);
    for seed in 0..RUNS {
        let mut line = clean.clone();
        damage::hit(&mut line, 240, &mut ChaCha8Rng::seed_from_u64(seed));
        for packet in with_parser(model, Packets(&line)) {
            points += packet.len();
            wrong += usize::from(!sent.contains(&packet));
        }
    }
    let points = points / RUNS as usize;
    println!(
        "of 1500 express capsules with 240 faults: {points} points; {wrong} capsules wrong in {RUNS} runs"
    );
    assert!(points >= 34_784, "{points}");
    // All of them have their length and their first four bytes; the XOR does not see two flips of one bit, nor order.
    assert!(wrong <= 12, "{wrong}");
}

/// Recorded with the times at which they came in, and replayed: beams of sensors without a clock have their times.
#[test]
fn replayed_bytes_have_their_times() {
    for model in [
        Model::RPLIDAR_SCAN,
        Model::RPLIDAR_EXPRESS,
        Model::YDLIDAR_X4,
        Model::NEATO_XV11,
        Model::CAMSENSE_X1,
        Model::DELTA_2A,
    ] {
        let start_us = 5_000_000.0;
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let mut sensor = encoder::for_model(&model);
        let mut recorder = capture::Recorder::new(Vec::new()).expect("memory");
        let mut truth = Vec::new();
        while truth.len() < 8000 {
            let mut line = Vec::new();
            let mut look = |time_us: f64, _| {
                truth.push(time_us + start_us);
                Some(Echo {
                    range_mm: 1000.0,
                    intensity: 90,
                })
            };
            sensor.fire(&mut look, &mut line);
            // Sent when complete, as long on the line as it takes, picked up late now and then. Half a second is lost.
            let sent_us =
                sensor.next_time_us() + start_us + line.len() as f64 * 1e7 / f64::from(model.baud);
            let late_us = if rng.random_range(0..4) == 0 {
                3000.0
            } else {
                50.0
            };
            if !line.is_empty() && !(3000..4000).contains(&truth.len()) {
                recorder
                    .push((sent_us + late_us) as u64, capture::Content::Bytes(&line))
                    .expect("memory");
            }
        }
        let file = recorder.finish().expect("memory");
        let mut times = Vec::new();
        let decoded = decode::decode(model.name, &file, &mut |row| times.push(row.time_us));
        assert!(decoded.expect("known").points > 6000, "{}", model.name);
        // The gap is seen, and behind it the times are right again to what a late pick-up can spoil.
        let (first, last) = (times[0] as f64, times[times.len() - 1] as f64);
        let expected_last = truth[truth.len() - 1];
        // The first may itself be picked up late, with a descriptor of 0.6 ms before it.
        assert!((first - truth[0]).abs() < 4000.0, "{}: {first}", model.name);
        let per_frame = 1e6 / f64::from(model.points_per_s) * 100.0;
        assert!(
            last <= expected_last + 2000.0,
            "{}: {last} {expected_last}",
            model.name
        );
        assert!(
            expected_last - last < per_frame + 5000.0,
            "{}: {last} {expected_last}",
            model.name
        );
    }
}

/// Every beam's time, where each frame is picked up as soon as it has come in.
#[test]
fn beams_have_the_times_at_which_they_were_measured() {
    for model in Model::ALL {
        let start_us = 5_000_000.0;
        let mut sensor = encoder::for_model(model);
        let mut recorder = capture::Recorder::new(Vec::new()).expect("memory");
        let mut truth = Vec::new();
        while sensor.next_time_us() < 4e6 {
            let mut line = Vec::new();
            let mut look = |time_us: f64, _| {
                truth.push(time_us);
                Some(Echo {
                    range_mm: 1000.0,
                    intensity: 90,
                })
            };
            sensor.fire(&mut look, &mut line);
            if !line.is_empty() {
                let on_line_us = line.len() as f64 * 1e7 / f64::from(model.baud);
                let time_us = (sensor.next_time_us() + start_us + on_line_us) as u64;
                recorder
                    .push(time_us, capture::Content::Bytes(&line))
                    .expect("memory");
            }
        }
        let file = recorder.finish().expect("memory");
        let mut times = Vec::new();
        let decoded = decode::decode(model.name, &file, &mut |row| times.push(row.time_us));
        decoded.expect("known");
        let own_clock = matches!(model.family, Family::Ldrobot(_) | Family::Scip(_));
        let zero = if own_clock { 0.0 } else { start_us };
        // The first second teaches clocks of whole milliseconds their pace.
        let late: Vec<f64> = times
            .iter()
            .zip(&truth)
            .skip(times.len() / 4)
            .map(|(&time_us, truth)| time_us as f64 - truth - zero)
            .collect();
        let mean = late.iter().sum::<f64>() / late.len() as f64;
        let spread = late
            .iter()
            .map(|late| (late - mean).abs())
            .fold(0.0, f64::max);
        println!(
            "{:<18} {mean:>8.0} µs late, at most {spread:>6.0} µs off that",
            model.name
        );
        // A stamp is a millisecond wide; LD14P frames last exactly three, so that nothing tells where in one they lie.
        assert!(mean.abs() < 500.0, "{}: {mean}", model.name);
        assert!(spread < 250.0, "{}: {spread}", model.name);
    }
}
