//! Replies of SCIP 2.0 among other bytes, to find out what is on a line.

use super::text::{MAX_LINE, checked};
use crate::lidar::wire::survey::Survey;

/// Replies among other bytes: the echo of a command, at least three lines with right check characters, an empty line.
///
/// Of any text one line in 64 ends in its check character by chance; three in a row behind an echo do not.
pub(super) fn count(bytes: &[u8]) -> Survey {
    let mut survey = Survey::default();
    // Bytes and good lines of the reply that is being read.
    let mut reply: Option<(u32, u32)> = None;
    for line in bytes.split(|byte| *byte == b'\n') {
        let text = line.strip_suffix(b"\r").unwrap_or(line);
        let length = line.len() as u32 + 1;
        reply = match reply {
            Some((bytes, lines)) if text.is_empty() => {
                if lines >= 3 {
                    survey.frames += 1;
                    survey.covered_bytes += bytes + length;
                }
                None
            }
            Some((bytes, lines)) if text.len() <= MAX_LINE && checked(text).is_some() => {
                Some((bytes + length, lines + 1))
            }
            interrupted => {
                survey.check_errors += u32::from(interrupted.is_some());
                is_echo(text).then_some((length, 0))
            }
        };
    }
    survey
}

/// Whether a line may be the echo of a command that asks for scans or for information.
fn is_echo(line: &[u8]) -> bool {
    match *line {
        [b'M' | b'G', b'D' | b'S', ref numbers @ ..] => {
            numbers.len() >= 10 && numbers.iter().all(u8::is_ascii_digit)
        }
        _ => matches!(line, b"VV" | b"PP" | b"II"),
    }
}
