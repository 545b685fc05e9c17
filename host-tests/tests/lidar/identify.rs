//! Which sensor is it, and what is wrong with the line.

use beamfix::lidar::identify::{Hint, hints, identify};
use beamfix::lidar::model::Camsense;
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
        Family::Camsense(sensor) => format!("camsense {}", sensor == Camsense::T2),
        Family::RplidarDense | Family::RplidarExpress => "capsules".into(),
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
        ("coin-d4-first-half.bin", Model::COIN_D4),
        ("lds006-steady-first-half.bin", Model::LDS006),
        ("lds006-spinup-first-half.bin", Model::LDS006),
        ("xv11-in-log-text-first-half.bin", Model::NEATO_XV11),
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
    // Of what looks like a frame's start one in 256 passes a check code of 8 bits.
    for length in [300, 3_000, 30_000, 100_000] {
        for seed in 0..20 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let noise: Vec<u8> = (0..length).map(|_| rng.random()).collect();
            let found = identify(&noise).map(|found| (found.model.name, found.survey));
            assert_eq!(found, None, "{length} bytes, seed {seed}");
        }
    }
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

/// Text that a person, a logger or a GPS receiver writes: of its lines one in 64 ends in SCIP's check character.
#[test]
fn text_is_nobodys_measurements() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let hex_dump: String = (0..4000)
        .map(|k| {
            let row: Vec<String> = (0..16)
                .map(|_| format!("{:02x}", rng.random::<u8>()))
                .collect();
            format!("{:08x}: {}\n", 16 * k, row.join(" "))
        })
        .collect();
    let positions: String = (0..4000)
        .map(|k| {
            let line = format!(
                "GPGGA,{:06},4807.038,N,01131.{:03},E,1,08,0.9,545.4,M",
                k,
                k % 997
            );
            let code = line.bytes().fold(0, |a, b| a ^ b);
            format!("${line}*{code:02X}\r\n")
        })
        .collect();
    let log: String = (0..4000)
        .map(|k| {
            let warns = if k % 3 == 0 {
                "warning: late by"
            } else {
                "took"
            };
            format!(
                "[{k:>6}.{:03}] control loop {warns} {} us\n\n",
                k % 1000,
                k * 37 % 5003
            )
        })
        .collect();
    for (name, text) in [
        ("hex dump", hex_dump),
        ("positions", positions),
        ("log", log),
    ] {
        let found = identify(text.as_bytes());
        assert_eq!(found, None, "{name}");
    }
}

/// Models that bytes cannot tell apart are all named.
#[test]
fn what_may_as_well_be_is_named() {
    let names = |bytes: &[u8]| -> (String, Vec<&str>) {
        let found = identify(bytes).expect("found");
        let others = found.alternatives().map(|model| model.name).collect();
        (found.model.name.into(), others)
    };
    for (model, expected) in [
        (Model::LDROBOT_LD19, "ld06 ld19 stl19p ms200"),
        (Model::LDROBOT_LD14P_2300, "ld14 ld14p-2300 lds02"),
        (Model::LDROBOT_STL27L, "stl27l"),
        (Model::RPLIDAR_C1_SCAN, "rplidar-c1-scan"),
        (Model::RPLIDAR_SCAN, "rplidar-scan"),
        (Model::RPLIDAR_C1, "rplidar-c1"),
        (Model::RPLIDAR_DENSE, "rplidar-dense"),
        (Model::HOKUYO_UTM30LX, "utm-30lx ust-10lx"),
        (Model::CAMSENSE_X1, "camsense-x1"),
        (Model::CAMSENSE_T2, "camsense-t2"),
        (Model::MYSTERY_360, "mystery-360"),
    ] {
        let (found, mut others) = names(&second(&model));
        others.push(&found);
        others.sort_unstable();
        let mut expected: Vec<&str> = expected.split(' ').collect();
        expected.sort_unstable();
        assert_eq!(others, expected, "{}", model.name);
    }
    if let Some(path) = shared::file("datasets/serial/ld19-20240828.bin") {
        let (found, others) = names(&std::fs::read(path).expect("readable"));
        assert!(
            found == "ld19" || others.contains(&"ld19"),
            "{found} {others:?}"
        );
    }
}
