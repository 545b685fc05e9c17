//! Hokuyo SCIP 2.0: text lines, each with a check character.
//!
//! Source: URG series communication protocol specification SCIP 2.0.
//!
//! ```text
//! MD0044072501000   the command's echo: first step, last step, cluster, skip, scans left
//! 99b               status and its check character
//! 0Xn>j             time (ms, 24 bits) and its check character
//! 1Dh1Dh…P          up to 64 characters of values and a check character; values straddle lines
//!                   an empty line
//! ```
//!
//! A character less `0x30` is six bits. MD and GD give three characters a value, MS and GS two. A check character is
//! the low six bits of the line's sum plus `0x30`. A scan with a damaged line is refused as a whole.

pub mod command;
mod survey;
mod text;

use heapless::Vec;

use crate::lidar::model::{Family, Model, Motor, Proof, Start, Steps};
use crate::lidar::wire::angle::divided;
use crate::lidar::wire::packet::{self, Reading, View};
use crate::lidar::wire::survey::Survey;
use crate::lidar::wire::{counters::Counters, protocol::Protocol};
use crate::scan::NoReturn;
use command::{Parameters, field};
pub use text::check_character;
use text::{MAX_LINE, checked};

impl Model {
    /// Hokuyo URG-04LX: 19 200 baud after power-on; a slower line than this does not carry every scan.
    pub const HOKUYO_URG04LX: Self = Self {
        name: "scip",
        family: Family::Scip(Steps::URG04LX),
        baud: 750_000,
        points_per_s: 10_240,
        revolutions_per_10s: 100,
        beams_per_revolution: 726,
        zero_cdeg: 0,
        counter_clockwise: true,
        min_range_mm: 20,
        max_range_mm: 5600,
        motor: Motor::Own,
        start: Start::Scip,
        proof: Proof::RealBytes,
    };
    /// Hokuyo UTM-30LX: over USB, where the speed of the line only has to be enough for 40 scans a second.
    pub const HOKUYO_UTM30LX: Self = Self {
        name: "utm-30lx",
        baud: 2_000_000,
        family: Family::Scip(Steps::UTM30LX),
        points_per_s: 57_600,
        revolutions_per_10s: 400,
        beams_per_revolution: 1081,
        min_range_mm: 100,
        max_range_mm: 60_000,
        proof: Proof::Document,
        ..Self::HOKUYO_URG04LX
    };
    /// Hokuyo UST-10LX, UST-20LX: over Ethernet, with the same commands.
    pub const HOKUYO_UST10LX: Self = Self {
        name: "ust-10lx",
        min_range_mm: 60,
        max_range_mm: 20_000,
        ..Self::HOKUYO_UTM30LX
    };
}

/// Most values of a scan: those of a sensor with 270° in steps of 0.25°.
pub const MAX_VALUES: usize = 1081;
/// Values below are error codes (mm).
const NEAREST: u16 = 20;

/// Line parser of scans. About 2300 bytes; a packet has as many.
#[derive(Debug, Clone)]
pub struct Parser {
    steps: Steps,
    /// What the unit itself said of its steps.
    told: Parameters,
    base: View,
    line: Vec<u8, MAX_LINE>,
    state: State,
    scan: Header,
    values: Vec<u16, MAX_VALUES>,
    /// Characters of a value that goes on in the next line.
    carry: u32,
    carried: u8,
    stamp_ms: Option<u32>,
    time_us: u32,
    /// Bytes of the reply so far.
    bytes: u32,
    counters: Counters,
}

/// Which line of a reply comes next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Echo,
    Status,
    Time,
    Data,
    /// Another command's reply, up to an empty line.
    Answer,
    /// A damaged reply, up to an empty line.
    Damaged,
}

/// What a command asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Header {
    first: u16,
    last: u16,
    cluster: u16,
    /// Characters of a value.
    width: u8,
    /// MD and MS: one reply to the command, then one for each scan.
    streams: bool,
}

impl Header {
    const NONE: Self = Self {
        first: 0,
        last: 0,
        cluster: 1,
        width: 3,
        streams: false,
    };

    fn values(self) -> usize {
        let steps = usize::from(self.last.saturating_sub(self.first));
        steps / usize::from(self.cluster.max(1)) + 1
    }
}

