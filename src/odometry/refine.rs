//! What a match of a scan makes of the robot's pose and velocity: the scan is deskewed by what the match tells, and matched
//! again where that differs.

use super::{
    error_model,
    motion::{Source, Times},
    prior::Prior,
    state::Odometry,
};
use crate::{
    geometry::{Pose, Twist},
    linalg::Covariance,
    matching::Match,
    math,
    scan::Scan,
};

impl<const N: usize> Odometry<N> {
    /// Fuses match and prior, and places the robot there. If the match implies another velocity than the scan was deskewed
    /// with, deskews and matches again first. Gives how much more of the rotation since the last scan (rad) the wheels missed than of
    /// the one before; 0 without wheels.
    #[inline(never)]
    pub(super) fn refine(
        &mut self,
        scan: &Scan<N>,
        (found, expected): (&mut Match, Twist),
        prior: &Prior,
        times: Times,
    ) -> f32 {
        let back = -0.5 * times.duration;
        let (end, _) = self.robot_pose(found);
        self.deskewed.pose = end;
        let mut middle = end * expected.displacement(back);
        let retried = prior.wheel_twist.is_none() && expected != prior.twist;
        let sudden = prior.wheel_twist.is_none() && (retried || self.refused_in_a_row > 0);
        let mut rate = None;
        let mut during = if sudden {
            // From the last scan's middle no velocity can be measured: that one's place was only a guess, or the velocity
            // has changed since, as the scan itself tells better.
            expected
        } else {
            let measured = self.motion.during(middle, prior.wheel_twist, times);
            match prior.turn_rate {
                Some(omega) if prior.wheel_twist.is_none() => Twist { omega, ..measured },
                _ => {
                    rate = Some(measured.omega);
                    measured
                }
            }
        };
        let ahead = rate
            .filter(|_| prior.wheel_twist.is_none())
            .and_then(|rate| self.motion.lead(rate, found.covariance.0.tt, times));
        self.motion.note_rate(rate);
        let mut leads = false;
        if let Some(ahead) = ahead {
            // A rotation that goes on changing as it did, if that explains as much.
            let leading = Twist {
                omega: during.omega + ahead,
                ..during
            };
            let least = found.score;
            leads = self.match_again(scan, (found, leading), (middle, least), prior);
            if leads {
                during = leading;
                middle = self.deskewed.pose * during.displacement(back);
            }
        }
        if differs(
            self.deskewed.twist.displacement(times.duration),
            during.displacement(times.duration),
        ) && self.match_again(scan, (found, during), (middle, 0.0), prior)
        {
            middle = self.deskewed.pose * during.displacement(back);
        }
        let unskewed = if leads {
            Pose::IDENTITY
        } else {
            self.motion.unskewed(during, prior.source, times)
        };
        let more = prior.wheel_twist.map_or(0.0, |wheels| {
            let missed = self.motion.missed(middle, wheels, times).theta;
            let change = (during.omega - self.motion.twist.omega) * times.duration;
            let unforeseen = error_model::unforeseen(times.duration).0.tt;
            self.lateness.push(missed, change, unforeseen)
        });
        self.place(found, (middle, during), unskewed, (prior, times));
        more
    }

    /// Deskews the scan with another velocity and matches it again, with the robot at `middle` in its middle; whether that
    /// match explains as much as `least`, and is taken.
    #[inline(never)]
    fn match_again(
        &mut self,
        scan: &Scan<N>,
        (found, during): (&mut Match, Twist),
        (middle, least): (Pose, f32),
        prior: &Prior,
    ) -> bool {
        self.deskewed.assign(scan, during, &self.config.points);
        self.deskewed.pose = middle * during.displacement(0.5 * scan.duration());
        match self.try_match(self.deskewed.pose, prior, self.rivals()) {
            Ok(again) if again.score >= least => {
                *found = again;
                (self.deskewed.pose, _) = self.robot_pose(found);
                true
            }
            _ => false,
        }
    }

    /// Puts the robot where its match and its prior say: it was at `middle` in the middle of the scan, and moved as `during`
    /// says, `unskewed` more at its end. Apart: so that its memory is not on the stack during a match.
    #[inline(never)]
    fn place(
        &mut self,
        found: &Match,
        (middle, during): (Pose, Twist),
        unskewed: Pose,
        (prior, times): (&Prior, Times),
    ) {
        let half = during.displacement(0.5 * times.duration);
        let (_, of_match) = self.robot_pose(found);
        let matched = middle * half * unskewed;
        let (pose, is_sure) = self.fuse(matched, &of_match, found, prior, times);
        // The points are seen from where fusion has moved the robot to.
        self.deskewed.pose = pose * matched.between(self.deskewed.pose);
        self.learn((matched, is_sure), &of_match, prior, found);
        let end = pose * unskewed.inverse();
        self.motion.advance(end, during, prior.wheel_twist, times);
        self.pose = pose;
        self.covariance = self
            .keyframe
            .covariance_at(pose, &self.tracking.covariance());
    }

    /// Learns from a match how good the wheels are.
    fn learn(
        &mut self,
        (matched, is_sure): (Pose, bool),
        of_match: &Covariance,
        prior: &Prior,
        found: &Match,
    ) {
        if prior.source == Source::Wheels && is_sure {
            let off = self.tracking.wheels.between(matched);
            self.wheel_errors
                .learn(off, self.config.prior_error, prior.motion, of_match);
        } else {
            self.wheel_errors.interrupt();
        }
        if found.degenerate_direction.is_none() {
            self.tracking.coasting = 0.0;
        }
    }
}

/// Whether two motions skew a scan differently: by more than 1 cm or 0.3°.
fn differs(a: Pose, b: Pose) -> bool {
    let off = a.between(b);
    off.distance() > 0.01 || math::abs(off.theta) > 0.005
}
