//! One pipeline: what a board makes of bytes, wheels and gyroscope, the tool makes of a recording of them.

use beamfix::geometry::{EgoMotion, Pose};
use beamfix::odometry::{Odometry, OdometryConfig};
use beamfix::scan::Scan;
use beamfix_app::BEAMS;
use beamfix_sim::encoder::ld06::Sensor;
use beamfix_sim::{Drive, Settings, TruePose, drive};
use host_tests::board::Replay;
use host_tests::board::commands::Commands;
use host_tests::formats::capture::log::{self, Turn};
use host_tests::golden::difference;
use host_tests::pipeline::Pipeline;

/// A drive with the lidar at the robot's centre, as the firmware has it.
fn driven(seconds: f64) -> Drive {
    let settings = Settings {
        seconds,
        mount: TruePose::new(0.0, 0.0, 0.0),
        ..Settings::DEFAULT
    };
    drive(&settings, &mut Sensor::ld06())
}

/// Poses of the firmware's application.
fn on_board(bytes: &[u8]) -> Vec<Pose> {
    let mut commands = Commands::new();
    commands.lidar(bytes);
    let replay = Replay::on_host(&commands, BEAMS);
    let poses = replay.poses().map(|pose| {
        let [x, y, theta] = pose.pose;
        Pose { x, y, theta }
    });
    poses.collect()
}

fn turns(bytes: &[u8]) -> Vec<Turn> {
    log::turns("ld06", bytes).expect("an LD06").0
}

#[test]
fn an_interrupted_recording_gives_the_boards_poses() {
    let drive = driven(8.0);
    let frames: Vec<&[u8]> = drive
        .frames
        .iter()
        .scan(0, |start, &(end, _)| {
            let frame = &drive.bytes[*start..end];
            *start = end;
            Some(frame)
        })
        .collect();
    // 375 frames a second; 1.5 s are 15 revolutions, so that what follows goes on in the same direction.
    for (pause, lost) in [(0, 0), (562, 1), (375, 0)] {
        for at in [1000, 1010, 1037] {
            let bytes = [&frames[..at], &frames[at + pause..]].concat().concat();
            let mut pipeline = Pipeline::<BEAMS>::new(OdometryConfig::DEFAULT);
            let poses: Vec<Pose> = turns(&bytes)
                .iter()
                .map(|turn| pipeline.step(&turn.beams, None).pose)
                .collect();
            let board = on_board(&bytes);
            assert_eq!(difference(&board, &poses), None, "{pause} frames from {at}");
            assert!(poses.len() + lost + pause / 37 >= 76, "{}", poses.len());
        }
    }
}

#[test]
fn the_poses_do_not_depend_on_the_capacity_that_holds_the_beams() {
    fn poses<const N: usize>(turns: &[Turn]) -> Vec<Pose> {
        let mut odometry = Box::new(Odometry::<N>::new(OdometryConfig::DEFAULT));
        let mut scan = Box::new(Scan::<N>::new());
        let follow = turns.iter().map(|turn| {
            scan.clear();
            for &beam in &turn.beams {
                scan.push(beam).expect("room");
            }
            odometry.update(&scan, EgoMotion::UNKNOWN).pose
        });
        follow.collect()
    }
    let turns = turns(&driven(12.0).bytes);
    let wanted = poses::<456>(&turns);
    assert_eq!(difference(&wanted, &poses::<457>(&turns)), None);
    assert_eq!(difference(&wanted, &poses::<720>(&turns)), None);
    assert_eq!(difference(&wanted, &poses::<1024>(&turns)), None);
    // One that does not hold all directions has others.
    assert!(difference(&wanted, &poses::<451>(&turns)).is_some());
}
