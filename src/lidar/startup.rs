//! From power-on to a stream of measurements, for sensors that have to be asked.
//!
//! A state machine without I/O. Call [`Startup::poll`] with the time until it says `Ready`, do what it says, and give
//! what comes in to [`Startup::push`]; from then on the bytes are the parser's, and [`Startup::packet_arrived`] keeps
//! the watch over the stream.
//!
//! ```text
//! stop ─▶ drain ─▶ info ─▶ health ─▶ motor ─▶ spin-up ─▶ best mode ─▶ scan ─▶ ready ─▶ stalled?
//! line's speed ─▶ motor ─▶ …                                                (SCIP, SICK)
//! ```

mod line;

use core::fmt;

use heapless::Vec;

use super::rplidar::command::{
    self, Answer, Answers, CONF_ANSWER, CONF_PERIOD, CONF_TYPICAL, EXPRESS_SCAN, GET_CONF,
    GET_HEALTH, GET_INFO, Health, Info, LONGEST_REQUEST, MOTOR_PWM, RESET, SCAN, STOP,
};
use super::scip::command::{Parameters, measure};
use super::{Family, Model, coin_d4, ld06, lds01, model::Motor, sick, ydlidar};
use line::{Line, Tongue};

/// Whose language the sensor speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Dialect {
    /// RPLIDAR.
    Rplidar,
    /// YDLIDAR that answer: X4, G, T-mini, TG.
    Ydlidar,
    /// LDS-01: one letter.
    Lds01,
    /// COIN-D4: four bytes.
    CoinD4,
    /// LD14P: eight bytes.
    Ld14p,
    /// SICK LMS2xx, to be brought to a line of so many bits/s: 9600 (as it starts), 38 400 or 500 000.
    Sick {
        /// Speed of the line (bits/s).
        baud: u32,
    },
    /// Hokuyo with SCIP 2.0, to be brought to a line of so many bits/s; it starts at 19 200.
    Scip {
        /// Speed of the line (bits/s).
        baud: u32,
    },
    /// Sends as soon as it revolutions: LD06, X2, XV-11, Delta, Camsense.
    Listen,
}

impl Dialect {
    /// What a model speaks, at the speed that its row names.
    #[must_use]
    pub const fn of(model: &Model) -> Self {
        let baud = model.baud;
        match (model.family, model.motor) {
            (
                Family::RplidarScan
                | Family::RplidarExpress
                | Family::RplidarDense
                | Family::RplidarUltra
                | Family::RplidarUltraDense
                | Family::RplidarHq,
                _,
            ) => Self::Rplidar,
            (Family::Ydlidar(_), _) => Self::Ydlidar,
            (Family::Lds01, _) => Self::Lds01,
            (Family::CoinD4, _) => Self::CoinD4,
            (Family::Ldrobot(_), Motor::Commands) => Self::Ld14p,
            (Family::Sick, _) => Self::Sick { baud },
            (Family::Scip(_), _) => Self::Scip { baud },
            _ => Self::Listen,
        }
    }
}

/// What to do next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// Send these bytes.
    Send(Vec<u8, 24>),
    /// Set the UART to so many bits a second, once all that was to be sent has left it.
    SetBaud(u32),
    /// Switch the motor on, where the host does that.
    MotorOn,
    /// Nothing; ask again soon.
    Wait,
    /// Measurements come, or will.
    Ready(Mode),
    /// It does not work.
    Failed(StartError),
}

/// How the sensor was started.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Mode {
    /// Type of the answers that stream in, by which the parser is chosen (`0x81` standard scan, `0x82` express, `0x84`
    /// ultra, `0x85` dense, `0x86` ultra-dense); 0 for sensors with one kind.
    pub answer: u8,
    /// Time from one measurement to the next (µs, Q8), where the sensor told.
    pub period_q8: Option<u32>,
}

/// Why a sensor does not start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StartError {
    /// A request stayed without an answer, however often it was sent.
    NoAnswer {
        /// The request's command.
        request: u8,
    },
    /// The sensor reports an error, even after a restart.
    Unhealthy(Health),
    /// No measurements for so long (ms): the motor stands, or the line is broken.
    Stalled {
        /// How long (ms).
        silent_ms: u32,
    },
}

