//! The folder of recorded data beside the checkout, which may be missing.

use std::path::PathBuf;

/// `BEAMFIX_SHARED`, or `../shared` beside the checkout; `None` where it is not there.
#[must_use]
pub fn folder() -> Option<PathBuf> {
    let beside = || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared"));
    let folder = std::env::var_os("BEAMFIX_SHARED").map_or_else(beside, PathBuf::from);
    folder.join("datasets").is_dir().then_some(folder)
}

/// A file there; prints what is left out where it is missing.
#[must_use]
pub fn file(path: &str) -> Option<PathBuf> {
    let found = folder()
        .map(|folder| folder.join(path))
        .filter(|file| file.is_file());
    if found.is_none() {
        println!("left out: ../shared/{path} is not there");
    }
    found
}
