//! What the firmware sends.

use beamfix::{
    geometry,
    matching::{Match, MatchError},
    odometry::{Refusal, Step},
    scan::{Beam, Bearing, Mount},
};
use heapless::{String, Vec};
use serde::{Deserialize, Serialize};

/// Most bytes of a framed [`Pose`].
pub const POSE_FRAME: usize = 64;
/// Most bytes of a framed [`Health`].
pub const HEALTH_FRAME: usize = 56;
/// Most bytes of a framed [`Quality`].
pub const QUALITY_FRAME: usize = 80;
/// Most bytes of a [`Raw`]: an LD06's packet.
pub const RAW: usize = 47;
/// Most beams of a [`Piece`]: those of an LD06's packet.
pub const PIECE: usize = 12;
/// Most bytes of a model's name.
pub const NAME: usize = 24;

/// A message from the board. Whether a match was good stands in its pose; how good, in all numbers, in its quality.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Telemetry {
    /// Sent when bytes are listened for, and on request.
    Ready(Ready),
    /// After every revolution.
    Pose(Pose),
    /// After every 16th revolution, and on request.
    Health(Health),
    /// What the last pose cost: only from a board that counts instructions.
    Cost(Cost),
    /// Bytes of the lidar, where they are asked for.
    Raw(Raw),
    /// Beams of a packet, where they are asked for.
    Scan(Piece),
    /// Where the robot really is: only from a board that simulates its lidar.
    Truth(Truth),
    /// How good the match behind the last pose was, where it is asked for.
    Quality(Quality),
    /// A pose of the wheels as it came in, where a recording is asked for.
    Wheels(Wheels),
    /// A rate of the gyroscope as it came in, where a recording is asked for.
    Gyro(Gyro),
    /// The angle of the lidar's own zero, where it told one and a recording is asked for.
    Zero(Zero),
}

/// The firmware listens.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ready {
    /// Version of the messages; changes whenever one of them does.
    pub version: u8,
    /// Most beams a revolution may have.
    pub beams: u16,
    /// Why the board has started.
    pub reset: Reset,
    /// How the lidar sits on the robot: what the bearings of [`Piece`] are to be seen through.
    pub mount: Mounted,
    /// Name of the lidar's model.
    pub lidar: String<NAME>,
    /// What is done with it.
    pub task: Task,
}

/// What a board finds its poses by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Task {
    /// Since the start, by the scans themselves.
    Odometry,
    /// In a map that lies in its flash.
    Localization,
}

/// How the lidar sits on the robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Mounted {
    /// Lidar on the robot: forward, left (m) and the direction of its zero (rad).
    pub pose: [f32; 3],
    /// Whether it hangs head down: its bearings run the other way round.
    pub upside_down: bool,
}

impl Mounted {
    /// As the settings have it.
    #[must_use]
    pub const fn of(mount: &Mount) -> Self {
        let at = mount.robot_from_lidar;
        Self {
            pose: [at.x, at.y, at.theta],
            upside_down: mount.upside_down,
        }
    }

    /// The same for the settings.
    #[must_use]
    pub fn mount(&self) -> Mount {
        let [x, y, theta] = self.pose;
        Mount {
            robot_from_lidar: geometry::Pose::new(x, y, theta),
            upside_down: self.upside_down,
        }
    }
}

/// Why a board has started, or that it was only asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reset {
    /// It was switched on, or its supply broke down.
    Power,
    /// Nothing went on any more.
    Watchdog,
    /// By a pin, a debugger, or for a reason that the board cannot tell.
    Other,
    /// It has not started: it was asked what it is.
    Asked,
}

