//! From steps to bytes to send.

#[cfg(feature = "truth")]
use beamfix::geometry::Pose;
#[cfg(feature = "mavlink")]
use beamfix::pipeline::Late;
use beamfix::{
    lidar::{Model, Packet},
    pipeline::{Revolution, Sink},
};
use heapless::Vec;

#[cfg(feature = "mavlink")]
use crate::mavlink;
#[cfg(feature = "truth")]
use crate::telemetry::Truth;
#[cfg(feature = "text")]
use crate::text;
use crate::{
    AppConfig, Output, link,
    supervisor::Care,
    task::{Task, Told},
    telemetry::{self, Gyro, Mounted, PIECE, Piece, Raw, Telemetry, Wheels, Zero},
};

/// Revolutions between two health messages.
const HEALTH_EVERY: u32 = 16;
/// Questions that are answered between two revolutions or ticks: an answer is eleven times as long as its question, so that a
/// flood of them would fill the line and leave no time for the lidar.
const ANSWERS: u8 = 2;

/// Most bytes that one call gives.
///
/// A packet makes a pose, its quality and a piece of the scan at most; health waits for room.
const OUT: usize = if cfg!(feature = "mavlink") { 448 } else { 192 };

/// What is sent, what it must tell besides steps, and the bytes of the call at hand.
pub(crate) struct Report {
    pub output: Output,
    pub record: bool,
    pub scans: bool,
    pub quality: bool,
    pub now_us: u32,
    /// When the last pose was, until its error was told.
    #[cfg(feature = "truth")]
    pub pose_us: Option<u32>,
    /// The motor's speed: by the last good packet, where packets tell it, else by the time of the last revolution.
    pub rpm: f32,
    pub tells_rpm: bool,
    /// End of the last revolution.
    end_us: u32,
    /// Revolutions that went through the matcher; wraps.
    pub turns: u32,
    /// The beam of the packet at hand that is to be sent next; 0 for none.
    pub scan_at: u16,
    pub bytes_lost: u32,
    pub care: Care,
    pub health_due: bool,
    pub mount: Mounted,
    /// Its model.
    pub lidar: Option<&'static Model>,
    /// The angle of its own zero (0.01°), where it told one.
    pub zero_cdeg: Option<u16>,
    /// Finds a lidar's model by its name, on a board that has a choice.
    #[cfg(feature = "any-lidar")]
    pub lidars: Option<fn(&str) -> Option<&'static Model>>,
    /// Which one a command has chosen.
    #[cfg(feature = "any-lidar")]
    pub chosen: Option<&'static Model>,
    /// Questions answered since the last revolution or tick.
    answers: u8,
    /// Revolutions in a row with too few beams to be matched.
    pub blind_turns: u8,
    #[cfg(feature = "mavlink")]
    link: mavlink::Link,
    #[cfg(feature = "mavlink")]
    config: Late<AppConfig>,
    pub out: Vec<u8, OUT>,
}

impl<P: Packet, E: Task<N>, const N: usize> Sink<P, E, N> for Report {
    fn revolution(&mut self, revolution: Revolution<'_, E, N>) {
        self.step(&revolution);
    }

    fn packet(&mut self, packet: &P) {
        if let Some(rpm) = packet.speed_rpm() {
            (self.rpm, self.tells_rpm) = (rpm, true);
        }
        self.scan_at = 0;
        if self.scans {
            self.send_piece(packet);
        }
    }
}

impl Report {
    /// All bytes zero: no settings yet.
    pub const ZERO: Self = {
        let mut zero = Self::new(&AppConfig::DEFAULT);
        zero.lidar = None;
        #[cfg(feature = "mavlink")]
        {
            zero.config = Late::Missing;
        }
        zero
    };

    /// With nothing sent yet.
    pub const fn new(config: &AppConfig) -> Self {
        Self {
            output: config.output,
            record: config.record,
            scans: config.scans,
            quality: config.quality,
            now_us: 0,
            #[cfg(feature = "truth")]
            pose_us: None,
            rpm: 0.0,
            tells_rpm: false,
            end_us: 0,
            turns: 0,
            scan_at: 0,
            health_due: false,
            mount: Mounted::of(&config.odometry.points.mount),
            lidar: Some(config.lidar),
            zero_cdeg: None,
            #[cfg(feature = "any-lidar")]
            lidars: None,
            #[cfg(feature = "any-lidar")]
            chosen: None,
            answers: 0,
            blind_turns: 0,
            #[cfg(feature = "mavlink")]
            link: mavlink::Link::new(),
            #[cfg(feature = "mavlink")]
            config: Late::Given(*config),
            bytes_lost: 0,
            care: Care::NONE,
            out: Vec::new(),
        }
    }

    /// Says what the board's clock shows (µs, wrapping).
    pub fn set_time(&mut self, now_us: u32) {
        self.now_us = now_us;
        #[cfg(feature = "mavlink")]
        self.link.set_time(now_us);
    }

