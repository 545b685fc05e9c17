//! How far off a prior may be: an error model for each source, scaled by how well it did lately.

use core::f32::consts::FRAC_1_PI;

use super::motion::Source;
use crate::{
    geometry::{EgoMotion, Pose, Twist},
    linalg::{Covariance, Sym3},
    math,
};

/// Standard deviation of a robot's unforeseen acceleration (m/s², rad/s²): an ordinary robot brakes and turns in within
/// twice of these.
const ACCELERATION: (f32, f32) = (3.0, 4.0);
/// Standard deviation of a heading of which nothing is known (rad): π/√3.
pub(super) const ANY_HEADING: f32 = 1.8;

/// What every prediction adds at least, so that covariances stay invertible.
pub(super) const FLOOR: Sym3 = Sym3::diagonal(1e-8, 1e-8, 1e-8);

/// Covariance of a pose predicted by a velocity that was measured `seconds` ago: the unforeseen acceleration has acted
/// that long, up to what an unknown velocity would do (m², rad²).
fn coasting(seconds: f32) -> (f32, f32) {
    let half = 0.5 * seconds * seconds;
    let distance = math::min(ACCELERATION.0 * half, 2.0 * EgoMotion::WALKING * seconds);
    let rotation = math::min(ACCELERATION.1 * half, ANY_HEADING);
    (distance * distance, rotation * rotation)
}

/// What a velocity's extrapolation adds from `before` to `after` (s, since the velocity was measured) to the covariance.
pub(super) fn coasting_between(before: f32, after: f32) -> Covariance {
    let ((d0, r0), (d1, r1)) = (coasting(before), coasting(after));
    Covariance(Sym3::diagonal(d1 - d0, d1 - d0, r1 - r0))
}

/// Standard deviation of a rate of turn (rad/s) that was measured `seconds` ago.
pub(super) fn turn_rate_after(seconds: f32) -> f32 {
    math::min(ACCELERATION.1 * seconds, EgoMotion::TURNING)
}

/// Covariance of the pose at a scan's end for what a match cannot see: the robot may have begun to accelerate since the
/// middle of the scan, which took `duration` (s).
pub(super) fn unforeseen(duration: f32) -> Covariance {
    let eighth = duration * duration / 8.0;
    let (distance, rotation) = (ACCELERATION.0 * eighth, ACCELERATION.1 * eighth);
    spread(distance, rotation)
}

/// Covariance of the pose at a scan's end where the velocity has changed by `change` since the scan before: one velocity
/// deskews all `duration` (s) of it. `late` is the squared share of a change that wheels miss.
///
/// A constant acceleration is undone to first order. With wheels, which tell the mean velocity of the scan, a change that sets in at
/// any moment u of it (0 to 1) moves the end by u/2 of the change that is seen, less the twelfth that is undone: the mean square
/// over u, each weighed by the square of the change that is seen, (1 - u)², is 1/90. Without wheels, or with wheels that tell of it a
/// scan later, half of the change is left. What the noise of three matches (each of covariance `of_match`) changes the velocity
/// by on the mean is left out. A scan bent by a rotation is moved as
/// well: of beams all around that are turned by -θ to θ from the first to the last, places `range` (m) away move by
/// `range`·θ/π on the mean. With wheels, whose mean rate is right, the beams between the first and the last are turned by half of θ
/// at most, and it is `range`·θ/π². `bent` is a rotation (rad) of the end that the residuals tell.
pub(super) fn skew(
    change: Twist,
    duration: f32,
    (source, late): (Source, f32),
    (of_match, range, bent): (&Covariance, f32, f32),
) -> Covariance {
    /// Squared shares of a change that is told at once, and a scan later.
    const SHARES: (f32, f32) = (1.0 / 90.0, 0.25);
    let (square, moving) = match source {
        Source::Wheels => (
            SHARES.0 + (SHARES.1 - SHARES.0) * late,
            FRAC_1_PI * FRAC_1_PI,
        ),
        Source::Velocity => (SHARES.1, FRAC_1_PI),
    };
    /// Variances of a match in a change of velocity, which is 1, -2 and 1 times a match's error.
    const NOISE: f32 = 6.0;
    let share = math::sqrt(square);
    let rest = |change: f32, noise: f32| {
        let change = duration * change;
        share * math::sqrt(math::max(change * change - NOISE * noise, 0.0))
    };
    let noise = &of_match.0;
    let rotation = math::max(rest(change.omega, noise.tt), bent);
    let distance = rest(change.speed(), noise.xx + noise.yy);
    let moved = rotation * range * moving;
    spread(math::sqrt(distance * distance + moved * moved), rotation)
}

