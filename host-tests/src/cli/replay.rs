//! `replay`: the firmware's pipeline over a recorded log.

mod args;
mod localize;
mod odometry;

use std::process::ExitCode;

use anyhow::{Result, anyhow, bail};
use beamfix::geometry::Pose;
use beamfix::scan::Mount;
use host_tests::formats::{self, Log};
use host_tests::size;

use super::prior::Prior;
pub use args::Args;
use args::Mode;

/// Replays the log.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.check()?;
    if args.mode == Mode::Slam {
        bail!("--mode: slam is not built so far");
    }
    let log = formats::read_with(&args.log, &args.options())?;
    eprintln!("beamfix: {}: {}", args.log.display(), taken(args, &log));
    // The log alone decides the poses; the tier only whether there is room.
    let directions = size::fitting(log.scans.iter().map(|scan| &scan.beams[..]));
    let size = args.tier.map_or(directions, |tier| tier as usize);
    match args.mode {
        Mode::Localize => localize::run(args, &log, size)?,
        Mode::Odometry | Mode::Slam => odometry::run(args, &log, (size, directions))?,
    }
    if let Some(remarks) = log.remarks() {
        eprintln!("beamfix: {}: {remarks}", args.log.display());
    }
    match &log.cut {
        Some(cut) => Err(anyhow!("{}: {cut}", args.log.display())),
        None => Ok(ExitCode::SUCCESS),
    }
}

/// What is replayed and with which prior and mount, in one line.
fn taken(args: &Args, log: &Log) -> String {
    let has_wheels = log.scans.iter().any(|scan| scan.wheels.is_some());
    let prior = match args.prior {
        Prior::Odometry if has_wheels => "the wheels",
        Prior::Odometry => "the last velocity (no wheels in it)",
        Prior::None => "the last velocity",
    };
    let Mount {
        robot_from_lidar: Pose { x, y, theta },
        upside_down,
    } = args.mount_of(log);
    let whose = match (args.mount.is_some(), log.is_mount_told) {
        (true, _) => "as told",
        (false, true) => "by the log",
        (false, false) => "not in the log: --mount tells it",
    };
    format!(
        "{}; prior: {prior}; mount {x:.3},{y:.3},{:.1}{} ({whose})",
        log.source,
        theta.to_degrees(),
        if upside_down { ",down" } else { "" },
    )
}
