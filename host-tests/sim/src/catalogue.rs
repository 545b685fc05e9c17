//! Scenes by name: everything that has deceived an odometry so far, and what must keep working.

mod motion;
mod noise;
mod people;
mod wheels;

use super::course::Course;
use super::pose::TruePose;
use super::scene::Scene;
use super::wheels::Wheels;
use super::world::World;
use super::{scenes, spaces};

/// A scene by its name.
#[derive(Clone, Copy)]
pub struct Entry {
    /// Unique, in words and hyphens.
    pub name: &'static str,
    /// What must come of it.
    pub must: Must,
    /// Makes it: worlds, places and people may differ from seed to seed.
    pub make: fn(u64) -> Scene,
}

/// What is asked of an odometry in a scene, besides never to be wrong and confident.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Must {
    /// The pose stays within so much of the truth (m, deg) at the end.
    Follow(f64, f64),
    /// The pose never leaves the truth by so much (m, deg).
    Hold(f64, f64),
    /// The scene does not determine the pose: it may be lost as long as the covariance says so.
    Tell,
}

/// Scenes of up to an hour, which are run by name only.
#[must_use]
pub fn long() -> Vec<Entry> {
    noise::LONG.to_vec()
}

/// All scenes of up to a few minutes.
#[must_use]
pub fn all() -> Vec<Entry> {
    [wheels::ALL, people::ALL, noise::ALL, motion::ALL]
        .into_iter()
        .flatten()
        .copied()
        .collect()
}

/// One round through the flat, after a second of standing.
fn flat_course() -> Course {
    let (start, way) = scenes::flat_round();
    Course::at(start).rest(1.0).through(&way)
}

/// A drive through the flat with an LD06 and ordinary wheels.
fn flat() -> Scene {
    Scene::new(scenes::flat(), flat_course())
}

/// The same without wheels.
fn blind_flat() -> Scene {
    Scene {
        wheels: None,
        ..flat()
    }
}

/// An empty room of 5 m by 4 m with some furniture.
fn furnished() -> World {
    let mut world = scenes::room();
    world.turned_block([1.9, 1.2], [0.8, 1.2], 0.1);
    world.turned_block([-1.2, -1.5], [1.4, 0.6], -0.05);
    world.column([-2.0, 1.1], 0.2);
    world
}

/// Standing for `seconds` in the furnished room, a little askew.
fn standing(seconds: f64) -> Scene {
    let course = Course::at(TruePose::new(0.2, -0.1, 0.4)).rest(seconds);
    Scene::new(furnished(), course)
}

/// 25 m of corridor with niches, driven from one end to the other at 0.6 m/s.
fn corridor(seed: u64) -> Scene {
    let course = Course::at(TruePose::new(1.5, 0.0, 0.0))
        .rest(1.0)
        .drive(36.0, 0.6, 0.0)
        .rest(2.0);
    Scene::new(spaces::niches(25.0, seed), course)
}

/// Wheels that are the truth.
fn true_wheels(scene: Scene) -> Scene {
    Scene {
        wheels: Some(Wheels::TRUE),
        ..scene
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_has_a_name_of_its_own_and_some_scans() {
        let entries = all();
        for (k, entry) in entries.iter().enumerate() {
            let twice = entries[..k].iter().any(|other| other.name == entry.name);
            assert!(!twice, "{}", entry.name);
            let course = (entry.make)(1).course;
            assert!(course.seconds() > 5.0, "{}", entry.name);
        }
    }
}
