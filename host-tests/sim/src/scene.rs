//! A scene: a world, what moves in it, a course through it, and what lidar and wheels make of that.

use beamfix::scan::{Beam, Bearing, Range};

use super::course::Course;
use super::lidar::quality;
use super::noise::Noise;
use super::pose::TruePose;
use super::sensor::Sensor;
use super::things::Thing;
use super::wheels::Wheels;
use super::world::World;

/// All that decides what a robot sees.
#[derive(Debug, Clone)]
pub struct Scene {
    /// What stands still.
    pub world: World,
    /// Panes of glass: four of ten beams pass, four are lost, two return.
    pub glass: World,
    /// What moves.
    pub things: Vec<Thing>,
    /// The robot's motion.
    pub course: Course,
    /// The lidar.
    pub sensor: Sensor,
    /// The lidar on the robot.
    pub mount: TruePose,
    /// The wheels; `None`: there are none.
    pub wheels: Option<Wheels>,
    /// The lidar is covered and sees nothing: from, to (s).
    pub covers: Vec<(f64, f64)>,
}

/// One scan of a scene.
#[derive(Debug, Clone)]
pub struct Revolution {
    /// Its beams in the order in which they are handed over.
    pub beams: Vec<Beam>,
    /// When its last beam was measured (s).
    pub end: f64,
    /// Where the robot was at its last beam, in the world.
    pub truth: TruePose,
    /// The wheels' pose, where there is news.
    pub wheels: Option<TruePose>,
}

impl Scene {
    /// An ordinary robot with an LD06 in `world` on `course`.
    #[must_use]
    pub fn new(world: World, course: Course) -> Self {
        Self {
            world,
            glass: World::default(),
            things: Vec::new(),
            course,
            sensor: Sensor::LD06,
            mount: TruePose::new(0.08, 0.0, 0.0),
            wheels: Some(Wheels::USUAL),
            covers: Vec::new(),
        }
    }

    /// The same scene in a mirror: left is right, and the lidar turns the other way.
    #[must_use]
    pub fn mirrored(self) -> Self {
        Self {
            world: self.world.mirrored(),
            glass: self.glass.mirrored(),
            things: self.things.into_iter().map(Thing::mirrored).collect(),
            course: self.course.mirrored(),
            sensor: self.sensor.mirrored(),
            mount: self.mount.mirrored(),
            wheels: self.wheels.map(Wheels::mirrored),
            covers: self.covers,
        }
    }

    /// The scans of the whole course.
    #[must_use]
    pub fn run(&self, seed: u64) -> Vec<Revolution> {
        let pattern = self.sensor.pattern();
        let last = pattern.iter().fold(0.0, |last: f64, beam| last.max(beam.0));
        let count = libm::floor(self.course.seconds() * self.sensor.rate) as usize;
        let starts: Vec<f64> = (0..count).map(|k| k as f64 / self.sensor.rate).collect();
        let ends: Vec<f64> = starts.iter().map(|start| start + last).collect();
        let wheels = match &self.wheels {
            Some(wheels) => wheels.poses(&self.course, &ends, &mut Noise::new(seed, 11)),
            None => vec![None; count],
        };
        let mut noise = Noise::new(seed, 12);
        let scans = starts.iter().zip(ends).zip(wheels);
        scans
            .map(|((start, end), wheels)| {
                let beams = pattern
                    .iter()
                    .enumerate()
                    .map(|(k, (after, bearing))| {
                        let late = if k == pattern.len() / 3 {
                            self.sensor.late
                        } else {
                            0.0
                        };
                        self.beam(start + after, late, *bearing, &mut noise)
                    })
                    .collect();
                Revolution {
                    beams,
                    end,
                    truth: self.course.truth(end),
                    wheels,
                }
            })
            .collect()
    }

    /// One beam, measured at `time` and told `late` seconds later.
    fn beam(&self, time: f64, late: f64, bearing: f64, noise: &mut Noise) -> Beam {
        let lidar = self.course.truth(time).then(self.mount);
        let direction = lidar.theta + bearing;
        let towards = [libm::cos(direction), libm::sin(direction)];
        let from = [lidar.x, lidar.y];
        let mut moving = World::default();
        for thing in &self.things {
            thing.place(&self.course, time, &mut moving);
        }
        let nearer = |a: Option<f64>, b: Option<f64>| match (a, b) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
        let mut range = nearer(self.world.cast(from, towards), moving.cast(from, towards));
        // Which of the three a beam does hangs on dirt and angle: from beam to beam.
        let pane = self.glass.cast(from, towards);
        let chance = noise.even(0.0, 1.0);
        if let Some(pane) = pane
            && range.is_none_or(|range| pane < range)
            && chance >= 0.4
        {
            range = (chance >= 0.8).then_some(pane);
        }
        let measured = self.sensor.measure(bearing, range, noise);
        let covered = self
            .covers
            .iter()
            .any(|(start, end)| (*start..*end).contains(&time));
        let range = if covered { Range::from_mm(0) } else { measured };
        Beam {
            bearing: Bearing::from_radians(bearing as f32),
            range,
            time_us: libm::round((time + late) * 1e6) as u64 as u32,
            quality: quality(range.mm().ok().map(f64::from)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_and_its_mirror_see_the_same_from_the_other_side() {
        let mut world = World::default();
        world.block([-2.0, -1.0], [3.0, 4.0]);
        let course = Course::at(TruePose::default()).drive(0.5, 0.5, 1.0);
        let mut scene = Scene::new(world, course);
        scene.sensor.sigma = (0.0, 0.0);
        let (here, there) = (scene.run(1), scene.mirrored().run(1));
        for (a, b) in here.iter().zip(&there) {
            for (a, b) in a.beams.iter().zip(&b.beams) {
                assert!(a.bearing.0.wrapping_add(b.bearing.0).wrapping_add(1) <= 2);
                assert_eq!((a.range, a.time_us), (b.range, b.time_us));
            }
        }
    }
}
