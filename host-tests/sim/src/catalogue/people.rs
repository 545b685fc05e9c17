//! What moves along is not the world; what covers, blinds or deceives the lidar.

use super::{Entry, Must, blind_flat, corridor, flat, flat_course, standing};
use crate::noise::Noise;
use crate::pose::TruePose;
use crate::scene::Scene;
use crate::sensor::Sensor;
use crate::things::{self, Moves, Shape, Thing};
use crate::world::World;
use crate::{Course, scenes, spaces};

pub(super) const ALL: &[Entry] = &[
    Entry {
        name: "corridor-person-ahead",
        must: Must::Follow(0.4, 1.0),
        make: |seed| along(corridor(seed), Shape::Body(0.2), 1.0),
    },
    Entry {
        name: "corridor-person-behind",
        must: Must::Follow(0.4, 1.0),
        make: |seed| along(corridor(seed), Shape::Body(0.2), -1.0),
    },
    Entry {
        name: "corridor-legs-behind",
        must: Must::Follow(0.4, 1.0),
        make: |seed| along(corridor(seed), Shape::Legs, -0.6),
    },
    Entry {
        name: "corridor-person-ahead-no-wheels",
        must: Must::Tell,
        make: |seed| Scene {
            wheels: None,
            ..along(corridor(seed), Shape::Body(0.2), 1.0)
        },
    },
    Entry {
        name: "floor-person-ahead",
        must: Must::Follow(0.4, 1.0),
        make: |seed| {
            let course = Course::at(TruePose::new(2.0, 0.0, 0.0))
                .rest(1.0)
                .drive(50.0, 0.6, 0.0);
            along(
                Scene::new(spaces::floor(40.0, seed), course),
                Shape::Body(0.22),
                0.9,
            )
        },
    },
    Entry {
        name: "flat-followed",
        must: Must::Follow(0.05, 1.0),
        make: |_| Scene {
            things: vec![Thing {
                shape: Shape::Legs,
                moves: Moves::Trailing(1.2),
            }],
            ..flat()
        },
    },
    Entry {
        name: "flat-followed-no-wheels",
        must: Must::Follow(0.1, 1.5),
        make: |_| Scene {
            things: vec![Thing {
                shape: Shape::Body(0.2),
                moves: Moves::Trailing(1.5),
            }],
            ..blind_flat()
        },
    },
    Entry {
        name: "own-mast",
        must: Must::Follow(0.05, 1.0),
        make: |_| mast(flat()),
    },
    Entry {
        name: "own-mast-no-wheels",
        must: Must::Follow(0.1, 1.5),
        make: |_| mast(blind_flat()),
    },
    Entry {
        name: "board-behind",
        must: Must::Follow(0.1, 1.0),
        make: |_| board(flat()),
    },
    Entry {
        name: "board-behind-no-wheels",
        must: Must::Tell,
        make: |_| board(blind_flat()),
    },
    Entry {
        name: "corridor-own-mast",
        must: Must::Follow(0.4, 1.0),
        make: |seed| mast(corridor(seed)),
    },
    Entry {
        name: "crowd-one-way",
        must: Must::Tell,
        make: |seed| crowd(seed, Scene::new(scenes::flat(), hall_course())),
    },
    Entry {
        name: "crowd-one-way-no-wheels",
        must: Must::Tell,
        make: |seed| Scene {
            wheels: None,
            ..crowd(seed, Scene::new(scenes::flat(), hall_course()))
        },
    },
    Entry {
        name: "carried-under-a-cover",
        must: Must::Tell,
        make: |_| carried(TruePose::new(0.9, 0.2, 0.3)),
    },
    Entry {
        name: "carried-far-under-a-cover",
        must: Must::Tell,
        make: |_| carried(TruePose::new(-3.2, 1.6, 1.57)),
    },
    Entry {
        name: "turned-under-a-cover",
        must: Must::Tell,
        make: |_| carried(TruePose::new(0.0, 0.0, 1.57)),
    },
    Entry {
        name: "carried-in-the-open",
        must: Must::Tell,
        make: |_| Scene {
            covers: Vec::new(),
            ..carried(TruePose::new(0.6, 0.3, 0.7))
        },
    },
    Entry {
        name: "covered-1-s-no-wheels",
        must: Must::Tell,
        make: |_| covered(1.0),
    },
    Entry {
        name: "covered-3-s-no-wheels",
        must: Must::Tell,
        make: |_| covered(3.0),
    },
    Entry {
        name: "covered-15-s-no-wheels",
        must: Must::Tell,
        make: |_| covered(15.0),
    },
    Entry {
        name: "covered-15-s",
        must: Must::Follow(0.3, 3.0),
        make: |_| Scene {
            covers: vec![(20.0, 35.0)],
            ..flat()
        },
    },
    Entry {
        name: "covered-throughout",
        must: Must::Tell,
        make: |_| Scene {
            covers: vec![(0.0, 100.0)],
            ..standing(10.0)
        },
    },
    Entry {
        name: "glass",
        must: Must::Follow(0.1, 1.0),
        make: |_| glass(flat()),
    },
    Entry {
        name: "glass-no-wheels",
        must: Must::Tell,
        make: |_| glass(blind_flat()),
    },
    Entry {
        name: "fog-no-wheels",
        must: Must::Tell,
        make: |_| {
            sensed(
                blind_flat(),
                Sensor {
                    reach: (0.05, 2.0),
                    dropped: 0.3,
                    outliers: 0.1,
                    ..Sensor::LD06
                },
            )
        },
    },
    Entry {
        name: "outliers-30-percent",
        must: Must::Follow(0.1, 1.0),
        make: |_| {
            sensed(
                flat(),
                Sensor {
                    outliers: 0.3,
                    ..Sensor::LD06
                },
            )
        },
    },
    Entry {
        name: "outliers-30-percent-no-wheels",
        must: Must::Tell,
        make: |_| {
            sensed(
                blind_flat(),
                Sensor {
                    outliers: 0.3,
                    ..Sensor::LD06
                },
            )
        },
    },
    Entry {
        name: "half-blind",
        must: Must::Follow(0.1, 1.0),
        make: |_| {
            sensed(
                flat(),
                Sensor {
                    blind: Some((0.0, 3.2)),
                    ..Sensor::LD06
                },
            )
        },
    },
    Entry {
        name: "beams-4-no-wheels",
        must: Must::Tell,
        make: |_| sparse(4, core::f64::consts::TAU),
    },
    Entry {
        name: "beams-64-no-wheels",
        must: Must::Tell,
        make: |_| sparse(64, core::f64::consts::TAU),
    },
    Entry {
        name: "beams-64",
        must: Must::Follow(0.15, 1.5),
        make: |_| {
            sensed(
                flat(),
                Sensor {
                    beams: 64,
                    ..Sensor::LD06
                },
            )
        },
    },
    Entry {
        name: "beams-64-in-60-deg-no-wheels",
        must: Must::Tell,
        make: |_| sparse(64, core::f64::consts::FRAC_PI_3),
    },
];

