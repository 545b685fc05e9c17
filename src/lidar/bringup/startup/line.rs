//! Sensors that begin on a slow line and can be asked onto a faster one: SCIP at 19 200 baud, SICK at 9600.
//!
//! ```text
//! fast: ask ─▶ answer ─▶ done
//!        ╰─ silence ─▶ slow: wake ─▶ switch ─▶ fast again
//! ```
//!
//! The fast line comes first: after a restart of the robot alone, the sensor is still on it, and one behind USB does
//! not care.

use super::action::Action;
use super::config::{StartConfig, StartError};
use crate::lidar::sensors::scip::command::{self, Parameters, Part, Replies};
use crate::lidar::sensors::sick;
use crate::lidar::wire::framing::{Framer, Verdict};
use crate::lidar::wire::request::Request;

/// The sensor at the other end, with what has come of its answer.
#[derive(Debug, Clone)]
enum Sensor {
    Scip {
        replies: Replies,
        parameters: Parameters,
    },
    Sick {
        telegrams: Framer<16>,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Fast,
    Ask,
    Answer,
    Slow,
    Wake,
    Switch,
    Switched,
}

/// Brings the line to its speed. 150 bytes.
#[derive(Debug, Clone)]
pub(super) struct Line {
    sensor: Sensor,
    fast_baud: u32,
    step: Step,
    since_us: u32,
    rounds: u8,
    answered: bool,
}

impl Line {
    /// A SCIP sensor, to be brought to a line of so many bits/s.
    pub(super) const fn scip(fast_baud: u32) -> Self {
        Self::new(
            Sensor::Scip {
                replies: Replies::new(),
                parameters: Parameters::NONE,
            },
            fast_baud,
        )
    }

    /// A SICK sensor, to be brought to a line of so many bits/s: 9600, 38 400 or 500 000.
    pub(super) const fn sick(fast_baud: u32) -> Self {
        Self::new(
            Sensor::Sick {
                telegrams: Framer::new(),
            },
            fast_baud,
        )
    }

    const fn new(sensor: Sensor, fast_baud: u32) -> Self {
        Self {
            sensor,
            fast_baud,
            step: Step::Fast,
            since_us: 0,
            rounds: 0,
            answered: false,
        }
    }

    /// What a SCIP sensor measures, if it told.
    pub(super) fn parameters(&self) -> Option<Parameters> {
        match self.sensor {
            Sensor::Scip { parameters, .. } => parameters.steps().map(|_| parameters),
            Sensor::Sick { .. } => None,
        }
    }

    /// What is to be done; `None` once the sensor has answered on the fast line.
    pub(super) fn poll(&mut self, now_us: u32, config: &StartConfig) -> Option<Action> {
        let waited_ms = now_us.wrapping_sub(self.since_us) / 1000;
        let (next, action) = match self.step {
            Step::Fast => (Step::Ask, Action::SetBaud(self.fast_baud)),
            Step::Ask => (Step::Answer, Action::Send(self.sensor.ask())),
            Step::Answer if self.answered => return None,
            Step::Answer if waited_ms >= config.answer_ms => {
                if self.rounds >= config.tries {
                    return Some(Action::Failed(StartError::NoAnswer {
                        request: self.sensor.request(),
                    }));
                }
                self.rounds += 1;
                (Step::Slow, Action::Wait)
            }
            Step::Slow => (Step::Wake, Action::SetBaud(self.sensor.slow_baud())),
            Step::Wake => (Step::Switch, Action::Send(self.sensor.wake())),
            Step::Switch if waited_ms >= config.drain_ms => (
                Step::Switched,
                Action::Send(self.sensor.switch(self.fast_baud)),
            ),
            // An answer that was missed does not matter: the fast line tells.
            Step::Switched if self.answered || waited_ms >= config.answer_ms => {
                (Step::Fast, Action::Wait)
            }
            _ => return Some(Action::Wait),
        };
        self.step = next;
        self.since_us = now_us;
        self.answered = false;
        self.sensor.clear();
        Some(action)
    }

    /// Takes a byte from the sensor.
    pub(super) fn push(&mut self, byte: u8) {
        self.answered |= self.sensor.push(byte);
    }

    /// What starts the stream of measurements.
    pub(super) fn measure(&self) -> Request {
        match self.sensor {
            Sensor::Scip { parameters, .. } => command::measure(parameters.first, parameters.last),
            Sensor::Sick { .. } => sick::request(&sick::START),
        }
    }
}

impl Sensor {
    /// Takes a byte; says whether it ends the answer that was waited for.
    fn push(&mut self, byte: u8) -> bool {
        match self {
            Self::Scip {
                replies,
                parameters,
            } => match replies.push(byte) {
                Some(Part::Field { name, value }) => {
                    parameters.take(name, value);
                    false
                }
                Some(Part::End {
                    command: [b'P', b'P'],
                }) => parameters.steps().is_some(),
                Some(Part::Status { command, .. }) => &command == b"SS",
                _ => false,
            },
            Self::Sick { telegrams } => {
                let telegram = telegrams.push(byte, |bytes| match sick::judge(bytes) {
                    // Measurements of a stream that still runs.
                    Verdict::Need(length) if length > 16 => Verdict::No,
                    verdict => verdict,
                });
                let answer = telegram.and_then(|telegram| telegram.bytes.get(4).copied());
                answer == Some(sick::MODE_ANSWER)
            }
        }
    }

