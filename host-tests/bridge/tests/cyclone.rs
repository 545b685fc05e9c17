//! A simulated board on a pseudo-terminal, the bridge, and Cyclone DDS behind it: what arrives there is what the board said, and
//! where the robot was.

use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use beamfix::geometry::Pose;
use beamfix_app::link::Receiver;
use beamfix_app::telemetry::{self, Reset, Telemetry};
use beamfix_app::{App, BEAMS, CONFIG};
use beamfix_sim::TruePose;
use beamfix_sim::drive::{Drive, Settings, drive};
use beamfix_sim::encoder::ld06::Sensor;
use host_tests::board::commands::Commands;
use host_tests::formats::ros_map;
use serde_json::Value;
use serialport::{SerialPort, TTYPort};

/// How long Cyclone DDS listens (s); the drive is longer.
const LISTENS: f64 = 9.0;

/// Where the lidar sits on the simulated robot, by [`Settings::DEFAULT`].
const MOUNT: Pose = Pose {
    x: 0.08,
    y: 0.0,
    theta: 0.0,
};

/// Python with Cyclone DDS; `None`, after a line that says so, where there is none.
fn python() -> Option<PathBuf> {
    let venv = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/python/venv/bin/python");
    let found = [venv, PathBuf::from("python3")].into_iter().find(|python| {
        let import = Command::new(python)
            .args(["-c", "import cyclonedds.idl"])
            .output();
        import.is_ok_and(|output| output.status.success())
    });
    if found.is_none() {
        println!("left out: python3 has no package cyclonedds (./test python installs it)");
    }
    found
}

/// Ends what was started, however the test ends.
struct Ended(Child);

