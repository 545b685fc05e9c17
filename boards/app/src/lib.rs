//! The firmware of every board, without the board: bytes in, frames out.
//!
//! ```text
//! lidar(byte) ───▶ ld06 ─▶ assembler ─▶ odometry ─▶ pose, health ─▶ bytes to send
//! command(byte) ─▶ wheels, beams of other sensors
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
    geometry::{EgoMotion, Pose},
    lidar::{Packet as _, Protocol as _, ld06, motor::MotorConfig},
    odometry::{Odometry, OdometryConfig, Step},
    scan::{Assembler, Beam},
};
use heapless::Vec;

use command::Command;
use supervisor::{Care, Seen};
use telemetry::{Health, Piece, Quality, Raw, Ready, Reset, Telemetry, Verdict};

/// Version of [`telemetry`] and [`command`].
pub const VERSION: u8 = 3;
/// What the lidar sends at.
pub const LIDAR_BAUD: u32 = 230_400;
/// What frames leave at and commands come in at: a recording with everything switched on takes half of it.
pub const TELEMETRY_BAUD: u32 = 921_600;
/// Revolutions between two health messages.
const HEALTH_EVERY: u16 = 16;
/// Longest time that bytes of the lidar wait for others before they are sent on (µs).
const RAW_US: u32 = 20_000;

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
    /// Whether the lidar's bytes are sent on with their times, for a replay on a PC. Default: no; a command switches it.
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
const OUT: usize = if cfg!(feature = "mavlink") { 448 } else { 256 };

/// What a board runs. N is the most beams a revolution may have.
pub struct App<const N: usize> {
    lidar: Lidar,
    commands: link::Receiver,
    turns: Turns<N>,
    raw: Raw,
}

/// From bytes to beams.
struct Lidar {
    parser: ld06::Parser,
    /// Here rather than on the stack, where it would lie below a match.
    packet: Option<ld06::Packet>,
    /// Bytes taken; wraps.
    bytes: u32,
    /// The motor's speed by the last good packet.
    speed_deg_per_s: u16,
}

