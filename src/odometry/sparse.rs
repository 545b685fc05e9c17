//! Where a robot is by rangers of few wide beams and its wheels.
//!
//! 32 to 64 beams at once are too far apart to show surfaces. The robot's motion spreads them: the last scans together,
//! each from where it was found to be, are what the next one is matched against. As a match of so few beams says little, it
//! is weighed with the wheels.

mod gathered;

use super::{Refusal, Step, prior::farther};
use crate::{
    config::{self, ConfigError},
    geometry::{EgoMotion, Pose},
    linalg::{Covariance, Information, Sym3},
    matching::{
        Match,
        icp::{self, IcpConfig, Reference},
    },
    math,
    scan::{Mount, Scan, ScanPoint},
};
use gathered::{DIRECTIONS, Gathered};

/// Settings of [`SparseOdometry`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SparseConfig {
    /// How the ring of rangers sits on the robot. Default [`Mount::DEFAULT`].
    pub mount: Mount,
    /// Width of a beam (rad). Default 0.0982: eight zones in 45°.
    pub beam_width: f32,
    /// Standard deviation of the wheels' distance, as a share of it. Default 0.1.
    pub prior_error: f32,
    /// Standard deviation of the wheels' heading (rad) after each metre. Default 0.5: a wheel that slips for a moment turns the
    /// robot far more than any tyre.
    pub prior_rotation_error: f32,
    /// Factor by which the error of a match has a larger variance than its beams alone would make. Default 5: a beam is wide,
    /// and what errs in the scans kept errs in many matches.
    pub match_variance: f32,
    /// Farthest accepted distance of a match from where the wheels lead (m; twice as many radians). Default 0.2: scans follow
    /// each other fast.
    pub max_correction: f32,
    /// Settings of the matcher. Default [`IcpConfig::DEFAULT`] for 15 beams that agree, and a direction counts as
    /// degenerate below a share of 0.05: of so few beams two or three are chance.
    pub icp: IcpConfig,
}

impl SparseConfig {
    /// For a wheeled robot with a ring of VL53L5CX.
    pub const DEFAULT: Self = Self {
        mount: Mount::DEFAULT,
        beam_width: 0.0982,
        prior_error: 0.1,
        prior_rotation_error: 0.5,
        match_variance: 5.0,
        max_correction: 0.2,
        icp: IcpConfig {
            min_inliers: 15,
            min_constraint_share: 0.05,
            ..IcpConfig::DEFAULT
        },
    };

    /// The same, if every setting is within its range; usable in a `const`.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is not.
    pub const fn checked(self) -> Result<Self, ConfigError> {
        if let Err(error) = self.icp.checked() {
            return Err(error);
        }
        let checks = [
            config::within("beam_width", self.beam_width, 0.001, 0.5),
            config::within("prior_error", self.prior_error, 0.0, 1.0),
            config::within("prior_rotation_error", self.prior_rotation_error, 0.0, 3.15),
            config::within("match_variance", self.match_variance, 1.0, 1000.0),
            config::within("max_correction", self.max_correction, 0.01, 10.0),
        ];
        match config::all(&checks) {
            Ok(()) => Ok(self),
            Err(error) => Err(error),
        }
    }
}

impl Default for SparseConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Pose from scans of few wide beams and wheels, in fixed memory.
///
/// All beams of a scan are taken to be measured at its end, in the order of their bearings. N is the most beams of a scan,
/// K the scans that the next one is matched against, each from another place: 64 are two metres in the flat. Fewer are renewed
/// more often, and each time the heading drifts; through more, what wide beams show from afar is mixed with what they show from
/// near by. K·(4·N + 40) bytes and 10 KB.
///
/// A ring that sees all around follows a minute in a simulated flat within 15 cm and 3° in most drives; half a ring is 10 to 70 cm
/// off.
#[derive(Debug, Clone)]
pub struct SparseOdometry<const N: usize, const K: usize> {
    config: SparseConfig,
    gathered: Gathered<N, K>,
    reference: Reference<DIRECTIONS>,
    points: heapless::Vec<ScanPoint, N>,
    pose: Pose,
    /// How sure the pose is since the start, without what errs alike at one place.
    covariance: Covariance,
    /// How sure the pose is among those of the scans kept.
    relative: Covariance,
    /// The last motion, for a robot whose wheels have fallen silent.
    motion: Pose,
}

/// Scans kept before the first match: fewer show too little.
const FEWEST: usize = 4;
/// A scan is kept that was taken so far from the last one kept (m, rad): a fifth of a beam at 2 m.
const KEPT: (f32, f32) = (0.03, 0.02);
/// Least error of a motion (m, rad).
const LEAST: (f32, f32) = (5e-4, 5e-4);
/// Standard deviation of what is wrong alike in all matches of a whole ring at one place (m, rad), and gone at the next: which
/// of the scans kept show a surface, and from how far away. Matches do not average it out, and it does not add up.
const ALIKE: (f32, f32) = (0.015, 0.0175);
/// Of a pose that is known.
const EXACT: Covariance = Covariance(Sym3::diagonal(0.0, 0.0, 0.0));

impl<const N: usize, const K: usize> SparseOdometry<N, K> {
    /// At the origin, with nothing seen yet.
    #[must_use]
    pub const fn new(config: SparseConfig) -> Self {
        Self {
            config,
            gathered: Gathered::new(),
            reference: Reference::new(),
            points: heapless::Vec::new(),
            pose: Pose::IDENTITY,
            covariance: EXACT,
            relative: EXACT,
            motion: Pose::IDENTITY,
        }
    }

