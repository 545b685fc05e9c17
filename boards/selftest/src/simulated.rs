//! A board whose lidar is simulated on it.

use beamfix::geometry::Pose;
use beamfix_app::{ring::Ring, run::Hardware, telemetry::Reset};

use crate::demo::Demo;

/// A board's hardware with the lidar simulated: its bytes go into the lidar's ring, and the error of each pose is told.
pub struct Simulated<H> {
    hardware: H,
    demo: Demo,
}

impl<H> Simulated<H> {
    /// The robot stands at the start of its circle.
    #[must_use]
    pub const fn new(hardware: H) -> Self {
        Self {
            hardware,
            demo: Demo::new(),
        }
    }
}

impl<H: Hardware> Hardware for Simulated<H> {
    const ASKS: bool = H::ASKS;

    fn reset(&mut self) -> Reset {
        self.hardware.reset()
    }

    fn now_us(&mut self) -> u32 {
        self.hardware.now_us()
    }

    fn send(&mut self, bytes: &[u8]) {
        self.hardware.send(bytes);
    }

    fn send_to_lidar(&mut self, bytes: &[u8]) {
        self.hardware.send_to_lidar(bytes);
    }

    fn set_lidar_baud(&mut self, baud: u32) {
        self.hardware.set_lidar_baud(baud);
    }

    fn feed_watchdog(&mut self) {
        self.hardware.feed_watchdog();
    }

    fn wait(&mut self) {
        self.hardware.wait();
    }

    fn log(&mut self, pose: Pose) {
        self.hardware.log(pose);
    }

    fn simulate<const L: usize>(&mut self, now_us: u32, lidar: &Ring<L>) {
        self.demo.advance(now_us, |byte| lidar.push(byte));
    }

    fn truth(&mut self, time_us: u32) -> Option<Pose> {
        Some(self.demo.truth(time_us))
    }
}
