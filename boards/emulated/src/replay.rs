//! The application over a recording: commands in, frames out, the cost of every revolution behind its pose.

use beamfix_app::{
    App, link,
    telemetry::{Cost, Reset, Telemetry},
};
use heapless::Vec;
use semihosting::{
    fs::File,
    io::{self, Read as _, Write as _},
};

use crate::{INPUT, Machine, OUTPUT, stack::Stack};

/// Feeds `input.bin` (frames of [`Command`](beamfix_app::command::Command)) to `app` and writes what it sends to
/// `output.bin`.
pub fn run<const N: usize>(
    app: &mut App<N>,
    machine: &mut impl Machine,
    stack: &Stack,
) -> io::Result<()> {
    let mut input = File::open(INPUT)?;
    let mut output = File::create(OUTPUT)?;
    output.write_all(app.ready(Reset::Other))?;
    let mut chunk = [0; 32];
    loop {
        let n = input.read(&mut chunk)?;
        let Some(bytes) = chunk.get(..n).filter(|bytes| !bytes.is_empty()) else {
            return Ok(());
        };
        for &byte in bytes {
            machine.restart();
            let (_, frames) = app.command(&[byte]);
            let instructions = machine.instructions();
            if !frames.is_empty() {
                output.write_all(frames)?;
                write_cost(&mut output, instructions, stack.peak())?;
            }
        }
    }
}

/// Apart, so that its memory is not on the stack during a match.
#[inline(never)]
fn write_cost(output: &mut File, instructions: u32, stack_bytes: u32) -> io::Result<()> {
    let cost = Cost {
        instructions,
        stack_bytes,
    };
    let mut frame = Vec::<u8, 24>::new();
    if link::append(&Telemetry::Cost(cost), &mut frame) {
        output.write_all(&frame)?;
    }
    Ok(())
}
