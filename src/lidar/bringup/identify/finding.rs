//! The sensor that bytes are most likely from, and those that they may as well be from.

use super::refine::{Told, refine};
use super::search;
use crate::lidar::model::Model;
use crate::lidar::wire::survey::Survey;

/// What was found on a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Finding {
    /// The likeliest sensor; where models cannot be told apart, the commonest of them.
    pub model: &'static Model,
    /// How much of the stream are its frames.
    pub survey: Survey,
    told: Told,
}

impl Finding {
    /// Other models that the bytes may as well be from: their frames look the same, at the same pace where the bytes
    /// tell it.
    pub fn alternatives(&self) -> impl Iterator<Item = &'static Model> {
        let Self { model, told, .. } = *self;
        Model::ALL
            .iter()
            .filter(move |other| other.name != model.name && told.suits(model, other))
    }
}

/// The sensor that these bytes are most likely from; `None` where nothing fits.
#[must_use]
pub fn identify(bytes: &[u8]) -> Option<Finding> {
    let (model, survey) = search::best(bytes)?;
    let (model, told) = refine(model, bytes);
    Some(Finding {
        model,
        survey,
        told,
    })
}
