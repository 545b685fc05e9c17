//! A whole run: the robot drives, the lidar turns, every beam is cast from where the lidar is at its time.

use super::lidar::{Ranging, quality};
use super::noise::Noise;
use super::place::{Moving, Nature, Place};
use super::pose::{TruePose, wrap};
use super::robot::{PERIOD, Robot, WheelErrors};
use super::scenes;
use super::view::View;
use super::world::{Circle, World};
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
    let mut underway = Underway::new(place, settings, sensor);
    let mut clearance = f64::INFINITY;
    while underway.now < settings.seconds && !underway.robot.arrived() {
        if underway.now >= STANDING {
            underway.robot.steer();
        }
        underway.go_on(sensor);
        let place = [underway.robot.pose.x, underway.robot.pose.y];
        clearance = clearance.min(underway.world.clearance(place));
    }
    let Underway {
        robot,
        world,
        nature,
        bytes,
        frames,
        moments,
        gyro,
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
    /// What stands around now.
    pub world: World,
    /// What robot and lidar are like.
    pub nature: Nature,
    /// Since the start (s).
    pub now: f64,
    /// As in [`Drive`].
    pub bytes: Vec<u8>,
    /// As in [`Drive`].
    pub frames: Vec<(usize, f64)>,
    /// As in [`Drive`].
    pub moments: Vec<Moment>,
    /// As in [`Drive`].
    pub gyro: Vec<(f64, f64)>,
    moving: Moving,
    posts: Own,
    settings: Settings,
    noise: Noise,
    gyro_noise: Noise,
    periods: u32,
    view: View,
}

impl Underway {
    /// Standing at a place's start.
    #[must_use]
    pub fn new(place: Place, settings: &Settings, sensor: &mut dyn Encoder) -> Self {
        let Place {
            world,
            start,
            way,
            nature,
            moving,
            posts,
        } = place;
        let settings = Settings {
            ranging: nature.ranging(settings.ranging),
            wheels: nature.wheels(settings.wheels),
            ..settings.clone()
        };
        sensor.sway(nature.sway);
        let robot = Robot::new(start, way, settings.wheels, Noise::new(settings.seed, 1));
        Self {
            robot: robot.with_steering(nature.steering),
            world,
            nature,
            now: 0.0,
            bytes: Vec::new(),
            frames: Vec::new(),
            moments: Vec::new(),
            gyro: Vec::new(),
            moving,
            posts: Own(posts),
            noise: Noise::new(settings.seed, 2),
            gyro_noise: Noise::new(settings.seed, 4),
            settings,
            periods: 0,
            view: View::default(),
        }
    }

    /// Whether anything of the place moves.
    #[must_use]
    pub fn has_moving(&self) -> bool {
        !self.moving.is_empty()
    }

    /// What the lidar can measure there.
    #[must_use]
    pub fn ranging(&self) -> Ranging {
        self.settings.ranging
    }

    /// Drives on for a period as it was steered, and measures what falls into it.
    pub fn go_on(&mut self, sensor: &mut dyn Encoder) {
        let (robot, world) = (&self.robot, &mut self.world);
        self.moving.place(self.now, world);
        self.moving.follow(robot.pose, robot.driven, world);
        let heading = robot.pose.theta;
        self.measure(sensor);
        if let Some([bias, sigma]) = self.nature.gyro {
            let turned = wrap(self.robot.pose.theta - heading);
            let rate = turned / PERIOD + bias + self.gyro_noise.normal(sigma);
            // Of the middle of the period, as the mean is.
            self.gyro.push((self.now - 0.5 * PERIOD, rate));
        }
    }

    /// Drives on for a period, and measures the beams that fall into it.
    fn measure(&mut self, sensor: &mut dyn Encoder) {
        let Self {
            robot,
            world,
            nature,
            now,
            bytes,
            frames,
            moments,
            posts,
            settings,
            noise,
            periods,
            view,
            ..
        } = self;
        let mut mount = settings.mount;
        if let Some([seconds, turn]) = nature.knock
            && *now >= seconds
        {
            mount.theta += turn;
        }
        // What moves has moved.
        view.forget();
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
                let Settings { ranging, .. } = settings;
                let range_mm = match posts.cast(mount, bearing) {
                    Some(range) => ranging.at(range, noise)?,
                    None => {
                        let lidar = robot.pose.then(mount);
                        let towards = lidar.theta + bearing;
                        let seen = view.towards(world, lidar, towards, ranging.width);
                        ranging.measure(seen, lidar, bearing, noise)?
                    }
                };
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

/// The robot's own posts, in its frame.
#[derive(Debug, Clone)]
struct Own(Vec<Circle>);

impl Own {
    /// How far (m) the first is in a direction (rad) from a lidar at this place on the robot.
    fn cast(&self, mount: TruePose, bearing: f64) -> Option<f64> {
        if self.0.is_empty() {
            return None;
        }
        let angle = mount.theta + bearing;
        let towards = [libm::cos(angle), libm::sin(angle)];
        let ranges = self.0.iter();
        ranges
            .filter_map(|post| post.cast([mount.x, mount.y], towards))
            .reduce(|a, b| if a < b { a } else { b })
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

    #[test]
    fn the_robots_own_posts_are_seen_wherever_it_drives() {
        let text = "rectangle 8 6\nstart -2 -2 0\nway 2 -2 2 2\npost -0.12 0 0.02";
        let place = Place::parse(text, &mut |_| Err("no map".into())).expect("a place");
        let run = drive_in(place, &Settings::DEFAULT, &mut Sensor::ld06());
        // The lidar is 8 cm ahead: the post's face 18 cm behind it, at 6 of 100 directions.
        let (mut near, mut all) = (0, 0);
        for packet in run.bytes.chunks(47) {
            for point in packet[6..42].chunks(3) {
                let mm = u16::from_le_bytes([point[0], point[1]]);
                near += u32::from((150..220).contains(&mm));
                all += 1;
            }
        }
        let wanted = 2.0 * libm::asin(0.02 / 0.2) / core::f64::consts::TAU;
        let share = f64::from(near) / f64::from(all);
        assert!((share - wanted).abs() < 0.004, "{share}, not {wanted}");
    }
}