    /// Forgets what has come of an answer.
    fn clear(&mut self) {
        match self {
            Self::Scip { replies, .. } => replies.clear(),
            Self::Sick { telegrams } => *telegrams = Framer::new(),
        }
    }

    const fn slow_baud(&self) -> u32 {
        match self {
            Self::Scip { .. } => 19_200,
            Self::Sick { .. } => 9600,
        }
    }

    /// Command of the request that stayed without an answer.
    const fn request(&self) -> u8 {
        match self {
            Self::Scip { .. } => b'P',
            Self::Sick { .. } => 0x20,
        }
    }

    /// Ends a stream that still runs, and asks who is there.
    fn ask(&self) -> Request {
        match self {
            Self::Scip { .. } => {
                Request::of(&[command::SCIP_2, command::STOP, command::PARAMETERS])
            }
            Self::Sick { .. } => sick::request(&sick::STOP),
        }
    }

    fn wake(&self) -> Request {
        match self {
            Self::Scip { .. } => Request::of(&[command::SCIP_2, command::STOP]),
            Self::Sick { .. } => sick::request(&sick::STOP),
        }
    }

    fn switch(&self, baud: u32) -> Request {
        match (self, baud) {
            (Self::Scip { .. }, _) => command::set_baud(baud),
            (Self::Sick { .. }, 0..=9600) => sick::request(&sick::BAUD_9600),
            (Self::Sick { .. }, 9601..=38_400) => sick::request(&sick::BAUD_38400),
            (Self::Sick { .. }, _) => sick::request(&sick::BAUD_500K),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Startup;
    use super::*;
    use crate::lidar::model::Model;

    /// What a sensor answers to a request, and the speed it goes to.
    type Reply = fn(&[u8]) -> (&'static [u8], Option<u32>);

    /// A sensor on a line: it hears only what is sent at its own speed.
    struct OnLine {
        baud: u32,
        reply: Reply,
    }

    /// Runs the start-up in steps of 10 ms; gives its end, the last request, and the speed of the sensor's line.
    fn run(model: &Model, mut sensor: OnLine) -> (Action, Request, Startup, u32) {
        let mut startup = Startup::new(model, StartConfig::DEFAULT);
        let (mut baud, mut last) = (1200, Request::new());
        for step in 0..2000 {
            match startup.poll(step * 10_000) {
                Action::SetBaud(next) => baud = next,
                Action::Send(bytes) => {
                    if baud == sensor.baud {
                        let (reply, next) = (sensor.reply)(&bytes);
                        reply.iter().for_each(|&byte| startup.push(byte));
                        sensor.baud = next.unwrap_or(baud);
                    }
                    last = bytes;
                }
                Action::Wait | Action::MotorOn => {}
                end => return (end, last, startup, sensor.baud),
            }
        }
        panic!("no end");
    }

    const PARAMETERS: &[u8] =
        b"SCIP2.0\n0Et\n\nQT\n00P\n\nPP\n00P\nDMIN:20;4\nDMAX:5600;_\nARES:1024;\\\n\
        AMIN:44;7\nAMAX:725;o\nAFRT:384;6\nSCAN:600;e\n\n";

    fn urg(request: &[u8]) -> (&'static [u8], Option<u32>) {
        match request {
            b"SCIP2.0\nQT\nPP\n" => (PARAMETERS, None),
            b"SS750000\n" => (b"SS750000\n00P\n\n", Some(750_000)),
            _ => (b"", None),
        }
    }

    #[test]
    fn a_urg_is_brought_to_its_speed_and_asked_what_it_measures() {
        for baud in [19_200, 750_000] {
            let sensor = OnLine { baud, reply: urg };
            let (end, last, startup, now) = run(&Model::HOKUYO_URG04LX, sensor);
            assert!(matches!(end, Action::Ready(_)), "{baud}: {end:?}");
            assert_eq!((&last[..], now), (&b"MD0044072501000\n"[..], 750_000));
            let parameters = startup.parameters().expect("told");
            assert_eq!((parameters.max_range_mm, parameters.rpm), (5600, 600));
        }
    }

    #[test]
    fn an_lms_is_brought_to_its_speed() {
        fn lms(request: &[u8]) -> (&'static [u8], Option<u32>) {
            const DONE: &[u8] = &[0x06, 0x02, 0x80, 3, 0, 0xa0, 0, 0x10, 0x16, 0x0a];
            match request {
                [2, 0, 2, 0, 0x20, 0x25, ..] => (DONE, None),
                [2, 0, 2, 0, 0x20, 0x48, ..] => (DONE, Some(500_000)),
                _ => (&[], None),
            }
        }
        for baud in [9600, 500_000] {
            let sensor = OnLine { baud, reply: lms };
            let (end, last, _, now) = run(&Model::SICK_LMS200, sensor);
            assert!(matches!(end, Action::Ready(_)), "{baud}: {end:?}");
            assert_eq!((&last[..6], now), (&[2, 0, 2, 0, 0x20, 0x24][..], 500_000));
        }
    }

    #[test]
    fn silence_on_both_lines_is_reported() {
        let sensor = OnLine {
            baud: 115_200,
            reply: urg,
        };
        let (end, ..) = run(&Model::HOKUYO_URG04LX, sensor);
        let error = StartError::NoAnswer { request: b'P' };
        assert_eq!(end, Action::Failed(error));
    }
}
