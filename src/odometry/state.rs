//! What the odometry remembers from scan to scan.

use super::{
    config::OdometryConfig, deskew::Deskewed, error_model::WheelErrors, lateness::Lateness,
    motion::Motion, step::Counters, tracking::Tracking,
};
use crate::{
    geometry::{Pose, Twist},
    keyframe::Keyframe,
    linalg::{Covariance, Sym3},
    matching::icp::Reference,
    scan::Points,
};

/// Pose from scans, in fixed memory.
///
/// 20·N + 500 bytes: a keyframe's lines and the current scan's points. N is the most beams of a revolution; beyond that
/// it does not change the result, which depends on [`OdometryConfig::directions`] alone.
#[derive(Debug, Clone)]
pub struct Odometry<const N: usize> {
    pub(super) config: OdometryConfig,
    pub(super) deskewed: Deskewed<N>,
    pub(super) keyframe: Keyframe<Reference<N>>,
    pub(super) pose: Pose,
    pub(super) covariance: Covariance,
    pub(super) motion: Motion,
    pub(super) tracking: Tracking,
    pub(super) wheel_errors: WheelErrors,
    pub(super) lateness: Lateness,
    /// End of the last scan (µs), where there was one.
    pub(super) end_us: Option<u32>,
    pub(super) refused_in_a_row: u8,
    pub(super) counters: Counters,
}

impl<const N: usize> Odometry<N> {
    /// All bytes zero: to be used after [`Odometry::restart`].
    pub(crate) const ZERO: Self = {
        let mut zero = Self::new(OdometryConfig::ZERO);
        zero.keyframe.reference = Reference::ZERO;
        zero.wheel_errors = WheelErrors::ZERO;
        zero
    };

    /// At the origin, with nothing seen yet.
    #[must_use]
    pub const fn new(config: OdometryConfig) -> Self {
        Self {
            config,
            deskewed: Deskewed::EMPTY,
            keyframe: Keyframe::at_origin(Reference::with_directions(config.directions)),
            pose: Pose::IDENTITY,
            covariance: Covariance(Sym3::diagonal(0.0, 0.0, 0.0)),
            motion: Motion::STANDING,
            tracking: Tracking::at(Pose::IDENTITY, 0.0),
            wheel_errors: WheelErrors::new(),
            lateness: Lateness::UNKNOWN,
            end_us: None,
            refused_in_a_row: 0,
            counters: Counters::ZERO,
        }
    }

    /// Begins anew with these settings, in its place: as [`Odometry::new`], without a second one on the stack.
    #[inline(never)]
    pub(crate) fn restart(&mut self, config: OdometryConfig) {
        // By name: a field more must be set here too.
        let Self {
            config: settings,
            deskewed,
            keyframe,
            pose,
            covariance,
            motion,
            tracking,
            wheel_errors,
            lateness,
            end_us,
            refused_in_a_row,
            counters,
        } = self;
        *settings = config;
        deskewed.clear();
        keyframe.reference.restart(config.directions);
        let origin = Keyframe::at_origin(());
        (keyframe.pose, keyframe.covariance) = (origin.pose, origin.covariance);
        (*pose, *covariance) = (origin.pose, origin.covariance);
        *motion = Motion::STANDING;
        *tracking = Tracking::at(Pose::IDENTITY, 0.0);
        *wheel_errors = WheelErrors::new();
        *lateness = Lateness::UNKNOWN;
        *end_us = None;
        *refused_in_a_row = 0;
        *counters = Counters::ZERO;
    }

    /// The robot at the end of the last scan, in the frame in which it started (m, rad).
    #[must_use]
    pub const fn pose(&self) -> Pose {
        self.pose
    }

    /// Covariance of the last pose (m², rad²) without the motion within the scan, which the next match corrects: its growth from one
    /// pose to a later one is what the motion between them is uncertain by. That of [`Step::covariance`](super::Step) may shrink.
    pub(crate) const fn settled_covariance(&self) -> &Covariance {
        &self.covariance
    }

    /// The robot's velocity during the last scan.
    #[must_use]
    pub const fn twist(&self) -> Twist {
        self.motion.twist
    }

    /// The last scan's points, in the lidar's frame at the scan's end; of a scan that became the keyframe, after they were
    /// moved towards the surfaces of the keyframe before and without what moved along with the robot.
    #[must_use]
    pub const fn points(&self) -> &Points<N> {
        &self.deskewed.points
    }

    /// Scans, refusals and keyframes since the start.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        self.counters
    }

    /// The same odometry as if it had come to `pose` with these counters before its first scan: what a month leaves behind, for
    /// the project's own tests.
    #[cfg(feature = "internals")]
    #[must_use]
    pub const fn after(mut self, pose: Pose, counters: Counters) -> Self {
        self.pose = pose;
        self.counters = counters;
        self
    }
}
