//! What tells the sensors of a family apart: a row of data each.

use super::{delta, ld06, scip, ydlidar};

/// A protocol family, with what its models differ in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Family {
    /// LDROBOT's 47-byte frame.
    Ldrobot(ld06::Parallax),
    /// RPLIDAR standard scan, 5 bytes a point.
    RplidarScan,
    /// RPLIDAR legacy express capsules.
    RplidarExpress,
    /// RPLIDAR dense capsules.
    RplidarDense,
    /// RPLIDAR ultra capsules ("boost").
    RplidarUltra,
    /// RPLIDAR ultra-dense capsules.
    RplidarUltraDense,
    /// RPLIDAR HQ packets.
    RplidarHq,
    /// YDLIDAR point frames.
    Ydlidar(ydlidar::Samples),
    /// HLS-LFCD2.
    Lds01,
    /// Neato XV-11, firmware 2.4 and later, and LDS02RR.
    Xv11,
    /// Neato XV-11, early firmware.
    Xv11Early,
    /// 3irobotix Delta.
    Delta(delta::Sector),
    /// Camsense X1 and LDS08RR.
    Camsense,
    /// COIN-D4.
    CoinD4,
    /// Hokuyo SCIP 2.0.
    Scip(scip::Steps),
    /// SICK LMS2xx.
    Sick,
}

/// Who drives the motor, and how its speed is set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Motor {
    /// The sensor, at its own speed.
    Own,
    /// The sensor, at its own speed; a PWM signal can take over.
    OwnOrPwm,
    /// The host: PWM from a control loop on the reported speed.
    Pwm,
    /// The sensor, on serial commands.
    Commands,
}

/// One sensor: the data its family's parser and its user need.
///
/// The numbers are data-sheet values. Some makers mount the same sensor turned or mirrored: copy the row and change it,
/// `Model { counter_clockwise: true, ..Model::CAMSENSE_X1 }`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Model {
    /// As `decode --lidar` takes it.
    pub name: &'static str,
    /// How its bytes are to be read.
    pub family: Family,
    /// Speed of its line (bits/s), 8N1.
    pub baud: u32,
    /// Measurements a second.
    pub points_per_s: u32,
    /// Revolutions in ten seconds.
    pub revolutions_per_10s: u16,
    /// Most beams of a revolution at the usual speed, with a margin: the N of a scan.
    pub beams_per_revolution: u16,
    /// The sensor's own angle that looks forward (0.01°).
    pub zero_cdeg: u16,
    /// Whether the sensor's own angle grows counter-clockwise seen from above.
    pub counter_clockwise: bool,
    /// Nearest range (mm).
    pub nearest_mm: u16,
    /// Farthest range (mm).
    pub farthest_mm: u16,
    /// Who drives the motor.
    pub motor: Motor,
}

