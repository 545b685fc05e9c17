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
        if is_better && !is_chance(survey, bytes.len()) {
            best = Some((model, survey));
        }
    }
    best
}

/// Whether frames among these bytes may be what a check code of 8 bits lets pass by chance: one in 256 of what looks like
/// the start of a frame. A few frames count only where they are most of the candidates and much of the bytes.
const fn is_chance(survey: Survey, length: usize) -> bool {
    let Survey {
        frames,
        covered_bytes,
        check_errors,
    } = survey;
    let few = frames < 3;
    let is_much = covered_bytes as u64 * 8 >= length as u64;
    let share = if few { 8 } else { 32 };
    frames == 0 || (few && !is_much) || frames.saturating_mul(share) <= check_errors
}
