//! Wheels that lie: out of step, slipping, spinning, jumping, starting over, far from their origin.

use super::{Entry, Must, blind_flat, corridor, flat, true_wheels};
use crate::pose::TruePose;
use crate::scene::Scene;
use crate::sensor::Sensor;
use crate::wheels::Wheels;
use crate::{Course, spaces};

pub(super) const ALL: &[Entry] = &[
    Entry {
        name: "flat",
        must: Must::Follow(0.05, 1.0),
        make: |_| flat(),
    },
    Entry {
        name: "flat-no-wheels",
        must: Must::Follow(0.05, 1.0),
        make: |_| blind_flat(),
    },
    Entry {
        name: "flat-true-wheels",
        must: Must::Hold(0.02, 0.3),
        make: |_| true_wheels(flat()),
    },
    Entry {
        name: "yard",
        must: Must::Follow(0.15, 1.0),
        make: |seed| Scene {
            sensor: Sensor::SICK,
            wheels: Some(Wheels {
                jumping: (0.026, 0.003),
                ..Wheels::USUAL
            }),
            ..Scene::new(
                spaces::yard(seed),
                Course::at(TruePose::new(-6.0, 0.0, 0.1))
                    .rest(1.0)
                    .drive(13.0, 0.8, 0.02),
            )
        },
    },
    Entry {
        name: "yard-true-wheels",
        must: Must::Hold(0.02, 0.3),
        make: |seed| Scene {
            sensor: Sensor::SICK,
            wheels: Some(Wheels::TRUE),
            ..Scene::new(
                spaces::yard(seed),
                Course::at(TruePose::new(-6.0, 0.0, 0.1))
                    .rest(1.0)
                    .drive(13.0, 0.8, 0.02),
            )
        },
    },
    Entry {
        name: "hall",
        must: Must::Follow(0.15, 1.0),
        make: |_| Scene {
            sensor: Sensor {
                reach: (0.05, 40.0),
                ..Sensor::LD06
            },
            ..Scene::new(
                spaces::hall(),
                Course::at(TruePose::new(-15.0, 1.0, 0.2))
                    .rest(1.0)
                    .drive(30.0, 0.8, -0.03),
            )
        },
    },
    Entry {
        name: "corridor",
        must: Must::Follow(0.4, 1.0),
        make: corridor,
    },
    Entry {
        name: "floor",
        must: Must::Follow(0.4, 1.0),
        make: |seed| {
            Scene::new(
                spaces::floor(40.0, seed),
                Course::at(TruePose::new(2.0, 0.0, 0.0))
                    .rest(1.0)
                    .drive(55.0, 0.6, 0.0)
                    .rest(2.0),
            )
        },
    },
    Entry {
        name: "floor-no-wheels",
        must: Must::Tell,
        make: |seed| Scene {
            wheels: None,
            ..Scene::new(
                spaces::floor(40.0, seed),
                Course::at(TruePose::new(2.0, 0.0, 0.0))
                    .rest(1.0)
                    .drive(55.0, 0.6, 0.0)
                    .rest(2.0),
            )
        },
    },
    Entry {
        name: "corridor-no-wheels",
        must: Must::Tell,
        make: |seed| Scene {
            wheels: None,
            ..corridor(seed)
        },
    },
    Entry {
        name: "wheels-start-over",
        must: Must::Follow(0.05, 1.0),
        make: |_| {
            with(Wheels {
                restarts: vec![27.3],
                ..Wheels::USUAL
            })
        },
    },
    Entry {
        name: "wheels-start-over-often",
        must: Must::Follow(0.05, 1.0),
        make: |_| {
            with(Wheels {
                restarts: vec![12.04, 19.3, 31.0, 44.2, 51.77],
                ..Wheels::USUAL
            })
        },
    },
    Entry {
        name: "wheels-jump",
        must: Must::Follow(0.05, 1.0),
        make: |_| {
            with(Wheels {
                jumps: vec![
                    (15.0, TruePose::new(0.8, -0.5, 0.6)),
                    (30.0, TruePose::new(-0.3, 0.2, -0.3)),
                    (45.0, TruePose::new(20.0, 3.0, 2.0)),
                ],
                ..Wheels::USUAL
            })
        },
    },
    Entry {
        name: "wheels-noisy",
        must: Must::Follow(0.05, 1.0),
        make: |_| {
            with(Wheels {
                jumping: (0.03, 0.02),
                ..Wheels::USUAL
            })
        },
    },
    Entry {
        name: "wheels-late-by-100-ms",
        must: Must::Follow(0.05, 1.0),
        make: |_| {
            with(Wheels {
                delay: 0.1,
                ..Wheels::USUAL
            })
        },
    },
    Entry {
        name: "wheels-jitter-100-ms",
        must: Must::Follow(0.05, 1.0),
        make: |_| {
            with(Wheels {
                jitter: 0.1,
                ..Wheels::USUAL
            })
        },
    },
    Entry {
        name: "wheels-5-hz",
        must: Must::Follow(0.05, 1.0),
        make: |_| {
            with(Wheels {
                rate: 5.0,
                ..Wheels::USUAL
            })
        },
    },
    Entry {
        name: "wheels-7-hz",
        must: Must::Follow(0.05, 1.0),
        make: |_| {
            with(Wheels {
                rate: 7.0,
                ..Wheels::USUAL
            })
        },
    },
    Entry {
        name: "wheels-stuck",
        must: Must::Follow(0.05, 1.0),
        make: |_| {
            with(Wheels {
                slips: vec![(10.0, 25.0, 0.0)],
                ..Wheels::USUAL
            })
        },
    },
    Entry {
        name: "wheels-slip",
        must: Must::Follow(0.05, 1.0),
        make: |_| {
            with(Wheels {
                slips: vec![(10.0, 14.0, 1.5), (20.0, 26.0, 2.0), (40.0, 45.0, 0.5)],
                ..Wheels::USUAL
            })
        },
    },
    Entry {
        name: "wheels-spin",
        must: Must::Follow(0.05, 1.0),
        make: |_| {
            with(Wheels {
                spins: vec![(0.4, 1.0, 0.6), (18.0, 22.0, 0.5)],
                ..Wheels::USUAL
            })
        },
    },
    Entry {
        name: "wheels-in-utm",
        must: Must::Follow(0.05, 1.0),
        make: |_| {
            with(Wheels {
                origin: TruePose::new(691_603.6, 5_335_854.2, 0.3),
                ..Wheels::USUAL
            })
        },
    },
    Entry {
        name: "wheels-10-km-off",
        must: Must::Follow(0.05, 1.0),
        make: |_| {
            with(Wheels {
                origin: TruePose::new(9000.0, -4000.0, -2.0),
                ..Wheels::USUAL
            })
        },
    },
];

fn with(wheels: Wheels) -> Scene {
    Scene {
        wheels: Some(wheels),
        ..flat()
    }
}
