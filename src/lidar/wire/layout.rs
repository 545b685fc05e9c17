//! Frames that stand for themselves, and points that lie in equal steps.
//!
//! Most families send such frames: what a [`Layout`] adds is where the fields are. Families whose frames depend on what
//! came before have a [`Format`] of their own.

use core::marker::PhantomData;

use heapless::Vec;

use super::angle::Revolutions;
use super::framing::Verdict;
use super::packet::{Packet, Reading, View};
use super::parser::{Format, Parser};
use super::timing::Pace;
use crate::lidar::model::Model;
use crate::scan::NoReturn;

/// Where a protocol's fields are.
pub trait Layout {
    /// One frame's measurements.
    type Packet: Packet;

    /// The quality's bits that a beam has no room for.
    const QUALITY_SHIFT: u8 = 0;

    /// Whether a frame begins with these bytes.
    fn judge(bytes: &[u8]) -> Verdict;

    /// Measurements of a frame that [`Layout::judge`] accepted.
    fn packet(frame: &[u8], context: Context<'_>) -> Option<Self::Packet>;
}

/// The [`Format`] of a [`Layout`]. About 40 bytes.
#[derive(Debug, Clone)]
pub struct Plain<Y> {
    base: View,
    revolutions: Revolutions,
    layout: PhantomData<Y>,
}

impl<Y: Layout, const L: usize> Parser<Plain<Y>, L> {
    /// Any model of the family.
    #[must_use]
    pub const fn for_model(model: &Model) -> Self {
        let format = Plain {
            base: View::of(model, Y::QUALITY_SHIFT),
            revolutions: Revolutions::new(),
            layout: PhantomData,
        };
        Self::with_format(format, model.baud)
    }
}

impl<Y: Layout> Format for Plain<Y> {
    type Packet = Y::Packet;

    fn judge(&self, bytes: &[u8]) -> Verdict {
        Y::judge(bytes)
    }

    fn packet(&mut self, frame: &[u8], _: bool, pace: &mut Pace) -> Option<Y::Packet> {
        let context = Context {
            base: self.base,
            revolutions: &mut self.revolutions,
            pace,
            bytes: frame.len() as u16,
        };
        Y::packet(frame, context)
    }
}

/// What a frame's beams depend on besides the frame.
#[derive(Debug)]
pub struct Context<'a> {
    /// What all packets of the model have in common.
    pub(crate) base: View,
    pub(crate) revolutions: &'a mut Revolutions,
    pub(crate) pace: &'a mut Pace,
    /// Bytes of the frame.
    pub(crate) bytes: u16,
}

impl Context<'_> {
    /// How a fan's points become beams, `period_q8` (µs/256) apart.
    pub(crate) fn view<const B: usize>(self, fan: &Fan<B>, period_q8: u32) -> View {
        let count = fan.count();
        View {
            first_us: self.pace.first_us(count, period_q8, self.bytes),
            period_q8,
            revolution_start: self.revolutions.find(fan.first, fan.step, count),
            ..self.base
        }
    }
}

/// Points of so many bytes each, at angles in equal steps. B bytes at most; B + 16 bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Fan<const B: usize> {
    /// Angle of the first point; 2³² is a turn.
    pub(crate) first: u32,
    /// From one to the next.
    pub(crate) step: u32,
    point_bytes: u8,
    points: Vec<u8, B>,
}

impl<const B: usize> Fan<B> {
    /// `None` for more points than there is room for.
    pub(crate) fn new(first: u32, step: u32, point_bytes: u8, points: &[u8]) -> Option<Self> {
        Some(Self {
            first,
            step,
            point_bytes,
            points: Vec::from_slice(points).ok()?,
        })
    }

    /// Number of points.
    pub(crate) fn count(&self) -> u16 {
        let count = self.points.len().checked_div(self.point_bytes.into());
        count.unwrap_or(0) as u16
    }

    /// In their order; `read` gives range and quality of a point's bytes.
    pub(crate) fn readings(
        &self,
        read: impl Fn(&[u8]) -> (Result<u32, NoReturn>, u16),
    ) -> impl Iterator<Item = Reading> {
        let mut angle = self.first;
        self.points
            .chunks_exact(usize::from(self.point_bytes).max(1))
            .map(move |point| {
                let (range, quality) = read(point);
                let reading = Reading {
                    angle,
                    range,
                    quality,
                };
                angle = angle.wrapping_add(self.step);
                reading
            })
    }
}
