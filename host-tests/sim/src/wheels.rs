//! What the wheels of a course say: scale, noise, slip, spinning, restarts, jumps, delays, far origins.

use super::course::Course;
use super::noise::Noise;
use super::pose::TruePose;
use super::robot::PERIOD;

/// What the wheels get wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Wheels {
    /// Error of the distance and of the rotation (share).
    pub scale: (f64, f64),
    /// Random error by the square root of metre (m) and of radian (rad).
    pub noise: (f64, f64),
    /// Random error of each pose that is handed over, in x and y (m) and in heading (rad): a random walk.
    pub jumping: (f64, f64),
    /// The wheels turn by this factor of what they roll: from, to (s), factor. 0 is stuck.
    pub slips: Vec<(f64, f64, f64)>,
    /// The wheels spin ahead at a speed without any motion: from, to (s), speed (m/s).
    pub spins: Vec<(f64, f64, f64)>,
    /// They start over from zero at these times (s).
    pub restarts: Vec<f64>,
    /// Poses handed over are moved by this from a time on (s).
    pub jumps: Vec<(f64, TruePose)>,
    /// A pose is older than it should be by up to so much (s), drawn evenly for each.
    pub jitter: f64,
    /// A pose is older than it should be by this (s).
    pub delay: f64,
    /// Where their origin lies.
    pub origin: TruePose,
    /// Poses a second; 0: one at each scan's end.
    pub rate: f64,
}

impl Wheels {
    /// The truth, in a frame of its own.
    pub const TRUE: Self = Self {
        scale: (0.0, 0.0),
        noise: (0.0, 0.0),
        jumping: (0.0, 0.0),
        slips: Vec::new(),
        spins: Vec::new(),
        restarts: Vec::new(),
        jumps: Vec::new(),
        jitter: 0.0,
        delay: 0.0,
        origin: TruePose::new(0.0, 0.0, 0.0),
        rate: 0.0,
    };

    /// An ordinary small robot on a smooth floor.
    pub const USUAL: Self = Self {
        scale: (0.005, 0.01),
        noise: (0.003, 0.01),
        jumping: (0.0, 0.0),
        slips: Vec::new(),
        spins: Vec::new(),
        restarts: Vec::new(),
        jumps: Vec::new(),
        jitter: 0.0,
        delay: 0.0,
        origin: TruePose::new(0.0, 0.0, 0.0),
        rate: 0.0,
    };

    /// The poses to be handed over at `times` (s, growing); `None` where there is no news.
    #[must_use]
    pub fn poses(
        &self,
        course: &Course,
        times: &[f64],
        noise: &mut Noise,
    ) -> Vec<Option<TruePose>> {
        let path = self.path(course, times.last().copied().unwrap_or(0.0), noise);
        let (mut walk, mut told) = (TruePose::default(), f64::NEG_INFINITY);
        times
            .iter()
            .map(|&now| {
                let said = if self.rate > 0.0 {
                    libm::floor(now * self.rate) / self.rate
                } else {
                    now
                };
                if said <= told {
                    return None;
                }
                told = said;
                let time = said - self.delay - noise.even(0.0, 1.0) * self.jitter;
                let mut pose = at(&path, time);
                for (from, jump) in &self.jumps {
                    if now >= *from {
                        pose = jump.then(pose);
                    }
                }
                walk.x += noise.normal(self.jumping.0);
                walk.y += noise.normal(self.jumping.0);
                walk.theta += noise.normal(self.jumping.1);
                Some(self.origin.then(walk.then(pose)))
            })
            .collect()
    }

    /// The wheels' own pose every [`PERIOD`].
    fn path(&self, course: &Course, until: f64, noise: &mut Noise) -> Vec<TruePose> {
        let mut pose = TruePose::default();
        let mut path = vec![pose];
        let count = libm::ceil(until / PERIOD) as usize + 1;
        for k in 0..count {
            let (from, to) = (k as f64 * PERIOD, (k + 1) as f64 * PERIOD);
            let rolled = course.rolled(from).between(course.rolled(to));
            let (mut forward, mut turn) = (
                rolled.x * (1.0 + self.scale.0)
                    + noise.normal(self.noise.0 * libm::sqrt(rolled.x.abs())),
                rolled.theta * (1.0 + self.scale.1)
                    + noise.normal(self.noise.1 * libm::sqrt(rolled.theta.abs())),
            );
            for &(start, end, factor) in &self.slips {
                if (start..end).contains(&from) {
                    (forward, turn) = (forward * factor, turn * factor);
                }
            }
            for &(start, end, speed) in &self.spins {
                if (start..end).contains(&from) {
                    forward += speed * PERIOD;
                }
            }
            pose = pose.along_arc(forward, turn);
            if self.restarts.iter().any(|&time| (from..to).contains(&time)) {
                pose = TruePose::default();
            }
            path.push(pose);
        }
        path
    }

    /// The same wheels in a mirror that lies along the x axis.
    #[must_use]
    pub fn mirrored(self) -> Self {
        let jumps = self.jumps.iter().map(|&(at, by)| (at, by.mirrored()));
        Self {
            jumps: jumps.collect(),
            origin: self.origin.mirrored(),
            ..self
        }
    }
}

fn at(path: &[TruePose], time: f64) -> TruePose {
    let place = (time / PERIOD).max(0.0);
    let before = (place as usize).min(path.len() - 1);
    let after = (before + 1).min(path.len() - 1);
    let (a, b) = (path[before], path[after]);
    let step = a.between(b);
    // A restart happens at once.
    if step.distance() > 0.5 {
        return a;
    }
    a.then(step.part(place - before as f64))
}
