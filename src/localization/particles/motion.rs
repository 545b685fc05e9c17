//! The motion model: what wheels tell of a motion, and how far off that may be.

use super::{belief::Mean, config::ParticleConfig};
use crate::{
    geometry::{EgoMotion, Pose},
    linalg::{Covariance, Sym3},
    math,
    scan::Mount,
};

/// A motion between two scans, and how far off it may be.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Motion {
    /// The second pose in the frame of the first one (m, rad).
    pub pose: Pose,
    /// Covariance of `pose`, along the axes of the same frame (m², m·rad, rad²).
    pub covariance: Covariance,
}

impl Motion {
    /// A motion by wheels (m, rad). Standard deviations of each coordinate and of the heading are `share` (0.2 for ordinary
    /// wheels) times the sum of its distance in metres and its rotation in radians, and 1 mm and 1 mrad more;
    /// [`Motion::unknown`] for a second where a number is not finite.
    #[must_use]
    pub fn by_wheels(pose: Pose, share: f32) -> Self {
        if !pose.is_finite() || !share.is_finite() {
            return Self::unknown(1.0);
        }
        // Odometry learns from its matches what it is that wheels tell wrongly. Particles do not: wheels of two sizes turn
        // while the robot drives, and a lidar before the axle, of which nobody told, moves while it turns.
        let (distance, rotation) = EgoMotion::wheel_errors(share, pose);
        let (turned, driven) = (share * math::abs(pose.theta), share * pose.distance());
        Self {
            pose,
            covariance: spread(distance + turned, rotation + driven),
        }
    }

    /// What a robot of which nothing is known may do in some seconds, at most ten: no motion, with standard deviations of 0.8 m
    /// and 1.5 rad for each second.
    #[must_use]
    pub fn unknown(seconds: f32) -> Self {
        let seconds = math::max(math::min(seconds, 10.0), 0.0);
        Self {
            pose: Pose::IDENTITY,
            covariance: spread(EgoMotion::WALKING * seconds, EgoMotion::TURNING * seconds),
        }
    }

    /// The same without wheels: nobody told how far the robot drove, and how far it turned only where a gyroscope did.
    pub(crate) fn without_wheels(&self, seconds: f32, is_rotation_told: bool) -> Self {
        let unknown = Self::unknown(seconds).covariance.0;
        let told = self.covariance.0;
        let tt = if is_rotation_told {
            told.tt
        } else {
            unknown.tt
        };
        Self {
            covariance: Covariance(Sym3 { tt, ..unknown }),
            ..*self
        }
    }

    /// The lidar's motion where this is the robot's.
    pub(crate) fn of_lidar(&self, mount: &Mount) -> Self {
        let own = Pose::new(0.0, 0.0, -mount.robot_from_lidar.theta);
        // A wrong heading moves the lidar about the robot, where this has come to.
        let end = self.pose * mount.robot_from_lidar;
        let (x, y) = (end.x - self.pose.x, end.y - self.pose.y);
        Self {
            pose: mount.lidar_motion(self.pose),
            covariance: self.covariance.transported(x, y).rotated(own),
        }
    }
}

fn spread(distance: f32, rotation: f32) -> Covariance {
    let square = distance * distance;
    Covariance(Sym3::diagonal(square, square, rotation * rotation))
}

/// Motions since the particles were moved last, as one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pending {
    /// In the lidar's frame when they were.
    pub motion: Pose,
    /// Of `motion`, in the same frame.
    pub covariance: Covariance,
    /// Sums of distances and rotations.
    distance: f32,
    rotation: f32,
}

impl Pending {
    pub const NONE: Self = Self {
        motion: Pose::IDENTITY,
        covariance: Covariance(Sym3::diagonal(0.0, 0.0, 0.0)),
        distance: 0.0,
        rotation: 0.0,
    };

    /// Takes the next motion.
    pub fn add(&mut self, motion: &Motion) {
        let next = self.motion * motion.pose;
        let (dx, dy) = (next.x - self.motion.x, next.y - self.motion.y);
        let added = motion.covariance.rotated(self.motion);
        self.covariance = self.covariance.transported(dx, dy).plus(&added);
        self.motion = next;
        self.distance += motion.pose.distance();
        self.rotation += math::abs(motion.pose.theta);
    }

    /// As if it led anywhere as near as `reach` (m), and turned points two metres away as far.
    pub fn widen(&mut self, reach: f32) {
        let half = 0.5 * reach;
        let (square, turned) = (reach * reach, half * half);
        let added = Covariance(Sym3::diagonal(square, square, turned));
        self.covariance = self.covariance.plus(&added);
    }

    /// Whether the lidar has moved enough to see something else, or may have.
    pub fn is_due(&self, config: &ParticleConfig) -> bool {
        let unknown = self.covariance.0;
        let (distance, rotation) = (config.min_distance, config.min_rotation);
        self.distance >= distance
            || self.rotation >= rotation
            || unknown.xx + unknown.yy >= distance * distance
            || unknown.tt >= rotation * rotation
    }

    /// Covariance of a mean after the motion.
    pub fn carried(&self, mean: &Mean) -> Covariance {
        let end = mean.pose * self.motion;
        let (dx, dy) = (end.x - mean.pose.x, end.y - mean.pose.y);
        let added = self.covariance.rotated(mean.pose);
        mean.covariance.transported(dx, dy).plus(&added)
    }
}
