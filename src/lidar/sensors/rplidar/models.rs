//! The RPLIDAR sensors, one row for each kind of stream.

use crate::lidar::model::{Family, Model, Motor, Proof, Start};

impl Model {
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
        min_range_mm: 150,
        max_range_mm: 12_000,
        motor: Motor::Pwm,
        start: Start::Rplidar,
        proof: Proof::RealBytes,
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
        min_range_mm: 50,
        max_range_mm: 30_000,
        motor: Motor::Commands,
        proof: Proof::MakersParser,
        ..Self::RPLIDAR_SCAN
    };
    /// RPLIDAR C1.
    pub const RPLIDAR_C1: Self = Self {
        name: "rplidar-c1",
        baud: 460_800,
        points_per_s: 5000,
        beams_per_revolution: 540,
        max_range_mm: 12_000,
        ..Self::RPLIDAR_DENSE
    };
    /// RPLIDAR C1 in standard scan.
    pub const RPLIDAR_C1_SCAN: Self = Self {
        name: "rplidar-c1-scan",
        family: Family::RplidarScan,
        proof: Proof::OneSource,
        ..Self::RPLIDAR_C1
    };
    /// RPLIDAR A3 in boost scan.
    pub const RPLIDAR_ULTRA: Self = Self {
        name: "rplidar-ultra",
        family: Family::RplidarUltra,
        baud: 256_000,
        points_per_s: 16_000,
        revolutions_per_10s: 100,
        beams_per_revolution: 1700,
        max_range_mm: 25_000,
        motor: Motor::Commands,
        proof: Proof::MakersParser,
        ..Self::RPLIDAR_SCAN
    };
    /// RPLIDAR S3 in ultra-dense scan.
    pub const RPLIDAR_ULTRADENSE: Self = Self {
        name: "rplidar-ultradense",
        family: Family::RplidarUltraDense,
        max_range_mm: 40_000,
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
}