/// From beams to frames.
struct Turns<const N: usize> {
    assembler: Assembler<N>,
    odometry: Odometry<N>,
    /// Where the robot is by its wheels, until a revolution has used it.
    wheels: Option<Pose>,
    /// The same at the end of the last revolution.
    last_wheels: Option<Pose>,
    output: Output,
    record: bool,
    scans: bool,
    quality: bool,
    now_us: u32,
    /// When the last pose was, until its error was told.
    #[cfg(feature = "demo")]
    pose_us: Option<u32>,
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
            lidar: Lidar {
                parser: ld06::Parser::new(),
                packet: None,
                bytes: 0,
                speed_deg_per_s: 0,
            },
            commands: link::Receiver::new(),
            turns: Turns {
                assembler: Assembler::new(),
                odometry: Odometry::new(config.odometry),
                wheels: None,
                last_wheels: None,
                output: config.output,
                record: config.record,
                scans: config.scans,
                quality: config.quality,
                now_us: 0,
                #[cfg(feature = "demo")]
                pose_us: None,
                sequence: 0,
                health_due: false,
                bytes_lost: 0,
                care: Care::NONE,
                out: Vec::new(),
            },
            raw: Raw {
                time_us: 0,
                bytes: Vec::new(),
            },
        }
    }

    /// The frame to send once the board listens.
    pub fn ready(&mut self, reset: Reset) -> &[u8] {
        self.turns.out.clear();
        let ready = Ready {
            version: VERSION,
            beams: N as u16,
            reset,
        };
        self.turns.send(&Telemetry::Ready(ready));
        &self.turns.out
    }

    /// How far the last pose is from where the simulated robot really is; most often nothing, for nothing was found.
    #[cfg(feature = "demo")]
    pub fn truth(&mut self, demo: &mut demo::Demo) -> &[u8] {
        self.turns.out.clear();
        if let Some(at) = self.turns.pose_us.take() {
            self.turns.tell_truth(demo.truth(at));
        }
        &self.turns.out
    }

    /// Tells the time (µs, wrapping), which only recordings and MAVLink need.
    pub fn set_time(&mut self, now_us: u32) {
        self.turns.now_us = now_us;
    }

    /// Takes a byte of the lidar; gives the bytes to send, most often none.
    ///
    /// The byte that completes a revolution costs a match; a board must buffer what comes meanwhile.
    pub fn lidar(&mut self, byte: u8) -> &[u8] {
        self.turns.out.clear();
        if self.turns.record {
            self.record(byte);
        }
        self.lidar.push(byte, &mut self.turns);
        self.health_when_due()
    }

    /// Collects the lidar's bytes and sends them on in pieces.
    #[inline(never)]
    fn record(&mut self, byte: u8) {
        let now_us = self.turns.now_us;
        let waited_us = now_us.wrapping_sub(self.raw.time_us);
        let old = !self.raw.bytes.is_empty() && waited_us > RAW_US;
        if self.raw.bytes.is_full() || old {
            self.turns.send_raw(&self.raw);
            self.raw.bytes.clear();
        }
        if self.raw.bytes.is_empty() {
            self.raw.time_us = now_us;
        }
        let _ = self.raw.bytes.push(byte);
    }

    /// Takes a byte of the command line; gives the bytes to send, most often none.
    pub fn command(&mut self, byte: u8) -> &[u8] {
        self.turns.out.clear();
        match self.commands.push(byte) {
            None => return &[],
            Some(Command::Wheels { x, y, theta }) => {
                self.turns.wheels = Some(Pose::new(x, y, theta));
            }
            Some(Command::Lidar(bytes)) => {
                for &byte in bytes {
                    self.lidar.push(byte, &mut self.turns);
                }
            }
            Some(Command::Beams { turn_starts, beams }) => {
                for (k, beam) in command::beams(beams).enumerate() {
                    self.turns.beam(beam, turn_starts && k == 0);
                }
            }
            Some(Command::Health) => {
                // What is left of a recording comes too.
                if !self.raw.bytes.is_empty() {
                    self.turns.send_raw(&self.raw);
                    self.raw.bytes.clear();
                }
                self.turns.health_due = true;
            }
            Some(Command::Send {
                raw,
                scans,
                quality,
            }) => {
                self.turns.record = raw;
                self.turns.scans = scans;
                self.turns.quality = quality;
            }
        }
        self.health_when_due()
    }

    /// Where the robot is.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.turns.odometry.pose()
    }

    /// What a [`supervisor::Supervisor`] watches.
    #[must_use]
    pub fn seen(&self) -> Seen {
        Seen {
            bytes: self.lidar.bytes,
            packets: self.lidar.parser.counters().packets,
            turns: self.turns.odometry.counters().scans,
            speed_deg_per_s: self.lidar.speed_deg_per_s,
        }
    }

    /// Tells what a [`supervisor::Supervisor`] found.
    pub fn set_care(&mut self, care: Care) {
        self.turns.care = care;
    }

    /// Tells how many bytes found no room in the board's buffers since the start.
    pub fn set_bytes_lost(&mut self, bytes: u32) {
        self.turns.bytes_lost = bytes;
    }

    fn health_when_due(&mut self) -> &[u8] {
        // It waits for a call that has room for it.
        let room = self.turns.out.capacity() - self.turns.out.len();
        if self.turns.health_due && room >= telemetry::HEALTH_FRAME {
            self.turns.health_due = false;
            let health = self.health();
            self.turns.send(&Telemetry::Health(health));
        }
        &self.turns.out
    }

    /// How the parts are.
    #[must_use]
    pub fn health(&self) -> Health {
        let lidar = self.lidar.parser.counters();
        let commands = self.commands.counters();
        Health {
            packets: lidar.packets,
            check_errors: lidar.check_errors,
            skipped_bytes: lidar.skipped_bytes,
            beams_refused: self.turns.assembler.refused_beams(),
            matches_refused: self.turns.odometry.counters().refused,
            commands: commands.frames,
            command_errors: commands.errors,
            bytes_lost: self.turns.bytes_lost,
            lidar: self.turns.care.lidar,
            motor: self.turns.care.motor,
            motor_restarts: self.turns.care.motor_restarts,
        }
    }
}

