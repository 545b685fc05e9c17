//! `replay`: the firmware's pipeline over a recorded log.

mod args;
mod localize;
mod odometry;
mod slam;

use std::process::ExitCode;

use anyhow::{Result, bail};
use beamfix::geometry::Pose;
use beamfix::scan::Mount;
use host_tests::formats::{self, Log};
use host_tests::size;
use serde_json::{Value, json};

use super::output;
use super::prior::Prior;
pub use args::Args;
use args::{Mode, Tier};

/// Replays the log.
pub fn run(args: &Args) -> Result<ExitCode> {
    args.check()?;
    let inside = |name: &str| args.out.as_ref().map(|folder| folder.join(name));
    let recorded = ["run.mcap", "bag/run_0.mcap", "seen.yaml", "seen.pgm"].map(inside);
    let pictures = args.picture.iter().map(|path| Some(path.as_path()));
    let written: Vec<_> = recorded
        .iter()
        .map(Option::as_deref)
        .chain([args.trajectory.as_deref()])
        .chain(pictures)
        .collect();
    let map = args.map.as_deref().unwrap_or(&args.log);
    output::spare(&[&args.log, map], &written)?;
    let mut log = formats::read_with(&args.log, &args.options())?;
    // The log alone decides the poses; the tier only whether there is room.
    let directions = size::fitting(log.scans.iter().map(|scan| &scan.beams[..]));
    let size = args.tier.map_or(directions, |tier| tier as usize);
    let thinned = log.thin(size);
    if thinned > 0 {
        output::remark(&[format!(
            "{thinned} beams of scans with more than {size} are left out, evenly over the directions"
        )]);
    }
    let done = match args.mode {
        Mode::Localize => localize::run(args, &log, size)?,
        Mode::Odometry => odometry::run(args, &log, (size, directions))?,
        Mode::Slam if args.tier == Some(Tier::Middle) => {
            odometry::run_rolling(args, &log, directions)?
        }
        Mode::Slam => slam::run(args, &log, directions)?,
    };
    let name = args.log.display();
    output::remark(&[format!("{name}: {}", taken(args, &log))]);
    if let Some(remarks) = log.remarks() {
        output::remark(&[format!("{name}: {remarks}")]);
    }
    if let Some(cut) = &log.cut {
        bail!("{name}: {cut}");
    }
    if done.measured == 0 {
        bail!("{name}: {}", done.why_nothing(&log));
    }
    if let Some(guesses) = done.guesses() {
        output::remark(&[format!("{name}: {guesses}")]);
    }
    Ok(ExitCode::SUCCESS)
}

/// How many poses of a replay are measured.
struct Done {
    scans: usize,
    /// Poses that a match confirms, and the first reference's.
    measured: usize,
    /// Scans that became a reference; `None` where a map is the reference.
    references: Option<u32>,
    /// Candidates for a place in a map where they agreed best with a scan, and how well (a share of its beams).
    candidates: Option<(u8, f32)>,
}

impl Done {
    /// Why no pose is measured.
    fn why_nothing(&self, log: &Log) -> String {
        let (scans, most) = (self.scans, log.most_ranges());
        match self.references {
            _ if most == 0 => format!(
                "no pose: no beam of {scans} scans has a range; the lidar is covered or blind, or the file marks all as no return"
            ),
            Some(0) => format!(
                "no pose: none of {scans} scans became a reference; at most {most} beams of one have a range"
            ),
            Some(_) => format!("no pose: none of {scans} scans matches the first"),
            None => {
                let why = match self.candidates {
                    None => "no place fits".to_owned(),
                    Some((count, best)) => format!(
                        "of {count} places the best explains {:.0} % of the beams less those through walls: the rest ends where the map is \
                         unexplored, on people or on what has moved",
                        100.0 * best
                    ),
                };
                format!(
                    "no pose: the robot was not found in the map in {scans} scans: {why}; --start X,Y,DEG tells where it is"
                )
            }
        }
    }

    /// A remark where some poses are only guesses.
    fn guesses(&self) -> Option<String> {
        let guesses = self.scans - self.measured;
        (guesses > 0).then(|| {
            format!(
                "{guesses} of {} poses are guesses that no match confirms, marked in a trajectory",
                self.scans
            )
        })
    }
}

/// What of a log and of the command line stands beside the figures in JSON.
fn add_context(value: &mut Value, args: &Args, log: &Log, last: Pose) {
    let mount = args.mount_of(log);
    let Pose { x, y, theta } = mount.robot_from_lidar;
    value["last_pose"] = json!({"x": last.x, "y": last.y, "theta": last.theta});
    value["lidar"] = json!(log.lidar);
    value["source"] = json!(log.source);
    value["mount"] = json!({"x": x, "y": y, "theta": theta, "upside_down": mount.upside_down});
    value["skipped"] = json!(log.skipped);
    value["bad_readings"] = json!(log.odd.bad);
    value["too_near_readings"] = json!(log.odd.too_near);
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
