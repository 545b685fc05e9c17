//! Every model of the table through the firmware's own loop: started as it wants to be, poses, its cable pulled out and put back,
//! poses again, where they should be.
//!
//! The lidar at the other end hears only what is sent at its own speed, needs the motor where the board drives it, and forgets all
//! when its cable, which carries its power, is pulled out.

use std::{
    cell::{Cell, RefCell},
    collections::VecDeque,
    convert::Infallible,
    panic::{AssertUnwindSafe, catch_unwind, resume_unwind},
    rc::Rc,
};

use beamfix::{
    Odometry,
    lidar::{
        Family, Model, Motor, Protocol, Start,
        choice::{WithParser, with_parser},
    },
};
use beamfix_app::{
    AppConfig,
    any::{AnyLidar, AnyParser},
    command::Command,
    link::Receiver,
    ring::Ring,
    run::{Hardware, run, run_any},
    telemetry::{LidarState, Telemetry, Verdict},
};
use beamfix_sim::{
    TruePose,
    encoder::{self, Echo, Encoder},
};
use embedded_hal::pwm::{ErrorType, SetDutyCycle};
use host_tests::{
    board::commands::Commands,
    formats::{self, capture::log},
    pipeline::follow,
    watch::Watch,
};

/// Most beams of any model's revolution.
const BEAMS: usize = 3400;
/// A round of the loop takes so long (µs), and up to 32 bytes: enough for 2 Mbit/s.
pub const ROUND_US: u32 = 125;
/// Walls of the room (m): along x and y.
const ROOM: [f64; 2] = [4.0, 3.0];
/// Middle and radius of a pillar in it (m).
const PILLAR: ([f64; 2], f64) = ([2.9, 1.9], 0.25);
/// What a unit that keeps its zero adds to its angles (0.25°).
const ADDED: i32 = 365;
/// Where the robot starts in it.
const START: TruePose = TruePose::new(1.3, 1.2, 0.3);

/// What the test waits for next.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// Poses, for the first time.
    Begins,
    /// The robot drives until then (µs), and stands until a second later.
    Drives(u64),
    /// The cable is out until then (µs).
    Unplugged(u64),
    /// Poses, once more.
    Returns,
    /// As the first time.
    DrivesAgain(u64),
}

/// A lidar with its cable.
pub struct Unit {
    model: &'static Model,
    encoder: Option<Box<dyn Encoder>>,
    /// When its stream began (µs).
    began_us: u64,
    /// Speed of its own end of the line.
    baud: u32,
    heard: Vec<u8>,
    /// What it will send, each byte no earlier than it is due (µs).
    line: VecDeque<(u64, u8)>,
    /// Where it is.
    robot: TruePose,
}

impl Unit {
    pub fn new(model: &'static Model) -> Self {
        Self {
            model,
            encoder: None,
            began_us: 0,
            baud: 0,
            heard: Vec::new(),
            line: VecDeque::new(),
            robot: START,
        }
    }

    /// Its supply comes.
    pub fn has_power(&mut self, now_us: u64) {
        self.encoder = None;
        self.heard.clear();
        self.line.clear();
        self.baud = match self.model.start {
            // The faster ones are on USB or Ethernet, which has no speed.
            Start::Scip if self.model.baud < 1_000_000 => 19_200,
            Start::Sick => 9600,
            _ => self.model.baud,
        };
        if self.model.start == Start::Listen {
            self.stream(now_us + 300_000);
        }
    }

    fn stream(&mut self, now_us: u64) {
        if self.encoder.is_none() {
            self.encoder = Some(encoder::for_model(self.model));
            self.began_us = now_us;
        }
    }

    fn answer(&mut self, now_us: u64, bytes: &[u8]) {
        self.line
            .extend(bytes.iter().map(|&byte| (now_us + 2000, byte)));
    }

    /// Takes what the board sends.
    pub fn hear(&mut self, now_us: u64, bytes: &[u8]) {
        self.heard.extend_from_slice(bytes);
        let heard = std::mem::take(&mut self.heard);
        match self.model.start {
            Start::Send(wanted) if heard.ends_with(wanted) => self.stream(now_us),
            Start::Rplidar | Start::Ydlidar { .. } => self.hear_request(now_us, &heard),
            Start::Scip => self.hear_scip(now_us, &heard),
            Start::Sick => self.hear_sick(now_us, &heard),
            _ => self.heard = heard,
        }
    }

