//! `regress`: recordings against what they gave before, in parts, and again after a stop.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::tool::{beamfix, folder, text};
use serde_json::Value;

/// A manifest over two simulated drives, one without its wheels too.
fn manifest(name: &str) -> (PathBuf, PathBuf) {
    let folder = folder(name);
    let _ = fs::remove_dir_all(folder.join("state"));
    let _ = fs::remove_file(folder.join("drives.baseline.json"));
    for seed in ["1", "2"] {
        let out = folder.join(seed);
        let done = beamfix(&[
            "simulate",
            "--seconds",
            "3",
            "--seed",
            seed,
            "--out",
            text(&out),
        ]);
        assert!(done.status.success(), "{done:?}");
    }
    let manifest = folder.join("drives.yaml");
    let list = "- log: 1/lidar.rec\n- { name: second, log: 2/lidar.rec }\n\
                - { name: blind wheels, log: 2/lidar.rec, options: [--prior, none] }\n";
    fs::write(&manifest, list).expect("the manifest");
    let state = folder.join("state");
    (manifest, state)
}

fn regress(manifest: &Path, state: &Path, more: &[&str]) -> std::process::Output {
    let mut arguments = vec!["regress", text(manifest), "--json", "--state", text(state)];
    arguments.extend(more);
    beamfix(&arguments)
}

#[test]
fn poses_are_compared_with_the_baseline_bit_for_bit() {
    let (manifest, state) = manifest("regress");
    let counts = |more: &[&str]| {
        let output = regress(&manifest, &state, more);
        let value: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let number = |name: &str| value[name].as_u64().expect(name);
        (
            output.status.code(),
            [
                number("same"),
                number("changed"),
                number("new"),
                number("failed"),
            ],
        )
    };
    assert_eq!(
        counts(&[]),
        (Some(0), [0, 0, 3, 0]),
        "nothing to compare with"
    );
    assert_eq!(counts(&["--bless"]), (Some(0), [0, 0, 3, 0]));
    assert_eq!(counts(&[]), (Some(0), [3, 0, 0, 0]));
    // Each recording was replayed once: what is done is kept.
    let lines = |state: &Path| {
        let text = fs::read_to_string(state.join("drives.jsonl")).expect("what is done");
        text.lines().count()
    };
    assert_eq!(lines(&state), 3);
    // A run that was stopped while it wrote does the last one again.
    let path = state.join("drives.jsonl");
    let kept = fs::read_to_string(&path).expect("what is done");
    fs::write(&path, &kept[..kept.len() - 20]).expect("cut");
    assert_eq!(counts(&[]), (Some(0), [3, 0, 0, 0]));

    // The parts together are the whole.
    let parts = ["1/2", "2/2"].map(|part| counts(&["--shard", part]).1[0]);
    assert_eq!(parts, [2, 1]);

    // Another prior is other poses.
    let list = fs::read_to_string(&manifest).expect("the manifest");
    fs::write(
        &manifest,
        list.replace("name: second,", "name: second, options: [--prior, none],"),
    )
    .expect("the manifest");
    assert_eq!(counts(&[]), (Some(1), [2, 1, 0, 0]));
    assert_eq!(counts(&["--only", "blind wheels"]), (Some(0), [1, 0, 0, 0]));

    // A recording that is gone fails alone, and no baseline is made of that.
    fs::remove_file(manifest.with_file_name("1").join("lidar.rec")).expect("the recording");
    assert_eq!(counts(&[]), (Some(1), [1, 1, 0, 1]));
    let blessed = regress(&manifest, &state, &["--bless"]);
    assert_eq!(blessed.status.code(), Some(2), "{blessed:?}");
}

#[test]
fn a_bad_manifest_is_refused_in_a_line() {
    let folder = folder("regress-bad");
    let path = folder.join("bad.yaml");
    for (list, word) in [
        ("log: x", "list of recordings"),
        ("[]", "no recordings"),
        ("- { log: a }\n- { log: a }", "give them names"),
        ("- { log: a, option: [b] }", "list of recordings"),
        ("- { log: a, options: [--json] }", "not for a manifest"),
    ] {
        fs::write(&path, list).expect("the manifest");
        let output = regress(&path, &folder.join("state"), &[]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{list}: {said}");
        assert!(
            said.contains(word) && said.trim().lines().count() == 1,
            "{list}: {said}"
        );
    }
}
