//! Telemetry as lines for a terminal: in integers, so that no formatting code and no panic comes with it.

use beamfix::math::{round_to_i32, sqrt};
use heapless::Vec;

use crate::telemetry::{LidarState, MotorState, Telemetry, Verdict};

/// Appends `message` as a line, or nothing where there is no room for it or no line for it.
#[inline(never)]
pub fn append<const N: usize>(message: &Telemetry, out: &mut Vec<u8, N>) {
    let start = out.len();
    let written = match message {
        Telemetry::Ready(ready) => Line(out)
            .word("beamfix listens, most beams ")
            .integer(ready.beams.into()),
        Telemetry::Pose(pose) => {
            let [x, y, theta] = pose.pose;
            let [xx, _, yy, _, _, tt] = pose.covariance;
            Line(out)
                .pose(x, y, theta)
                .word("  +- ")
                .decimal(1000.0 * sqrt(xx), 1)
                .word(" ")
                .decimal(1000.0 * sqrt(yy), 1)
                .word(" mm ")
                .decimal(sqrt(tt).to_degrees(), 2)
                .word(" deg  ")
                .word(verdict(pose.verdict))
                .word(" ")
                .integer(pose.inliers.into())
                .word("/")
                .integer(pose.beams.into())
        }
        Telemetry::Health(health) => Line(out)
            .word("lidar ")
            .word(lidar(health.lidar))
            .word(", motor ")
            .word(motor(health.motor))
            .word(": packets ")
            .integer(health.packets)
            .word(", damaged ")
            .integer(health.check_errors)
            .word(", lost bytes ")
            .integer(health.bytes_lost)
            .word(", refused beams ")
            .integer(health.beams_refused)
            .word(" matches ")
            .integer(health.matches_refused),
        Telemetry::Truth(truth) => {
            let [x, y, theta] = truth.pose;
            Line(out).word("  really ").pose(x, y, theta)
        }
        Telemetry::Cost(_)
        | Telemetry::Quality(_)
        | Telemetry::Raw(_)
        | Telemetry::Scan(_)
        | Telemetry::Wheels(_)
        | Telemetry::Gyro(_)
        | Telemetry::Zero(_) => {
            return;
        }
    };
    if written.word("\r\n").is_cut() {
        out.truncate(start);
    }
}

/// Appends how far one pose is from another as a line.
pub fn append_error<const N: usize>(mm: f32, degrees: f32, out: &mut Vec<u8, N>) {
    Line(out)
        .word("  error ")
        .decimal(mm, 1)
        .word(" mm ")
        .decimal(degrees, 2)
        .word(" deg\r\n");
}

/// A line in progress.
struct Line<'a, const N: usize>(&'a mut Vec<u8, N>);

impl<const N: usize> Line<'_, N> {
    #[inline(never)]
    fn word(self, word: &str) -> Self {
        for &byte in word.as_bytes() {
            let _ = self.0.push(byte);
        }
        self
    }

    #[inline(never)]
    fn integer(self, value: u32) -> Self {
        let (mut digits, mut rest) = (Vec::<u8, 10>::new(), value);
        loop {
            let _ = digits.push(b'0' + (rest % 10) as u8);
            rest /= 10;
            if rest == 0 {
                break;
            }
        }
        for &digit in digits.iter().rev() {
            let _ = self.0.push(digit);
        }
        self
    }

    #[inline(never)]
    /// With so many decimals, at most 3; what does not fit into 31 bits then is held at the largest.
    fn decimal(self, value: f32, decimals: u8) -> Self {
        let scale = [1, 10, 100, 1000]
            .get(usize::from(decimals))
            .copied()
            .unwrap_or(1);
        let scaled = round_to_i32(value * scale as f32);
        let magnitude = scaled.unsigned_abs();
        let line = self.word(if scaled < 0 { "-" } else { "" });
        let (whole, mut rest) = (magnitude / scale, magnitude % scale);
        let mut line = line.integer(whole).word(".");
        let mut place = scale / 10;
        while place > 0 {
            line = line.integer(rest / place);
            rest %= place;
            place /= 10;
        }
        line
    }

    #[inline(never)]
    fn pose(self, x: f32, y: f32, theta: f32) -> Self {
        self.word("x ")
            .decimal(x, 3)
            .word(" m, y ")
            .decimal(y, 3)
            .word(" m, heading ")
            .decimal(theta.to_degrees(), 2)
            .word(" deg")
    }

    /// The buffer is full: something may be missing.
    fn is_cut(&self) -> bool {
        self.0.is_full()
    }
}

fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Measured => "measured",
        Verdict::Keyframe => "keyframe",
        Verdict::First => "first",
        Verdict::TooFewBeams => "too few beams",
        Verdict::TooFewLines => "too few lines",
        Verdict::TooFewCorrespondences => "too few correspondences",
        Verdict::Degenerate => "degenerate",
        Verdict::NotConverged => "not converged",
        Verdict::Ambiguous => "ambiguous",
        Verdict::TooFar => "too far",
        Verdict::Refused => "refused",
        Verdict::NothingFound => "nothing found",
        Verdict::Unlikely => "unlikely",
        Verdict::BadGuess => "bad guess",
        Verdict::BadConfig => "bad setting",
        Verdict::Doubtful => "doubtful",
        Verdict::Searching => "searching",
        Verdict::Choosing => "choosing",
    }
}

fn lidar(state: LidarState) -> &'static str {
    match state {
        LidarState::Unknown => "not watched",
        LidarState::Silent => "silent",
        LidarState::Noise => "sends noise",
        LidarState::Standing => "stands",
        LidarState::Turning => "turns",
        LidarState::Blind => "is blind",
        LidarState::Starting => "is being started",
        LidarState::Defective => "is defective",
    }
}

fn motor(state: MotorState) -> &'static str {
    match state {
        MotorState::Free => "free",
        MotorState::SpinningUp => "spins up",
        MotorState::Steady => "steady",
        MotorState::Off => "off",
    }
}
