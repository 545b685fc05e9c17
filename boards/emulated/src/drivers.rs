//! What a lidar's driver costs: bytes to beams, without the matcher.
//!
//! `input.bin`: a byte that chooses the driver (its place in [`Model::ALL`]), then the sensor's bytes. `output.bin`:
//! `u32` each of bytes, beams, instructions, a checksum of all beams, bytes of the parser, bytes of a packet, stack.

use beamfix::lidar::{
    Model, Packet as _, Protocol,
    choice::{WithParser, with_parser},
};
use semihosting::{
    fs::File,
    io::{self, Read as _, Write as _},
};

use crate::{INPUT, Machine, OUTPUT, stack::Stack};

/// Runs the driver over the file.
pub fn run(machine: &mut impl Machine, stack: &Stack) -> io::Result<()> {
    let mut input = File::open(INPUT)?;
    let mut choice = [0];
    input.read(&mut choice)?;
    let model = Model::ALL
        .get(usize::from(choice[0]))
        .unwrap_or(&Model::LDROBOT_LD06);
    let cost = with_parser(model, Driving { input, machine })?;
    let mut output = File::create(OUTPUT)?;
    for number in cost.into_iter().chain([stack.peak()]) {
        output.write_all(&number.to_le_bytes())?;
    }
    Ok(())
}

/// A driver over the rest of the file.
struct Driving<'a, M> {
    input: File,
    machine: &'a mut M,
}

impl<M: Machine> WithParser for Driving<'_, M> {
    type Output = io::Result<[u32; 6]>;

    fn run<P: Protocol>(self, parser: P) -> Self::Output {
        drive(parser, self.input, self.machine)
    }
}

#[inline(never)]
fn drive<P: Protocol>(
    mut parser: P,
    mut input: File,
    machine: &mut impl Machine,
) -> io::Result<[u32; 6]> {
    let (mut bytes, mut beams, mut instructions, mut checksum) = (0, 0, 0, 0u32);
    let mut piece = [0; 128];
    loop {
        let count = input.read(&mut piece)?;
        let Some(piece) = piece.get(..count).filter(|piece| !piece.is_empty()) else {
            break;
        };
        machine.restart();
        for &byte in piece {
            if let Some(packet) = parser.push(byte) {
                for beam in packet.beams() {
                    let word =
                        u32::from(beam.bearing.0) << 16 | u32::from(beam.range.mm().unwrap_or(0));
                    checksum = checksum.rotate_left(1) ^ word ^ beam.time_us;
                    beams += 1;
                }
            }
        }
        instructions += machine.instructions();
        bytes += count as u32;
    }
    let sizes = [size_of::<P>() as u32, size_of::<P::Packet>() as u32];
    Ok([bytes, beams, instructions, checksum, sizes[0], sizes[1]])
}
