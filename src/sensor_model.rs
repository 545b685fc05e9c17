//! How likely a measurement is, seen from a pose in a map.

pub mod beam_model;
pub mod likelihood_field;

pub use beam_model::BeamModel;
pub use likelihood_field::LikelihoodField;
