//! `replay`: the firmware's pipeline over a recorded log.

mod args;
mod localize;
mod odometry;

use std::process::ExitCode;

use anyhow::{Result, anyhow, bail};
use host_tests::formats::{self, capture};
use host_tests::size;

pub use args::Args;
use args::Mode;

/// Replays the log.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.check()?;
    if args.mode == Mode::Slam {
        bail!("--mode: slam is not built so far");
    }
    let log = match &args.lidar {
        Some(lidar) => capture::log::read(&args.log, lidar)?,
        None => formats::read(&args.log)?,
    };
    let size = match args.tier {
        Some(tier) => tier as usize,
        None => size::fitting(log.scans.iter().map(|scan| &scan.beams[..])),
    };
    match args.mode {
        Mode::Localize => localize::run(args, &log, size)?,
        Mode::Odometry | Mode::Slam => odometry::run(args, &log, size)?,
    }
    if let Some(remarks) = log.remarks() {
        eprintln!("beamfix: {}: {remarks}", args.log.display());
    }
    match &log.cut {
        Some(cut) => Err(anyhow!("{}: {cut}", args.log.display())),
        None => Ok(ExitCode::SUCCESS),
    }
}
