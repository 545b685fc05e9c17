//! A whole run: the robot drives, the lidar turns, every shot is cast from where the lidar is at its time.

use super::lidar::{Ranging, Shot, quality};
use super::noise::Noise;
use super::pose::TruePose;
use super::robot::{PERIOD, Robot, WheelErrors};
use super::scenes;
use super::world::World;

/// What to simulate.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Seed of all randomness. Default 1.
    pub seed: u64,
    /// Longest run (s); it also ends where the way does. Default 120.
    pub seconds: f64,
    /// Measurements per second. Default 4500: the LD06.
    pub shots_per_s: f64,
    /// Turns per second. Default 10.
    pub turns_per_s: f64,
    /// Whether the lidar turns clockwise seen from above. Default true: the LD06.
    pub clockwise: bool,
    /// The lidar on the robot (m, rad). Default at the middle, looking ahead.
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
        shots_per_s: 4500.0,
        turns_per_s: 10.0,
        clockwise: true,
        mount: TruePose::new(0.0, 0.0, 0.0),
        ranging: Ranging::DEFAULT,
        wheels: WheelErrors::DEFAULT,
    };
}

/// A finished run. The vectors have an entry a shot.
#[derive(Debug, Clone)]
pub struct Drive {
    /// Where it took place.
    pub world: World,
    /// Where the robot started; poses below are in the world's frame too.
    pub start: TruePose,
    /// All measurements in order.
    pub shots: Vec<Shot>,
    /// The robot's true pose at each.
    pub truth: Vec<TruePose>,
    /// The latest pose by wheel odometry at each, in the wheels' own frame.
    pub wheels: Vec<TruePose>,
    /// Metres driven.
    pub distance: f64,
    /// Nearest that the robot's middle came to anything (m).
    pub clearance: f64,
}

/// Drives one round through the flat.
#[must_use]
pub fn drive(settings: &Settings) -> Drive {
    let world = scenes::flat();
    let (start, way) = scenes::flat_round();
    let mut robot = Robot::new(start, way, settings.wheels, Noise::new(settings.seed, 1));
    let mut range_noise = Noise::new(settings.seed, 2);
    let mut motor_noise = Noise::new(settings.seed, 3);
    let mut run = Drive {
        world,
        start,
        shots: Vec::new(),
        truth: Vec::new(),
        wheels: Vec::new(),
        distance: 0.0,
        clearance: f64::INFINITY,
    };
    let step = 1.0 / settings.shots_per_s;
    let (mut shot, mut bearing) = (0u64, 0.0);
    let mut now = 0.0;
    let mut period = 0u64;
    loop {
        let begins = period as f64 * PERIOD;
        if begins >= settings.seconds || robot.arrived() {
            break;
        }
        robot.steer();
        robot.read_wheels();
        // The motor's speed wanders by a few thousandths.
        let turns = settings.turns_per_s * (1.0 + motor_noise.normal(0.002));
        let turned =
            core::f64::consts::TAU * turns * step * if settings.clockwise { -1.0 } else { 1.0 };
        let ends = (period + 1) as f64 * PERIOD;
        while (shot as f64) * step < ends {
            let time = shot as f64 * step;
            robot.advance(time - now);
            now = time;
            let sensor = robot.pose.then(settings.mount);
            let mm = settings
                .ranging
                .measure(&run.world, sensor, bearing, &mut range_noise);
            run.shots.push(Shot {
                time,
                bearing,
                range_mm: mm,
                quality: quality(mm),
            });
            run.truth.push(robot.pose);
            run.wheels.push(robot.wheels);
            bearing += turned;
            shot += 1;
        }
        robot.advance(ends - now);
        now = ends;
        let room = run.world.clearance([robot.pose.x, robot.pose.y]);
        run.clearance = run.clearance.min(room);
        period += 1;
    }
    run.distance = robot.driven;
    run
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_round_is_long_enough_touches_nothing_and_ends_where_it_began() {
        let run = drive(&Settings::DEFAULT);
        let seconds = run.shots.last().expect("shots").time;
        let end = *run.truth.last().expect("shots");
        assert!(
            seconds >= 60.0 && run.distance >= 30.0,
            "{seconds} s, {} m",
            run.distance
        );
        assert!(run.clearance > 0.18, "clearance {} m", run.clearance);
        assert!(run.start.between(end).distance() < 0.05, "{end:?}");
    }
}
