//! A lidar as a type: its row of the table of models, its parser, its settings, all known when the firmware is compiled.

use beamfix::{
    lidar::{Model, Protocol, Start, parsers},
    odometry::Odometry,
};

use crate::{AppConfig, BEAMS, Firmware};

/// A lidar that is known when the firmware is compiled.
pub trait Lidar {
    /// Reads its bytes.
    type Parser: Protocol;
    /// Its row in the table of models.
    const MODEL: &'static Model;
    /// Nothing received yet.
    const PARSER: Self::Parser;
    /// Most beams of a revolution.
    const BEAMS: usize = beams(Self::MODEL);
    /// Whether it must be asked to start, over a line to it.
    const ASKS: bool = !matches!(Self::MODEL.start, Start::Listen);
    /// The application's settings for it.
    const CONFIG: AppConfig = AppConfig::for_model(Self::MODEL);
}

/// What a board with this lidar runs that tells its pose since the start.
pub type OdometryWith<L, const N: usize> = Firmware<<L as Lidar>::Parser, Odometry<N>, N>;

/// Row number K of [`Model::ALL`]: `Row<{ chosen("ld06") }>`.
#[derive(Debug, Clone, Copy)]
pub struct Row<const K: usize>;

/// Number of the row of this name, or of the one that the environment variable `BEAMFIX_LIDAR` names when the firmware is
/// compiled. In a `const`, a name that is not in the table does not compile.
#[must_use]
pub const fn chosen(name: &str) -> usize {
    let name = match option_env!("BEAMFIX_LIDAR") {
        Some(other) => other,
        None => name,
    };
    let mut k = 0;
    while k < Model::ALL.len() {
        if same(Model::ALL[k].name, name) {
            return k;
        }
        k += 1;
    }
    panic!("no lidar of this name: `beamfix lidars` lists them")
}

/// Most beams of a revolution of this model: for an LD06 those that the boards' cards are measured with, 450 at 10 Hz.
#[must_use]
pub const fn beams(model: &Model) -> usize {
    match same(model.name, Model::LDROBOT_LD06.name) {
        true => BEAMS,
        false => model.beams_per_revolution as usize,
    }
}

/// Whether two names are the same.
pub(crate) const fn same(one: &str, other: &str) -> bool {
    let (one, other) = (one.as_bytes(), other.as_bytes());
    let mut k = 0;
    while k < one.len() && k < other.len() && one[k] == other[k] {
        k += 1;
    }
    k == one.len() && k == other.len()
}

macro_rules! rows {
    ($($k:literal $model:ident $parser:ident)*) => {
        $(impl Lidar for Row<$k> {
            type Parser = parsers::$parser;
            const MODEL: &'static Model = &Model::$model;
            const PARSER: parsers::$parser = parsers::$parser::for_model(Self::MODEL);
        }
        const _: () = assert!(same(Model::ALL[$k].name, Model::$model.name));)*
    };
}

// In the order of the table.
rows! {
    0 LDROBOT_LD06 Ldrobot
    1 LDROBOT_LD19 Ldrobot
    2 LDROBOT_STL19P Ldrobot
    3 LDROBOT_STL27L Ldrobot
    4 LDROBOT_LD14 Ldrobot
    5 LDROBOT_LD14P Ldrobot
    6 LDROBOT_LD14P_2300 Ldrobot
    7 LDROBOT_LDS02 Ldrobot
    8 ORADAR_MS200 Ldrobot
    9 RPLIDAR_SCAN Rplidar
    10 RPLIDAR_EXPRESS RplidarCapsule
    11 RPLIDAR_DENSE RplidarCapsule
    12 RPLIDAR_C1 RplidarCapsule
    13 RPLIDAR_C1_SCAN Rplidar
    14 RPLIDAR_ULTRA RplidarUltra
    15 RPLIDAR_ULTRADENSE RplidarUltraDense
    16 RPLIDAR_HQ RplidarHq
    17 YDLIDAR_X4 Ydlidar
    18 YDLIDAR_X2 Ydlidar
    19 YDLIDAR_G4 Ydlidar
    20 YDLIDAR_G6 Ydlidar
    21 YDLIDAR_TG Ydlidar
    22 YDLIDAR_TMINI Ydlidar
    23 YDLIDAR_G2 Ydlidar
    24 YDLIDAR_G4B Ydlidar
    25 YDLIDAR_S4B Ydlidar
    26 COIN_D4 Ydlidar
    27 YDLIDAR_TMINI_SH Ydlidar
    28 HLS_LDS01 Lds01
    29 NEATO_XV11 Xv11
    30 XIAOMI_LDS02RR Xv11
    31 NEATO_XV11_EARLY Xv11Early
    32 LDS006 Lds006
    33 CAMSENSE_X1 Camsense
    34 CAMSENSE_X2 Camsense
    35 CAMSENSE_LDS08RR Camsense
    36 MYSTERY_360 Camsense
    37 CAMSENSE_T2 Camsense
    38 DELTA_2A Delta
    39 DELTA_2G Delta
    40 LSLIDAR_N10 Lslidar
    41 LSLIDAR_N10P Lslidar
    42 HOKUYO_URG04LX Scip
    43 HOKUYO_UTM30LX Scip
    44 HOKUYO_UST10LX Scip
    45 SICK_LMS200 Sick
}
