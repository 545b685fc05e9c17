//! `beamfix-bridge`: from a serial line to ROS 2 and back.

use std::convert::Infallible;
use std::env;
use std::io::{ErrorKind, Read, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant, SystemTime};

use anyhow::{Context, Result, ensure};
use beamfix::scan::Mount;
use beamfix_app::command::Command;
use beamfix_app::telemetry::Task;
use beamfix_bridge::convert::{Converter, mount, time};
use beamfix_bridge::dds::{Names, Ros};
use beamfix_bridge::message::Message;
use beamfix_bridge::node::{self, Ids};
use clap::{Parser, ValueEnum};
use host_tests::board::commands::Commands;
use host_tests::formats::{mount, ros_map};
use host_tests::report::ros::occupied;

/// A board's telemetry as ROS 2 topics: /odom (in a map /pose), /tf, /tf_static, /scan, /diagnostics; the robot's wheels from
/// /wheel_odom to the board. ROS_DOMAIN_ID and ROS_LOCALHOST_ONLY count as for any node.
#[derive(Parser)]
struct Args {
    /// The board's serial line.
    port: String,
    /// The line's speed.
    #[arg(long, value_name = "BAUD", default_value_t = 921_600)]
    baud: u32,
    /// Topic of the robot's own odometry, of type nav_msgs/Odometry.
    #[arg(long, value_name = "TOPIC", default_value = "/wheel_odom")]
    wheels: String,
    /// Topic of the board's odometry.
    #[arg(long, value_name = "TOPIC", default_value = "/odom")]
    odom: String,
    /// Name of the node, as `ros2 node list` shows it.
    #[arg(long, value_name = "NAME", default_value = "beamfix")]
    node: String,
    /// How the lidar sits on the robot, for a board that does not tell it when asked: firmware before version 7 of the telemetry.
    #[arg(long, value_name = "X,Y,DEG[,down]", value_parser = mount::parse, allow_hyphen_values = true)]
    mount: Option<Mount>,
    /// What the board does, for one that does not tell it when asked.
    #[arg(long, value_enum, default_value_t = Doing::Odometry)]
    task: Doing,
    /// A map as ROS has it, published on /map.
    #[arg(long, value_name = "YAML")]
    map: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Doing {
    Odometry,
    Localization,
}

/// What the board has not answered after so long is asked again, [`QUESTIONS`] times in all: a board before version 7 does not
/// know the question.
const PATIENCE: Duration = Duration::from_secs(2);
const QUESTIONS: u32 = 5;
/// Nothing comes for so long where something is wrong: four revolutions of the slowest lidar.
const SILENCE: Duration = Duration::from_secs(2);

fn main() -> ExitCode {
    let Err(error) = run(&Args::parse());
    eprintln!("beamfix-bridge: {error:#}");
    ExitCode::from(2)
}

/// Until something fails.
fn run(args: &Args) -> Result<Infallible> {
    let bare = |topic: &str| topic.trim_start_matches('/').to_owned();
    ensure!(
        bare(&args.odom) != bare(&args.wheels),
        "--odom and --wheels are the same topic, {}: the board would be told what it has said",
        args.odom
    );
    node::check(&args.node).context("--node")?;
    let map = args.map.as_deref().map(ros_map::read).transpose()?;
    let mut port = serialport::new(&args.port, args.baud)
        .timeout(Duration::from_millis(10))
        .open()
        .with_context(|| args.port.clone())?;
    let domain = match env::var("ROS_DOMAIN_ID") {
        Ok(text) => text.parse().context("ROS_DOMAIN_ID")?,
        Err(_) => 0,
    };
    let is_local = env::var("ROS_LOCALHOST_ONLY").is_ok_and(|value| value == "1")
        || env::var("ROS_AUTOMATIC_DISCOVERY_RANGE").is_ok_and(|value| value == "LOCALHOST");
    let names = Names {
        odom: &args.odom,
        wheels: &args.wheels,
        node: &args.node,
        ids: Ids::of(&env::var("ROS_DISTRO").unwrap_or_default()),
    };
    let mut ros = Ros::join(domain, is_local, &names)?;
    let mut converter = Converter::new(match args.task {
        Doing::Odometry => Task::Odometry,
        Doing::Localization => Task::Localization,
    });
    if let Some(map) = &map {
        ros.publish(&Message::Map(occupied(map, time(now_ns()))))?;
    }
    if let Some(told) = args.mount {
        ros.publish(&Message::Mount(mount(told, now_ns())))?;
    }
    eprintln!("{}: domain {domain}, node /{}", args.port, args.node);
    ask(&mut port)?;
    let (mut heard, mut starts) = (Instant::now(), 0);
    let (mut asked, mut questions) = (Instant::now(), 1);
    let mut bytes = [0; 4096];
    loop {
        let count = match port.read(&mut bytes) {
            Ok(count) => count,
            Err(error) if [ErrorKind::TimedOut, ErrorKind::Interrupted].contains(&error.kind()) => {
                0
            }
            Err(error) => return Err(error).with_context(|| args.port.clone()),
        };
        for message in converter.push(&bytes[..count], now_ns()) {
            ros.publish(&message)?;
        }
        if count > 0 {
            heard = Instant::now();
        } else if heard.elapsed() > SILENCE
            && let Some(message) = converter.silence(now_ns())
        {
            ros.publish(&message)?;
        }
        // A board that has started sends no beams before it is asked.
        if converter.starts != starts {
            starts = converter.starts;
            ask(&mut port)?;
        } else if !converter.is_known && questions < QUESTIONS && asked.elapsed() > PATIENCE {
            (asked, questions) = (Instant::now(), questions + 1);
            ask(&mut port)?;
            if questions == QUESTIONS && args.mount.is_none() {
                eprintln!(
                    "the board does not tell how its lidar sits: no transform of it on /tf_static before the board starts again, or --mount tells it"
                );
            }
        }
        wheels(&mut ros, &mut converter, &mut port)?;
    }
}

/// Hands the wheels' poses to the board.
fn wheels(ros: &mut Ros, converter: &mut Converter, port: &mut impl Write) -> Result<()> {
    loop {
        match ros.wheels() {
            Ok(Some((stamp_ns, pose))) => {
                let mut commands = Commands::new();
                commands.wheels(pose);
                port.write_all(commands.bytes())?;
                let stamp_ns = if stamp_ns == 0 { now_ns() } else { stamp_ns };
                if let Some(message) = converter.wheels(pose, stamp_ns) {
                    ros.publish(&message)?;
                }
            }
            Ok(None) => return Ok(()),
            Err(error) => eprintln!("a message of the wheels is left out: {error:#}"),
        }
    }
}

/// Asks the board for its beams, what it is and how it is.
fn ask(port: &mut impl Write) -> Result<()> {
    let mut commands = Commands::new();
    commands.send(&Command::Send {
        raw: false,
        scans: true,
        quality: false,
    });
    commands.ask_ready();
    commands.ask_health();
    Ok(port.write_all(commands.bytes())?)
}

/// Since the epoch.
fn now_ns() -> i64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    since.map_or(0, |since| since.as_nanos() as i64)
}
