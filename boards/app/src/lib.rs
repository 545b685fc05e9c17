//! The firmware of every board, without the board: bytes in, frames out.
//!
//! ```text
//! lidar(bytes) ───▶ pipeline ─▶ pose, health ─▶ bytes to send
//! command(bytes) ─▶ wheels, gyroscope, beams of other sensors
//! ```
//!
//! [`App`] does no I/O, so the host runs the very code that the boards run; a board moves bytes between its UARTs
//! and these functions, and sleeps in between: [`run`] does that for every board with interrupts.
#![no_std]

#[cfg(feature = "demo")]
pub mod checks;
pub mod command;
#[cfg(feature = "demo")]
pub mod demo;
#[cfg(feature = "demo")]
pub mod hash;
pub mod link;
#[cfg(feature = "mavlink")]
pub mod mavlink;
pub mod pairs;
pub mod ring;
pub mod run;
pub mod supervisor;
pub mod telemetry;
pub mod text;

use beamfix::{
    geometry::Pose,
    lidar::{Packet as _, Protocol as _, ld06, motor::MotorConfig},
    odometry::{Odometry, OdometryConfig, Step},
    pipeline::{Pipeline, Revolution, Sink},
};
use heapless::Vec;

use command::Command;
use supervisor::{Care, Seen};
use telemetry::{Gyro, Health, Piece, Quality, Raw, Ready, Reset, Telemetry, Verdict, Wheels};

/// Version of [`telemetry`] and [`command`].
pub const VERSION: u8 = 4;
/// What the lidar sends at.
pub const LIDAR_BAUD: u32 = 230_400;
/// What frames leave at and commands come in at: a recording with everything switched on takes half of it.
pub const TELEMETRY_BAUD: u32 = 921_600;
/// Revolutions between two health messages.
const HEALTH_EVERY: u16 = 16;
/// Bytes of the lidar that come in within this time of each other count as coming in together (µs), so that a recording
/// can say when that was.
const PIECE_US: u32 = 2_000;

/// Most beams of a revolution; further ones are refused and counted. An LD06 sends 450 at 10 Hz.
pub const BEAMS: usize = 456;
/// The same on a board with 16 KB of RAM: the last 20 of a revolution, 16°, are given up so that the stack fits too.
pub const SMALL_BEAMS: usize = 430;
/// Change it here for all boards.
pub const CONFIG: AppConfig = AppConfig::DEFAULT;

/// The application as the boards run it.
pub type Board = App<BEAMS>;
/// The same on a board with 16 KB of RAM.
pub type SmallBoard = App<SMALL_BEAMS>;

/// Settings of [`App`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AppConfig {
    /// How the lidar sits on the robot, what is believed and what is not.
    pub odometry: OdometryConfig,
    /// What is sent. Default: frames.
    pub output: Output,
    /// Whether the lidar's bytes, wheels and gyroscope are sent on with their times, for a replay on a PC. Default: no; a command switches it.
    pub record: bool,
    /// Whether every beam is sent on, for a picture on a PC. Default: no; a command switches it.
    pub scans: bool,
    /// Whether every pose is followed by how good its match was, in numbers. Default: no; a command switches it.
    pub quality: bool,
    /// How the lidar's motor is driven, where its PWM line is connected. Default: an LD06's, which listens to the line
    /// only once it has seen a duty of 45 to 55 %, and is at its speed well within 5 s. `None` keeps the line low: an
    /// LD06 then turns at 10 Hz by itself.
    pub motor: Option<MotorConfig>,
}

impl AppConfig {
    /// An LD06 at the robot's centre, frames out.
    pub const DEFAULT: Self = Self {
        odometry: OdometryConfig::DEFAULT,
        output: Output::Frames,
        record: false,
        scans: false,
        quality: false,
        motor: Some(MotorConfig {
            initial_duty: 0.5,
            spin_up_ms: 5000,
            ..MotorConfig::LDROBOT_LD06
        }),
    };
}

impl AppConfig {
    /// For a board's features of these names: lines for a terminal in the demo, MAVLink where this crate has it.
    #[must_use]
    pub const fn for_features(self, demo: bool, mavlink: bool) -> Self {
        let output = match (demo, mavlink) {
            #[cfg(feature = "mavlink")]
            (_, true) => Output::Mavlink,
            (true, _) => Output::Text,
            _ => self.output,
        };
        Self { output, ..self }
    }
}

/// What is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    /// The frames of [`link`]: everything of [`telemetry`].
    Frames,
    /// Lines for a terminal: poses and health.
    Text,
    /// MAVLink 2: poses as `ODOMETRY`, scans as `OBSTACLE_DISTANCE`.
    #[cfg(feature = "mavlink")]
    Mavlink,
}

