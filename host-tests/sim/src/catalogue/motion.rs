//! Hard turns, scans that are not taken at one moment or not in order, rooms that look alike after a turn.

use core::f64::consts::{FRAC_PI_2, PI, TAU};

use super::{Entry, Must, blind_flat, flat};
use crate::pose::TruePose;
use crate::scene::Scene;
use crate::sensor::Sensor;
use crate::wheels::Wheels;
use crate::world::World;
use crate::{Course, scenes, spaces};

pub(super) const ALL: &[Entry] = &[
    Entry {
        name: "turns-180-deg-per-s",
        must: Must::Follow(0.05, 1.0),
        make: |_| turns(PI, 10.0, true),
    },
    Entry {
        name: "turns-360-deg-per-s",
        must: Must::Follow(0.05, 1.0),
        make: |_| turns(TAU, 10.0, true),
    },
    Entry {
        name: "turns-180-deg-per-s-no-wheels",
        must: Must::Follow(0.1, 2.0),
        make: |_| turns(PI, 10.0, false),
    },
    Entry {
        name: "turns-360-deg-per-s-no-wheels",
        must: Must::Tell,
        make: |_| turns(TAU, 10.0, false),
    },
    Entry {
        name: "turns-180-deg-per-s-5-hz-no-wheels",
        must: Must::Tell,
        make: |_| turns(PI, 5.0, false),
    },
    Entry {
        name: "turns-90-deg-per-s-wheels-out-of-step",
        must: Must::Follow(0.05, 1.0),
        make: |_| Scene {
            wheels: Some(Wheels {
                delay: 0.08,
                jitter: 0.08,
                ..Wheels::USUAL
            }),
            ..turns(FRAC_PI_2, 10.0, true)
        },
    },
    Entry {
        name: "spin-on",
        must: Must::Follow(0.05, 2.0),
        make: |_| spin(true),
    },
    Entry {
        name: "spin-on-mirrored",
        must: Must::Follow(0.05, 2.0),
        make: |_| spin(true).mirrored(),
    },
    Entry {
        name: "spin-on-no-wheels",
        must: Must::Tell,
        make: |_| spin(false),
    },
    Entry {
        name: "square-room-after-a-gap",
        must: Must::Tell,
        make: |_| symmetric(scenes_square()),
    },
    Entry {
        name: "hexagon-after-a-gap",
        must: Must::Tell,
        make: |_| symmetric(spaces::regular(6)),
    },
    Entry {
        name: "triangle-after-a-gap",
        must: Must::Tell,
        make: |_| symmetric(spaces::regular(3)),
    },
    Entry {
        name: "round-room",
        must: Must::Tell,
        make: |_| round(true),
    },
    Entry {
        name: "round-room-no-wheels",
        must: Must::Tell,
        make: |_| round(false),
    },
    Entry {
        name: "late-beam",
        must: Must::Follow(0.05, 1.0),
        make: |_| {
            sensed(Sensor {
                late: 0.2,
                ..Sensor::LD06
            })
        },
    },
    Entry {
        name: "late-beam-no-wheels",
        must: Must::Follow(0.1, 1.5),
        make: |_| Scene {
            wheels: None,
            ..sensed(Sensor {
                late: 0.2,
                ..Sensor::LD06
            })
        },
    },
    Entry {
        name: "beams-by-bearing",
        must: Must::Follow(0.05, 1.0),
        make: |_| {
            sensed(Sensor {
                by_bearing: true,
                ..Sensor::LD06
            })
        },
    },
    Entry {
        name: "sick-0.5-deg-interleaved",
        must: Must::Follow(0.1, 1.0),
        make: |_| sick(361, 2),
    },
    Entry {
        name: "sick-0.25-deg-interleaved",
        must: Must::Follow(0.1, 1.0),
        make: |_| sick(721, 4),
    },
    Entry {
        name: "lidar-2-hz",
        must: Must::Follow(0.05, 1.0),
        make: |_| {
            sensed(Sensor {
                rate: 2.0,
                ..Sensor::LD06
            })
        },
    },
    Entry {
        name: "lidar-15-hz",
        must: Must::Follow(0.05, 1.0),
        make: |_| {
            sensed(Sensor {
                rate: 15.0,
                beams: 300,
                ..Sensor::LD06
            })
        },
    },
    Entry {
        name: "nothing-around",
        must: Must::Tell,
        make: |_| {
            Scene::new(
                World::default(),
                Course::at(TruePose::default())
                    .rest(1.0)
                    .drive(9.0, 0.4, 0.0),
            )
        },
    },
];

/// Turns on the spot at up to `rate` (rad/s), 10 rad/s², with short drives between.
fn turns(rate: f64, lidar: f64, wheels: bool) -> Scene {
    let mut course = Course::at(TruePose::new(2.6, 4.15, 0.0))
        .accelerating(0.8, 10.0)
        .rest(1.03);
    for angle in [FRAC_PI_2, -PI, TAU, -FRAC_PI_2, 1.0, -1.0, PI, -TAU] {
        course = course
            .rotate(angle, rate)
            .rest(0.73)
            .drive(0.8, 0.2, 0.0)
            .rest(0.6);
    }
    Scene {
        sensor: Sensor {
            rate: lidar,
            ..Sensor::LD06
        },
        wheels: wheels.then_some(Wheels::USUAL),
        ..Scene::new(scenes::flat(), course)
    }
}

/// Ten rounds on the spot without a stop.
fn spin(wheels: bool) -> Scene {
    Scene {
        wheels: wheels.then_some(Wheels::USUAL),
        ..Scene::new(
            scenes::flat(),
            Course::at(TruePose::new(2.6, 4.15, 0.0))
                .rest(1.0)
                .rotate(10.0 * TAU, 3.0)
                .rest(1.0),
        )
    }
}

fn scenes_square() -> World {
    let mut world = World::default();
    world.block([-2.0, -2.0], [2.0, 2.0]);
    world
}

/// Turns by a quarter under a cover, without wheels.
fn symmetric(world: World) -> Scene {
    Scene {
        wheels: None,
        covers: vec![(4.0, 6.0)],
        ..Scene::new(
            world,
            Course::at(TruePose::new(0.3, -0.2, 0.2))
                .rest(4.2)
                .rotate(FRAC_PI_2, 1.2)
                .rest(8.0),
        )
    }
}

fn round(wheels: bool) -> Scene {
    Scene {
        wheels: wheels.then_some(Wheels::USUAL),
        ..Scene::new(
            scenes::circle(),
            Course::at(TruePose::new(-0.8, 0.3, 0.2))
                .rest(1.0)
                .drive(4.0, 0.3, 0.3)
                .rest(1.0)
                .rotate(PI, 1.0)
                .drive(4.0, 0.3, 0.2)
                .rest(1.0),
        )
    }
}

fn sensed(sensor: Sensor) -> Scene {
    Scene { sensor, ..flat() }
}

/// A SICK on the flat's round whose beams are taken by several turns of its mirror.
fn sick(beams: usize, interleaved: usize) -> Scene {
    Scene {
        sensor: Sensor {
            beams,
            interleaved,
            by_bearing: true,
            rate: 5.0,
            sector: PI * beams as f64 / (beams as f64 - 1.0),
            ..Sensor::SICK
        },
        wheels: Some(Wheels::USUAL),
        ..blind_flat()
    }
}
