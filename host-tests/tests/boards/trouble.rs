//! What goes wrong on a robot, on a whole emulated board: an unplugged lidar, a stalled motor, a supply that breaks down.
//! Each time: what the board does, what its health says, and that poses go on afterwards.
//!
//! The board's clock is its own, so the lidar's bytes come at the lidar's speed, or slower where this computer is busy;
//! no limit is on how long things take. What the watchdog does is tried with the Pico's own firmware in rp2040js, where time
//! is simulated too.

use std::{
    io::Write as _,
    thread,
    time::{Duration, Instant},
};

use crate::common::cable::{Cable, PACKET_US};
use beamfix::lidar::ld06::{FRAME, check_code};
use beamfix_app::{
    link::Receiver,
    telemetry::{Health, LidarState, MotorState, Pose, Reset, Telemetry, Verdict},
};
use beamfix_sim::noise::Noise;
use host_tests::board::{
    BOARDS,
    commands::Commands,
    rp2040js::{Job, PICO, Report},
    stream::Stream,
};

/// Longest that anything may take; a tenth of it does on an idle machine.
const PATIENCE: Duration = Duration::from_secs(90);

/// What the lidar does.
#[derive(Clone, Copy, PartialEq)]
enum Lidar {
    /// It turns and sends.
    Turns,
    /// Its cable is pulled out.
    Unplugged,
    /// It has power, but something holds its motor: packets of one direction, the speed 0.
    Held,
}

/// A board, the lidar that is connected to it, and what came from it.
struct Robot {
    board: Stream,
    receiver: Receiver,
    cable: Cable,
    lidar: Lidar,
    due: Instant,
    asked: Instant,
    readies: Vec<Reset>,
    poses: Vec<Pose>,
    health: Option<Health>,
    duties: Vec<u8>,
}

impl Robot {
    fn new() -> Self {
        let board = Stream::start(&BOARDS[0]).unwrap_or_else(|error| panic!("{error:#}"));
        let now = Instant::now();
        let mut robot = Self {
            board,
            receiver: Receiver::new(),
            cable: Cable::new(),
            lidar: Lidar::Unplugged,
            due: now,
            asked: now,
            readies: Vec::new(),
            poses: Vec::new(),
            health: None,
            duties: Vec::new(),
        };
        robot.until("it listens", |robot| robot.readies.len() == 1);
        robot
    }

    /// From now on.
    fn lidar(&mut self, does: Lidar) {
        if self.lidar == Lidar::Turns && does == Lidar::Unplugged {
            // In the middle of a packet.
            let half = self.cable.packet();
            self.send(&half[..FRAME / 2]);
        }
        if self.lidar == Lidar::Unplugged {
            self.cable.has_power_again();
        }
        self.lidar = does;
        self.due = Instant::now();
    }

    fn send(&mut self, bytes: &[u8]) {
        self.board
            .send(bytes)
            .unwrap_or_else(|error| panic!("{error:#}"));
    }

    /// Goes on until this is so, and gives the health asked for last.
    fn until(&mut self, what: &str, is_so: impl Fn(&Self) -> bool) -> Option<Health> {
        let start = Instant::now();
        let mut bytes = [0; 4096];
        while !is_so(self) {
            let newest = self.poses.last();
            assert!(
                start.elapsed() < PATIENCE,
                "not so for {PATIENCE:?}: {what}; {:?}, {newest:?}",
                self.health
            );
            // One packet, then what the board has to say is read: a board whose line is full takes nothing more.
            let is_due = Instant::now() >= self.due;
            if self.lidar != Lidar::Unplugged && is_due {
                let packet = match self.lidar {
                    Lidar::Held => held(self.cable.packet()),
                    _ => self.cable.packet(),
                };
                self.send(&packet);
                self.due += Duration::from_micros(PACKET_US);
            }
            if self.asked.elapsed() > Duration::from_millis(100) {
                self.asked = Instant::now();
                let mut ask = Commands::new();
                ask.ask_health();
                let commands = self.board.commands().expect("it has a line for commands");
                commands.write_all(ask.bytes()).expect("it takes commands");
            }
            let time = Duration::from_millis(if is_due { 1 } else { 5 });
            let n = self.board.read_for(&mut bytes, time);
            let n = n.unwrap_or_else(|error| panic!("{error:#}"));
            for &byte in &bytes[..n] {
                match self.receiver.push(byte) {
                    Some(Telemetry::Ready(ready)) => self.readies.push(ready.reset),
                    Some(Telemetry::Pose(pose)) => self.poses.push(pose),
                    Some(Telemetry::Health(health)) => self.health = Some(health),
                    _ => {}
                }
            }
            let duties = self.board.duties();
            self.duties
                .extend(duties.unwrap_or_else(|error| panic!("{error:#}")));
            thread::yield_now();
        }
        println!(
            "{what} after {:.1} s: {:?}",
            start.elapsed().as_secs_f64(),
            self.health
        );
        self.health
    }

