//! The C programs on this computer: every misuse has its error, the poses are Rust's, no byte is touched that is not theirs.

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use beamfix::{
    Odometry, OdometryConfig, Pipeline, Revolution,
    lidar::{Model, parsers},
};
use beamfix_sim::drive::{Settings, drive};
use beamfix_sim::encoder::{self, ld06::Sensor};
use host_tests::report::hash::PoseHash;

use super::tools::{archive, folder, has, run, sources};

/// Beams of an object of the functions that end in `_small`.
const SMALL_BEAMS: usize = 384;

/// Bytes of a simulated LD06, carried for 20 s.
pub fn capture() -> Vec<u8> {
    let settings = Settings {
        seconds: 20.0,
        ..Settings::DEFAULT
    };
    drive(&settings, &mut Sensor::ld06()).bytes
}

/// What the C example prints for these bytes, by the same pipeline in Rust.
pub fn expected(bytes: &[u8]) -> String {
    let model = &Model::LDROBOT_LD06;
    let odometry = Odometry::<SMALL_BEAMS>::new(OdometryConfig::for_model(model));
    let mut pipeline = Pipeline::new(parsers::Ldrobot::for_model(model), odometry);
    let (mut hash, mut poses) = (PoseHash::new(), 0u32);
    pipeline.set_time(0);
    pipeline.push(bytes, &mut |revolution: Revolution<
        '_,
        Odometry<SMALL_BEAMS>,
        SMALL_BEAMS,
    >| {
        hash.push(revolution.step.pose);
        poses += 1;
    });
    assert!(poses > 150, "{poses} poses");
    format!("{hash} {poses:08x}\n")
}

/// Compiles one of the examples for this computer.
fn compile(name: &str, sources_of: &[&str], flags: &[&str]) -> Option<PathBuf> {
    if !has("cc") {
        return None;
    }
    let program = folder(name).join(name);
    let examples = sources().join("examples");
    run(Command::new("cc")
        .args([
            "-std=c99",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-pedantic",
            "-g",
            "-O1",
        ])
        .args(flags)
        .arg("-I")
        .arg(sources().join("include"))
        .args(sources_of.iter().map(|name| examples.join(name)))
        .arg(archive("host"))
        .arg("-o")
        .arg(&program));
    Some(program)
}

/// Runs a program, under valgrind where there is one; gives what it printed.
fn output_of(program: &Path, input: Stdio) -> String {
    let mut command = if has("valgrind") {
        let mut command = Command::new("valgrind");
        command
            .args(["--quiet", "--error-exitcode=77", "--leak-check=full"])
            .arg(program);
        command
    } else {
        Command::new(program)
    };
    let output = command.stdin(input).output().expect("it starts");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        output.status.success(),
        "{text}{}",
        String::from_utf8_lossy(&output.stderr)
    );
    text
}

#[test]
fn every_misuse_has_its_error() {
    if let Some(program) = compile("misuse", &["misuse.c"], &[]) {
        output_of(&program, Stdio::null());
    }
    // With the compiler's own checks of the C side's memory.
    if let Some(program) = compile(
        "misuse-asan",
        &["misuse.c"],
        &["-fsanitize=address,undefined"],
    ) {
        run(&mut Command::new(program));
    }
}

#[test]
fn the_example_finds_rusts_poses() {
    let Some(program) = compile("replay", &["replay.c", "platform_pc.c"], &[]) else {
        return;
    };
    let bytes = capture();
    let input = program.with_file_name("capture.bin");
    fs::write(&input, &bytes).expect("the capture");
    let input = File::open(input).expect("the capture");
    assert_eq!(output_of(&program, input.into()), expected(&bytes));
}

/// As the unit in `zero.c` tells it (0.01°): 37 quarters of a degree.
const ZERO_CDEG: u16 = 925;

/// Every pose of a YDLIDAR's bytes, its bits as text, by a parser for this model.
fn poses(model: &Model, bytes: &[u8]) -> String {
    const BEAMS: usize = 1100;
    let odometry = Odometry::<BEAMS>::new(OdometryConfig::for_model(model));
    let mut pipeline = Box::new(Pipeline::new(parsers::Ydlidar::for_model(model), odometry));
    let mut text = String::new();
    for (k, bytes) in bytes.chunks(256).enumerate() {
        // As `zero.c` has it.
        pipeline.set_time(15_677 * (k as u32 + 1));
        pipeline.push(bytes, &mut |revolution: Revolution<
            '_,
            Odometry<BEAMS>,
            BEAMS,
        >| {
            let pose = revolution.step.pose;
            let [x, y, theta] = [pose.x, pose.y, pose.theta].map(f32::to_bits);
            text += &format!("{x:08x} {y:08x} {theta:08x}\n");
        });
    }
    text
}

#[test]
fn the_zero_that_a_lidar_tells_at_its_start_turns_the_poses_as_in_rust() {
    let Some(program) = compile("zero", &["zero.c"], &[]) else {
        return;
    };
    let model = &Model::YDLIDAR_G2;
    let turned = Model {
        zero_cdeg: ZERO_CDEG,
        ..*model
    };
    let settings = Settings {
        seconds: 6.0,
        ..Settings::DEFAULT
    };
    let bytes = drive(&settings, &mut *encoder::for_model(&turned)).bytes;
    let input = program.with_file_name("input.bin");
    fs::write(&input, &bytes).expect("the capture");
    let said = |arguments: &[&str]| {
        let output = Command::new(&program)
            .args(arguments)
            .stdin(File::open(&input).expect("the capture"))
            .output()
            .expect("it starts");
        assert!(output.status.success(), "{output:?}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let [with, without] = [poses(&turned, &bytes), poses(model, &bytes)];
    let count = with.lines().count();
    assert!(count > 35 && with != without, "{count} poses");
    assert_eq!(said(&[]), with);
    assert_eq!(said(&["without"]), without);
}
