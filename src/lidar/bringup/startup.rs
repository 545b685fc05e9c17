//! From power-on to a stream of measurements, for sensors that have to be asked.
//!
//! A state machine without I/O. Call [`Startup::poll`] with the time until it says `Ready`, do what it says, and give
//! what comes in to [`Startup::push`]; from then on the bytes are the parser's, and [`Startup::packet_arrived`] keeps
//! the watch over the stream.
//!
//! ```text
//! introduction ─▶ motor ─▶ spin-up ─▶ scan ─▶ ready ─▶ stalled?
//!   query                             query                        RPLIDAR, YDLIDAR
//!   speed of the line                 one request                  SCIP, SICK
//!                                     one request, or nothing      all others
//! ```

mod action;
mod config;
mod line;
mod query;

use crate::lidar::model::{Model, Start};
use crate::lidar::sensors::rplidar::command::Info;
use crate::lidar::sensors::scip::command::Parameters;
use crate::lidar::wire::request::Request;
pub use action::{Action, Mode};
pub use config::{StartConfig, StartError};
use line::Line;
use query::Query;

/// How the sensor is spoken to.
#[derive(Debug, Clone)]
enum Talk {
    Listen,
    Send(&'static [u8]),
    Query(Query),
    Line(Line),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Introduction,
    Motor,
    MotorSpeed,
    SpinUp,
    Scan,
    Streaming,
    Failed(StartError),
}

/// Start-up of one sensor, a state machine that is polled. About 240 bytes.
///
/// ```
/// use beamfix::lidar::{Model, startup::{Action, StartConfig, Startup}};
///
/// let mut startup = Startup::new(&Model::HLS_LDS01, StartConfig::DEFAULT);
/// let (mut sent, mut motor, mut now_us) = (Vec::new(), false, 0);
/// loop {
///     match startup.poll(now_us) {
///         Action::Send(bytes) => sent.extend_from_slice(&bytes), // to the UART
///         Action::SetBaud(_) => {}                               // of the UART
///         Action::MotorOn => motor = true,                       // a pin, where the host drives the motor
///         Action::Wait => now_us += 10_000, // meanwhile each byte from the UART goes to `startup.push`
///         Action::Ready(_) => break,        // from here on to the parser
///         Action::Failed(error) => panic!("{error}"),
///     }
/// }
/// assert_eq!((&sent[..], motor), (&b"b"[..], true)); // an LDS-01 starts with the letter b
/// ```
#[derive(Debug, Clone)]
pub struct Startup {
    talk: Talk,
    config: StartConfig,
    phase: Phase,
    /// When the present phase began to wait; `None` before it has acted.
    since_us: Option<u32>,
}

impl Startup {
    /// At the beginning, for a sensor that is to end on a line of the model's speed.
    #[must_use]
    pub const fn new(model: &Model, config: StartConfig) -> Self {
        Self {
            talk: match model.start {
                Start::Listen => Talk::Listen,
                Start::Send(bytes) => Talk::Send(bytes),
                Start::Rplidar => Talk::Query(Query::rplidar(model.family)),
                Start::Ydlidar { .. } => Talk::Query(Query::ydlidar(model)),
                Start::Sick => Talk::Line(Line::sick(model.baud)),
                Start::Scip => Talk::Line(Line::scip(model.baud)),
            },
            config,
            phase: Phase::Introduction,
            since_us: None,
        }
    }

    /// Who answered, if someone did.
    #[must_use]
    pub fn info(&self) -> Option<Info> {
        match &self.talk {
            Talk::Query(query) => query.info(),
            _ => None,
        }
    }

    /// Angle (0.01°, `0..36000`) that looks forward by the unit's own calibration, if it keeps one and told: what
    /// [`Model::zero_cdeg`], which is part of it, should be for the unit's parser. YDLIDAR G1, G2, TG; by the maker's driver, in two
    /// versions; no unit was at hand.
    #[must_use]
    pub fn zero_cdeg(&self) -> Option<u16> {
        match &self.talk {
            Talk::Query(query) => query.zero(),
            _ => None,
        }
    }

    /// What a SCIP sensor measures, if it told: `Parameters::steps` are what its parser needs.
    #[must_use]
    pub fn parameters(&self) -> Option<Parameters> {
        match &self.talk {
            Talk::Line(line) => line.parameters(),
            _ => None,
        }
    }

