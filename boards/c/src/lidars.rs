//! One static a lidar: its row of the table of models, and the code of its protocol. A program has the code of those that it names.

use core::{
    ffi::{CStr, c_char},
    mem::size_of,
};

use beamfix_core::{
    Odometry,
    lidar::{Model, parsers},
};

use crate::{
    object::{ForModel, Ops, needed},
    place::{Localization, Mapping},
    types::*,
};

/// A lidar: how its bytes are read, at what speed they come, how it is started.
pub struct Lidar {
    pub(crate) model: &'static Model,
    pub(crate) usual: Ops<BEAMFIX_BEAMS>,
    pub(crate) small: Ops<BEAMFIX_SMALL_BEAMS>,
}

impl Lidar {
    const fn new<P: ForModel>(model: &'static Model) -> Self {
        Self {
            model,
            usual: Ops::of::<P>(),
            small: Ops::of::<P>(),
        }
    }
}

/// LDROBOT LD06. 230400 bits/s, up to 520 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_LDROBOT_LD06: Lidar = Lidar::new::<parsers::Ldrobot>(&Model::LDROBOT_LD06);

/// LDROBOT LD19. 230400 bits/s, up to 520 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_LDROBOT_LD19: Lidar = Lidar::new::<parsers::Ldrobot>(&Model::LDROBOT_LD19);

/// LDROBOT STL-19P, D500 kit; also STL-06P and STL-26. 230400 bits/s, up to 570 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_LDROBOT_STL19P: Lidar = Lidar::new::<parsers::Ldrobot>(&Model::LDROBOT_STL19P);

/// LDROBOT STL-27L. 921600 bits/s, up to 2300 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_LDROBOT_STL27L: Lidar = Lidar::new::<parsers::Ldrobot>(&Model::LDROBOT_STL27L);

/// LDROBOT LD14. 115200 bits/s, up to 430 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_LDROBOT_LD14: Lidar = Lidar::new::<parsers::Ldrobot>(&Model::LDROBOT_LD14);

/// LDROBOT LD14P. 230400 bits/s, up to 730 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_LDROBOT_LD14P: Lidar = Lidar::new::<parsers::Ldrobot>(&Model::LDROBOT_LD14P);

/// LDROBOT LD14P in its variant with 2300 measurements a second; on the line it looks as an LD14. 230400 bits/s, up to 430 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_LDROBOT_LD14P_2300: Lidar =
    Lidar::new::<parsers::Ldrobot>(&Model::LDROBOT_LD14P_2300);

/// LDS-02 (HLS-LFCD3, LD08). 115200 bits/s, up to 510 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_LDROBOT_LDS02: Lidar = Lidar::new::<parsers::Ldrobot>(&Model::LDROBOT_LDS02);

/// Oradar MS200: the LD06's frames. 230400 bits/s, up to 520 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_ORADAR_MS200: Lidar = Lidar::new::<parsers::Ldrobot>(&Model::ORADAR_MS200);

/// RPLIDAR A1 or A2 in standard scan. 115200 bits/s, up to 400 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_RPLIDAR_SCAN: Lidar = Lidar::new::<parsers::Rplidar>(&Model::RPLIDAR_SCAN);

/// RPLIDAR A1 or A2 in legacy express scan. 115200 bits/s, up to 800 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_RPLIDAR_EXPRESS: Lidar =
    Lidar::new::<parsers::RplidarCapsule>(&Model::RPLIDAR_EXPRESS);

/// RPLIDAR S2 in dense scan. 1000000 bits/s, up to 3400 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_RPLIDAR_DENSE: Lidar =
    Lidar::new::<parsers::RplidarCapsule>(&Model::RPLIDAR_DENSE);

/// RPLIDAR C1. 460800 bits/s, up to 540 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_RPLIDAR_C1: Lidar = Lidar::new::<parsers::RplidarCapsule>(&Model::RPLIDAR_C1);

/// RPLIDAR C1 in standard scan. 460800 bits/s, up to 540 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_RPLIDAR_C1_SCAN: Lidar = Lidar::new::<parsers::Rplidar>(&Model::RPLIDAR_C1_SCAN);

/// RPLIDAR A3 in boost scan. 256000 bits/s, up to 1700 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_RPLIDAR_ULTRA: Lidar =
    Lidar::new::<parsers::RplidarUltra>(&Model::RPLIDAR_ULTRA);

