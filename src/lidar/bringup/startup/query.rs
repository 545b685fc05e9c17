//! The conversation with sensors that answer requests: RPLIDAR and YDLIDAR.
//!
//! ```text
//! stop ─▶ drain ─▶ info ─▶ health (─▶ reset ─▶ stop) ─▶ zero angle, where the unit keeps one ─▶ introduced
//! a mode ─▶ its answer type, until it is the parser's ─▶ its period ─▶ scan ─▶ streaming    (RPLIDAR since firmware 1.24)
//! ```

use super::action::{Action, Mode};
use super::config::{StartConfig, StartError};
use crate::lidar::model::{Family, Model, Start};
use crate::lidar::sensors::rplidar::command::{
    self as rplidar, Answer, Answers, CONF_ANSWER, CONF_PERIOD, CONF_TYPICAL, Health, Info,
};
use crate::lidar::sensors::ydlidar::command as ydlidar;
use crate::lidar::wire::request::Request;

/// A maker's commands, and what its sensors may leave out.
#[derive(Debug, PartialEq, Eq)]
struct Commands {
    /// Ends a scan; all its bytes.
    stop: &'static [u8],
    info: u8,
    /// Sent in turn where one stays without an answer.
    health: [u8; 2],
    reset: u8,
    scan: u8,
    /// Whether the sensor has scan modes that can be asked for.
    has_modes: bool,
    /// Whether a sensor may have one wire only: it cannot answer, and streams all the same.
    may_be_deaf: bool,
}

/// Answers in standard scan.
const STANDARD: u8 = 0x81;
/// Answers in the first express scan.
const EXPRESS: u8 = 0x82;
/// Modes that are looked at, at most: units have up to five.
const MODES: u16 = 8;

/// SLAMTEC's.
const RPLIDAR: Commands = Commands {
    stop: &[0xa5, rplidar::STOP],
    info: rplidar::GET_INFO,
    health: [rplidar::GET_HEALTH; 2],
    reset: rplidar::RESET,
    scan: rplidar::SCAN,
    has_modes: true,
    may_be_deaf: false,
};

/// YDLIDAR's.
const YDLIDAR: Commands = Commands {
    // The first two bytes wake it up.
    stop: &[0xa5, 0x00, 0xa5, ydlidar::STOP],
    info: ydlidar::GET_INFO,
    // Manuals and the maker's SDK disagree on the command.
    health: [ydlidar::GET_HEALTH, ydlidar::GET_HEALTH_TOO],
    reset: ydlidar::RESET,
    scan: ydlidar::SCAN,
    has_modes: false,
    may_be_deaf: true,
};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Stop,
    Drain,
    Info,
    Health,
    Reset,
    ZeroAngle,
    Introduced,
    TypicalMode,
    AnswerType,
    Period,
    Scan,
    /// No mode answers with what the parser reads.
    NoSuchMode,
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
                | Self::ZeroAngle
                | Self::TypicalMode
                | Self::AnswerType
                | Self::Period
                | Self::Scan
        )
    }
}

/// State of the conversation. About 130 bytes.
#[derive(Debug, Clone)]
pub(super) struct Query {
    commands: &'static Commands,
    step: Step,
    answers: Answers,
    info: Option<Info>,
    /// When the present step began to wait; `None` before it has acted.
    since_us: Option<u32>,
    tries: u8,
    was_reset: bool,
    scan_mode: Option<u16>,
    /// The answers that the parser reads; `None` where there is one kind.
    wanted: Option<u8>,
    /// The mode that is looked at next, after the one that the maker recommends.
    next_mode: u16,
    mode: Mode,
    keeps_zero: bool,
    /// The model's angle that looks forward (0.01°).
    model_zero: u16,
    zero: Option<u16>,
}

impl Query {
    /// At the beginning, for an RPLIDAR that is to answer with what the family's parser reads.
    pub(super) const fn rplidar(family: Family) -> Self {
        let wanted = match family {
            Family::RplidarExpress => EXPRESS,
            Family::RplidarHq => 0x83,
            Family::RplidarUltra => 0x84,
            Family::RplidarDense => 0x85,
            Family::RplidarUltraDense => 0x86,
            _ => STANDARD,
        };
        Self::new(&RPLIDAR, Some(wanted))
    }

