//! The library alone, as a program of one's own would use it: bytes of an LD06 to the hash of all poses.
//!
//! `boards/c/examples/replay.c` makes the same calls; the tests compare what both print and how large they are.

use beamfix::{
    Odometry, OdometryConfig, Pipeline, Protocol as _, Revolution,
    lidar::{Model, parsers},
};
use semihosting::{
    fs::File,
    io::{self, Read as _, Write as _},
};

use crate::INPUT;

/// Most beams of a revolution: those of the C library's functions that end in `_small`.
pub const BEAMS: usize = 430;

/// The parser and the odometry.
pub type Robot = Pipeline<parsers::Ldrobot, Odometry<BEAMS>, BEAMS>;

/// With the LD06's settings.
#[must_use]
pub const fn new() -> Robot {
    let model = &Model::LDROBOT_LD06;
    let odometry = Odometry::new(OdometryConfig::for_model(model));
    Pipeline::new(parsers::Ldrobot::for_model(model), odometry)
}

/// Prints the hash of the poses of `input.bin` and their number: FNV-1a over the bits of every x, y and theta.
///
/// By hand, as the C program does it: formatting would be more code than that.
pub fn run(robot: &mut Robot) -> io::Result<()> {
    let mut input = File::open(INPUT)?;
    let (mut hash, mut poses) = (0xcbf2_9ce4_8422_2325u64, 0u32);
    let mut bytes = [0; 64];
    loop {
        let count = input.read(&mut bytes)?;
        let Some(mut rest) = bytes.get(..count).filter(|bytes| !bytes.is_empty()) else {
            break;
        };
        while !rest.is_empty() {
            robot.set_time(0);
            let taken = robot.push_packet(rest, &mut |revolution: Revolution<
                '_,
                Odometry<BEAMS>,
                BEAMS,
            >| {
                let pose = revolution.step.pose;
                for byte in [pose.x, pose.y, pose.theta]
                    .into_iter()
                    .flat_map(f32::to_le_bytes)
                {
                    hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
                }
                poses += 1;
            });
            rest = rest.get(taken..).unwrap_or_default();
        }
    }
    let health = robot.lidar().counters();
    core::hint::black_box((health, robot.tracker().refused_beams()));
    let digit = |value: u64, k: u32| b"0123456789abcdef"[(value >> (4 * k)) as usize & 15];
    let mut line = *b"0000000000000000 00000000\n";
    for (slot, k) in line.iter_mut().zip((0..16).rev()) {
        *slot = digit(hash, k);
    }
    for (slot, k) in line.iter_mut().skip(17).zip((0..8).rev()) {
        *slot = digit(poses.into(), k);
    }
    io::stdout()?.write_all(&line)
}
