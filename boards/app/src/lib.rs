//! The firmware of every board, without the board: bytes in, frames out.
//!
//! ```text
//! lidar(bytes) ───▶ pipeline ─▶ pose, health ─▶ bytes to send
//! command(bytes) ─▶ wheels, gyroscope, beams of other sensors
//! ```
//!
//! [`Firmware`] does no I/O, so the host runs the very code that the boards run; a board moves bytes between its UARTs
//! and these functions, and sleeps in between: [`run`] does that for every board with interrupts. Which lidar and which
//! task are types: [`lidars`], [`task`].
#![no_std]

#[cfg(feature = "any-lidar")]
pub mod any;
mod config;
pub mod lidars;
pub mod map;
#[cfg(feature = "mavlink")]
pub mod mavlink;
mod report;
pub mod ring;
pub mod run;
pub mod starter;
pub mod supervisor;
pub mod task;
#[cfg(feature = "text")]
pub mod text;

use beamfix::{
    geometry::Pose,
    lidar::{Protocol, parsers},
    odometry::Odometry,
    pipeline::{Late, Pipeline},
};
use heapless::Vec;

use command::Command;
use report::Report;
use supervisor::{Care, Seen};
use task::Task;
use telemetry::{Health, Raw, Ready, Reset, Telemetry};

pub use beamfix_telemetry::{VERSION, command, link, telemetry};
pub use config::{AppConfig, CONFIG, Output};
pub use lidars::{Lidar, OdometryWith, Row, chosen};

/// What an LD06 sends at.
pub const LIDAR_BAUD: u32 = CONFIG.lidar.baud;
/// What frames leave at and commands come in at: a recording with everything switched on takes half of it.
pub const TELEMETRY_BAUD: u32 = 921_600;
/// Bytes of the lidar that come in within this time of each other count as coming in together (µs), so that a recording
/// can say when that was.
const PIECE_US: u32 = 2_000;

/// Most beams of an LD06's revolution; further ones are refused and counted. It sends 450 at 10 Hz.
pub const BEAMS: usize = 456;
/// The same on a board with 16 KB of RAM: the last 38 of a revolution, 30°, are given up so that the stack fits too.
pub const SMALL_BEAMS: usize = 412;

/// The application with an LD06 and odometry.
pub type App<const N: usize> = Firmware<parsers::Ldrobot, Odometry<N>, N>;
/// The same as the boards run it.
pub type Board = App<BEAMS>;
/// The same on a board with 16 KB of RAM.
pub type SmallBoard = App<SMALL_BEAMS>;

/// Nothing came in yet.
const NO_PIECE: Raw = Raw {
    time_us: 0,
    bytes: Vec::new(),
};

/// Room for an application whose bytes are all zero: a static of it takes no flash, and nothing is copied at the start.
///
/// ```
/// use beamfix_app::{AppConfig, Board, CONFIG, Place};
///
/// const HERE: AppConfig = CONFIG.checked();
/// # fn once(place: &mut Place<Board>) {
/// let app: &mut Board = place.app(&HERE); // `place` is a static: `Place::EMPTY`
/// # }
/// ```
pub struct Place<F>(F);

impl<const N: usize> Place<App<N>> {
    /// Makes the application with an LD06 and odometry there: it waits for the first whole revolution.
    pub fn app(&mut self, config: &AppConfig) -> &mut App<N> {
        self.odometry::<lidars::Row<0>>(config)
    }
}

impl<P: Protocol, const N: usize> Place<Firmware<P, Odometry<N>, N>> {
    /// Nothing there yet.
    pub const EMPTY: Self = Self(Firmware {
        pipeline: Pipeline::ZERO,
        commands: link::Receiver::new(),
        piece: NO_PIECE,
        piece_bytes: 0,
        lidar_bytes: 0,
        report: Report::ZERO,
    });

    /// Makes the application there, as [`Firmware::odometry`] does, without a second one on the stack. L is the settings' lidar.
    // Apart, so that its memory is not on the stack of whoever goes on with the application.
    #[inline(never)]
    pub fn odometry<L: Lidar<Parser = P>>(
        &mut self,
        config: &AppConfig,
    ) -> &mut Firmware<P, Odometry<N>, N> {
        let Self(app) = self;
        app.commands = link::Receiver::new();
        app.set_up(L::PARSER, config);
        app
    }
}

