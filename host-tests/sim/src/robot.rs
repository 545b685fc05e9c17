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

/// How far the wheels tell the truth.
#[derive(Debug, Clone, Copy)]
pub struct WheelErrors {
    /// Radius error of the left and the right wheel (share). Default +0.3 % and −0.2 %: tyres.
    pub scale: [f64; 2],
    /// Random error per square root of metre (m). Default 1.5 mm.
    pub noise: f64,
    /// Chance of a slip per second. Default 0.1; a slip lasts 0.3 s and adds 5 to 25 % to one wheel.
    pub slips_per_s: f64,
}

impl WheelErrors {
    /// An ordinary small robot on a smooth floor.
    pub const DEFAULT: Self = Self {
        scale: [0.003, -0.002],
        noise: 0.0015,
        slips_per_s: 0.1,
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
    turn: f64,
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
            turn: 0.0,
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

    /// Whether it stands at the end of its way.
    #[must_use]
    pub fn arrived(&self) -> bool {
        self.next >= self.way.len() && self.speed == 0.0 && self.turn == 0.0
    }

    /// Chooses speed and turn for the next [`PERIOD`].
    pub fn steer(&mut self) {
        let (mut speed, mut turn) = (0.0, 0.0);
        while let Some(corner) = self.way.get(self.next) {
            let to = [corner[0] - self.pose.x, corner[1] - self.pose.y];
            let left = libm::sqrt(to[0] * to[0] + to[1] * to[1]);
            let last = self.next + 1 == self.way.len();
            if left < if last { 0.02 } else { REACHED } {
                self.next += 1;
                continue;
            }
            let off = wrap(libm::atan2(to[1], to[0]) - self.pose.theta);
            turn = (2.5 * off).clamp(-TOP_TURN, TOP_TURN);
            let ahead = libm::cos(off.clamp(-1.5, 1.5));
            speed = TOP_SPEED * ahead * ahead * ahead;
            if last {
                // Brake in time: v² = 2·a·s, with some reserve.
                speed = speed.min(libm::sqrt(ACCELERATION * left));
            }
            break;
        }
        self.aim(speed, turn);
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
    }

    /// Reads the wheels' counters, once a [`PERIOD`], and moves [`Robot::wheels`] on by them.
    pub fn read_wheels(&mut self) {
        self.slip_left -= PERIOD;
        if self.slip_left <= 0.0 {
            self.slip = [0.0; 2];
            if self.noise.even(0.0, 1.0) < self.errors.slips_per_s * PERIOD {
                self.slip_left = 0.3;
                let wheel = usize::from(self.noise.even(0.0, 1.0) < 0.5);
                self.slip[wheel] = self.noise.even(0.05, 0.25);
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
    }
}