/// Most bytes that one call gives.
///
/// A packet makes a pose, its quality and a piece of the scan at most; health waits for room.
const OUT: usize = if cfg!(feature = "mavlink") { 448 } else { 192 };

/// What a board runs. N is the most beams a revolution may have.
pub struct App<const N: usize> {
    pipeline: Pipeline<ld06::Parser, Odometry<N>, N>,
    commands: link::Receiver,
    /// The bytes of the lidar that came in last, together, and when.
    piece: Raw,
    /// Bytes of the lidar taken; wraps.
    lidar_bytes: u32,
    report: Report,
}

/// From steps to bytes to send.
struct Report {
    output: Output,
    record: bool,
    scans: bool,
    quality: bool,
    now_us: u32,
    /// When the last pose was, until its error was told.
    #[cfg(feature = "demo")]
    pose_us: Option<u32>,
    /// The motor's speed by the last good packet.
    speed_deg_per_s: u16,
    sequence: u16,
    bytes_lost: u32,
    care: Care,
    health_due: bool,
    out: Vec<u8, OUT>,
}

impl<const N: usize> App<N> {
    /// Waits for the first whole revolution.
    #[must_use]
    pub const fn new(config: AppConfig) -> Self {
        Self {
            pipeline: Pipeline::new(ld06::Parser::new(), Odometry::new(config.odometry)),
            commands: link::Receiver::new(),
            piece: Raw {
                time_us: 0,
                bytes: Vec::new(),
            },
            lidar_bytes: 0,
            report: Report {
                output: config.output,
                record: config.record,
                scans: config.scans,
                quality: config.quality,
                now_us: 0,
                #[cfg(feature = "demo")]
                pose_us: None,
                speed_deg_per_s: 0,
                sequence: 0,
                health_due: false,
                bytes_lost: 0,
                care: Care::NONE,
                out: Vec::new(),
            },
        }
    }

    /// The frame to send once the board listens.
    pub fn ready(&mut self, reset: Reset) -> &[u8] {
        self.report.out.clear();
        let ready = Ready {
            version: VERSION,
            beams: N as u16,
            reset,
        };
        self.report.send(&Telemetry::Ready(ready));
        &self.report.out
    }

    /// Bytes that report the error of the last pose; empty if there was no new pose.
    #[cfg(feature = "demo")]
    pub fn truth(&mut self, demo: &mut demo::Demo) -> &[u8] {
        self.report.out.clear();
        if let Some(at) = self.report.pose_us.take() {
            self.report.send_truth(demo.truth(at), self.pose());
        }
        &self.report.out
    }

    /// Says when the bytes given next came in (µs, wrapping).
    pub fn set_time(&mut self, now_us: u32) {
        self.report.now_us = now_us;
    }

    /// Takes bytes of the lidar until there is something to send: gives the number of bytes taken and what to send,
    /// most often nothing. The rest of the bytes is to be given again.
    ///
    /// The byte that completes a revolution costs a match; a board must buffer what comes meanwhile.
    pub fn lidar(&mut self, bytes: &[u8]) -> (usize, &[u8]) {
        self.report.out.clear();
        let mut taken = 0;
        while let Some(rest) = bytes.get(taken..).filter(|rest| !rest.is_empty()) {
            let room = self.room_in_piece();
            if !self.report.out.is_empty() {
                break;
            }
            let part = rest.get(..room).unwrap_or(rest);
            let count = self.pipeline.push_packet(part, &mut self.report);
            let _ = (self.piece.bytes).extend_from_slice(part.get(..count).unwrap_or_default());
            taken += count;
            if !self.report.out.is_empty() {
                break;
            }
        }
        self.lidar_bytes = self.lidar_bytes.wrapping_add(taken as u32);
        (taken, self.health_when_due())
    }

    /// Takes all of some bytes of the lidar; what is to be sent goes to `send`.
    pub fn lidar_all(&mut self, bytes: &[u8], mut send: impl FnMut(&[u8])) {
        let mut rest = bytes;
        while !rest.is_empty() {
            let (taken, sent) = self.lidar(rest);
            send(sent);
            rest = rest.get(taken..).unwrap_or_default();
        }
    }