/// Where the robot is, and how well that is known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Counts poses from 0, wrapping: a gap is a pose lost on the way.
    pub sequence: u16,
    /// End of the revolution (µs, the lidar's clock, wrapping).
    pub time_us: u32,
    /// Forward, left (m) and heading (rad): since the start by odometry, in the map by localization.
    pub pose: [f32; 3],
    /// Covariance of `pose` in its frame: xx, xy, yy (m²), xθ, yθ (m·rad), θθ (rad²). By odometry since the start, growing
    /// with the way; by localization [`NOT_KNOWN`] where nothing has measured the pose.
    pub covariance: [f32; 6],
    /// What became of the match.
    pub verdict: Verdict,
    /// Correspondences that agree.
    pub inliers: u16,
    /// Beams with a return.
    pub beams: u16,
    /// Typical distance of an inlier from its line (m).
    pub residual: f32,
}

/// Covariance of a pose that nothing has measured: a kilometre, and more than half a turn.
pub const NOT_KNOWN: [f32; 6] = [1e6, 0.0, 1e6, 0.0, 0.0, 10.0];

/// What became of a match. All but the first two mean that the pose is only predicted, or less: see [`Verdict::Searching`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Verdict {
    /// The pose is measured.
    Measured,
    /// Measured, and this revolution is now what later ones are compared with.
    Keyframe,
    /// The first revolution: nothing to match against.
    First,
    /// The revolution has too few beams with a range.
    TooFewBeams,
    /// What it was matched against has too few surfaces.
    TooFewLines,
    /// Too few beams found a correspondence.
    TooFewCorrespondences,
    /// The geometry leaves the pose undetermined.
    Degenerate,
    /// The iteration limit came first.
    NotConverged,
    /// Two poses explain the revolution equally well.
    Ambiguous,
    /// The match is too far from the prediction to be believed.
    TooFar,
    /// For a reason that a version before 4 did not name.
    Refused,
    /// No pose that was tried reaches the least score.
    NothingFound,
    /// The best pose explains the revolution badly.
    Unlikely,
    /// The prediction is not a number, or farther away than the matcher can reckon.
    BadGuess,
    /// A setting is out of its range.
    BadConfig,
    /// In a map: predicted, or matched so that it may be another place.
    Doubtful,
    /// In a map: nobody knows, the pose is all zeros.
    Searching,
    /// In a map: one of several places, which the robot's motion will tell apart; the pose as while searching.
    Choosing,
}

impl Verdict {
    /// Of a step.
    #[must_use]
    pub fn of(step: &Step) -> Self {
        match &step.outcome {
            Ok(_) if step.keyframe => Self::Keyframe,
            Ok(_) => Self::Measured,
            Err(Refusal::First) => Self::First,
            Err(Refusal::TooFar { .. }) => Self::TooFar,
            Err(Refusal::NoMatch(error)) => match error {
                MatchError::TooFewBeams { .. } => Self::TooFewBeams,
                MatchError::TooFewLines { .. } => Self::TooFewLines,
                MatchError::TooFewCorrespondences { .. } => Self::TooFewCorrespondences,
                MatchError::Degenerate => Self::Degenerate,
                MatchError::NotConverged { .. } => Self::NotConverged,
                MatchError::Ambiguous { .. } => Self::Ambiguous,
                MatchError::NothingFound { .. } => Self::NothingFound,
                MatchError::Unlikely { .. } => Self::Unlikely,
                MatchError::BadGuess => Self::BadGuess,
                MatchError::BadConfig(_) => Self::BadConfig,
            },
        }
    }
}

/// How good a match was.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    /// Of the pose that it belongs to.
    pub sequence: u16,
    /// What became of the match.
    pub verdict: Verdict,
    /// What was found, or the two numbers that say why nothing was.
    pub found: Result<Found, [f32; 2]>,
}

