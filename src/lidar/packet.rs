//! What all packets have in common: readings in the sensor's terms, and the way from there to beams.

use super::Model;
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

/// How a packet's readings become beams: direction, sense and time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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

    /// In the order of measurement; angles counter-clockwise from forward, times in the parser's clock.
    fn beams(&self) -> impl Iterator<Item = Beam> + '_ {
        let view = *self.view();
        let mut age_q8 = 0u32;
        self.readings().map(move |reading| {
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

    /// As the sensor itself gives them, in the same order.
    fn samples(&self) -> impl Iterator<Item = Sample> + '_ {
        self.readings().map(|reading| Sample {
            // 24 bits, which f32 holds: less than a turn stays less than 360.
            angle_deg: (reading.angle >> 8) as f32 * (360.0 / 16_777_216.0),
            range_mm: reading.range.ok().map(|quarters| quarters as f32 * 0.25),
            quality: reading.quality,
        })
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

/// Finds where revolutions begin in angles that grow steadily.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Revolutions {
    /// Last angle seen; 2³² is a turn.
    last: u32,
}

impl Revolutions {
    pub(crate) const fn new() -> Self {
        Self { last: 0 }
    }

    /// Number of the first of `count` angles, `step` apart, that is more than half a turn less than the one before.
    pub(crate) fn find(&mut self, first: u32, step: u32, count: u16) -> Option<u16> {
        const HALF: u32 = 1 << 31;
        if count == 0 {
            return None;
        }
        let before = self.last;
        let span = step.wrapping_mul(u32::from(count.saturating_sub(1)));
        self.last = first.wrapping_add(span);
        if before > first && before - first > HALF {
            return Some(0);
        }
        if self.last >= first {
            return None;
        }
        let mut angle = first;
        (1..count).find(|_| {
            let (next, wrapped) = angle.overflowing_add(step);
            angle = next;
            wrapped
        })
    }
}

/// Hundredths of a degree as a fraction of 2³²: a product instead of a quotient; at a full turn it is 3e-6 of it too
/// large.
pub(crate) const fn from_cdeg(cdeg: u32) -> u32 {
    cdeg.wrapping_mul(119_304)
        .wrapping_add((cdeg.wrapping_mul(165)) >> 8)
}

/// 1/64 degrees as a fraction of 2³².
pub(crate) const fn from_deg_q6(q6: u32) -> u32 {
    q6.wrapping_mul(186_413).wrapping_add(q6 >> 1)
}

/// 1/128 degrees as a fraction of 2³².
pub(crate) const fn from_deg_q7(q7: u32) -> u32 {
    q7.wrapping_mul(93_206)
        .wrapping_add((q7.wrapping_mul(193)) >> 8)
}

/// `span`, a fraction of 2³², divided into `parts`; 0 for none.
pub(crate) const fn divided(span: u32, parts: u32) -> u32 {
    match span.checked_div(parts) {
        Some(part) => part,
        None => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_convert_to_within_a_thousandth_of_a_degree() {
        for cdeg in 0..36_000u32 {
            let exact = f64::from(cdeg) / 36_000.0 * 4_294_967_296.0;
            assert!((f64::from(from_cdeg(cdeg)) - exact).abs() < 600.0, "{cdeg}");
        }
        for q6 in 0..23_040u32 {
            let exact = f64::from(q6) / 23_040.0 * 4_294_967_296.0;
            assert!((f64::from(from_deg_q6(q6)) - exact).abs() < 600.0, "{q6}");
        }
        for q7 in 0..46_080u32 {
            let exact = f64::from(q7) / 46_080.0 * 4_294_967_296.0;
            assert!((f64::from(from_deg_q7(q7)) - exact).abs() < 600.0, "{q7}");
        }
        assert_eq!(
            (from_cdeg(36_000) >> 8, from_deg_q6(23_040) >> 9),
            (0xffffff, 0x7fffff)
        );
    }

    #[test]
    fn revolutions_are_found_between_and_within_packets() {
        let mut revolutions = Revolutions::new();
        let degree = from_cdeg(100);
        for (first, count, expected) in [
            (1000, 5, None),
            (35_050, 20, Some(10)),
            (1000, 5, None),
            (30_000, 50, None),
            (0, 4, Some(0)),
            (9000, 4, None),
            (8000, 4, None),
        ] {
            let found = revolutions.find(from_cdeg(first), degree, count);
            assert_eq!(found, expected, "{first}");
        }
    }
}
