//! Sensors that begin on a slow line and can be asked onto a faster one: SCIP at 19 200 baud, SICK at 9600.
//!
//! ```text
//! fast: ask ─▶ answer ─▶ done
//!        ╰─ silence ─▶ slow: wake ─▶ switch ─▶ fast again
//! ```
//!
//! The fast line comes first: after a restart of the robot alone, the sensor is still on it, and one behind USB does
//! not care.

use super::{Action, StartConfig, StartError, send};
use crate::lidar::framing::{Framer, Verdict};
use crate::lidar::scip::command::{self, Parameters, Part, Replies};
use crate::lidar::{Layout as _, sick};

/// Whose language is spoken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tongue {
    Scip,
    Sick,
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

/// Brings the line to its speed. 230 bytes.
#[derive(Debug, Clone)]
pub(super) struct Line {
    tongue: Tongue,
    fast_baud: u32,
    step: Step,
    since_us: u32,
    rounds: u8,
    answered: bool,
    replies: Replies,
    telegrams: Framer<16>,
    pub(super) parameters: Parameters,
}

impl Line {
    pub(super) const fn new(tongue: Tongue, fast_baud: u32) -> Self {
        Self {
            tongue,
            fast_baud,
            step: Step::Fast,
            since_us: 0,
            rounds: 0,
            answered: false,
            replies: Replies::new(),
            telegrams: Framer::new(),
            parameters: Parameters {
                nearest_mm: 0,
                farthest_mm: 0,
                per_revolution: 0,
                first: 0,
                last: 0,
                front: 0,
                rpm: 0,
            },
        }
    }

    /// What is to be done; `None` once the sensor has answered on the fast line.
    pub(super) fn poll(&mut self, now_us: u32, config: &StartConfig) -> Option<Action> {
        let waited_ms = now_us.wrapping_sub(self.since_us) / 1000;
        let (next, action) = match self.step {
            Step::Fast => (Step::Ask, Action::SetBaud(self.fast_baud)),
            Step::Ask => (Step::Answer, self.ask()),
            Step::Answer if self.answered => return None,
            Step::Answer if waited_ms >= config.answer_ms => {
                if self.rounds >= config.tries {
                    return Some(Action::Failed(StartError::NoAnswer {
                        request: self.request(),
                    }));
                }
                self.rounds += 1;
                (Step::Slow, Action::Wait)
            }
            Step::Slow => (Step::Wake, Action::SetBaud(self.slow_baud())),
            Step::Wake => (Step::Switch, self.wake()),
            Step::Switch if waited_ms >= config.drain_ms => (Step::Switched, self.switch()),
            // An answer that was missed does not matter: the fast line tells.
            Step::Switched if self.answered || waited_ms >= config.answer_ms => {
                (Step::Fast, Action::Wait)
            }
            _ => return Some(Action::Wait),
        };
        self.step = next;
        self.since_us = now_us;
        self.answered = false;
        self.replies.clear();
        self.telegrams = Framer::new();
        Some(action)
    }

    pub(super) fn push(&mut self, byte: u8) {
        match self.tongue {
            Tongue::Scip => match self.replies.push(byte) {
                Some(Part::Field { name, value }) => self.parameters.take(name, value),
                Some(Part::End {
                    command: [b'P', b'P'],
                }) => {
                    self.answered |= self.parameters.steps().is_some();
                }
                Some(Part::Status { command, .. }) => self.answered |= &command == b"SS",
                _ => {}
            },
            Tongue::Sick => {
                let telegram =
                    self.telegrams
                        .push(byte, |bytes| match sick::Telegrams::judge(bytes) {
                            // Measurements of a stream that still runs.
                            Verdict::Need(length) if length > 16 => Verdict::No,
                            verdict => verdict,
                        });
                let answer = telegram.and_then(|telegram| telegram.bytes.get(4).copied());
                self.answered |= answer == Some(sick::MODE_ANSWER);
            }
        }
    }

    fn slow_baud(&self) -> u32 {
        match self.tongue {
            Tongue::Scip => 19_200,
            Tongue::Sick => 9600,
        }
    }

    fn request(&self) -> u8 {
        match self.tongue {
            Tongue::Scip => b'P',
            Tongue::Sick => 0x20,
        }
    }

    /// Ends a stream that still runs, and asks who is there.
    fn ask(&self) -> Action {
        match self.tongue {
            Tongue::Scip => send(&[command::SCIP_2, command::STOP, command::PARAMETERS]),
            Tongue::Sick => telegram(&sick::STOP),
        }
    }

    fn wake(&self) -> Action {
        match self.tongue {
            Tongue::Scip => send(&[command::SCIP_2, command::STOP]),
            Tongue::Sick => telegram(&sick::STOP),
        }
    }

    fn switch(&self) -> Action {
        match (self.tongue, self.fast_baud) {
            (Tongue::Scip, baud) => send(&[&command::set_baud(baud)]),
            (Tongue::Sick, 0..=9600) => telegram(&sick::BAUD_9600),
            (Tongue::Sick, 9601..=38_400) => telegram(&sick::BAUD_38400),
            (Tongue::Sick, _) => telegram(&sick::BAUD_500K),
        }
    }
}

/// A telegram with this payload.
pub(super) fn telegram(payload: &[u8]) -> Action {
    let mut buffer = [0; 16];
    send(&[sick::encode(payload, &mut buffer).unwrap_or(&[])])
}

#[cfg(test)]
mod tests {
    use super::super::{Dialect, Startup};
    use super::*;

    /// What a sensor answers to a request, and the speed it goes to.
    type Reply = fn(&[u8]) -> (&'static [u8], Option<u32>);

    /// A sensor on a line: it hears only what is sent at its own speed.
    struct Sensor {
        baud: u32,
        reply: Reply,
    }

    /// Runs the start-up in steps of 10 ms; gives its end, the last request, and the speed of the sensor's line.
    fn run(dialect: Dialect, mut sensor: Sensor) -> (Action, heapless::Vec<u8, 24>, Startup, u32) {
        let mut startup = Startup::new(dialect, StartConfig::DEFAULT);
        let (mut baud, mut last) = (1200, heapless::Vec::new());
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
            let sensor = Sensor { baud, reply: urg };
            let (end, last, startup, now) = run(Dialect::Scip { baud: 750_000 }, sensor);
            assert!(matches!(end, Action::Ready(_)), "{baud}: {end:?}");
            assert_eq!((&last[..], now), (&b"MD0044072501000\n"[..], 750_000));
            let parameters = startup.parameters().expect("told");
            assert_eq!((parameters.farthest_mm, parameters.rpm), (5600, 600));
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
            let sensor = Sensor { baud, reply: lms };
            let (end, last, _, now) = run(Dialect::Sick { baud: 500_000 }, sensor);
            assert!(matches!(end, Action::Ready(_)), "{baud}: {end:?}");
            assert_eq!((&last[..6], now), (&[2, 0, 2, 0, 0x20, 0x24][..], 500_000));
        }
    }

    #[test]
    fn silence_on_both_lines_is_reported() {
        let sensor = Sensor {
            baud: 115_200,
            reply: urg,
        };
        let (end, ..) = run(Dialect::Scip { baud: 750_000 }, sensor);
        let error = StartError::NoAnswer { request: b'P' };
        assert_eq!(end, Action::Failed(error));
    }
}
