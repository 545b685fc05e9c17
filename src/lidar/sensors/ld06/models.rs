//! The LDROBOT sensors that send 47-byte frames.

use super::START;
use crate::lidar::model::{Family, Model, Motor, Parallax, Proof, Start};

impl Model {
    /// LDROBOT LD06.
    pub const LDROBOT_LD06: Self = Self {
        name: "ld06",
        family: Family::Ldrobot(Parallax::None),
        baud: 230_400,
        points_per_s: 4500,
        revolutions_per_10s: 100,
        beams_per_revolution: 520,
        zero_cdeg: 0,
        counter_clockwise: false,
        min_range_mm: 20,
        max_range_mm: 12_000,
        motor: Motor::OwnOrPwm,
        start: Start::Listen,
        proof: Proof::RealBytes,
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
        proof: Proof::MakersParser,
        ..Self::LDROBOT_LD06
    };
    /// LDROBOT STL-27L.
    pub const LDROBOT_STL27L: Self = Self {
        name: "stl27l",
        baud: 921_600,
        points_per_s: 21_600,
        beams_per_revolution: 2300,
        min_range_mm: 30,
        max_range_mm: 25_000,
        motor: Motor::Own,
        proof: Proof::MakersParser,
        ..Self::LDROBOT_LD06
    };
    /// LDROBOT LD14.
    pub const LDROBOT_LD14: Self = Self {
        name: "ld14",
        family: Family::Ldrobot(Parallax::Ld14),
        baud: 115_200,
        points_per_s: 2300,
        revolutions_per_10s: 60,
        beams_per_revolution: 430,
        min_range_mm: 150,
        max_range_mm: 8000,
        motor: Motor::Own,
        proof: Proof::MakersParser,
        ..Self::LDROBOT_LD06
    };
    /// LDROBOT LD14P.
    pub const LDROBOT_LD14P: Self = Self {
        name: "ld14p",
        baud: 230_400,
        points_per_s: 4000,
        beams_per_revolution: 730,
        min_range_mm: 100,
        motor: Motor::Commands,
        start: Start::Send(&START),
        ..Self::LDROBOT_LD14
    };
    /// LDROBOT LD14P in its variant with 2300 measurements a second; on the line it looks as an LD14.
    pub const LDROBOT_LD14P_2300: Self = Self {
        name: "ld14p-2300",
        points_per_s: 2300,
        beams_per_revolution: 430,
        ..Self::LDROBOT_LD14P
    };
    /// LDS-02 (HLS-LFCD3, LD08).
    pub const LDROBOT_LDS02: Self = Self {
        name: "lds02",
        family: Family::Ldrobot(Parallax::Lds02),
        revolutions_per_10s: 50,
        beams_per_revolution: 510,
        min_range_mm: 160,
        proof: Proof::OneSource,
        ..Self::LDROBOT_LD14
    };
    /// Oradar MS200: the LD06's frames. Before them it tells its serial number and version in messages that begin with
    /// `AA 55` and end with `31 F2`: they are skipped.
    pub const ORADAR_MS200: Self = Self {
        name: "ms200",
        min_range_mm: 30,
        motor: Motor::Own,
        proof: Proof::Document,
        ..Self::LDROBOT_LD06
    };
}
