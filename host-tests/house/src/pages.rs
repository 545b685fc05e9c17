//! What the pages name is there.

use std::{fs, path::Path};

/// Pages, and folders of pages.
const PAGES: [&str; 7] = [
    "README.md",
    "SECURITY.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "boards/README.md",
    "docs",
    "src/math.rs",
];

/// Paths in backquotes that start so are checked.
const FOLDERS: [&str; 4] = ["src/", "host-tests/", "boards/", "docs/"];

#[test]
fn every_file_that_a_page_names_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut pages = Vec::new();
    for page in PAGES {
        let path = root.join(page);
        match fs::read_dir(&path) {
            Ok(entries) => pages.extend(entries.map(|entry| entry.expect("an entry").path())),
            Err(_) => pages.push(path),
        }
    }
    let (mut missing, mut named) = (Vec::new(), 0);
    for page in pages {
        let text = fs::read_to_string(&page).unwrap_or_else(|error| panic!("{page:?}: {error}"));
        for word in text.split('`').skip(1).step_by(2) {
            let is_path = FOLDERS.iter().any(|folder| word.starts_with(folder))
                // A pattern, a command or a path with a line or an item.
                && !word.contains([' ', '*', ':', '<', '{', '\n'])
                // What the reader is to name.
                && !word.contains("NAME");
            if is_path {
                named += 1;
                if !root.join(word).exists() {
                    missing.push(format!("{}: {word}", page.display()));
                }
            }
        }
    }
    assert!(named > 40, "the test finds names: {named}");
    assert!(missing.is_empty(), "not there:\n{}", missing.join("\n"));
}

/// A row of a promise or a fault names a file of tests and functions in it: `file.rs` `one`, `another`. Or scenes of the table.
#[test]
fn every_promise_has_its_test() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let read = |page: &str| fs::read_to_string(root.join(page)).expect("a page of promises");
    let page = read("docs/promises.md") + &read("docs/faults.md");
    let scenes: String = ["motion", "noise", "people", "wheels"]
        .map(|kind| read(&format!("host-tests/sim/src/catalogue/{kind}.rs")))
        .concat();
    let (mut missing, mut named) = (Vec::new(), 0);
    for row in page.lines().filter(|line| line.starts_with('|')) {
        let mut text = String::new();
        let is_of_scenes = row.contains("| scene");
        for word in row.split('`').skip(1).step_by(2) {
            if is_of_scenes {
                named += 1;
                if !scenes.contains(&format!("\"{word}\"")) {
                    missing.push(word.to_owned());
                }
            } else if word.ends_with(".rs") {
                text = fs::read_to_string(root.join(word)).unwrap_or_default();
            } else if !text.is_empty() && !word.contains([' ', '#', '!', '-', '/']) {
                named += 1;
                if !text.contains(&format!("fn {word}(")) {
                    missing.push(word.to_owned());
                }
            }
        }
    }
    assert!(named > 60, "the test finds names: {named}");
    assert!(missing.is_empty(), "no such tests: {}", missing.join(", "));
}
