//! Motion between the ends of two revolutions by wheel odometry whose messages come at any rate.

use crate::geometry::{Pose, Twist};

/// Messages kept: two tell how the wheels moved around a revolution's end and shortly after. That is enough because the
/// pose at the last end is kept too.
const KEPT: usize = 2;
/// Longest time between two messages (µs) over which the motion is taken to be even.
const MAX_GAP_US: i32 = 600_000;
/// The last motion is believed to go on for so many times the time between the last two messages.
const MAX_GAPS: i32 = 3;

/// The last poses by the wheels, and the one at the end of the last revolution. 52 bytes.
#[derive(Debug)]
pub(super) struct Wheels {
    /// The newest first.
    messages: [Message; KEPT],
    count: u8,
    /// Whether a message came since the last revolution's end.
    news: bool,
    /// When the last revolution ended, and the pose by the wheels then.
    end_us: u32,
    end: Option<Pose>,
}

#[derive(Debug, Clone, Copy)]
struct Message {
    time_us: u32,
    pose: Pose,
}

impl Wheels {
    pub const fn new() -> Self {
        const NONE: Message = Message {
            time_us: 0,
            pose: Pose::IDENTITY,
        };
        Self {
            messages: [NONE; KEPT],
            count: 0,
            news: false,
            end_us: 0,
            end: None,
        }
    }

    /// Takes a pose of a time (µs), unless it is not finite.
    pub fn push(&mut self, time_us: u32, pose: Pose) {
        if !pose.is_finite() {
            return;
        }
        let [newest, ..] = self.messages;
        match after(newest.time_us, time_us) {
            // A correction, or a clock that stands still.
            0 if self.count > 0 => {}
            // The clock was set back, or the wheels' computer started over.
            passed if passed < 0 => self.count = 1,
            _ => {
                self.messages.rotate_right(1);
                self.count = if self.count < KEPT as u8 {
                    self.count + 1
                } else {
                    KEPT as u8
                };
            }
        }
        let [newest, ..] = &mut self.messages;
        *newest = Message { time_us, pose };
        self.news = true;
    }

    /// Motion from the last revolution's end to this one's (µs); `None` where messages are missing at either.
    pub fn motion_until(&mut self, end_us: u32) -> Option<Pose> {
        // On a clock that stands still an old message would say that the robot stands too.
        let stale = !self.news && end_us == self.end_us;
        let now = if stale { None } else { self.at(end_us) };
        let motion = self.end.zip(now).map(|(before, now)| before.between(now));
        // What was wrong in an expected pose comes back with the other sign, so that no error stays in the sum.
        (self.end, self.end_us, self.news) = (now, end_us, false);
        motion
    }

    /// Pose by the wheels at a time (µs): that of a message of just this time, else by even motion between the two
    /// around it, or on from the last two.
    fn at(&self, time_us: u32) -> Option<Pose> {
        let messages = self.messages.get(..usize::from(self.count))?;
        let newest = messages.first()?;
        let late_us = after(newest.time_us, time_us);
        if late_us == 0 {
            return Some(newest.pose);
        }
        for pair in messages.windows(2) {
            let [to, from] = pair else { return None };
            let (gap_us, since_us) = (
                after(from.time_us, to.time_us),
                after(from.time_us, time_us),
            );
            if since_us < 0 {
                continue;
            }
            if since_us == 0 {
                return Some(from.pose);
            }
            let known = gap_us <= MAX_GAP_US && late_us <= gap_us.saturating_mul(MAX_GAPS);
            return known.then(|| {
                let twist = Twist::from_motion(from.pose.between(to.pose), gap_us as f32 * 1e-6);
                from.pose * twist.displacement(since_us as f32 * 1e-6)
            });
        }
        None
    }
}

/// Time from `before` to `time` (µs), both wrapping.
fn after(before: u32, time: u32) -> i32 {
    time.wrapping_sub(before).cast_signed()
}

