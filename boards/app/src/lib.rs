//! The firmware of every board, without the board: bytes in, frames out.
//!
//! ```text
//! lidar(byte) ───▶ ld06 ─▶ assembler ─▶ odometry ─▶ pose, health ─▶ bytes to send
//! command(byte) ─▶ wheels, beams of other sensors
//! ```
//!
//! [`App`] does no I/O, so the host runs the very code that the boards run; a board moves bytes between its UARTs
//! and these functions, and sleeps in between.
#![no_std]

pub mod command;
pub mod link;
pub mod pairs;
pub mod ring;
pub mod telemetry;

use beamfix::{
    geometry::Pose,
    lidar::{Packet as _, Protocol as _, ld06},
    matching::MatchError,
    odometry::{Odometry, OdometryConfig, Refusal, Step},
    scan::{Assembler, Beam},
};
use heapless::Vec;

use command::Command;
use telemetry::{Health, Ready, Telemetry, Verdict};

/// Version of [`telemetry`] and [`command`].
pub const VERSION: u8 = 1;
/// Revolutions between two health messages.
const HEALTH_EVERY: u16 = 16;

/// Most beams of a revolution; further ones are refused and counted. An LD06 sends 450 at 10 Hz: the last 20 of a
/// revolution are given up so that the stack fits into 16 KB of RAM too.
pub const BEAMS: usize = 430;
/// How the lidar sits on the robot, what is believed and what is not: change it here for all boards.
pub const CONFIG: OdometryConfig = OdometryConfig::DEFAULT;

/// The application as the boards run it.
pub type Board = App<BEAMS>;

/// What a board runs. N is the most beams a revolution may have.
pub struct App<const N: usize> {
    lidar: Lidar,
    commands: link::Receiver,
    turns: Turns<N>,
}

/// From bytes to beams.
struct Lidar {
    parser: ld06::Parser,
    /// Here rather than on the stack, where it would lie below a match.
    packet: Option<ld06::Packet>,
}

/// From beams to frames.
struct Turns<const N: usize> {
    assembler: Assembler<N>,
    odometry: Odometry<N>,
    /// Where the robot is by its wheels, until a revolution has used it.
    wheels: Option<Pose>,
    sequence: u16,
    bytes_lost: u32,
    health_due: bool,
    out: Vec<u8, 128>,
}

impl<const N: usize> App<N> {
    /// Waits for the first whole revolution.
    #[must_use]
    pub const fn new(config: OdometryConfig) -> Self {
        Self {
            lidar: Lidar {
                parser: ld06::Parser::new(),
                packet: None,
            },
            commands: link::Receiver::new(),
            turns: Turns {
                assembler: Assembler::new(),
                odometry: Odometry::new(config),
                wheels: None,
                sequence: 0,
                health_due: false,
                bytes_lost: 0,
                out: Vec::new(),
            },
        }
    }

    /// The frame to send once the board listens.
    pub fn ready(&mut self) -> &[u8] {
        self.turns.out.clear();
        let ready = Ready {
            version: VERSION,
            beams: N as u16,
        };
        self.turns.send(&Telemetry::Ready(ready));
        &self.turns.out
    }

    /// Takes a byte of the lidar; gives the bytes to send, most often none.
    ///
    /// The byte that completes a revolution costs a match; a board must buffer what comes meanwhile.
    pub fn lidar(&mut self, byte: u8) -> &[u8] {
        self.turns.out.clear();
        self.lidar.push(byte, &mut self.turns);
        self.health_when_due()
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
            Some(Command::Health) => self.turns.health_due = true,
        }
        self.health_when_due()
    }

    /// Where the robot is.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.turns.odometry.pose()
    }

    /// Tells how many bytes found no room in the board's buffers since the start.
    pub fn set_bytes_lost(&mut self, bytes: u32) {
        self.turns.bytes_lost = bytes;
    }

    fn health_when_due(&mut self) -> &[u8] {
        if core::mem::take(&mut self.turns.health_due) {
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
        self.receive(byte);
        if let Some(packet) = &self.packet {
            let start = packet.turn_start();
            for (k, beam) in packet.beams().enumerate() {
                turns.beam(beam, start == Some(k));
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
        let step = self.odometry.update(scan, self.wheels.take());
        self.report(time_us, &step);
    }

    /// Apart, so that its memory is not on the stack during the match.
    #[inline(never)]
    fn report(&mut self, time_us: u32, step: &Step) {
        let pose = frame(self.sequence, time_us, step);
        self.sequence = self.sequence.wrapping_add(1);
        self.health_due |= self.sequence.is_multiple_of(HEALTH_EVERY);
        self.send(&Telemetry::Pose(pose));
    }

    /// A frame that finds no room is dropped: its sequence number will be missing.
    fn send(&mut self, message: &Telemetry) {
        let _ = link::append(message, &mut self.out);
    }
}

/// A step as it is sent.
fn frame(sequence: u16, time_us: u32, step: &Step) -> telemetry::Pose {
    let c = step.covariance.0;
    let (verdict, inliers, beams, residual) = match &step.outcome {
        Ok(found) if step.keyframe => (
            Verdict::Keyframe,
            found.inliers,
            found.beams,
            found.residual,
        ),
        Ok(found) => (
            Verdict::Measured,
            found.inliers,
            found.beams,
            found.residual,
        ),
        Err(refusal) => (verdict(refusal), 0, 0, 0.0),
    };
    telemetry::Pose {
        sequence,
        time_us,
        pose: [step.pose.x, step.pose.y, step.pose.theta],
        covariance: [c.xx, c.xy, c.yy, c.xt, c.yt, c.tt],
        verdict,
        inliers,
        beams,
        residual,
    }
}

fn verdict(refusal: &Refusal) -> Verdict {
    match refusal {
        Refusal::First => Verdict::First,
        Refusal::TooFar { .. } => Verdict::TooFar,
        Refusal::NoMatch(MatchError::TooFewBeams { .. }) => Verdict::TooFewBeams,
        Refusal::NoMatch(MatchError::TooFewLines { .. }) => Verdict::TooFewLines,
        Refusal::NoMatch(MatchError::TooFewCorrespondences { .. }) => {
            Verdict::TooFewCorrespondences
        }
        Refusal::NoMatch(MatchError::Degenerate) => Verdict::Degenerate,
        Refusal::NoMatch(MatchError::NotConverged { .. }) => Verdict::NotConverged,
        Refusal::NoMatch(MatchError::Ambiguous { .. }) => Verdict::Ambiguous,
        _ => Verdict::Refused,
    }
}