/// What a match says about itself: see [`Match`], whose fields these are.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Found {
    /// How well the pose explains the scan: 1 where every beam agrees, 0 where none does.
    pub score: f32,
    /// Beams that agree with the reference.
    pub inliers: u16,
    /// Beams that met a part of the reference that could have answered.
    pub overlap: u16,
    /// Beams given.
    pub beams: u16,
    /// Root mean square distance of the inliers from the reference's lines (m).
    pub residual: f32,
    /// Of this match alone, in the keyframe's frame: xx, xy, yy (m²), xθ, yθ (m·rad), θθ (rad²).
    pub covariance: [f32; 6],
    /// The direction that the scene hardly determines, if there is one.
    pub weak: Option<Weak>,
    /// Passes over the beams, of all starts.
    pub iterations: u8,
    /// Starts tried.
    pub starts: u8,
    /// What the best pose elsewhere is worth over what this one is: near 1 where two places look the same.
    pub rival: f32,
}

/// A direction along which the pose is hardly measured, as along a corridor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Weak {
    /// Unit vector over forward, left and heading · `lever`, in the keyframe's frame.
    pub direction: [f32; 3],
    /// Standard deviation along it by the scan alone (m).
    pub sigma: f32,
    /// Distance that makes a heading comparable with a position (m): a motion of `d` metres along the direction turns by
    /// `d · direction[2] / lever` radians.
    pub lever: f32,
}

impl Quality {
    /// Of a step.
    #[must_use]
    pub fn of(sequence: u16, step: &Step) -> Self {
        Self {
            sequence,
            verdict: Verdict::of(step),
            found: match &step.outcome {
                Ok(found) => Ok(Found::of(found)),
                Err(refusal) => Err(numbers(refusal)),
            },
        }
    }
}

impl Found {
    fn of(found: &Match) -> Self {
        Self {
            score: found.score,
            inliers: found.inliers,
            overlap: found.overlap,
            beams: found.beams,
            residual: found.residual,
            covariance: found.covariance.to_array(),
            weak: found.degenerate_direction.map(|weak| Weak {
                direction: weak.direction,
                sigma: weak.sigma,
                lever: weak.lever,
            }),
            iterations: found.iterations,
            starts: found.starts.map_or(1, |starts| starts.tried),
            rival: found.starts.map_or(0.0, |starts| starts.rival),
        }
    }
}

/// Found and needed, m and rad, a score, a step, a ratio: what the refusal carries, 0 where it carries less.
fn numbers(refusal: &Refusal) -> [f32; 2] {
    match refusal {
        Refusal::TooFar { distance, rotation } => [*distance, *rotation],
        Refusal::NoMatch(
            MatchError::TooFewBeams { found, needed }
            | MatchError::TooFewLines { found, needed }
            | MatchError::TooFewCorrespondences { found, needed },
        ) => [f32::from(*found), f32::from(*needed)],
        Refusal::NoMatch(
            MatchError::Unlikely { score: one }
            | MatchError::NotConverged { step: one }
            | MatchError::Ambiguous { ratio: one },
        ) => [*one, 0.0],
        Refusal::NoMatch(MatchError::NothingFound { min_score }) => [0.0, *min_score],
        Refusal::First
        | Refusal::NoMatch(
            MatchError::BadGuess | MatchError::BadConfig(_) | MatchError::Degenerate,
        ) => [0.0; 2],
    }
}

/// How the parts are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Health {
    /// Lidar packets that passed their check.
    pub packets: u32,
    /// Lidar packets that failed it.
    pub check_errors: u32,
    /// Lidar bytes that belong to no packet.
    pub skipped_bytes: u32,
    /// Beams that a revolution had no room for.
    pub beams_refused: u32,
    /// Matches refused.
    pub matches_refused: u32,
    /// Commands understood.
    pub commands: u32,
    /// Command frames that were damaged.
    pub command_errors: u32,
    /// Bytes that came while the ring or the UART was full.
    pub bytes_lost: u32,
    /// What the lidar does.
    pub lidar: LidarState,
    /// What its motor does.
    pub motor: MotorState,
    /// Times that the motor was started again; stays at the most.
    pub motor_restarts: u8,
}

