//! From steps to bytes to send.

#[cfg(feature = "truth")]
use beamfix::geometry::Pose;
use beamfix::{
    lidar::{Packet as _, ld06},
    odometry::{Odometry, Step},
    pipeline::{Revolution, Sink},
};
use heapless::Vec;

#[cfg(feature = "mavlink")]
use crate::mavlink;
#[cfg(feature = "truth")]
use crate::telemetry::Truth;
use crate::{
    AppConfig, Output, link,
    supervisor::Care,
    telemetry::{self, Gyro, Mounted, Piece, Quality, Raw, Telemetry, Verdict, Wheels},
    text,
};

/// Revolutions between two health messages.
const HEALTH_EVERY: u16 = 16;
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
    /// The motor's speed by the last good packet.
    pub speed_deg_per_s: u16,
    pub sequence: u16,
    pub bytes_lost: u32,
    pub care: Care,
    pub health_due: bool,
    pub mount: Mounted,
    /// Questions answered since the last revolution or tick.
    answers: u8,
    /// Revolutions in a row with too few beams to be matched.
    pub blind_turns: u8,
    #[cfg(feature = "mavlink")]
    link: mavlink::Link,
    #[cfg(feature = "mavlink")]
    config: AppConfig,
    pub out: Vec<u8, OUT>,
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
            speed_deg_per_s: 0,
            sequence: 0,
            health_due: false,
            mount: Mounted::of(&config.odometry.points.mount),
            answers: 0,
            blind_turns: 0,
            #[cfg(feature = "mavlink")]
            link: mavlink::Link::new(),
            #[cfg(feature = "mavlink")]
            config: *config,
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
    pub fn step<const N: usize>(&mut self, revolution: &Revolution<'_, Odometry<N>, N>) {
        let time_us = revolution.scan.end_us();
        let pose = frame(self.sequence, time_us, revolution.step);
        self.sequence = self.sequence.wrapping_add(1);
        self.answers = 0;
        self.blind_turns = match pose.verdict {
            Verdict::First | Verdict::TooFewBeams => self.blind_turns.saturating_add(1),
            _ => 0,
        };
        self.health_due |= self.sequence.is_multiple_of(HEALTH_EVERY);
        self.send(&Telemetry::Pose(pose));
        if self.quality {
            self.send_quality(pose.sequence, revolution.step);
        }
        #[cfg(feature = "truth")]
        {
            self.pose_us = Some(time_us);
        }
        #[cfg(feature = "mavlink")]
        if self.output == Output::Mavlink {
            let told = mavlink::Told {
                pose,
                twist: revolution.estimator.twist(),
                resets: revolution.estimator.counters().lost as u8,
                autopilot: self.config.autopilot,
            };
            let limits = mavlink::Limits::of(&self.config);
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

    #[inline(never)]
    fn send_quality(&mut self, sequence: u16, step: &Step) {
        self.send(&Telemetry::Quality(Quality::of(sequence, step)));
    }

    #[inline(never)]
    fn send_piece(&mut self, packet: &ld06::Packet) {
        let start = packet.revolution_start();
        self.send(&Telemetry::Scan(Piece::of(packet, start)));
    }

    #[cfg(feature = "truth")]
    #[inline(never)]
    pub fn send_truth(&mut self, truth: Pose, pose: Pose) {
        let sequence = self.sequence.wrapping_sub(1);
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
