//! What a board can check about itself: the tests on targets (`boards/*/tests/on_target.rs`) call these. Each panics where
//! something is not as it should be.

use heapless::Vec;

use beamfix_app::{App, command::Command, link, ring::Ring, telemetry::Telemetry};

use crate::demo::{Demo, FIRST_POSES};

/// The simulated lidar's bytes through the whole firmware: the poses have the bits that every machine finds.
pub fn poses_have_the_same_bits_as_everywhere<const N: usize>(app: &mut App<N>) {
    let found = FIRST_POSES.find(app, &mut Demo::new());
    assert_eq!(found, FIRST_POSES.hash);
}

/// A frame arrives, a damaged one is counted.
pub fn frames_come_back_and_damage_is_counted() {
    let wheels = Command::Wheels {
        x: 1.5,
        y: 0.0,
        theta: -0.25,
    };
    let mut frame = Vec::<u8, { link::FRAME }>::new();
    assert!(link::append(&wheels, &mut frame));
    let mut receiver = link::Receiver::new();
    let mut came = 0;
    for byte in &frame {
        came += u32::from(receiver.push::<Command>(*byte) == Some(wheels));
    }
    frame[3] ^= 4;
    for byte in &frame {
        came += u32::from(receiver.push::<Command>(*byte).is_some());
    }
    assert_eq!((came, receiver.counters().errors), (1, 1));
}

/// With interrupts masked and unmasked as on this chip.
pub fn a_ring_counts_what_it_has_no_room_for() {
    let ring = Ring::<16>::new();
    (0..20).for_each(|byte| ring.push(byte));
    ring.lose(3);
    assert_eq!(ring.lost(), 7);
    let mut bytes = [0; 12];
    assert_eq!(ring.read(&mut bytes), 12);
    assert!((0..12).eq(bytes));
    assert_eq!(ring.read(&mut bytes), 4);
    assert!(bytes.starts_with(&[12, 13, 14, 15]));
    assert!(ring.is_empty());
}

/// A command is answered.
pub fn health_is_told_when_asked_for<const N: usize>(app: &mut App<N>) {
    let mut ask = Vec::<u8, 16>::new();
    assert!(link::append(&Command::Health, &mut ask));
    let mut receiver = link::Receiver::new();
    let mut answers = 0;
    app.command_all(&ask, |sent| {
        for &byte in sent {
            let message = receiver.push::<Telemetry>(byte);
            answers += u32::from(
                matches!(message, Some(Telemetry::Health(health)) if health.commands == 1),
            );
        }
    });
    assert_eq!(answers, 1);
}