impl Lidar {
    /// Apart, so that what the parser needs is not on the stack during a match.
    #[inline(never)]
    fn receive(&mut self, byte: u8) {
        self.packet = self.parser.push(byte);
    }

    fn push<const N: usize>(&mut self, byte: u8, turns: &mut Turns<N>) {
        self.bytes = self.bytes.wrapping_add(1);
        self.receive(byte);
        if let Some(packet) = &self.packet {
            self.speed_deg_per_s = packet.speed_deg_per_s;
            let start = packet.revolution_start();
            for (k, beam) in packet.beams().enumerate() {
                turns.beam(beam, start == Some(k));
            }
            if turns.scans {
                turns.send_piece(packet, start);
            }
        }
    }
}

impl<const N: usize> Turns<N> {
    fn beam(&mut self, beam: Beam, turn_starts: bool) {
        if !self.assembler.push(beam, turn_starts) {
            return;
        }
        let scan = self.assembler.scan();
        let time_us = scan.end_us();
        let wheels = self.wheels.take();
        let ego = EgoMotion {
            wheels: (self.last_wheels.zip(wheels)).map(|(last, now)| last.between(now)),
            rotation: None,
        };
        self.last_wheels = wheels.filter(|pose| pose.is_finite());
        let step = self.odometry.update(scan, ego);
        self.report(time_us, &step);
    }

    /// Apart, so that its memory is not on the stack during the match.
    #[inline(never)]
    fn report(&mut self, time_us: u32, step: &Step) {
        let pose = frame(self.sequence, time_us, step);
        self.sequence = self.sequence.wrapping_add(1);
        self.health_due |= self.sequence.is_multiple_of(HEALTH_EVERY);
        self.send(&Telemetry::Pose(pose));
        if self.quality {
            self.send_quality(pose.sequence, step);
        }
        #[cfg(feature = "demo")]
        {
            self.pose_us = Some(time_us);
        }
        #[cfg(feature = "mavlink")]
        if self.output == Output::Mavlink {
            let twist = self.odometry.twist();
            let scan = self.assembler.scan();
            mavlink::append(&pose, twist, scan, self.now_us, &mut self.out);
        }
    }

    #[inline(never)]
    fn send_raw(&mut self, raw: &Raw) {
        self.send(&Telemetry::Raw(raw.clone()));
    }

    #[inline(never)]
    fn send_quality(&mut self, sequence: u16, step: &Step) {
        self.send(&Telemetry::Quality(Quality::of(sequence, step)));
    }

    #[inline(never)]
    fn send_piece(&mut self, packet: &ld06::Packet, start: Option<usize>) {
        self.send(&Telemetry::Scan(Piece::of(packet, start)));
    }

    #[cfg(feature = "demo")]
    #[inline(never)]
    fn tell_truth(&mut self, truth: Pose) {
        let sequence = self.sequence.wrapping_sub(1);
        let message = telemetry::Truth {
            sequence,
            pose: [truth.x, truth.y, truth.theta],
        };
        self.send(&Telemetry::Truth(message));
        if self.output == Output::Text {
            let off = truth.between(self.odometry.pose());
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
    let c = step.covariance.0;
    let (inliers, beams, residual) = match &step.outcome {
        Ok(found) => (found.inliers, found.beams, found.residual),
        Err(_) => (0, 0, 0.0),
    };
    telemetry::Pose {
        sequence,
        time_us,
        pose: [step.pose.x, step.pose.y, step.pose.theta],
        covariance: [c.xx, c.xy, c.yy, c.xt, c.yt, c.tt],
        verdict: Verdict::of(step),
        inliers,
        beams,
        residual,
    }
}
