//! Compilers that may be missing, and the archives that `boards/c/build` makes.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    sync::{Mutex, PoisonError},
};

/// The checkout.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("host-tests lies in the workspace")
}

/// The folder of the C library's sources.
pub fn sources() -> PathBuf {
    root().join("boards/c")
}

/// A folder for what a test makes, empty.
pub fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("c").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("the test's folder");
    folder
}

/// Whether a program can be started; says what is left out where it cannot.
pub fn has(program: &str) -> bool {
    let starts = Command::new(program)
        .arg("--version")
        .stdin(Stdio::null())
        .output()
        .is_ok_and(|output| output.status.success());
    if !starts {
        println!("left out: {program} is not installed");
    }
    starts
}

/// The archive for a target, built once in a run of the tests.
///
/// # Panics
/// Where it does not build.
pub fn archive(target: &str) -> PathBuf {
    static BUILT: Mutex<Vec<String>> = Mutex::new(Vec::new());
    let mut built = BUILT.lock().unwrap_or_else(PoisonError::into_inner);
    let out = root().join("target/c");
    if !built.iter().any(|done| done == target) {
        run(Command::new(sources().join("build"))
            .arg("--out")
            .arg(&out)
            .arg(target));
        built.push(target.to_string());
    }
    out.join("lib").join(target).join("libbeamfix.a")
}

/// Runs a command to its success.
///
/// # Panics
/// With what it wrote, where it fails.
pub fn run(command: &mut Command) -> Output {
    let output = command
        .stdin(Stdio::null())
        .output()
        .unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(
        output.status.success(),
        "{command:?}\n{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    output
}
