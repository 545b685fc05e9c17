//! What a byte of the lidar costs the firmware besides matches: the boards' own loop, from the interrupt that puts a piece of the
//! line into the ring to the frames that leave, with a task that finds nothing.
//!
//! `input.bin`: a byte that says how many come in at a time, then an LD06's. `output.bin`: `u32` each of bytes, instructions
//! and frames sent.

use beamfix::{
    geometry::{EgoMotion, Pose, Twist},
    lidar::parsers::Ldrobot,
    linalg::Covariance,
    pipeline::{Estimate, Estimator, Verdict as Known},
    scan::Scan,
};
use beamfix_app::{
    CONFIG, Firmware, Lidar as _, Row, SMALL_BEAMS,
    ring::Ring,
    run::{Hardware, NoPwm, run},
    task::{Task, Told},
    telemetry::{NOT_KNOWN, Quality, Task as Kind, Verdict},
};
use semihosting::{
    fs::File,
    io::{self, Read as _, Write as _},
};

use crate::{INPUT, Machine, OUTPUT, finish};

/// Most bytes that come in at a time.
const MOST: usize = 32;

/// A task that takes scans and finds nothing.
#[derive(Debug, Clone, Copy)]
pub struct Nothing;

impl Estimate for Nothing {
    fn pose(&self) -> Option<Pose> {
        None
    }

    fn covariance(&self) -> Option<Covariance> {
        None
    }

    fn verdict(&self) -> Known {
        Known::Unknown
    }
}

impl<const N: usize> Estimator<N> for Nothing {
    type Step = Self;

    fn update(&mut self, _: &Scan<N>, _: EgoMotion) -> Self {
        Self
    }
}

impl<const N: usize> Task<N> for Nothing {
    const KIND: Kind = Kind::Odometry;

    fn pose(&self) -> Option<Pose> {
        None
    }

    fn twist(&self) -> Option<Twist> {
        None
    }

    fn refused(&self) -> u32 {
        0
    }

    fn lost(&self) -> u32 {
        0
    }

    fn told(_: &Self) -> Told {
        // Nothing of it is known when this is compiled.
        core::hint::black_box(Told {
            pose: Pose::new(1.0, -2.0, 0.5),
            covariance: NOT_KNOWN,
            verdict: Verdict::Measured,
            inliers: 400,
            beams: 412,
            residual: 0.01,
        })
    }

    fn is_blind(_: &Self, _: &Scan<N>) -> bool {
        false
    }

    fn quality(_: u16, _: &Self) -> Option<Quality> {
        None
    }
}

/// The application with it.
pub type App = Firmware<Ldrobot, Nothing, SMALL_BEAMS>;

/// Waits for the first revolution.
#[must_use]
pub const fn new() -> App {
    Firmware::with_task(&CONFIG, Row::<0>::PARSER, Nothing)
}

/// The lidar's line and the clock, by the file.
struct Line<M> {
    machine: M,
    input: File,
    piece: usize,
    /// Whether a piece has come in since the loop was last asleep.
    is_fed: bool,
    bytes: u32,
    instructions: u32,
    /// Frames that were sent.
    frames: u32,
}

impl<M: Machine> Hardware for Line<M> {
    /// A byte takes 43 µs: a line without a pause.
    fn now_us(&mut self) -> u32 {
        43 * self.bytes
    }

    fn send(&mut self, bytes: &[u8]) {
        core::hint::black_box(bytes);
        self.frames += 1;
    }

    fn feed_watchdog(&mut self) {}

    fn wait(&mut self) {
        self.is_fed = false;
    }

    /// Once the loop has slept: what the interrupt does.
    fn simulate<const L: usize>(&mut self, _: u32, lidar: &Ring<L>) {
        if self.is_fed {
            return;
        }
        self.instructions += self.machine.instructions();
        let mut bytes = [0; MOST];
        let piece = bytes.get_mut(..self.piece).unwrap_or_default();
        let count = self.input.read(piece).unwrap_or(0);
        let Some(bytes) = piece.get(..count).filter(|bytes| !bytes.is_empty()) else {
            finish(self.tell());
        };
        self.is_fed = true;
        self.bytes += count as u32;
        self.machine.restart();
        lidar.extend(bytes);
    }
}

impl<M: Machine> Line<M> {
    #[inline(never)]
    fn tell(&self) -> io::Result<()> {
        let mut output = File::create(OUTPUT)?;
        for number in [self.bytes, self.instructions, self.frames] {
            output.write_all(&number.to_le_bytes())?;
        }
        Ok(())
    }
}

/// Runs the loop until the file is at its end.
pub fn forever(app: &mut App, rings: (&Ring<256>, &Ring<32>), mut machine: impl Machine) -> ! {
    let open = || {
        let mut input = File::open(INPUT)?;
        let mut piece = [0];
        input.read(&mut piece)?;
        Ok((input, usize::from(piece[0])))
    };
    let (input, piece) = match open() {
        Ok(opened) => opened,
        Err(error) => finish(Err(error)),
    };
    machine.restart();
    let line = Line {
        machine,
        input,
        piece,
        is_fed: false,
        bytes: 0,
        instructions: 0,
        frames: 0,
    };
    run(app, &CONFIG, rings, line, NoPwm)
}