    /// Room for bytes that come in now, in the piece that came in together or in a new one: this sets the pipeline's
    /// clock, so that a recording of the pieces gives the same poses again.
    #[inline(never)]
    fn room_in_piece(&mut self) -> usize {
        let now_us = self.report.now_us;
        let waited_us = now_us.wrapping_sub(self.piece.time_us);
        if self.piece.bytes.is_full() || self.piece.bytes.is_empty() || waited_us > PIECE_US {
            self.end_piece();
        }
        self.piece.bytes.capacity() - self.piece.bytes.len()
    }

    /// Sends the bytes that came in together, if they are recorded; what comes in from now on belongs to a new piece.
    #[inline(never)]
    fn end_piece(&mut self) {
        if self.report.record && !self.piece.bytes.is_empty() {
            self.report.send_raw(&self.piece);
        }
        self.piece.bytes.clear();
        self.piece.time_us = self.report.now_us;
        self.pipeline.set_time(self.report.now_us);
    }

    /// Takes bytes of the command line until there is something to send: gives the number of bytes taken, and what to
    /// send, as [`App::lidar`] does.
    pub fn command(&mut self, bytes: &[u8]) -> (usize, &[u8]) {
        self.report.out.clear();
        let mut taken = 0;
        while let Some(&byte) = bytes.get(taken) {
            taken += 1;
            if self.take_command(byte) && (!self.report.out.is_empty() || self.report.health_due) {
                break;
            }
        }
        (taken, self.health_when_due())
    }

    /// Takes all of some bytes of the command line; what is to be sent goes to `send`.
    pub fn command_all(&mut self, bytes: &[u8], mut send: impl FnMut(&[u8])) {
        let mut rest = bytes;
        while !rest.is_empty() {
            let (taken, sent) = self.command(rest);
            send(sent);
            rest = rest.get(taken..).unwrap_or_default();
        }
    }

    /// Takes a byte of the command line; whether it completed a command.
    fn take_command(&mut self, byte: u8) -> bool {
        let now_us = self.report.now_us;
        match self.commands.push(byte) {
            None => return false,
            Some(Command::Wheels { x, y, theta }) => {
                self.end_piece();
                let pose = Pose::new(x, y, theta);
                self.pipeline.tracker_mut().push_wheels(now_us, pose);
                self.report.send_wheels([x, y, theta]);
            }
            Some(Command::Gyro { rate }) => {
                self.end_piece();
                self.pipeline.tracker_mut().push_gyro(now_us, rate);
                self.report.send_gyro(rate);
            }
            Some(Command::Lidar(bytes)) => {
                self.lidar_bytes = self.lidar_bytes.wrapping_add(bytes.len() as u32);
                self.pipeline.set_time(now_us);
                self.pipeline.push(bytes, &mut self.report);
            }
            Some(Command::Beams { turn_starts, beams }) => {
                let tracker = self.pipeline.tracker_mut();
                tracker.set_time(now_us);
                let start = turn_starts.then_some(0);
                let report = &mut self.report;
                tracker.push_packet(command::beams(beams), start, |revolution| {
                    report.step(&revolution);
                });
            }
            Some(Command::Health) => {
                // What is left of a recording comes too.
                self.end_piece();
                self.report.health_due = true;
            }
            Some(Command::Send {
                raw,
                scans,
                quality,
            }) => {
                self.end_piece();
                self.report.record = raw;
                self.report.scans = scans;
                self.report.quality = quality;
            }
        }
        true
    }

    /// Where the robot is.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.odometry().pose()
    }

    fn odometry(&self) -> &Odometry<N> {
        self.pipeline.tracker().estimator()
    }

    /// What a [`supervisor::Supervisor`] watches.
    #[must_use]
    pub fn seen(&self) -> Seen {
        Seen {
            bytes: self.lidar_bytes,
            packets: self.pipeline.lidar().counters().packets,
            turns: self.odometry().counters().scans,
            speed_deg_per_s: self.report.speed_deg_per_s,
        }
    }

    /// Tells what a [`supervisor::Supervisor`] found.
    pub fn set_care(&mut self, care: Care) {
        self.report.care = care;
    }

    /// Tells how many bytes found no room in the board's buffers since the start.
    pub fn set_bytes_lost(&mut self, bytes: u32) {
        self.report.bytes_lost = bytes;
    }

    fn health_when_due(&mut self) -> &[u8] {
        // It waits for a call that has room for it.
        let room = self.report.out.capacity() - self.report.out.len();
        if self.report.health_due && room >= telemetry::HEALTH_FRAME {
            self.report.health_due = false;
            let health = self.health();
            self.report.send(&Telemetry::Health(health));
        }
        &self.report.out
    }

    /// How the parts are.
    #[must_use]
    pub fn health(&self) -> Health {
        let lidar = self.pipeline.lidar().counters();
        let commands = self.commands.counters();
        Health {
            packets: lidar.packets,
            check_errors: lidar.check_errors,
            skipped_bytes: lidar.skipped_bytes,
            beams_refused: self.pipeline.tracker().refused_beams(),
            matches_refused: self.odometry().counters().refused,
            commands: commands.frames,
            command_errors: commands.errors,
            bytes_lost: self.report.bytes_lost,
            lidar: self.report.care.lidar,
            motor: self.report.care.motor,
            motor_restarts: self.report.care.motor_restarts,
        }
    }
}