    /// A request of an RPLIDAR or a YDLIDAR; a firmware with modes, of which the second is the family's, except the oldest one's.
    fn hear_request(&mut self, now_us: u64, request: &[u8]) {
        let kind = match self.model.family {
            Family::RplidarExpress => 0x82,
            Family::RplidarHq => 0x83,
            Family::RplidarUltra => 0x84,
            Family::RplidarDense => 0x85,
            Family::RplidarUltraDense => 0x86,
            _ => 0x81,
        };
        let answer = |kind: u8, payload: &[u8], streams: bool| {
            let mut bytes = vec![0xa5, 0x5a, payload.len() as u8, 0, 0];
            bytes.extend([if streams { 0x40 } else { 0 }, kind]);
            bytes.extend_from_slice(payload);
            bytes
        };
        let has_modes = self.model.name != "rplidar-express";
        let firmware = if has_modes { 29 } else { 5 };
        let is_rplidar = self.model.start == Start::Rplidar;
        let mut info = vec![0x18, firmware, 1, 7];
        info.extend([0; 16]);
        let period_q8 = 256_000_000 / self.model.points_per_s;
        let conf = |entry: u8, value: &[u8]| {
            let payload = [&[entry, 0, 0, 0][..], value].concat();
            answer(0x20, &payload, false)
        };
        let bytes = match *request {
            [0xa5, 0x25 | 0x65] | [0xa5, 0, 0xa5, 0x65] => {
                self.encoder = None;
                self.line.clear();
                vec![]
            }
            [0xa5, 0x50 | 0x90] => answer(4, &info, false),
            [0xa5, 0x52 | 0x91 | 0x92] => answer(6, &[0, 0, 0], false),
            [0xa5, 0x93] => answer(4, &ADDED.to_le_bytes(), false),
            [0xa5, 0x84, _, 0x7c, ..] if has_modes => conf(0x7c, &[0, 0]),
            [0xa5, 0x84, _, 0x75, 0, 0, 0, mode, ..] if has_modes => {
                conf(0x75, &[if mode == 1 { kind } else { 0x81 }])
            }
            [0xa5, 0x84, _, 0x71, ..] if has_modes => conf(0x71, &period_q8.to_le_bytes()),
            [0xa5, 0x20 | 0x60] => {
                self.stream(now_us + 10_000);
                answer(0x81, &[0; 5], true)
            }
            [0xa5, 0x82, 5, mode, ..] => {
                self.stream(now_us + 10_000);
                assert!(is_rplidar && mode == u8::from(has_modes), "{mode}");
                answer(kind, &[0; 4], true)
            }
            // The rest of it comes.
            _ => {
                self.heard = request.to_vec();
                return;
            }
        };
        self.answer(now_us, &bytes);
    }

    fn hear_scip(&mut self, now_us: u64, heard: &[u8]) {
        let mut rest = heard;
        while let Some(end) = rest.iter().position(|&byte| byte == b'\n') {
            let line = &rest[..end];
            rest = &rest[end + 1..];
            let code = |text: &str| {
                let sum = text.bytes().fold(0u8, u8::wrapping_add);
                char::from((sum & 0x3f) + 0x30)
            };
            let Family::Scip(steps) = self.model.family else {
                unreachable!("a SCIP sensor");
            };
            let text = String::from_utf8_lossy(line).into_owned();
            let mut reply = format!("{text}\n00P\n");
            match text.get(..2) {
                Some("PP") => {
                    let fields = [
                        ("ARES", steps.per_revolution),
                        ("AMIN", 0),
                        ("AMAX", steps.last),
                        ("AFRT", steps.front),
                        ("SCAN", steps.rpm),
                    ];
                    for (name, value) in fields {
                        let field = format!("{name}:{value}");
                        reply += &format!("{field};{}\n", code(&field));
                    }
                }
                Some("MD") => self.stream(now_us),
                Some("QT") => {
                    self.encoder = None;
                    self.line.clear();
                }
                _ => {}
            }
            self.answer(now_us, format!("{reply}\n").as_bytes());
            if let Some(Ok(baud)) = text.strip_prefix("SS").map(str::parse) {
                self.baud = baud;
            }
        }
        self.heard = rest.to_vec();
    }

    fn hear_sick(&mut self, now_us: u64, request: &[u8]) {
        match *request {
            [2, 0, 2, 0, 0x20, what, _, _] => {
                match what {
                    0x24 => self.stream(now_us + 1000),
                    0x25 => {
                        self.encoder = None;
                        self.line.clear();
                    }
                    0x48 => self.baud = 500_000,
                    _ => panic!("{what:#x}"),
                }
                self.answer(now_us, &[0x06, 0x02, 0x80, 3, 0, 0xa0, 0, 0x10, 0x16, 0x0a]);
            }
            _ => self.heard = request.to_vec(),
        }
    }