/// What the lidar does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum LidarState {
    /// Nobody watches over it.
    #[default]
    Unknown,
    /// Nothing comes: unplugged, or without power.
    Silent,
    /// Bytes come, but no packet: another lidar, or a bad line.
    Noise,
    /// Packets come, but no revolutions.
    Standing,
    /// All is well.
    Turning,
    /// Revolutions come, but hardly a beam of them has a range: covered, dirty, or in a void.
    Blind,
    /// It is being asked to start.
    Starting,
    /// It answers that it is defective.
    Defective,
}

/// What the lidar's motor does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum MotorState {
    /// It is not driven by the board.
    #[default]
    Free,
    /// On its way to its speed.
    SpinningUp,
    /// At its speed.
    Steady,
    /// Switched off for a moment, because it did not turn.
    Off,
}

/// Bytes of the lidar as they came in.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Raw {
    /// When the first of them was taken from the UART's buffer (µs, the board's clock, wrapping).
    pub time_us: u32,
    /// What came.
    pub bytes: Vec<u8, RAW>,
}

/// A pose of the wheels as it came in.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Wheels {
    /// When (µs, the board's clock, wrapping).
    pub time_us: u32,
    /// Forward, left (m) and heading (rad), in the wheels' own frame.
    pub pose: [f32; 3],
}

/// A rate of the gyroscope as it came in.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Gyro {
    /// When (µs, the board's clock, wrapping).
    pub time_us: u32,
    /// Counter-clockwise (rad/s).
    pub rate: f32,
}

/// The angle that looks forward by the lidar's own calibration: what comes from the lidar later is seen through it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Zero {
    /// When it is told (µs, the board's clock, wrapping).
    pub time_us: u32,
    /// In place of its model's (0.01°).
    pub zero_cdeg: u16,
}

/// Beams of a packet, in equal steps, as the lidar sees them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Piece {
    /// Which of them is the first of a revolution, if one is.
    pub turn_start: Option<u8>,
    /// Bearing of the first (1/65 536 turn, counter-clockwise).
    pub first: u16,
    /// Bearing of the last.
    pub last: u16,
    /// Ranges (mm), 0 for none.
    pub ranges_mm: Vec<u16, PIECE>,
}

impl Piece {
    /// The first [`PIECE`] of some beams, of which number `turn_start` is the first of a revolution.
    #[must_use]
    pub fn of(beams: impl Iterator<Item = Beam>, turn_start: Option<usize>) -> Self {
        let mut piece = Self {
            turn_start: turn_start.filter(|&k| k < PIECE).map(|k| k as u8),
            first: 0,
            last: 0,
            ranges_mm: Vec::new(),
        };
        for (k, beam) in beams.take(PIECE).enumerate() {
            if k == 0 {
                piece.first = beam.bearing.0;
            }
            piece.last = beam.bearing.0;
            let _ = piece.ranges_mm.push(beam.range.mm().unwrap_or(0));
        }
        piece
    }

    /// Bearing and range (mm, 0 for none) of each beam.
    pub fn beams(&self) -> impl Iterator<Item = (Bearing, u16)> + '_ {
        let span = i32::from(self.last.wrapping_sub(self.first) as i16);
        let steps = (self.ranges_mm.len() as i32 - 1).max(1);
        self.ranges_mm.iter().enumerate().map(move |(k, &mm)| {
            let turned = span * k as i32 / steps;
            (Bearing(self.first.wrapping_add(turned as u16)), mm)
        })
    }
}

/// Where a simulated robot really is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Of the pose that it belongs to.
    pub sequence: u16,
    /// Forward, left (m) and heading (rad) since the start.
    pub pose: [f32; 3],
}

/// Executed instructions of the last revolution, from its completion to its pose, and the stack's peak.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cost {
    /// Executed instructions.
    pub instructions: u32,
    /// Deepest stack since the start (bytes).
    pub stack_bytes: u32,
}
