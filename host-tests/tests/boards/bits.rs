//! The firmware in the emulator against the same application here.

use beamfix_app::{BEAMS, telemetry::Telemetry};
use beamfix_sim::drive::{Settings, drive};
use beamfix_sim::encoder::{Echo, Encoder as _, damage, ld06::Sensor};
use host_tests::formats;
use host_tests::{
    board::{BOARDS, Replay, commands::Commands, difference, emulator::Count, stream},
    shared,
};

/// Bytes of an LD06 that stands in a square room, 8 m wide, with a door open, and turns by a degree a second.
fn square_room(turns: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut sensor = Sensor::ld06();
    while sensor.next_time_us() < f64::from(turns) * 1e5 {
        sensor.fire(
            &mut |time, bearing| {
                let heading = bearing + time * 1e-6 * 1f64.to_radians();
                let (s, c) = (libm::sin(heading), libm::cos(heading));
                let to_wall = 4000.0 / s.abs().max(c.abs());
                (libm::fabs(s * to_wall - 500.0) > 450.0 || c < 0.0).then_some(Echo {
                    range_mm: to_wall,
                    intensity: 200,
                })
            },
            &mut bytes,
        );
    }
    bytes
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn every_board_replays_the_same_bits() {
    let mut commands = Commands::new();
    commands.lidar(&square_room(30));
    for board in BOARDS {
        let here = Replay::on_host(&commands, board.beams);
        assert!(here.poses().count() >= 27, "{}", here.poses().count());
        let there = board
            .replay(&commands, Count::None)
            .unwrap_or_else(|error| panic!("{error:#}"));
        assert_eq!(
            difference(here.poses(), there.poses()),
            None,
            "{}",
            board.name
        );
    }
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn every_board_streams_the_same_bits() {
    let bytes = square_room(30);
    for board in BOARDS {
        let poses = stream::compare(board, &bytes).unwrap_or_else(|error| panic!("{error:#}"));
        assert!(poses >= 27, "{}: {poses} poses", board.name);
    }
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn every_board_replays_a_real_log_to_the_same_bits() {
    let Some(log) = shared::file("datasets/logs/intel.lscan") else {
        return;
    };
    let log = formats::read(&log).unwrap_or_else(|error| panic!("{error:#}"));
    let commands = Commands::of_log(&log.scans[..1000]);
    for board in BOARDS {
        let here = Replay::on_host(&commands, board.beams);
        assert_eq!(here.poses().count(), 1000);
        let there = board
            .replay(&commands, Count::None)
            .unwrap_or_else(|error| panic!("{error:#}"));
        assert_eq!(
            difference(here.poses(), there.poses()),
            None,
            "{}",
            board.name
        );
    }
}

#[test]
fn a_damaged_line_costs_packets_not_the_run() {
    let settings = Settings {
        seconds: 20.0,
        ..Settings::DEFAULT
    };
    let drive = drive(&settings, &mut Sensor::ld06());
    let bytes = damage::a_hundredth(&drive.bytes);
    let mut commands = Commands::new();
    commands.lidar(&bytes);
    commands.ask_health();
    let here = Replay::on_host(&commands, BEAMS);
    let poses: Vec<_> = here.poses().collect();
    // A frame of 47 bytes survives with a chance of 0.99^47 = 0.62; a turn whose start is lost joins the next.
    assert!(poses.len() > 80, "{} poses of 200", poses.len());
    for (k, pose) in poses.iter().enumerate() {
        assert_eq!(usize::from(pose.sequence), k);
        assert!(pose.pose.iter().all(|value| value.is_finite()), "{pose:?}");
    }
    let Some(Telemetry::Health(health)) = here.messages.last() else {
        panic!("{:?}", here.messages.last());
    };
    println!("{health:?}");
    let (all, good) = (drive.bytes.len() as u32 / 47, health.packets);
    assert!(
        good > all / 2 && good < all * 3 / 4,
        "{good} of {all} packets"
    );
    assert!(health.check_errors > 0 && health.skipped_bytes > 47 * (all - good) / 2);
    for board in BOARDS {
        let here = Replay::on_host(&commands, board.beams);
        let there = board
            .replay(&commands, Count::None)
            .unwrap_or_else(|error| panic!("{error:#}"));
        assert_eq!(here.messages, there.messages, "{}", board.name);
    }
}
