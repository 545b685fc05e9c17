//! Simulated sensors: what each lidar family would send for the world it is shown.
//!
//! Written from the format descriptions and independent of the parsers, check codes included.

pub mod ld06;

/// What a beam of a simulated sensor meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Echo {
    /// Distance (mm).
    pub range_mm: f64,
    /// Strength of the return.
    pub intensity: u8,
}

/// A sensor that measures one beam after the other and now and then has a frame to send.
pub trait Encoder {
    /// When the next beam is measured (µs since the start).
    fn next_time_us(&self) -> f64;

    /// Measures the next beam, and appends the frame that it completes.
    ///
    /// `look` says what lies, at a time (µs), in a direction (radians, counter-clockwise from the sensor's front).
    fn fire(&mut self, look: &mut dyn FnMut(f64, f64) -> Option<Echo>, line: &mut Vec<u8>);
}