impl Model {
    /// LDROBOT LD06.
    pub const LDROBOT_LD06: Self = Self {
        name: "ld06",
        family: Family::Ldrobot(ld06::Parallax::None),
        baud: 230_400,
        points_per_s: 4500,
        revolutions_per_10s: 100,
        beams_per_revolution: 520,
        zero_cdeg: 0,
        counter_clockwise: false,
        nearest_mm: 20,
        farthest_mm: 12_000,
        motor: Motor::OwnOrPwm,
    };
    /// LDROBOT LD19.
    pub const LDROBOT_LD19: Self = Self {
        name: "ld19",
        ..Self::LDROBOT_LD06
    };
    /// LDROBOT STL-19P, D500 kit; also STL-06P and STL-26.
    pub const LDROBOT_STL19P: Self = Self {
        name: "stl19p",
        points_per_s: 5000,
        beams_per_revolution: 570,
        ..Self::LDROBOT_LD06
    };
    /// LDROBOT STL-27L.
    pub const LDROBOT_STL27L: Self = Self {
        name: "stl27l",
        baud: 921_600,
        points_per_s: 21_600,
        beams_per_revolution: 2300,
        nearest_mm: 30,
        farthest_mm: 25_000,
        motor: Motor::Own,
        ..Self::LDROBOT_LD06
    };
    /// LDROBOT LD14.
    pub const LDROBOT_LD14: Self = Self {
        name: "ld14",
        family: Family::Ldrobot(ld06::Parallax::Ld14),
        baud: 115_200,
        points_per_s: 2300,
        revolutions_per_10s: 60,
        beams_per_revolution: 430,
        nearest_mm: 150,
        farthest_mm: 8000,
        motor: Motor::Own,
        ..Self::LDROBOT_LD06
    };
    /// LDROBOT LD14P.
    pub const LDROBOT_LD14P: Self = Self {
        name: "ld14p",
        baud: 230_400,
        points_per_s: 4000,
        beams_per_revolution: 730,
        nearest_mm: 100,
        motor: Motor::Commands,
        ..Self::LDROBOT_LD14
    };
    /// LDS-02 (HLS-LFCD3, LD08).
    pub const LDROBOT_LDS02: Self = Self {
        name: "lds02",
        family: Family::Ldrobot(ld06::Parallax::Lds02),
        revolutions_per_10s: 50,
        beams_per_revolution: 510,
        nearest_mm: 160,
        ..Self::LDROBOT_LD14
    };
    /// RPLIDAR A1 or A2 in standard scan.
    pub const RPLIDAR_SCAN: Self = Self {
        name: "rplidar-scan",
        family: Family::RplidarScan,
        baud: 115_200,
        points_per_s: 2000,
        revolutions_per_10s: 55,
        beams_per_revolution: 400,
        zero_cdeg: 0,
        counter_clockwise: false,
        nearest_mm: 150,
        farthest_mm: 12_000,
        motor: Motor::Pwm,
    };
    /// RPLIDAR A1 or A2 in legacy express scan.
    pub const RPLIDAR_EXPRESS: Self = Self {
        name: "rplidar-express",
        family: Family::RplidarExpress,
        points_per_s: 4000,
        beams_per_revolution: 800,
        ..Self::RPLIDAR_SCAN
    };
    /// RPLIDAR S2 in dense scan.
    pub const RPLIDAR_DENSE: Self = Self {
        name: "rplidar-dense",
        family: Family::RplidarDense,
        baud: 1_000_000,
        points_per_s: 32_000,
        revolutions_per_10s: 100,
        beams_per_revolution: 3400,
        nearest_mm: 50,
        farthest_mm: 30_000,
        motor: Motor::Commands,
        ..Self::RPLIDAR_SCAN
    };
    /// RPLIDAR C1.
    pub const RPLIDAR_C1: Self = Self {
        name: "rplidar-c1",
        baud: 460_800,
        points_per_s: 5000,
        beams_per_revolution: 540,
        farthest_mm: 12_000,
        ..Self::RPLIDAR_DENSE
    };
    /// RPLIDAR A3 in boost scan.
    pub const RPLIDAR_ULTRA: Self = Self {
        name: "rplidar-ultra",
        family: Family::RplidarUltra,
        baud: 256_000,
        points_per_s: 16_000,
        revolutions_per_10s: 100,
        beams_per_revolution: 1700,
        farthest_mm: 25_000,
        motor: Motor::Commands,
        ..Self::RPLIDAR_SCAN
    };
    /// RPLIDAR S3 in ultra-dense scan.
    pub const RPLIDAR_ULTRADENSE: Self = Self {
        name: "rplidar-ultradense",
        family: Family::RplidarUltraDense,
        farthest_mm: 40_000,
        ..Self::RPLIDAR_DENSE
    };
    /// RPLIDAR in HQ scan; 8 bytes a point, so only on a fast line.
    pub const RPLIDAR_HQ: Self = Self {
        name: "rplidar-hq",
        family: Family::RplidarHq,
        baud: 1_000_000,
        points_per_s: 10_000,
        beams_per_revolution: 1100,
        ..Self::RPLIDAR_ULTRA
    };
    /// YDLIDAR X2, X2L, X3.
    pub const YDLIDAR_X2: Self = Self {
        name: "ydlidar-x2",
        family: Family::Ydlidar(ydlidar::Samples::TRIANGLE),
        baud: 115_200,
        points_per_s: 3000,
        revolutions_per_10s: 70,
        beams_per_revolution: 700,
        zero_cdeg: 0,
        counter_clockwise: false,
        nearest_mm: 100,
        farthest_mm: 8000,
        motor: Motor::Pwm,
    };
    /// YDLIDAR X4.
    pub const YDLIDAR_X4: Self = Self {
        name: "ydlidar-x4",
        baud: 128_000,
        points_per_s: 5000,
        beams_per_revolution: 900,
        nearest_mm: 120,
        farthest_mm: 10_000,
        ..Self::YDLIDAR_X2
    };
    /// YDLIDAR G2 and others with an intensity byte.
    pub const YDLIDAR_G2: Self = Self {
        name: "ydlidar-g2",
        family: Family::Ydlidar(ydlidar::Samples::TRIANGLE_INTENSITY),
        baud: 230_400,
        nearest_mm: 280,
        farthest_mm: 16_000,
        motor: Motor::Commands,
        ..Self::YDLIDAR_X4
    };
    /// YDLIDAR G4.
    pub const YDLIDAR_G4: Self = Self {
        name: "ydlidar-g4",
        family: Family::Ydlidar(ydlidar::Samples::TRIANGLE),
        points_per_s: 9000,
        beams_per_revolution: 1500,
        nearest_mm: 100,
        ..Self::YDLIDAR_G2
    };
    /// YDLIDAR G6, G7.
    pub const YDLIDAR_G6: Self = Self {
        name: "ydlidar-g6",
        family: Family::Ydlidar(ydlidar::Samples::G6),
        baud: 512_000,
        points_per_s: 18_000,
        beams_per_revolution: 3000,
        farthest_mm: 25_000,
        ..Self::YDLIDAR_G4
    };
    /// YDLIDAR T-mini Pro and Plus.
    pub const YDLIDAR_TMINI: Self = Self {
        name: "ydlidar-tmini",
        family: Family::Ydlidar(ydlidar::Samples::TMINI),
        points_per_s: 4000,
        revolutions_per_10s: 60,
        beams_per_revolution: 750,
        nearest_mm: 50,
        farthest_mm: 12_000,
        ..Self::YDLIDAR_G2
    };
    /// YDLIDAR T-mini Plus SH: four bytes a sample; not verified on a unit.
    pub const YDLIDAR_TMINI_SH: Self = Self {
        name: "ydlidar-tmini-sh",
        family: Family::Ydlidar(ydlidar::Samples::TMINI_SH),
        ..Self::YDLIDAR_TMINI
    };
    /// YDLIDAR TG15, TG30, TG50: time of flight.
    pub const YDLIDAR_TG: Self = Self {
        name: "ydlidar-tg",
        family: Family::Ydlidar(ydlidar::Samples::TIME_OF_FLIGHT),
        baud: 512_000,
        points_per_s: 20_000,
        revolutions_per_10s: 100,
        beams_per_revolution: 2300,
        nearest_mm: 50,
        farthest_mm: 50_000,
        ..Self::YDLIDAR_G2
    };
    /// LDS-01 (HLS-LFCD2).
    pub const HLS_LDS01: Self = Self {
        name: "lds01",
        family: Family::Lds01,
        baud: 230_400,
        points_per_s: 1800,
        revolutions_per_10s: 50,
        beams_per_revolution: 360,
        zero_cdeg: 0,
        counter_clockwise: false,
        nearest_mm: 120,
        farthest_mm: 3500,
        motor: Motor::Commands,
    };
    /// Neato XV-11, firmware 2.4 and later.
    pub const NEATO_XV11: Self = Self {
        name: "xv11",
        family: Family::Xv11,
        baud: 115_200,
        counter_clockwise: true,
        nearest_mm: 60,
        farthest_mm: 5000,
        motor: Motor::Pwm,
        ..Self::HLS_LDS01
    };
    /// Xiaomi LDS02RR: the XV-11's frames, clockwise by the one source there is.
    pub const XIAOMI_LDS02RR: Self = Self {
        name: "lds02rr",
        counter_clockwise: false,
        nearest_mm: 150,
        farthest_mm: 6000,
        ..Self::NEATO_XV11
    };
    /// Neato XV-11, early firmware.
    pub const NEATO_XV11_EARLY: Self = Self {
        name: "xv11-early",
        family: Family::Xv11Early,
        ..Self::NEATO_XV11
    };
    /// Camsense X1.
    pub const CAMSENSE_X1: Self = Self {
        name: "camsense-x1",
        family: Family::Camsense,
        baud: 115_200,
        points_per_s: 2080,
        revolutions_per_10s: 52,
        beams_per_revolution: 440,
        zero_cdeg: 0,
        counter_clockwise: false,
        nearest_mm: 80,
        farthest_mm: 8000,
        motor: Motor::Own,
    };
    /// LDS08RR: the Camsense frame with 16-bit quality.
    pub const CAMSENSE_LDS08RR: Self = Self {
        name: "lds08rr",
        ..Self::CAMSENSE_X1
    };
    /// 3irobotix Delta-1A, 2A, 2B.
    pub const DELTA_2A: Self = Self {
        name: "delta-2a",
        family: Family::Delta(delta::Sector::Sixteenth),
        baud: 230_400,
        points_per_s: 4500,
        revolutions_per_10s: 60,
        beams_per_revolution: 960,
        zero_cdeg: 0,
        counter_clockwise: false,
        nearest_mm: 130,
        farthest_mm: 8000,
        motor: Motor::Pwm,
    };
    /// 3irobotix Delta-2G.
    pub const DELTA_2G: Self = Self {
        name: "delta-2g",
        family: Family::Delta(delta::Sector::Fifteenth),
        baud: 115_200,
        points_per_s: 1890,
        revolutions_per_10s: 52,
        beams_per_revolution: 900,
        ..Self::DELTA_2A
    };
    /// COIN-D4.
    pub const COIN_D4: Self = Self {
        name: "coin-d4",
        family: Family::CoinD4,
        baud: 230_400,
        points_per_s: 4000,
        revolutions_per_10s: 60,
        beams_per_revolution: 750,
        zero_cdeg: 0,
        counter_clockwise: false,
        nearest_mm: 50,
        farthest_mm: 8000,
        motor: Motor::Commands,
    };
    /// Hokuyo URG-04LX: 19 200 baud after power-on; a slower line than this does not carry every scan.
    pub const HOKUYO_URG04LX: Self = Self {
        name: "scip",
        family: Family::Scip(scip::Steps::URG04LX),
        baud: 750_000,
        points_per_s: 10_240,
        revolutions_per_10s: 100,
        beams_per_revolution: 726,
        zero_cdeg: 0,
        counter_clockwise: true,
        nearest_mm: 20,
        farthest_mm: 5600,
        motor: Motor::Own,
    };
    /// SICK LMS200, LMS291: 9600 baud after power-on; only 500 000 carries every scan.
    pub const SICK_LMS200: Self = Self {
        name: "lms200",
        family: Family::Sick,
        baud: 500_000,
        points_per_s: 27_000,
        revolutions_per_10s: 750,
        beams_per_revolution: 401,
        zero_cdeg: 9000,
        counter_clockwise: true,
        nearest_mm: 50,
        farthest_mm: 8182,
        motor: Motor::Own,
    };

