//! The emulated boards: what they are, how their firmware is built and run.

pub mod bench;
pub mod bytes;
pub mod card;
pub mod commands;
pub mod drivers;
pub mod emulator;
pub mod fields;
pub mod firmware;
pub mod maps;
pub mod profile;
pub mod real;
pub mod real_card;
pub mod rp2040js;
pub mod slam;
pub mod start;
pub mod stream;

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use beamfix_app::{
    App, BEAMS, CONFIG, SMALL_BEAMS,
    telemetry::{Cost, Health, Reset, Telemetry},
};

use commands::Commands;
use emulator::Count;
use firmware::Firmware;

/// An emulated board.
#[derive(Debug)]
pub struct Board {
    /// As the command line has it.
    pub name: &'static str,
    /// What it stands for.
    pub core: &'static str,
    /// Its programs.
    pub firmware: Firmware,
    emulator: &'static str,
    machine: &'static [&'static str],
    /// Where the memory for statics and stack starts.
    ram_start: u64,
    /// How much of it there is (bytes).
    ram_bytes: u64,
    /// Nanoseconds of emulated time per instruction: 2 to this.
    icount_shift: u8,
    /// Most beams of a revolution.
    pub beams: usize,
    /// Which of the machine's UARTs frames leave by and commands come in by; the lidar is on the first.
    uarts: &'static [Line],
}

/// What a UART is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Line {
    Lidar,
    Telemetry,
    Commands,
    /// Bytes that tell the motor's duty.
    Motor,
    /// One UART for both: lidar in, frames out.
    LidarAndTelemetry,
    /// One UART for both: frames out, commands in.
    TelemetryAndCommands,
}

/// All there are.
pub const BOARDS: &[Board] = &[
    Board {
        name: "m4f",
        core: "Cortex-M4F",
        firmware: Firmware::new("qemu-m4f", "thumbv7em-none-eabihf").proven(),
        emulator: "qemu-system-arm",
        machine: &["-M", "mps2-an386"],
        ram_start: 0x2000_0000,
        ram_bytes: 4 << 20,
        icount_shift: 6,
        beams: BEAMS,
        uarts: &[Line::Lidar, Line::Telemetry, Line::Commands, Line::Motor],
    },
    Board {
        name: "m0",
        core: "Cortex-M0",
        firmware: Firmware::new("qemu-m0", "thumbv6m-none-eabi").proven(),
        emulator: "qemu-system-arm",
        machine: &["-M", "microbit"],
        ram_start: 0x2000_0000,
        ram_bytes: 16 << 10,
        icount_shift: 6,
        beams: SMALL_BEAMS,
        uarts: &[Line::LidarAndTelemetry],
    },
    Board {
        name: "rv32",
        core: "RV32IMC",
        firmware: Firmware::new("qemu-rv32", "riscv32imc-unknown-none-elf").proven(),
        emulator: "qemu-system-riscv32",
        machine: &["-M", "virt", "-bios", "none"],
        ram_start: 0x8040_0000,
        ram_bytes: 4 << 20,
        icount_shift: 0,
        beams: BEAMS,
        uarts: &[Line::LidarAndTelemetry],
    },
];

/// The firmware of a real board, the STM32F446's, in the nearest machine that QEMU has: it runs, but is no measure.
pub const STM32F4: Board = Board {
    name: "stm32f4",
    core: "Cortex-M4F",
    firmware: Firmware::new("nucleo-f446", "thumbv7em-none-eabihf").with("qemu"),
    emulator: "qemu-system-arm",
    machine: &["-M", "netduinoplus2"],
    ram_start: 0x2000_0000,
    ram_bytes: 128 << 10,
    icount_shift: 6,
    beams: BEAMS,
    uarts: &[Line::Lidar, Line::Telemetry],
};

/// The same, which takes any lidar by a command, and has a line to it.
pub const STM32F4_ANY: Board = Board {
    name: "stm32f4-any",
    firmware: Firmware::new("nucleo-f446", "thumbv7em-none-eabihf").with("qemu,any-lidar"),
    uarts: &[Line::Lidar, Line::TelemetryAndCommands],
    ..STM32F4
};

/// The emulated Cortex-M0 with the firmware built for size, as a board with 64 KB of flash has it. Not optimised so far that the
/// linker could see that it does not panic.
pub const SMALL: Board = Board {
    name: "m0z",
    firmware: Firmware::new("qemu-m0", "thumbv6m-none-eabi").small(),
    ..BOARDS[1]
};

/// The emulated Cortex-M4F that simulates its lidar itself.
pub const DEMO: Board = Board {
    firmware: Firmware::new("qemu-m4f", "thumbv7em-none-eabihf")
        .with("demo")
        .proven(),
    ..BOARDS[0]
};

/// The emulated Cortex-M4F that sends MAVLink.
pub const MAVLINK: Board = Board {
    firmware: Firmware::new("qemu-m4f", "thumbv7em-none-eabihf").with("mavlink"),
    ..BOARDS[0]
};

