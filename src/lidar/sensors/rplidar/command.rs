//! Requests of RPLIDAR and YDLIDAR sensors, and their answers.
//!
//! Source: RPLIDAR interface protocol and communication protocol; YDLIDAR development manuals. A request is `A5` and a
//! command, with a payload also its length and the XOR of all before. An answer is `A5 5A`, a `u32` (30 bits length, 2
//! bits mode: 1 for a stream), a type, and the payload.

use heapless::Vec;

use crate::lidar::wire::request::{MAX_BYTES, Request};

/// Ends the scan.
pub const STOP: u8 = 0x25;
/// Restarts the sensor; for 2 s nothing else is understood.
pub const RESET: u8 = 0x40;
/// Starts the standard scan.
pub const SCAN: u8 = 0x20;
/// Starts the standard scan, whatever the motor does.
pub const FORCE_SCAN: u8 = 0x21;
/// Starts an express scan: payload mode, two `u16` 0.
pub const EXPRESS_SCAN: u8 = 0x82;
/// Asks for model, firmware, serial number.
pub const GET_INFO: u8 = 0x50;
/// Asks for the health.
pub const GET_HEALTH: u8 = 0x52;
/// Asks for the sample periods.
pub const GET_SAMPLERATE: u8 = 0x59;
/// Asks for an entry of the configuration: payload `u32` type, `u16` mode.
pub const GET_CONF: u8 = 0x84;
/// Sets the motor's speed on C and S sensors: payload `u16` rpm, 0 to stop.
pub const MOTOR_SPEED: u8 = 0xa8;
/// Sets the motor's duty on A2 and A3: payload `u16` 0…1023.
pub const MOTOR_PWM: u8 = 0xf0;

/// Sample period of a mode (µs, Q8).
pub const CONF_PERIOD: u32 = 0x71;
/// Answer type of a mode.
pub const CONF_ANSWER: u32 = 0x75;
/// The mode that the maker recommends.
pub const CONF_TYPICAL: u32 = 0x7c;

/// Duty (of 1023) of an A2's or A3's motor that the maker's software starts with.
pub(crate) const MOTOR_PWM_USUAL: u16 = 660;

/// Longest payload of an answer that is kept.
pub const MAX_ANSWER: usize = 32;

/// Encodes a request; `None` for a payload that leaves no room for command, length and check code.
#[must_use]
pub fn request(command: u8, payload: &[u8]) -> Option<Request> {
    if payload.len() + 4 > MAX_BYTES {
        return None;
    }
    if payload.is_empty() {
        return Some(Request::of(&[&[0xa5, command]]));
    }
    let mut request = Request::of(&[&[0xa5, command, payload.len() as u8], payload]);
    let code = request.iter().fold(0, |code, byte| code ^ byte);
    request.push(code);
    Some(request)
}

/// An answer to a request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    /// What it is.
    pub kind: u8,
    /// A stream of such answers follows; the payload is empty.
    pub streams: bool,
    payload: Vec<u8, MAX_ANSWER>,
}

impl Answer {
    /// Its content.
    #[must_use]
    pub fn payload(&self) -> &[u8] {
        &self.payload
    }
}

/// Finds answers among other bytes. About 60 bytes.
#[derive(Debug, Clone, Default)]
pub struct Answers {
    bytes: Vec<u8, { 7 + MAX_ANSWER }>,
}

impl Answers {
    /// Nothing received.
    #[must_use]
    pub const fn new() -> Self {
        Self { bytes: Vec::new() }
    }

    /// Forgets what has come.
    pub fn clear(&mut self) {
        self.bytes.clear();
    }

    /// Takes the next byte; gives the answer that it completes.
    pub fn push(&mut self, byte: u8) -> Option<Answer> {
        if self.bytes.push(byte).is_err() {
            self.bytes.clear();
        }
        loop {
            match *self.bytes {
                [] | [0xa5] => return None,
                [0xa5, 0x5a, l0, l1, l2, l3, kind, ref payload @ ..] => {
                    let length = u32::from_le_bytes([l0, l1, l2, l3 & 0x3f]) as usize;
                    let streams = l3 >> 6 == 1;
                    let wanted = if streams { 0 } else { length };
                    if wanted <= MAX_ANSWER {
                        if payload.len() < wanted {
                            return None;
                        }
                        let answer = Answer {
                            kind,
                            streams,
                            payload: Vec::from_slice(payload).ok()?,
                        };
                        self.bytes.clear();
                        return Some(answer);
                    }
                }
                [0xa5, 0x5a, ..] => return None,
                _ => {}
            }
            // Not an answer: the next byte may begin one.
            self.bytes.remove_first();
        }
    }
}

