//! `simulate`, the default: a robot drives through a flat, and its lidar's bytes are all that the library gets.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, anyhow, bail, ensure};
use beamfix::geometry::Pose;
use beamfix::grid::occupancy;
use beamfix::lidar::Model;
use beamfix::odometry::{Odometry, Step};
use beamfix::pipeline::Estimator;
use beamfix::scan::Mount;
use beamfix::sensor_model::likelihood_field::{FieldModel, LikelihoodField};
use beamfix_sim::encoder;
use beamfix_sim::lidar::Ranging;
use beamfix_sim::place::{self, Place};
use beamfix_sim::ring::{Ring, RingModel};
use beamfix_sim::{Drive, Moment, Settings, World};
use host_tests::decode;
use host_tests::formats::bytes::{self, Content};
use host_tests::formats::capture::{log, simulated};
use host_tests::formats::carmen;
use host_tests::formats::field::of_map;
use host_tests::formats::ros::bag::ATTACHMENT;
use host_tests::formats::{Log, ros_map};
use host_tests::pipeline::{config, follow, is_measured, sparse_odometry};
use host_tests::report::picture;
use host_tests::report::run::{Left, Run, Setup, Titles};
use host_tests::{size, sized};
use serde_json::json;

use super::output::{self, RecordingFormat};
use super::prior::Prior;
use host_tests::report::track::At;

/// Drive a simulated robot through a flat or another place: ray casting, lidar bytes, driver, matcher, pose.
#[derive(clap::Args)]
pub struct Args {
    /// Where to write pictures (map.png, errors.svg, match.png, match.gif), what was seen as a ROS map (seen.yaml),
    /// trajectory.txt, truth.txt, a recording, and lidar.rec or ring.log for `replay`.
    #[arg(long, value_name = "DIR", default_value = "target/beamfix")]
    out: PathBuf,
    /// Draw into this file too, .png or .svg: what its name says, map, errors, match or field (the likelihood field of the
    /// place). Several times: several pictures.
    #[arg(long, value_name = "FILE")]
    picture: Vec<PathBuf>,
    /// How the run is recorded: run.mcap for Foxglove and Lichtblick (docs/foxglove.json is its layout), or a ROS 2 bag.
    #[arg(long, value_enum, default_value_t = RecordingFormat::Foxglove)]
    recording_format: RecordingFormat,
    /// Seed of all randomness.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The lidar on board: a name that `lidars` lists, or vl53l5cx-ring, eight rangers of eight zones around the robot.
    #[arg(long, value_name = "MODEL", default_value = "ld06")]
    lidar: String,
    /// Where the robot drives: flat, room, corridor, office, hall, aisles, yard, maze, dock; an empty room by its sides, 6x4; or a file that describes a place
    /// (walls, boxes, columns, a drawing, a ROS map, a start and a way: host-tests/sim/worlds has some).
    #[arg(long, value_name = "NAME|FILE", default_value = "flat")]
    world: String,
    /// Where the guess for each match comes from: the simulated wheels' odometry, or the last velocity.
    #[arg(long, value_enum, default_value_t = Prior::Odometry)]
    prior: Prior,
    /// Stop after so many seconds; the round through the flat takes about 70.
    #[arg(long, default_value_t = Settings::DEFAULT.seconds)]
    seconds: f64,
    /// Write the place as a ROS map too: this YAML file, and a PGM picture beside it. `field` makes a likelihood field
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
    let settings = Settings {
        seed: args.seed,
        seconds: args.seconds,
        ..Settings::DEFAULT
    };
    for path in &args.picture {
        picture::Kind::of(path)?;
    }
    if args.lidar == RING {
        fs::create_dir_all(&args.out).with_context(|| args.out.display().to_string())?;
        return ring(args, settings);
    }
    let model = decode::model(&args.lidar, &[])?;
    fs::create_dir_all(&args.out).with_context(|| args.out.display().to_string())?;
    let settings = Settings {
        ranging: simulated::settings(model).ranging,
        ..settings
    };
    let driven = drive(place(args)?, &settings, model)?;
    let path = args.out.join(RECORDING);
    fs::write(&path, &driven.bytes).with_context(|| path.display().to_string())?;
    let size = driven.size();
    sized!(size, turning(args, &settings, driven))
}

/// Drives through a place with a lidar of `model`.
pub fn drive(place: Place, settings: &Settings, model: &'static Model) -> Result<Driven> {
    let mut sensor = encoder::for_model(model);
    ensure!(
        sensor.sway(place.nature.sway),
        "--lidar {}: the simulated one turns steadily, and the place wants its speed to sway",
        model.name
    );
    let drive = beamfix_sim::drive_in(place, settings, sensor.as_mut());
    let (bytes, revolutions, summary) = simulated::capture(&drive, settings.mount, model)?;
    let moment = |revolution| simulated::moment(&drive, revolution);
    let moments: Option<Vec<Moment>> = revolutions.iter().map(moment).collect();
    let moments = moments.context("a revolution ends at a beam")?;
    let packets = summary.packets;
    let log = if moments.is_empty() {
        Log::default()
    } else {
        let content = Content {
            bytes: bytes.clone(),
            cut: None,
        };
        log::of_revolutions(
            "the simulated drive",
            content,
            model,
            (revolutions, summary),
        )?
    };
    Ok(Driven {
        drive,
        moments,
        log,
        bytes,
        packets,
    })
}

