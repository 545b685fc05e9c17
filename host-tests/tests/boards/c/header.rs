//! The header is what the sources say, and every C and C++ compiler here takes it.

use std::{fs, process::Command};

use super::tools::{folder, has, root, run, sources};

#[test]
fn the_header_is_current() {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let built = Command::new(&cargo)
        .args(["build", "--quiet", "--manifest-path"])
        .arg(sources().join("header/Cargo.toml"))
        .arg("--target-dir")
        .arg(root().join("target/header"))
        .output()
        .expect("cargo starts");
    if !built.status.success() {
        println!(
            "left out: cbindgen does not build here:\n{}",
            String::from_utf8_lossy(&built.stderr)
        );
        return;
    }
    let program = root().join("target/header/debug/beamfix-header");
    let made = run(Command::new(program).arg(sources())).stdout;
    let made = String::from_utf8(made).expect("text");
    let path = sources().join("include/beamfix.h");
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        fs::write(&path, &made).expect("the header");
    }
    let kept = fs::read_to_string(&path).unwrap_or_default();
    let differs = made
        .lines()
        .zip(kept.lines())
        .find(|(made, kept)| made != kept);
    assert!(
        made == kept,
        "boards/c/include/beamfix.h is not what cbindgen makes (UPDATE_EXPECT=1 renews it): {differs:?}"
    );
}

#[test]
fn c99_and_cpp_take_the_header_without_a_warning() {
    let folder = folder("header");
    for (name, compiler, standards) in [
        ("header.c", "cc", &["c99", "c11", "c17"][..]),
        ("header.cpp", "c++", &["c++11", "c++17", "c++20"]),
    ] {
        if !has(compiler) {
            continue;
        }
        let source = folder.join(name);
        fs::write(
            &source,
            "#include \"beamfix.h\"\n#include \"beamfix.h\"\nint main(void) { return 0; }\n",
        )
        .expect("a source");
        for standard in standards {
            run(Command::new(compiler)
                .args(["-Wall", "-Wextra", "-Werror", "-pedantic", "-fsyntax-only"])
                .arg(format!("-std={standard}"))
                .arg("-I")
                .arg(sources().join("include"))
                .arg(&source));
        }
    }
}

/// A sentence in C's documentation says what can fail and in which unit: nothing is without one.
#[test]
fn everything_in_the_header_is_documented() {
    let header = fs::read_to_string(sources().join("include/beamfix.h")).expect("the header");
    let lines: Vec<_> = header.lines().collect();
    let mut bare = Vec::new();
    for (k, line) in lines.iter().enumerate() {
        let declares = line.starts_with("extern const")
            || line.contains(" beamfix_")
                && line.contains('(')
                && !line.trim_start().starts_with("//")
            || line.starts_with("#define BEAMFIX_")
                && !line.ends_with("_H")
                && !line.ends_with('\\');
        let before = k
            .checked_sub(1)
            .and_then(|k| lines.get(k))
            .copied()
            .unwrap_or_default();
        if declares && !before.trim_start().starts_with("//") && !before.contains("extern") {
            bare.push(*line);
        }
    }
    assert!(bare.is_empty(), "without a comment:\n{}", bare.join("\n"));
}