impl fmt::Display for StartError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::NoAnswer { request } => write!(f, "no answer to request {request:#04x}"),
            Self::Unhealthy(health) => write!(
                f,
                "the sensor reports status {} and error code {:#06x}",
                health.status, health.code
            ),
            Self::Stalled { silent_ms } => write!(f, "no measurement for {silent_ms} ms"),
        }
    }
}

impl core::error::Error for StartError {}

/// How long to wait for what.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StartConfig {
    /// Silence after a stop command (ms). Default 100, as the makers do.
    pub drain_ms: u32,
    /// For an answer (ms). Default 500.
    pub answer_ms: u32,
    /// Times that a request is sent. Default 3.
    pub tries: u8,
    /// After a restart (ms). Default 2000.
    pub reset_ms: u32,
    /// For the motor (ms). Default 1000.
    pub spin_up_ms: u32,
    /// Longest silence of a stream (ms). Default 5000: some sensors send nothing before they spin steadily.
    pub stall_ms: u32,
}

impl StartConfig {
    /// The defaults above.
    pub const DEFAULT: Self = Self {
        drain_ms: 100,
        answer_ms: 500,
        tries: 3,
        reset_ms: 2000,
        spin_up_ms: 1000,
        stall_ms: 5000,
    };
}

impl Default for StartConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Duty of an A2's or A3's motor that the maker's software starts with, of 1023.
const MOTOR_PWM_USUAL: u16 = 660;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    /// The line is brought to its speed.
    Line,
    Stop,
    Drain,
    Info,
    Health,
    Reset,
    Motor,
    MotorSpeed,
    SpinUp,
    TypicalMode,
    AnswerType,
    Period,
    Scan,
    Streaming,
    Failed(StartError),
}

impl Step {
    /// Whether it sends a request and waits for its answer.
    const fn asks(self) -> bool {
        matches!(
            self,
            Self::Info
                | Self::Health
                | Self::TypicalMode
                | Self::AnswerType
                | Self::Period
                | Self::Scan
        )
    }
}

/// The state machine. About 400 bytes.
#[derive(Debug, Clone)]
pub struct Startup {
    dialect: Dialect,
    config: StartConfig,
    step: Step,
    answers: Answers,
    line: Line,
    info: Option<Info>,
    health: Option<Health>,
    /// When the present step began to wait; `None` before it has acted.
    since_us: Option<u32>,
    tries: u8,
    was_reset: bool,
    scan_mode: Option<u16>,
    mode: Mode,
}

impl Startup {
    /// At the beginning.
    #[must_use]
    pub const fn new(dialect: Dialect, config: StartConfig) -> Self {
        Self {
            dialect,
            config,
            step: match dialect {
                Dialect::Rplidar | Dialect::Ydlidar => Step::Stop,
                Dialect::Sick { .. } | Dialect::Scip { .. } => Step::Line,
                _ => Step::Motor,
            },
            answers: Answers::new(),
            line: match dialect {
                Dialect::Sick { baud } => Line::new(Tongue::Sick, baud),
                Dialect::Scip { baud } => Line::new(Tongue::Scip, baud),
                _ => Line::new(Tongue::Scip, 0),
            },
            info: None,
            health: None,
            since_us: None,
            tries: 0,
            was_reset: false,
            scan_mode: None,
            mode: Mode {
                answer: 0,
                period_q8: None,
            },
        }
    }

    /// Who answered, if someone did.
    #[must_use]
    pub fn info(&self) -> Option<Info> {
        self.info
    }

    /// What a SCIP sensor measures, if it told: [`Parameters::steps`] are what its parser needs.
    #[must_use]
    pub fn parameters(&self) -> Option<Parameters> {
        self.line.parameters.steps().map(|_| self.line.parameters)
    }