impl<const N: usize> Sink<ld06::Packet, Odometry<N>, N> for Report {
    fn revolution(&mut self, revolution: Revolution<'_, Odometry<N>, N>) {
        self.step(&revolution);
    }

    fn packet(&mut self, packet: &ld06::Packet) {
        self.speed_deg_per_s = packet.speed_deg_per_s;
        if self.scans {
            self.send_piece(packet);
        }
    }
}

impl Report {
    /// Apart, so that its memory is not on the stack during the match.
    #[inline(never)]
    fn step<const N: usize>(&mut self, revolution: &Revolution<'_, Odometry<N>, N>) {
        let time_us = revolution.scan.end_us();
        let pose = frame(self.sequence, time_us, revolution.step);
        self.sequence = self.sequence.wrapping_add(1);
        self.health_due |= self.sequence.is_multiple_of(HEALTH_EVERY);
        self.send(&Telemetry::Pose(pose));
        if self.quality {
            self.send_quality(pose.sequence, revolution.step);
        }
        #[cfg(feature = "demo")]
        {
            self.pose_us = Some(time_us);
        }
        #[cfg(feature = "mavlink")]
        if self.output == Output::Mavlink {
            let twist = revolution.estimator.twist();
            mavlink::append(&pose, twist, revolution.scan, self.now_us, &mut self.out);
        }
    }

    #[inline(never)]
    fn send_raw(&mut self, raw: &Raw) {
        self.send(&Telemetry::Raw(raw.clone()));
    }

    /// Sends a pose of the wheels back with its time, where a recording wants it.
    #[inline(never)]
    fn send_wheels(&mut self, pose: [f32; 3]) {
        if self.record {
            let time_us = self.now_us;
            self.send(&Telemetry::Wheels(Wheels { time_us, pose }));
        }
    }

    /// Sends a rate of the gyroscope back with its time, where a recording wants it.
    #[inline(never)]
    fn send_gyro(&mut self, rate: f32) {
        if self.record {
            let time_us = self.now_us;
            self.send(&Telemetry::Gyro(Gyro { time_us, rate }));
        }
    }

    #[inline(never)]
    fn send_quality(&mut self, sequence: u16, step: &Step) {
        self.send(&Telemetry::Quality(Quality::of(sequence, step)));
    }

    #[inline(never)]
    fn send_piece(&mut self, packet: &ld06::Packet) {
        let start = packet.revolution_start();
        self.send(&Telemetry::Scan(Piece::of(packet, start)));
    }

    #[cfg(feature = "demo")]
    #[inline(never)]
    fn send_truth(&mut self, truth: Pose, pose: Pose) {
        let sequence = self.sequence.wrapping_sub(1);
        let message = telemetry::Truth {
            sequence,
            pose: [truth.x, truth.y, truth.theta],
        };
        self.send(&Telemetry::Truth(message));
        if self.output == Output::Text {
            let off = truth.between(pose);
            text::append_error(
                1000.0 * off.distance(),
                off.theta.to_degrees(),
                &mut self.out,
            );
        }
    }

    /// A frame that finds no room is dropped: its sequence number will be missing.
    fn send(&mut self, message: &Telemetry) {
        match self.output {
            Output::Frames => {
                let _ = link::append(message, &mut self.out);
            }
            Output::Text => text::append(message, &mut self.out),
            #[cfg(feature = "mavlink")]
            Output::Mavlink => mavlink::append_heartbeat(message, &mut self.out),
        }
    }
}

/// A step as it is sent.
fn frame(sequence: u16, time_us: u32, step: &Step) -> telemetry::Pose {
    let (inliers, beams, residual) = match &step.outcome {
        Ok(found) => (found.inliers, found.beams, found.residual),
        Err(_) => (0, 0, 0.0),
    };
    telemetry::Pose {
        sequence,
        time_us,
        pose: [step.pose.x, step.pose.y, step.pose.theta],
        covariance: step.covariance.to_array(),
        verdict: Verdict::of(step),
        inliers,
        beams,
        residual,
    }
}
