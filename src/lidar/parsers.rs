//! The parser of each protocol family, for firmware that knows its lidar when it is compiled.
//!
//! Each has `for_model(&Model)`, which takes a row of the table of models: directions, zero and pace are that model's.
//! Where the lidar is known only at run time, [`with_parser`](super::choice::with_parser) finds its parser.
//!
//! ```
//! use beamfix::lidar::{Model, Protocol as _, parsers};
//!
//! let mut parser = parsers::Ydlidar::for_model(&Model::YDLIDAR_X4);
//! assert!(parser.push(0xAA).is_none()); // the first byte of a packet
//! ```

pub use super::sensors::{
    camsense::Parser as Camsense,
    delta::Parser as Delta,
    ld06::Parser as Ldrobot,
    lds01::Parser as Lds01,
    lds006::Parser as Lds006,
    lslidar::Parser as Lslidar,
    rplidar::Parser as Rplidar,
    rplidar::capsule::Parser as RplidarCapsule,
    rplidar::hq::Parser as RplidarHq,
    rplidar::ultra::{UltraDenseParser as RplidarUltraDense, UltraParser as RplidarUltra},
    scip::Parser as Scip,
    sick::Parser as Sick,
    xv11::Parser as Xv11,
    xv11::early::Parser as Xv11Early,
    ydlidar::Parser as Ydlidar,
};