    /// Goes on for so many more poses.
    fn poses(&mut self, more: usize) {
        let enough = self.poses.len() + more;
        self.until("poses go on", |robot| robot.poses.len() >= enough);
    }

    fn until_health(&mut self, what: &str, is_so: impl Fn(&Health) -> bool) -> Health {
        self.health = None;
        let health = self.until(what, |robot| robot.health.as_ref().is_some_and(&is_so));
        health.expect("it was there")
    }

    /// The last pose is where the robot is.
    fn is_where_it_should_be(&mut self) {
        let pose = self.poses.last().expect("a pose");
        let (mm, degrees) = self.cable.off(pose);
        println!("{mm:.0} mm and {degrees:.2}° off");
        assert!(mm < 50.0 && degrees.abs() < 1.5, "{pose:?}");
    }

    /// The numbers of all poses since the last start: none is missing.
    fn is_without_gap(&self, from: usize) {
        for (k, pose) in self.poses[from..].iter().enumerate() {
            assert_eq!(usize::from(pose.sequence), k);
        }
    }
}

/// A packet while the motor stands: all beams in one direction, the speed 0.
fn held(mut packet: [u8; FRAME]) -> [u8; FRAME] {
    packet[2..4].fill(0);
    packet[4..6].copy_from_slice(&9000u16.to_le_bytes());
    packet[42..44].copy_from_slice(&9000u16.to_le_bytes());
    packet[46] = check_code(&packet[..46]);
    packet
}