/// The application with any lidar and any task: P reads the lidar's bytes, E finds the poses, N is the most beams a revolution may have.
pub struct Firmware<P: Protocol, E, const N: usize> {
    pipeline: Pipeline<Late<P>, E, N>,
    commands: link::Receiver,
    /// The bytes of the lidar that came in last, together, where they are recorded, and when.
    piece: Raw,
    /// How many there are, recorded or not.
    piece_bytes: usize,
    /// Bytes of the lidar taken; wraps.
    lidar_bytes: u32,
    report: Report,
}

impl<const N: usize> App<N> {
    /// Waits for the first whole revolution.
    #[must_use]
    pub const fn new(config: AppConfig) -> Self {
        Self::odometry(config, parsers::Ldrobot::new())
    }
}

impl<P: Protocol, const N: usize> Firmware<P, Odometry<N>, N> {
    /// Begins anew with these settings and their lidar's parser, in its place; a command that has begun goes on.
    #[inline(always)]
    fn set_up(&mut self, lidar: P, config: &AppConfig) {
        // By name: a field more must be set here too.
        let Self {
            pipeline,
            commands: _,
            piece,
            piece_bytes,
            lidar_bytes,
            report,
        } = self;
        pipeline.set_up(lidar, config.odometry);
        *piece = NO_PIECE;
        *piece_bytes = 0;
        *lidar_bytes = 0;
        *report = Report::new(config);
    }

    /// Tells the pose since the start, by the lidar that `lidar` reads: the settings' one.
    #[must_use]
    pub const fn odometry(config: AppConfig, lidar: P) -> Self {
        Self::with_task(&config, lidar, Odometry::new(config.odometry))
    }
}

impl<P: Protocol, E: Task<N>, const N: usize> Firmware<P, E, N> {
    /// Does this task with the lidar that `lidar` reads: the settings' one.
    #[must_use]
    pub const fn with_task(config: &AppConfig, lidar: P, task: E) -> Self {
        Self {
            pipeline: Pipeline::new(Late::Given(lidar), task),
            commands: link::Receiver::new(),
            piece: NO_PIECE,
            piece_bytes: 0,
            lidar_bytes: 0,
            report: Report::new(config),
        }
    }

    /// The frame to send once the board listens.
    pub fn ready(&mut self, reset: Reset) -> &[u8] {
        self.report.out.clear();
        self.send_ready(reset);
        &self.report.out
    }

    /// Apart, so that its memory is not on the stack of whoever takes commands.
    #[inline(never)]
    fn send_ready(&mut self, reset: Reset) {
        let name = self.report.lidar.map_or("", |model| model.name);
        let ready = Ready {
            version: VERSION,
            beams: N as u16,
            reset,
            mount: self.report.mount,
            lidar: name.try_into().unwrap_or_default(),
            task: E::KIND,
        };
        self.report.send(&Telemetry::Ready(ready));
    }

    /// Bytes that report the error of the last pose; empty if there was no new pose or nobody knows the true one.
    ///
    /// `truth` gives the true pose of the robot at a time of the lidar's clock (µs, wrapping).
    #[cfg(feature = "truth")]
    pub fn truth(&mut self, truth: impl FnOnce(u32) -> Option<Pose>) -> &[u8] {
        self.report.out.clear();
        if let Some(truth) = self.report.pose_us.take().and_then(truth) {
            self.report.send_truth(truth, self.pose());
        }
        &self.report.out
    }

    /// Says when the bytes given next came in (µs, wrapping).
    pub fn set_time(&mut self, now_us: u32) {
        self.report.set_time(now_us);
    }

    /// Takes the angle (0.01°) that looks forward by the lidar's own calibration, in place of its model's: gives what to send, for a
    /// recording must know it. The same again changes nothing.
    pub fn set_zero(&mut self, zero_cdeg: u16) -> &[u8] {
        self.report.out.clear();
        if self.report.zero_cdeg != Some(zero_cdeg) {
            // What came before was seen without it.
            self.end_piece();
            self.pipeline.lidar_mut().set_zero(zero_cdeg);
            self.report.zero_cdeg = Some(zero_cdeg);
            self.report.send_zero();
        }
        &self.report.out
    }

    /// What is due by the clock alone, lidar or not: gives what to send, most often nothing. To be called about every
    /// [`run::TICK_US`], after [`App::set_time`].
    pub fn tick(&mut self) -> &[u8] {
        self.report.tick();
        &self.report.out
    }