/// RPLIDAR S3 in ultra-dense scan. 1000000 bits/s, up to 3400 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_RPLIDAR_ULTRADENSE: Lidar =
    Lidar::new::<parsers::RplidarUltraDense>(&Model::RPLIDAR_ULTRADENSE);

/// RPLIDAR in HQ scan; 8 bytes a point, so only on a fast line. 1000000 bits/s, up to 1100 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_RPLIDAR_HQ: Lidar = Lidar::new::<parsers::RplidarHq>(&Model::RPLIDAR_HQ);

/// YDLIDAR X4. 128000 bits/s, up to 900 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_YDLIDAR_X4: Lidar = Lidar::new::<parsers::Ydlidar>(&Model::YDLIDAR_X4);

/// YDLIDAR X2, X2L, X3. 115200 bits/s, up to 700 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_YDLIDAR_X2: Lidar = Lidar::new::<parsers::Ydlidar>(&Model::YDLIDAR_X2);

/// YDLIDAR G4. 230400 bits/s, up to 1500 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_YDLIDAR_G4: Lidar = Lidar::new::<parsers::Ydlidar>(&Model::YDLIDAR_G4);

/// YDLIDAR G6, G7. 512000 bits/s, up to 3000 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_YDLIDAR_G6: Lidar = Lidar::new::<parsers::Ydlidar>(&Model::YDLIDAR_G6);

/// YDLIDAR TG15, TG30, TG50: time of flight. 512000 bits/s, up to 2300 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_YDLIDAR_TG: Lidar = Lidar::new::<parsers::Ydlidar>(&Model::YDLIDAR_TG);

/// YDLIDAR T-mini Pro and Plus. 230400 bits/s, up to 750 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_YDLIDAR_TMINI: Lidar = Lidar::new::<parsers::Ydlidar>(&Model::YDLIDAR_TMINI);

/// YDLIDAR G2 and others with an intensity byte. 230400 bits/s, up to 900 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_YDLIDAR_G2: Lidar = Lidar::new::<parsers::Ydlidar>(&Model::YDLIDAR_G2);

/// YDLIDAR G4B: 10 bits of intensity. 512000 bits/s, up to 1500 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_YDLIDAR_G4B: Lidar = Lidar::new::<parsers::Ydlidar>(&Model::YDLIDAR_G4B);

/// YDLIDAR S4B: 8 bits of intensity. 153600 bits/s, up to 750 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_YDLIDAR_S4B: Lidar = Lidar::new::<parsers::Ydlidar>(&Model::YDLIDAR_S4B);

/// COIN-D4, also sold as TurtleBot3's LDS-03: by its frames alone it looks like a T-mini. 230400 bits/s, up to 750 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_COIN_D4: Lidar = Lidar::new::<parsers::Ydlidar>(&Model::COIN_D4);

/// YDLIDAR T-mini Plus SH: four bytes a sample; not verified on a unit. 230400 bits/s, up to 750 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_YDLIDAR_TMINI_SH: Lidar =
    Lidar::new::<parsers::Ydlidar>(&Model::YDLIDAR_TMINI_SH);

/// LDS-01 (HLS-LFCD2). 230400 bits/s, up to 360 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_HLS_LDS01: Lidar = Lidar::new::<parsers::Lds01>(&Model::HLS_LDS01);

/// Neato XV-11, firmware 2.4 and later. 115200 bits/s, up to 360 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_NEATO_XV11: Lidar = Lidar::new::<parsers::Xv11>(&Model::NEATO_XV11);

/// Xiaomi LDS02RR: the XV-11's frames, clockwise by the one source there is. 115200 bits/s, up to 360 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_XIAOMI_LDS02RR: Lidar = Lidar::new::<parsers::Xv11>(&Model::XIAOMI_LDS02RR);

/// Neato XV-11, early firmware. 115200 bits/s, up to 360 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_NEATO_XV11_EARLY: Lidar =
    Lidar::new::<parsers::Xv11Early>(&Model::NEATO_XV11_EARLY);

/// LDS-006. 115200 bits/s, up to 360 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_LDS006: Lidar = Lidar::new::<parsers::Lds006>(&Model::LDS006);

