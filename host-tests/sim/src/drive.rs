//! A whole run: the robot drives, the lidar turns, every beam is cast from where the lidar is at its time.

use super::lidar::{Ranging, quality};
use super::noise::Noise;
use super::place::{Nature, Place};
use super::pose::{TruePose, wrap};
use super::robot::{PERIOD, Robot, WheelErrors};
use super::scenes;
use super::world::World;
use crate::encoder::{Echo, Encoder};

/// What to simulate.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Seed of all randomness. Default 1.
    pub seed: u64,
    /// Longest run (s); it also ends where the way does. Default 120.
    pub seconds: f64,
    /// The lidar on the robot (m, rad). Default 8 cm ahead of the axle, looking ahead.
    pub mount: TruePose,
    /// What the lidar can measure.
    pub ranging: Ranging,
    /// What the wheels get wrong.
    pub wheels: WheelErrors,
}

impl Settings {
    /// An LD06 in the flat.
    pub const DEFAULT: Self = Self {
        seed: 1,
        seconds: 120.0,
        mount: TruePose::new(0.08, 0.0, 0.0),
        ranging: Ranging::DEFAULT,
        wheels: WheelErrors::DEFAULT,
    };
}

/// State of the robot when a beam was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Since the start (s).
    pub time: f64,
    /// Where the robot was, in the world's frame.
    pub truth: TruePose,
    /// Where its wheels said it was, in a frame of their own.
    pub wheels: TruePose,
}

/// A finished run.
#[derive(Debug, Clone)]
pub struct Drive {
    /// Where it took place.
    pub world: World,
    /// What came over the lidar's line.
    pub bytes: Vec<u8>,
    /// Where in `bytes` each frame ends, and when (µs) what it tells was measured.
    pub frames: Vec<(usize, f64)>,
    /// The robot at each beam, in order.
    pub moments: Vec<Moment>,
    /// Metres driven.
    pub distance: f64,
    /// Nearest that the robot's middle came to anything (m).
    pub clearance: f64,
    /// What robot and lidar were like.
    pub nature: Nature,
    /// When (s) the gyroscope told which rate of turn (rad/s).
    pub gyro: Vec<(f64, f64)>,
}

/// The robot stands that long before it drives off (s): its first scan is not bent by any motion.
const STANDING: f64 = 1.0;

/// Drives one round through the flat with `sensor` on board.
#[must_use]
pub fn drive(settings: &Settings, sensor: &mut dyn Encoder) -> Drive {
    let (start, way) = scenes::flat_round();
    let flat = Place {
        world: scenes::flat(),
        start,
        way,
        ..Place::default()
    };
    drive_in(flat, settings, sensor)
}

/// Drives the way of a place with `sensor` on board.
#[must_use]
pub fn drive_in(place: Place, settings: &Settings, sensor: &mut dyn Encoder) -> Drive {
    let Place {
        mut world,
        start,
        way,
        nature,
        moving,
    } = place;
    let settings = Settings {
        ranging: nature.ranging(settings.ranging),
        wheels: nature.wheels(settings.wheels),
        ..settings.clone()
    };
    sensor.sway(nature.sway);
    let mut underway = Underway::new(start, way, &settings);
    underway.robot = underway.robot.with_steering(nature.steering);
    let mut noise = Noise::new(settings.seed, 4);
    let mut gyro = Vec::new();
    let mut clearance = f64::INFINITY;
    while underway.now < settings.seconds && !underway.robot.arrived() {
        if underway.now >= STANDING {
            underway.robot.steer();
        }
        moving.place(underway.now, &mut world);
        if let Some([seconds, turn]) = nature.knock
            && underway.now >= seconds
        {
            underway.settings.mount.theta = settings.mount.theta + turn;
        }
        let heading = underway.robot.pose.theta;
        underway.go_on(&world, sensor);
        if let Some([bias, sigma]) = nature.gyro {
            let turned = wrap(underway.robot.pose.theta - heading);
            let rate = turned / PERIOD + bias + noise.normal(sigma);
            // Of the middle of the period, as the mean is.
            gyro.push((underway.now - 0.5 * PERIOD, rate));
        }
        let place = [underway.robot.pose.x, underway.robot.pose.y];
        clearance = clearance.min(world.clearance(place));
    }
    let Underway {
        robot,
        bytes,
        frames,
        moments,
        ..
    } = underway;
    Drive {
        world,
        bytes,
        frames,
        moments,
        distance: robot.driven,
        clearance,
        nature,
        gyro,
    }
}

/// A robot on its way, [`PERIOD`] by [`PERIOD`], and what came over its lidar's line so far.
#[derive(Debug, Clone)]
pub struct Underway {
    /// The robot; between two periods it may be steered, or put elsewhere.
    pub robot: Robot,
    /// Since the start (s).
    pub now: f64,
    /// As in [`Drive`].
    pub bytes: Vec<u8>,
    /// As in [`Drive`].
    pub frames: Vec<(usize, f64)>,
    /// As in [`Drive`].
    pub moments: Vec<Moment>,
    settings: Settings,
    noise: Noise,
    periods: u32,
}

impl Underway {
    /// Standing at `start`.
    #[must_use]
    pub fn new(start: TruePose, way: Vec<[f64; 2]>, settings: &Settings) -> Self {
        Self {
            robot: Robot::new(start, way, settings.wheels, Noise::new(settings.seed, 1)),
            now: 0.0,
            bytes: Vec::new(),
            frames: Vec::new(),
            moments: Vec::new(),
            settings: settings.clone(),
            noise: Noise::new(settings.seed, 2),
            periods: 0,
        }
    }

    /// Drives on for a period as it was steered, and measures the beams that fall into it.
    pub fn go_on(&mut self, world: &World, sensor: &mut dyn Encoder) {
        let Self {
            robot,
            now,
            bytes,
            frames,
            moments,
            settings,
            noise,
            periods,
        } = self;
        robot.read_wheels();
        *periods += 1;
        let ends = f64::from(*periods) * PERIOD;
        while sensor.next_time_us() < ends * 1e6 {
            let mut look = |time_us: f64, bearing: f64| {
                let time = time_us * 1e-6;
                robot.advance(time - *now);
                *now = time;
                moments.push(Moment {
                    time,
                    truth: robot.pose,
                    wheels: robot.wheels,
                });
                let lidar = robot.pose.then(settings.mount);
                let range_mm = settings.ranging.measure(world, lidar, bearing, noise)?;
                Some(Echo {
                    range_mm,
                    intensity: quality(Some(range_mm)),
                })
            };
            let before = bytes.len();
            sensor.fire(&mut look, bytes);
            if bytes.len() > before {
                frames.push((bytes.len(), sensor.next_time_us()));
            }
        }
        robot.advance(ends - *now);
        *now = ends;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encoder::ld06::Sensor;

    #[test]
    fn the_round_is_long_enough_touches_nothing_and_ends_where_it_began() {
        let run = drive(&Settings::DEFAULT, &mut Sensor::ld06());
        let (first, last) = (run.moments[0], run.moments[run.moments.len() - 1]);
        assert!(
            last.time >= 60.0 && run.distance >= 30.0,
            "{} s, {} m",
            last.time,
            run.distance
        );
        assert!(run.clearance > 0.18, "clearance {} m", run.clearance);
        assert!(
            first.truth.between(last.truth).distance() < 0.05,
            "{last:?}"
        );
    }
}