    /// What is to be done now (µs, wrapping).
    pub fn poll(&mut self, now_us: u32) -> Action {
        let waited_ms = self.since_us.map(|since| now_us.wrapping_sub(since) / 1000);
        match (self.step, waited_ms) {
            (Step::Failed(error), _) => Action::Failed(error),
            (Step::Line, _) => match self.line.poll(now_us, &self.config) {
                Some(Action::Failed(error)) => self.fail(error),
                Some(action) => action,
                None => {
                    self.go(Step::Motor);
                    Action::Wait
                }
            },
            (Step::Streaming, None) => {
                self.since_us = Some(now_us);
                Action::Ready(self.mode)
            }
            (Step::Streaming, Some(silent_ms)) if silent_ms >= self.config.stall_ms => {
                self.fail(StartError::Stalled { silent_ms })
            }
            (Step::Streaming, Some(_)) => Action::Ready(self.mode),
            (Step::Stop, _) => {
                self.go(Step::Drain);
                self.since_us = Some(now_us);
                match self.dialect {
                    // The first two bytes wake it up.
                    Dialect::Ydlidar => send(&[&[0xa5, 0x00, 0xa5, ydlidar::command::STOP]]),
                    _ => self.request(STOP, &[]),
                }
            }
            (Step::Drain, Some(waited)) if waited >= self.config.drain_ms => {
                self.answers.clear();
                self.go(Step::Info);
                self.poll_request(now_us)
            }
            (Step::Reset, None) => {
                self.since_us = Some(now_us);
                let reset = match self.dialect {
                    Dialect::Ydlidar => ydlidar::command::RESET,
                    _ => RESET,
                };
                self.request(reset, &[])
            }
            (Step::Reset, Some(waited)) if waited >= self.config.reset_ms => {
                self.go(Step::Stop);
                Action::Wait
            }
            (Step::Motor, _) => {
                self.go(Step::MotorSpeed);
                Action::MotorOn
            }
            (Step::MotorSpeed, _) => {
                self.go(Step::SpinUp);
                self.since_us = Some(now_us);
                // The A2's and A3's motor has a board of its own; C and S sensors start theirs with the scan.
                match self.info.filter(|_| self.dialect == Dialect::Rplidar) {
                    Some(info) if (0x20..0x40).contains(&info.model) => {
                        self.request(MOTOR_PWM, &MOTOR_PWM_USUAL.to_le_bytes())
                    }
                    _ => Action::Wait,
                }
            }
            (Step::SpinUp, Some(waited)) if waited >= self.config.spin_up_ms => {
                // GET_CONF came with firmware 1.24.
                let has_modes = self.dialect == Dialect::Rplidar
                    && self.info.is_some_and(|info| info.firmware >= (1, 24));
                self.go(if has_modes {
                    Step::TypicalMode
                } else {
                    Step::Scan
                });
                self.poll_request(now_us)
            }
            (step, None) if step.asks() => self.poll_request(now_us),
            (step, Some(waited)) if step.asks() && waited >= self.config.answer_ms => {
                if self.tries >= self.config.tries {
                    return self.give_up();
                }
                self.poll_request(now_us)
            }
            _ => Action::Wait,
        }
    }

    /// Takes a byte from the sensor.
    pub fn push(&mut self, byte: u8) {
        if self.step == Step::Line {
            self.line.push(byte);
        } else if let Some(answer) = self.answers.push(byte) {
            self.take(&answer);
        }
    }

    /// Says that the parser has found a packet; [`Startup::poll`] reports a stall where none comes.
    pub fn packet_arrived(&mut self, now_us: u32) {
        if self.step == Step::Streaming {
            self.since_us = Some(now_us);
        }
    }

    fn is_ydlidar(&self) -> bool {
        self.dialect == Dialect::Ydlidar
    }

    fn go(&mut self, step: Step) {
        self.step = step;
        self.since_us = None;
        self.tries = 0;
    }

    fn fail(&mut self, error: StartError) -> Action {
        self.go(Step::Failed(error));
        Action::Failed(error)
    }