/// Where the robot drives: a place that is built in, or described in a file.
fn place(args: &Args) -> Result<Place> {
    if let Some(place) = Place::named(&args.world, args.seed) {
        return Ok(place);
    }
    let path = Path::new(&args.world);
    let known = || {
        let names = place::NAMES.map(|(name, what)| format!("{name} ({what})"));
        format!(
            "--world {}: a file, or one of {}",
            args.world,
            names.join(", ")
        )
    };
    let content = bytes::load_at_most(path, MAX_WORLD).with_context(known)?;
    let text = String::from_utf8(content.bytes).with_context(known)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut read_map = |name: &str| {
        let map = ros_map::read(&folder.join(name)).map_err(|error| format!("{error:#}"))?;
        Ok(walls(&map))
    };
    Place::parse(&text, &mut read_map).map_err(|why| anyhow!("{}: {why}", args.world))
}

/// Largest description of a place (bytes).
const MAX_WORLD: u64 = 4 << 20;

/// The faces of a map's occupied cells.
fn walls(map: &ros_map::Map) -> World {
    let shape = map.shape();
    let origin = shape.origin().into();
    let is_full = |x: usize, y: usize| {
        let byte = map.get(x as i32, y as i32);
        byte.is_some_and(occupancy::is_occupied)
    };
    let cells = (usize::from(shape.width()), usize::from(shape.height()));
    World::of_cells(cells, f64::from(shape.resolution()), origin, &is_full)
}

/// The name of the ring of rangers, which has no bytes and so is no model.
const RING: &str = "vl53l5cx-ring";
/// What a lidar's drive is recorded in for `replay`, and what a ring's.
const RECORDING: &str = "lidar.rec";
const RING_RECORDING: &str = "ring.log";

/// A finished drive, and its scans as the pipeline gets them.
pub struct Driven {
    pub drive: Drive,
    pub log: Log,
    /// The robot at the end of each scan.
    pub moments: Vec<Moment>,
    /// The capture that the log was read from; none of a ring of rangers.
    bytes: Vec<u8>,
    packets: u32,
}

impl Driven {
    /// Room for this many beams a revolution is enough.
    pub fn size(&self) -> usize {
        size::fitting(self.log.scans.iter().map(|scan| &scan.beams[..]))
    }
}

/// A lidar that turns, with room for N beams a revolution.
fn turning<const N: usize>(args: &Args, settings: &Settings, driven: Driven) -> Result<ExitCode> {
    let mount = Mount {
        robot_from_lidar: settings.mount.into(),
        ..Mount::DEFAULT
    };
    let odometry = Odometry::<N>::new(config(mount, N));
    replay(args, settings, driven, odometry, |odometry| {
        odometry.counters().lost
    })
}

/// A ring of rangers, which sees 64 wide beams at once.
fn ring(args: &Args, settings: Settings) -> Result<ExitCode> {
    let settings = Settings {
        ranging: Ranging::TRUE,
        ..settings
    };
    let mut ring = Ring::new(RingModel::VL53L5CX, args.seed);
    let drive = beamfix_sim::drive_in(place(args)?, &settings, &mut ring);
    let log = simulated::ring(&drive, &ring, settings.mount);
    let moments = ring.scans.iter().map(|scan| drive.moments[scan.0 - 1]);
    let moments = moments.collect();
    let path = args.out.join(RING_RECORDING);
    fs::write(&path, carmen::written(&log)).with_context(|| path.display().to_string())?;
    let odometry = sparse_odometry(log.mount, RingModel::VL53L5CX.width() as f32);
    let driven = Driven {
        drive,
        log,
        moments,
        bytes: Vec::new(),
        packets: 0,
    };
    replay(args, &settings, driven, odometry, |_| 0)
}

/// Side of a cell of a written map (m).
const CELL: f32 = 0.05;

/// The world that was driven through as a ROS map, with some cells around it, in its own frame.
fn map(drive: &Drive) -> Result<ros_map::Map> {
    let (low, high) = drive.world.extent();
    let margin = f64::from(3.0 * CELL);
    let start = drive.moments.first().context("nothing was driven")?.truth;
    ros_map::of_world(
        &drive.world,
        low.map(|side| side - margin),
        high.map(|side| side + margin),
        CELL,
        [start.x, start.y],
    )
}

