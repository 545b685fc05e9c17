//! What a lidar's driver costs on a board: instructions a byte, memory.

use std::path::Path;

use anyhow::{Result, ensure};
use beamfix::lidar::{Model, Packet, Protocol};
use serde::Serialize;

use super::{Board, Count, emulator};
use crate::decode::{WithParser, with_parser};
use beamfix_sim::encoder::{self, Echo};

/// What a driver costs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cost {
    /// The sensor.
    pub lidar: &'static str,
    /// Bits a second of its line.
    pub baud: u32,
    /// Instructions a byte, from the line to the beams.
    pub instructions_per_byte: f64,
    /// Bytes of the parser.
    pub parser_bytes: u32,
    /// Bytes of a packet.
    pub packet_bytes: u32,
    /// Deepest stack of the measuring program, parser and packets included (bytes).
    pub stack_bytes: u32,
    /// Bytes a second that the sensor sends.
    pub bytes_per_s: f64,
}

impl Cost {
    /// Share (percent) of a core of `mhz` that the sensor's bytes take, in instructions.
    #[must_use]
    pub fn share(&self, mhz: f64) -> f64 {
        self.instructions_per_byte * self.bytes_per_s / (mhz * 1e4)
    }

    /// The same of a line without any pause.
    #[must_use]
    pub fn full_line_share(&self, mhz: f64) -> f64 {
        self.instructions_per_byte * f64::from(self.baud) / 10.0 / (mhz * 1e4)
    }
}

/// Every model's driver on the Cortex-M0.
pub fn measure_all(mut each: impl FnMut()) -> Result<Vec<Cost>> {
    let board = Board::named("m0")?;
    let elf = board.build("drivers")?;
    let mut costs = Vec::new();
    for model in Model::ALL {
        costs.push(measure(board, &elf, model)?);
        each();
    }
    Ok(costs)
}

/// The costs as a table, and what is promised of two of them.
#[must_use]
pub fn table(costs: &[Cost]) -> String {
    let mut text = String::from(
        "driver, on the Cortex-M0  parser B  packet B  stack B  instructions a byte  of 48 MHz as sent, on a full line",
    );
    for cost in costs {
        text += &format!(
            "\n{:<25} {:>8} {:>9} {:>8} {:>20.1} {:>18.1} % {:>12.1} %",
            cost.lidar,
            cost.parser_bytes,
            cost.packet_bytes,
            cost.stack_bytes,
            cost.instructions_per_byte,
            cost.share(48.0),
            cost.full_line_share(48.0),
        );
    }
    for (lidar, mhz, core, bar) in PROMISES {
        if let Some(cost) = costs.iter().find(|cost| cost.lidar == lidar) {
            let share = cost.full_line_share(mhz);
            text += &format!(
                "\n{lidar} on a full line at {} baud: {share:.1} % of a {core} at {mhz} MHz in instructions, \
                 {:.1} % in cycles at 1.5 a piece (at most {bar} %)",
                cost.baud,
                share * 1.5
            );
        }
    }
    text
}

/// Whose full line may take at most so many percent of which core: name, MHz, core, percent.
pub const PROMISES: [(&str, f64, &str, f64); 2] = [
    ("ld06", 48.0, "Cortex-M0", 5.0),
    ("rplidar-dense", 133.0, "Cortex-M0+", 15.0),
];

/// Half a second of a sensor's bytes, and how many it sends a second.
fn stream(model: &Model) -> (Vec<u8>, f64) {
    let mut sensor = encoder::for_model(model);
    let mut line = Vec::new();
    while sensor.next_time_us() < 5e5 {
        let mut look = |_: f64, bearing: f64| {
            let range_mm = 1500.0 + 700.0 * (2.0 * bearing).sin();
            (bearing.sin() < 0.97).then_some(Echo {
                range_mm,
                intensity: 100,
            })
        };
        sensor.fire(&mut look, &mut line);
    }
    let per_s = line.len() as f64 / (sensor.next_time_us() * 1e-6);
    (line, per_s)
}

/// The same checksum of all beams as on the board, here.
struct Checksum<'a>(&'a [u8]);

impl WithParser for Checksum<'_> {
    type Output = (u32, u32);

    fn run<P: Protocol>(self, mut parser: P) -> (u32, u32) {
        let (mut beams, mut checksum) = (0, 0u32);
        for packet in self.0.iter().filter_map(|&byte| parser.push(byte)) {
            for beam in packet.beams() {
                let range = u32::from(beam.range.mm().unwrap_or(0));
                let word = u32::from(beam.bearing.0) << 16 | range;
                checksum = checksum.rotate_left(1) ^ word ^ beam.time_us;
                beams += 1;
            }
        }
        (beams, checksum)
    }
}

/// Runs the driver of `model` on `board`; fails where its beams differ from those found here.
fn measure(board: &Board, elf: &Path, model: &'static Model) -> Result<Cost> {
    let (line, bytes_per_s) = stream(model);
    let place = Model::ALL.iter().position(|other| other.name == model.name);
    let mut input = vec![place.unwrap_or(0) as u8];
    input.extend(&line);
    let output = emulator::run(board, elf, &input, Count::Exact)?;
    let (words, _) = output.as_chunks::<4>();
    let numbers: Vec<u32> = words.iter().map(|word| u32::from_le_bytes(*word)).collect();
    ensure!(
        numbers.len() == 7,
        "{}: {} numbers",
        model.name,
        numbers.len()
    );
    let here = with_parser(model, Checksum(&line));
    ensure!(
        numbers[0] as usize == line.len() && (numbers[1], numbers[3]) == here,
        "{}: {} beams differ from the {} found here",
        model.name,
        numbers[1],
        here.0
    );
    Ok(Cost {
        lidar: model.name,
        baud: model.baud,
        instructions_per_byte: f64::from(numbers[2]) / line.len() as f64,
        parser_bytes: numbers[4],
        packet_bytes: numbers[5],
        stack_bytes: numbers[6],
        bytes_per_s,
    })
}
