//! Localization from a table in flash, by the C example: moved by hand once, found again, with Rust's bits, here and on emulated boards.

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
    process::Command,
};

use super::cross::{BOARDS, emulate};
use super::tools::{archive, folder, has, run, sources};
use crate::localize::{expected, scene};

/// A folder with the table and the capture, and what is to be found.
fn prepared(name: &str) -> (PathBuf, String) {
    let folder = folder(name);
    let (table, bytes) = scene();
    fs::write(folder.join("field.bin"), &table).expect("the table");
    fs::write(folder.join("input.bin"), &bytes).expect("the capture");
    (folder, expected(&table, &bytes))
}

#[test]
fn c_finds_the_pose_in_a_map_and_again_after_it_was_carried_away() {
    let (folder, expected) = prepared("localize");
    if !has("cc") {
        return;
    }
    let examples = sources().join("examples");
    let program = folder.join("localize");
    run(Command::new("cc")
        .args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-O1", "-I"])
        .arg(sources().join("include"))
        .args(["localize.c", "table.S", "platform_pc.c"].map(|name| examples.join(name)))
        .arg(archive("host"))
        .arg("-o")
        .arg(&program)
        .current_dir(&folder));
    let input = File::open(folder.join("input.bin")).expect("the capture");
    let output = Command::new(program)
        .stdin(input)
        .output()
        .expect("it starts");
    assert_eq!(String::from_utf8_lossy(&output.stdout), expected);
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the library is always a release build"
)]
fn two_emulated_boards_find_it_in_a_map_in_flash_with_the_hosts_bits() {
    let (folder, expected) = prepared("localize-cross");
    let sources = ["localize.c", "table.S"].map(|name| sources().join("examples").join(name));
    let sources: Vec<&Path> = sources.iter().map(PathBuf::as_path).collect();
    // The map is larger than the smallest boards' flash.
    for board in (BOARDS.iter()).filter(|board| matches!(board.name, "m4f" | "rv32")) {
        if let Some(program) = board.compile(&folder, &sources) {
            assert_eq!(
                emulate(board, &program, &folder),
                expected,
                "{}",
                board.name
            );
        }
    }
}
