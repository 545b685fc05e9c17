//! Any lidar of the table at run time: the parsers of all protocols in one place, of which a command chooses.
//!
//! It takes the flash of them all and the memory of the largest: for boards that have it.

use beamfix::{
    lidar::{Counters, Family, Model, Packet, Protocol, Reading, View, parsers, survey::Survey},
    odometry::Odometry,
    scan::Beam,
};

use crate::{AppConfig, Firmware, Place};

/// What a board runs that takes any lidar, of up to N beams a revolution, and tells its pose since the start.
pub type AnyLidar<const N: usize> = Firmware<AnyParser, Odometry<N>, N>;

macro_rules! any {
    ($($name:ident)*) => {
        /// The parser of any model.
        #[allow(clippy::large_enum_variant, reason = "there is no heap")]
        pub enum AnyParser {
            $(#[doc = concat!("Of the protocol ", stringify!($name), ".")] $name(parsers::$name),)*
        }

        /// A packet of any protocol.
        #[allow(clippy::large_enum_variant, reason = "there is no heap")]
        pub enum AnyPacket {
            $(#[doc = concat!("Of the protocol ", stringify!($name), ".")] $name(<parsers::$name as Protocol>::Packet),)*
        }

        /// An iterator over what is in a packet, whichever it is.
        #[allow(clippy::large_enum_variant, reason = "it lives for a packet")]
        enum Inside<$($name),*> {
            $($name($name),)*
        }

        impl<T, $($name: Iterator<Item = T>),*> Iterator for Inside<$($name),*> {
            type Item = T;

            fn next(&mut self) -> Option<T> {
                match self {
                    $(Self::$name(inside) => inside.next(),)*
                }
            }
        }

        impl Packet for AnyPacket {
            fn view(&self) -> &View {
                match self {
                    $(Self::$name(packet) => packet.view(),)*
                }
            }

            fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
                match self {
                    $(Self::$name(packet) => Inside::$name(packet.readings()),)*
                }
            }

            fn beams(&self) -> impl Iterator<Item = Beam> + '_ {
                match self {
                    $(Self::$name(packet) => Inside::$name(packet.beams()),)*
                }
            }

            fn speed_rpm(&self) -> Option<f32> {
                match self {
                    $(Self::$name(packet) => packet.speed_rpm(),)*
                }
            }
        }

        impl Protocol for AnyParser {
            type Packet = AnyPacket;

            fn push(&mut self, byte: u8) -> Option<AnyPacket> {
                match self {
                    $(Self::$name(parser) => parser.push(byte).map(AnyPacket::$name),)*
                }
            }

            fn pull(&mut self) -> Option<AnyPacket> {
                match self {
                    $(Self::$name(parser) => parser.pull().map(AnyPacket::$name),)*
                }
            }

            fn arrived(&mut self, now_us: u32) {
                match self {
                    $(Self::$name(parser) => parser.arrived(now_us),)*
                }
            }

            fn set_zero(&mut self, zero_cdeg: u16) {
                match self {
                    $(Self::$name(parser) => parser.set_zero(zero_cdeg),)*
                }
            }

            fn pending_bytes(&self) -> usize {
                match self {
                    $(Self::$name(parser) => parser.pending_bytes(),)*
                }
            }

            fn counters(&self) -> Counters {
                match self {
                    $(Self::$name(parser) => parser.counters(),)*
                }
            }

            fn survey(&self, bytes: &[u8]) -> Survey {
                match self {
                    $(Self::$name(parser) => parser.survey(bytes),)*
                }
            }
        }
    };
}

any! {
    Camsense Delta Ldrobot Lds01 Lds006 Lslidar Rplidar RplidarCapsule RplidarHq RplidarUltra RplidarUltraDense Scip Sick Xv11
    Xv11Early Ydlidar
}

impl AnyParser {
    /// Reads this model's bytes; `None` for a family that this file does not know.
    #[must_use]
    pub fn for_model(model: &Model) -> Option<Self> {
        Some(match model.family {
            Family::Ldrobot(_) => Self::Ldrobot(parsers::Ldrobot::for_model(model)),
            Family::RplidarScan => Self::Rplidar(parsers::Rplidar::for_model(model)),
            Family::RplidarExpress | Family::RplidarDense => {
                Self::RplidarCapsule(parsers::RplidarCapsule::for_model(model))
            }
            Family::RplidarUltra => Self::RplidarUltra(parsers::RplidarUltra::for_model(model)),
            Family::RplidarUltraDense => {
                Self::RplidarUltraDense(parsers::RplidarUltraDense::for_model(model))
            }
            Family::RplidarHq => Self::RplidarHq(parsers::RplidarHq::for_model(model)),
            Family::Ydlidar(_) => Self::Ydlidar(parsers::Ydlidar::for_model(model)),
            Family::Lds006 => Self::Lds006(parsers::Lds006::for_model(model)),
            Family::Lds01 => Self::Lds01(parsers::Lds01::for_model(model)),
            Family::Xv11 => Self::Xv11(parsers::Xv11::for_model(model)),
            Family::Xv11Early => Self::Xv11Early(parsers::Xv11Early::for_model(model)),
            Family::Delta(_) => Self::Delta(parsers::Delta::for_model(model)),
            Family::Camsense(_) => Self::Camsense(parsers::Camsense::for_model(model)),
            Family::Lslidar(_) => Self::Lslidar(parsers::Lslidar::for_model(model)),
            Family::Scip(_) => Self::Scip(parsers::Scip::for_model(model)),
            Family::Sick => Self::Sick(parsers::Sick::for_model(model)),
            _ => return None,
        })
    }
}

impl<const N: usize> Place<AnyLidar<N>> {
    /// Makes the application there, with the settings' lidar until a command chooses another.
    pub fn any(&mut self, config: &AppConfig) -> &mut AnyLidar<N> {
        let Self(app) = self;
        app.choose(config);
        app
    }
}

impl<const N: usize> AnyLidar<N> {
    /// Begins anew with the settings' lidar, in its place; what is sent besides poses stays as it was asked for.
    pub fn choose(&mut self, config: &AppConfig) {
        let (record, scans, quality) = match self.report.lidar {
            Some(_) => (self.report.record, self.report.scans, self.report.quality),
            None => (config.record, config.scans, config.quality),
        };
        let config = AppConfig {
            record,
            scans,
            quality,
            ..*config
        };
        if let Some(parser) = AnyParser::for_model(config.lidar) {
            self.set_up(parser, &config);
        }
        self.report.lidars = Some(Model::named);
    }

    /// The lidar that a command has chosen since the last [`AnyLidar::choose`].
    #[must_use]
    pub fn chosen(&self) -> Option<&'static Model> {
        self.report.chosen
    }
}
