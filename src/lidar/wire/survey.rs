//! Counting one family's frames in a stream, to find out what is on a line.

use super::framing::Verdict;

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
pub(crate) fn count(bytes: &[u8], mut judge: impl FnMut(&[u8]) -> Verdict) -> Survey {
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
