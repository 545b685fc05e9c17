//! A robot on two driven wheels: how it drives, and what its wheels say about it.

use super::noise::Noise;
use super::pose::{TruePose, wrap};

/// Time between two decisions of the controller and two readings of the wheels (s).
pub const PERIOD: f64 = 0.01;

const TOP_SPEED: f64 = 0.65;
const TOP_TURN: f64 = 1.4;
const ACCELERATION: f64 = 0.6;
const TURN_ACCELERATION: f64 = 5.0;
/// A corner counts as reached from here (m).
const REACHED: f64 = 0.25;
const WHEEL_BASE: f64 = 0.28;
/// Distance per tick of the wheels' counters (m).
const TICK: f64 = 0.0005;

/// What a robot's wheels let it do.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Steering {
    /// Two driven wheels: it turns on the spot.
    #[default]
    Differential,
    /// Wheels that roll to all sides: it drives sideways as well as forward.
    Omni,
    /// Steered front wheels: it drives no circle of a smaller radius (m), and turns only while it drives.
    Ackermann(f64),
}

/// How far the wheels tell the truth.
#[derive(Debug, Clone, Copy)]
pub struct WheelErrors {
    /// Radius error of the left and the right wheel (share). Default +0.3 % and −0.2 %: tyres.
    pub scale: [f64; 2],
    /// Random error per square root of metre (m). Default 1.5 mm.
    pub noise: f64,
    /// Chance of a slip per second. Default 0.1; a slip lasts 0.3 s.
    pub slips_per_s: f64,
    /// A slip adds such a share to what one wheel rolls: from, to. Default 5 to 25 %.
    pub slip: [f64; 2],
}

impl WheelErrors {
    /// An ordinary small robot on a smooth floor.
    pub const DEFAULT: Self = Self {
        scale: [0.003, -0.002],
        noise: 0.0015,
        slips_per_s: 0.1,
        slip: [0.05, 0.25],
    };
}

/// The robot on its way.
#[derive(Debug, Clone)]
pub struct Robot {
    /// Where it is.
    pub pose: TruePose,
    /// Metres driven.
    pub driven: f64,
    /// Where its wheels say it is, in a frame of their own that starts at zero.
    pub wheels: TruePose,
    speed: f64,
    /// To the left (m/s).
    sideways: f64,
    turn: f64,
    steering: Steering,
    way: Vec<[f64; 2]>,
    next: usize,
    errors: WheelErrors,
    noise: Noise,
    rolled: [f64; 2],
    counted: [i64; 2],
    slip_left: f64,
    slip: [f64; 2],
}

impl Robot {
    /// Standing at `start`, with the corners of its way ahead.
    #[must_use]
    pub fn new(start: TruePose, way: Vec<[f64; 2]>, errors: WheelErrors, noise: Noise) -> Self {
        Self {
            pose: start,
            driven: 0.0,
            wheels: TruePose::default(),
            speed: 0.0,
            sideways: 0.0,
            turn: 0.0,
            steering: Steering::Differential,
            way,
            next: 0,
            errors,
            noise,
            rolled: [0.0; 2],
            counted: [0; 2],
            slip_left: 0.0,
            slip: [0.0; 2],
        }
    }

    /// The same robot on other wheels.
    #[must_use]
    pub fn with_steering(self, steering: Steering) -> Self {
        Self { steering, ..self }
    }

    /// Whether it stands at the end of its way.
    #[must_use]
    pub fn arrived(&self) -> bool {
        self.next >= self.way.len() && self.speed == 0.0 && self.sideways == 0.0 && self.turn == 0.0
    }

    /// Chooses speed and turn for the next [`PERIOD`].
    pub fn steer(&mut self) {
        let (mut speed, mut sideways, mut turn) = (0.0, 0.0, 0.0);
        while let Some(corner) = self.way.get(self.next) {
            let to = [corner[0] - self.pose.x, corner[1] - self.pose.y];
            let left = libm::sqrt(to[0] * to[0] + to[1] * to[1]);
            let last = self.next + 1 == self.way.len();
            if left < if last { 0.02 } else { REACHED } {
                self.next += 1;
                continue;
            }
            let off = wrap(libm::atan2(to[1], to[0]) - self.pose.theta);
            // Brake in time: v² = 2·a·s, with some reserve.
            let most = if last {
                libm::sqrt(ACCELERATION * left)
            } else {
                f64::INFINITY
            };
            turn = (2.5 * off).clamp(-TOP_TURN, TOP_TURN);
            let ahead = libm::cos(off.clamp(-1.5, 1.5));
            speed = (TOP_SPEED * ahead * ahead * ahead).min(most);
            match self.steering {
                Steering::Differential => {}
                Steering::Omni => {
                    // Straight to the corner, while it turns there at its leisure.
                    let pace = TOP_SPEED.min(most);
                    (speed, sideways) = (pace * libm::cos(off), pace * libm::sin(off));
                    turn *= 0.25;
                }
                Steering::Ackermann(radius) => {
                    // What lies behind or within the circle is turned to backwards.
                    let is_behind = off.abs() > 1.9 || self.speed < 0.0 && off.abs() > 0.5;
                    let within = 2.0 * radius * libm::sin(off.abs()) > left && off.abs() > 0.3;
                    let pace = (0.5 * TOP_SPEED).max(speed).min(most);
                    speed = if is_behind || within {
                        -0.5 * TOP_SPEED
                    } else {
                        pace
                    };
                    turn = turn.clamp(-speed.abs() / radius, speed.abs() / radius);
                }
            }
            break;
        }
        self.aim(speed, turn);
        self.sideways +=
            (sideways - self.sideways).clamp(-ACCELERATION * PERIOD, ACCELERATION * PERIOD);
        if let Steering::Ackermann(radius) = self.steering {
            let most = self.speed.abs() / radius;
            self.turn = self.turn.clamp(-most, most);
        }
    }

