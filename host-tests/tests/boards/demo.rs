//! The bare-board demo: a board alone, without a lidar, runs the whole way and tells its own error.

use std::{
    process::Stdio,
    time::{Duration, Instant},
};

use beamfix_app::{App, BEAMS, SMALL_BEAMS};
use beamfix_selftest::demo::Demo;
use host_tests::board::{
    BOARDS, DEMO, emulator,
    rp2040js::{Job, PICO, PICO_EMBASSY},
    stream::Stream,
};

/// The numbers that follow `word` and stand before `unit` in each line that has it.
fn numbers(text: &str, word: &str, unit: &str) -> Vec<f64> {
    text.lines()
        .filter_map(|line| line.trim().strip_prefix(word))
        .filter_map(|rest| {
            let number = rest.split(unit).next()?;
            number.split_whitespace().last()?.parse().ok()
        })
        .collect()
}

/// What the same program prints here.
fn on_host<const N: usize>() -> String {
    let mut app = Box::new(App::<N>::new(beamfix_app::AppConfig {
        output: beamfix_app::Output::Text,
        ..beamfix_app::CONFIG
    }));
    let mut demo = Demo::new();
    let mut text = app.ready(beamfix_app::telemetry::Reset::Other).to_vec();
    while app.seen().turns < 400 {
        let packet = demo.packet();
        let mut rest = packet.as_slice();
        while !rest.is_empty() {
            let (taken, sent) = app.lidar(rest);
            rest = &rest[taken..];
            if !sent.is_empty() {
                text.extend_from_slice(sent);
                text.extend_from_slice(app.truth(|time_us| Some(demo.truth(time_us))));
            }
        }
    }
    String::from_utf8(text).expect("ASCII")
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn every_board_alone_follows_the_simulated_robot() {
    for board in BOARDS {
        let mut command = emulator::demo(board).unwrap_or_else(|error| panic!("{error:#}"));
        let output = command
            .stdin(Stdio::null())
            .output()
            .expect("the emulator starts");
        assert!(output.status.success(), "{}", board.name);
        let text = String::from_utf8(output.stdout).expect("ASCII");
        let here = match board.beams {
            SMALL_BEAMS => on_host::<SMALL_BEAMS>(),
            _ => on_host::<BEAMS>(),
        };
        assert!(text == here, "{}: not what the host prints", board.name);
        let (mm, degrees) = (
            numbers(&text, "error", " mm"),
            numbers(&text, "error", " deg"),
        );
        assert_eq!((mm.len(), degrees.len()), (400, 400));
        let worst = |errors: &[f64]| errors.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        println!(
            "{}: two rounds of 7.9 m; error at most {} mm, {}°",
            board.name,
            worst(&mm),
            worst(&degrees)
        );
        assert!(worst(&mm) < 50.0 && worst(&degrees) < 1.5, "{}", board.name);
    }
}

/// So many lines tell an error, all of them small.
fn follows(text: &str, least: usize) {
    assert!(text.starts_with("beamfix listens"), "{text}");
    let errors = numbers(text, "error", " mm");
    println!("{} poses, last error {:?} mm", errors.len(), errors.last());
    assert!(errors.len() >= least, "{text}");
    assert!(errors.iter().all(|mm| *mm < 50.0), "{errors:?}");
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn both_firmwares_of_the_pico_run_the_demo() {
    for firmware in [PICO, PICO_EMBASSY] {
        let text = Job::alone(firmware.with("demo"), 4.0).run_text();
        let Some(text) = text.unwrap_or_else(|error| panic!("{error:#}")) else {
            return;
        };
        println!("{}:", firmware.package);
        // At the lidar's own speed: ten a second.
        follows(&text, 37);
    }
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn the_firmware_itself_runs_the_demo_over_its_uart() {
    let mut stream = Stream::start(&DEMO).unwrap_or_else(|error| panic!("{error:#}"));
    let (mut text, mut bytes) = (Vec::new(), [0; 4096]);
    // At the lidar's own speed: six seconds' poses, in no more than a minute.
    let end = Instant::now() + Duration::from_secs(60);
    while Instant::now() < end {
        let n = stream.read_for(&mut bytes, Duration::from_millis(100));
        text.extend_from_slice(&bytes[..n.unwrap_or_else(|error| panic!("{error:#}"))]);
        if numbers(&String::from_utf8_lossy(&text), "error", " mm").len() >= 60 {
            break;
        }
    }
    let text = String::from_utf8(text).expect("ASCII");
    follows(&text, 60);
}
