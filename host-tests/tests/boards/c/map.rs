//! Mapping by the C example: Rust's poses and Rust's map, here and on an emulated board with as much RAM as it says.

use std::{
    fs::{self, File},
    process::Command,
};

use beamfix::{
    Grid, OdometryConfig, Pipeline, Pose, Revolution,
    grid::{
        Shape,
        occupancy::{self, UpdateConfig},
    },
    lidar::{Model, parsers},
    pipeline::{Estimate as _, Estimator as _, Mapper},
    slam::{SLICE, SlamConfig},
};
use beamfix_sim::{
    drive::{Settings, drive},
    encoder::ld06::Sensor,
};

use super::cross::{BOARDS, emulate};
use super::tools::{archive, folder, has, run, sources};

/// As `boards/c` has it.
const BEAMS: usize = 1100;
type Robot = Mapper<BEAMS, 224, 512, 880, 144, 360>;
/// Cells of the example's map in a row.
const SIDE: u32 = 200;

fn capture() -> Vec<u8> {
    let settings = Settings {
        seconds: 30.0,
        ..Settings::DEFAULT
    };
    drive(&settings, &mut Sensor::ld06()).bytes
}

/// FNV-1a.
fn hashed(hash: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(hash, |hash, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// What the C example prints, by the same pipeline in Rust.
fn expected(bytes: &[u8]) -> String {
    const START: u64 = 0xcbf2_9ce4_8422_2325;
    let model = &Model::LDROBOT_LD06;
    let mapper = Robot::new(OdometryConfig::for_model(model), SlamConfig::DEFAULT);
    let mut pipeline = Box::new(Pipeline::<_, _, BEAMS>::new(
        parsers::Ldrobot::for_model(model),
        mapper,
    ));
    pipeline.set_time(0);
    let (mut poses_hash, mut poses) = (START, 0u32);
    let mut rest = bytes;
    while !rest.is_empty() {
        let mut stepped = false;
        let taken = pipeline.push_packet(rest, &mut |revolution: Revolution<'_, Robot, BEAMS>| {
            let pose = revolution.step.pose().unwrap_or(Pose::IDENTITY);
            for number in [pose.x, pose.y, pose.theta] {
                poses_hash = hashed(poses_hash, &number.to_le_bytes());
            }
            poses += 1;
            stepped = true;
        });
        rest = &rest[taken..];
        if stepped {
            pipeline.tracker_mut().estimator_mut().work(SLICE);
        }
    }
    let mapper = pipeline.tracker_mut().estimator_mut();
    while !mapper.work(SLICE) {}
    let map = mapper.slam_mut();
    let (low, _) = map.extent(12.0).expect("there are keyframes");
    let corner = Pose::new(low.x - 0.2, low.y - 0.2, 0.0);
    let shape = Shape::new(SIDE, SIDE, 0.1, corner).expect("a grid");
    let mut grid = Grid::new(shape, vec![occupancy::UNKNOWN; shape.len()]).expect("a byte a cell");
    let slots: Vec<u16> = map.keyframes().map(|(_, slot, _)| slot).collect();
    for &slot in &slots {
        map.draw(slot, &mut grid, &UpdateConfig::DEFAULT);
    }
    occupancy::decide(grid.cells_mut());
    let cells = grid.cells();
    let occupied = cells.iter().filter(|&&cell| occupancy::is_occupied(cell));
    let occupied = occupied.count();
    assert!(
        poses > 250 && slots.len() > 10 && occupied > 300,
        "{poses} poses, {} keyframes, {occupied} cells",
        slots.len()
    );
    let map_hash = hashed(START, cells);
    format!("{poses_hash:016x} {poses:08x} {map_hash:016x} {occupied:08x}\n")
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the library is always a release build"
)]
fn the_c_example_maps_as_rust_does_here_and_on_a_board() {
    let folder = folder("map");
    let bytes = capture();
    fs::write(folder.join("input.bin"), &bytes).expect("the capture");
    let expected = expected(&bytes);
    let examples = sources().join("examples");
    if has("cc") {
        let program = folder.join("map");
        run(Command::new("cc")
            .args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-O1", "-I"])
            .arg(sources().join("include"))
            .args(["map.c", "platform_pc.c"].map(|name| examples.join(name)))
            .arg(archive("host"))
            .arg("-o")
            .arg(&program));
        let output = Command::new(program)
            .stdin(File::open(folder.join("input.bin")).expect("the capture"))
            .output()
            .expect("it starts");
        assert_eq!(String::from_utf8_lossy(&output.stdout), expected);
    }
    let board = BOARDS.iter().find(|board| board.name == "m4f");
    let board = board.expect("it is there").with_ram(RAM);
    if let Some(program) = board.compile(&folder, &[&examples.join("map.c")]) {
        assert_eq!(emulate(&board, &program, &folder), expected);
    }
}

/// Bytes of RAM: the mapping, 40 KB of cells, and 10 KB for the stack.
const RAM: u32 = 208_000 + 40_000 + (10 << 10);
