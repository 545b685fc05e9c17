//! What a byte of the lidar costs the firmware besides matches, on the emulated Cortex-M0.

use anyhow::{Result, ensure};

use super::{Board, Count, emulator};
use beamfix_sim::drive::{Settings, drive};
use beamfix_sim::encoder::ld06::Sensor;

/// How many bytes come in at a time, and the most instructions a byte that are promised: an ESP32 or embassy gives 32 and more, a
/// Pico's UART half of its buffer. One by one nothing is promised.
pub const MOST: [(u8, f64); 3] = [(32, 150.0), (16, 160.0), (1, f64::INFINITY)];

/// Instructions a byte, from the interrupt to the frames, sleep and the supervisor's looks included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Bytes that come in at a time.
    pub piece: u8,
    /// Instructions a byte.
    pub instructions: f64,
}

/// By pieces of each length of [`MOST`].
pub fn measure() -> Result<Vec<Cost>> {
    let board = Board::named("m0")?;
    let elf = board.build("bytes")?;
    let settings = Settings {
        seconds: 5.0,
        ..Settings::DEFAULT
    };
    let line = drive(&settings, &mut Sensor::ld06()).bytes;
    let measure = |piece: u8| {
        let input = [&[piece][..], &line].concat();
        let output = emulator::run(board, &elf, &input, Count::Exact)?;
        let (words, _) = output.as_chunks::<4>();
        let [bytes, instructions, frames] = words else {
            anyhow::bail!("{} numbers", words.len());
        };
        let [bytes, instructions, frames] =
            [bytes, instructions, frames].map(|word| u32::from_le_bytes(*word));
        ensure!(
            bytes as usize == line.len() && frames > 45,
            "{bytes} of {} bytes were taken, {frames} frames came",
            line.len()
        );
        Ok(Cost {
            piece,
            instructions: f64::from(instructions) / f64::from(bytes),
        })
    };
    MOST.iter().map(|&(piece, _)| measure(piece)).collect()
}

/// The costs in a line.
#[must_use]
pub fn text(costs: &[Cost]) -> String {
    let costs: Vec<String> = costs
        .iter()
        .zip(MOST)
        .map(|(cost, (_, most))| match most.is_finite() {
            true => format!(
                "{:.0} by pieces of {} (at most {most:.0})",
                cost.instructions, cost.piece
            ),
            false => format!("{:.0} one by one", cost.instructions),
        })
        .collect();
    format!(
        "firmware besides matches, on the Cortex-M0: instructions a byte of an LD06: {}",
        costs.join(", ")
    )
}
