//! The YDLIDAR sensors.

use super::command;
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
        min_range_mm: 100,
        max_range_mm: 8000,
        motor: Motor::Pwm,
        start: Start::Ydlidar { keeps_zero: false },
        proof: Proof::RealBytes,
    };
    /// YDLIDAR X4.
    pub const YDLIDAR_X4: Self = Self {
        name: "ydlidar-x4",
        baud: 128_000,
        points_per_s: 5000,
        beams_per_revolution: 900,
        min_range_mm: 120,
        max_range_mm: 10_000,
        ..Self::YDLIDAR_X2
    };
    /// YDLIDAR G2 and others with an intensity byte.
    pub const YDLIDAR_G2: Self = Self {
        name: "ydlidar-g2",
        family: Family::Ydlidar(Samples::TRIANGLE_INTENSITY),
        baud: 230_400,
        min_range_mm: 280,
        max_range_mm: 16_000,
        motor: Motor::Commands,
        start: Start::Ydlidar { keeps_zero: true },
        proof: Proof::MakersParser,
        ..Self::YDLIDAR_X4
    };
    /// YDLIDAR S4B: 8 bits of intensity.
    pub const YDLIDAR_S4B: Self = Self {
        name: "ydlidar-s4b",
        family: Family::Ydlidar(Samples::TRIANGLE_DOUBT),
        baud: 153_600,
        points_per_s: 4000,
        beams_per_revolution: 750,
        max_range_mm: 8000,
        proof: Proof::OneSource,
        ..Self::YDLIDAR_X4
    };
    /// YDLIDAR G4.
    pub const YDLIDAR_G4: Self = Self {
        name: "ydlidar-g4",
        family: Family::Ydlidar(Samples::TRIANGLE),
        points_per_s: 9000,
        beams_per_revolution: 1500,
        min_range_mm: 100,
        start: Start::Ydlidar { keeps_zero: false },
        proof: Proof::RealBytes,
        ..Self::YDLIDAR_G2
    };
    /// YDLIDAR G4B: 10 bits of intensity.
    pub const YDLIDAR_G4B: Self = Self {
        name: "ydlidar-g4b",
        family: Family::Ydlidar(Samples::TRIANGLE_INTENSITY),
        baud: 512_000,
        proof: Proof::OneSource,
        ..Self::YDLIDAR_G4
    };
    /// YDLIDAR G6, G7.
    pub const YDLIDAR_G6: Self = Self {
        name: "ydlidar-g6",
        family: Family::Ydlidar(Samples::G6),
        baud: 512_000,
        points_per_s: 18_000,
        beams_per_revolution: 3000,
        max_range_mm: 25_000,
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
        min_range_mm: 50,
        max_range_mm: 12_000,
        start: Start::Ydlidar { keeps_zero: false },
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
        min_range_mm: 50,
        max_range_mm: 50_000,
        proof: Proof::MakersParser,
        ..Self::YDLIDAR_G2
    };
    /// COIN-D4, also sold as TurtleBot3's LDS-03: by its frames alone it looks like a T-mini.
    pub const COIN_D4: Self = Self {
        name: "coin-d4",
        family: Family::Ydlidar(Samples::COIN_D4),
        baud: 230_400,
        points_per_s: 4000,
        revolutions_per_10s: 60,
        beams_per_revolution: 750,
        zero_cdeg: 0,
        counter_clockwise: false,
        min_range_mm: 50,
        max_range_mm: 8000,
        motor: Motor::Commands,
        start: Start::Send(&command::COIN_D4_START),
        proof: Proof::RealBytes,
    };
}
