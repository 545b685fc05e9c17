//! `card`: what the firmware takes on each emulated board.

use std::process::ExitCode;

use anyhow::Result;
use beamfix::lidar::Model;
use host_tests::board::{
    BOARDS, Board,
    card::{self, Card},
    drivers,
};

use super::output;

/// Flash, memory, stack and instructions of the firmware on the emulated boards, and of each lidar's driver on the
/// Cortex-M0.
///
/// The tests compare them with `host-tests/golden/card.json`.
#[derive(clap::Args)]
pub struct Args {
    /// Only this one: m4f, m0 or rv32.
    #[arg(long, value_name = "NAME")]
    board: Option<String>,
    /// Write the figures to `host-tests/golden/card.json` and into the README's table.
    #[arg(long, conflicts_with = "board")]
    bless: bool,
    /// Print one JSON list.
    #[arg(long)]
    json: bool,
}

/// Builds, runs, reports.
pub fn run(args: &Args) -> Result<ExitCode> {
    let recording = card::recording();
    let boards: Vec<&Board> = match &args.board {
        Some(name) => vec![Board::named(name)?],
        None => BOARDS.iter().collect(),
    };
    // Drivers are measured on the smallest core.
    let with_drivers = boards.iter().any(|board| board.name == "m0");
    let models = if with_drivers { Model::ALL.len() } else { 0 };
    let bar = output::progress(boards.len() + models, "boards");
    let mut cards = Vec::new();
    for board in boards {
        cards.push(card::measure(board, &recording)?);
        bar.inc(1);
    }
    let drivers = match with_drivers {
        true => drivers::measure_all(|| bar.inc(1))?,
        false => Vec::new(),
    };
    bar.finish_and_clear();
    if args.bless {
        card::bless(&cards)?;
    }
    let mut value = serde_json::to_value(&cards)?;
    for row in value.as_array_mut().into_iter().flatten() {
        if row["board"] == "m0" {
            row["drivers"] = serde_json::to_value(&drivers)?;
        }
    }
    let json = serde_json::to_string_pretty(&value)?;
    let text = if args.json {
        json
    } else {
        text(&cards, &drivers)
    };
    output::report(false, &value, &text)?;
    Ok(ExitCode::SUCCESS)
}

fn text(cards: &[Card], drivers: &[drivers::Cost]) -> String {
    match drivers {
        [] => table(cards),
        _ => table(cards) + "\n\n" + &drivers::table(drivers),
    }
}

fn table(cards: &[Card]) -> String {
    let mut text = String::from(
        "board  flash B  RAM B  stack B  instructions per revolution: median, most   configuration",
    );
    for card in cards {
        text += &format!(
            "\n{:<5} {:>8} {:>6} {:>8} {:>37} {:>8}   {} (rustc {})",
            card.board,
            card.flash_bytes,
            card.ram_bytes,
            card.stack_bytes,
            card.instructions,
            card.instructions_max,
            card.configuration,
            card.rustc,
        );
    }
    text
}
