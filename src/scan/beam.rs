//! One measurement: its direction, its distance or why there is none, its time.

use crate::math;

/// Direction in the sensor's plane, counter-clockwise from forward, in 1/65536 turn (0.0055°).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Bearing(pub u16);

impl Bearing {
    /// Nearest bearing to `radians`; any number of turns up to a few thousand.
    #[must_use]
    pub fn from_radians(radians: f32) -> Self {
        const PER_RADIAN: f32 = 32768.0 / core::f32::consts::PI;
        Self(math::round_to_i32(radians * PER_RADIAN) as u16)
    }

    /// Nearest bearing to an angle that grows clockwise, in hundredths of a degree: the unit on most wires.
    #[cfg(test)]
    pub(crate) const fn from_clockwise_cdeg(cdeg: u32) -> Self {
        Self((0u16).wrapping_sub((((cdeg % 36_000) * 65_536 + 18_000) / 36_000) as u16))
    }

    /// In `[-π, π)` (rad).
    #[must_use]
    pub fn radians(self) -> f32 {
        const RADIANS: f32 = core::f32::consts::PI / 32768.0;
        f32::from(self.0 as i16) * RADIANS
    }
}

/// Distance in whole millimetres up to 65.279 m, or the reason why there is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Range(u16);

/// Why a beam has no range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum NoReturn {
    /// Nothing came back, and the sensor does not say why.
    Nothing,
    /// Nearer than the sensor measures.
    TooNear,
    /// Farther than the sensor measures, or than a range can hold.
    TooFar,
    /// The sensor distrusts its own reading: too weak, ambient light, a mirror.
    Doubtful,
    /// The sensor's own error code.
    Sensor(u8),
    /// Removed by a filter here.
    Filtered,
}

impl Range {
    /// Longest range there is (mm).
    pub const MAX_MM: u16 = 0xfeff;

    /// Range of `mm` millimetres; 0 is [`NoReturn::Nothing`], more than [`Range::MAX_MM`] is [`NoReturn::TooFar`].
    #[must_use]
    pub const fn from_mm(mm: u32) -> Self {
        if mm == 0 {
            Self::none(NoReturn::Nothing)
        } else if mm > Self::MAX_MM as u32 {
            Self::none(NoReturn::TooFar)
        } else {
            Self(mm as u16)
        }
    }

    /// Range of `metres`, rounded to a millimetre.
    ///
    /// Zero, negative and NaN are [`NoReturn::Nothing`]; infinite and beyond 65.279 m are [`NoReturn::TooFar`].
    #[must_use]
    pub fn from_metres(metres: f32) -> Self {
        if !(metres > 0.0) {
            return Self::none(NoReturn::Nothing);
        }
        if metres > 66.0 {
            return Self::none(NoReturn::TooFar);
        }
        Self::from_mm(math::round_to_i32(metres * 1000.0).unsigned_abs())
    }

    /// No range, for this reason. A sensor's error code keeps its low 7 bits.
    #[must_use]
    pub const fn none(reason: NoReturn) -> Self {
        Self(match reason {
            NoReturn::Nothing => 0xff00,
            NoReturn::TooNear => 0xff01,
            NoReturn::TooFar => 0xff02,
            NoReturn::Doubtful => 0xff03,
            NoReturn::Filtered => 0xff04,
            NoReturn::Sensor(code) => 0xff80 | (code & 0x7f) as u16,
        })
    }

    /// Millimetres, or why there are none.
    pub const fn mm(self) -> Result<u16, NoReturn> {
        match self.0 {
            0xff01 => Err(NoReturn::TooNear),
            0xff02 => Err(NoReturn::TooFar),
            0xff03 => Err(NoReturn::Doubtful),
            0xff04 => Err(NoReturn::Filtered),
            code @ 0xff80.. => Err(NoReturn::Sensor((code & 0x7f) as u8)),
            0 | 0xff00.. => Err(NoReturn::Nothing),
            mm => Ok(mm),
        }
    }

    /// Millimetres if they are at least `least`, which is not 0, and at most `span` more, which is at most
    /// [`Range::MAX_MM`].
    #[must_use]
    pub(super) const fn within(self, least: u16, span: u16) -> Option<u16> {
        // Reasons are above every range, and nothing is 0.
        if self.0.wrapping_sub(least) <= span {
            Some(self.0)
        } else {
            None
        }
    }

    /// Metres, or why there are none.
    pub fn metres(self) -> Result<f32, NoReturn> {
        self.mm().map(|mm| f32::from(mm) * 1e-3)
    }

    /// Whether there is a distance.
    #[must_use]
    pub const fn is_some(self) -> bool {
        self.0 != 0 && self.0 <= Self::MAX_MM
    }
}

/// One measurement of a lidar.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Beam {
    /// Counter-clockwise from the sensor's forward axis.
    pub bearing: Bearing,
    /// Distance, or why there is none.
    pub range: Range,
    /// When it was measured (µs, the sensor's clock or the driver's, wrapping at 2³²).
    pub time_us: u32,
    /// Strength of the return as the sensor gives it, scaled to 0…255 where it has more bits.
    pub quality: u8,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bearings_round_and_wrap() {
        for (cdeg, expected) in [
            (0, 0),
            (9_000, 49_152),
            (18_000, 32_768),
            (27_000, 16_384),
            (36_000, 0),
            (35_999, 2),
        ] {
            assert_eq!(
                Bearing::from_clockwise_cdeg(cdeg),
                Bearing(expected),
                "{cdeg}"
            );
        }
        for degrees in [-179.0f32, -90.0, 0.0, 45.0, 179.0, 361.0] {
            let bearing = Bearing::from_radians(degrees.to_radians());
            let back = bearing.radians().to_degrees();
            let off = (back - degrees + 540.0) % 360.0 - 180.0;
            assert!(off.abs() < 0.003, "{degrees}: {back}");
        }
    }

    #[test]
    fn ranges_keep_their_distance_or_their_reason() {
        for (metres, expected) in [
            (1.2344, Ok(1234)),
            (65.279, Ok(65_279)),
            (65.28, Err(NoReturn::TooFar)),
            (f32::INFINITY, Err(NoReturn::TooFar)),
            (0.0, Err(NoReturn::Nothing)),
            (-1.0, Err(NoReturn::Nothing)),
            (0.0004, Err(NoReturn::Nothing)),
            (f32::NAN, Err(NoReturn::Nothing)),
        ] {
            let range = Range::from_metres(metres);
            assert_eq!(range.mm(), expected, "{metres}");
            assert_eq!(range.is_some(), expected.is_ok(), "{metres}");
        }
        for reason in [
            NoReturn::Nothing,
            NoReturn::TooNear,
            NoReturn::TooFar,
            NoReturn::Doubtful,
            NoReturn::Filtered,
            NoReturn::Sensor(0x35),
        ] {
            assert_eq!(Range::none(reason).mm(), Err(reason));
            assert!(!Range::none(reason).is_some());
        }
    }
}