/// Somebody walks along, `ahead` metres before the robot.
fn along(scene: Scene, shape: Shape, ahead: f64) -> Scene {
    Scene {
        things: vec![Thing {
            shape,
            moves: Moves::Along(TruePose::new(ahead, 0.1, 0.0), 0.04),
        }],
        ..scene
    }
}

/// Two posts and a panel behind the lidar that hide a sixth of the view.
fn mast(scene: Scene) -> Scene {
    let fixed = |x: f64, y: f64, shape: Shape| Thing {
        shape,
        moves: Moves::Fixed(TruePose::new(x, y, 0.0)),
    };
    Scene {
        things: vec![
            fixed(-0.25, 0.0, Shape::Board(0.3)),
            fixed(-0.1, 0.25, Shape::Body(0.02)),
            fixed(-0.1, -0.25, Shape::Body(0.02)),
        ],
        ..scene
    }
}

/// A board 1 m behind that hides a sixth of the view: a trailer.
fn board(scene: Scene) -> Scene {
    Scene {
        things: vec![Thing {
            shape: Shape::Board(1.15),
            moves: Moves::Fixed(TruePose::new(-0.92, 0.0, 0.0)),
        }],
        ..scene
    }
}

/// Along the flat's hall.
fn hall_course() -> Course {
    Course::at(TruePose::new(2.0, 4.15, 0.0))
        .rest(1.0)
        .drive(14.0, 0.4, 0.0)
}

fn crowd(seed: u64, scene: Scene) -> Scene {
    let mut noise = Noise::new(seed, 31);
    // On both sides of the robot, which they pass.
    let mut people = things::crowd(6, ([-6.0, 4.6], [8.0, 4.75]), 0.0, 0.6, &mut noise);
    people.extend(things::crowd(
        6,
        ([-6.0, 3.6], [8.0, 3.7]),
        0.0,
        0.6,
        &mut noise,
    ));
    Scene {
        things: people,
        ..scene
    }
}

/// Stands in the flat, is carried under a cover for two seconds, stands there.
fn carried(motion: TruePose) -> Scene {
    Scene {
        covers: vec![(3.0, 5.2)],
        ..Scene::new(
            scenes::flat(),
            Course::at(TruePose::new(4.9, 4.2, 3.0))
                .rest(3.1)
                .carried(motion, 2.0)
                .rest(10.0),
        )
    }
}

/// Covered for so long in the middle of the round, without wheels.
fn covered(seconds: f64) -> Scene {
    Scene {
        covers: vec![(20.0, 20.0 + seconds)],
        ..blind_flat()
    }
}

/// Some walls of the flat are glass.
fn glass(scene: Scene) -> Scene {
    let mut glass = World::default();
    glass.line([5.0, 4.85], [5.8, 4.85]);
    glass.line([0.3, 2.5], [2.5, 2.5]);
    glass.line([6.6, 2.0], [6.6, 3.3]);
    glass.line([9.5, 3.5], [9.5, 4.8]);
    Scene { glass, ..scene }
}

fn sensed(scene: Scene, sensor: Sensor) -> Scene {
    Scene { sensor, ..scene }
}

/// So many beams in a sector, in the flat, without wheels.
fn sparse(beams: usize, sector: f64) -> Scene {
    Scene {
        sensor: Sensor {
            beams,
            sector,
            ..Sensor::LD06
        },
        wheels: None,
        ..Scene::new(scenes::flat(), flat_course())
    }
}
