//! Noise by data sheets, and what drifts to one side over time.

use super::{Entry, Must, blind_flat, flat, furnished, standing, true_wheels};
use crate::pose::TruePose;
use crate::scene::Scene;
use crate::sensor::Sensor;
use crate::{Course, scenes};

pub(super) const ALL: &[Entry] = &[
    Entry {
        name: "standing-1-cm",
        must: Must::Follow(0.01, 0.2),
        make: |_| noisy(standing(20.0), (0.01, 0.0)),
    },
    Entry {
        name: "standing-2-cm",
        must: Must::Follow(0.02, 0.3),
        make: |_| noisy(standing(20.0), (0.02, 0.0)),
    },
    Entry {
        name: "standing-3-cm",
        must: Must::Follow(0.03, 0.5),
        make: |_| noisy(standing(20.0), (0.03, 0.0)),
    },
    Entry {
        name: "standing-5-cm",
        must: Must::Follow(0.05, 1.0),
        make: |_| noisy(standing(20.0), (0.05, 0.0)),
    },
    Entry {
        name: "standing-5-cm-mirrored",
        must: Must::Follow(0.05, 1.0),
        make: |_| noisy(standing(20.0), (0.05, 0.0)).mirrored(),
    },
    Entry {
        name: "drive-5-cm",
        must: Must::Follow(0.2, 2.0),
        make: |_| noisy(flat(), (0.05, 0.0)),
    },
    Entry {
        name: "drive-5-cm-mirrored",
        must: Must::Follow(0.2, 2.0),
        make: |_| noisy(flat(), (0.05, 0.0)).mirrored(),
    },
    Entry {
        name: "drive-3-cm-no-wheels",
        must: Must::Follow(0.2, 2.0),
        make: |_| noisy(blind_flat(), (0.03, 0.0)),
    },
    Entry {
        name: "drive-1-cm-and-2-percent",
        must: Must::Follow(0.1, 1.0),
        make: |_| noisy(flat(), (0.01, 0.02)),
    },
    Entry {
        name: "drive-3.5-percent",
        must: Must::Follow(0.1, 1.0),
        make: |_| noisy(flat(), (0.005, 0.035)),
    },
    Entry {
        name: "drive-3.5-percent-mirrored",
        must: Must::Follow(0.1, 1.0),
        make: |_| noisy(flat(), (0.005, 0.035)).mirrored(),
    },
    Entry {
        name: "lds-01",
        must: Must::Follow(0.1, 1.0),
        make: |_| Scene {
            sensor: Sensor {
                beams: 360,
                rate: 5.0,
                sigma: (0.01, 0.025),
                reach: (0.12, 3.5),
                clockwise: false,
                ..Sensor::LD06
            },
            ..flat()
        },
    },
    Entry {
        name: "rounds-5-min",
        must: Must::Follow(0.05, 1.0),
        make: |_| rounds(8),
    },
    Entry {
        name: "rounds-5-min-mirrored",
        must: Must::Follow(0.05, 1.0),
        make: |_| rounds(8).mirrored(),
    },
];

/// Scenes that take too long for every run of the table.
pub(super) const LONG: &[Entry] = &[
    Entry {
        name: "rounds-55-min",
        must: Must::Follow(0.2, 1.0),
        make: |_| rounds(88),
    },
    Entry {
        name: "rounds-55-min-mirrored",
        must: Must::Follow(0.2, 1.0),
        make: |_| rounds(88).mirrored(),
    },
    Entry {
        name: "flat-for-an-hour",
        must: Must::Follow(0.3, 2.0),
        make: |_| {
            let (start, way) = scenes::flat_round();
            let mut course = Course::at(start).rest(1.0);
            for _ in 0..50 {
                course = course.through(&way);
            }
            Scene { course, ..flat() }
        },
    },
];

fn noisy(scene: Scene, sigma: (f64, f64)) -> Scene {
    Scene {
        sensor: Sensor {
            sigma,
            ..scene.sensor
        },
        ..scene
    }
}

/// So many rounds of 37 s on a rounded way in the furnished room, with true wheels.
fn rounds(count: usize) -> Scene {
    use core::f64::consts::FRAC_PI_2;
    let mut round = Course::at(TruePose::new(-0.6, -0.5, 0.0));
    for long in [3.6, 2.6, 3.6, 2.6] {
        round = round
            .drive(long, 0.25, 0.0)
            .rest(0.5)
            .rotate(FRAC_PI_2, 0.8)
            .rest(0.5);
    }
    true_wheels(Scene::new(furnished(), round.repeated(count)))
}