    /// Every row above.
    pub const ALL: &'static [Self] = &[
        Self::LDROBOT_LD06,
        Self::LDROBOT_LD19,
        Self::LDROBOT_STL19P,
        Self::LDROBOT_STL27L,
        Self::LDROBOT_LD14,
        Self::LDROBOT_LD14P,
        Self::LDROBOT_LDS02,
        Self::RPLIDAR_SCAN,
        Self::RPLIDAR_EXPRESS,
        Self::RPLIDAR_DENSE,
        Self::RPLIDAR_C1,
        Self::RPLIDAR_ULTRA,
        Self::RPLIDAR_ULTRADENSE,
        Self::RPLIDAR_HQ,
        Self::YDLIDAR_X2,
        Self::YDLIDAR_X4,
        Self::YDLIDAR_G2,
        Self::YDLIDAR_G4,
        Self::YDLIDAR_G6,
        Self::YDLIDAR_TMINI,
        Self::YDLIDAR_TMINI_SH,
        Self::YDLIDAR_TG,
        Self::HLS_LDS01,
        Self::NEATO_XV11,
        Self::XIAOMI_LDS02RR,
        Self::NEATO_XV11_EARLY,
        Self::CAMSENSE_X1,
        Self::CAMSENSE_LDS08RR,
        Self::DELTA_2A,
        Self::DELTA_2G,
        Self::COIN_D4,
        Self::HOKUYO_URG04LX,
        Self::SICK_LMS200,
    ];

    /// The model of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        Self::ALL.iter().find(|model| model.name == name)
    }

    /// Time from one measurement to the next (µs/256).
    #[must_use]
    pub const fn period_q8(&self) -> u32 {
        let rate = if self.points_per_s < 100 {
            100
        } else {
            self.points_per_s
        };
        256_000_000 / rate
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_have_names_of_their_own_and_sane_numbers() {
        for (k, model) in Model::ALL.iter().enumerate() {
            let same = Model::ALL.iter().filter(|other| other.name == model.name);
            assert_eq!(same.count(), 1, "{}", model.name);
            assert_eq!(Model::named(model.name), Some(&Model::ALL[k]));
            let per_revolution = model.points_per_s * 10 / u32::from(model.revolutions_per_10s);
            let sees_all_around = !matches!(model.family, Family::Scip(_) | Family::Sick);
            let room = u32::from(model.beams_per_revolution);
            assert!(!sees_all_around || room >= per_revolution, "{}", model.name);
            assert!(model.nearest_mm < model.farthest_mm, "{}", model.name);
        }
    }
}
