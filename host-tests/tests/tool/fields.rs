//! `field`, `learn` and `replay --mode localize` as they are called.

use std::fs;

use crate::common::tool::{beamfix, folder, json as json_of, text};
use beamfix::sensor_model::likelihood_field::stored;
use beamfix_sim::home;
use host_tests::formats::ros_map;
use host_tests::shared;

#[test]
fn a_map_becomes_a_table_for_flash() {
    let folder = folder("field-cli");
    let (low, high) = home::EXTENT;
    let map = ros_map::of_world(&home::home(), low, high, 0.05, home::INSIDE).expect("a map");
    let yaml = folder.join("home.yaml");
    ros_map::write(&map, &yaml).expect("written");
    let table = folder.join("home.field");
    let output = beamfix(&["field", text(&yaml), "--out", text(&table), "--json"]);
    assert!(output.status.success(), "{output:?}");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one object");
    let bytes = fs::read(&table).expect("written");
    assert_eq!(json["flash_bytes"], bytes.len());
    // A home of 20 m by 16 m in cells of 5 cm: 128 KB.
    assert!(bytes.len() <= 128 * 1024, "{} bytes", bytes.len());
    let field = stored::parse(&bytes).expect("a field");
    assert_eq!(
        (field.grid().shape().width(), field.grid().shape().height()),
        (400, 320)
    );
    let source = fs::read_to_string(folder.join("home.rs")).expect("written");
    assert!(source.contains(&format!("pub const FIELD: [u8; {}]", bytes.len())));
    let numbers = source
        .lines()
        .skip(2)
        .flat_map(|line| line.split(','))
        .filter_map(|n| n.parse::<u8>().ok());
    assert!(
        numbers.eq(bytes.iter().copied()),
        "the const is not the table"
    );
    let picture = image::open(folder.join("home.png")).expect("a picture");
    // With axes and a legend, 20 m by 16 m at one scale; surfaces glow, and what is unexplored is grey.
    assert_eq!(picture.width(), 1500);
    assert!(
        (1100..1500).contains(&picture.height()),
        "{}",
        picture.height()
    );
    let picture = picture.to_rgb8();
    let unexplored = |[r, g, b]: [u8; 3]| [r, g, b] == [90, 100, 120];
    let nothing_near = |[r, g, b]: [u8; 3]| r < 60 && g == 0 && b == 0;
    let surface = |[r, g, b]: [u8; 3]| r == 255 && g == 255 && (100..255).contains(&b);
    let count = |is: &dyn Fn([u8; 3]) -> bool| picture.pixels().filter(|p| is(p.0)).count();
    let counts = [count(&unexplored), count(&nothing_near), count(&surface)];
    assert!(counts.iter().all(|count| *count > 2000), "{counts:?}");
}

