//! What is on the line? From a second of bytes: the sensor's family, and plain words where something is wrong.
//!
//! Every family's frames are looked for; check codes tell them apart, and what they leave open (two packings of one
//! capsule, models of one family) the measurements do. Costs some passes over the bytes; meant for start-up and for
//! finding faults, not for every day.

use core::fmt;

use super::choice::{WithParser, with_parser};
use crate::lidar::model::{Family, Model, Sector};
use crate::lidar::sensors::{delta, ld06, rplidar};
use crate::lidar::wire::packet::Packet as _;
use crate::lidar::wire::protocol::Protocol;
use crate::lidar::wire::survey::Survey;

/// Line speeds at which to listen, the commonest first (bits/s).
pub const BAUDS: [u32; 8] = [
    115_200, 230_400, 128_000, 256_000, 460_800, 921_600, 1_000_000, 512_000,
];

/// What was found on a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Finding {
    /// The likeliest sensor; where models cannot be told apart, the commonest of them.
    pub model: &'static Model,
    /// How much of the stream are its frames.
    pub survey: Survey,
}

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

/// The sensor that these bytes are most likely from; `None` where nothing fits.
#[must_use]
pub fn identify(bytes: &[u8]) -> Option<Finding> {
    let mut best: Option<Finding> = None;
    for model in candidates() {
        let survey = survey_model(model, bytes);
        let is_better = best.is_none_or(|best| survey.covered_bytes > best.survey.covered_bytes);
        // A whole second holds more; a single frame is no proof of a check code of 8 bits, but better than nothing.
        if survey.frames >= 1 && is_better {
            best = Some(Finding { model, survey });
        }
    }
    let Finding { model, survey } = best?;
    Some(Finding {
        model: refine(model, bytes),
        survey,
    })
}

/// The model of a family by what its frames say.
fn refine(model: &'static Model, bytes: &[u8]) -> &'static Model {
    match model.family {
        Family::Ldrobot(_) => ldrobot_by_pace(bytes),
        Family::Delta(_) => delta_by_sector(bytes),
        Family::Camsense if bytes.windows(4).any(|w| w == [0x55, 0xaa, 0x07, 0x0c]) => {
            &Model::CAMSENSE_LDS08RR
        }
        Family::RplidarExpress => {
            let smooth = |model| smooth_steps(rplidar::capsule::Parser::for_model(model), bytes);
            if smooth(&Model::RPLIDAR_EXPRESS) >= smooth(&Model::RPLIDAR_C1) {
                model
            } else {
                &Model::RPLIDAR_DENSE
            }
        }
        _ => model,
    }
}

/// Which LDROBOT sensor measures as often as the time stamps say.
fn ldrobot_by_pace(bytes: &[u8]) -> &'static Model {
    let mut parser = ld06::Parser::new();
    let (mut frames, mut elapsed_ms, mut previous, mut speed) = (0u32, 0u32, None::<u16>, 0);
    for packet in bytes.iter().filter_map(|&byte| parser.push(byte)) {
        if let Some(previous) = previous.replace(packet.stamp_ms) {
            let passed = u32::from(packet.stamp_ms) + 30_000 - u32::from(previous);
            let passed = if passed >= 30_000 {
                passed - 30_000
            } else {
                passed
            };
            // Frames that follow each other, not those on both sides of a gap.
            if passed <= 7 {
                frames += 1;
                elapsed_ms += passed;
            }
        }
        speed = packet.speed_deg_per_s;
    }
    match frames
        .saturating_mul(12_000)
        .checked_div(elapsed_ms)
        .unwrap_or(4500)
    {
        0..=3200 if speed < 2000 => &Model::LDROBOT_LDS02,
        0..=3200 => &Model::LDROBOT_LD14,
        3201..=4250 => &Model::LDROBOT_LD14P,
        4251..=4750 => &Model::LDROBOT_LD06,
        4751..=10_000 => &Model::LDROBOT_STL19P,
        _ => &Model::LDROBOT_STL27L,
    }
}

/// Which Delta has frames as far apart as these.
fn delta_by_sector(bytes: &[u8]) -> &'static Model {
    let mut parser = delta::Parser::for_model(&Model::DELTA_2A);
    for &byte in bytes {
        parser.push(byte);
    }
    match parser.format().sector() {
        Sector::Sixteenth => &Model::DELTA_2A,
        Sector::Fifteenth => &Model::DELTA_2G,
    }
}

/// Share of neighbours that differ by less than a 16th (1/1000): walls are smooth, misread bytes are not.
fn smooth_steps(mut parser: impl Protocol, bytes: &[u8]) -> u32 {
    let (mut smooth, mut all) = (0u32, 1u32);
    for &byte in bytes {
        let Some(packet) = parser.push(byte) else {
            continue;
        };
        let mut previous = None;
        for mm in packet.beams().filter_map(|beam| beam.range.mm().ok()) {
            if let Some(previous) = previous.replace(mm) {
                all += 1;
                smooth += u32::from(mm.abs_diff(previous) < mm / 16);
            }
        }
    }
    smooth.saturating_mul(1000).checked_div(all).unwrap_or(0)
}

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