    /// Drives towards a speed (m/s) and a rate of turn (rad/s) in the next [`PERIOD`], as fast as it accelerates.
    pub fn aim(&mut self, speed: f64, turn: f64) {
        self.speed += (speed - self.speed).clamp(-ACCELERATION * PERIOD, ACCELERATION * PERIOD);
        self.turn +=
            (turn - self.turn).clamp(-TURN_ACCELERATION * PERIOD, TURN_ACCELERATION * PERIOD);
    }

    /// Drives on for `seconds`: an exact arc.
    pub fn advance(&mut self, seconds: f64) {
        let (forward, turn) = (self.speed * seconds, self.turn * seconds);
        self.pose = self.pose.along_arc(forward, turn);
        self.driven += forward.abs();
        if self.sideways != 0.0 {
            let left = self.sideways * seconds;
            self.pose = self.pose.then(TruePose::new(0.0, left, 0.0));
            // Forward was counted.
            self.driven += libm::hypot(forward, left) - forward.abs();
        }
    }

    /// Reads the wheels' counters, once a [`PERIOD`], and moves [`Robot::wheels`] on by them.
    pub fn read_wheels(&mut self) {
        self.slip_left -= PERIOD;
        if self.slip_left <= 0.0 {
            self.slip = [0.0; 2];
            if self.noise.even(0.0, 1.0) < self.errors.slips_per_s * PERIOD {
                self.slip_left = 0.3;
                let wheel = usize::from(self.noise.even(0.0, 1.0) < 0.5);
                let [least, most] = self.errors.slip;
                self.slip[wheel] = self.noise.even(least, most);
            }
        }
        let mut moved = [0.0; 2];
        for wheel in 0..2 {
            let side = if wheel == 0 { -0.5 } else { 0.5 };
            let ground = (self.speed + side * WHEEL_BASE * self.turn) * PERIOD;
            let random = self.errors.noise * libm::sqrt(ground.abs());
            self.rolled[wheel] += ground * (1.0 + self.errors.scale[wheel] + self.slip[wheel])
                + self.noise.normal(random);
            let ticks = libm::floor(self.rolled[wheel] / TICK) as i64;
            moved[wheel] = (ticks - self.counted[wheel]) as f64 * TICK;
            self.counted[wheel] = ticks;
        }
        let forward = 0.5 * (moved[0] + moved[1]);
        self.wheels = self
            .wheels
            .along_arc(forward, (moved[1] - moved[0]) / WHEEL_BASE);
        if self.steering == Steering::Omni {
            // A third count, of the rollers.
            let ground = self.sideways * PERIOD;
            let random = self
                .noise
                .normal(self.errors.noise * libm::sqrt(ground.abs()));
            let told = ground * (1.0 + self.errors.scale[0]) + random;
            self.wheels = self.wheels.then(TruePose::new(0.0, told, 0.0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Drives through corners; gives the robot at the end, and the largest of what `of` says about a step.
    fn drive(steering: Steering, of: impl Fn(TruePose) -> f64) -> (Robot, f64) {
        let way = vec![[4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [0.5, 0.0]];
        let exact = WheelErrors {
            scale: [0.0; 2],
            noise: 0.0,
            slips_per_s: 0.0,
            ..WheelErrors::DEFAULT
        };
        let robot = Robot::new(TruePose::default(), way, exact, Noise::new(1, 1));
        let mut robot = robot.with_steering(steering);
        let mut most = 0.0f64;
        for _ in 0..12_000 {
            robot.steer();
            robot.read_wheels();
            let before = robot.pose;
            robot.advance(PERIOD);
            most = most.max(of(before.between(robot.pose)));
            if robot.arrived() {
                return (robot, most);
            }
        }
        panic!("{steering:?} does not arrive: {:?}", robot.pose);
    }

    #[test]
    fn every_kind_arrives_and_its_wheels_say_where() {
        for steering in [
            Steering::Differential,
            Steering::Omni,
            Steering::Ackermann(0.6),
        ] {
            let (robot, _) = drive(steering, |_| 0.0);
            let off = robot.pose.between(robot.wheels);
            // Ticks of half a millimetre.
            assert!(
                off.distance() < 0.05 && off.theta.abs() < 0.02,
                "{steering:?}: {:?} {:?}",
                robot.pose,
                robot.wheels
            );
            let to_end = libm::hypot(robot.pose.x - 0.5, robot.pose.y);
            assert!(to_end < 0.05, "{steering:?}: {:?}", robot.pose);
        }
    }

    #[test]
    fn steered_wheels_drive_no_smaller_circle_and_only_rollers_drive_sideways() {
        let curvature = |step: TruePose| step.theta.abs() / step.distance().max(1e-9);
        let (_, most) = drive(Steering::Ackermann(0.6), curvature);
        assert!(most < 1.01 / 0.6, "{most}");
        let sideways = |step: TruePose| (step.y - 0.5 * step.x * step.theta).abs() / PERIOD;
        let (_, most) = drive(Steering::Differential, sideways);
        assert!(most < 0.001, "{most}");
        let (_, most) = drive(Steering::Omni, sideways);
        assert!(most > 0.3, "{most}");
    }
}
