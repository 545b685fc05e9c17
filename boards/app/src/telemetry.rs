//! What the firmware sends.

use serde::{Deserialize, Serialize};

/// Most bytes of a framed [`Pose`].
pub const POSE_FRAME: usize = 64;

/// A message from the board.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Telemetry {
    /// Sent once, when bytes are listened for.
    Ready(Ready),
    /// After every revolution.
    Pose(Pose),
    /// After every 16th revolution, and by itself where nothing else is left to say.
    Health(Health),
    /// What the last pose cost: only from a board that counts instructions.
    Cost(Cost),
}

/// The firmware listens.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ready {
    /// Version of the messages; changes whenever one of them does.
    pub version: u8,
    /// Most beams a revolution may have.
    pub beams: u16,
}

/// Where the robot is, and how well that is known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Counts poses from 0, wrapping: a gap is a pose lost on the way.
    pub sequence: u16,
    /// End of the revolution (µs, the lidar's clock, wrapping).
    pub time_us: u32,
    /// Forward, left (m) and heading (rad) since the start.
    pub pose: [f32; 3],
    /// Covariance of one match: xx, xy, yy (m²), xθ, yθ (m·rad), θθ (rad²).
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

/// What became of a match. All but the first two mean that the pose is only predicted.
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
    /// For a reason that this version does not name.
    Refused,
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
    /// Bytes that came while the ring was full.
    pub bytes_lost: u32,
}

/// Executed instructions of the last revolution, from its completion to its pose, and the stack's peak.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cost {
    /// Executed instructions.
    pub instructions: u32,
    /// Deepest stack since the start (bytes).
    pub stack_bytes: u32,
}
