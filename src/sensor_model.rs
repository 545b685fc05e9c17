//! How likely a measurement is, seen from a pose in a map.

pub mod beam_model;
pub mod likelihood_field;

use core::fmt;

pub use beam_model::BeamModel;
pub use likelihood_field::LikelihoodField;

/// Why a model's numbers make no model.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ConfigError {
    /// A weight is outside what the model allows, or not a number.
    Weight {
        /// The weight.
        value: f32,
    },
    /// The weights must sum to one.
    Sum {
        /// They sum to this.
        sum: f32,
    },
    /// A length or rate is outside what the model allows, or not a number.
    Scale {
        /// The number.
        value: f32,
    },
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Weight { value } => write!(f, "a weight of {value}"),
            Self::Sum { sum } => write!(f, "the weights sum to {sum}, not to 1"),
            Self::Scale { value } => write!(f, "a length or rate of {value}"),
        }
    }
}

impl core::error::Error for ConfigError {}
