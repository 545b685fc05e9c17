//! The plan of `src/`: a room imports only rooms below it, no two files import each other, and files stay short.

use std::collections::{BTreeMap, BTreeSet};

use crate::source::{Import, Source};

/// The rooms from the top down. A room imports what stands below it, nothing beside it, nothing above.
const FLOORS: [&[&str]; 9] = [
    &["pipeline"],
    &["odometry", "localization", "slam"],
    &["matching"],
    &["sensor_model"],
    &["lidar", "grid", "keyframe"],
    &["scan", "linalg"],
    &["geometry"],
    &["math"],
    &["config"],
];

/// Wings of a room, from the top down, with the same rule. A room's own page, `lidar.rs`, belongs to none.
const WINGS: [(&str, &[&str]); 1] = [("lidar", &["bringup", "sensors", "wire", "model"])];

/// Most lines of a file, unit tests included: what one reads in one sitting.
const MAX_LINES: usize = 450;
/// Largest median of all files' lines.
const MAX_MEDIAN: usize = 200;

fn check(what: &str, broken: &[String]) {
    println!("{what}: {}", broken.len());
    for line in broken {
        println!("  {line}");
    }
    assert!(broken.is_empty(), "{what}:\n{}", broken.join("\n"));
}

/// The room of a file: the first folder, or the file itself at the top.
fn room(file: &str) -> &str {
    let first = file.split('/').next().unwrap_or(file);
    first.strip_suffix(".rs").unwrap_or(first)
}

/// The wing of a file in its room; `None` for the room's own page.
fn wing(file: &str) -> Option<&str> {
    let second = file.split('/').nth(1)?;
    Some(second.strip_suffix(".rs").unwrap_or(second))
}

fn floor(room: &str) -> Option<usize> {
    FLOORS.iter().position(|rooms| rooms.contains(&room))
}

/// Whether an import goes down, or stays where it is.
fn goes_down(import: &Import) -> bool {
    let (from, to) = (room(&import.from), room(&import.to));
    // The front door re-exports; it belongs to no room.
    if from == "lib" {
        return true;
    }
    if from != to {
        return match (floor(from), floor(to)) {
            (Some(from), Some(to)) => from < to,
            _ => false,
        };
    }
    let Some((_, wings)) = WINGS.iter().find(|(of, _)| *of == from) else {
        return true;
    };
    let place = |file| wing(file).and_then(|wing| wings.iter().position(|w| *w == wing));
    match (place(&import.from), place(&import.to)) {
        (Some(from), Some(to)) => from <= to,
        _ => true,
    }
}

fn line(import: &Import) -> String {
    let Import {
        from,
        to,
        line,
        written,
        ..
    } = import;
    format!("{from}:{line} imports {to} ({written})")
}

#[test]
fn a_room_imports_only_rooms_below_it() {
    let source = Source::read();
    let imports = source.imports();
    assert!(
        imports.len() > 100,
        "the test reads imports: {}",
        imports.len()
    );
    let rooms: BTreeSet<&str> = source.lines.keys().map(|file| room(file)).collect();
    let nowhere = rooms
        .into_iter()
        .filter(|room| *room != "lib" && floor(room).is_none())
        .map(|room| format!("{room} stands on no floor"));
    let up = imports.iter().filter(|import| !goes_down(import)).map(line);
    check(
        "imports upwards or sideways",
        &nowhere.chain(up).collect::<Vec<_>>(),
    );
}

/// The circles among imports, with the imports inside them.
fn told(imports: &[Import]) -> Vec<String> {
    let mut told = Vec::new();
    for circle in circles_of(imports) {
        let mut text = circle.join(", ");
        for import in imports {
            let inside = |file: &str| circle.contains(&file);
            if inside(&import.from) && inside(&import.to) {
                text += &format!("\n    {}", line(import));
            }
        }
        told.push(text);
    }
    told
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let mut imports = Source::read().imports();
    // A unit test may use what stands on the thing that it tests.
    imports.retain(|import| !import.in_tests);
    check("circles between files", &told(&imports));
}

/// Groups of files that all reach each other by imports.
fn circles_of(imports: &[Import]) -> Vec<Vec<&str>> {
    let mut next: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for import in imports {
        next.entry(&import.from).or_default().insert(&import.to);
    }
    let reached = |start: &str| {
        let mut seen = BTreeSet::new();
        let mut open: Vec<&str> = next.get(start).into_iter().flatten().copied().collect();
        while let Some(file) = open.pop() {
            if seen.insert(file) {
                open.extend(next.get(file).into_iter().flatten());
            }
        }
        seen
    };
    let all: BTreeMap<&str, BTreeSet<&str>> =
        next.keys().map(|&file| (file, reached(file))).collect();
    let mut circles: Vec<Vec<&str>> = Vec::new();
    for (&file, reached) in &all {
        if !reached.contains(file) || circles.iter().any(|circle| circle.contains(&file)) {
            continue;
        }
        let back = |other: &&&str| all.get(**other).is_some_and(|far| far.contains(file));
        circles.push(reached.iter().filter(back).copied().collect());
    }
    circles
}

#[test]
fn files_can_be_read_in_one_sitting() {
    let source = Source::read();
    let long: Vec<String> = source
        .lines
        .iter()
        .filter(|(_, lines)| **lines > MAX_LINES)
        .map(|(file, lines)| format!("{file}: {lines} lines"))
        .collect();
    let mut lines: Vec<usize> = source.lines.values().copied().collect();
    lines.sort_unstable();
    let median = lines[lines.len() / 2];
    println!("{} files, median {median} lines", lines.len());
    check(&format!("files above {MAX_LINES} lines"), &long);
    let median_is_high = (median > MAX_MEDIAN).then(|| format!("{median} lines"));
    check(
        &format!("median above {MAX_MEDIAN} lines"),
        &median_is_high.into_iter().collect::<Vec<_>>(),
    );
}

#[test]
fn a_circle_and_an_import_upwards_are_found() {
    let import = |from: &str, to: &str| Import {
        from: from.to_owned(),
        to: to.to_owned(),
        line: 1,
        written: String::new(),
        in_tests: false,
    };
    let imports = [
        import("math.rs", "scan.rs"),
        import("scan.rs", "scan/points.rs"),
        import("scan/points.rs", "math.rs"),
        import("odometry.rs", "scan.rs"),
    ];
    let circles = circles_of(&imports);
    assert_eq!(circles, [["math.rs", "scan.rs", "scan/points.rs"]]);
    let up = imports.iter().filter(|import| !goes_down(import));
    assert_eq!(up.map(line).count(), 1);
    // Beside is not below, a wing has its place, and a room's own page belongs to no wing.
    for (from, to, is_down) in [
        ("slam/graph.rs", "odometry.rs", false),
        ("lidar/wire/framing.rs", "lidar/sensors/ld06.rs", false),
        ("lidar/sensors/ld06.rs", "lidar/wire/framing.rs", true),
        ("lidar/wire.rs", "lidar.rs", true),
        ("lidar.rs", "grid.rs", false),
    ] {
        assert_eq!(goes_down(&import(from, to)), is_down, "{from} imports {to}");
    }
}