    /// At the beginning; a YDLIDAR that keeps its zero angle is asked for it.
    pub(super) const fn ydlidar(model: &Model) -> Self {
        let mut query = Self::new(&YDLIDAR, None);
        query.keeps_zero = matches!(model.start, Start::Ydlidar { keeps_zero: true });
        query.model_zero = model.zero_cdeg;
        query
    }

    const fn new(commands: &'static Commands, wanted: Option<u8>) -> Self {
        Self {
            commands,
            wanted,
            next_mode: 0,
            keeps_zero: false,
            model_zero: 0,
            zero: None,
            step: Step::Stop,
            answers: Answers::new(),
            info: None,
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
    pub(super) fn info(&self) -> Option<Info> {
        self.info
    }

    /// The angle that looks forward by the unit's own calibration (0.01°), as it was told.
    pub(super) fn zero(&self) -> Option<u16> {
        self.zero
    }

    /// How the sensor streams, once it does.
    pub(super) fn mode(&self) -> Mode {
        self.mode
    }

    /// What sets the motor's speed: the A2's and A3's motor has a board of its own; C and S sensors start theirs with
    /// the scan.
    pub(super) fn motor_request(&self) -> Option<Request> {
        let info = self.info.filter(|_| self.commands.has_modes)?;
        if !(0x20..0x40).contains(&info.model) {
            return None;
        }
        rplidar::request(rplidar::MOTOR_PWM, &rplidar::MOTOR_PWM_USUAL.to_le_bytes())
    }

    /// Goes on to the scan, in the mode that the parser reads.
    pub(super) fn begin_scan(&mut self) {
        // GET_CONF came with firmware 1.24. The standard scan and the first express scan are older.
        let has_modes =
            self.commands.has_modes && self.info.is_some_and(|info| info.firmware >= (1, 24));
        self.next_mode = 0;
        match self.wanted {
            None | Some(STANDARD) => self.go(Step::Scan),
            _ if has_modes => self.go(Step::TypicalMode),
            Some(EXPRESS) => {
                self.scan_mode = Some(0);
                self.go(Step::Scan);
            }
            Some(_) => self.go(Step::NoSuchMode),
        }
    }

    /// What is to be done (µs, wrapping); `None` once the sensor is introduced, and once it streams.
    pub(super) fn poll(&mut self, now_us: u32, config: &StartConfig) -> Option<Action> {
        let waited_ms = self.since_us.map(|since| now_us.wrapping_sub(since) / 1000);
        Some(match (self.step, waited_ms) {
            (Step::Introduced | Step::Streaming, _) => return None,
            (Step::Failed(error), _) => Action::Failed(error),
            (Step::NoSuchMode, _) => self.give_up(),
            (Step::Stop, _) => {
                self.go(Step::Drain);
                self.since_us = Some(now_us);
                Action::Send(Request::of(&[self.commands.stop]))
            }
            (Step::Drain, Some(waited)) if waited >= config.drain_ms => {
                self.answers.clear();
                self.go(Step::Info);
                self.ask(now_us)
            }
            (Step::Reset, None) => {
                self.since_us = Some(now_us);
                send(self.commands.reset, &[])
            }
            (Step::Reset, Some(waited)) if waited >= config.reset_ms => {
                self.go(Step::Stop);
                Action::Wait
            }
            (step, None) if step.asks() => self.ask(now_us),
            (step, Some(waited)) if step.asks() && waited >= config.answer_ms => {
                if self.tries >= config.tries {
                    self.give_up()
                } else {
                    self.ask(now_us)
                }
            }
            _ => Action::Wait,
        })
    }

    /// Takes a byte from the sensor.
    pub(super) fn push(&mut self, byte: u8) {
        if let Some(answer) = self.answers.push(byte) {
            self.take(&answer);
        }
    }

    fn go(&mut self, step: Step) {
        self.step = step;
        self.since_us = None;
        self.tries = 0;
    }

    /// A request without an answer: some can be done without.
    fn give_up(&mut self) -> Action {
        let next = match self.step {
            Step::Info | Step::Health if self.commands.may_be_deaf => Step::Introduced,
            Step::ZeroAngle => Step::Introduced,
            Step::Scan if self.commands.may_be_deaf && self.info.is_none() => Step::Streaming,
            // The first express scan can be asked for blindly.
            Step::TypicalMode | Step::AnswerType if self.wanted == Some(EXPRESS) => {
                self.scan_mode = Some(0);
                Step::Scan
            }
            Step::Period => Step::Scan,
            _ => {
                let request = self.command();
                let error = StartError::NoAnswer { request };
                self.go(Step::Failed(error));
                return Action::Failed(error);
            }
        };
        self.go(next);
        Action::Wait
    }

    /// Command of the present step's request.
    fn command(&self) -> u8 {
        let [health, health_too] = self.commands.health;
        match self.step {
            Step::Info => self.commands.info,
            Step::Health if self.tries & 1 == 1 => health_too,
            Step::Health => health,
            Step::ZeroAngle => ydlidar::GET_ZERO_ANGLE,
            Step::Scan if self.scan_mode.is_some() => rplidar::EXPRESS_SCAN,
            Step::Scan => self.commands.scan,
            _ => rplidar::GET_CONF,
        }
    }

    /// Sends the present step's request.
    fn ask(&mut self, now_us: u32) -> Action {
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
            Step::TypicalMode => send(command, &CONF_TYPICAL.to_le_bytes()),
            Step::AnswerType => send(command, &entry(CONF_ANSWER)),
            Step::Period => send(command, &entry(CONF_PERIOD)),
            Step::Scan if self.scan_mode.is_some() => send(command, &[m0, 0, 0, 0, 0]),
            _ => send(command, &[]),
        }
    }

    fn take(&mut self, answer: &Answer) {
        match self.step {
            Step::Info => {
                if let Some(info) = Info::from_answer(answer) {
                    self.info = Some(info);
                    self.go(Step::Health);
                }
            }
            Step::Health => match Health::from_answer(answer) {
                None => {}
                Some(health) if health.status < 2 => self.go(if self.keeps_zero {
                    Step::ZeroAngle
                } else {
                    Step::Introduced
                }),
                Some(health) if self.was_reset => {
                    self.go(Step::Failed(StartError::Unhealthy(health)));
                }
                Some(_) => {
                    self.was_reset = true;
                    self.go(Step::Reset);
                }
            },
            Step::ZeroAngle => {
                if let (0x04, &[z0, z1, z2, z3]) = (answer.kind, answer.payload()) {
                    // A quarter of a degree a count, to be added to the sensor's angles. More than half a turn is no angle.
                    let added = i32::from_le_bytes([z0, z1, z2, z3]);
                    if (-720..=720).contains(&added) {
                        let zero = i32::from(self.model_zero) - 25 * added;
                        self.zero = Some(zero.rem_euclid(36_000) as u16);
                    }
                    self.go(Step::Introduced);
                }
            }
            Step::TypicalMode | Step::AnswerType | Step::Period => {
                if let Some((entry, value)) = rplidar::conf(answer) {
                    self.take_conf(entry, value);
                }
            }
            // An older stream may still run.
            Step::Scan if answer.streams && self.wanted.is_none_or(|kind| kind == answer.kind) => {
                self.mode.answer = answer.kind;
                self.go(Step::Streaming);
            }
            _ => {}
        }
    }

    fn take_conf(&mut self, entry: u32, value: u32) {
        match (self.step, entry) {
            (Step::TypicalMode, CONF_TYPICAL) => {
                self.scan_mode = Some(value as u16);
                self.go(Step::AnswerType);
            }
            (Step::AnswerType, CONF_ANSWER) if self.wanted == Some(value as u8) => {
                self.mode.answer = value as u8;
                self.go(Step::Period);
            }
            (Step::AnswerType, CONF_ANSWER) if self.next_mode < MODES => {
                self.scan_mode = Some(self.next_mode);
                self.next_mode += 1;
                self.go(Step::AnswerType);
            }
            (Step::AnswerType, CONF_ANSWER) => self.go(Step::NoSuchMode),
            (Step::Period, CONF_PERIOD) => {
                self.mode.period_q8 = Some(value);
                self.go(Step::Scan);
            }
            _ => {}
        }
    }
}

fn send(command: u8, payload: &[u8]) -> Action {
    Action::Send(rplidar::request(command, payload).unwrap_or_default())
}