    /// What it has sent by now, if its motor turned.
    pub fn sends(&mut self, now_us: u64, turns: bool) -> Vec<u8> {
        if let Some(encoder) = &mut self.encoder {
            if !turns {
                self.began_us = now_us.saturating_sub(encoder.next_time_us() as u64);
            }
            // The angles of a unit with a zero of its own are to be added to, clockwise.
            let turned = match self.model.start {
                Start::Ydlidar { keeps_zero: true } => f64::from(ADDED).to_radians() / 4.0,
                _ => 0.0,
            };
            let mut look = |_: f64, bearing: f64| see(self.robot, bearing - turned);
            while self.began_us as f64 + encoder.next_time_us() <= now_us as f64 {
                let mut bytes = Vec::new();
                encoder.fire(&mut look, &mut bytes);
                self.line.extend(bytes.iter().map(|&byte| (now_us, byte)));
            }
        }
        let due = self.line.iter().take_while(|(due, _)| *due <= now_us);
        // As fast as its line is.
        let room = (u64::from(self.model.baud) * u64::from(ROUND_US)).div_ceil(10_000_000);
        let count = due.count().min(room as usize);
        self.line.drain(..count).map(|(_, byte)| byte).collect()
    }
}

/// What a beam of a lidar at a pose in the room meets.
fn see(robot: TruePose, bearing: f64) -> Option<Echo> {
    let (sin, cos) = (
        libm::sin(robot.theta + bearing),
        libm::cos(robot.theta + bearing),
    );
    let along = |at: f64, direction: f64, wall: f64| match direction {
        0.0.. => (wall - at) / direction,
        _ => -at / direction,
    };
    let wall = along(robot.x, cos, ROOM[0]).min(along(robot.y, sin, ROOM[1]));
    let ([x, y], radius) = PILLAR;
    let (dx, dy) = (x - robot.x, y - robot.y);
    let (ahead, aside) = (dx * cos + dy * sin, dy * cos - dx * sin);
    let half = radius * radius - aside * aside;
    let pillar = match half > 0.0 && ahead > 0.0 {
        true => ahead - libm::sqrt(half),
        false => f64::INFINITY,
    };
    let range_mm = 1000.0 * wall.min(pillar);
    Some(Echo {
        range_mm,
        intensity: 180,
    })
}

/// The board with what hangs on it; its time passes by the rounds of the loop.
struct Board {
    us: u64,
    unit: Unit,
    stage: Stage,
    /// Speed of its end of the lidar's line.
    baud: u32,
    duty: Rc<Cell<u16>>,
    receiver: Receiver,
    found: Rc<RefCell<Found>>,
    commands: Rc<Ring<64>>,
    asked_us: u64,
}

/// What came of it.
#[derive(Default)]
struct Found {
    /// How long it took from power to the first pose, twice (ms).
    starts_ms: Vec<u64>,
    /// Poses that a match found, since the lidar had power.
    measured: u32,
    off: (f64, f64),
    states: Vec<LidarState>,
    unfed_us: u64,
    fed_us: u64,
    /// All that the board has sent, and the bits of the poses in it.
    sent: Vec<u8>,
    poses: Vec<[u32; 3]>,
}

/// How the loop, which never ends, is left.
struct Over;

impl Board {
    fn is_plugged(&self) -> bool {
        !matches!(self.stage, Stage::Unplugged(_))
    }

    /// Drives on, pulls the cable out, puts it back.
    fn go_on(&mut self) {
        let mut found = self.found.borrow_mut();
        let enough = found.measured >= 10;
        let now = self.us;
        self.stage = match self.stage {
            Stage::Begins if enough => Stage::Drives(now + 3_000_000),
            Stage::Returns if enough => Stage::DrivesAgain(now + 3_000_000),
            Stage::Drives(until) | Stage::DrivesAgain(until) if now < until => {
                let seconds = f64::from(ROUND_US) * 1e-6;
                self.unit.robot = self.unit.robot.along_arc(0.12 * seconds, 0.1 * seconds);
                self.stage
            }
            Stage::Drives(until) if now > until + 1_000_000 => Stage::Unplugged(now + 3_000_000),
            Stage::Unplugged(until) if now > until => {
                self.unit.has_power(now);
                found.measured = 0;
                Stage::Returns
            }
            Stage::DrivesAgain(until) if now > until + 1_000_000 => {
                drop(found);
                resume_unwind(Box::new(Over));
            }
            Stage::Begins | Stage::Returns if now > 80_000_000 => {
                panic!("{}: no poses in {:?}", self.unit.model.name, self.stage)
            }
            stage => stage,
        };
    }
}

