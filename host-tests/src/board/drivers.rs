//! What a lidar's driver costs on a board: instructions a byte, memory.

use anyhow::{Result, ensure};
use beamfix::lidar::{Model, Packet, Protocol};

use super::{Board, Count, emulator};
use crate::decode::{WithParser, with_parser};
use crate::encoder::{self, Echo};

/// What a driver costs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Instructions a byte, from the line to the beams.
    pub per_byte: f64,
    /// Bytes of the parser.
    pub parser_bytes: u32,
    /// Bytes of a packet.
    pub packet_bytes: u32,
    /// Deepest stack of the measuring program, parser and packets included (bytes).
    pub stack_bytes: u32,
    /// Bytes a second that the sensor sends.
    pub bytes_per_s: f64,
}

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
pub fn measure(board: &Board, model: &Model) -> Result<Cost> {
    let elf = board.build("drivers")?;
    let (line, bytes_per_s) = stream(model);
    let place = Model::ALL.iter().position(|other| other.name == model.name);
    let mut input = vec![place.unwrap_or(0) as u8];
    input.extend(&line);
    let output = emulator::run(board, &elf, &input, Count::Exact)?;
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
        per_byte: f64::from(numbers[2]) / line.len() as f64,
        parser_bytes: numbers[4],
        packet_bytes: numbers[5],
        stack_bytes: numbers[6],
        bytes_per_s,
    })
}
