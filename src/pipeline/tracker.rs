//! From beams to poses.

use super::{estimator::Estimator, gyro::Gyro, wheels::Wheels};
use crate::{
    geometry::{EgoMotion, Pose},
    scan::{Assembler, Beam, Scan},
};

/// Beams, wheels and a gyroscope in, a step for each revolution out.
///
/// An [`Assembler`], the estimator, and 150 bytes.
#[derive(Debug)]
pub struct Tracker<E, const N: usize> {
    assembler: Assembler<N>,
    estimator: E,
    inertial: Inertial,
}

/// What is known of the robot's motion without looking around.
#[derive(Debug)]
struct Inertial {
    wheels: Wheels,
    gyro: Gyro,
    now_us: u32,
}

/// A revolution that went through the estimator.
#[derive(Debug)]
pub struct Revolution<'a, E: Estimator<N>, const N: usize> {
    /// What the estimator made of it.
    pub step: &'a E::Step,
    /// Its beams.
    pub scan: &'a Scan<N>,
    /// The estimator behind the step.
    pub estimator: &'a E,
}

impl<E, const N: usize> Tracker<E, N> {
    /// Waits for the first whole revolution.
    #[must_use]
    pub const fn new(estimator: E) -> Self {
        Self {
            assembler: Assembler::new(),
            estimator,
            inertial: Inertial::new(),
        }
    }

    /// The same around an estimator of zeros: all bytes are zero.
    pub(super) const fn zero(estimator: E) -> Self {
        Self {
            inertial: Inertial {
                gyro: Gyro::ZERO,
                ..Inertial::new()
            },
            assembler: Assembler::new(),
            estimator,
        }
    }

    /// Begins anew in its place, but for the estimator.
    pub(super) fn restart(&mut self) {
        self.assembler.reset();
        self.inertial = Inertial::new();
    }

    /// Says when the beams pushed next came in (µs, wrapping).
    pub fn set_time(&mut self, now_us: u32) {
        self.inertial.now_us = now_us;
    }

    /// Takes the robot's pose by its wheels at a time (µs), in a frame of their own; a pose that is not finite is left
    /// out. Messages may come at any rate from two a second on, four if one may be lost.
    pub fn push_wheels(&mut self, time_us: u32, pose: Pose) {
        self.inertial.wheels.push(time_us, pose);
    }

    /// Takes the robot's rate of turn by a gyroscope at a time (µs), counter-clockwise (rad/s). Messages should come at
    /// least 20 times a second, so that one may be lost: over a gap of more than 100 ms the gyroscope tells nothing.
    pub fn push_gyro(&mut self, time_us: u32, rate: f32) {
        self.inertial.gyro.push(time_us, rate);
    }

    /// The estimator.
    pub const fn estimator(&self) -> &E {
        &self.estimator
    }

    /// The estimator, to be told where the robot starts.
    pub const fn estimator_mut(&mut self) -> &mut E {
        &mut self.estimator
    }

    /// The estimator alone, at the end.
    #[cfg(feature = "internals")]
    #[must_use]
    pub fn into_estimator(self) -> E {
        self.estimator
    }

    /// Beams that found no room because a revolution had more than N, and the beams of interrupted revolutions; wraps.
    pub fn refused_beams(&self) -> u32 {
        self.assembler.refused_beams()
    }
}

impl<E: Estimator<N>, const N: usize> Tracker<E, N> {
    /// Takes the beams of a packet in order, of which number `start` is the first of a revolution.
    pub fn push_packet(
        &mut self,
        beams: impl Iterator<Item = Beam>,
        start: Option<usize>,
        mut ready: impl FnMut(Revolution<'_, E, N>),
    ) {
        let Self {
            assembler,
            estimator,
            inertial,
        } = self;
        assembler.push_packet(beams, start, |scan| {
            let step = estimator.update(scan, inertial.motion());
            ready(Revolution {
                step: &step,
                scan,
                estimator,
            });
        });
    }

    /// Takes the beams of a whole scan, of a log that has no bytes. The time of its last beam becomes the time of now.
    pub fn push_scan(
        &mut self,
        beams: impl Iterator<Item = Beam>,
        mut ready: impl FnMut(Revolution<'_, E, N>),
    ) {
        self.assembler.assign(beams);
        let scan = self.assembler.scan();
        self.inertial.now_us = scan.end_us();
        let step = self.estimator.update(scan, self.inertial.motion());
        ready(Revolution {
            step: &step,
            scan,
            estimator: &self.estimator,
        });
    }
}

impl Inertial {
    const fn new() -> Self {
        Self {
            wheels: Wheels::new(),
            gyro: Gyro::new(),
            now_us: 0,
        }
    }

    /// Motion from the last revolution's end until now. Apart, so that its memory is not on the stack during a match.
    #[inline(never)]
    fn motion(&mut self) -> EgoMotion {
        EgoMotion {
            wheels: self.wheels.motion_until(self.now_us),
            rotation: self.gyro.rotation_until(self.now_us),
        }
    }
}