impl Board {
    /// The board of this name.
    pub fn named(name: &str) -> Result<&'static Self> {
        (BOARDS.iter().chain([&SMALL]))
            .find(|board| board.name == name)
            .with_context(|| {
                let names: Vec<_> = BOARDS.iter().map(|board| board.name).collect();
                format!("no board {name:?}: there are {}", names.join(", "))
            })
    }

    /// Builds one of the board's programs (`""`: the firmware itself); gives the ELF file.
    pub fn build(&self, program: &str) -> Result<PathBuf> {
        self.firmware.build(program)
    }

    /// Builds one of the board's tests; gives the ELF file.
    pub fn build_test(&self, test: &str) -> Result<PathBuf> {
        self.firmware.build_test(test)
    }

    /// Runs the application over commands, in the emulator; the costs are worth something with [`Count::Exact`].
    pub fn replay(&self, commands: &Commands, count: Count) -> Result<Replay> {
        let elf = self.build("replay")?;
        let sent = emulator::run(self, &elf, commands.bytes(), count)?;
        Replay::from_bytes(&sent)
            .with_context(|| format!("{}: what the board sent is damaged", self.name))
    }
}

/// What the application sent over commands.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Replay {
    /// In order, without the costs.
    pub messages: Vec<Telemetry>,
    /// From a board: one for every call that sent something.
    pub costs: Vec<Cost>,
}

impl Replay {
    /// Runs the application over commands, here, with room for so many beams: a board's [`Board::beams`].
    #[must_use]
    pub fn on_host(commands: &Commands, beams: usize) -> Self {
        let mut app = Here::new(beams);
        let mut sent = app.ready().to_vec();
        app.command(commands.bytes(), |out| sent.extend_from_slice(out));
        Self::from_bytes(&sent).expect("the frames were just made")
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let mut replay = Self::default();
        let mut receiver = beamfix_app::link::Receiver::new();
        for &byte in bytes {
            match receiver.push(byte) {
                Some(Telemetry::Cost(cost)) => replay.costs.push(cost),
                Some(message) => replay.messages.push(message),
                None => {}
            }
        }
        let counters = receiver.counters();
        let decoded = replay.messages.len() + replay.costs.len();
        if counters.errors > 0 || decoded != counters.frames as usize {
            bail!(
                "{} frames, {decoded} of them understood, {} damaged",
                counters.frames,
                counters.errors
            );
        }
        Ok(replay)
    }

    /// The poses, in order.
    pub fn poses(&self) -> impl Iterator<Item = &beamfix_app::telemetry::Pose> {
        self.messages.iter().filter_map(|message| match message {
            Telemetry::Pose(pose) => Some(pose),
            _ => None,
        })
    }

    /// The last word on the application's health.
    #[must_use]
    pub fn health(&self) -> Option<&Health> {
        self.messages
            .iter()
            .rev()
            .find_map(|message| match message {
                Telemetry::Health(health) => Some(health),
                _ => None,
            })
    }
}

/// The first pose in which two runs differ, in words; `None` where every bit of every pose is the same.
pub fn difference<'a>(
    a: impl IntoIterator<Item = &'a beamfix_app::telemetry::Pose>,
    b: impl IntoIterator<Item = &'a beamfix_app::telemetry::Pose>,
) -> Option<String> {
    let (mut a, mut b) = (a.into_iter(), b.into_iter());
    for k in 0.. {
        match (a.next(), b.next()) {
            (None, None) => break,
            (Some(a), Some(b)) if bits(a) == bits(b) => {}
            (Some(a), Some(b)) => return Some(format!("scan {k}: {a:?} is not {b:?}")),
            (None, Some(_)) => return Some(format!("scan {k}: missing in the first run")),
            (Some(_), None) => return Some(format!("scan {k}: missing in the second run")),
        }
    }
    None
}

/// Everything in a pose, floats as bits: -0 is not 0, and NaN is itself.
fn bits(pose: &beamfix_app::telemetry::Pose) -> impl PartialEq + use<> {
    let beamfix_app::telemetry::Pose {
        sequence,
        time_us,
        pose,
        covariance,
        verdict,
        inliers,
        beams,
        residual,
    } = *pose;
    (
        (sequence, time_us, verdict, inliers, beams),
        pose.map(f32::to_bits),
        covariance.map(f32::to_bits),
        residual.to_bits(),
    )
}

/// The application here, with as many beams as on one of the boards.
pub enum Here {
    /// As nearly all have it.
    Usual(Box<App<BEAMS>>),
    /// As a board with 16 KB of RAM has it.
    Small(Box<App<SMALL_BEAMS>>),
}

impl Here {
    /// With room for so many beams.
    ///
    /// # Panics
    /// If no board has room for exactly so many.
    #[must_use]
    pub fn new(beams: usize) -> Self {
        match beams {
            BEAMS => Self::Usual(Box::new(App::new(CONFIG))),
            SMALL_BEAMS => Self::Small(Box::new(App::new(CONFIG))),
            _ => panic!("no board takes {beams} beams"),
        }
    }

    /// As [`App::ready`].
    pub fn ready(&mut self) -> &[u8] {
        match self {
            Self::Usual(app) => app.ready(Reset::Other),
            Self::Small(app) => app.ready(Reset::Other),
        }
    }

    /// As [`App::lidar_all`].
    pub fn lidar(&mut self, bytes: &[u8], send: impl FnMut(&[u8])) {
        match self {
            Self::Usual(app) => app.lidar_all(bytes, send),
            Self::Small(app) => app.lidar_all(bytes, send),
        }
    }

    /// As [`App::command_all`].
    pub fn command(&mut self, bytes: &[u8], send: impl FnMut(&[u8])) {
        match self {
            Self::Usual(app) => app.command_all(bytes, send),
            Self::Small(app) => app.command_all(bytes, send),
        }
    }

    /// As [`App::health`].
    #[must_use]
    pub fn health(&self) -> Health {
        match self {
            Self::Usual(app) => app.health(),
            Self::Small(app) => app.health(),
        }
    }
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("host-tests lies in the workspace")
}
