//! Where a robot really is over time: legs that it drives with bounded acceleration, sampled a hundred times a second.

use super::noise::Noise;
use super::pose::TruePose;
use super::robot::{PERIOD, Robot, WheelErrors};

/// The true motion of a robot, and what ideal wheels would make of it.
///
/// Built leg by leg: `Course::at(start).rest(1.0).drive(5.0, 0.6, 0.0).rotate(PI, 3.0)`.
#[derive(Debug, Clone)]
pub struct Course {
    /// Every [`PERIOD`], from time 0 on.
    samples: Vec<Sample>,
    speed: f64,
    turn: f64,
    acceleration: f64,
    turn_acceleration: f64,
}

/// The robot at one moment.
#[derive(Debug, Clone, Copy)]
struct Sample {
    truth: TruePose,
    rolled: TruePose,
}

impl Course {
    /// Stands at `start`.
    #[must_use]
    pub fn at(start: TruePose) -> Self {
        Self {
            samples: vec![Sample {
                truth: start,
                rolled: TruePose::default(),
            }],
            speed: 0.0,
            turn: 0.0,
            acceleration: 0.8,
            turn_acceleration: 5.0,
        }
    }

    /// Accelerates by at most so much from here on (m/s², rad/s²).
    #[must_use]
    pub fn accelerating(mut self, linear: f64, turn: f64) -> Self {
        (self.acceleration, self.turn_acceleration) = (linear, turn);
        self
    }

    /// Slows down to a stand, and stands, for `seconds` in all.
    #[must_use]
    pub fn rest(self, seconds: f64) -> Self {
        self.drive(seconds, 0.0, 0.0)
    }

    /// Drives for `seconds` towards a speed (m/s) and a rate of turn (rad/s).
    #[must_use]
    pub fn drive(mut self, seconds: f64, speed: f64, turn: f64) -> Self {
        for _ in 0..periods(seconds) {
            self.roll(speed, turn);
        }
        self
    }

    /// Slows down to a stand, then rotates on the spot by `angle` (rad, any number of turns) at up to `rate` (rad/s).
    #[must_use]
    pub fn rotate(mut self, angle: f64, rate: f64) -> Self {
        while self.speed.abs() > 1e-9 || self.turn.abs() > 1e-9 {
            self.roll(0.0, 0.0);
        }
        let mut left = angle;
        // The brakes reach a stand within a period of the end.
        while left.abs() > 1e-4 {
            let brake = libm::sqrt(2.0 * self.turn_acceleration * left.abs());
            let aim = rate.min(brake).min(left.abs() / PERIOD).copysign(left);
            self.roll(0.0, aim);
            left -= self.turn * PERIOD;
        }
        self.turn = 0.0;
        self
    }

    /// Drives through `corners` as the robot of the default run does.
    #[must_use]
    pub fn through(mut self, corners: &[[f64; 2]]) -> Self {
        let ideal = WheelErrors {
            scale: [0.0; 2],
            noise: 0.0,
            slips_per_s: 0.0,
            ..WheelErrors::DEFAULT
        };
        let from = self.last();
        let mut robot = Robot::new(from.truth, corners.to_vec(), ideal, Noise::new(0, 0));
        loop {
            robot.steer();
            robot.advance(PERIOD);
            self.samples.push(Sample {
                truth: robot.pose,
                rolled: from.rolled.then(from.truth.between(robot.pose)),
            });
            if robot.arrived() {
                return self;
            }
        }
    }

    /// Is carried by `motion` within `seconds`: the wheels hang in the air.
    #[must_use]
    pub fn carried(mut self, motion: TruePose, seconds: f64) -> Self {
        let (from, count) = (self.last(), periods(seconds).max(1));
        for k in 1..=count {
            let share = k as f64 / count as f64;
            self.samples.push(Sample {
                truth: from.truth.then(motion.part(share)),
                rolled: from.rolled,
            });
        }
        self
    }

    /// The same course `count` times, one after the other: for courses that end where they began.
    #[must_use]
    pub fn repeated(self, count: usize) -> Self {
        let mut whole = self.clone();
        for _ in 1..count {
            let (end, first) = (whole.last(), self.samples[0]);
            whole
                .samples
                .extend(self.samples[1..].iter().map(|sample| Sample {
                    truth: end.truth.then(first.truth.between(sample.truth)),
                    rolled: end.rolled.then(first.rolled.between(sample.rolled)),
                }));
        }
        whole
    }

    /// The same course in a mirror that lies along the x axis.
    #[must_use]
    pub fn mirrored(mut self) -> Self {
        for sample in &mut self.samples {
            sample.truth = sample.truth.mirrored();
            sample.rolled = sample.rolled.mirrored();
        }
        self
    }

    /// Length (s).
    #[must_use]
    pub fn seconds(&self) -> f64 {
        (self.samples.len() - 1) as f64 * PERIOD
    }

    /// Where the robot is at `time` (s); before the start it came straight ahead, after the end it stands.
    #[must_use]
    pub fn truth(&self, time: f64) -> TruePose {
        if time < 0.0 {
            return self.samples[0].truth.then(TruePose::new(time, 0.0, 0.0));
        }
        self.between(time, |sample| sample.truth)
    }

    /// Where ideal wheels, which started at zero, say that it is.
    #[must_use]
    pub fn rolled(&self, time: f64) -> TruePose {
        self.between(time, |sample| sample.rolled)
    }

    fn between(&self, time: f64, of: impl Fn(Sample) -> TruePose) -> TruePose {
        let place = (time / PERIOD).max(0.0);
        let before = (place as usize).min(self.samples.len() - 1);
        let after = (before + 1).min(self.samples.len() - 1);
        let (a, b) = (of(self.samples[before]), of(self.samples[after]));
        a.then(a.between(b).part(place - before as f64))
    }

    fn last(&self) -> Sample {
        self.samples[self.samples.len() - 1]
    }

    /// Drives on for a period.
    fn roll(&mut self, speed: f64, turn: f64) {
        let (dv, dw) = (self.acceleration * PERIOD, self.turn_acceleration * PERIOD);
        self.speed += (speed - self.speed).clamp(-dv, dv);
        self.turn += (turn - self.turn).clamp(-dw, dw);
        let (forward, turned) = (self.speed * PERIOD, self.turn * PERIOD);
        let last = self.last();
        self.samples.push(Sample {
            truth: last.truth.along_arc(forward, turned),
            rolled: last.rolled.along_arc(forward, turned),
        });
    }
}

fn periods(seconds: f64) -> usize {
    libm::round(seconds / PERIOD) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;

    #[test]
    fn a_course_ends_where_its_legs_lead() {
        let course = Course::at(TruePose::new(1.0, 2.0, 0.0))
            .rest(1.0)
            .rotate(0.5 * PI, 3.0)
            .carried(TruePose::new(2.0, 0.0, 0.0), 2.0);
        let end = course.truth(course.seconds());
        let off = TruePose::new(1.0, 4.0, 0.5 * PI).between(end);
        assert!(off.distance() < 1e-3 && off.theta.abs() < 1e-3, "{end:?}");
        let rolled = course.rolled(course.seconds());
        assert!(rolled.distance() < 1e-9, "{rolled:?}");
    }

    #[test]
    fn twice_around_is_the_same_place() {
        let around = Course::at(TruePose::default()).rotate(2.0 * PI, 6.0);
        let twice = around.clone().repeated(2);
        assert!((twice.seconds() - 2.0 * around.seconds()).abs() < 1e-9);
        assert!(twice.truth(twice.seconds()).theta.abs() < 1e-3);
    }
}
