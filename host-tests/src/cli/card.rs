//! `card`: what the firmware takes on each emulated board.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Result, bail};
use beamfix::lidar::Model;
use host_tests::board::{
    BOARDS, Board, SMALL, bytes,
    card::{self, Card},
    drivers, maps,
    real::{REAL, Real},
    real_card::RealCard,
    slam,
};
use host_tests::formats;
use host_tests::mapping::{Tier, building};

use super::output;

/// Flash, memory, stack and instructions of the firmware on the emulated boards, what that means for the real ones, and
/// what each lidar's driver takes on the Cortex-M0 and what matching against maps takes.
///
/// Instructions of a real board are those of its core as emulated, cycles a model; its flash and statics are its own.
/// The tests compare them with `host-tests/golden/card.json`.
#[derive(clap::Args)]
pub struct Args {
    /// Only this one: m4f, m0, rv32, m0z (the Cortex-M0, built for size), or a real board.
    #[arg(long, value_name = "NAME")]
    board: Option<String>,
    /// Write the figures to `host-tests/golden/card.json` and into the README's table.
    #[arg(long, conflicts_with = "board")]
    bless: bool,
    /// Mapping instead, on the emulated Cortex-M4F with just this RAM: a simulated building, twice round.
    #[arg(long, value_name = "TIER", value_parser = tier, conflicts_with_all = ["board", "bless", "json"])]
    tier: Option<Tier>,
    /// Map this recorded log instead.
    #[arg(long, value_name = "FILE", requires = "tier")]
    log: Option<PathBuf>,
    /// Stop after so many scans.
    #[arg(long, value_name = "N", requires = "tier")]
    scans: Option<usize>,
    /// Print one JSON list.
    #[arg(long)]
    json: bool,
}

fn tier(name: &str) -> Result<Tier> {
    match name {
        "64k" => Ok(Tier::Of64k),
        "192k" => Ok(Tier::Of192k),
        "512k" => Ok(Tier::Of512k),
        _ => bail!("64k, 192k or 512k"),
    }
}

/// What mapping costs.
fn mapping(args: &Args, tier: Tier) -> Result<ExitCode> {
    let (name, log) = match &args.log {
        Some(path) => (path.display().to_string(), formats::read(path)?),
        None => ("a simulated building".to_owned(), building::log(2, 1).0),
    };
    let costs = slam::measure(tier, &log, args.scans.unwrap_or(usize::MAX))?;
    println!("{}", costs.text(&name));
    Ok(ExitCode::SUCCESS)
}

/// Builds, runs, reports.
pub fn run(args: &Args) -> Result<ExitCode> {
    if let Some(tier) = args.tier {
        return mapping(args, tier);
    }
    let commands = card::drive_commands();
    let only = args.board.as_deref();
    let real: Vec<&Real> = match only {
        Some(name) => Real::named(name).into_iter().collect(),
        None => REAL.iter().collect(),
    };
    let boards: Vec<&Board> = match (only, &real[..]) {
        (Some(_), [real]) => vec![Board::named(real.emulated)?],
        (Some(name), _) => vec![Board::named(name)?],
        (None, _) => BOARDS.iter().chain([&SMALL]).collect(),
    };
    // Drivers are measured on the smallest core.
    let with_drivers = only.is_none_or(|name| name == "m0");
    let models = if with_drivers { Model::ALL.len() } else { 0 };
    let bar = output::progress(boards.len() + real.len() + models, "boards");
    let mut cards = Vec::new();
    for board in &boards {
        cards.push(card::measure(board, &commands)?);
        bar.inc(1);
    }
    let mut real_cards = Vec::new();
    for real in real {
        let core = cards.iter().find(|card| card.board == real.emulated);
        real_cards.extend(core.map(|core| real.measure(core)).transpose()?);
        bar.inc(1);
    }
    let bytes = match with_drivers {
        true => bytes::measure()?,
        false => Vec::new(),
    };
    let drivers = match with_drivers {
        true => drivers::measure_all(|| bar.inc(1))?,
        false => Vec::new(),
    };
    // What matching against maps takes is measured as it is built to be fast.
    let fast: Vec<&Board> = (boards.iter().copied())
        .filter(|board| board.name != SMALL.name)
        .collect();
    let maps = maps::measure(&fast)?;
    bar.finish_and_clear();
    if args.bless {
        card::bless(&cards, &real_cards)?;
        maps.bless()?;
    }
    let mut value = serde_json::to_value(&cards)?;
    for row in value.as_array_mut().into_iter().flatten() {
        if row["board"] == "m0" {
            row["drivers"] = serde_json::to_value(&drivers)?;
            for cost in &bytes {
                row[format!("instructions_per_byte_by_{}", cost.piece)] = cost.instructions.into();
            }
        }
        let board = row["board"].clone();
        for costs in maps.fields.iter().filter(|costs| board == costs.board) {
            row["fields"] = serde_json::to_value(costs)?;
        }
        for costs in maps.starts.iter().filter(|costs| board == costs.board) {
            row["start"] = serde_json::to_value(costs)?;
        }
    }
    if let (Some(rows), Some(more)) = (
        value.as_array_mut(),
        serde_json::to_value(&real_cards)?.as_array_mut(),
    ) {
        rows.append(more);
    }
    let json = serde_json::to_string_pretty(&value)?;
    let text = if args.json {
        json
    } else {
        text(&cards, &real_cards, (&bytes, &drivers), &maps)
    };
    output::report(false, &value, &text)?;
    Ok(ExitCode::SUCCESS)
}

fn text(
    cards: &[Card],
    real: &[RealCard],
    (bytes, drivers): (&[bytes::Cost], &[drivers::Cost]),
    maps: &maps::Card,
) -> String {
    let mut text = table(cards);
    if !real.is_empty() {
        text += "\n\n";
        text += &real_table(real);
    }
    if !bytes.is_empty() {
        text += "\n\n";
        text += &bytes::text(bytes);
    }
    if !drivers.is_empty() {
        text += "\n\n";
        text += &drivers::table(drivers);
    }
    text += "\n\n";
    text += &maps.table();
    text
}

fn real_table(cards: &[RealCard]) -> String {
    let mut text = String::from(
        "board         clock MHz     flash KB        RAM KB  stack B  core at 10 Hz  longest match  good enough",
    );
    for card in cards {
        text += &format!(
            "\n{:<13} {:>9} {:>4} of {:>5} {:>5.1} of {:>4} {:>8} {:>12.1} % {:>11.1} ms  {}",
            card.board,
            card.clock_mhz,
            card.flash_bytes >> 10,
            card.flash_of >> 10,
            card.ram_bytes as f64 / 1024.0,
            card.ram_of >> 10,
            card.stack_bytes,
            card.share_percent,
            card.longest_ms,
            card.verdict.word(),
        );
    }
    text
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
