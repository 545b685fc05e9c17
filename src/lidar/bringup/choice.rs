//! The parser of a model that is known only when the program runs.
//!
//! A program that knows its sensor names the parser instead: this links all of them.

use crate::lidar::model::{Family, Model};
use crate::lidar::sensors::{
    camsense, delta, ld06, lds01, lds006, lslidar, rplidar, scip, sick, xv11, ydlidar,
};
use crate::lidar::wire::protocol::Protocol;

/// What to do with a parser, whichever it is.
pub trait WithParser {
    /// What comes of it.
    type Output;

    /// Does it with a parser of the model's family.
    fn run<P: Protocol + 'static>(self, parser: P) -> Self::Output;
}

/// Does something with the parser of `model`.
pub fn with_parser<W: WithParser>(model: &Model, with: W) -> W::Output {
    match model.family {
        Family::Ldrobot(_) => with.run(ld06::Parser::for_model(model)),
        Family::RplidarScan => with.run(rplidar::Parser::for_model(model)),
        Family::RplidarExpress | Family::RplidarDense => {
            with.run(rplidar::capsule::Parser::for_model(model))
        }
        Family::RplidarUltra => with.run(rplidar::ultra::UltraParser::for_model(model)),
        Family::RplidarUltraDense => with.run(rplidar::ultra::UltraDenseParser::for_model(model)),
        Family::RplidarHq => with.run(rplidar::hq::Parser::for_model(model)),
        Family::Ydlidar(_) => with.run(ydlidar::Parser::for_model(model)),
        Family::Lds006 => with.run(lds006::Parser::for_model(model)),
        Family::Lds01 => with.run(lds01::Parser::for_model(model)),
        Family::Xv11 => with.run(xv11::Parser::for_model(model)),
        Family::Xv11Early => with.run(xv11::early::Parser::for_model(model)),
        Family::Delta(_) => with.run(delta::Parser::for_model(model)),
        Family::Camsense(_) => with.run(camsense::Parser::for_model(model)),
        Family::Lslidar(_) => with.run(lslidar::Parser::for_model(model)),
        Family::Scip(_) => with.run(scip::Parser::for_model(model)),
        Family::Sick => with.run(sick::Parser::for_model(model)),
    }
}