impl Hardware for Board {
    const ASKS: bool = true;

    fn now_us(&mut self) -> u32 {
        self.us += u64::from(ROUND_US);
        self.go_on();
        if self.us > self.asked_us + 100_000 {
            self.asked_us = self.us;
            let mut ask = Commands::new();
            ask.ask_health();
            self.commands.extend(ask.bytes());
        }
        self.us as u32
    }

    fn send(&mut self, bytes: &[u8]) {
        let mut found = self.found.borrow_mut();
        found.sent.extend_from_slice(bytes);
        for &byte in bytes {
            match self.receiver.push(byte) {
                Some(Telemetry::Pose(pose)) => {
                    found.poses.push(pose.pose.map(f32::to_bits));
                    if matches!(pose.verdict, Verdict::Measured | Verdict::Keyframe) {
                        found.measured += 1;
                        if found.measured == 1 {
                            found.starts_ms.push(self.us / 1000);
                        }
                    }
                    let [x, y, theta] = pose.pose.map(f64::from);
                    let there = START.between(self.unit.robot);
                    let off = there.between(TruePose::new(x, y, theta));
                    found.off = (1000.0 * off.distance(), off.theta.to_degrees());
                }
                Some(Telemetry::Health(health)) if found.states.last() != Some(&health.lidar) => {
                    found.states.push(health.lidar);
                }
                _ => {}
            }
        }
    }

    fn send_to_lidar(&mut self, bytes: &[u8]) {
        if self.is_plugged() && self.baud == self.unit.baud {
            self.unit.hear(self.us, bytes);
        }
    }

    fn set_lidar_baud(&mut self, baud: u32) {
        self.baud = baud;
    }

    fn feed_watchdog(&mut self) {
        let mut found = self.found.borrow_mut();
        found.unfed_us = found.unfed_us.max(self.us - found.fed_us);
        found.fed_us = self.us;
    }

    fn wait(&mut self) {}

    fn simulate<const L: usize>(&mut self, _: u32, lidar: &Ring<L>) {
        if !self.is_plugged() {
            return;
        }
        // Whose motor the board must drive does not turn without.
        let turns = self.unit.model.motor != Motor::Pwm || self.duty.get() > 0;
        let bytes = self.unit.sends(self.us, turns);
        match self.baud == self.unit.baud {
            true => lidar.extend(&bytes),
            false => bytes
                .iter()
                .for_each(|byte| lidar.push(byte.rotate_left(3) ^ 0x29)),
        }
    }
}

struct Pwm(Rc<Cell<u16>>);

impl ErrorType for Pwm {
    type Error = Infallible;
}

impl SetDutyCycle for Pwm {
    fn max_duty_cycle(&self) -> u16 {
        1000
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Self::Error> {
        self.0.set(duty);
        Ok(())
    }
}

/// The firmware with a model's parser.
struct Started {
    config: AppConfig,
    board: Board,
    pwm: Pwm,
    commands: Rc<Ring<64>>,
}

impl Started {
    /// On a board that has a choice.
    fn run_any(self) {
        let mut app = Box::new(AnyLidar::<BEAMS>::odometry(
            self.config,
            AnyParser::for_model(self.config.lidar).expect("a family that is known"),
        ));
        app.choose(&self.config);
        let lidar = Ring::<4096>::new();
        until_over(|| -> Infallible {
            run_any(
                &mut *app,
                &self.config,
                (&lidar, &*self.commands),
                self.board,
                self.pwm,
            )
        });
    }
}

/// Runs what never returns, until the board says that the drive is [`Over`].
fn until_over(run: impl FnOnce() -> Infallible) {
    let Err(over) = catch_unwind(AssertUnwindSafe(run));
    if !over.is::<Over>() {
        resume_unwind(over);
    }
}

impl WithParser for Started {
    type Output = ();