/// Removing the first element.
trait RemoveFirst {
    fn remove_first(&mut self);
}

impl<const N: usize> RemoveFirst for Vec<u8, N> {
    fn remove_first(&mut self) {
        let length = self.len();
        if length > 0 {
            self.rotate_left(1);
            self.truncate(length - 1);
        }
    }
}

/// Identity of a sensor, as it reports it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Info {
    /// The maker's number of the model.
    pub model: u8,
    /// Firmware, major and minor.
    pub firmware: (u8, u8),
    /// Hardware.
    pub hardware: u8,
    /// Serial number.
    pub serial: [u8; 16],
}

impl Info {
    /// From an answer of type 4: 20 bytes.
    #[must_use]
    pub fn from_answer(answer: &Answer) -> Option<Self> {
        let (&[model, minor, major, hardware], serial) = answer.payload.split_first_chunk::<4>()?;
        (answer.kind == 0x04).then_some(Self {
            model,
            firmware: (major, minor),
            hardware,
            serial: serial.try_into().ok()?,
        })
    }
}

/// Health of a sensor, as it reports it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Health {
    /// 0 good, 1 warning, 2 error.
    pub status: u8,
    /// The maker's error code.
    pub code: u16,
}

impl Health {
    /// From an answer of type 6: 3 bytes.
    #[must_use]
    pub fn from_answer(answer: &Answer) -> Option<Self> {
        match (answer.kind, &answer.payload[..]) {
            (0x06, &[status, c0, c1]) => Some(Self {
                status,
                code: u16::from_le_bytes([c0, c1]),
            }),
            _ => None,
        }
    }
}

/// Times from one measurement to the next (µs) in standard and in express scan, from an answer of type `0x15`.
#[must_use]
pub fn sample_periods_us(answer: &Answer) -> Option<(u16, u16)> {
    match (answer.kind, &answer.payload[..]) {
        (0x15, &[s0, s1, e0, e1]) => {
            Some((u16::from_le_bytes([s0, s1]), u16::from_le_bytes([e0, e1])))
        }
        _ => None,
    }
}

/// An entry of the configuration: its type and its first 32 bits.
#[must_use]
pub fn conf(answer: &Answer) -> Option<(u32, u32)> {
    let (entry, value) = answer.payload.split_first_chunk::<4>()?;
    let mut bytes = [0; 4];
    bytes
        .iter_mut()
        .zip(value)
        .for_each(|(to, from)| *to = *from);
    (answer.kind == 0x20).then_some((u32::from_le_bytes(*entry), u32::from_le_bytes(bytes)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(bytes: &[u8]) -> Option<Answer> {
        let mut answers = Answers::new();
        bytes.iter().filter_map(|&byte| answers.push(byte)).last()
    }

    #[test]
    fn requests_as_documented() {
        let legacy = [0xa5, 0x82, 0x05, 0, 0, 0, 0, 0, 0x22];
        assert_eq!(request(EXPRESS_SCAN, &[0; 5]).as_deref(), Some(&legacy[..]));
        assert_eq!(request(STOP, &[]).as_deref(), Some(&[0xa5, 0x25][..]));
        let period = [0xa5, 0x84, 0x06, 0x71, 0, 0, 0, 3, 0, 0x55];
        assert_eq!(
            request(GET_CONF, &[0x71, 0, 0, 0, 3, 0]).as_deref(),
            Some(&period[..])
        );
        assert_eq!(request(GET_CONF, &[0; MAX_BYTES]), None);
    }

    #[test]
    fn answers_behind_the_rest_of_a_scan() {
        // An A1M8 with firmware 1.29.
        let period = [
            0xa5, 0xa5, 0x12, 0xa5, 0x5a, 0x08, 0, 0, 0, 0x20, 0x71, 0, 0, 0, 0, 0x7f, 0, 0,
        ];
        assert_eq!(
            answer(&period).and_then(|answer| conf(&answer)),
            Some((0x71, 127 << 8))
        );
        let health = [0x3e, 0xa5, 0x5a, 0x03, 0, 0, 0, 0x06, 2, 0x34, 0x12];
        let health = answer(&health).and_then(|answer| Health::from_answer(&answer));
        let expected = Health {
            status: 2,
            code: 0x1234,
        };
        assert_eq!(health, Some(expected));
        let rates = answer(&[0xa5, 0x5a, 4, 0, 0, 0, 0x15, 0xf4, 0x01, 0xfa, 0]);
        let periods = rates.and_then(|answer| sample_periods_us(&answer));
        assert_eq!(periods, Some((500, 250)));
        let scan = answer(&[0xa5, 0x5a, 0x05, 0, 0, 0x40, 0x81]).expect("answer");
        assert!(scan.streams && scan.kind == 0x81);
    }
}
