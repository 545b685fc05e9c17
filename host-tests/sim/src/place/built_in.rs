//! The places that are there without a description.

use super::Place;
use crate::pose::TruePose;
use crate::scenes;
use crate::spaces;
use crate::world::World;

/// Names of the built-in places, and what each is.
pub const NAMES: [(&str, &str); 9] = [
    ("flat", "four furnished rooms, a round of 39 m"),
    ("room", "an empty room of 5 m by 4 m"),
    ("corridor", "25 m with niches of doors, there and back"),
    (
        "office",
        "a corridor of 40 m with rooms on both sides, there and back",
    ),
    ("hall", "60 m by 40 m with two rows of pillars"),
    ("aisles", "a warehouse with rows of shelves that look alike"),
    ("yard", "buildings 10 to 60 m away, trees, hedges, cars"),
    ("maze", "passages 1.2 m wide"),
    ("dock", "a charging station in a corner, driven to"),
];

impl Place {
    /// The built-in place of this name, or an empty room by its sides, `6x4` (m); `None` if there is none. What is random in it
    /// comes from `seed`.
    #[must_use]
    pub fn named(name: &str, seed: u64) -> Option<Self> {
        let along = |world: World, end: f64| Self {
            world,
            start: TruePose::new(1.2, 0.0, 0.0),
            way: vec![[end, 0.0], [1.2, 0.0]],
            ..Self::default()
        };
        Some(match name {
            "flat" => {
                let (start, way) = scenes::flat_round();
                Self {
                    world: scenes::flat(),
                    start,
                    way,
                    ..Self::default()
                }
            }
            "room" => Self::built_in(include_str!("../../worlds/room.txt")),
            "corridor" => along(spaces::niches(25.0, seed), 23.5),
            "office" => along(spaces::floor(40.0, seed), 38.0),
            "hall" => Self {
                world: spaces::hall(),
                start: TruePose::new(-20.0, 0.0, 0.0),
                way: vec![
                    [20.0, 0.0],
                    [20.0, 13.0],
                    [-18.0, 13.0],
                    [-18.0, -13.0],
                    [10.0, -13.0],
                    [10.0, 0.0],
                    [-20.0, 0.0],
                ],
                ..Self::default()
            },
            "aisles" => Self::built_in(include_str!("../../worlds/aisles.txt")),
            "yard" => {
                // Trees stand anywhere: the first yard whose way is free.
                let yards = (0..100).map(|k| Self {
                    world: spaces::yard(seed + 1000 * k),
                    start: TruePose::default(),
                    way: vec![
                        [6.0, 0.0],
                        [6.0, 5.0],
                        [-5.0, 5.0],
                        [-5.0, -4.0],
                        [4.0, -4.0],
                        [0.0, 0.0],
                    ],
                    ..Self::default()
                });
                yards.into_iter().find(|yard| yard.check().is_ok())?
            }
            "maze" => Self::built_in(include_str!("../../worlds/maze.txt")),
            "dock" => Self::built_in(include_str!("../../worlds/dock.txt")),
            _ => return Self::rectangle(name),
        })
    }

    /// An empty room by its sides, `6x4`, driven around half-way between its middle and its walls.
    fn rectangle(name: &str) -> Option<Self> {
        let (length, width) = name.split_once('x')?;
        let sides: [f64; 2] = [length.parse().ok()?, width.parse().ok()?];
        if !sides.iter().all(|side| (1.0..1000.0).contains(side)) {
            return None;
        }
        let [x, y] = sides.map(|side| 0.25 * side);
        let mut world = World::default();
        world.block([-2.0 * x, -2.0 * y], [2.0 * x, 2.0 * y]);
        Some(Self {
            world,
            start: TruePose::new(-x, -y, 0.0),
            way: vec![[x, -y], [x, y], [-x, y], [-x, -y]],
            ..Self::default()
        })
    }

    /// A description that a test has parsed.
    fn built_in(text: &str) -> Self {
        Self::parse(text, &mut |_| Err("no map here".into())).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Place, String> {
        Place::parse(text, &mut |name| Err(format!("{name} is not there")))
    }

    #[test]
    fn every_built_in_place_can_be_driven() {
        for text in [
            include_str!("../../worlds/room.txt"),
            include_str!("../../worlds/aisles.txt"),
            include_str!("../../worlds/maze.txt"),
            include_str!("../../worlds/dock.txt"),
        ] {
            parse(text).unwrap_or_else(|why| panic!("{why}:\n{text}"));
        }
        for (name, _) in NAMES {
            for seed in 1..6 {
                let place = Place::named(name, seed).expect(name);
                assert!(!place.way.is_empty(), "{name}");
                place
                    .check()
                    .unwrap_or_else(|why| panic!("{name}, seed {seed}: {why}"));
            }
        }
        let room = Place::named("6.5x4", 1).expect("a rectangle");
        assert_eq!(room.world.extent(), ([-3.25, -2.0], [3.25, 2.0]));
        room.check().expect("its way");
        for name in ["moon", "0x4", "4x", "infx2", "4x4x4"] {
            assert!(Place::named(name, 1).is_none(), "{name}");
        }
    }
}
