//! Instructions of a match on the host, counted by callgrind.

use std::{
    fs,
    process::{Command, Stdio},
};

use host_tests::formats::bytes;
use host_tests::shared;

/// Most instructions a match, from the beams of both scans to the pose.
const ALLOWED: u64 = 425_000;

/// Pairs at level 0 of the recorded scans of 180 beams, from the wheels' guess.
#[test]
#[cfg_attr(debug_assertions, ignore = "a debug build counts other things")]
fn a_match_of_180_beams_costs_at_most_425_000_instructions() {
    let (Some(scans), Some(list)) = (
        shared::file("pairs/host/scans_intel.txt.gz"),
        shared::file("pairs/host/pairs_intel_cons.csv.gz"),
    ) else {
        return;
    };
    let is_there = |program: &str| {
        let mut command = Command::new(program);
        command.arg("--version").stdout(Stdio::null());
        command.status().is_ok_and(|status| status.success())
    };
    if !is_there("valgrind") {
        println!("left out: valgrind is not there (Debian: apt-get install valgrind)");
        return;
    }
    let content = bytes::load(&list).expect("a list of pairs");
    let text = String::from_utf8(content.bytes).expect("text");
    let rows: Vec<&str> = text
        .lines()
        .enumerate()
        .filter(|(k, line)| *k == 0 || line.split(',').nth(3) == Some("0"))
        .map(|(_, line)| line)
        .collect();
    let pairs = rows.len() as u64 - 1;
    let folder = std::env::temp_dir().join(format!("beamfix-callgrind-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder for temporary files");
    let some = folder.join("level-0.csv");
    fs::write(&some, rows.join("\n")).expect("a temporary file");
    let output = Command::new("valgrind")
        .arg("--tool=callgrind")
        .arg("--toggle-collect=*matcher::Matcher*::run*")
        .arg(format!(
            "--callgrind-out-file={}",
            folder.join("out").display()
        ))
        .arg(env!("CARGO_BIN_EXE_beamfix"))
        .arg("pairs")
        .args([&scans, &some])
        .output()
        .expect("valgrind was there a moment ago");
    let said = String::from_utf8_lossy(&output.stderr);
    fs::remove_dir_all(&folder).expect("the folder is ours");
    let collected = said
        .lines()
        .find_map(|line| line.split("Collected : ").nth(1))
        .and_then(|count| count.trim().parse::<u64>().ok())
        .unwrap_or_else(|| panic!("{said}"));
    println!("{pairs} pairs, {} instructions a match", collected / pairs);
    assert!(pairs > 100 && collected > 1000 * pairs, "{said}");
    assert!(
        collected <= ALLOWED * pairs,
        "{} a match",
        collected / pairs
    );
}
