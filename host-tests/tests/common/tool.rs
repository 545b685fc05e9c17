//! The tool, started as scripts start it.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use serde_json::Value;

/// A folder of its own for each test.
pub fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&path).expect("a folder for the test");
    path
}

/// Runs it to its end.
pub fn beamfix(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_beamfix"))
        .args(arguments)
        .output()
        .expect("the tool starts")
}

/// What it said: one object on one line, and status 0.
pub fn json(output: &Output) -> Value {
    assert_eq!(
        output.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let text = String::from_utf8(output.stdout.clone()).expect("text");
    assert_eq!(
        text.trim_end().lines().count(),
        1,
        "one object, one line: {text}"
    );
    serde_json::from_str(&text).expect("JSON")
}

/// A path as an argument.
pub fn text(path: &Path) -> &str {
    path.to_str().expect("a path in UTF-8")
}