/// Covariance of standard deviations of both coordinates (m) and of the heading (rad).
fn spread(distance: f32, rotation: f32) -> Covariance {
    let square = distance * distance;
    Covariance(Sym3::diagonal(square, square, rotation * rotation))
}

/// Errors that wheels make between two scans, and how much larger or smaller they were lately than assumed.
#[derive(Debug, Clone, Copy)]
pub(super) struct WheelErrors {
    translation: Ratio,
    rotation: Ratio,
    /// What the last scan added to `off` (m, m, rad), where two matches in a row are known.
    last: [f32; 3],
    /// Difference between match and wheels since the keyframe, where one is.
    off: Pose,
    /// Matches in a row since the keyframe or a gap, up to two. Not options: their tags would take 8 bytes.
    known: u8,
    /// Scans in a row whose matches agreed with them; stays at the most.
    agreed: u8,
}

/// Measured squares over assumed ones, all fading out.
#[derive(Debug, Clone, Copy)]
struct Ratio {
    /// Errors that stay.
    drift: f32,
    /// Errors that come and go: a clock that jitters.
    jitter: f32,
    assumed: f32,
}

impl Ratio {
    /// As assumed, with the weight of a few scans of a robot that drives.
    const fn new(square: f32) -> Self {
        Self {
            drift: square,
            jitter: square,
            assumed: square,
        }
    }

    fn push(&mut self, drift: f32, jitter: f32, assumed: f32) {
        /// Scans until an observation has faded to a third.
        const MEMORY: f32 = 50.0;
        self.drift += drift - self.drift / MEMORY;
        self.jitter += jitter - self.jitter / MEMORY;
        self.assumed += assumed - self.assumed / MEMORY;
    }

    /// Squared factor of the assumed errors.
    fn factor(&self) -> f32 {
        /// Wheels are never believed to be ten times better or thirty times worse than assumed.
        const RANGE: (f32, f32) = (0.01, 1000.0);
        let measured = math::max(self.drift, self.jitter);
        math::max(RANGE.0, math::min(measured / self.assumed, RANGE.1))
    }
}

impl WheelErrors {
    /// All bytes zero.
    pub const ZERO: Self = Self::assumed(0.0);

    pub const fn new() -> Self {
        Self::assumed(1e-3)
    }

    const fn assumed(square: f32) -> Self {
        Self {
            translation: Ratio::new(square),
            rotation: Ratio::new(square),
            last: [0.0; 3],
            off: Pose::IDENTITY,
            known: 0,
            agreed: 0,
        }
    }

    /// Covariance of a motion by wheels whose errors are assumed to be `share` of it.
    pub fn covariance(&self, share: f32, motion: Pose) -> Covariance {
        let (distance, rotation) = EgoMotion::wheel_errors(share, motion);
        let distance = distance * distance * self.translation.factor();
        Covariance(Sym3::diagonal(
            distance,
            distance,
            rotation * rotation * self.rotation.factor(),
        ))
    }

    /// Whether the distances that they told were about as good as assumed lately.
    pub fn are_steady(&self) -> bool {
        self.translation.factor() < 4.0
    }

    /// Notes whether a match agreed with them.
    pub fn note(&mut self, agreed: bool) {
        self.agreed = if agreed {
            self.agreed.saturating_add(1)
        } else {
            0
        };
    }

    /// Whether no match has contradicted them for two seconds at 10 Hz.
    pub fn were_right(&self) -> bool {
        self.are_steady() && self.agreed >= 20
    }

    /// Forgets where match and wheels differed: another keyframe, or no match.
    pub fn interrupt(&mut self) {
        self.known = 0;
    }

