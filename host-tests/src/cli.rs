//! The command line: what it takes, how it ends.

mod bench;
mod card;
mod decode;
mod field;
mod learn;
mod lidars;
mod live;
mod output;
mod pairs;
mod particles;
mod prior;
mod profile;
mod prune;
mod regress;
mod replay;
mod scenes;
mod simulate;
mod teach;
mod tune;
mod verify;
mod watch;
mod worlds;

use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

/// From a lidar's bytes to a pose: simulate, replay, match, decode, verify.
///
/// Without a subcommand: simulate.
#[derive(Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
struct Tool {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    simulate: simulate::Args,
}

#[derive(Subcommand)]
enum Command {
    Simulate(simulate::Args),
    Regress(regress::Args),
    Replay(replay::Args),
    Pairs(pairs::Args),
    Particles(particles::Args),
    Decode(decode::Args),
    Field(field::Args),
    Learn(learn::Args),
    Lidars(lidars::Args),
    Live(live::Args),
    Bench(bench::Args),
    Profile(profile::Args),
    Card(card::Args),
    Prune(prune::Args),
    Scenes(scenes::Args),
    Worlds(worlds::Args),
    Teach(teach::Args),
    Tune(tune::Args),
    Verify(verify::Args),
    Watch(watch::Args),
}

/// Exit status of a run that could not do its work: a bad file, a bad setting.
const FAILED: u8 = 2;

/// Does what the command line says.
pub fn run() -> ExitCode {
    let tool = Tool::parse();
    let done: Result<ExitCode> = match tool.command {
        Some(Command::Decode(args)) => decode::run(&args),
        Some(Command::Field(args)) => field::run(&args),
        Some(Command::Learn(args)) => learn::run(&args),
        Some(Command::Lidars(args)) => lidars::run(&args),
        Some(Command::Live(args)) => live::run(&args),
        Some(Command::Regress(args)) => regress::run(&args),
        Some(Command::Replay(args)) => replay::run(&args),
        Some(Command::Pairs(args)) => pairs::run(&args),
        Some(Command::Particles(args)) => particles::run(&args),
        Some(Command::Bench(args)) => bench::run(&args),
        Some(Command::Profile(args)) => profile::run(&args),
        Some(Command::Card(args)) => card::run(&args),
        Some(Command::Prune(args)) => prune::run(&args),
        Some(Command::Scenes(args)) => scenes::run(&args),
        Some(Command::Worlds(args)) => worlds::run(&args),
        Some(Command::Teach(args)) => teach::run(&args),
        Some(Command::Tune(args)) => tune::run(&args),
        Some(Command::Verify(args)) => verify::run(&args),
        Some(Command::Watch(args)) => watch::run(&args),
        Some(Command::Simulate(args)) => simulate::run(&args),
        None => simulate::run(&tool.simulate),
    };
    done.unwrap_or_else(|error| {
        eprintln!("beamfix: {error:#}");
        ExitCode::from(FAILED)
    })
}
