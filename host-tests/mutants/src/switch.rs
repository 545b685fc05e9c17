//! Which break is on: `BEAMFIX_MUTANT`. With `BEAMFIX_MUTANT_SEEN` a file gets the number of each break that was come by.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::string::ToString;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, Ordering};

static ON: LazyLock<u32> =
    LazyLock::new(|| std::env::var("BEAMFIX_MUTANT").ok().and_then(|id| id.parse().ok()).unwrap_or(0));

static SEEN_IN: LazyLock<Option<File>> = LazyLock::new(|| {
    let path = std::env::var("BEAMFIX_MUTANT_SEEN").ok()?;
    OpenOptions::new().append(true).create(true).open(path).ok()
});

/// More than there are places in the library.
static SEEN: [AtomicBool; 1 << 16] = [const { AtomicBool::new(false) }; 1 << 16];

/// Whether this break is on.
pub fn on(id: u32) -> bool {
    if let Some(seen) = SEEN.get(id as usize)
        && !seen.load(Ordering::Relaxed)
        && !seen.swap(true, Ordering::Relaxed)
        && let Some(mut file) = SEEN_IN.as_ref()
    {
        let line = id.to_string() + "\n";
        let _ = file.write_all(line.as_bytes());
    }
    *ON == id
}
