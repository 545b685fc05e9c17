//! The YDLIDAR sensors.

use crate::lidar::model::{Family, Model, Motor, Proof, Samples, Start};

impl Model {
    /// YDLIDAR X2, X2L, X3.
    pub const YDLIDAR_X2: Self = Self {
        name: "ydlidar-x2",
        family: Family::Ydlidar(Samples::TRIANGLE),
        baud: 115_200,
        points_per_s: 3000,
        revolutions_per_10s: 70,
        beams_per_revolution: 700,
        zero_cdeg: 0,
        counter_clockwise: false,
        nearest_mm: 100,
        farthest_mm: 8000,
        motor: Motor::Pwm,
        start: Start::Ydlidar,
        proof: Proof::RealBytes,
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
        family: Family::Ydlidar(Samples::TRIANGLE_INTENSITY),
        baud: 230_400,
        nearest_mm: 280,
        farthest_mm: 16_000,
        motor: Motor::Commands,
        proof: Proof::MakersParser,
        ..Self::YDLIDAR_X4
    };
    /// YDLIDAR G4.
    pub const YDLIDAR_G4: Self = Self {
        name: "ydlidar-g4",
        family: Family::Ydlidar(Samples::TRIANGLE),
        points_per_s: 9000,
        beams_per_revolution: 1500,
        nearest_mm: 100,
        proof: Proof::RealBytes,
        ..Self::YDLIDAR_G2
    };
    /// YDLIDAR G6, G7.
    pub const YDLIDAR_G6: Self = Self {
        name: "ydlidar-g6",
        family: Family::Ydlidar(Samples::G6),
        baud: 512_000,
        points_per_s: 18_000,
        beams_per_revolution: 3000,
        farthest_mm: 25_000,
        proof: Proof::MakersParser,
        ..Self::YDLIDAR_G4
    };
    /// YDLIDAR T-mini Pro and Plus.
    pub const YDLIDAR_TMINI: Self = Self {
        name: "ydlidar-tmini",
        family: Family::Ydlidar(Samples::TMINI),
        points_per_s: 4000,
        revolutions_per_10s: 60,
        beams_per_revolution: 750,
        nearest_mm: 50,
        farthest_mm: 12_000,
        proof: Proof::RealBytes,
        ..Self::YDLIDAR_G2
    };
    /// YDLIDAR T-mini Plus SH: four bytes a sample; not verified on a unit.
    pub const YDLIDAR_TMINI_SH: Self = Self {
        name: "ydlidar-tmini-sh",
        family: Family::Ydlidar(Samples::TMINI_SH),
        proof: Proof::OneSource,
        ..Self::YDLIDAR_TMINI
    };
    /// YDLIDAR TG15, TG30, TG50: time of flight.
    pub const YDLIDAR_TG: Self = Self {
        name: "ydlidar-tg",
        family: Family::Ydlidar(Samples::TIME_OF_FLIGHT),
        baud: 512_000,
        points_per_s: 20_000,
        revolutions_per_10s: 100,
        beams_per_revolution: 2300,
        nearest_mm: 50,
        farthest_mm: 50_000,
        proof: Proof::MakersParser,
        ..Self::YDLIDAR_G2
    };
}