    fn run<P: Protocol>(self, parser: P) {
        let mut app = Box::new(beamfix_app::Firmware::<P, _, BEAMS>::odometry(
            self.config,
            parser,
        ));
        let lidar = Ring::<4096>::new();
        until_over(|| -> Infallible {
            run(
                &mut *app,
                &self.config,
                (&lidar, &*self.commands),
                self.board,
                self.pwm,
            )
        });
        assert_eq!(lidar.lost(), 0);
    }
}

/// A model's drive on a board that is built for it, or that a command tells which lidar it has.
fn driven(model: &'static Model, config: &AppConfig, is_chosen: bool) -> Found {
    let (duty, commands) = (Rc::new(Cell::new(0)), Rc::new(Ring::new()));
    let found = Rc::new(RefCell::new(Found::default()));
    let mut unit = Unit::new(model);
    unit.has_power(0);
    let board = Board {
        us: 0,
        unit,
        stage: Stage::Begins,
        baud: config.lidar.baud,
        duty: duty.clone(),
        receiver: Receiver::new(),
        found: found.clone(),
        commands: commands.clone(),
        asked_us: 0,
    };
    let started = Started {
        config: *config,
        board,
        pwm: Pwm(duty),
        commands,
    };
    match is_chosen {
        true => {
            let mut choose = Commands::new();
            choose.send(&Command::Choose { lidar: "no lidar" });
            choose.send(&Command::Choose { lidar: model.name });
            started.commands.extend(choose.bytes());
            started.run_any();
        }
        false => with_parser(model, started),
    }
    found.take()
}

impl Found {
    /// Started, poses where they should be before and after the cable was out, the watchdog fed.
    fn expect_well(&self, name: &str) {
        let (mm, degrees) = self.off;
        println!(
            "{name:<20} first pose after {:?} ms, {mm:.0} mm and {degrees:.2}° off, {:?}, fed every {} ms",
            self.starts_ms,
            self.states,
            self.unfed_us / 1000
        );
        assert!(mm < 30.0 && degrees.abs() < 1.0, "{name}");
        assert!(self.unfed_us < 100_000, "{name}");
        let [.., LidarState::Turning] = self.states[..] else {
            panic!("{name}: {:?}", self.states)
        };
        assert!(self.states.contains(&LidarState::Silent));
    }
}

#[test]
#[cfg_attr(debug_assertions, ignore = "twenty seconds of each of 46 lidars")]
fn every_lidar_is_started_and_gives_poses_again_after_its_cable_was_out() {
    let (mut slowest, mut replayed) = (0, 0);
    for model in Model::ALL {
        let config = AppConfig {
            record: true,
            ..AppConfig::for_model(model)
        };
        let found = driven(model, &config, false);
        let name = model.name;
        found.expect_well(name);
        slowest = slowest.max(found.starts_ms[0]);
        if let Some(recorded) = recorded(model, &config, &found.sent) {
            let differs = (recorded.iter().zip(&found.poses)).position(|(one, other)| one != other);
            // The last piece of the bytes waits for more.
            let missing = found.poses.len().wrapping_sub(recorded.len());
            assert!(
                missing <= 1 && differs.is_none(),
                "{name}: {missing} poses are not in the recording, {differs:?} is another"
            );
            replayed += 1;
        }
    }
    println!("the slowest took {slowest} ms; what `watch` recorded of {replayed} lidars replays");
    assert!(replayed >= 36, "{replayed}");
    assert!(slowest < 5000, "the supervisor counts on less");
}

/// A board that is set to an LD06 and told another lidar by a command: as one that is built for it.
#[test]
#[cfg_attr(debug_assertions, ignore = "twenty seconds of each of 46 lidars")]
fn every_lidar_can_be_chosen_by_a_command() {
    for model in Model::ALL {
        let found = driven(model, &AppConfig::DEFAULT, true);
        found.expect_well(model.name);
        let mut receiver = Receiver::new();
        let told: Vec<_> = (found.sent.iter())
            .filter_map(|&byte| receiver.push::<Telemetry>(byte))
            .filter_map(|message| match message {
                Telemetry::Ready(ready) => Some(ready.lidar.as_str().to_owned()),
                _ => None,
            })
            .collect();
        assert_eq!(told, ["ld06", model.name]);
    }
}

/// Bits of the poses that `replay` finds in what `watch` recorded of a board: with the zero that the lidar told the board. `None`
/// where the revolutions are so fine that `replay` thins them.
fn recorded(model: &Model, config: &AppConfig, sent: &[u8]) -> Option<Vec<[u32; 3]>> {
    let mut file = Vec::new();
    let mut watch = Watch::new(Some(&mut file), None).expect("memory");
    watch.push(sent).expect("memory");
    watch.finish().expect("memory");
    drop(watch);
    let content = formats::bytes::Content {
        bytes: file,
        cut: None,
    };
    let log = log::parse("recording", content, model.name).expect("the lidar's bytes");
    log.capture.as_ref()?;
    let mut poses = Vec::new();
    let odometry = Odometry::<BEAMS>::new(config.odometry);
    follow(&log, (usize::MAX, true), odometry, &mut |_, pose, _| {
        poses.push([pose.x, pose.y, pose.theta].map(f32::to_bits));
        Ok(())
    })
    .expect("nothing fails");
    Some(poses)
}
