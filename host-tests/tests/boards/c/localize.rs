//! Localization from a table in flash, by the C example: moved by hand once, found again, with Rust's bits, here and on emulated boards.

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
    process::Command,
};

use beamfix::{
    Localizer, LocalizerConfig, MapLocalizer, OdometryConfig, Pipeline, Revolution,
    lidar::{Model, ld06::FRAME, parsers},
    localization::Verdict,
    matching::correlative::Pyramid,
    pipeline::Estimator as _,
    sensor_model::likelihood_field::{FieldModel, LikelihoodField, Profile, stored},
};
use beamfix_sim::drive::{Settings, drive};
use beamfix_sim::encoder::ld06::Sensor;
use host_tests::{formats::ros_map, report::hash::PoseHash};

use super::cross::{BOARDS, emulate};
use super::tools::{archive, folder, has, run, sources};

/// Beams and points of the C library's localization.
const BEAMS: usize = 1100;
const POINTS: usize = 96;

/// A table of the simulated flat, and bytes of a lidar that is carried elsewhere after five seconds.
fn scene() -> (Vec<u8>, Vec<u8>) {
    let settings = Settings {
        seconds: 45.0,
        ..Settings::DEFAULT
    };
    let drive = drive(&settings, &mut Sensor::ld06());
    let inside = [drive.moments[0].truth.x, drive.moments[0].truth.y];
    let (mut low, mut high) = (inside, inside);
    for moment in &drive.moments {
        for (k, at) in [moment.truth.x, moment.truth.y].into_iter().enumerate() {
            low[k] = low[k].min(at - 3.0);
            high[k] = high[k].max(at + 3.0);
        }
    }
    let map = ros_map::of_world(&drive.world, low, high, 0.05, inside).expect("a map");
    let squares = ros_map::squares(&map, beamfix::grid::occupancy::is_occupied);
    let profile = Profile::new(&FieldModel::DEFAULT);
    let cells = vec![0; map.shape().len()];
    let field =
        LikelihoodField::from_map(&map.as_slice(), &squares, &profile, cells).expect("a field");
    let mut table = stored::header(&field.as_slice()).to_vec();
    table.extend_from_slice(field.grid().cells());
    // By hand from where it is after 5 s to where it would be after 30 s.
    let second = 4500 / 12 * FRAME;
    let mut bytes = drive.bytes[..5 * second].to_vec();
    bytes.extend_from_slice(&drive.bytes[30 * second..38 * second]);
    (table, bytes)
}

/// What the C example prints, by the same pipeline in Rust.
fn expected(table: &[u8], bytes: &[u8]) -> String {
    let field = stored::parse(table).expect("a field");
    let mut maxima = vec![0; Pyramid::bytes(field.grid().shape())];
    let pyramid = Pyramid::new(field, &mut maxima).expect("room");
    let model = &Model::LDROBOT_LD06;
    let points = OdometryConfig::for_model(model).points;
    let localizer = Localizer::<POINTS>::new(pyramid, LocalizerConfig::DEFAULT);
    let robot = MapLocalizer::<BEAMS, POINTS>::new(localizer, points);
    let mut pipeline = Pipeline::<_, _, BEAMS>::new(parsers::Ldrobot::for_model(model), robot);
    let (mut hash, mut poses, mut known) = (PoseHash::new(), 0u32, false);
    let mut rest = bytes;
    while !rest.is_empty() {
        pipeline.set_time(0);
        let mut stepped = false;
        let taken = pipeline.push_packet(rest, &mut |revolution: Revolution<
            '_,
            MapLocalizer<'_, BEAMS, POINTS>,
            BEAMS,
        >| {
            stepped = true;
            known = matches!(revolution.step.outcome, Verdict::Tracking(..));
            if let (true, Some(pose)) = (known, revolution.step.pose) {
                hash.push(pose);
                poses += 1;
            }
        });
        rest = &rest[taken..];
        while stepped && !pipeline.tracker_mut().estimator_mut().work(500_000) {}
    }
    let lost = pipeline.tracker().estimator().localizer().counters().lost;
    assert!(
        poses > 60 && lost == 1 && known,
        "{poses} poses known, lost {lost} times, known at the end: {known}"
    );
    format!("{hash} {poses:08x} {lost:08x} 1\n")
}

/// A folder with the table and the capture, and what is to be found.
fn prepared(name: &str) -> (PathBuf, String) {
    let folder = folder(name);
    let (table, bytes) = scene();
    fs::write(folder.join("field.bin"), &table).expect("the table");
    fs::write(folder.join("input.bin"), &bytes).expect("the capture");
    (folder, expected(&table, &bytes))
}

#[test]
fn c_finds_the_pose_in_a_map_and_again_after_it_was_carried_away() {
    let (folder, expected) = prepared("localize");
    if !has("cc") {
        return;
    }
    let examples = sources().join("examples");
    let program = folder.join("localize");
    run(Command::new("cc")
        .args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-O1", "-I"])
        .arg(sources().join("include"))
        .args(["localize.c", "table.S", "platform_pc.c"].map(|name| examples.join(name)))
        .arg(archive("host"))
        .arg("-o")
        .arg(&program)
        .current_dir(&folder));
    let input = File::open(folder.join("input.bin")).expect("the capture");
    let output = Command::new(program)
        .stdin(input)
        .output()
        .expect("it starts");
    assert_eq!(String::from_utf8_lossy(&output.stdout), expected);
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the library is always a release build"
)]
fn two_emulated_boards_find_it_in_a_map_in_flash_with_the_hosts_bits() {
    let (folder, expected) = prepared("localize-cross");
    let sources = ["localize.c", "table.S"].map(|name| sources().join("examples").join(name));
    let sources: Vec<&Path> = sources.iter().map(PathBuf::as_path).collect();
    // The map is larger than the smallest boards' flash.
    for board in (BOARDS.iter()).filter(|board| matches!(board.name, "m4f" | "rv32")) {
        if let Some(program) = board.compile(&folder, &sources) {
            assert_eq!(
                emulate(board, &program, &folder),
                expected,
                "{}",
                board.name
            );
        }
    }
}
