//! Which family's frames are in a stream?

use crate::lidar::bringup::choice::{WithParser, with_parser};
use crate::lidar::model::Model;
use crate::lidar::wire::protocol::Protocol;
use crate::lidar::wire::survey::Survey;

/// How much of a stream are frames as `model` sends them.
#[must_use]
pub fn survey_model(model: &Model, bytes: &[u8]) -> Survey {
    struct Count<'a>(&'a [u8]);

    impl WithParser for Count<'_> {
        type Output = Survey;

        #[inline(never)]
        fn run<P: Protocol>(self, parser: P) -> Survey {
            parser.survey(self.0)
        }
    }

    with_parser(model, Count(bytes))
}

/// Every kind of frame, each by the first model that sends it.
fn candidates() -> impl Iterator<Item = &'static Model> {
    let before = |k| Model::ALL.get(..k).unwrap_or(&[]).iter();
    Model::ALL
        .iter()
        .enumerate()
        .filter(move |&(k, model)| !before(k).any(|other| model.family.frames_as(other.family)))
        .map(|(_, model)| model)
}

/// The kind of frame that covers most of the bytes, if any does.
pub(super) fn best(bytes: &[u8]) -> Option<(&'static Model, Survey)> {
    let mut best: Option<(&Model, Survey)> = None;
    for model in candidates() {
        let survey = survey_model(model, bytes);
        let is_better = best.is_none_or(|(_, best)| survey.covered_bytes > best.covered_bytes);
        // A whole second holds more; a single frame is no proof of a check code of 8 bits, but better than nothing.
        if survey.frames >= 1 && is_better {
            best = Some((model, survey));
        }
    }
    best
}
