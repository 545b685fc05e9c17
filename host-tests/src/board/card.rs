//! What a firmware takes: flash, memory, stack, instructions.

use std::{fs, path::Path};

use anyhow::{Context as _, Result, ensure};
use beamfix_app::telemetry::Cost;
use object::{Object as _, ObjectSection as _, SectionFlags, SectionKind};
use serde::{Deserialize, Serialize};

use super::{Board, commands::Commands, emulator::Count, real_card::RealCard, root};
use beamfix_sim::drive::{Settings, drive};
use beamfix_sim::encoder::ld06::Sensor;

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
pub fn drive_commands() -> Commands {
    let settings = Settings {
        seconds: 20.0,
        ..Settings::DEFAULT
    };
    let mut commands = Commands::new();
    commands.lidar(&drive(&settings, &mut Sensor::ld06()).bytes);
    commands
}

/// Measures a board.
pub fn measure(board: &Board, commands: &Commands) -> Result<Card> {
    let (flash_bytes, ram_bytes) = sizes(
        &board.build("")?,
        &[(board.ram_start, board.ram_start + board.ram_bytes)],
    )?;
    let replay = board.replay(commands, Count::Exact)?;
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

/// Makes these the golden figures: `host-tests/golden/card.json`, `boards.json`, and the rows of the README's tables.
pub fn bless(cards: &[Card], boards: &[RealCard]) -> Result<()> {
    keep("card.json", cards)?;
    keep("boards.json", boards)?;
    let mut rows: Vec<(String, String)> = Vec::new();
    rows.extend(
        cards
            .iter()
            .map(|card| (card.board.clone(), card.markdown())),
    );
    rows.extend(
        boards
            .iter()
            .map(|card| (card.board.clone(), card.markdown())),
    );
    let readme = root().join("README.md");
    let mut text = fs::read_to_string(&readme).with_context(|| readme.display().to_string())?;
    for (board, row) in rows {
        let start = format!("| {board} | ");
        let old = text.lines().find(|line| line.starts_with(&start));
        let old = old.with_context(|| format!("README.md has no row of {board}"))?;
        text = text.replace(&old.to_owned(), &row);
    }
    fs::write(&readme, text).with_context(|| readme.display().to_string())
}

/// Writes figures into `host-tests/golden/`.
pub(super) fn keep(name: &str, figures: &(impl Serialize + ?Sized)) -> Result<()> {
    let path = root().join("host-tests/golden").join(name);
    let text = serde_json::to_string_pretty(figures)? + "\n";
    fs::write(&path, text).with_context(|| path.display().to_string())
}

/// Bytes in flash and of statics in RAM, which lies between these addresses.
pub(super) fn sizes(elf: &Path, ram: &[(u64, u64)]) -> Result<(u64, u64)> {
    let bytes = fs::read(elf).with_context(|| elf.display().to_string())?;
    let file = object::File::parse(&*bytes).with_context(|| elf.display().to_string())?;
    let (mut flash, mut statics) = (0, 0);
    for section in file.sections() {
        let name = section.name().unwrap_or_default();
        let SectionFlags::Elf { sh_flags, .. } = section.flags() else {
            continue;
        };
        // What the runtimes leave to the heap and the stack is a section too.
        if sh_flags.0 & object::elf::SHF_ALLOC.0 == 0 || matches!(name, ".heap" | ".stack") {
            continue;
        }
        let kept = !matches!(
            section.kind(),
            SectionKind::UninitializedData | SectionKind::UninitializedTls
        );
        let is_filler = name.ends_with("_dummy") || name.ends_with("_gap");
        if kept {
            flash += section.size();
        }
        let in_ram = |&(start, end): &(u64, u64)| (start..end).contains(&section.address());
        if !is_filler && ram.iter().any(in_ram) {
            statics += section.size();
        }
    }
    Ok((flash, statics))
}

fn rustc_version() -> Result<String> {
    let output = std::process::Command::new("rustc")
        .arg("--version")
        .output()
        .context("rustc could not be started")?;
    let text = String::from_utf8_lossy(&output.stdout);
    Ok(text.split_whitespace().nth(1).unwrap_or("?").into())
}