    /// Learns from a match: `off` is the matched pose as seen from the wheels' pose since the keyframe, `motion` what
    /// the wheels said since the last scan.
    ///
    /// Errors of matches come and go from scan to scan, errors of wheels stay: with `u` the change of `off` from scan to
    /// scan, `u² + 2·u·u'` is free of the former on the mean. What `u²` has more than twice the noise of a match comes and
    /// goes with the wheels.
    pub fn learn(&mut self, off: Pose, share: f32, motion: Pose, of_match: &Covariance) {
        let before = core::mem::replace(&mut self.off, off);
        let known = self.known;
        self.known = u8::min(known + 1, 2);
        if known == 0 {
            return;
        }
        let change = [
            off.x - before.x,
            off.y - before.y,
            math::wrap_angle(off.theta - before.theta),
        ];
        let [lx, ly, lt] = core::mem::replace(&mut self.last, change);
        if known == 1 {
            return;
        }
        let [x, y, t] = change;
        let (distance, rotation) = EgoMotion::wheel_errors(share, motion);
        let noise = &of_match.0;
        let square = x * x + y * y;
        self.translation.push(
            square + 2.0 * (x * lx + y * ly),
            square - 2.0 * (noise.xx + noise.yy),
            2.0 * distance * distance,
        );
        self.rotation.push(
            t * t + 2.0 * t * lt,
            t * t - 2.0 * noise.tt,
            rotation * rotation,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOTION: Pose = Pose {
        x: 0.06,
        y: 0.0,
        theta: 0.05,
    };

    /// Factor of the variance that wheels get whose pose is off by `off` in each scan of a drive.
    fn learned(off: impl Fn(u32) -> f32) -> f32 {
        let mut errors = WheelErrors::new();
        let before = errors.covariance(0.1, MOTION).0.xx;
        let noise = Covariance(Sym3::diagonal(9e-6, 9e-6, 4e-6));
        for k in 0..200 {
            errors.learn(Pose::new(off(k), 0.0, 0.0), 0.1, MOTION, &noise);
        }
        errors.covariance(0.1, MOTION).0.xx / before
    }

    #[test]
    fn good_wheels_are_believed_more_and_bad_ones_less() {
        let alternating = |k: u32| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        // Matches that are 3 mm off to and fro, on exact wheels.
        let exact = learned(|k| 0.002 * alternating(k));
        assert!(exact < 0.1, "{exact}");
        // 2 cm more in every scan, of 6 cm that were driven; and 5 cm to and fro: a clock that jitters.
        for factor in [
            learned(|k| 0.02 * k as f32),
            learned(|k| 0.05 * alternating(k)),
        ] {
            assert!(factor > 4.0, "{factor}");
        }
    }

    #[test]
    fn the_error_of_a_velocity_grows_with_the_time_squared() {
        let sigma = |seconds| math::sqrt(coasting_between(0.0, seconds).0.xx);
        assert!((sigma(0.4) / sigma(0.2) - 4.0).abs() < 1e-3);
        // In the end as an unknown velocity's.
        assert!((sigma(20.0) / sigma(10.0) - 2.0).abs() < 1e-3);
        let twice = coasting_between(0.0, 0.3).plus(&coasting_between(0.3, 0.7));
        assert!((twice.0.tt / coasting_between(0.0, 0.7).0.tt - 1.0).abs() < 1e-5);
    }

    #[test]
    fn a_bent_scan_is_moved_as_well() {
        let exact = Covariance(Sym3::diagonal(0.0, 0.0, 0.0));
        let turning = Twist {
            omega: 1.0,
            ..Twist::ZERO
        };
        let of = |range| skew(turning, 0.1, (Source::Velocity, 1.0), (&exact, range, 0.0)).0;
        assert!((math::sqrt(of(3.0).tt) - 0.05).abs() < 1e-6);
        assert_eq!(of(0.0).xx, 0.0);
        // 2.9° of places 3 m away.
        assert!((math::sqrt(of(3.0).xx) - 0.048).abs() < 1e-3);
        let wheels = |late| skew(turning, 0.1, (Source::Wheels, late), (&exact, 0.0, 0.0)).0;
        assert!((math::sqrt(wheels(0.0).tt) - 0.0105).abs() < 1e-4);
        assert_eq!(wheels(1.0).tt, of(0.0).tt);
    }
}
