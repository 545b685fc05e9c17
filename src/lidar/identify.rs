//! What is on the line? From a second of bytes: the sensor's family, and plain words where something is wrong.
//!
//! Every family's frames are looked for; check codes tell them apart, and what they leave open (two packings of one
//! capsule, models of one family) the measurements do. Costs some passes over the bytes; meant for start-up and for
//! finding faults, not for every day.

use core::fmt;

use super::{
    Family, Layout as _, Model, Packet as _, Protocol, Verdict, camsense, coin_d4, delta, ld06,
    lds01, rplidar, scip, sick, xv11, ydlidar,
};

/// Line speeds at which to listen, the commonest first (bits/s).
pub const BAUDS: [u32; 8] = [
    115_200, 230_400, 128_000, 256_000, 460_800, 921_600, 1_000_000, 512_000,
];

/// How much of a stream is one family's frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Survey {
    /// Good frames.
    pub frames: u32,
    /// Bytes in them and in answers.
    pub covered_bytes: u32,
    /// Frames that failed their check.
    pub check_errors: u32,
}

/// Counts frames by the rule of [`super::framing`].
pub fn survey(bytes: &[u8], mut judge: impl FnMut(&[u8]) -> Verdict) -> Survey {
    let mut survey = Survey::default();
    let mut rest = bytes;
    while let Some((_, after)) = rest.split_first() {
        let taken = match judge(rest) {
            Verdict::Frame(length) => {
                survey.frames += 1;
                length
            }
            Verdict::Answer(length) => length,
            Verdict::CheckFailed => {
                survey.check_errors += 1;
                0
            }
            _ => 0,
        };
        survey.covered_bytes += taken as u32;
        rest = match taken {
            0 => after,
            _ => rest.get(taken..).unwrap_or(&[]),
        };
    }
    survey
}

/// What was found on a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Finding {
    /// The likeliest sensor; where models cannot be told apart, the commonest of them.
    pub model: &'static Model,
    /// How much of the stream are its frames.
    pub survey: Survey,
}

/// Families that frames tell apart, each by a model that stands for it.
const CANDIDATES: [&Model; 17] = [
    &Model::LDROBOT_LD06,
    &Model::YDLIDAR_X4,
    &Model::YDLIDAR_TMINI,
    &Model::YDLIDAR_TMINI_SH,
    &Model::COIN_D4,
    &Model::HLS_LDS01,
    &Model::NEATO_XV11,
    &Model::NEATO_XV11_EARLY,
    &Model::CAMSENSE_X1,
    &Model::DELTA_2A,
    &Model::RPLIDAR_EXPRESS,
    &Model::RPLIDAR_ULTRA,
    &Model::RPLIDAR_ULTRADENSE,
    &Model::RPLIDAR_HQ,
    &Model::SICK_LMS200,
    &Model::HOKUYO_URG04LX,
    &Model::RPLIDAR_SCAN,
];

/// How much of a stream are frames as `model` sends them.
#[must_use]
pub fn survey_model(model: &Model, bytes: &[u8]) -> Survey {
    match model.family {
        Family::Ldrobot(_) => survey(bytes, ld06::judge),
        Family::RplidarScan => survey(bytes, rplidar::judge),
        Family::RplidarExpress | Family::RplidarDense => survey(bytes, rplidar::capsule::judge),
        Family::RplidarUltra => survey(bytes, rplidar::ultra::judge_ultra),
        Family::RplidarUltraDense => survey(bytes, rplidar::ultra::judge_ultra_dense),
        Family::RplidarHq => survey(bytes, rplidar::hq::Frames::judge),
        Family::Ydlidar(samples) => survey(bytes, |bytes| ydlidar::judge(bytes, samples.bytes)),
        Family::Lds01 => survey(bytes, lds01::Frames::judge),
        Family::Xv11 => survey(bytes, xv11::Frames::judge),
        Family::Xv11Early => survey(bytes, xv11::early::Frames::judge),
        Family::Delta(_) => survey(bytes, delta::judge),
        Family::Camsense => survey(bytes, camsense::Frames::judge),
        Family::CoinD4 => survey(bytes, coin_d4::Frames::judge),
        Family::Scip(_) => scip::survey(bytes),
        Family::Sick => survey(bytes, sick::Telegrams::judge),
    }
}

/// The sensor that these bytes are most likely from; `None` where nothing fits.
#[must_use]
pub fn identify(bytes: &[u8]) -> Option<Finding> {
    let mut best: Option<Finding> = None;
    for model in CANDIDATES {
        let survey = survey_model(model, bytes);
        // Random bytes are full of RPLIDAR points, which have no check code: believe them only without gaps.
        let is_believable = match model.family {
            Family::RplidarScan => {
                survey.frames >= 20
                    && u64::from(survey.covered_bytes) * 20 >= bytes.len() as u64 * 19
            }
            Family::Scip(_) => survey.frames >= 3,
            // A whole second of one of the others holds more; a single frame is no proof of a check code of 8 bits.
            _ => survey.frames >= 1,
        };
        let is_better = best.is_none_or(|best| survey.covered_bytes > best.survey.covered_bytes);
        if is_believable && is_better {
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
            let express = smooth_steps(
                rplidar::capsule::Parser::express(&Model::RPLIDAR_EXPRESS),
                bytes,
            );
            let dense = smooth_steps(rplidar::capsule::Parser::dense(&Model::RPLIDAR_C1), bytes);
            if express >= dense {
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
        delta::Sector::Sixteenth => &Model::DELTA_2A,
        delta::Sector::Fifteenth => &Model::DELTA_2G,
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
    let is_text = matches!(model.family, Family::Scip(_));
    let flow = !is_text && only_flow_control_is_missing(bytes);
    hints[0] = flow.then_some(Hint::FlowControl);
    let seven = !is_text && bytes.len() >= 64 && bytes.iter().all(|byte| *byte < 0x80);
    hints[1] = seven.then_some(Hint::SevenBits);
    hints[2] = match identify(bytes) {
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
    if let (Family::Ydlidar(expected), Family::Ydlidar(other)) = (model.family, found.model.family)
    {
        if expected.bytes == other.bytes {
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