/// Camsense X1. 115200 bits/s, up to 440 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_CAMSENSE_X1: Lidar = Lidar::new::<parsers::Camsense>(&Model::CAMSENSE_X1);

/// Camsense X2. No source tells its pace: it is taken as the X1's. 115200 bits/s, up to 440 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_CAMSENSE_X2: Lidar = Lidar::new::<parsers::Camsense>(&Model::CAMSENSE_X2);

/// LDS08RR: the Camsense frame with 16-bit quality. No source says that its angles are to be corrected. 115200 bits/s, up to 440 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_CAMSENSE_LDS08RR: Lidar =
    Lidar::new::<parsers::Camsense>(&Model::CAMSENSE_LDS08RR);

/// "Mystery 360": a nameless time-of-flight sensor of 2024 with 16 points in a frame. 230400 bits/s, up to 640 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_MYSTERY_360: Lidar = Lidar::new::<parsers::Camsense>(&Model::MYSTERY_360);

/// Camsense T2, T200: time of flight. No source tells a pace that its line carries: it is taken as the X1's. 115200 bits/s, up to 440 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_CAMSENSE_T2: Lidar = Lidar::new::<parsers::Camsense>(&Model::CAMSENSE_T2);

/// 3irobotix Delta-1A, 2A, 2B. 230400 bits/s, up to 960 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_DELTA_2A: Lidar = Lidar::new::<parsers::Delta>(&Model::DELTA_2A);

/// 3irobotix Delta-2G. 115200 bits/s, up to 900 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_DELTA_2G: Lidar = Lidar::new::<parsers::Delta>(&Model::DELTA_2G);

/// LSLIDAR N10, L10. 230400 bits/s, up to 520 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_LSLIDAR_N10: Lidar = Lidar::new::<parsers::Lslidar>(&Model::LSLIDAR_N10);

/// LSLIDAR N10P. 460800 bits/s, up to 620 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_LSLIDAR_N10P: Lidar = Lidar::new::<parsers::Lslidar>(&Model::LSLIDAR_N10P);

/// Hokuyo URG-04LX: 19 200 baud after power-on; a slower line than this does not carry every scan. 750000 bits/s, up to 726 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_HOKUYO_URG04LX: Lidar = Lidar::new::<parsers::Scip>(&Model::HOKUYO_URG04LX);

/// Hokuyo UTM-30LX: over USB, where the speed of the line only has to be enough for 40 scans a second. 2000000 bits/s, up to 1081 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_HOKUYO_UTM30LX: Lidar = Lidar::new::<parsers::Scip>(&Model::HOKUYO_UTM30LX);

/// Hokuyo UST-10LX, UST-20LX: over Ethernet, with the same commands. 2000000 bits/s, up to 1081 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_HOKUYO_UST10LX: Lidar = Lidar::new::<parsers::Scip>(&Model::HOKUYO_UST10LX);

/// SICK LMS200, LMS291: 9600 baud after power-on; only 500 000 carries every scan. 500000 bits/s, up to 401 beams a revolution.
#[unsafe(no_mangle)]
pub static BEAMFIX_SICK_LMS200: Lidar = Lidar::new::<parsers::Sick>(&Model::SICK_LMS200);

