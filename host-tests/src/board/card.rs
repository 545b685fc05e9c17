//! What a firmware takes: flash, memory, stack, instructions.

use std::{fs, path::Path};

use anyhow::{Context as _, Result, ensure};
use beamfix_app::telemetry::Cost;
use object::{Object as _, ObjectSection as _, SectionKind};
use serde::{Deserialize, Serialize};

use super::{Board, emulator::Count, recording::Recording, root};
use crate::{
    encoder::ld06::Sensor,
    sim::drive::{Settings, drive},
};

/// One row: a board with the application.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Card {
    /// As the command line has it.
    pub board: String,
    /// What runs.
    pub configuration: String,
    /// Code, tables and what the memory is filled with at the start (bytes).
    pub flash_bytes: u64,
    /// Statics (bytes).
    pub ram_bytes: u64,
    /// Deepest stack over the simulated drive (bytes).
    pub stack_bytes: u64,
    /// From the byte that completes a revolution to its pose: median over the drive.
    pub instructions: u64,
    /// The same: the worst.
    pub instructions_max: u64,
    /// The compiler, on whose version the figures depend a little.
    pub rustc: String,
}

impl Card {
    /// A row of the README's table.
    #[must_use]
    pub fn markdown(&self) -> String {
        format!(
            "| {} | {} | {} | {} | {} | {} |",
            self.board,
            self.flash_bytes,
            self.ram_bytes,
            self.stack_bytes,
            self.instructions,
            self.instructions_max
        )
    }
}

/// The drive that the cards are measured over: the first 20 s through the simulated flat.
#[must_use]
pub fn recording() -> Recording {
    let settings = Settings {
        seconds: 20.0,
        ..Settings::DEFAULT
    };
    let mut recording = Recording::new();
    recording.lidar(&drive(&settings, &mut Sensor::ld06()).bytes);
    recording
}

/// Measures a board.
pub fn measure(board: &Board, recording: &Recording) -> Result<Card> {
    let (flash_bytes, ram_bytes) = sizes(&board.build("")?, board.ram_start)?;
    let replay = board.replay(recording, Count::Exact)?;
    let stack_bytes = replay.costs.iter().map(|cost| cost.stack_bytes).max();
    let mut instructions: Vec<u32> = replay
        .costs
        .iter()
        // The first revolution has nothing to be matched against.
        .skip(1)
        .map(|&Cost { instructions, .. }| instructions)
        .collect();
    instructions.sort_unstable();
    let (Some(stack_bytes), Some(&worst)) = (stack_bytes, instructions.last()) else {
        anyhow::bail!("{}: no pose came back", board.name);
    };
    ensure!(
        ram_bytes + u64::from(stack_bytes) < board.ram_bytes,
        "{}: {ram_bytes} bytes of statics and {stack_bytes} of stack are more than the {} there are",
        board.name,
        board.ram_bytes
    );
    Ok(Card {
        board: board.name.into(),
        configuration: format!("LD06, odometry, {} beams", board.beams),
        flash_bytes,
        ram_bytes,
        stack_bytes: stack_bytes.into(),
        instructions: instructions[instructions.len() / 2].into(),
        instructions_max: worst.into(),
        rustc: rustc_version()?,
    })
}

/// Makes these the golden figures: `host-tests/golden/card.json` and the rows of the README's table.
pub fn bless(cards: &[Card]) -> Result<()> {
    let golden = root().join("host-tests/golden/card.json");
    fs::write(&golden, serde_json::to_string_pretty(cards)? + "\n")
        .with_context(|| golden.display().to_string())?;
    let readme = root().join("README.md");
    let text = fs::read_to_string(&readme).with_context(|| readme.display().to_string())?;
    let is_row = |line: &&str| {
        cards
            .iter()
            .any(|card| line.starts_with(&format!("| {} | ", card.board)))
    };
    let rows = text.lines().filter(is_row).count();
    ensure!(
        rows == cards.len(),
        "README.md has {rows} rows of the cost table, not {}",
        cards.len()
    );
    let mut new = cards.iter().map(Card::markdown);
    let lines = text.lines().map(|line| {
        let row = if is_row(&line) { new.next() } else { None };
        row.unwrap_or_else(|| line.into())
    });
    let text: Vec<String> = lines.collect();
    fs::write(&readme, text.join("\n") + "\n").with_context(|| readme.display().to_string())
}

/// Bytes in flash and of statics in RAM.
fn sizes(elf: &Path, ram_start: u64) -> Result<(u64, u64)> {
    let bytes = fs::read(elf).with_context(|| elf.display().to_string())?;
    let file = object::File::parse(&*bytes).with_context(|| elf.display().to_string())?;
    let (mut flash, mut ram) = (0, 0);
    for section in file.sections() {
        let name = section.name().unwrap_or_default();
        let kept = !matches!(
            section.kind(),
            SectionKind::UninitializedData | SectionKind::UninitializedTls
        );
        let loaded = section.address() != 0 || name == ".vector_table";
        // What the runtimes leave to the heap and the stack is a section too.
        if !loaded || matches!(name, ".heap" | ".stack") || name.starts_with(".debug") {
            continue;
        }
        if kept {
            flash += section.size();
        }
        if section.address() >= ram_start {
            ram += section.size();
        }
    }
    Ok((flash, ram))
}

fn rustc_version() -> Result<String> {
    let output = std::process::Command::new("rustc")
        .arg("--version")
        .output()
        .context("rustc could not be started")?;
    let text = String::from_utf8_lossy(&output.stdout);
    Ok(text.split_whitespace().nth(1).unwrap_or("?").into())
}
