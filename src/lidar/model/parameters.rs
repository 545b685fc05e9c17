//! What the models of one family differ in: the parameters of its parser.

/// How an LDROBOT sensor's parser corrects for the distance between laser and receiver, by the maker's formulas.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Parallax {
    /// No correction, or one inside the sensor: LD06, LD19, STL.
    None,
    /// LD14, LD14P: the angle is corrected; a point without a range gets the shift of the one before.
    Ld14,
    /// LDS-02: angle and range are corrected.
    Lds02,
}

/// How a YDLIDAR's samples are to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Samples {
    /// Bytes of a sample: 2, 3 or 4.
    pub bytes: u8,
    /// Quarter millimetres in the unit of a distance.
    pub unit_q2: u8,
    /// Meaning of the low two bits of a three-byte sample's distance.
    pub flags: Flags,
    /// Correction of the angle for the distance between laser and receiver.
    pub correction: Correction,
    /// By how much (0.1 revolutions/s) the sensor spins faster than its frames say.
    pub speed_offset_dhz: u8,
}

/// Meaning of the low two bits of the distance in a YDLIDAR's three-byte sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Flags {
    /// Part of the distance: there are no flags.
    None,
    /// Bits 9:8 of the intensity.
    Intensity,
    /// What the sensor thinks of the point: 2 a mirror, 3 ambient light.
    Doubt,
    /// COIN-D4: bits 7:6 of the intensity, whose bits 5:0 are the first byte's bits 7:2.
    Exposure,
}

/// Correction of a YDLIDAR's angle by the distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Correction {
    /// Time of flight: none.
    None,
    /// `atan(21.8 (155.3 - d) / (155.3 d))`, d in mm.
    Triangle,
    /// `atan(17.8 / d)`, d in mm.
    Scl,
}

impl Samples {
    /// X2, X3, X4, G1, G4, S2, F4 Pro, R2.
    pub const TRIANGLE: Self = Self {
        bytes: 2,
        unit_q2: 1,
        flags: Flags::None,
        correction: Correction::Triangle,
        speed_offset_dhz: 0,
    };
    /// G2, G4B and the manuals' format with intensity: 10 bits of it.
    pub const TRIANGLE_INTENSITY: Self = Self {
        bytes: 3,
        flags: Flags::Intensity,
        ..Self::TRIANGLE
    };
    /// S4B: 8 bits of intensity.
    pub const TRIANGLE_DOUBT: Self = Self {
        bytes: 3,
        flags: Flags::Doubt,
        ..Self::TRIANGLE
    };
    /// G6, G7.
    pub const G6: Self = Self {
        unit_q2: 2,
        ..Self::TRIANGLE
    };
    /// T-mini Pro and Plus.
    pub const TMINI: Self = Self {
        bytes: 3,
        unit_q2: 1,
        flags: Flags::Doubt,
        correction: Correction::None,
        speed_offset_dhz: 0,
    };
    /// COIN-D4, which sends YDLIDAR's frames.
    pub const COIN_D4: Self = Self {
        flags: Flags::Exposure,
        ..Self::TMINI
    };
    /// T-mini Plus SH: by the maker's software, no recording was to be had.
    pub const TMINI_SH: Self = Self {
        bytes: 4,
        unit_q2: 4,
        flags: Flags::None,
        ..Self::TMINI
    };
    /// TG and TX: by the maker's driver they spin at 3 Hz more than their frames say.
    pub const TIME_OF_FLIGHT: Self = Self {
        bytes: 2,
        unit_q2: 4,
        flags: Flags::None,
        correction: Correction::None,
        speed_offset_dhz: 30,
    };
    /// SCL.
    pub const SCL: Self = Self {
        correction: Correction::Scl,
        ..Self::TMINI
    };
}

/// Share of a revolution that a 3irobotix Delta's frame covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Sector {
    /// 22.5°: Delta-1A, 2A, 2B.
    Sixteenth,
    /// 24°: Delta-2G and some that are called Delta-2.
    Fifteenth,
}

/// How a Camsense sensor's angles and ranges are to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Camsense {
    /// X1: laser and receiver lie 20 mm apart.
    X1,
    /// X2: they lie 17.92 mm apart.
    X2,
    /// LDS08RR, "Mystery 360": nothing is corrected.
    Uncorrected,
    /// T2, T200: time of flight, and angles in hundredths of a degree.
    T2,
}

/// Returns of a beam that an LSLIDAR sensor sends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Returns {
    /// N10, L10: one.
    One,
    /// N10P: two, of which the first is used.
    Two,
}

/// How a SCIP sensor counts the steps of its angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Steps {
    /// Steps of a revolution (ARES).
    pub per_revolution: u16,
    /// Step that looks forward (AFRT).
    pub front: u16,
    /// Last step that a unit can be asked for.
    pub last: u16,
    /// Revolutions a minute (SCAN).
    pub rpm: u16,
}

impl Steps {
    /// URG-04LX: 1024 a revolution, 44 to 725 (768 on the UG01), 384 in front.
    pub const URG04LX: Self = Self {
        per_revolution: 1024,
        front: 384,
        last: 768,
        rpm: 600,
    };
    /// UTM-30LX, UST-10LX, UST-20LX: 1440 a revolution, 0 to 1080, 540 in front.
    pub const UTM30LX: Self = Self {
        per_revolution: 1440,
        front: 540,
        last: 1080,
        rpm: 2400,
    };

    /// Time from one step to the next (µs/256).
    pub(crate) const fn period_q8(self) -> u32 {
        let steps_per_minute = self.rpm as u64 * self.per_revolution as u64;
        match (60_000_000u64 << 8).checked_div(steps_per_minute) {
            Some(period) if period <= u32::MAX as u64 => period as u32,
            _ => 0,
        }
    }
}