    /// What is due by the clock alone.
    pub fn tick(&mut self) {
        self.out.clear();
        self.answers = 0;
        #[cfg(feature = "mavlink")]
        if self.output == Output::Mavlink {
            self.link.heartbeat_when_due(self.care.lidar, &mut self.out);
        }
    }

    /// Whether one more question may be answered now.
    pub fn may_answer(&mut self) -> bool {
        self.answers = self.answers.saturating_add(1);
        self.answers <= ANSWERS
    }

    /// Apart, so that its memory is not on the stack during the match.
    #[inline(never)]
    pub fn step<E: Task<N>, const N: usize>(&mut self, revolution: &Revolution<'_, E, N>) {
        let time_us = revolution.scan.end_us();
        let pose = frame(self.turns as u16, time_us, &E::told(revolution.step));
        if !self.tells_rpm {
            self.rpm = 60e6 / time_us.wrapping_sub(self.end_us) as f32;
        }
        self.end_us = time_us;
        self.turns = self.turns.wrapping_add(1);
        self.answers = 0;
        self.blind_turns = match E::is_blind(revolution.step, revolution.scan) {
            true => self.blind_turns.saturating_add(1),
            false => 0,
        };
        self.health_due |= self.turns.is_multiple_of(HEALTH_EVERY);
        self.send(&Telemetry::Pose(pose));
        if self.quality {
            self.send_quality::<E, N>(pose.sequence, revolution.step);
        }
        #[cfg(feature = "truth")]
        {
            self.pose_us = Some(time_us);
        }
        #[cfg(feature = "mavlink")]
        if let (Output::Mavlink, Late::Given(config)) = (self.output, &self.config) {
            let told = mavlink::Told {
                pose,
                twist: revolution.estimator.twist(),
                resets: revolution.estimator.lost() as u8,
                autopilot: config.autopilot,
            };
            let limits = mavlink::Limits::of(config);
            self.link
                .append(&told, revolution.scan, &limits, &mut self.out);
        }
    }

    #[inline(never)]
    pub fn send_raw(&mut self, raw: &Raw) {
        self.send(&Telemetry::Raw(raw.clone()));
    }

    /// Sends a pose of the wheels back with its time, where a recording wants it.
    #[inline(never)]
    pub fn send_wheels(&mut self, pose: [f32; 3]) {
        if self.record {
            let time_us = self.now_us;
            self.send(&Telemetry::Wheels(Wheels { time_us, pose }));
        }
    }

    /// Sends a rate of the gyroscope back with its time, where a recording wants it.
    #[inline(never)]
    pub fn send_gyro(&mut self, rate: f32) {
        if self.record {
            let time_us = self.now_us;
            self.send(&Telemetry::Gyro(Gyro { time_us, rate }));
        }
    }

    /// Sends the angle of the lidar's own zero, where it told one and a recording wants it.
    #[inline(never)]
    pub fn send_zero(&mut self) {
        if let (true, Some(zero_cdeg)) = (self.record, self.zero_cdeg) {
            let time_us = self.now_us;
            self.send(&Telemetry::Zero(Zero { time_us, zero_cdeg }));
        }
    }

    #[inline(never)]
    fn send_quality<E: Task<N>, const N: usize>(&mut self, sequence: u16, step: &E::Step) {
        if let Some(quality) = E::quality(sequence, step) {
            self.send(&Telemetry::Quality(quality));
        }
    }

    /// Sends the next beams of a packet; the rest waits for the next call.
    #[inline(never)]
    pub fn send_piece(&mut self, packet: &impl Packet) {
        let at = usize::from(self.scan_at);
        let start = packet.revolution_start();
        let start = start.and_then(|start| start.checked_sub(at));
        let mut beams = packet.beams().skip(at);
        let piece = Piece::of(beams.by_ref().take(PIECE), start);
        self.scan_at = match beams.next() {
            Some(_) => self.scan_at + PIECE as u16,
            None => 0,
        };
        self.send(&Telemetry::Scan(piece));
    }

    #[cfg(feature = "truth")]
    #[inline(never)]
    pub fn send_truth(&mut self, truth: Pose, pose: Pose) {
        let sequence = (self.turns as u16).wrapping_sub(1);
        let message = Truth {
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
    pub fn send(&mut self, message: &Telemetry) {
        match self.output {
            Output::Frames => {
                let _ = link::append(message, &mut self.out);
            }
            #[cfg(feature = "text")]
            Output::Text => text::append(message, &mut self.out),
            #[cfg(feature = "mavlink")]
            Output::Mavlink => {
                // The board listens: the first heartbeat says so.
                if let Telemetry::Ready(_) = message {
                    self.link.heartbeat_when_due(self.care.lidar, &mut self.out);
                }
            }
        }
    }
}

/// A step as it is sent.
fn frame(sequence: u16, time_us: u32, told: &Told) -> telemetry::Pose {
    telemetry::Pose {
        sequence,
        time_us,
        pose: [told.pose.x, told.pose.y, told.pose.theta],
        covariance: told.covariance,
        verdict: told.verdict,
        inliers: told.inliers,
        beams: told.beams,
        residual: told.residual,
    }
}
