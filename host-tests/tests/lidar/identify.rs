//! Which sensor is it, and what is wrong with the line.

use beamfix::lidar::identify::{Hint, hints, identify};
use beamfix::lidar::{Family, Model};
use beamfix_sim::encoder::{self, Echo, damage};
use host_tests::shared;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// About a second of a sensor's bytes in a room.
fn second(model: &Model) -> Vec<u8> {
    let mut sensor = encoder::for_model(model);
    let mut line = Vec::new();
    while sensor.next_time_us() < 1e6 {
        let mut look = |time_us: f64, bearing: f64| {
            let range_mm = 1500.0 + 700.0 * (2.0 * bearing).sin() + 30.0 * (time_us * 1e-5).cos();
            (bearing.sin() < 0.97).then_some(Echo {
                range_mm,
                intensity: (40.0 * (3.0 + bearing.cos())) as u8,
            })
        };
        sensor.fire(&mut look, &mut line);
    }
    line
}

/// What can be told of a family from its frames alone.
fn told(family: Family) -> String {
    match family {
        Family::Ydlidar(samples) => format!("ydlidar {}", samples.bytes),
        Family::Ldrobot(_) => "ldrobot".into(),
        family => format!("{family:?}"),
    }
}

#[test]
fn every_encoder_is_recognised() {
    for model in Model::ALL {
        let bytes = second(model);
        let found = identify(&bytes).unwrap_or_else(|| panic!("{}: nothing found", model.name));
        assert_eq!(
            told(found.model.family),
            told(model.family),
            "{}",
            model.name
        );
        let coverage = f64::from(found.survey.covered_bytes) / bytes.len() as f64;
        assert!(coverage > 0.9, "{}: {coverage}", model.name);
        let none: Vec<Hint> = hints(model, &bytes).collect();
        assert_eq!(none, [], "{}", model.name);
        // Also in the middle of a frame and on a bad line.
        let mut bad = bytes[17..].to_vec();
        damage::hit(&mut bad, 20, &mut ChaCha8Rng::seed_from_u64(1));
        let found = identify(&bad).unwrap_or_else(|| panic!("{}: nothing found", model.name));
        assert_eq!(
            told(found.model.family),
            told(model.family),
            "{} damaged",
            model.name
        );
    }
    // Models of one family that their pace tells apart.
    for model in [
        Model::LDROBOT_LD06,
        Model::LDROBOT_LD14,
        Model::LDROBOT_LD14P,
        Model::LDROBOT_STL19P,
        Model::LDROBOT_STL27L,
        Model::LDROBOT_LDS02,
    ] {
        let found = identify(&second(&model)).expect("found");
        assert_eq!(found.model.name, model.name);
    }
}

#[test]
fn every_capture_is_recognised() {
    for (file, expected) in [
        ("ld19-20240828.bin", Model::LDROBOT_LD06),
        ("ydlidar-x4-b.bin", Model::YDLIDAR_X4),
        ("ydlidar-g2-packet-a.bin", Model::YDLIDAR_TMINI),
        ("rplidar-a1-standard.bin", Model::RPLIDAR_SCAN),
        ("rplidar-a1-room-0001.bin", Model::RPLIDAR_SCAN),
        ("rplidar-a1-room-0004.bin", Model::RPLIDAR_SCAN),
        ("rplidar-express-capsules.bin", Model::RPLIDAR_EXPRESS),
        ("xv11-fw24-first-half.bin", Model::NEATO_XV11),
        ("xv11-fw21-a.bin", Model::NEATO_XV11_EARLY),
        ("camsense-x1-a.bin", Model::CAMSENSE_X1),
        ("urg-04lx-md.txt", Model::HOKUYO_URG04LX),
        ("doc-ld06-frame.bin", Model::LDROBOT_LD06),
        ("doc-delta-2a-frame.bin", Model::DELTA_2A),
    ] {
        let Some(path) = shared::file(&format!("datasets/serial/{file}")) else {
            continue;
        };
        let bytes = std::fs::read(path).expect("readable");
        let found = identify(&bytes).unwrap_or_else(|| panic!("{file}: nothing found"));
        assert_eq!(told(found.model.family), told(expected.family), "{file}");
        if file.starts_with("urg") {
            assert_eq!(hints(&expected, &bytes).next(), None, "{file}");
        }
    }
}

#[test]
fn plain_words_where_something_is_wrong() {
    let all = |model: &Model, bytes: &[u8]| hints(model, bytes).collect::<Vec<_>>();
    assert_eq!(all(&Model::LDROBOT_LD06, &[]), [Hint::Silence]);

    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let noise: Vec<u8> = (0..20_000).map(|_| rng.random()).collect();
    assert_eq!(identify(&noise), None);
    assert_eq!(all(&Model::LDROBOT_LD06, &noise), [Hint::NothingFits]);

    let ld06 = second(&Model::LDROBOT_LD06);
    let swallowed: Vec<u8> = ld06
        .iter()
        .copied()
        .filter(|byte| !matches!(byte, 0x11 | 0x13))
        .collect();
    assert!(all(&Model::LDROBOT_LD06, &swallowed).contains(&Hint::FlowControl));
    let seven: Vec<u8> = ld06.iter().map(|byte| byte & 0x7f).collect();
    assert!(all(&Model::LDROBOT_LD06, &seven).contains(&Hint::SevenBits));
    assert!(
        matches!(all(&Model::YDLIDAR_X4, &ld06)[..], [Hint::OtherModel { found }] if found.name == "ld06")
    );

    let tmini = second(&Model::YDLIDAR_TMINI);
    let found = all(&Model::YDLIDAR_X4, &tmini);
    assert!(
        matches!(
            found[..],
            [Hint::SampleSize {
                bytes: 3,
                errors_gone_percent: 50..
            }]
        ),
        "{found:?}"
    );
    println!("{}", found[0]);

    let mut bad = ld06;
    damage::hit(&mut bad, 40, &mut rng);
    assert!(matches!(
        all(&Model::LDROBOT_LD06, &bad)[..],
        [Hint::Damaged { .. }]
    ));
}

#[test]
fn flow_control_in_the_recording_is_noticed() {
    let Some(path) = shared::file("datasets/serial/ld19-20240828.bin") else {
        return;
    };
    let bytes = std::fs::read(path).expect("readable");
    assert!(hints(&Model::LDROBOT_LD06, &bytes).any(|hint| hint == Hint::FlowControl));
}