    /// A request without an answer: some can be done without.
    fn give_up(&mut self) -> Action {
        match self.step {
            // A YDLIDAR with one wire cannot answer, and streams all the same.
            Step::Info | Step::Health if self.is_ydlidar() => {
                self.go(Step::Motor);
                Action::Wait
            }
            Step::Scan if self.is_ydlidar() && self.info.is_none() => {
                self.go(Step::Streaming);
                Action::Wait
            }
            Step::TypicalMode | Step::AnswerType | Step::Period => {
                self.scan_mode = None;
                self.go(Step::Scan);
                Action::Wait
            }
            _ => self.fail(StartError::NoAnswer {
                request: self.command(),
            }),
        }
    }

    fn command(&self) -> u8 {
        match (self.step, self.dialect) {
            (Step::Info, Dialect::Ydlidar) => ydlidar::command::GET_INFO,
            (Step::Info, _) => GET_INFO,
            // Manuals and the maker's SDK disagree on the command.
            (Step::Health, Dialect::Ydlidar) if self.tries & 1 == 1 => {
                ydlidar::command::GET_HEALTH_TOO
            }
            (Step::Health, Dialect::Ydlidar) => ydlidar::command::GET_HEALTH,
            (Step::Health, _) => GET_HEALTH,
            (Step::Scan, Dialect::Ydlidar) => ydlidar::command::SCAN,
            (Step::Scan, _) if self.scan_mode.is_some() => EXPRESS_SCAN,
            (Step::Scan, _) => SCAN,
            _ => GET_CONF,
        }
    }

    /// Sends the present step's request.
    fn poll_request(&mut self, now_us: u32) -> Action {
        self.since_us = Some(now_us);
        let command = self.command();
        self.tries = self.tries.saturating_add(1);
        let mode = self.scan_mode.unwrap_or(0);
        let [m0, m1] = mode.to_le_bytes();
        let entry = |entry: u32| {
            let [e0, e1, e2, e3] = entry.to_le_bytes();
            [e0, e1, e2, e3, m0, m1]
        };
        match self.step {
            Step::TypicalMode => self.request(command, &CONF_TYPICAL.to_le_bytes()),
            Step::AnswerType => self.request(command, &entry(CONF_ANSWER)),
            Step::Period => self.request(command, &entry(CONF_PERIOD)),
            Step::Scan => self.start_scan(command, m0),
            _ => self.request(command, &[]),
        }
    }

    fn start_scan(&mut self, command: u8, mode: u8) -> Action {
        let start = match self.dialect {
            Dialect::Rplidar if command == EXPRESS_SCAN => {
                return self.request(command, &[mode, 0, 0, 0, 0]);
            }
            Dialect::Rplidar | Dialect::Ydlidar => return self.request(command, &[]),
            Dialect::Lds01 => send(&[&[lds01::START]]),
            Dialect::CoinD4 => send(&[&coin_d4::START]),
            Dialect::Ld14p => send(&[&ld06::START]),
            Dialect::Sick { .. } => line::telegram(&sick::START),
            Dialect::Scip { .. } => {
                let Parameters { first, last, .. } = self.line.parameters;
                send(&[&measure(first, last)])
            }
            Dialect::Listen => Action::Wait,
        };
        // Nobody announces these streams: their packets are the answer.
        self.go(Step::Streaming);
        start
    }

    fn request(&mut self, command: u8, payload: &[u8]) -> Action {
        let bytes: Option<Vec<u8, LONGEST_REQUEST>> = command::request(command, payload);
        send(&[&bytes.unwrap_or_default()])
    }

