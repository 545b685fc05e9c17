//! Simulated sensors: what each lidar family would send for the world it is shown.
//!
//! Written from the format descriptions and independent of the parsers, check codes included.

pub mod camsense;
pub mod coin_d4;
pub mod damage;
pub mod delta;
pub mod grid;
pub mod ld06;
pub mod lslidar;
pub mod rplidar;
pub mod rplidar_ultra;
pub mod scip;
pub mod sick;
pub mod ydlidar;

use std::f64::consts::TAU;

use beamfix::lidar::model::Samples;
use beamfix::lidar::{Family, Model};

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

    /// Lets the motor be faster and slower by a share of its speed; false where the simulated sensor turns steadily only.
    fn sway(&mut self, share: f64) -> bool {
        share == 0.0
    }
}

/// The simulated sensor of a model.
#[must_use]
pub fn for_model(model: &Model) -> Box<dyn Encoder> {
    match model.family {
        Family::RplidarScan => turning(model, rplidar::Scan::new()),
        Family::RplidarExpress => turning(model, rplidar::Capsules::express()),
        Family::RplidarDense => turning(model, rplidar::Capsules::dense()),
        Family::RplidarUltra => turning(model, rplidar_ultra::Ultra::new()),
        Family::RplidarUltraDense => turning(model, rplidar_ultra::UltraDense::new()),
        Family::RplidarHq => turning(model, rplidar::Hq::new()),
        Family::Ydlidar(Samples::COIN_D4) => turning(model, coin_d4::Frames::new(model)),
        Family::Ydlidar(samples) => turning(model, ydlidar::Frames::new(samples, model)),
        Family::Lds01 => turning(model, grid::Frames::lds01()),
        Family::Lds006 => turning(model, grid::Frames::lds006()),
        Family::Xv11 => turning(model, grid::Frames::xv11()),
        Family::Xv11Early => turning(model, grid::Frames::xv11_early()),
        Family::Delta(sector) => turning(model, delta::Frames::new(sector, model)),
        Family::Camsense(sensor) => turning(model, camsense::Frames::new(sensor, model)),
        Family::Lslidar(returns) => turning(model, lslidar::Frames::new(returns)),
        Family::Scip(steps) => turning(model, scip::Scans::new(steps)),
        Family::Sick => turning(model, sick::Scans::new()),
        _ => Box::new(ld06::Sensor::for_model(model)),
    }
}

fn turning(model: &Model, wire: impl Wire + 'static) -> Box<dyn Encoder> {
    Box::new(Turning {
        model: *model,
        sweep: wire.sweep(model),
        wire,
        count: 0,
        last_mm: 1500.0,
    })
}

/// A measurement on its way into a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shot {
    /// Number of the beam since the start.
    pub beam: u64,
    /// When (µs).
    pub time_us: f64,
    /// Angle as the sensor writes it, within [0, 1) (turns).
    pub angle: f64,
    /// Distance (mm), 0 for none.
    pub mm: f64,
    /// Strength of the return, 0 without one.
    pub intensity: u8,
}

/// A family's frames.
pub trait Wire {
    /// Which way the beams look one after the other.
    fn sweep(&self, model: &Model) -> Sweep {
        Sweep::turning(model)
    }

    /// By how much (turns) a beam looks beside the angle that is written for it, at this distance (mm).
    fn shift(&self, _mm: f64) -> f64 {
        0.0
    }

    /// Takes the next measurement; appends the frame that it completes.
    fn add(&mut self, shot: Shot, line: &mut Vec<u8>);
}

/// Where the beams of a sensor look, and when.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// Angle of the first beam (turns).
    pub first: f64,
    /// From one beam to the next (turns).
    pub step: f64,
    /// Time from one beam to the next (µs).
    pub period_us: f64,
    /// Beams of a sweep, after which it begins anew.
    pub beams: u64,
    /// Time from one sweep to the next (µs).
    pub sweep_us: f64,
}

impl Sweep {
    /// Steadily around.
    #[must_use]
    pub fn turning(model: &Model) -> Self {
        let period_us = 1e6 / f64::from(model.points_per_s);
        Self {
            first: 0.123,
            step: f64::from(model.revolutions_per_10s) * 1e-7 * period_us,
            period_us,
            beams: u64::MAX,
            sweep_us: 0.0,
        }
    }

    fn time_us(&self, beam: u64) -> f64 {
        (beam / self.beams) as f64 * self.sweep_us + (beam % self.beams) as f64 * self.period_us
    }

    fn angle(&self, beam: u64) -> f64 {
        (self.first + self.step * (beam % self.beams) as f64).rem_euclid(1.0)
    }
}

/// A sensor of any family but LDROBOT's.
struct Turning<W> {
    model: Model,
    sweep: Sweep,
    wire: W,
    count: u64,
    last_mm: f64,
}

impl<W: Wire> Encoder for Turning<W> {
    fn next_time_us(&self) -> f64 {
        self.sweep.time_us(self.count)
    }

    fn fire(&mut self, look: &mut dyn FnMut(f64, f64) -> Option<Echo>, line: &mut Vec<u8>) {
        let angle = self.sweep.angle(self.count);
        let time_us = self.next_time_us();
        // A triangulating sensor looks past the angle by what the distance will say; the last one is near enough.
        let native = angle + self.wire.shift(self.last_mm);
        let echo = look(time_us, bearing(&self.model, native));
        if let Some(echo) = echo {
            self.last_mm = echo.range_mm;
        }
        let shot = Shot {
            beam: self.count,
            time_us,
            angle,
            mm: echo.map_or(0.0, |echo| echo.range_mm),
            intensity: echo.map_or(0, |echo| echo.intensity),
        };
        self.count += 1;
        self.wire.add(shot, line);
    }
}

/// Direction (radians, counter-clockwise from forward) of a model's own angle (turns).
#[must_use]
pub fn bearing(model: &Model, native: f64) -> f64 {
    let turned = native - f64::from(model.zero_cdeg) / 36_000.0;
    TAU * if model.counter_clockwise {
        turned
    } else {
        -turned
    }
}

/// Whole 1/64° of an angle (turns), within a turn.
fn q6(angle: f64) -> u16 {
    ((angle * 23_040.0).round() as i64).rem_euclid(23_040) as u16
}

/// XOR of bytes.
fn xor(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |a, b| a ^ b)
}

/// The check code that XV-11 and Camsense share, over 16-bit words.
fn fold(bytes: &[u8]) -> u16 {
    let mut sum: u64 = 0;
    for word in bytes.chunks(2) {
        sum = ((sum << 1) + u64::from(word[0]) + 256 * u64::from(word[1])) & 0xffff_ffff;
    }
    (((sum & 0x7fff) + (sum >> 15)) & 0x7fff) as u16
}