/// The likelihood field of the world that was driven through, in its own frame.
fn field(drive: &Drive) -> Result<LikelihoodField<Vec<u8>>> {
    of_map(&map(drive)?, &FieldModel::DEFAULT)
}

/// Follows the robot by what its lidar saw; `lost` counts the keyframes that were given up.
fn replay<E: Estimator<N, Step = Step>, const N: usize>(
    args: &Args,
    settings: &Settings,
    driven: Driven,
    estimator: E,
    lost: impl Fn(&E) -> u32,
) -> Result<ExitCode> {
    let Driven {
        drive,
        log,
        moments,
        bytes,
        packets,
    } = driven;
    let Some(&origin) = moments.first() else {
        bail!(
            "--seconds {}: not one whole revolution of the lidar",
            args.seconds
        );
    };
    if let Some(path) = &args.ros_map {
        ros_map::write(&map(&drive)?, path)?;
    }
    let setup = Setup {
        origin: origin.truth,
        mount: Mount {
            robot_from_lidar: settings.mount.into(),
            ..Mount::DEFAULT
        },
        scans: moments.len(),
        drawn: DRAWN,
        has: (true, true),
        // A ring of rangers has no bytes.
        is_sampled: !bytes.is_empty(),
    };
    let left = Left {
        folder: Some((&args.out, args.recording_format.into())),
        pictures: &args.picture,
    };
    let mut run = Run::create(&left, &setup)?;
    // So that `replay` takes the recording too.
    let recording = if setup.is_sampled {
        run.attach(ATTACHMENT, &bytes)?;
        RECORDING
    } else {
        run.attach(ATTACHMENT, carmen::written(&log).as_bytes())?;
        RING_RECORDING
    };
    let mut trajectory = output::create(&args.out.join("trajectory.txt"))?;
    let mut truth = output::create(&args.out.join("truth.txt"))?;
    let bar = output::progress(moments.len(), "matching");
    let wheels = args.prior == Prior::Odometry;
    let (mut refused, mut keyframes) = (0, 0);
    let mut at_end = moments.iter();
    let followed = follow(
        &log,
        (usize::MAX, wheels),
        estimator,
        &mut |scan, pose, step| {
            let now = at_end.next().context("a moment for each scan")?;
            let is_measured = is_measured(step);
            refused += u32::from(!is_measured);
            keyframes += u32::from(step.keyframe);
            let true_pose: Pose = origin.truth.between(now.truth).into();
            let wheels: Pose = origin.wheels.between(now.wheels).into();
            let at = At {
                time: now.time,
                estimate: pose,
                covariance: Some(step.covariance),
                is_measured,
                truth: Some(true_pose),
                wheels: Some(wheels),
            };
            run.push(scan, at)?;
            for (file, pose) in [(&mut trajectory, pose), (&mut truth, true_pose)] {
                writeln!(file, "{:.6} {} {} {}", now.time, pose.x, pose.y, pose.theta)?;
            }
            bar.inc(1);
            Ok(())
        },
    )?;
    bar.finish_and_clear();
    trajectory.flush()?;
    truth.flush()?;

    let errors = run.errors();
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
        "beamfix: {} in the simulated {}, seed {}",
        args.lidar,
        Path::new(&args.world)
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy(),
        args.seed
    );
    let titles = Titles {
        title,
        caption: caption.clone(),
    };
    let field = left.has_field().then(|| field(&drive)).transpose()?;
    let field = field.as_ref().map(|field| field.as_slice());
    let (files, remarks) = run.finish(titles, Some(drive.world.clone()), field)?;
    output::remark(&remarks);

    let (scans, lost) = (followed.scans, lost(&followed.estimator));
    let value = json!({
        "lidar": args.lidar, "world": args.world, "seed": args.seed,
        "final_error_m": errors.last.0, "final_error_deg": errors.last.1,
        "max_error_m": errors.largest.0, "max_error_deg": errors.largest.1,
        "wheels_error_m": errors.wheels.0, "wheels_error_deg": errors.wheels.1,
        "distance_m": drive.distance, "seconds": seconds, "scans": scans,
        "refused": refused, "keyframes": keyframes, "lost": lost, "refused_beams": followed.refused_beams,
        "bytes": drive.bytes.len(), "packets": packets, "pose_hash": followed.hash.to_string(),
    });
    let text = format!(
        "{caption}\nwheels alone: {:.1} cm, {:.2}° at the end\n{} bytes, {} packets, {} scans, {} refused, {} keyframes\n\
         pose hash {}\nwritten to {}: {} trajectory.txt truth.txt {recording}",
        100.0 * errors.wheels.0,
        errors.wheels.1,
        drive.bytes.len(),
        packets,
        scans,
        refused,
        keyframes,
        followed.hash,
        args.out.display(),
        files.join(" ")
    );
    output::report(args.json, &value, &text)?;
    Ok(ExitCode::SUCCESS)
}
