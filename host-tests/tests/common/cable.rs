//! The demo's LD06, whose cable may be pulled out.

use beamfix::{
    geometry,
    lidar::ld06::{FRAME, check_code},
};
use beamfix_app::telemetry::Pose;
use beamfix_selftest::demo::Demo;

/// Time between two packets (µs).
pub const PACKET_US: u64 = 12 * 222;
/// Where an LD06's clock wraps (µs).
const WRAP_US: u64 = 30_000_000;

/// The lidar and the robot that carries it, which moves only while packets are taken.
pub struct Cable {
    demo: Demo,
    packets: u64,
    /// When the lidar's clock was at 0 (ms).
    start_ms: u64,
}

impl Cable {
    pub fn new() -> Self {
        Self {
            demo: Demo::new(),
            packets: 0,
            start_ms: 0,
        }
    }

    /// The next packet, by the lidar's clock.
    pub fn packet(&mut self) -> [u8; FRAME] {
        let mut packet = self.demo.packet();
        let us = self.packets * PACKET_US - 1000 * self.start_ms;
        self.packets += 1;
        let ms = us % WRAP_US / 1000;
        packet[44..46].copy_from_slice(&(ms as u16).to_le_bytes());
        packet[46] = check_code(&packet[..46]);
        packet
    }

    /// The lidar was without power: its clock starts over with the next packet.
    pub fn has_power_again(&mut self) {
        self.start_ms = self.packets * PACKET_US / 1000;
    }

    /// This is the first pose, from which all others are measured.
    pub fn first(&mut self, pose: &Pose) {
        let _ = self.truth(pose);
    }

    /// How far off the pose is (mm, °).
    pub fn off(&mut self, pose: &Pose) -> (f32, f32) {
        let [x, y, theta] = pose.pose;
        let off = self.truth(pose).between(geometry::Pose { x, y, theta });
        (1000.0 * off.distance(), off.theta.to_degrees())
    }

    /// Where the robot is at the pose's time, if that is less than 30 s after the lidar's start.
    fn truth(&mut self, pose: &Pose) -> geometry::Pose {
        let since_start_us = u64::from(pose.time_us) % WRAP_US;
        self.demo
            .truth((1000 * self.start_ms + since_start_us) as u32)
    }
}
