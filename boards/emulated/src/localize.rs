//! The application in a map that is linked into the program, over a lidar's bytes.
//!
//! `input.bin`: what came over the lidar's line. `output.bin`: what the application sends. The table is what the environment variable
//! `BEAMFIX_FIELD` named when the program was built.

use beamfix_app::{BEAMS, Lidar, Row, map::LocalizationWith, telemetry::Reset};
use semihosting::{
    eprintln,
    fs::File,
    io::{self, Read as _, Write as _},
};

use crate::{INPUT, OUTPUT};

/// The lidar: an LD06.
type Ld06 = Row<0>;
/// What the board runs.
type Robot = LocalizationWith<Ld06, BEAMS>;
/// Bytes of the map that one call of a search looks up, about.
const WORK: u32 = 500_000;
/// Most bytes of the map's maxima: those of a map of 20 m by 16 m in cells of 5 cm have room.
const MAXIMA: usize = 9000;
/// Bytes that are taken at a time.
const PIECE: usize = 32;

/// The memory that it needs.
pub struct Localize {
    robot: Option<Robot>,
    maxima: [u8; MAXIMA],
}

impl Localize {
    /// Nothing there yet.
    #[allow(clippy::new_without_default, reason = "for statics")]
    pub const fn new() -> Self {
        Self {
            robot: None,
            maxima: [0; MAXIMA],
        }
    }

    /// Tells the poses of the bytes of `input.bin` in the map of `table`.
    pub fn run(&'static mut self, table: &'static [u8]) -> io::Result<()> {
        let mut input = File::open(INPUT)?;
        let mut output = File::create(OUTPUT)?;
        let Ok(robot) = Robot::in_map(&Ld06::CONFIG, Ld06::PARSER, table, &mut self.maxima) else {
            eprintln!("no table, or a map with more than {MAXIMA} maxima: BEAMFIX_FIELD names it");
            semihosting::process::exit(1)
        };
        let robot = self.robot.insert(robot);
        output.write_all(robot.ready(Reset::Other))?;
        let mut bytes = [0; PIECE];
        loop {
            let count = input.read(&mut bytes)?;
            let mut rest = bytes.get(..count).unwrap_or_default();
            if rest.is_empty() {
                return Ok(());
            }
            while !rest.is_empty() {
                let (taken, sent) = robot.lidar(rest);
                rest = rest.get(taken..).unwrap_or_default();
                if !sent.is_empty() {
                    output.write_all(sent)?;
                    while !robot.work(WORK) {}
                }
            }
        }
    }
}
