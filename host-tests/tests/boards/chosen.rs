//! Lidars on the firmware of a real board in QEMU: chosen by a command, asked to start over the board's line to them, poses, the cable
//! out and back, poses again.
//!
//! Time is this computer's, so nothing here is measured.

use std::{
    io::{ErrorKind, Read as _, Write as _},
    path::{Path, PathBuf},
    sync::OnceLock,
    time::{Duration, Instant},
};

use beamfix::lidar::Model;
use beamfix_app::{
    command::Command,
    link::Receiver,
    telemetry::{LidarState, Telemetry, Verdict},
};
use host_tests::board::{STM32F4_ANY, commands::Commands, stream::Stream};

use crate::every_lidar::{ROUND_US, Unit};

/// Poses that a match found, before and after the cable was out.
const POSES: u32 = 12;
/// How long the cable is out.
const OUT: Duration = Duration::from_secs(3);
/// The longest that all of it may take.
const PATIENCE: Duration = Duration::from_secs(60);

/// The firmware, built once: a file that an emulator starts from is not written anew.
fn program() -> &'static Path {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    BUILT.get_or_init(|| (STM32F4_ANY.build("")).unwrap_or_else(|error| panic!("{error:#}")))
}

/// Chooses a lidar and goes through all of it.
fn expect_well(name: &str) {
    let model = Model::named(name).expect("a model of the table");
    let mut stream =
        Stream::start_program(&STM32F4_ANY, program()).unwrap_or_else(|error| panic!("{error:#}"));
    let mut line = stream.lidar().expect("the lidar's line");
    line.set_nonblocking(true).expect("a socket");
    let begin = Instant::now();
    let mut unit = Unit::new(model);
    let (mut receiver, mut bytes) = (Receiver::new(), vec![0; 4096]);
    let (mut asked, mut measured, mut states) = (Instant::now(), 0, Vec::new());
    let (mut is_chosen, mut out, mut unsent) = (false, None, Vec::new());
    let (mut counts, mut line_us) = (Vec::new(), 0);
    while counts.len() < 2 {
        assert!(
            begin.elapsed() < PATIENCE,
            "{name}: {measured} poses, {states:?}, {counts:?}"
        );
        let now_us = begin.elapsed().as_micros() as u64;
        // The lidar: what it hears, what it says.
        match line.read(&mut bytes) {
            Ok(count) if out.is_none() => unit.hear(now_us, &bytes[..count]),
            Err(error) if error.kind() != ErrorKind::WouldBlock => panic!("{name}: {error}"),
            _ => {}
        }
        match out {
            Some(until) if Instant::now() >= until => {
                (out, line_us) = (None, now_us);
                unit.has_power(now_us);
            }
            Some(_) => unsent.clear(),
            None => {}
        }
        // As much as its line carries in the time.
        while out.is_none() && line_us < now_us {
            line_us += u64::from(ROUND_US);
            unsent.extend(unit.sends(line_us, true));
        }
        match line.write(&unsent) {
            Ok(count) => drop(unsent.drain(..count)),
            Err(error) if error.kind() != ErrorKind::WouldBlock => panic!("{name}: {error}"),
            Err(_) => {}
        }
        // The board: what it says, what it is asked.
        let count = stream
            .read_for(&mut bytes, Duration::from_millis(1))
            .unwrap_or_else(|error| panic!("{name}: {error:#}"));
        for &byte in &bytes[..count] {
            match receiver.push(byte) {
                Some(Telemetry::Ready(ready)) if ready.lidar == name => {
                    is_chosen = true;
                    unit.has_power(now_us);
                }
                Some(Telemetry::Pose(pose)) if is_chosen && out.is_none() => {
                    measured += u32::from(matches!(
                        pose.verdict,
                        Verdict::Measured | Verdict::Keyframe
                    ));
                }
                Some(Telemetry::Health(health)) if states.last() != Some(&health.lidar) => {
                    states.push(health.lidar);
                }
                _ => {}
            }
        }
        if measured >= POSES {
            counts.push(measured);
            measured = 0;
            unsent.clear();
            out = Some(Instant::now() + OUT);
        }
        if asked.elapsed() > Duration::from_millis(200) {
            asked = Instant::now();
            let mut commands = Commands::new();
            match is_chosen {
                true => commands.ask_health(),
                false => commands.send(&Command::Choose { lidar: name }),
            }
            let line = stream.commands().expect("a line for commands");
            line.write_all(commands.bytes())
                .expect("the board takes commands");
        }
    }
    println!("{name}: {:.1} s, {states:?}", begin.elapsed().as_secs_f64());
    assert!(
        states.contains(&LidarState::Silent) && states.contains(&LidarState::Turning),
        "{name}: {states:?}"
    );
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn lidars_that_must_be_asked_start_on_an_emulated_board() {
    all_well(&["rplidar-scan", "ydlidar-g2", "lds006", "scip", "xv11"]);
}

/// A few at a time: they wait most of it.
fn all_well(names: &[&str]) {
    for names in names.chunks(3) {
        std::thread::scope(|scope| {
            for name in names {
                scope.spawn(|| expect_well(name));
            }
        });
    }
}

/// One of each protocol.
#[test]
#[ignore = "a minute and a half: cargo test --release --test boards chosen:: -- --ignored --nocapture"]
fn a_lidar_of_every_family_starts_on_an_emulated_board() {
    all_well(&[
        "ld14p",
        "rplidar-express",
        "rplidar-c1",
        "rplidar-ultra",
        "rplidar-ultradense",
        "rplidar-hq",
        "lds01",
        "xv11-early",
        "delta-2a",
        "camsense-x1",
        "n10",
        "lms200",
        "coin-d4",
    ]);
}
