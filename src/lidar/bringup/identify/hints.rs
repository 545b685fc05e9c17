//! What may be wrong with a line, in plain words.

use core::fmt;

use super::finding::{Finding, identify};
use super::search::survey_model;
use crate::lidar::model::{Family, Model};
use crate::lidar::wire::survey::Survey;

/// What may be wrong with a line, in plain words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Hint {
    /// Nothing came.
    Silence,
    /// Nothing fits any sensor.
    NothingFits,
    /// The line is read with seven bits.
    SevenBits,
    /// Two values never occur that software flow control swallows.
    FlowControl,
    /// Another sensor's frames.
    OtherModel {
        /// Whose.
        found: &'static Model,
    },
    /// The same family's frames with samples of another size.
    SampleSize {
        /// Bytes of a sample.
        bytes: u8,
        /// Check errors that would vanish (percent).
        errors_gone_percent: u8,
    },
    /// Frames are damaged here and there.
    Damaged {
        /// Bytes outside good frames (percent).
        lost_percent: u8,
    },
}

impl fmt::Display for Hint {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Silence => f.write_str(
                "not one byte came: power, ground, the sensor's TX to your RX, and does it wait for a command or its motor?",
            ),
            Self::NothingFits => f.write_str("no sensor's frames are in these bytes: most likely the baud rate is wrong"),
            Self::SevenBits => f.write_str("the highest bit is never set: is the line read with seven data bits?"),
            Self::FlowControl => f.write_str("bytes 0x11 and 0x13 never occur: software flow control is on, turn it off"),
            Self::OtherModel { found } => write!(
                f,
                "these are frames of {}, usually at {} baud",
                found.name, found.baud
            ),
            Self::SampleSize {
                bytes,
                errors_gone_percent,
            } => write!(
                f,
                "{errors_gone_percent} % of the check errors would vanish with {bytes}-byte samples"
            ),
            Self::Damaged { lost_percent } => write!(
                f,
                "{lost_percent} % of the bytes are in damaged frames: overruns, a long cable, no common ground?"
            ),
        }
    }
}

/// What may be wrong when `model` is expected and these bytes come.
pub fn hints(model: &Model, bytes: &[u8]) -> impl Iterator<Item = Hint> {
    let mut hints = [None; 4];
    if bytes.is_empty() {
        hints[0] = Some(Hint::Silence);
        return hints.into_iter().flatten();
    }
    let survey = survey_model(model, bytes);
    let found = identify(bytes);
    hints[0] = only_flow_control_is_missing(bytes).then_some(Hint::FlowControl);
    // Text is a sensor's language, too.
    let explained = found.is_some_and(|found| is_most(found.survey, bytes));
    let seven = !explained && bytes.len() >= 64 && bytes.iter().all(|byte| *byte < 0x80);
    hints[1] = seven.then_some(Hint::SevenBits);
    hints[2] = match found {
        None if survey.frames == 0 => Some(Hint::NothingFits),
        Some(found) => better_model(model, survey, found, bytes),
        None => None,
    };
    let lost = bytes.len() as u64 - u64::from(survey.covered_bytes).min(bytes.len() as u64);
    let lost_percent = (lost * 100 / bytes.len() as u64) as u8;
    let is_damaged = survey.check_errors > 1 && lost_percent >= 1 && hints[2].is_none();
    hints[3] = is_damaged.then_some(Hint::Damaged { lost_percent });
    hints.into_iter().flatten()
}

/// Whether frames cover more than half of the bytes.
fn is_most(survey: Survey, bytes: &[u8]) -> bool {
    u64::from(survey.covered_bytes) * 2 > bytes.len() as u64
}

/// Whether nearly every value occurs, but neither 0x11 nor 0x13.
fn only_flow_control_is_missing(bytes: &[u8]) -> bool {
    let mut seen = [0u32; 8];
    for byte in bytes {
        if let Some(word) = seen.get_mut(usize::from(byte >> 5)) {
            *word |= 1 << (byte & 31);
        }
    }
    let values: u32 = seen.iter().map(|word| word.count_ones()).sum();
    let [first, ..] = seen;
    values >= 248 && first & (1 << 0x11 | 1 << 0x13) == 0
}

/// Whether another sensor's frames explain the bytes better than the expected one's.
fn better_model(model: &Model, survey: Survey, found: Finding, bytes: &[u8]) -> Option<Hint> {
    if let (Family::Ydlidar(_), Family::Ydlidar(other)) = (model.family, found.model.family) {
        if model.family.frames_as(found.model.family) {
            return None;
        }
        let errors = survey.check_errors.max(1);
        let left = survey_model(found.model, bytes).check_errors;
        let gone = errors.saturating_sub(left).saturating_mul(100) / errors;
        return Some(Hint::SampleSize {
            bytes: other.bytes,
            errors_gone_percent: gone.min(100) as u8,
        });
    }
    let same =
        core::mem::discriminant(&model.family) == core::mem::discriminant(&found.model.family);
    let is_clear = found.survey.covered_bytes > 2 * survey.covered_bytes;
    (!same && is_clear).then_some(Hint::OtherModel { found: found.model })
}