/// A robot that has driven for two seconds, and knows where it is.
fn driving() -> Robot {
    let mut robot = Robot::new();
    robot.lidar(Lidar::Turns);
    // Where its first pose was is where it measures from.
    robot.until("a first pose", |robot| !robot.poses.is_empty());
    robot.cable.first(&robot.poses[0]);
    robot.poses(20);
    let health = robot.until_health("all is well", |health| {
        (health.lidar, health.motor) == (LidarState::Turning, MotorState::Steady)
    });
    assert_eq!(health.motor_restarts, 0);
    robot.is_where_it_should_be();
    robot
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn an_unplugged_lidar_is_told_and_poses_go_on_when_it_is_back() {
    let mut robot = driving();
    let before = robot.health.expect("asked for");
    robot.lidar(Lidar::Unplugged);
    robot.until_health("silent", |health| health.lidar == LidarState::Silent);
    let seen = robot.poses.len();
    // Its motor's line is switched off and on again, in case that helps.
    robot.until_health("restarted", |health| health.motor_restarts >= 1);
    assert_eq!(robot.poses.len(), seen, "poses without a lidar");
    robot.lidar(Lidar::Turns);
    robot.poses(30);
    let after = robot.until_health("all is well", |health| {
        (health.lidar, health.motor) == (LidarState::Turning, MotorState::Steady)
    });
    // Half a packet was lost, and nothing else.
    assert!(after.check_errors <= before.check_errors + 1);
    assert!(after.skipped_bytes - before.skipped_bytes < FRAME as u32);
    assert_eq!((after.bytes_lost, robot.readies.len()), (0, 1));
    robot.is_without_gap(0);
    robot.is_where_it_should_be();
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn a_held_motor_is_told_switched_off_and_started_again() {
    let mut robot = driving();
    robot.duties.clear();
    robot.lidar(Lidar::Held);
    robot.until_health("it stands", |health| health.lidar == LidarState::Standing);
    robot.until_health("off", |health| health.motor == MotorState::Off);
    robot.until("its line is low", |robot| robot.duties.last() == Some(&0));
    // More and more first, in vain.
    let most = robot.duties.iter().max();
    assert_eq!(most, Some(&100), "{:?}", robot.duties);
    robot.duties.clear();
    let health = robot.until_health("started again", |health| health.motor_restarts == 1);
    assert_eq!(health.motor, MotorState::SpinningUp);
    robot.until("its line shows it", |robot| {
        // An LD06 listens to its line only once it has seen about half.
        robot.duties.first() == Some(&50)
    });
    robot.lidar(Lidar::Turns);
    robot.poses(30);
    let health = robot.until_health("all is well", |health| {
        (health.lidar, health.motor) == (LidarState::Turning, MotorState::Steady)
    });
    assert_eq!((health.motor_restarts, robot.readies.len()), (1, 1));
    robot.is_without_gap(0);
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn a_board_whose_supply_breaks_down_starts_again_in_the_stream() {
    let mut robot = driving();
    let before = robot.health.expect("asked for");
    assert!(before.packets > 0);
    robot.duties.clear();
    robot
        .board
        .reset()
        .unwrap_or_else(|error| panic!("{error:#}"));
    robot.until("it listens again", |robot| robot.readies.len() == 2);
    let seen = robot.poses.len();
    robot.poses(1);
    // From the origin, and counted from 0.
    let first = robot.poses[seen];
    assert_eq!((first.sequence, first.pose), (0, [0.0; 3]));
    robot.poses(30);
    let after = robot.until_health("all is well", |health| {
        (health.lidar, health.motor) == (LidarState::Turning, MotorState::Steady)
    });
    assert_eq!((after.motor_restarts, after.bytes_lost), (0, 0));
    assert_eq!(robot.duties.first(), Some(&50));
    assert_eq!(robot.readies.len(), 2);
    robot.is_without_gap(seen);
    println!("before: {before:?}");
}

/// `None` where rp2040js is missing.
fn in_rp2040js(job: Job) -> Option<Report> {
    job.run().unwrap_or_else(|error| panic!("{error:#}"))
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn bytes_that_lead_nowhere_end_in_a_reset_by_the_watchdog() {
    // Another lidar's bytes, or a bad line, for 20 s.
    let mut random = Noise::new(1, 0);
    let noise: Vec<u8> = std::iter::repeat_with(|| random.even(0.0, 256.0) as u8)
        .take(20 * 23_040)
        .collect();
    let Some(report) = in_rp2040js(Job::ld06(PICO, &noise)) else {
        return;
    };
    let reset = report.reset.expect("the watchdog bites");
    println!("reset {reset:.2} s after the first byte");
    // It gives up after 15 s, and the watchdog waits for 1 s.
    assert!((15.5..16.5).contains(&reset), "{reset}");
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn scans_that_fit_nowhere_cost_a_pico_a_few_packets_at_most() {
    // Without wheels the first such scan costs most: other turns are tried, longer than the ring for bytes lasts.
    // Three ranges in four are wrong for 0.8 s of 7.
    // 2600 packets of 12 beams, 449 a turn at least; the first and the last turn are not whole.
    const REVOLUTIONS: usize = 2600 * 12 / 451 - 2;
    let (mut cable, mut random, mut bytes) = (Cable::new(), Noise::new(1, 0), Vec::new());
    for k in 0..2600 {
        let mut packet = cable.packet();
        if (1200..1500).contains(&k) {
            for point in packet[6..42].chunks_exact_mut(3) {
                if random.even(0.0, 1.0) < 0.75 {
                    let mm = random.even(200.0, 3200.0) as u16;
                    point[..2].copy_from_slice(&mm.to_le_bytes());
                }
            }
            packet[46] = check_code(&packet[..46]);
        }
        bytes.extend_from_slice(&packet);
    }
    let Some(report) = in_rp2040js(Job::ld06(PICO, &bytes)) else {
        return;
    };
    let poses: Vec<_> = report.replay.poses().collect();
    cable.first(poses[0]);
    let (mm, degrees) = cable.off(poses[poses.len() - 1]);
    let health = report.replay.health().expect("every 16 poses");
    let used = [Verdict::First, Verdict::Measured, Verdict::Keyframe];
    let refused = poses.iter().filter(|pose| !used.contains(&pose.verdict));
    let refused = refused.count();
    println!(
        "{} poses, {refused} refused, the last {mm:.0} mm and {degrees:.2}° off; {health:?}",
        poses.len()
    );
    assert_eq!((report.reset, report.overruns), (None, 0));
    assert!(refused >= 5, "they fit");
    assert!(poses.len() >= REVOLUTIONS, "whole revolutions are lost");
    assert!(health.bytes_lost <= 5 * FRAME as u32);
    assert!(mm < 20.0 && degrees.abs() < 0.3);
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn a_silent_lidar_resets_nothing_and_its_motor_is_tried_again_and_again() {
    let Some(report) = in_rp2040js(Job::alone(PICO, 20.0)) else {
        return;
    };
    println!("{:?}", report.duties);
    assert_eq!(report.reset, None);
    let duties: Vec<u8> = report.duties.iter().map(|(_, duty)| *duty).collect();
    let changes = duties.iter().position(|duty| *duty == 50);
    assert_eq!(
        &duties[changes.expect("it is started")..],
        [50, 0, 50, 0, 50, 0],
        "5 s on, 2 s off"
    );
    let times: Vec<f64> = report.duties.iter().map(|(time, _)| *time).collect();
    for (k, wanted) in [5.0, 7.0, 12.0, 14.0, 19.0].iter().enumerate() {
        let time = times[times.len() - 5 + k];
        assert!((time - wanted).abs() < 0.2, "{times:?}");
    }
}