    /// What is to be done now (µs, wrapping).
    pub fn poll(&mut self, now_us: u32) -> Action {
        let waited_ms = self.since_us.map(|since| now_us.wrapping_sub(since) / 1000);
        match (self.phase, waited_ms) {
            (Phase::Failed(error), _) => Action::Failed(error),
            (Phase::Introduction, _) => {
                let action = match &mut self.talk {
                    Talk::Query(query) => query.poll(now_us, &self.config),
                    Talk::Line(line) => line.poll(now_us, &self.config),
                    Talk::Listen | Talk::Send(_) => None,
                };
                self.act_or_go(action, Phase::Motor)
            }
            (Phase::Motor, _) => {
                self.go(Phase::MotorSpeed);
                Action::MotorOn
            }
            (Phase::MotorSpeed, _) => {
                self.go(Phase::SpinUp);
                self.since_us = Some(now_us);
                match &self.talk {
                    Talk::Query(query) => query.motor_request().map_or(Action::Wait, Action::Send),
                    _ => Action::Wait,
                }
            }
            (Phase::SpinUp, Some(waited)) if waited >= self.config.spin_up_ms => {
                if let Talk::Query(query) = &mut self.talk {
                    query.begin_scan();
                }
                self.go(Phase::Scan);
                self.poll_scan(now_us)
            }
            (Phase::Scan, _) => self.poll_scan(now_us),
            (Phase::Streaming, None) => {
                self.since_us = Some(now_us);
                Action::Ready(self.mode())
            }
            (Phase::Streaming, Some(silent_ms)) if silent_ms >= self.config.stall_ms => {
                self.fail(StartError::Stalled { silent_ms })
            }
            (Phase::Streaming, Some(_)) => Action::Ready(self.mode()),
            _ => Action::Wait,
        }
    }

    /// Takes a byte from the sensor.
    pub fn push(&mut self, byte: u8) {
        match (&mut self.talk, self.phase) {
            (Talk::Query(query), _) => query.push(byte),
            (Talk::Line(line), Phase::Introduction) => line.push(byte),
            _ => {}
        }
    }

    /// Says that the parser has found a packet; [`Startup::poll`] reports a stall where none comes.
    pub fn packet_arrived(&mut self, now_us: u32) {
        if self.phase == Phase::Streaming {
            self.since_us = Some(now_us);
        }
    }

    fn mode(&self) -> Mode {
        match &self.talk {
            Talk::Query(query) => query.mode(),
            _ => Mode {
                answer: 0,
                period_q8: None,
            },
        }
    }

    /// Sends what starts the measurements. Only a query is answered; of the others the packets are the answer.
    fn poll_scan(&mut self, now_us: u32) -> Action {
        let request = match &mut self.talk {
            Talk::Query(query) => {
                let action = query.poll(now_us, &self.config);
                return self.act_or_go(action, Phase::Streaming);
            }
            Talk::Line(line) => Some(line.measure()),
            Talk::Send(bytes) => Some(Request::of(&[*bytes])),
            Talk::Listen => None,
        };
        self.go(Phase::Streaming);
        request.map_or(Action::Wait, Action::Send)
    }

    /// What a conversation wants done; where it is over, the next phase begins.
    fn act_or_go(&mut self, action: Option<Action>, next: Phase) -> Action {
        match action {
            Some(Action::Failed(error)) => self.fail(error),
            Some(action) => action,
            None => {
                self.go(next);
                Action::Wait
            }
        }
    }

    fn go(&mut self, phase: Phase) {
        self.phase = phase;
        self.since_us = None;
    }