impl Parser {
    /// Any of the family.
    #[must_use]
    pub const fn for_model(model: &Model) -> Self {
        Self {
            steps: match model.family {
                Family::Scip(steps) => steps,
                _ => Steps::URG04LX,
            },
            told: Parameters::NONE,
            base: View::of(model, 0),
            line: Vec::new(),
            state: State::Echo,
            scan: Header::NONE,
            values: Vec::new(),
            carry: 0,
            carried: 0,
            stamp_ms: None,
            time_us: 0,
            bytes: 0,
            counters: Counters::ZERO,
        }
    }

    fn end_of_line(&mut self) -> Option<Packet> {
        let line = core::mem::take(&mut self.line);
        if line.is_empty() {
            return self.end_of_reply();
        }
        let next = match self.state {
            State::Echo => self.echo(&line),
            State::Status => match (self.scan.streams, checked(&line)) {
                (true, Some(b"99")) | (false, Some(b"00")) => Some(State::Time),
                (_, Some(_)) => Some(State::Answer),
                _ => None,
            },
            State::Time => self.time(&line).map(|()| State::Data),
            State::Data => self.data(&line).map(|()| State::Data),
            State::Answer => {
                if let Some((name, value)) = field(&line) {
                    self.take_parameter(name, value);
                }
                Some(State::Answer)
            }
            State::Damaged => match self.echo(&line) {
                // The empty line may have been lost, too.
                Some(State::Status) => Some(State::Status),
                _ => Some(State::Damaged),
            },
        };
        self.state = match next {
            Some(State::Status) => {
                let own = line.len() as u32 + 1;
                self.skip(self.bytes.saturating_sub(own));
                self.bytes = own;
                State::Status
            }
            Some(next) => next,
            None => {
                self.counters.check_errors = self.counters.check_errors.wrapping_add(1);
                State::Damaged
            }
        };
        None
    }

    fn echo(&mut self, line: &[u8]) -> Option<State> {
        let (streams, width) = match line {
            [b'M', b'D', ..] => (true, 3),
            [b'M', b'S', ..] => (true, 2),
            [b'G', b'D', ..] => (false, 3),
            [b'G', b'S', ..] => (false, 2),
            _ if line.iter().all(|c| (0x20..0x7f).contains(c)) => return Some(State::Answer),
            _ => return Some(State::Damaged),
        };
        let number = |range: core::ops::Range<usize>| {
            line.get(range)?.iter().try_fold(0u16, |number, c| {
                let digit = c.checked_sub(b'0').filter(|digit| *digit < 10)?;
                Some(number * 10 + u16::from(digit))
            })
        };
        let (Some(first), Some(last), Some(cluster)) =
            (number(2..6), number(6..10), number(10..12))
        else {
            return Some(State::Damaged);
        };
        if !self.suits(last) {
            return Some(State::Damaged);
        }
        self.scan = Header {
            first,
            last,
            cluster,
            width,
            streams,
        };
        Some(State::Status)
    }

    /// How the unit counts its steps: by its own words, by what it was asked for, or by its model.
    #[must_use]
    pub fn steps(&self) -> Steps {
        self.steps
    }

    /// Time from one step to the next (µs/256).
    fn period_q8(&self) -> u32 {
        match self.steps.period_q8() {
            0 => self.base.period_q8,
            period => period,
        }
    }

    /// Takes a field of an answer; the geometry is the unit's own once it has told all of it.
    fn take_parameter(&mut self, name: &[u8], value: &[u8]) {
        self.told.take(name, value);
        if let Some(steps) = self.told.steps() {
            self.steps = steps;
        }
    }

    /// Whether a scan up to step `last` can be this unit's: a scan that the model cannot send is another model's, and one
    /// that no model can send is refused rather than laid out by guess.
    fn suits(&mut self, last: u16) -> bool {
        if last > self.steps.last && self.told.steps().is_none() && last <= Steps::UTM30LX.last {
            self.steps = Steps::UTM30LX;
        }
        last <= self.steps.last
    }

