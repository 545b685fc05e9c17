//! Bytes over the boards' UARTs: none lost, and what is damaged on the line costs packets, not the run.
//!
//! Three minutes on each board (a quarter of an hour in all):
//! `cargo test --release --test boards_uart -- --ignored --nocapture`

use beamfix_app::{BEAMS, telemetry::Telemetry};
use beamfix_selftest::{checks, demo::Demo};
use beamfix_sim::encoder::damage;
use host_tests::board::{
    BOARDS, Board, Replay, STM32F4,
    commands::Commands,
    difference,
    firmware::Firmware,
    rp2040js::{Job, PICO, PICO_EMBASSY},
    stream,
};

/// Of the demo's robot, which drives in a circle as long as one likes.
fn ld06(seconds: f64) -> Vec<u8> {
    let mut demo = Demo::new();
    let packets = (seconds * 4500.0 / 12.0) as usize;
    (0..packets).flat_map(|_| demo.packet()).collect()
}

fn boards() -> impl Iterator<Item = &'static Board> {
    BOARDS.iter().chain([&STM32F4])
}

/// What the application makes of these bytes here.
fn here(bytes: &[u8]) -> Replay {
    let mut commands = Commands::new();
    commands.lidar(bytes);
    commands.ask_health();
    Replay::on_host(&commands, BEAMS)
}

/// Every message of the board is the host's, so no byte was lost and every pose is out.
fn run(board: &Board, bytes: &[u8], least: usize) {
    let poses = stream::compare(board, bytes).unwrap_or_else(|error| panic!("{error:#}"));
    println!("{}: {} bytes, {poses} poses", board.name, bytes.len());
    assert!(poses >= least, "{}: {poses} poses", board.name);
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn no_byte_is_lost_and_every_pose_is_out() {
    let bytes = ld06(5.0);
    for board in boards() {
        run(board, &bytes, 47);
    }
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn a_damaged_line_resets_no_board() {
    // `compare` expects the one ready frame of the start, and then the same messages as here: a reset would send another.
    let bytes = damage::a_hundredth(&ld06(10.0));
    for board in boards() {
        run(board, &bytes, 30);
    }
}

#[test]
#[ignore = "ten minutes: cargo test --release --test boards_uart -- --ignored --nocapture"]
fn three_minutes_without_a_loss_on_every_board() {
    let bytes = ld06(180.0);
    std::thread::scope(|scope| {
        for board in boards() {
            let bytes = &bytes;
            scope.spawn(move || run(board, bytes, 1795));
        }
    });
}

#[test]
#[ignore = "ten minutes: cargo test --release --test boards_uart -- --ignored --nocapture"]
fn three_minutes_on_a_damaged_line_on_every_board() {
    let bytes = damage::a_hundredth(&ld06(180.0));
    let health = here(&bytes).messages;
    println!("{:?}", health.last());
    std::thread::scope(|scope| {
        for board in boards() {
            let bytes = &bytes;
            scope.spawn(move || run(board, bytes, 900));
        }
    });
}

/// Bytes at their exact times into a firmware of the Pico: nothing overruns while a match is computed.
fn at_exact_times(firmware: Firmware, seconds: f64) {
    let bytes = ld06(seconds);
    let Some(report) = Job::ld06(firmware, &bytes)
        .run()
        .unwrap_or_else(|error| panic!("{error:#}"))
    else {
        return;
    };
    println!(
        "{}: {} bytes in {:.1} s, {} overruns, {} poses, core awake {:.1} %",
        firmware.package,
        report.sent,
        report.seconds,
        report.overruns,
        report.replay.poses().count(),
        100.0 * report.load()
    );
    assert_eq!((report.sent, report.overruns), (bytes.len(), 0));
    assert!((report.seconds - seconds).abs() < 0.1);
    let here = here(&bytes);
    assert_eq!(difference(here.poses(), report.replay.poses()), None);
    assert!(report.load() < 0.5, "awake {:.3}", report.load());
    for message in &report.replay.messages {
        if let Telemetry::Health(health) = message {
            assert_eq!((health.bytes_lost, health.check_errors), (0, 0));
        }
    }
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn a_pico_has_no_overrun_at_exact_byte_times() {
    at_exact_times(PICO, 5.0);
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn a_pico_with_embassy_has_no_overrun_at_exact_byte_times() {
    at_exact_times(PICO_EMBASSY, 5.0);
}

#[test]
#[ignore = "three minutes: cargo test --release --test boards_uart -- --ignored --nocapture"]
fn a_pico_has_no_overrun_in_three_minutes_at_exact_byte_times() {
    at_exact_times(PICO, 180.0);
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn a_pico_counts_and_survives_forced_overruns() {
    let bytes = ld06(8.0);
    let mut job = Job::ld06(PICO, &bytes);
    // The UART holds 32 bytes: now and then 100 come at once, as if interrupts had been masked for 4 ms.
    job.bursts = (1..8).map(|second| (second * 17_625, 100)).collect();
    let Some(report) = job.run().unwrap_or_else(|error| panic!("{error:#}")) else {
        return;
    };
    let poses: Vec<_> = report.replay.poses().collect();
    let health = report.replay.health();
    let health = health.expect("a health message every 16 revolutions");
    println!(
        "{} bytes lost in {} poses, {health:?}",
        report.overruns,
        poses.len()
    );
    assert!(report.overruns > 300, "{}", report.overruns);
    // The chip tells of a loss, not how large it was.
    assert!((1..=report.overruns).contains(&health.bytes_lost));
    assert!(health.skipped_bytes > 0);
    // No reset, and no revolution without a pose.
    let readies = |message: &&Telemetry| matches!(message, Telemetry::Ready(_));
    assert_eq!(report.replay.messages.iter().filter(readies).count(), 1);
    assert!(poses.len() >= 75, "{} poses", poses.len());
    for (k, pose) in poses.iter().enumerate() {
        assert_eq!(usize::from(pose.sequence), k);
    }
}

#[test]
fn a_ring_counts_what_it_has_no_room_for() {
    checks::a_ring_counts_what_it_has_no_room_for();
}