impl Drop for Ended {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Whether the board starts before the bridge or after.
#[derive(Clone, Copy, PartialEq)]
enum Starts {
    Before,
    After,
}

/// The firmware at the other end of the line, in its own time, until `done`; gives what it said and what it was sent.
fn board(
    mut line: TTYPort,
    starts: Starts,
    drive: &Drive,
    mut done: impl FnMut() -> bool,
) -> (Vec<u8>, Vec<u8>) {
    let mut config = CONFIG;
    config.odometry.points.mount.robot_from_lidar = MOUNT;
    let mut app = Box::new(App::<BEAMS>::new(config));
    line.set_timeout(Duration::from_millis(1)).expect("a line");
    let (mut said, mut got) = (Vec::new(), Vec::new());
    let mut bytes = [0; 256];
    if starts == Starts::After {
        // It does not hear the bridge's first question.
        let given_up = Instant::now() + Duration::from_secs(60);
        while line.read(&mut bytes).is_err() {
            assert!(Instant::now() < given_up, "the bridge asks nothing");
        }
        said.extend_from_slice(app.ready(Reset::Power));
    }
    let start = Instant::now();
    let (mut sent, mut frame, mut written) = (0, 0, 0);
    while !done() {
        let now_us = start.elapsed().as_micros();
        app.set_time(now_us as u32);
        while let Some(&(end, _)) = drive
            .frames
            .get(frame)
            .filter(|next| next.1 < now_us as f64)
        {
            app.lidar_all(&drive.bytes[sent..end], |out| said.extend_from_slice(out));
            (sent, frame) = (end, frame + 1);
        }
        // A line that is full takes the rest later: the bridge may have had no turn.
        match line.write(&said[written..]) {
            Ok(count) => written += count,
            Err(error) if error.kind() == ErrorKind::TimedOut => {}
            Err(error) => panic!("the line: {error}"),
        }
        match line.read(&mut bytes) {
            Ok(count) => {
                got.extend_from_slice(&bytes[..count]);
                // The wheels of this test are no robot's: the board is not told.
                for command in bytes[..count].split_inclusive(|&byte| byte == 0) {
                    if command.len() < 16 {
                        app.command_all(command, |out| said.extend_from_slice(out));
                    }
                }
            }
            Err(error) if error.kind() == ErrorKind::TimedOut => {}
            Err(error) => panic!("the line: {error}"),
        }
    }
    (said, got)
}

fn poses(said: &[u8]) -> Vec<telemetry::Pose> {
    let mut receiver = Receiver::new();
    let messages = said
        .iter()
        .filter_map(|&byte| receiver.push::<Telemetry>(byte));
    let pose = |message| match message {
        Telemetry::Pose(pose) => Some(pose),
        _ => None,
    };
    messages.filter_map(pose).collect()
}

fn number(value: &Value) -> f64 {
    match value.as_str() {
        Some(text) => text.parse().expect("a number's name"),
        None => value.as_f64().expect("a number"),
    }
}

fn ns(message: &Value) -> i64 {
    let stamp = &message["header"]["stamp"];
    let [sec, nanosec] = ["sec", "nanosec"].map(|name| stamp[name].as_i64().expect("a number"));
    sec * 1_000_000_000 + nanosec
}

/// Of a place with a quaternion about z.
fn planar(position: &Value, orientation: &Value) -> TruePose {
    let (z, w) = (number(&orientation["z"]), number(&orientation["w"]));
    assert!(orientation["x"] == 0.0 && orientation["y"] == 0.0 && position["z"] == 0.0);
    TruePose::new(
        number(&position["x"]),
        number(&position["y"]),
        2.0 * libm::atan2(z, w),
    )
}

/// Where the robot was in the simulated world at a time of its drive (s).
fn truth(drive: &Drive, time: f64) -> TruePose {
    let k = drive.moments.partition_point(|moment| moment.time < time);
    drive.moments[k.min(drive.moments.len() - 1)].truth
}

/// What a board said and was sent, and what Cyclone DDS got of it through the bridge within so many seconds.
struct Run {
    drive: Drive,
    map: ros_map::Map,
    said: Vec<u8>,
    got: Vec<u8>,
    received: Value,
}

/// With a bridge for nodes of this distribution; `None` where there is no Cyclone DDS.
fn run(starts: Starts, listens: f64, distribution: &str) -> Option<Run> {
    let python = python()?;
    let settings = Settings {
        seconds: 40.0,
        ..Settings::DEFAULT
    };
    let drive = drive(&settings, &mut Sensor::ld06());
    let (low, high) = drive.world.extent();
    let start = truth(&drive, 0.0);
    let map = ros_map::of_world(&drive.world, low, high, 0.05, [start.x, start.y]);
    let map = map.expect("a map");
    let yaml = format!("bridge-{distribution}.yaml");
    let yaml = Path::new(env!("CARGO_TARGET_TMPDIR")).join(yaml);
    ros_map::write(&map, &yaml).expect("the test's file");

    let (master, slave) = TTYPort::pair().expect("a pseudo-terminal");
    // Others on this machine may test too.
    let first = match starts {
        Starts::Before => 20,
        Starts::After => 60,
    };
    let domain = (first + std::process::id() % 40).to_string();
    let bridge = Command::new(env!("CARGO_BIN_EXE_beamfix-bridge"))
        .arg(slave.name().expect("its name"))
        .args(["--map", yaml.to_str().expect("a name")])
        .env("ROS_DOMAIN_ID", &domain)
        .env("ROS_LOCALHOST_ONLY", "1")
        .env("ROS_DISTRO", distribution)
        .spawn()
        .expect("the bridge");
    let _bridge = Ended(bridge);
    let bytes = match distribution {
        "humble" => "24",
        _ => "16",
    };
    let peer = Command::new(&python)
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peer.py"))
        .args([&domain, &listens.to_string(), bytes])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("python");
    let mut peer = Ended(peer);
    let mut output = peer.0.stdout.take().expect("a pipe");
    let mut errors = BufReader::new(peer.0.stderr.take().expect("a pipe"));
    let mut first = String::new();
    errors.read_line(&mut first).expect("text");
    let reader = std::thread::spawn(move || {
        let mut text = String::new();
        output.read_to_string(&mut text).expect("text");
        text
    });
    // What was sent last is still on its way.
    let mut end = None;
    let (said, got) = board(master, starts, &drive, || {
        reader.is_finished()
            && end.get_or_insert_with(Instant::now).elapsed() > Duration::from_secs(2)
    });
    let mut rest = String::new();
    errors.read_to_string(&mut rest).expect("text");
    let text = reader.join().expect("what was received");
    let received: Value = serde_json::from_str(&text).unwrap_or_else(|_| panic!("{first}{rest}"));
    Some(Run {
        drive,
        map,
        said,
        got,
        received,
    })
}

#[test]
fn cyclone_dds_receives_what_the_board_said_and_its_wheels_reach_the_board() {
    let Some(run) = run(Starts::After, LISTENS, "jazzy") else {
        return;
    };
    check(
        &run.received,
        &poses(&run.said),
        &run.got,
        &run.drive,
        &run.map,
    );
    is_node(&run.received, 16);
}

#[test]
fn a_bridge_that_starts_after_the_board_asks_what_it_is() {
    let Some(run) = run(Starts::Before, 5.0, "humble") else {
        return;
    };
    is_at_mount(&run.received);
    let list = |name: &str| run.received["received"][name].as_array().expect("a list");
    assert!(list("/odom").len() > 20 && list("/scan").len() > 20);
    // The board answered, and has not started.
    let mut receiver = Receiver::new();
    let resets: Vec<Reset> = (run.said.iter())
        .filter_map(|&byte| match receiver.push(byte) {
            Some(Telemetry::Ready(ready)) => Some(ready.reset),
            _ => None,
        })
        .collect();
    assert_eq!(resets, [Reset::Asked]);
    is_node(&run.received, 24);
}

/// The bridge is a node whose writers and readers are those that DDS's discovery tells, with ids of so many bytes.
fn is_node(received: &Value, bytes: usize) {
    let list = |value: &Value| value.as_array().expect("a list").clone();
    let infos = list(&received["received"]["ros_discovery_info"]);
    let [info] = &infos[..] else {
        panic!("one participant: {infos:?}");
    };
    let hex = |gid: &Value| -> String {
        let data = list(&gid["data"]);
        assert_eq!(data.len(), bytes);
        assert!(data[16..].iter().all(|byte| byte == 0), "{gid}");
        let digits = data[..16]
            .iter()
            .map(|byte| format!("{:02x}", byte.as_u64().expect("a byte")));
        digits.collect()
    };
    let nodes = list(&info["node_entities_info_seq"]);
    let [node] = &nodes[..] else {
        panic!("one node: {info}");
    };
    assert_eq!(
        (&node["node_namespace"], &node["node_name"]),
        (&"/".into(), &"beamfix".into())
    );
    // Topics of the ids, by what DDS tells of the participant.
    let participant = hex(&info["gid"]);
    let topics = |kind: &str, ids: &Value| -> Vec<String> {
        let found = list(&received["found"][kind]);
        let mut topics: Vec<String> = list(ids)
            .iter()
            .map(|id| {
                let id = hex(id);
                let endpoint = found.iter().find(|endpoint| endpoint[0] == id.as_str());
                let endpoint = endpoint.unwrap_or_else(|| panic!("{id} in {found:?}"));
                assert_eq!(endpoint[1], participant.as_str());
                endpoint[2].as_str().expect("a name").to_owned()
            })
            .collect();
        topics.sort_unstable();
        topics
    };
    assert_eq!(
        topics("writers", &node["writer_gid_seq"]),
        [
            "rt/diagnostics",
            "rt/map",
            "rt/odom",
            "rt/pose",
            "rt/scan",
            "rt/tf",
            "rt/tf_static"
        ]
    );
    assert_eq!(
        topics("readers", &node["reader_gid_seq"]),
        ["rt/wheel_odom"]
    );
}

/// The lidar sits where the board says.
fn is_at_mount(received: &Value) {
    let mounts = received["received"]["/tf_static"].as_array();
    let mount = &mounts.expect("a list").last().expect("a mount")["transforms"][0];
    assert_eq!(
        (&mount["header"]["frame_id"], &mount["child_frame_id"]),
        (&"base_link".into(), &"laser".into())
    );
    let place = &mount["transform"];
    let mount = planar(&place["translation"], &place["rotation"]);
    let told = [MOUNT.x, MOUNT.y, MOUNT.theta];
    assert_eq!(
        [mount.x, mount.y, mount.theta].map(|value| value as f32),
        told
    );
}

fn check(
    received: &Value,
    said: &[telemetry::Pose],
    got: &[u8],
    drive: &Drive,
    map: &ros_map::Map,
) {
    let list = |name: &str| received["received"][name].as_array().expect("a list");
    println!("of {} poses, received:", said.len());
    for name in [
        "/odom",
        "/tf",
        "/tf_static",
        "/scan",
        "/map",
        "/diagnostics",
    ] {
        println!("  {name}: {}", list(name).len());
    }
    println!("  {} poses of the wheels sent", received["sent"]);
    // Poses: the bits that the board sent, in order, each once.
    let odom = list("/odom");
    assert!(odom.len() > 40, "{} of {} poses", odom.len(), said.len());
    let start = truth(drive, 0.0);
    let mut next = said.iter();
    let mut lags = Vec::new();
    let mut worst: f64 = 0.0;
    let mut times = Vec::new();
    for message in odom {
        assert_eq!(message["header"]["frame_id"], "odom");
        assert_eq!(message["child_frame_id"], "base_link");
        let pose = &message["pose"]["pose"];
        let at = planar(&pose["position"], &pose["orientation"]);
        let of = next.find(|said| said.pose[..2] == [at.x as f32, at.y as f32]);
        let of = of.expect("a pose that the board said, after the one before");
        assert!(
            (at.theta - f64::from(of.pose[2])).abs() < 1e-7,
            "{message} {of:?}"
        );
        let six = message["pose"]["covariance"].as_array().expect("a list");
        let [xx, xy, yy, xt, yt, tt] = of.covariance;
        for (k, value) in [
            (0, xx),
            (1, xy),
            (6, xy),
            (7, yy),
            (5, xt),
            (30, xt),
            (11, yt),
            (31, yt),
            (35, tt),
        ] {
            assert_eq!(number(&six[k]) as f32, value, "covariance {k}");
        }
        for k in [14, 21, 28] {
            assert_eq!(number(&six[k]), 1e6, "covariance {k}");
        }
        // The lidar's clock is the drive's.
        let seconds = f64::from(of.time_us) * 1e-6;
        worst = worst.max(start.between(truth(drive, seconds)).between(at).distance());
        lags.push(ns(message) as f64 * 1e-9 - seconds);
        times.push((ns(message), seconds));
    }
    assert!(worst < 0.05, "{worst} m off");
    assert!(times.is_sorted(), "stamps step back");
    // What DDS itself says about when a message was written, by which recorders sort.
    let written: Vec<i64> = odom
        .iter()
        .filter_map(|message| message["source_ns"].as_i64())
        .collect();
    let late = written
        .iter()
        .zip(&times)
        .map(|(written, (stamp, _))| written - stamp);
    let late: Vec<i64> = late.collect();
    assert!(
        late.len() == odom.len() && late.iter().all(|ns| (0..60_000_000_000).contains(ns)),
        "{late:?}"
    );
    let [least, most] = [f64::min, f64::max]
        .map(|of: fn(f64, f64) -> f64| lags.iter().copied().reduce(of).expect("some"));
    println!(
        "poses are at most {:.1} mm off, stamps wander by {:.1} ms",
        1e3 * worst,
        1e3 * (most - least)
    );
    // The same poses as transforms.
    let transforms: Vec<&Value> = list("/tf")
        .iter()
        .map(|message| &message["transforms"][0])
        .collect();
    let mut same = 0;
    for message in odom {
        let of = transforms
            .iter()
            .find(|transform| ns(transform) == ns(message));
        let Some(of) = of else {
            continue;
        };
        assert_eq!(
            (&of["header"]["frame_id"], &of["child_frame_id"]),
            (&"odom".into(), &"base_link".into())
        );
        assert_eq!(
            of["transform"]["translation"]["x"],
            message["pose"]["pose"]["position"]["x"]
        );
        assert_eq!(
            of["transform"]["rotation"],
            message["pose"]["pose"]["orientation"]
        );
        same += 1;
    }
    assert!(10 * same > 9 * odom.len(), "{same} of {}", odom.len());
    is_at_mount(received);
    // Scans: each beam ends at a wall, from where the lidar was when it was measured.
    let scans = list("/scan");
    assert!(scans.len() > 40, "{} scans", scans.len());
    let [right, mirrored] = [1.0, -1.0].map(|sense| share_at_walls(scans, &times, sense, drive));
    println!(
        "{:.1} % of the beams end at a wall, of their mirror image {:.1} %",
        100.0 * right,
        100.0 * mirrored
    );
    assert!(right > 0.95 && mirrored < 0.5);
    // The map, which was published before anybody listened.
    let [grid] = &list("/map")[..] else {
        panic!("one map");
    };
    let shape = map.shape();
    assert_eq!(grid["info"]["width"], shape.width());
    assert_eq!(grid["info"]["height"], shape.height());
    let count = |value: i64| {
        grid["data"]
            .as_array()
            .expect("a list")
            .iter()
            .filter(|cell| **cell == value)
            .count()
    };
    assert!(
        count(0) > 1000
            && count(100) > 100
            && count(0) + count(100) + count(-1) == map.cells().len()
    );
    // Diagnostics: all is well.
    let last = &list("/diagnostics").last().expect("diagnostics")["status"][0];
    assert_eq!(last["message"], "the pose is measured", "{last}");
    // The wheels, as the board gets them.
    let sent = received["sent"].as_u64().expect("a number");
    let frames: Vec<&[u8]> = got.split_inclusive(|&byte| byte == 0).collect();
    let arrived = (0..sent)
        .filter(|&k| {
            let mut commands = Commands::new();
            commands.wheels(Pose::new(0.25 * k as f32, -0.5, -0.6));
            frames.contains(&commands.bytes())
        })
        .count();
    println!("{arrived} poses of the wheels reached the board");
    assert!(
        sent > 40 && 10 * arrived as u64 > 9 * sent,
        "{arrived} of {sent}"
    );
}

/// Share of the ranges that end within 6 cm of where the world's wall is; with `sense` -1 as if bearings ran the other way.
fn share_at_walls(scans: &[Value], times: &[(i64, f64)], sense: f64, drive: &Drive) -> f64 {
    let (mut near, mut all) = (0, 0);
    for scan in scans {
        assert_eq!(scan["header"]["frame_id"], "laser");
        let Some(&(_, end)) = times.iter().find(|(stamp, _)| *stamp == ns(scan)) else {
            continue;
        };
        let [first, step, each] =
            ["angle_min", "angle_increment", "time_increment"].map(|name| number(&scan[name]));
        // An LD06 turns clockwise, ten times a second.
        assert!(
            step > 0.0 && each < 0.0 && (0.09..0.11).contains(&number(&scan["scan_time"])),
            "{step} {each}"
        );
        for (k, range) in scan["ranges"]
            .as_array()
            .expect("a list")
            .iter()
            .enumerate()
        {
            let range = number(range);
            if !range.is_finite() {
                continue;
            }
            let robot = truth(drive, end + each * k as f64);
            let lidar = robot.then(TruePose::new(f64::from(MOUNT.x), 0.0, 0.0));
            let bearing = lidar.theta + sense * (first + step * k as f64);
            let towards = [libm::cos(bearing), libm::sin(bearing)];
            let wall = drive.world.cast([lidar.x, lidar.y], towards);
            all += 1;
            near += i32::from(wall.is_some_and(|wall| (wall - range).abs() < 0.06));
        }
    }
    assert!(all > 10_000, "{all} beams");
    f64::from(near) / f64::from(all)
}
