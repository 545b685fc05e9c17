//! `replay`: the firmware's pipeline over a recorded log.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Result, anyhow, bail};
use beamfix::geometry::Pose;
use beamfix::odometry::{Counters, OdometryConfig};
use beamfix::scan::Mount;
use beamfix_sim::TruePose;
use clap::ValueEnum;
use host_tests::formats::{self, Log, capture};
use host_tests::pipeline::Pipeline;
use host_tests::report::hash::PoseHash;
use host_tests::report::picture;
use host_tests::{size, sized};
use serde_json::json;

use super::localize::replay as localize_replay;
use super::output;
use super::prior::Prior;
use host_tests::report::track::{At, Track};

/// Run the firmware's pipeline over a recorded log: CARMEN .log, .lscan, ROS 2 MCAP, a recording of
/// `simulate` (lidar.rec), or a raw serial capture; packed or not.
#[derive(clap::Args)]
pub struct Args {
    /// The log.
    pub(super) log: PathBuf,
    /// Take the log as raw bytes of this sensor.
    #[arg(long, value_name = "MODEL")]
    lidar: Option<String>,
    /// What runs over the scans.
    #[arg(long, value_enum, default_value_t = Mode::Odometry)]
    mode: Mode,
    /// Where the guess for each match comes from: the log's wheel odometry, or the last velocity.
    #[arg(long, value_enum, default_value_t = Prior::Odometry)]
    prior: Prior,
    /// The memory configuration. Default: the smallest one with room for the log's scans.
    #[arg(long, value_enum)]
    tier: Option<Tier>,
    /// Where to write a line `timestamp x y theta` for every scan.
    #[arg(long, value_name = "FILE")]
    pub(super) trajectory: Option<PathBuf>,
    /// Draw what was seen and driven into this file, PNG or SVG by its ending; with --mode localize: the map to
    /// localize in, a ROS map's YAML file.
    #[arg(long, value_name = "FILE")]
    pub(super) map: Option<PathBuf>,
    /// The lidar's place on the robot (m, m, deg), where the log does not tell or tells it wrong.
    #[arg(long, value_name = "X,Y,DEG", value_parser = mount, allow_hyphen_values = true)]
    pub(super) mount: Option<Pose>,
    /// Where the robot starts in the map (m, m, deg). Default: it finds itself.
    #[arg(long, value_name = "X,Y,DEG", value_parser = mount, allow_hyphen_values = true)]
    pub(super) start: Option<Pose>,
    /// Stop after so many scans.
    #[arg(long, value_name = "N")]
    pub(super) scans: Option<usize>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Mode {
    Odometry,
    /// Refused with a clear line until it is there.
    #[value(hide = true)]
    Slam,
    Localize,
}

/// Compiled memory configurations, by the RAM of the controller: how many beams a turn may have.
#[derive(Clone, Copy, ValueEnum)]
enum Tier {
    /// 360 beams.
    #[value(name = "16k")]
    Small = 360,
    /// 512 beams.
    #[value(name = "64k")]
    Middle = 512,
    /// 720 beams.
    #[value(name = "192k")]
    Large = 720,
    /// 1024 beams.
    #[value(name = "512k")]
    Huge = 1024,
}

/// About so many scans are drawn into a map.
const DRAWN: usize = 400;

impl Args {
    /// Whether the log's wheel odometry is the prior.
    pub(super) fn uses_wheels(&self) -> bool {
        self.prior == Prior::Odometry
    }
}

/// What a replay came to.
struct Outcome {
    counters: Counters,
    refused_beams: usize,
    hash: PoseHash,
    last: Pose,
}

/// Replays the log.
pub fn run(args: &Args) -> Result<ExitCode> {
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
    if args.mode == Mode::Localize {
        return localized(args, &log, size);
    }
    let outcome = sized!(size, replay(args, &log))?;
    let Counters {
        scans,
        refused,
        keyframes,
        lost,
    } = outcome.counters;
    let value = json!({
        "scans": scans, "refused": refused, "keyframes": keyframes, "lost": lost, "loops": 0,
        "beams": size, "refused_beams": outcome.refused_beams, "skipped": log.skipped, "bad_readings": log.bad_readings,
        "pose_hash": outcome.hash.to_string(),
    });
    let Pose { x, y, theta } = outcome.last;
    let mut text = format!(
        "{scans} scans, {refused} refused, {keyframes} keyframes, {lost} times lost\n\
         last pose {x:.3} m {y:.3} m {:.2}°\npose hash {}",
        theta.to_degrees(),
        outcome.hash
    );
    if outcome.refused_beams > 0 {
        text += &format!(
            "\n{} beams found no room: this configuration has {size} a turn",
            outcome.refused_beams
        );
    }
    output::report(args.json, &value, &text)?;
    if let Some(remarks) = log.remarks() {
        eprintln!("beamfix: {}: {remarks}", args.log.display());
    }
    match &log.cut {
        Some(cut) => Err(anyhow!("{}: {cut}", args.log.display())),
        None => Ok(ExitCode::SUCCESS),
    }
}

/// Replays the log in a map.
fn localized(args: &Args, log: &Log, size: usize) -> Result<ExitCode> {
    let outcome = sized!(size, localize_replay(args, log))?;
    let value = json!({
        "scans": outcome.scans, "refused": outcome.scans - outcome.tracked, "keyframes": 0, "loops": 0,
        "tracked": outcome.tracked, "doubtful": outcome.doubtful, "lost": outcome.lost, "searches": outcome.searches,
        "beams": size, "refused_beams": outcome.refused_beams, "skipped": log.skipped,
        "pose_hash": outcome.hash.to_string(),
    });
    let Pose { x, y, theta } = outcome.last;
    let text = format!(
        "{} scans, {} with a pose, {} doubtful, {} times lost, {} searches\n\
         last pose {x:.3} m {y:.3} m {:.2}°\npose hash {}",
        outcome.scans,
        outcome.tracked,
        outcome.doubtful,
        outcome.lost,
        outcome.searches,
        theta.to_degrees(),
        outcome.hash
    );
    output::report(args.json, &value, &text)?;
    if let Some(remarks) = log.remarks() {
        eprintln!("beamfix: {}: {remarks}", args.log.display());
    }
    match &log.cut {
        Some(cut) => Err(anyhow!("{}: {cut}", args.log.display())),
        None => Ok(ExitCode::SUCCESS),
    }
}

fn replay<const N: usize>(args: &Args, log: &Log) -> Result<Outcome> {
    let robot_from_lidar = args.mount.unwrap_or(log.robot_from_lidar);
    let config = OdometryConfig::DEFAULT.with_mount(Mount {
        robot_from_lidar,
        ..Mount::DEFAULT
    });
    let mut pipeline = Pipeline::<N>::new(config);
    let mut trajectory = args.trajectory.as_deref().map(output::create).transpose()?;
    let count = args
        .scans
        .map_or(log.scans.len(), |most| most.min(log.scans.len()));
    let bar = output::progress(count, "replaying");
    let mut last = Pose::IDENTITY;
    let mut track = Track::new(
        TruePose::default(),
        robot_from_lidar,
        (count / DRAWN).max(1),
    );
    let start = log.scans.first().and_then(|scan| scan.wheels);
    for scan in &log.scans[..count] {
        let wheels = args.prior.of(scan.wheels);
        last = pipeline.step(&scan.beams, wheels).pose;
        if let Some(file) = &mut trajectory {
            writeln!(file, "{} {} {} {}", scan.stamp, last.x, last.y, last.theta)?;
        }
        if args.map.is_some() {
            let us = scan.beams.last().map_or(0, |beam| beam.time_us);
            let wheels = start
                .zip(scan.wheels)
                .map(|(start, now)| start.between(now));
            let at = At {
                time: f64::from(us) * 1e-6,
                estimate: last,
                truth: None,
                wheels,
            };
            track.push(at, &scan.beams);
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    if let Some(path) = &args.map {
        let name = args
            .log
            .file_name()
            .map_or(String::new(), |name| name.to_string_lossy().into_owned());
        let caption = format!("{count} scans, pose hash {}", pipeline.hash);
        picture::save(
            &track.map(format!("beamfix: odometry over {name}"), caption, None),
            path,
        )?;
    }
    if let Some(mut file) = trajectory {
        file.flush()?;
    }
    Ok(Outcome {
        counters: pipeline.counters(),
        refused_beams: pipeline.refused_beams,
        hash: pipeline.hash,
        last,
    })
}

/// `x,y,degrees`.
fn mount(text: &str) -> Result<Pose> {
    let numbers: Vec<f32> = text.split(',').map(str::parse).collect::<Result<_, _>>()?;
    match numbers[..] {
        [x, y, degrees] if numbers.iter().all(|v| v.is_finite()) => {
            Ok(Pose::new(x, y, degrees.to_radians()))
        }
        _ => bail!("three numbers wanted: x,y,degrees"),
    }
}
