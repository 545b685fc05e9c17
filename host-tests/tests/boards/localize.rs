//! Localization from a table in flash: a robot that is moved by hand once notices it and is found again.

use beamfix::{
    Localizer, LocalizerConfig, MapLocalizer, OdometryConfig, Pipeline, Pose, Revolution,
    lidar::{Model, ld06::FRAME, parsers},
    localization::Verdict,
    matching::correlative::Pyramid,
    pipeline::Estimator as _,
    sensor_model::likelihood_field::{FieldModel, LikelihoodField, Profile, stored},
};
use beamfix_app::{
    BEAMS, Lidar as _, Row,
    link::Receiver,
    map::{self, LocalizationWith},
    telemetry::{self, Reset, Telemetry},
};
use beamfix_sim::drive::{Settings, drive};
use beamfix_sim::encoder::ld06::Sensor;
use host_tests::{
    board::{
        Board,
        emulator::{self, Count},
    },
    formats::ros_map,
    report::hash::PoseHash,
};

/// Beams and points of the C library's localization.
const C_BEAMS: usize = 1100;
const POINTS: usize = map::POINTS;
/// Bytes that the firmware's program takes at a time: `boards/emulated/src/localize.rs`.
const PIECE: usize = 32;

/// A table of the simulated flat, and bytes of a lidar that is carried elsewhere after five seconds.
pub fn scene() -> (Vec<u8>, Vec<u8>) {
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
pub fn expected(table: &[u8], bytes: &[u8]) -> String {
    let field = stored::parse(table).expect("a field");
    let mut maxima = vec![0; Pyramid::bytes(field.grid().shape())];
    let pyramid = Pyramid::new(field, &mut maxima).expect("room");
    let model = &Model::LDROBOT_LD06;
    let points = OdometryConfig::for_model(model).points;
    let localizer = Localizer::<POINTS>::new(pyramid, LocalizerConfig::DEFAULT);
    let robot = MapLocalizer::<C_BEAMS, POINTS>::new(localizer, points);
    let mut pipeline = Pipeline::<_, _, C_BEAMS>::new(parsers::Ldrobot::for_model(model), robot);
    let (mut hash, mut poses, mut known) = (PoseHash::new(), 0u32, false);
    let mut rest = bytes;
    while !rest.is_empty() {
        pipeline.set_time(0);
        let mut stepped = false;
        let taken = pipeline.push_packet(rest, &mut |revolution: Revolution<
            '_,
            MapLocalizer<'_, C_BEAMS, POINTS>,
            C_BEAMS,
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

/// What the firmware sends over these bytes.
fn sent_over(table: Vec<u8>, bytes: &[u8]) -> Vec<u8> {
    type Ld06 = Row<0>;
    let shape = *stored::parse(&table).expect("a field").grid().shape();
    let maxima = vec![0; Pyramid::bytes(&shape)].leak();
    let mut app = Box::new(
        LocalizationWith::<Ld06, BEAMS>::in_map(&Ld06::CONFIG, Ld06::PARSER, table.leak(), maxima)
            .expect("a table and room for its maxima"),
    );
    let mut all = app.ready(Reset::Other).to_vec();
    for mut rest in bytes.chunks(PIECE) {
        while !rest.is_empty() {
            let (taken, sent) = app.lidar(rest);
            rest = &rest[taken..];
            all.extend_from_slice(sent);
            if !sent.is_empty() {
                while !app.work(500_000) {}
            }
        }
    }
    all
}

/// The firmware's application over the same table and bytes: its telemetry holds the pipeline's poses, tells that they are
/// searched for, and says which task it does.
#[test]
fn the_firmware_finds_its_pose_in_a_map_and_again_after_it_was_carried_away() {
    let (table, bytes) = scene();
    let wanted = expected(&table, &bytes);
    let mut receiver = Receiver::new();
    let (mut hash, mut poses, mut searched, mut task) = (PoseHash::new(), 0u32, 0, None);
    for byte in sent_over(table, &bytes) {
        let pose = match receiver.push::<Telemetry>(byte) {
            Some(Telemetry::Ready(ready)) => {
                task = Some(ready.task);
                continue;
            }
            Some(Telemetry::Pose(pose)) => pose,
            _ => continue,
        };
        let [x, y, theta] = pose.pose;
        match pose.verdict {
            telemetry::Verdict::Measured => {
                hash.push(Pose { x, y, theta });
                poses += 1;
            }
            telemetry::Verdict::Searching | telemetry::Verdict::Choosing => {
                assert_eq!(pose.pose, [0.0; 3]);
                searched += 1;
            }
            _ => {}
        }
    }
    assert_eq!(task, Some(telemetry::Task::Localization));
    // Lost once.
    assert_eq!(format!("{hash} {poses:08x} 00000001 1\n"), wanted);
    // At the start, and after it was carried.
    assert!(searched >= 2, "{searched}");
}

/// The same firmware with the table in its flash, on two emulated boards: it sends what it sends here, byte for byte.
#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn two_emulated_boards_send_the_same_with_the_map_in_their_flash() {
    let (table, bytes) = scene();
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    let field = folder.join("localize.field");
    std::fs::write(&field, &table).expect("the table");
    let here = sent_over(table, &bytes);
    for name in ["m4f", "rv32"] {
        let board = Board::named(name).expect("it is there");
        let there = board
            .firmware
            .build_in_map(&field)
            .and_then(|program| emulator::run(board, &program, &bytes, Count::None))
            .unwrap_or_else(|error| panic!("{error:#}"));
        println!("{name}: {} bytes", there.len());
        assert!(here == there, "{name} sends something else");
    }
}
