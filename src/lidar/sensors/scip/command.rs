//! Requests to SCIP 2.0 sensors, and replies that are no scans: version, parameters, state, status.
//!
//! Source: as [`super`]. A reply is the request's echo, a line with a status of two characters, lines with
//! `NAME:value;` where something was asked for, each with a check character, and an empty line.

use heapless::Vec;

use super::text::{MAX_LINE, check_character};
use crate::lidar::model::Steps;
use crate::lidar::wire::request::Request;

/// Into SCIP 2.0, from the older protocol that some units start with.
pub const SCIP_2: &[u8] = b"SCIP2.0\n";
/// Asks for maker, product, firmware, protocol, serial number.
pub const VERSION: &[u8] = b"VV\n";
/// Asks for the parameters of the measurement.
pub const PARAMETERS: &[u8] = b"PP\n";
/// Asks for the state.
pub const STATE: &[u8] = b"II\n";
/// Switches the laser on.
pub const LASER_ON: &[u8] = b"BM\n";
/// Switches the laser off and ends measuring.
pub const STOP: &[u8] = b"QT\n";
/// Restarts the sensor.
pub const RESET: &[u8] = b"RS\n";

/// Sets the speed of the line (bits/s, six digits).
#[must_use]
pub fn set_baud(baud: u32) -> Request {
    let mut request = Request::of(&[b"SS"]);
    push_number(&mut request, baud, 6);
    request.push(b'\n');
    request
}

/// Starts an endless stream of scans from step `first` to `last`, three characters a value.
#[must_use]
pub fn measure(first: u16, last: u16) -> Request {
    let mut request = Request::of(&[b"MD"]);
    push_number(&mut request, first.into(), 4);
    push_number(&mut request, last.into(), 4);
    // Cluster 1, none skipped, without end.
    for byte in *b"01000\n" {
        request.push(byte);
    }
    request
}

fn push_number(request: &mut Request, number: u32, digits: u32) {
    for place in (0..digits).rev() {
        let digit = 10u32
            .checked_pow(place)
            .and_then(|unit| number.checked_div(unit));
        request.push(b'0' + (digit.unwrap_or(0) % 10) as u8);
    }
}

/// A part of a reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part<'a> {
    /// How a request was received: its first two characters, the status.
    Status {
        /// For example `PP`.
        command: [u8; 2],
        /// For example `00`.
        status: [u8; 2],
    },
    /// A line of what was asked for.
    Field {
        /// For example `ARES`.
        name: &'a [u8],
        /// For example `1024`.
        value: &'a [u8],
    },
    /// The empty line at the end of a reply to this request.
    End {
        /// For example `PP`.
        command: [u8; 2],
    },
    /// A line whose check character is wrong; the rest of the reply is skipped.
    Damaged,
}

/// Which line of a reply comes next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Echo,
    Status([u8; 2]),
    Fields([u8; 2]),
    /// A scan, or something damaged: up to an empty line.
    Skip,
}

/// Finds replies among other bytes. About 100 bytes.
#[derive(Debug, Clone)]
pub struct Replies {
    line: Vec<u8, MAX_LINE>,
    state: State,
    /// The line is complete and goes with the next byte.
    whole: bool,
}

impl Replies {
    /// Nothing received.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            line: Vec::new(),
            state: State::Echo,
            whole: false,
        }
    }

    /// Forgets what has come.
    pub fn clear(&mut self) {
        self.line.clear();
        self.state = State::Echo;
        self.whole = false;
    }

    /// Takes the next byte; gives the part that it completes.
    pub fn push(&mut self, byte: u8) -> Option<Part<'_>> {
        if self.whole {
            self.line.clear();
            self.whole = false;
        }
        match byte {
            b'\r' => None,
            b'\n' => {
                self.whole = true;
                self.end_of_line()
            }
            _ => {
                if self.line.push(byte).is_err() {
                    self.line.clear();
                    self.state = State::Skip;
                }
                None
            }
        }
    }

    fn end_of_line(&mut self) -> Option<Part<'_>> {
        if self.line.is_empty() {
            return match core::mem::replace(&mut self.state, State::Echo) {
                State::Fields(command) => Some(Part::End { command }),
                _ => None,
            };
        }
        let line = self.line.as_slice();
        match self.state {
            State::Echo => {
                self.state = match *line {
                    [a, b, ..] if line.iter().all(|c| (0x20..0x7f).contains(c)) => {
                        State::Status([a, b])
                    }
                    _ => State::Skip,
                };
                None
            }
            State::Status(command) => match *line {
                [s0, s1, code] if code == check_character(&[s0, s1]) => {
                    self.state = State::Fields(command);
                    let status = [s0, s1];
                    Some(Part::Status { command, status })
                }
                _ => {
                    self.state = State::Skip;
                    Some(Part::Damaged)
                }
            },
            State::Fields(command) => match field(line) {
                Some((name, value)) => Some(Part::Field { name, value }),
                // Values of a scan have no names; they are not given, and do not matter.
                None if !matches!(&command, b"VV" | b"PP" | b"II") => None,
                None => {
                    self.state = State::Skip;
                    Some(Part::Damaged)
                }
            },
            State::Skip => None,
        }
    }
}