    fn time(&mut self, line: &[u8]) -> Option<()> {
        let &[a, b, c, d] = checked(line)? else {
            return None;
        };
        let stamp_ms = [a, b, c, d]
            .iter()
            .fold(0, |stamp, c| stamp << 6 | six_bits(*c));
        let elapsed_ms = match self.stamp_ms.replace(stamp_ms) {
            Some(previous) => stamp_ms.wrapping_sub(previous) & 0x00ff_ffff,
            None => stamp_ms,
        };
        self.time_us = self.time_us.wrapping_add(elapsed_ms.wrapping_mul(1000));
        self.values.clear();
        (self.carry, self.carried) = (0, 0);
        Some(())
    }

    fn data(&mut self, line: &[u8]) -> Option<()> {
        for c in checked(line)? {
            self.carry = self.carry << 6 | six_bits(*c);
            self.carried += 1;
            if self.carried == self.scan.width {
                self.values.push(self.carry.min(0xffff) as u16).ok()?;
                (self.carry, self.carried) = (0, 0);
            }
        }
        Some(())
    }

    fn end_of_reply(&mut self) -> Option<Packet> {
        let state = core::mem::replace(&mut self.state, State::Echo);
        let bytes = core::mem::take(&mut self.bytes);
        let whole = self.values.len() == self.scan.values() && self.carried == 0;
        match state {
            State::Data if whole => {}
            State::Answer => {
                self.counters.answers = self.counters.answers.wrapping_add(1);
                return None;
            }
            State::Damaged => {
                self.skip(bytes);
                return None;
            }
            _ => {
                if bytes > 1 {
                    self.counters.check_errors = self.counters.check_errors.wrapping_add(1);
                    self.skip(bytes);
                }
                return None;
            }
        }
        self.counters.packets = self.counters.packets.wrapping_add(1);
        self.counters.revolutions = self.counters.revolutions.wrapping_add(1);
        let per_revolution = u32::from(self.steps.per_revolution);
        let one = divided(u32::MAX, per_revolution);
        let cluster = u32::from(self.scan.cluster.max(1));
        let first = i32::from(self.scan.first) - i32::from(self.steps.front);
        Some(Packet {
            view: View {
                first_us: self.time_us,
                period_q8: self.period_q8().saturating_mul(cluster),
                revolution_start: Some(0),
                ..self.base
            },
            first: one.wrapping_mul(first as u32),
            step: one.wrapping_mul(cluster),
            values: core::mem::take(&mut self.values),
        })
    }

    fn skip(&mut self, bytes: u32) {
        self.counters.skipped_bytes = self.counters.skipped_bytes.wrapping_add(bytes);
    }
}

fn six_bits(character: u8) -> u32 {
    u32::from(character.wrapping_sub(0x30) & 0x3f)
}

impl Protocol for Parser {
    type Packet = Packet;

    fn push(&mut self, byte: u8) -> Option<Packet> {
        self.bytes = self.bytes.wrapping_add(1);
        match byte {
            b'\n' => self.end_of_line(),
            b'\r' => None,
            _ => {
                if self.line.push(byte).is_err() {
                    // No line is as long: bytes of something else.
                    self.line.clear();
                    self.state = State::Damaged;
                }
                None
            }
        }
    }

    fn pull(&mut self) -> Option<Packet> {
        None
    }

    /// The sensor has a clock of its own.
    fn arrived(&mut self, _: u32) {}

    fn pending_bytes(&self) -> usize {
        self.bytes as usize
    }

    fn counters(&self) -> Counters {
        self.counters
    }

    fn survey(&self, bytes: &[u8]) -> Survey {
        survey::count(bytes)
    }
}

/// One scan. 2200 bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Packet {
    view: View,
    first: u32,
    step: u32,
    values: Vec<u16, MAX_VALUES>,
}

impl packet::Packet for Packet {
    fn view(&self) -> &View {
        &self.view
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        let mut angle = self.first;
        self.values.iter().map(move |&mm| {
            let reading = Reading {
                angle,
                range: if mm < NEAREST {
                    Err(NoReturn::Sensor(mm as u8))
                } else {
                    Ok(u32::from(mm) << 2)
                },
                quality: 0,
            };
            angle = angle.wrapping_add(self.step);
            reading
        })
    }
}