static ALL: [&Lidar; 46] = [
    &BEAMFIX_LDROBOT_LD06,
    &BEAMFIX_LDROBOT_LD19,
    &BEAMFIX_LDROBOT_STL19P,
    &BEAMFIX_LDROBOT_STL27L,
    &BEAMFIX_LDROBOT_LD14,
    &BEAMFIX_LDROBOT_LD14P,
    &BEAMFIX_LDROBOT_LD14P_2300,
    &BEAMFIX_LDROBOT_LDS02,
    &BEAMFIX_ORADAR_MS200,
    &BEAMFIX_RPLIDAR_SCAN,
    &BEAMFIX_RPLIDAR_EXPRESS,
    &BEAMFIX_RPLIDAR_DENSE,
    &BEAMFIX_RPLIDAR_C1,
    &BEAMFIX_RPLIDAR_C1_SCAN,
    &BEAMFIX_RPLIDAR_ULTRA,
    &BEAMFIX_RPLIDAR_ULTRADENSE,
    &BEAMFIX_RPLIDAR_HQ,
    &BEAMFIX_YDLIDAR_X4,
    &BEAMFIX_YDLIDAR_X2,
    &BEAMFIX_YDLIDAR_G4,
    &BEAMFIX_YDLIDAR_G6,
    &BEAMFIX_YDLIDAR_TG,
    &BEAMFIX_YDLIDAR_TMINI,
    &BEAMFIX_YDLIDAR_G2,
    &BEAMFIX_YDLIDAR_G4B,
    &BEAMFIX_YDLIDAR_S4B,
    &BEAMFIX_COIN_D4,
    &BEAMFIX_YDLIDAR_TMINI_SH,
    &BEAMFIX_HLS_LDS01,
    &BEAMFIX_NEATO_XV11,
    &BEAMFIX_XIAOMI_LDS02RR,
    &BEAMFIX_NEATO_XV11_EARLY,
    &BEAMFIX_LDS006,
    &BEAMFIX_CAMSENSE_X1,
    &BEAMFIX_CAMSENSE_X2,
    &BEAMFIX_CAMSENSE_LDS08RR,
    &BEAMFIX_MYSTERY_360,
    &BEAMFIX_CAMSENSE_T2,
    &BEAMFIX_DELTA_2A,
    &BEAMFIX_DELTA_2G,
    &BEAMFIX_LSLIDAR_N10,
    &BEAMFIX_LSLIDAR_N10P,
    &BEAMFIX_HOKUYO_URG04LX,
    &BEAMFIX_HOKUYO_UTM30LX,
    &BEAMFIX_HOKUYO_UST10LX,
    &BEAMFIX_SICK_LMS200,
];

/// The lidar of a name, such as "ld06": `beamfix lidars` lists them. Null where there is none.
///
/// It has the code of every protocol: a program that knows its lidar names its constant instead.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_lidar_named(name: *const c_char) -> *const Lidar {
    if name.is_null() {
        return core::ptr::null();
    }
    // SAFETY: by the header a string that ends with a zero.
    let name = unsafe { CStr::from_ptr(name) }.to_bytes();
    let found = ALL.iter().find(|lidar| lidar.model.name.as_bytes() == name);
    found.map_or(core::ptr::null(), |lidar| {
        core::ptr::from_ref::<Lidar>(lidar)
    })
}

/// Speed of the lidar's line (bits/s), 8 data bits, no parity, one stop bit; 0 for null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_lidar_baud(lidar: *const Lidar) -> u32 {
    // SAFETY: where not null, one of the statics of this header.
    unsafe { lidar.as_ref() }.map_or(0, |lidar| lidar.model.baud)
}

/// Most beams of a revolution of the lidar; 0 for null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn beamfix_lidar_beams(lidar: *const Lidar) -> u16 {
    // SAFETY: where not null, one of the statics of this header.
    unsafe { lidar.as_ref() }.map_or(0, |lidar| lidar.model.beams_per_revolution)
}

/// The constants of the header hold for every lidar.
const _: () = {
    let mut k = 0;
    while k < ALL.len() {
        let Lidar { usual, small, .. } = ALL[k];
        assert!(needed(usual, size_of::<Odometry<BEAMFIX_BEAMS>>()) <= BEAMFIX_ODOMETRY_BYTES);
        assert!(needed(usual, size_of::<Mapping>()) <= BEAMFIX_MAPPING_BYTES);
        assert!(
            needed(usual, size_of::<Localization<BEAMFIX_BEAMS>>()) <= BEAMFIX_LOCALIZATION_BYTES
        );
        assert!(
            needed(small, size_of::<Odometry<BEAMFIX_SMALL_BEAMS>>())
                <= BEAMFIX_SMALL_ODOMETRY_BYTES
        );
        assert!(
            needed(small, size_of::<Localization<BEAMFIX_SMALL_BEAMS>>())
                <= BEAMFIX_SMALL_LOCALIZATION_BYTES
        );
        k += 1;
    }
    let ldrobot = needed(
        &BEAMFIX_LDROBOT_LD06.small,
        size_of::<Odometry<BEAMFIX_SMALL_BEAMS>>(),
    );
    assert!(ldrobot <= BEAMFIX_LDROBOT_SMALL_ODOMETRY_BYTES);
};