/// Name and value of a line `NAME:value;` with the right check character.
pub(super) fn field(line: &[u8]) -> Option<(&[u8], &[u8])> {
    let (code, text) = line.split_last()?;
    let field = text.strip_suffix(b";")?;
    let colon = field.iter().position(|c| *c == b':')?;
    let (name, value) = field.split_at_checked(colon)?;
    (check_character(field) == *code).then_some((name, value.get(1..)?))
}

impl Default for Replies {
    fn default() -> Self {
        Self::new()
    }
}

/// What a sensor says of its measurements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Parameters {
    /// Nearest range (mm).
    pub min_range_mm: u16,
    /// Farthest range (mm).
    pub max_range_mm: u16,
    /// Steps of a revolution.
    pub per_revolution: u16,
    /// First step that is measured.
    pub first: u16,
    /// Last step that is measured.
    pub last: u16,
    /// Step that looks forward.
    pub front: u16,
    /// Speed of the motor (rpm).
    pub rpm: u16,
}

impl Parameters {
    /// Before anything was told.
    pub(crate) const NONE: Self = Self {
        min_range_mm: 0,
        max_range_mm: 0,
        per_revolution: 0,
        first: 0,
        last: 0,
        front: 0,
        rpm: 0,
    };

    /// Takes a field of a reply to [`PARAMETERS`]; other names and values that are no numbers change nothing.
    pub fn take(&mut self, name: &[u8], value: &[u8]) {
        let slot = match name {
            b"DMIN" => &mut self.min_range_mm,
            b"DMAX" => &mut self.max_range_mm,
            b"ARES" => &mut self.per_revolution,
            b"AMIN" => &mut self.first,
            b"AMAX" => &mut self.last,
            b"AFRT" => &mut self.front,
            b"SCAN" => &mut self.rpm,
            _ => return,
        };
        let number = value.iter().try_fold(0u32, |number, c| {
            let digit = c.checked_sub(b'0').filter(|digit| *digit < 10)?;
            Some(number.saturating_mul(10).saturating_add(digit.into()))
        });
        if let Some(number) = number.filter(|_| !value.is_empty()) {
            *slot = number.min(0xffff) as u16;
        }
    }

    /// How the model counts its steps, once everything needed has come.
    #[must_use]
    pub fn steps(&self) -> Option<Steps> {
        let holds =
            self.per_revolution > 0 && self.first < self.last && self.last <= self.per_revolution;
        holds.then_some(Steps {
            per_revolution: self.per_revolution,
            front: self.front,
            last: self.last,
            rpm: self.rpm,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The specification's example, with the check character of `ARES` that its text has.
    const REPLY: &[u8] =
        b"PP\n00P\nMODL:URG-04LX(Hokuyo Automatic Co., Ltd.);n\nDMIN:20;4\nDMAX:5600;_\n\
        ARES:1024;\\\nAMIN:44;7\nAMAX:725;o\nAFRT:384;6\nSCAN:600;e\n\n";

    fn parameters(bytes: &[u8]) -> (Parameters, u32, u32) {
        let (mut found, mut ends, mut damaged) = (Parameters::default(), 0, 0);
        let mut replies = Replies::new();
        for &byte in bytes {
            match replies.push(byte) {
                Some(Part::Field { name, value }) => found.take(name, value),
                Some(Part::Status { command, status }) => {
                    assert_eq!((&command, &status), (b"PP", b"00"));
                }
                Some(Part::End { command }) => {
                    assert_eq!(&command, b"PP");
                    ends += 1;
                }
                Some(Part::Damaged) => damaged += 1,
                None => {}
            }
        }
        (found, ends, damaged)
    }

    #[test]
    fn the_specifications_example() {
        let expected = Parameters {
            min_range_mm: 20,
            max_range_mm: 5600,
            per_revolution: 1024,
            first: 44,
            last: 725,
            front: 384,
            rpm: 600,
        };
        assert_eq!(parameters(REPLY), (expected, 1, 0));
        let steps = Steps {
            last: 725,
            ..Steps::URG04LX
        };
        assert_eq!(expected.steps(), Some(steps));
        // After the rest of a scan, and with other line ends.
        let mut after = Vec::<u8, 300>::from_slice(b"1Dh1DhP\n\n").expect("room");
        for &byte in REPLY {
            if byte == b'\n' {
                after.push(b'\r').expect("room");
            }
            after.push(byte).expect("room");
        }
        assert_eq!(parameters(&after), (expected, 1, 0));
    }

    #[test]
    fn a_damaged_line_is_noticed() {
        for at in 7..REPLY.len() {
            let mut bytes = Vec::<u8, 200>::from_slice(REPLY).expect("room");
            bytes[at] ^= 1;
            let (found, ends, damaged) = parameters(&bytes);
            assert!(ends == 0 && damaged <= 1, "{at}: {found:?}");
            let lost_its_end = at + 2 >= REPLY.len();
            assert!(damaged == 1 || lost_its_end, "{at}: {found:?}");
        }
    }

    #[test]
    fn requests_as_documented() {
        assert_eq!(&*set_baud(115_200), b"SS115200\n");
        assert_eq!(&*set_baud(19_200), b"SS019200\n");
        assert_eq!(&*measure(44, 725), b"MD0044072501000\n");
    }
}