#[cfg(test)]
mod tests {
    use super::*;

    const VELOCITY: Twist = Twist {
        vx: 0.5,
        vy: 0.0,
        omega: 0.7,
    };

    /// Where the wheels are after a time, the robot driving evenly.
    fn pose(time_us: u32) -> Pose {
        VELOCITY.displacement(time_us as f32 * 1e-6)
    }

    #[test]
    fn messages_of_any_rate_tell_the_motion_of_every_revolution() {
        // Time between messages (ms), lost ones, and revolutions without a motion: those before the second message.
        for (every_ms, lost, without) in [
            (10, None, 2),
            (37, None, 2),
            (100, None, 2),
            (200, None, 3),
            (500, None, 6),
            (100, Some(7), 2),
            (200, Some(5), 3),
        ] {
            let (mut wheels, mut missing) = (Wheels::new(), 0);
            let mut sent = 0;
            for k in 0..60u32 {
                let end_us = 100_000 * k + 3000;
                while 1000 * every_ms * sent <= end_us {
                    let time_us = 1000 * every_ms * sent;
                    // The clock wraps on the way.
                    if lost != Some(sent) {
                        wheels.push(time_us.wrapping_sub(1_000_000), pose(time_us));
                    }
                    sent += 1;
                }
                let Some(motion) = wheels.motion_until(end_us.wrapping_sub(1_000_000)) else {
                    missing += 1;
                    assert!(k < 8, "{every_ms} ms: none at revolution {k}");
                    continue;
                };
                let off = motion.between(VELOCITY.displacement(0.1));
                assert!(
                    off.distance() < 1e-4 && off.theta.abs() < 1e-4,
                    "{every_ms} ms, {k}: {motion:?}"
                );
            }
            assert_eq!(missing, without, "{every_ms} ms, {lost:?} lost");
        }
    }

    #[test]
    fn messages_of_just_the_revolutions_ends_give_their_very_poses_whatever_the_times() {
        // Evenly, standing still, back and forth, over a pause.
        let times = [0, 100, 200, 200, 200, 150, 400, 9_000_000, 9_000_100u32];
        let mut wheels = Wheels::new();
        let mut before: Option<Pose> = None;
        for (k, time_us) in times.into_iter().enumerate() {
            let now = Pose::new(0.1 * k as f32, 0.03, 0.5);
            wheels.push(time_us, now);
            let motion = wheels.motion_until(time_us);
            assert_eq!(motion, before.map(|before| before.between(now)), "{k}");
            before = Some(now);
        }
    }

    #[test]
    fn silence_tells_nothing_and_a_robot_that_brakes_is_followed() {
        let mut wheels = Wheels::new();
        for k in 0..5 {
            wheels.push(200_000 * k, pose(200_000 * k));
        }
        assert!(wheels.motion_until(800_000).is_none());
        assert!(wheels.motion_until(1_300_000).is_some());
        assert!(wheels.motion_until(1_500_000).is_none());
        // It stopped at 0.9 s, which was not foreseen; the motion is right in the end.
        let mut wheels = Wheels::new();
        let mut sum = Pose::IDENTITY;
        for k in 0..30u32 {
            if k % 2 == 0 {
                wheels.push(100_000 * k, pose((100_000 * k).min(900_000)));
            }
            if let Some(motion) = wheels.motion_until(100_000 * k) {
                sum = sum * motion;
            }
        }
        // From the first revolution with a motion on, whose start was a message.
        let driven = pose(200_000).between(pose(900_000));
        let off = sum.between(driven);
        assert!(off.distance() < 1e-3, "{sum:?} {driven:?}");
        // A clock that stands still: an old message is no standstill.
        let mut wheels = Wheels::new();
        for k in 0..3 {
            wheels.push(0, pose(100_000 * k));
            assert_eq!(wheels.motion_until(0).is_some(), k > 0);
        }
        assert_eq!(wheels.motion_until(0), None);
    }
}
