//! What all packets have in common: readings in the sensor's terms, and the way from there to beams.

use super::angle::from_cdeg;
use crate::lidar::model::Model;
use crate::scan::{Beam, Bearing, NoReturn, Range};

/// One measurement as it stands in a frame, after the maker's corrections.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reading {
    /// In the sensor's own sense; 2³² is a turn, so that it wraps by itself.
    pub angle: u32,
    /// Distance (mm/4, not 0), or why there is none.
    pub range: Result<u32, NoReturn>,
    /// Strength of the return in the sensor's own unit, 0 where it gives none.
    pub quality: u16,
}

impl Reading {
    /// Distance of so many quarter millimetres, of which 0 means none.
    pub(crate) const fn range_q2(quarters: u32) -> Result<u32, NoReturn> {
        if quarters == 0 {
            Err(NoReturn::Nothing)
        } else {
            Ok(quarters)
        }
    }
}

/// One measurement in the sensor's own terms: for decoding and comparison, not for matching.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sample {
    /// In the sensor's own sense, after its maker's corrections, in `[0, 360)` (degrees).
    pub angle_deg: f32,
    /// Distance (mm), if there is one.
    pub range_mm: Option<f32>,
    /// Strength of the return in the sensor's own unit, 0 where it gives none.
    pub quality: u16,
}

impl Sample {
    /// The reading in degrees and millimetres.
    pub(crate) fn of(reading: Reading) -> Self {
        Self {
            // 24 bits, which f32 holds: less than a turn stays less than 360.
            angle_deg: (reading.angle >> 8) as f32 * (360.0 / 16_777_216.0),
            range_mm: reading.range.ok().map(|quarters| quarters as f32 * 0.25),
            quality: reading.quality,
        }
    }
}

/// How a packet's readings become beams: direction, sense and time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct View {
    /// When the first reading was measured (µs).
    pub first_us: u32,
    /// Time from one to the next (µs/256).
    pub period_q8: u32,
    /// The sensor's angle that looks forward; 2³² is a turn.
    pub zero: u32,
    /// Whether the sensor's angle grows counter-clockwise.
    pub counter_clockwise: bool,
    /// The quality's bits that a beam has no room for.
    pub quality_shift: u8,
    /// Which reading is the first of a new revolution, if one is.
    pub revolution_start: Option<u16>,
    /// The line has just been lost and nothing proves that it was found again: beams without ranges.
    pub doubtful: bool,
}

impl View {
    /// What a model's packets have in common, with beams of a quality of 8 and `quality_shift` bits.
    #[must_use]
    pub const fn of(model: &Model, quality_shift: u8) -> Self {
        Self {
            first_us: 0,
            period_q8: model.period_q8(),
            zero: from_cdeg(model.zero_cdeg as u32),
            counter_clockwise: model.counter_clockwise,
            quality_shift,
            revolution_start: None,
            doubtful: false,
        }
    }
}

/// The measurements of one packet.
pub trait Packet {
    /// How its readings become beams.
    fn view(&self) -> &View;

    /// As they stand in the frame, in the order of measurement.
    fn readings(&self) -> impl Iterator<Item = Reading> + '_;

    /// In the order of the frame, which is that of measurement unless a mirror takes every other one in its next turn; angles
    /// counter-clockwise from forward, times in the parser's clock.
    fn beams(&self) -> impl Iterator<Item = Beam> + '_ {
        beams(*self.view(), self.readings())
    }

    /// As the sensor itself gives them, in the same order: where a maker corrects the angle on the host only, before that.
    fn samples(&self) -> impl Iterator<Item = Sample> + '_ {
        self.readings().map(Sample::of)
    }

    /// Speed of the motor (rpm), where the frame tells.
    fn speed_rpm(&self) -> Option<f32> {
        None
    }

    /// Number of the beam that is the first of a new revolution, if one is among them.
    fn revolution_start(&self) -> Option<usize> {
        self.view().revolution_start.map(usize::from)
    }
}

/// Beams of readings that follow each other at an even pace.
pub(crate) fn beams(
    view: View,
    readings: impl Iterator<Item = Reading>,
) -> impl Iterator<Item = Beam> {
    let mut age_q8 = 0u32;
    readings.map(move |reading| {
        let turned = reading.angle.wrapping_sub(view.zero);
        let angle = if view.counter_clockwise {
            turned
        } else {
            turned.wrapping_neg()
        };
        let quality = reading.quality >> view.quality_shift;
        let beam = Beam {
            bearing: Bearing((angle.wrapping_add(0x8000) >> 16) as u16),
            range: match reading.range {
                _ if view.doubtful => Range::none(NoReturn::Doubtful),
                Ok(quarters) => Range::from_mm(quarters.saturating_add(2) >> 2),
                Err(reason) => Range::none(reason),
            },
            time_us: view.first_us.wrapping_add(age_q8 >> 8),
            quality: if quality > 255 { 255 } else { quality as u8 },
        };
        age_q8 = age_q8.wrapping_add(view.period_q8);
        beam
    })
}
