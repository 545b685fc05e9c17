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
    AppConfig, Firmware,
    link::Receiver,
    map::{self, InMap},
    telemetry::{self, Reset, Telemetry},
};
use beamfix_sim::drive::{Settings, drive};
use beamfix_sim::encoder::ld06::Sensor;
use host_tests::{formats::ros_map, report::hash::PoseHash};

/// Beams and points of the C library's localization, and the firmware's here.
const BEAMS: usize = 1100;
const POINTS: usize = map::POINTS;

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

/// The firmware's application over the same table and bytes: its telemetry holds the pipeline's poses, tells that they are
/// searched for, and says which task it does.
#[test]
fn the_firmware_finds_its_pose_in_a_map_and_again_after_it_was_carried_away() {
    let (table, bytes) = scene();
    let wanted = expected(&table, &bytes);
    let model = &Model::LDROBOT_LD06;
    let shape = *stored::parse(&table).expect("a field").grid().shape();
    let maxima = vec![0; Pyramid::bytes(&shape)].leak();
    let config = AppConfig::for_model(model);
    let config = AppConfig {
        odometry: OdometryConfig::for_model(model),
        ..config
    };
    let parser = parsers::Ldrobot::for_model(model);
    let mut app = Firmware::<_, InMap<BEAMS>, BEAMS>::in_map(&config, parser, table.leak(), maxima)
        .expect("a table and room for its maxima");
    let mut receiver = Receiver::new();
    let mut read = |sent: &[u8]| {
        let mut messages = Vec::new();
        for &byte in sent {
            match receiver.push::<Telemetry>(byte) {
                Some(Telemetry::Ready(ready)) => {
                    assert_eq!(ready.task, telemetry::Task::Localization);
                }
                Some(Telemetry::Pose(pose)) => messages.push(pose),
                _ => {}
            }
        }
        messages
    };
    read(app.ready(Reset::Other));
    let (mut hash, mut poses, mut searched) = (PoseHash::new(), 0u32, 0);
    let mut rest = &bytes[..];
    while !rest.is_empty() {
        let (taken, sent) = app.lidar(rest);
        let told = read(sent);
        rest = &rest[taken..];
        for told in &told {
            let [x, y, theta] = told.pose;
            match told.verdict {
                telemetry::Verdict::Measured => {
                    hash.push(Pose { x, y, theta });
                    poses += 1;
                }
                telemetry::Verdict::Searching | telemetry::Verdict::Choosing => {
                    assert_eq!(told.pose, [0.0; 3]);
                    searched += 1;
                }
                _ => {}
            }
        }
        while !told.is_empty() && !app.work(500_000) {}
    }
    // Lost once.
    assert_eq!(format!("{hash} {poses:08x} 00000001 1\n"), wanted);
    // At the start, and after it was carried.
    assert!(searched >= 2, "{searched}");
}