    /// Takes a scan in and says where the robot is.
    ///
    /// `ego` is the robot's motion since the last scan by its wheels and gyroscope; without wheels the last motion is believed
    /// to go on, and told to be uncertain. `keyframe` in the step says that the scan is kept for later ones.
    pub fn update(&mut self, scan: &Scan<N>, ego: EgoMotion) -> Step {
        self.predict(ego);
        if self.gathered.newest().is_none() && self.pose == Pose::IDENTITY {
            // The way begins at the first scan. How the next ones lie to it is not yet known.
            self.covariance = EXACT;
        }
        let width =
            math::round_to_i32(self.config.beam_width * (65_536.0 / core::f32::consts::TAU));
        let mount = self.config.mount;
        gathered::places(scan, width as u16, mount.upside_down, &mut self.points);
        let outcome = self.try_match();
        if let Ok(found) = &outcome {
            self.fuse(found);
        }
        let keyframe = self.gathered.newest().is_none_or(|last| {
            let moved = last.between(self.pose);
            moved.distance() > KEPT.0 || math::abs(moved.theta) > KEPT.1
        });
        if keyframe {
            self.gathered.keep(self.pose, self.covariance, &self.points);
        }
        let covariance = match outcome {
            Err(Refusal::First) => self.covariance,
            _ => self.covariance.plus(&self.alike()),
        };
        Step {
            pose: self.pose,
            covariance,
            outcome,
            keyframe,
        }
    }

    /// Covariance of what errs alike at one place. The smaller the share of the ring that sees something, the less of it
    /// cancels between one side and the other: by the square of that share, as drives with half a ring show.
    fn alike(&self) -> Covariance {
        let ring = core::f32::consts::TAU / self.config.beam_width;
        let share = (self.points.len() as f32 / ring).clamp(0.2, 1.0);
        let [place, heading] = [ALIKE.0, ALIKE.1].map(|whole| whole / (share * share));
        Covariance(Sym3::diagonal(
            place * place,
            place * place,
            heading * heading,
        ))
    }

    /// Moves the pose by wheels and gyroscope.
    fn predict(&mut self, ego: EgoMotion) {
        let config = &self.config;
        let wheels = ego.motion();
        let motion = wheels.unwrap_or(Pose {
            theta: ego.credible_rotation().unwrap_or(self.motion.theta),
            ..self.motion
        });
        let (distance, rotation) = (motion.distance(), math::abs(motion.theta));
        let along = match wheels {
            Some(_) => config.prior_error * distance + LEAST.0,
            // A robot stops within a few scans.
            None => distance + 0.02,
        };
        let turn = match (wheels, ego.credible_rotation()) {
            (_, Some(_)) => 0.02 * rotation + LEAST.1,
            (Some(_), None) => {
                config.prior_error * rotation + config.prior_rotation_error * distance + LEAST.1
            }
            (None, None) => rotation + 0.05,
        };
        let error = Covariance(Sym3::diagonal(along * along, along * along, turn * turn));
        let moved = self.pose * motion;
        let (x, y) = (moved.x - self.pose.x, moved.y - self.pose.y);
        self.covariance = self.covariance.transported(x, y).plus(&error);
        self.relative = self.relative.transported(x, y).plus(&error);
        (self.pose, self.motion) = (moved, motion);
    }

    /// The scan against those kept, seen from where it should be.
    #[inline(never)]
    fn try_match(&mut self) -> Result<Match, Refusal> {
        if self.gathered.len() < FEWEST {
            return Err(Refusal::First);
        }
        let mount = self.config.mount.robot_from_lidar;
        let surfaces = self.gathered.seen_from(self.pose * mount, mount);
        self.reference.assign(surfaces);
        let found = icp::align(
            &self.reference,
            &self.points,
            Pose::IDENTITY,
            &self.config.icp,
        )
        .map_err(Refusal::NoMatch)?;
        let limit = self.config.max_correction;
        match farther(Pose::IDENTITY, found.pose, (limit, 2.0 * limit)) {
            Some((distance, rotation)) => Err(Refusal::TooFar { distance, rotation }),
            None => Ok(found),
        }
    }

    /// Weighs a match with the prediction, each by what it is worth, and says how sure the pose is since the start.
    fn fuse(&mut self, found: &Match) {
        let mount = self.config.mount.robot_from_lidar;
        let lidar = self.pose * mount;
        let matched = lidar * found.pose * mount.inverse();
        let seen = (lidar * found.pose, matched);
        let of_match = Covariance(found.covariance.0.scaled(self.config.match_variance))
            .rotated(lidar)
            .transported(seen.1.x - seen.0.x, seen.1.y - seen.0.y);
        let (Some(before), Some(new)) = (self.relative.information(), of_match.information())
        else {
            return;
        };
        let Some(fused) = Information(before.0.plus(&new.0)).covariance() else {
            return;
        };
        let off = [
            matched.x - self.pose.x,
            matched.y - self.pose.y,
            math::wrap_angle(matched.theta - self.pose.theta),
        ];
        let [x, y, theta] = fused.0.times(new.0.times(off));
        self.pose = Pose::new(self.pose.x + x, self.pose.y + y, self.pose.theta + theta);
        self.relative = fused;
        if let Some((oldest, covariance)) = self.gathered.oldest() {
            self.covariance = covariance
                .transported(self.pose.x - oldest.x, self.pose.y - oldest.y)
                .plus(&fused);
        }
    }
}