    fn take(&mut self, answer: &Answer) {
        match self.step {
            Step::Info => {
                if let Some(info) = Info::from_answer(answer) {
                    self.info = Some(info);
                    self.go(Step::Health);
                }
            }
            Step::Health => {
                let Some(health) = Health::from_answer(answer) else {
                    return;
                };
                self.health = Some(health);
                if health.status < 2 {
                    self.go(Step::Motor);
                } else if self.was_reset {
                    self.go(Step::Failed(StartError::Unhealthy(health)));
                } else {
                    self.was_reset = true;
                    self.go(Step::Reset);
                }
            }
            Step::TypicalMode | Step::AnswerType | Step::Period => {
                let Some((entry, value)) = command::conf(answer) else {
                    return;
                };
                match (self.step, entry) {
                    (Step::TypicalMode, CONF_TYPICAL) => {
                        self.scan_mode = Some(value as u16);
                        self.go(Step::AnswerType);
                    }
                    (Step::AnswerType, CONF_ANSWER) => {
                        // Mode with an answer of its own, or the standard scan.
                        if value as u8 == 0x81 {
                            self.scan_mode = None;
                        }
                        self.mode.answer = value as u8;
                        self.go(Step::Period);
                    }
                    (Step::Period, CONF_PERIOD) => {
                        self.mode.period_q8 = Some(value);
                        self.go(Step::Scan);
                    }
                    _ => {}
                }
            }
            Step::Scan if answer.streams => {
                self.mode.answer = answer.kind;
                self.go(Step::Streaming);
            }
            _ => {}
        }
    }
}

/// Sends these one after the other.
fn send(pieces: &[&[u8]]) -> Action {
    let mut bytes = Vec::new();
    for piece in pieces {
        // Every request that is encoded here has room.
        let _ = bytes.extend_from_slice(piece);
    }
    Action::Send(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let mut startup = Startup::new(Dialect::Rplidar, StartConfig::DEFAULT);
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
    fn a_new_rplidar_gets_its_best_mode() {
        let mut startup = Startup::new(Dialect::Rplidar, StartConfig::DEFAULT);
        let end = run(&mut startup, 10, |request| match request {
            [0xa5, 0x50] => INFO_NEW,
            [0xa5, 0x52] => GOOD,
            [0xa5, 0x84, 4, 0x7c, ..] => &[0xa5, 0x5a, 6, 0, 0, 0, 0x20, 0x7c, 0, 0, 0, 3, 0],
            [0xa5, 0x84, 6, 0x75, 0, 0, 0, 3, ..] => {
                &[0xa5, 0x5a, 5, 0, 0, 0, 0x20, 0x75, 0, 0, 0, 0x84]
            }
            [0xa5, 0x84, 6, 0x71, 0, 0, 0, 3, ..] => {
                &[0xa5, 0x5a, 8, 0, 0, 0, 0x20, 0x71, 0, 0, 0, 0, 0x7f, 0, 0]
            }
            [0xa5, 0x82, 5, 3, 0, 0, 0, 0, _] => &[0xa5, 0x5a, 0x84, 0, 0, 0x40, 0x84],
            _ => &[],
        });
        let mode = Mode {
            answer: 0x84,
            period_q8: Some(127 << 8),
        };
        assert_eq!(end, (Action::Ready(mode), true));
    }

    #[test]
    fn silence_illness_and_a_stall_are_reported() {
        let mut silent = Startup::new(Dialect::Rplidar, StartConfig::DEFAULT);
        let (end, motor) = run(&mut silent, 10, |_| &[]);
        assert_eq!(end, Action::Failed(StartError::NoAnswer { request: 0x50 }));
        assert!(!motor);

        let mut resets = 0;
        let mut ill = Startup::new(Dialect::Rplidar, StartConfig::DEFAULT);
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

        let mut stalled = Startup::new(Dialect::Listen, StartConfig::DEFAULT);
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
        let mut startup = Startup::new(Dialect::Ydlidar, StartConfig::DEFAULT);
        assert!(matches!(
            run(&mut startup, 20, |_| &[]),
            (Action::Ready(_), true)
        ));
    }

    #[test]
    fn sensors_with_one_command_get_it() {
        for (dialect, expected) in [
            (Dialect::Lds01, &b"b"[..]),
            (Dialect::Ld14p, &[0x54, 0xa0, 4, 0, 0, 0, 0, 0x5e]),
            (Dialect::CoinD4, &[0xaa, 0x55, 0xf0, 0x0f]),
        ] {
            let mut startup = Startup::new(dialect, StartConfig::DEFAULT);
            let mut sent = Vec::<u8, 24>::new();
            let (end, _) = run(&mut startup, 10, |request| {
                sent = Vec::from_slice(request).expect("room");
                &[]
            });
            assert!(matches!(end, Action::Ready(_)));
            assert_eq!(sent, expected);
        }
    }
}