    /// Takes bytes of the lidar until there is something to send: gives the number of bytes taken and what to send,
    /// most often nothing. The rest of the bytes is to be given again.
    ///
    /// The byte that completes a revolution costs a match; a board must buffer what comes meanwhile.
    pub fn lidar(&mut self, bytes: &[u8]) -> (usize, &[u8]) {
        self.report.out.clear();
        self.send_rest_of_scan();
        let mut taken = 0;
        while let Some(rest) = bytes.get(taken..).filter(|rest| !rest.is_empty()) {
            if !self.report.out.is_empty() {
                break;
            }
            let room = self.room_in_piece();
            if !self.report.out.is_empty() {
                break;
            }
            let part = rest.get(..room).unwrap_or(rest);
            let count = self.pipeline.push_packet(part, &mut self.report);
            if self.report.record {
                let taken = part.get(..count).unwrap_or_default();
                let _ = self.piece.bytes.extend_from_slice(taken);
            }
            self.piece_bytes += count;
            taken += count;
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

    /// Sends the next beams of a packet that has more than one message holds, where they are asked for.
    fn send_rest_of_scan(&mut self) {
        if let (1.., Some(packet)) = (self.report.scan_at, self.pipeline.packet()) {
            self.report.send_piece(packet);
        }
    }

    /// Room for bytes that come in now, in the piece that came in together or in a new one: this sets the pipeline's
    /// clock, so that a recording of the pieces gives the same poses again.
    #[inline(never)]
    fn room_in_piece(&mut self) -> usize {
        let now_us = self.report.now_us;
        let waited_us = now_us.wrapping_sub(self.piece.time_us);
        let most = self.piece.bytes.capacity();
        if self.piece_bytes >= most || self.piece_bytes == 0 || waited_us > PIECE_US {
            self.end_piece();
        }
        most.saturating_sub(self.piece_bytes)
    }

    /// Sends the bytes that came in together, if they are recorded; what comes in from now on belongs to a new piece.
    #[inline(never)]
    fn end_piece(&mut self) {
        if self.report.record && !self.piece.bytes.is_empty() {
            self.report.send_raw(&self.piece);
        }
        self.piece.bytes.clear();
        self.piece_bytes = 0;
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
                if self.report.may_answer() {
                    // What is left of a recording comes too.
                    self.end_piece();
                    self.report.health_due = true;
                }
            }
            Some(Command::Ready) => {
                if self.report.may_answer() {
                    self.send_ready(Reset::Asked);
                }
            }
            Some(Command::Choose { lidar }) => {
                #[cfg(feature = "any-lidar")]
                {
                    let named = self.report.lidars.and_then(|named| named(lidar));
                    self.report.chosen = named.or(self.report.chosen);
                }
                #[cfg(not(feature = "any-lidar"))]
                let _ = lidar;
            }
            Some(Command::StartAt { x, y, theta }) => {
                let estimator = self.pipeline.tracker_mut().estimator_mut();
                estimator.start_at(Pose::new(x, y, theta));
            }
            Some(Command::Send {
                raw,
                scans,
                quality,
            }) => {
                self.end_piece();
                let was_recorded = core::mem::replace(&mut self.report.record, raw);
                if !was_recorded {
                    self.report.send_zero();
                }
                self.report.scans = scans;
                self.report.quality = quality;
            }
        }
        true
    }

    /// Does a part of what the task puts off, about so many bytes looked up; true where nothing is left to do before the
    /// next revolution. Only a search in a map puts something off.
    pub fn work(&mut self, budget: u32) -> bool {
        self.pipeline.tracker_mut().estimator_mut().work(budget)
    }

    /// Where the robot is; all zeros where nobody knows.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.task().pose().unwrap_or(Pose::IDENTITY)
    }

    fn task(&self) -> &E {
        self.pipeline.tracker().estimator()
    }

    /// What a [`supervisor::Supervisor`] watches.
    #[must_use]
    pub fn seen(&self) -> Seen {
        Seen {
            bytes: self.lidar_bytes.wrapping_add(self.report.bytes_lost),
            packets: self.pipeline.lidar().counters().packets,
            turns: self.report.turns,
            rpm: self.report.rpm,
            tells_rpm: self.report.tells_rpm,
            blind_turns: self.report.blind_turns,
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
            matches_refused: self.task().refused(),
            commands: commands.frames,
            command_errors: commands.errors,
            bytes_lost: self.report.bytes_lost,
            lidar: self.report.care.lidar,
            motor: self.report.care.motor,
            motor_restarts: self.report.care.motor_restarts,
        }
    }
}
