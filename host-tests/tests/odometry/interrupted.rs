//! A lidar that does not see the robot's surroundings for a while: its cable is pulled out or has a loose contact, or
//! somebody stands before it. The application's poses afterwards, for every point of a turn at which that may begin.

use crate::common::cable::{Cable, PACKET_US};
use beamfix::lidar::ld06::{FRAME, check_code};
use beamfix_app::{
    BEAMS,
    link::Receiver,
    telemetry::{Pose, Telemetry},
};
use host_tests::board::Here;

/// Packets of a turn of the lidar, nearly.
const TURN: u64 = 38;

/// What happens meanwhile.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Meanwhile {
    /// The robot stands, and the lidar's clock starts over.
    NoPower,
    /// The robot drives on, and the lidar turns.
    LooseContact,
    /// The robot drives on; every beam is 15 cm long.
    Covered,
}

/// The board's application, a lidar, and the poses that came.
struct Robot {
    app: Here,
    receiver: Receiver,
    cable: Cable,
    poses: Vec<Pose>,
}

impl Robot {
    fn new() -> Self {
        let mut app = Here::new(BEAMS);
        let _ = app.ready();
        Self {
            app,
            receiver: Receiver::new(),
            cable: Cable::new(),
            poses: Vec::new(),
        }
    }

    fn takes(&mut self, bytes: &[u8]) {
        let mut sent = Vec::new();
        self.app.lidar(bytes, |out| sent.extend_from_slice(out));
        for byte in sent {
            if let Some(Telemetry::Pose(pose)) = self.receiver.push(byte) {
                if self.poses.is_empty() {
                    self.cable.first(&pose);
                }
                self.poses.push(pose);
            }
        }
    }

    fn drives(&mut self, packets: u64) {
        for _ in 0..packets {
            let packet = self.cable.packet();
            self.takes(&packet);
        }
    }

    fn is_interrupted(&mut self, packets: u64, meanwhile: Meanwhile) {
        if meanwhile != Meanwhile::Covered {
            let half = self.cable.packet();
            self.takes(&half[..FRAME / 2]);
        }
        match meanwhile {
            Meanwhile::NoPower => self.cable.has_power_again(),
            Meanwhile::LooseContact => {
                for _ in 0..packets {
                    let _ = self.cable.packet();
                }
            }
            Meanwhile::Covered => {
                for _ in 0..packets {
                    let packet = covered(self.cable.packet());
                    self.takes(&packet);
                }
            }
        }
    }

    /// By its last pose.
    fn is_where_it_should_be(&mut self) -> bool {
        let (mm, degrees) = self.cable.off(self.poses.last().expect("a pose"));
        mm < 20.0 && degrees.abs() < 0.3
    }
}

/// All ranges 15 cm.
fn covered(mut packet: [u8; FRAME]) -> [u8; FRAME] {
    for point in packet[6..42].chunks_exact_mut(3) {
        point[..2].copy_from_slice(&150u16.to_le_bytes());
    }
    packet[46] = check_code(&packet[..46]);
    packet
}

/// Interrupted at each point of the turn after `after` packets, for so long.
fn tried(after: u64, ms: u64, meanwhile: Meanwhile) {
    let mut astray = Vec::new();
    for packets in after..after + TURN {
        let mut robot = Robot::new();
        robot.drives(packets);
        robot.is_interrupted(1000 * ms / PACKET_US, meanwhile);
        // Three seconds more.
        robot.drives(30 * TURN);
        if !robot.is_where_it_should_be() {
            astray.push(packets);
        }
    }
    assert!(
        astray.is_empty(),
        "{meanwhile:?} for {ms} ms: astray if it began after {astray:?} packets"
    );
}

#[test]
fn without_power_the_robot_stays_where_it_was() {
    // While it quickens, and at full speed.
    for after in [700, 1200] {
        tried(after, 0, Meanwhile::NoPower);
    }
}

#[test]
fn over_a_loose_contact_the_robot_is_followed() {
    for ms in [50, 300, 600, 900, 1200] {
        tried(1200, ms, Meanwhile::LooseContact);
    }
}

#[test]
fn who_stands_before_the_lidar_for_less_than_a_second_changes_nothing() {
    for ms in [200, 500, 800] {
        tried(1200, ms, Meanwhile::Covered);
    }
}