#[test]
fn a_bad_map_ends_with_one_line_and_status_2() {
    let folder = folder("field-cli-bad");
    let yaml = folder.join("bad.yaml");
    fs::write(
        &yaml,
        "image: bad.pgm\nresolution: 0.05\norigin: [0, .nan, 0]\n",
    )
    .expect("written");
    for arguments in [
        vec!["field", text(&yaml), "--out", "/dev/null"],
        vec!["field", "missing.yaml", "--out", "/dev/null"],
        vec!["learn", "missing.log"],
    ] {
        let output = beamfix(&arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
    }
}

#[test]
fn intel_is_learned_from_and_localized_in() {
    let (Some(corrected), Some(raw)) = (
        shared::file("datasets/logs/intel-corrected.log.gz"),
        shared::file("datasets/logs/intel.log.gz"),
    ) else {
        return;
    };
    let folder = folder("field-cli-intel");
    let (map, picture) = (folder.join("intel.yaml"), folder.join("model.png"));
    let output = beamfix(&[
        "learn",
        text(&corrected),
        "--keep-map",
        text(&map),
        "--picture",
        text(&picture),
        "--json",
    ]);
    assert!(output.status.success(), "{output:?}");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one object");
    println!("{json}");
    let steps: Vec<f64> = json["log_likelihood"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(serde_json::Value::as_f64)
        .collect();
    assert!(
        steps.len() >= 2 && steps.windows(2).all(|pair| pair[1] >= pair[0]),
        "{steps:?}"
    );
    // Cells of 5 cm, a SICK of 1 to 2 cm: between them, and more the flatter the beam.
    let sigma = |value: &serde_json::Value| value["model"]["sigma"].as_f64().expect("a number");
    assert!(
        (0.01..0.08).contains(&json["model"]["sigma"].as_f64().expect("a number")),
        "{json}"
    );
    let bins: Vec<f64> = json["by_incidence"]
        .as_array()
        .expect("a list")
        .iter()
        .map(sigma)
        .collect();
    assert!(bins.windows(2).all(|pair| pair[1] > pair[0]), "{bins:?}");
    assert!(json["model"]["z_hit"].as_f64().expect("a number") > 0.8);
    assert!(picture.exists());

    let trajectory = folder.join("localized.txt");
    let arguments = [
        "replay",
        text(&raw),
        "--mode",
        "localize",
        "--map",
        text(&map),
        "--trajectory",
        text(&trajectory),
        "--json",
    ];
    let output = beamfix(&arguments);
    assert!(output.status.success(), "{output:?}");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one object");
    println!("{json}");
    // It starts without a pose, and never loses it once it is found.
    assert_eq!(
        (&json["lost"], &json["searches"]),
        (&0.into(), &1.into()),
        "{json}"
    );
    assert!(
        json["tracked"].as_u64().expect("a number") >= 13_000,
        "{json}"
    );
    let lines = fs::read_to_string(&trajectory)
        .expect("written")
        .lines()
        .count();
    assert_eq!(json["scans"], lines);
}

#[test]
fn the_simulated_flat_is_a_map_to_find_oneself_in() {
    let folder = folder("field-simulated");
    let (yaml, table) = (folder.join("flat.yaml"), folder.join("flat.field"));
    let output = beamfix(&[
        "simulate",
        "--seconds",
        "15",
        "--out",
        text(&folder),
        "--ros-map",
        text(&yaml),
    ]);
    assert!(output.status.success(), "{output:?}");
    let output = beamfix(&["field", text(&yaml), "--out", text(&table)]);
    assert!(output.status.success(), "{output:?}");
    let log = folder.join("lidar.rec");
    let output = beamfix(&[
        "replay",
        text(&log),
        "--mode",
        "localize",
        "--map",
        text(&yaml),
        "--json",
    ]);
    assert!(output.status.success(), "{output:?}");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one object");
    println!("{json}");
    let number = |key: &str| json[key].as_u64().expect("a number");
    assert!(4 * number("tracked") >= 3 * number("scans"), "{json}");
    // The table that `field` wrote is the same map, and gives the same poses.
    let localized = |map: &str| {
        let arguments = [
            "replay",
            text(&log),
            "--mode",
            "localize",
            "--map",
            map,
            "--json",
        ];
        json_of(&beamfix(&arguments))
    };
    let from_table = localized(text(&table));
    assert_eq!(from_table["pose_hash"], json["pose_hash"], "{from_table}");
    // One that was made with another sigma is matched with that sigma.
    let wide = folder.join("wide.field");
    let output = beamfix(&["field", text(&yaml), "--sigma", "0.1", "--out", text(&wide)]);
    assert!(output.status.success(), "{output:?}");
    let from_wide = localized(text(&wide));
    assert_ne!(from_wide["pose_hash"], json["pose_hash"], "{from_wide}");
    let tracked = from_wide["tracked"].as_u64().expect("a number");
    assert!(2 * tracked >= number("scans"), "{from_wide}");
    // An address that cannot be written to is told, with status 2.
    let nowhere = folder.join("no/such/folder/flat.yaml");
    let output = beamfix(&[
        "simulate",
        "--seconds",
        "1",
        "--out",
        text(&folder),
        "--ros-map",
        text(&nowhere),
    ]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
}

#[test]
fn a_map_goes_in_and_is_never_drawn_over() {
    let folder = folder("field-maps-go-in");
    let yaml = folder.join("flat.yaml");
    let output = beamfix(&[
        "simulate",
        "--seconds",
        "5",
        "--out",
        text(&folder),
        "--ros-map",
        text(&yaml),
    ]);
    assert!(output.status.success(), "{output:?}");
    let (log, table) = (folder.join("lidar.rec"), folder.join("flat.field"));
    let output = beamfix(&["field", text(&yaml), "--out", text(&table)]);
    assert!(output.status.success(), "{output:?}");
    let damaged = folder.join("damaged.field");
    let mut bytes = fs::read(&table).expect("written");
    bytes.truncate(1000);
    fs::write(&damaged, bytes).expect("written");
    let drawn = folder.join("drawn.png");
    let _ = fs::remove_file(&drawn);
    let kept: Vec<_> = [&yaml, &yaml.with_extension("pgm"), &table]
        .map(|path| (path.clone(), fs::read(path).expect("written")))
        .into();
    //   arguments                                                     words of the refusal
    for (arguments, word) in [
        (vec!["--map", text(&yaml)], "--picture"),
        (vec!["--map", text(&drawn)], "--picture"),
        (vec!["--picture", text(&yaml)], ".png or .svg"),
        (vec!["--picture", text(&table)], ".png or .svg"),
        (vec!["--picture", text(&folder)], ".png or .svg"),
        (vec!["--mode", "localize"], "--map"),
        (
            vec!["--mode", "localize", "--map", text(&damaged)],
            "not a table of `field`",
        ),
        (vec!["--start", "0,0,0"], "--mode localize"),
    ] {
        let arguments = [vec!["replay", text(&log)], arguments].concat();
        let output = beamfix(&arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{arguments:?}: {stderr}");
        assert!(stderr.contains(word), "{arguments:?}: {stderr}");
    }
    let output = beamfix(&["field", text(&yaml), "--out", text(&yaml)]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    for (path, bytes) in kept {
        assert!(
            fs::read(&path).is_ok_and(|now| now == bytes),
            "{}",
            path.display()
        );
    }
    assert!(!drawn.exists(), "the old meaning of --map draws nothing");
    // What is drawn is of the kind that its name says.
    let vector = folder.join("drawn.svg");
    for (arguments, path, start) in [
        (vec![], &drawn, b"\x89PNG" as &[u8]),
        (
            vec!["--mode", "localize", "--map", text(&yaml)],
            &vector,
            b"<svg",
        ),
    ] {
        let arguments = [
            vec!["replay", text(&log), "--picture", text(path)],
            arguments,
        ]
        .concat();
        let output = beamfix(&arguments);
        assert!(output.status.success(), "{arguments:?}: {output:?}");
        let bytes = fs::read(path).expect("drawn");
        assert!(bytes.starts_with(start), "{}", path.display());
    }
}