    fn fail(&mut self, error: StartError) -> Action {
        self.go(Phase::Failed(error));
        Action::Failed(error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lidar::sensors::rplidar::command::Health;

    /// Runs the machine against a sensor that answers a request with `reply`, in steps of 10 ms.
    fn run(
        startup: &mut Startup,
        seconds: u32,
        mut reply: impl FnMut(&[u8]) -> &'static [u8],
    ) -> (Action, bool) {
        let mut motor = false;
        for step in 0..seconds * 100 {
            match startup.poll(step * 10_000) {
                Action::Send(bytes) => {
                    for &byte in reply(&bytes) {
                        startup.push(byte);
                    }
                }
                Action::MotorOn => motor = true,
                Action::Wait | Action::SetBaud(_) => {}
                end => return (end, motor),
            }
        }
        (Action::Wait, motor)
    }

    const INFO_OLD: &[u8] = &[
        0xa5, 0x5a, 0x14, 0, 0, 0, 4, 0x18, 5, 1, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    const INFO_NEW: &[u8] = &[
        0xa5, 0x5a, 0x14, 0, 0, 0, 4, 0x18, 29, 1, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0,
    ];
    const GOOD: &[u8] = &[0xa5, 0x5a, 3, 0, 0, 0, 6, 0, 0, 0];
    const BAD: &[u8] = &[0xa5, 0x5a, 3, 0, 0, 0, 6, 2, 1, 0];

    #[test]
    fn an_old_rplidar_gets_the_standard_scan() {
        let mut startup = Startup::new(&Model::RPLIDAR_SCAN, StartConfig::DEFAULT);
        let end = run(&mut startup, 10, |request| match request {
            [0xa5, 0x50] => INFO_OLD,
            [0xa5, 0x52] => GOOD,
            [0xa5, 0x20] => &[0xa5, 0x5a, 5, 0, 0, 0x40, 0x81],
            _ => &[],
        });
        let mode = Mode {
            answer: 0x81,
            period_q8: None,
        };
        assert_eq!(end, (Action::Ready(mode), true));
        assert_eq!(startup.info().map(|info| info.firmware), Some((1, 5)));
    }

    #[test]
    fn a_new_rplidar_gets_the_mode_that_its_parser_reads() {
        // The mode that it recommends, another one, none.
        for (model, kind) in [
            (&Model::RPLIDAR_ULTRA, 0x84),
            (&Model::RPLIDAR_DENSE, 0x85),
            (&Model::RPLIDAR_ULTRADENSE, 0x86),
        ] {
            let mut startup = Startup::new(model, StartConfig::DEFAULT);
            let end = run(&mut startup, 20, |request| match request {
                [0xa5, 0x50] => INFO_NEW,
                [0xa5, 0x52] => GOOD,
                [0xa5, 0x84, 4, 0x7c, ..] => &[0xa5, 0x5a, 6, 0, 0, 0, 0x20, 0x7c, 0, 0, 0, 3, 0],
                [0xa5, 0x84, 6, 0x75, 0, 0, 0, 3, ..] => {
                    &[0xa5, 0x5a, 5, 0, 0, 0, 0x20, 0x75, 0, 0, 0, 0x84]
                }
                [0xa5, 0x84, 6, 0x75, 0, 0, 0, 2, ..] => {
                    &[0xa5, 0x5a, 5, 0, 0, 0, 0x20, 0x75, 0, 0, 0, 0x85]
                }
                [0xa5, 0x84, 6, 0x75, ..] => &[0xa5, 0x5a, 5, 0, 0, 0, 0x20, 0x75, 0, 0, 0, 0x81],
                [0xa5, 0x84, 6, 0x71, ..] => {
                    &[0xa5, 0x5a, 8, 0, 0, 0, 0x20, 0x71, 0, 0, 0, 0, 0x7f, 0, 0]
                }
                [0xa5, 0x82, 5, 3, ..] => &[0xa5, 0x5a, 0x84, 0, 0, 0x40, 0x84],
                [0xa5, 0x82, 5, 2, ..] => &[0xa5, 0x5a, 0x84, 0, 0, 0x40, 0x85],
                _ => &[],
            });
            let mode = Mode {
                answer: kind,
                period_q8: Some(127 << 8),
            };
            let wanted = match kind {
                0x86 => Action::Failed(StartError::NoAnswer { request: 0x84 }),
                _ => Action::Ready(mode),
            };
            assert_eq!(end, (wanted, true), "{}", model.name);
        }
    }

    #[test]
    fn a_new_rplidar_in_standard_scan_is_not_asked_for_modes() {
        let mut startup = Startup::new(&Model::RPLIDAR_SCAN, StartConfig::DEFAULT);
        let end = run(&mut startup, 10, |request| match request {
            [0xa5, 0x50] => INFO_NEW,
            [0xa5, 0x52] => GOOD,
            [0xa5, 0x20] => &[0xa5, 0x5a, 5, 0, 0, 0x40, 0x81],
            _ => &[],
        });
        let mode = Mode {
            answer: 0x81,
            period_q8: None,
        };
        assert_eq!(end, (Action::Ready(mode), true));
    }

    #[test]
    fn an_old_rplidar_knows_the_first_express_scan() {
        let mut startup = Startup::new(&Model::RPLIDAR_EXPRESS, StartConfig::DEFAULT);
        let end = run(&mut startup, 10, |request| match request {
            [0xa5, 0x50] => INFO_OLD,
            [0xa5, 0x52] => GOOD,
            [0xa5, 0x82, 5, 0, 0, 0, 0, 0, _] => &[0xa5, 0x5a, 0x54, 0, 0, 0x40, 0x82],
            _ => &[],
        });
        let mode = Mode {
            answer: 0x82,
            period_q8: None,
        };
        assert_eq!(end, (Action::Ready(mode), true));
    }

    #[test]
    fn silence_illness_and_a_stall_are_reported() {
        let mut silent = Startup::new(&Model::RPLIDAR_SCAN, StartConfig::DEFAULT);
        let (end, motor) = run(&mut silent, 10, |_| &[]);
        assert_eq!(end, Action::Failed(StartError::NoAnswer { request: 0x50 }));
        assert!(!motor);

        let mut resets = 0;
        let mut ill = Startup::new(&Model::RPLIDAR_SCAN, StartConfig::DEFAULT);
        let (end, _) = run(&mut ill, 20, |request| match request {
            [0xa5, 0x50] => INFO_OLD,
            [0xa5, 0x52] => BAD,
            [0xa5, 0x40] => {
                resets += 1;
                &[]
            }
            _ => &[],
        });
        let health = Health { status: 2, code: 1 };
        assert_eq!(end, Action::Failed(StartError::Unhealthy(health)));
        assert_eq!(resets, 1);

        let mut stalled = Startup::new(&Model::LDROBOT_LD06, StartConfig::DEFAULT);
        assert!(matches!(
            run(&mut stalled, 10, |_| &[]),
            (Action::Ready(_), true)
        ));
        stalled.packet_arrived(3_000_000);
        assert!(matches!(stalled.poll(7_000_000), Action::Ready(_)));
        let error = StartError::Stalled { silent_ms: 5000 };
        assert_eq!(stalled.poll(8_000_000), Action::Failed(error));
    }

    #[test]
    fn a_ydlidar_that_cannot_answer_is_listened_to() {
        let mut startup = Startup::new(&Model::YDLIDAR_X4, StartConfig::DEFAULT);
        assert!(matches!(
            run(&mut startup, 20, |_| &[]),
            (Action::Ready(_), true)
        ));
    }

    #[test]
    fn a_unit_that_keeps_its_zero_is_asked_for_it() {
        const AHEAD: &[u8] = &[0xa5, 0x5a, 4, 0, 0, 0, 4, 6, 0, 0, 0];
        const BEHIND: &[u8] = &[0xa5, 0x5a, 4, 0, 0, 0, 4, 0xa6, 0xff, 0xff, 0xff];
        const FAR: &[u8] = &[0xa5, 0x5a, 4, 0, 0, 0, 4, 0xd1, 2, 0, 0];
        let turned = Model {
            zero_cdeg: 18_000,
            ..Model::YDLIDAR_TG
        };
        for (model, zero, zero_cdeg) in [
            (&Model::YDLIDAR_TG, AHEAD, Some(35_850)),
            (&Model::YDLIDAR_TG, BEHIND, Some(2250)),
            (&turned, BEHIND, Some(20_250)),
            (&Model::YDLIDAR_TG, FAR, None),
            // One that does not answer starts all the same.
            (&Model::YDLIDAR_TG, &[], None),
        ] {
            let mut startup = Startup::new(model, StartConfig::DEFAULT);
            let (end, _) = run(&mut startup, 20, |request| match request {
                [0xa5, 0x90] => INFO_OLD,
                [0xa5, 0x91] => GOOD,
                [0xa5, 0x93] => zero,
                [0xa5, 0x60] => &[0xa5, 0x5a, 5, 0, 0, 0x40, 0x81],
                _ => &[],
            });
            assert!(matches!(end, Action::Ready(_)), "{end:?}");
            assert_eq!(startup.zero_cdeg(), zero_cdeg);
        }
    }

    #[test]
    fn sensors_with_one_command_get_it() {
        for (model, expected) in [
            (&Model::HLS_LDS01, &b"b"[..]),
            (&Model::LDROBOT_LD14P, &[0x54, 0xa0, 4, 0, 0, 0, 0, 0x5e]),
            (&Model::LDS006, b"startlds$"),
            (&Model::COIN_D4, &[0xaa, 0x55, 0xf0, 0x0f]),
        ] {
            let mut startup = Startup::new(model, StartConfig::DEFAULT);
            let mut sent = Request::new();
            let (end, _) = run(&mut startup, 10, |request| {
                sent = Request::of(&[request]);
                &[]
            });
            assert!(matches!(end, Action::Ready(_)));
            assert_eq!(&*sent, expected);
        }
    }
}
