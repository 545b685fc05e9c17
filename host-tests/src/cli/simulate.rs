//! `simulate`, the default: a robot drives through a flat, and its lidar's bytes are all that the library gets.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use beamfix::geometry::Pose;
use beamfix::odometry::{Counters, Odometry};
use beamfix::scan::Mount;
use beamfix_sim::encoder;
use beamfix_sim::lidar::Ranging;
use beamfix_sim::{Drive, Settings};
use host_tests::decode::{self, Summary};
use host_tests::formats::bytes::Content;
use host_tests::formats::capture::log::{self, Revolution};
use host_tests::formats::capture::simulated;
use host_tests::formats::ros::bag::ATTACHMENT;
use host_tests::formats::{Log, ros_map};
use host_tests::pipeline::{config, follow};
use host_tests::report::mcap::McapFile;
use host_tests::report::picture;
use host_tests::{size, sized};
use serde_json::json;

use super::output;
use super::prior::Prior;
use host_tests::report::track::{At, Track};

/// Drive a simulated robot through a flat: ray casting, lidar bytes, driver, matcher, pose.
#[derive(clap::Args)]
pub struct Args {
    /// Where to write map.png, errors.svg, trajectory.txt, truth.txt, run.mcap, and lidar.rec for `replay`.
    #[arg(long, value_name = "DIR", default_value = "target/beamfix")]
    out: PathBuf,
    /// Seed of all randomness.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The lidar on board.
    #[arg(long, value_name = "MODEL", default_value = "ld06")]
    lidar: String,
    /// Where the guess for each match comes from: the simulated wheels' odometry, or the last velocity.
    #[arg(long, value_enum, default_value_t = Prior::Odometry)]
    prior: Prior,
    /// Stop after so many seconds; the round takes about 70.
    #[arg(long, default_value_t = Settings::DEFAULT.seconds)]
    seconds: f64,
    /// Write the flat as a ROS map too: this YAML file, and a PGM picture beside it. `field` makes a likelihood field
    /// of it, and `replay --mode localize --map FILE` finds the robot in it.
    #[arg(long, value_name = "FILE.yaml")]
    ros_map: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Every so many scans are drawn.
const DRAWN: usize = 4;

/// Drives, matches, writes, reports.
pub fn run(args: &Args) -> Result<ExitCode> {
    if !(args.seconds > 0.0) {
        bail!("--seconds {}: must be above 0", args.seconds);
    }
    let model = decode::model(&args.lidar, &[])?;
    fs::create_dir_all(&args.out).with_context(|| args.out.display().to_string())?;
    let settings = Settings {
        seed: args.seed,
        seconds: args.seconds,
        ranging: Ranging {
            nearest: f64::from(model.min_range_mm) * 1e-3,
            farthest: f64::from(model.max_range_mm) * 1e-3,
            ..Ranging::DEFAULT
        },
        ..Settings::DEFAULT
    };
    let drive = beamfix_sim::drive(&settings, encoder::for_model(model).as_mut());
    if let Some(path) = &args.ros_map {
        write_map(&drive, path)?;
    }
    let (bytes, revolutions, summary) = simulated::capture(&drive, settings.mount, model)?;
    let path = args.out.join("lidar.rec");
    fs::write(&path, &bytes).with_context(|| path.display().to_string())?;
    if revolutions.is_empty() {
        bail!(
            "--seconds {}: not one whole revolution of the lidar",
            args.seconds
        );
    }
    let content = Content { bytes, cut: None };
    let log = log::parse("the simulated drive", content, model.name)?;
    let size = size::fitting(revolutions.iter().map(|revolution| &revolution.beams[..]));
    sized!(
        size,
        replay(args, &settings, drive, &log, &revolutions, &summary)
    )
}

/// Side of a cell of a written map (m).
const CELL: f32 = 0.05;

/// Writes the world that was driven through, with some cells around it, in its own frame.
fn write_map(drive: &Drive, path: &Path) -> Result<()> {
    let (low, high) = drive.world.extent();
    let margin = f64::from(3.0 * CELL);
    let start = drive.moments.first().context("nothing was driven")?.truth;
    let map = ros_map::of_world(
        &drive.world,
        low.map(|side| side - margin),
        high.map(|side| side + margin),
        CELL,
        [start.x, start.y],
    )?;
    ros_map::write(&map, path)?;
    Ok(())
}

/// Follows the robot by what its lidar saw, with room for N beams a revolution.
fn replay<const N: usize>(
    args: &Args,
    settings: &Settings,
    drive: Drive,
    log: &Log,
    revolutions: &[Revolution],
    summary: &Summary,
) -> Result<ExitCode> {
    let moment =
        |revolution| simulated::moment(&drive, revolution).context("a revolution ends at a beam");
    let origin = moment(revolutions.first().context("there is a revolution")?)?;
    let mut mcap = McapFile::create(&args.out.join("run.mcap"), &["estimate", "truth", "wheels"])?;
    // So that `replay` takes this file too.
    mcap.attach(ATTACHMENT, &fs::read(args.out.join("lidar.rec"))?)?;
    let mut trajectory = output::create(&args.out.join("trajectory.txt"))?;
    let mut truth = output::create(&args.out.join("truth.txt"))?;
    let mut track = Track::new(origin.truth, settings.mount.into(), DRAWN);
    let bar = output::progress(revolutions.len(), "matching");
    let mount = Mount {
        robot_from_lidar: settings.mount.into(),
        ..Mount::DEFAULT
    };
    let odometry = Odometry::<N>::new(config(mount, N));
    let wheels = args.prior == Prior::Odometry;
    let mut revolutions = revolutions.iter();
    let followed = follow(log, (usize::MAX, wheels), odometry, &mut |scan, pose, _| {
        let now = moment(revolutions.next().context("a revolution for each scan")?)?;
        let true_pose: Pose = origin.truth.between(now.truth).into();
        let wheels: Pose = origin.wheels.between(now.wheels).into();
        let at = At {
            time: now.time,
            estimate: pose,
            truth: Some(true_pose),
            wheels: Some(wheels),
        };
        let points = track.push(at, &scan.beams);
        mcap.push(now.time, &points, &[pose, true_pose, wheels])?;
        for (file, pose) in [(&mut trajectory, pose), (&mut truth, true_pose)] {
            writeln!(file, "{:.6} {} {} {}", now.time, pose.x, pose.y, pose.theta)?;
        }
        bar.inc(1);
        Ok(())
    })?;
    bar.finish_and_clear();
    mcap.finish()?;
    trajectory.flush()?;
    truth.flush()?;

    let errors = track.errors();
    let seconds = drive.moments.last().map_or(0.0, |moment| moment.time);
    let caption = format!(
        "{seconds:.0} s, {:.1} m driven; error at the end {:.1} cm, {:.2}°; largest {:.1} cm, {:.2}°",
        drive.distance,
        100.0 * errors.last.0,
        errors.last.1,
        100.0 * errors.largest.0,
        errors.largest.1
    );
    let title = format!(
        "beamfix: {} in the simulated flat, seed {}",
        args.lidar, args.seed
    );
    let map = track.map(title.clone(), caption.clone(), Some(drive.world));
    picture::save(&map, &args.out.join("map.png"))?;
    picture::save(&track.chart(title), &args.out.join("errors.svg"))?;

    let Counters {
        scans,
        refused,
        keyframes,
        lost,
    } = followed.estimator.counters();
    let value = json!({
        "lidar": args.lidar, "seed": args.seed,
        "final_error_m": errors.last.0, "final_error_deg": errors.last.1,
        "max_error_m": errors.largest.0, "max_error_deg": errors.largest.1,
        "wheels_error_m": errors.wheels.0, "wheels_error_deg": errors.wheels.1,
        "distance_m": drive.distance, "seconds": seconds, "scans": scans,
        "refused": refused, "keyframes": keyframes, "lost": lost, "refused_beams": followed.refused_beams,
        "bytes": drive.bytes.len(), "packets": summary.packets, "pose_hash": followed.hash.to_string(),
    });
    let text = format!(
        "{caption}\nwheels alone: {:.1} cm, {:.2}° at the end\n{} bytes, {} packets, {} scans, {} refused, {} keyframes\n\
         pose hash {}\nwritten to {}: map.png errors.svg trajectory.txt truth.txt run.mcap lidar.rec",
        100.0 * errors.wheels.0,
        errors.wheels.1,
        drive.bytes.len(),
        summary.packets,
        scans,
        refused,
        keyframes,
        followed.hash,
        args.out.display()
    );
    output::report(args.json, &value, &text)?;
    Ok(ExitCode::SUCCESS)
}
