//! `profile`: where the firmware's instructions go.

use std::process::ExitCode;

use anyhow::Result;
use beamfix_sim::{
    drive::{Settings, drive},
    encoder::ld06::Sensor,
};
use host_tests::board::{Board, profile};
use serde_json::json;

use super::output;

/// Count the library's instructions by function, on an emulated board, over the start of the drive that `card` measures.
///
/// Takes about a minute: the emulator tells every block of instructions that it executes.
#[derive(clap::Args)]
pub struct Args {
    /// m4f or m0.
    #[arg(long, value_name = "NAME", default_value = "m4f")]
    board: String,
    /// So many seconds of the drive.
    #[arg(long, value_name = "S", default_value_t = 5.0)]
    seconds: f64,
    /// By the functions that were compiled; without it inlined code counts for the function that it was written in.
    #[arg(long)]
    compiled: bool,
    /// Print one JSON list.
    #[arg(long)]
    json: bool,
}

/// Builds, runs, reports.
pub fn run(args: &Args) -> Result<ExitCode> {
    let board = Board::named(&args.board)?;
    let settings = Settings {
        seconds: args.seconds,
        ..Settings::DEFAULT
    };
    let bytes = drive(&settings, &mut Sensor::ld06()).bytes;
    let shares = profile::profile(board, &bytes, !args.compiled)?;
    let all: u64 = shares.iter().map(|share| share.instructions).sum();
    let revolutions = args.seconds * 10.0;
    let mut text = format!(
        "{}: {:.0} instructions a revolution, bytes and all, over {} s\n  share  a revolution  function",
        board.name,
        all as f64 / revolutions,
        args.seconds
    );
    for share in shares
        .iter()
        .take_while(|share| share.instructions * 200 > all)
    {
        text += &format!(
            "\n{:5.1} %  {:12.0}  {}",
            100.0 * share.instructions as f64 / all as f64,
            share.instructions as f64 / revolutions,
            share.function
        );
    }
    output::report(args.json, &json!(shares), &text)?;
    Ok(ExitCode::SUCCESS)
}
