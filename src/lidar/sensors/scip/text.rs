//! Lines of SCIP 2.0 and their check characters.

/// Longest line with its check character: of the fields of an answer.
pub(super) const MAX_LINE: usize = 80;

/// Check character of a line.
#[must_use]
pub fn check_character(text: &[u8]) -> u8 {
    (text.iter().fold(0u8, |sum, c| sum.wrapping_add(*c)) & 0x3f) + 0x30
}

/// A line without its check character, if that is right.
pub(super) fn checked(line: &[u8]) -> Option<&[u8]> {
    let (code, text) = line.split_last()?;
    (check_character(text) == *code).then_some(text)
}
