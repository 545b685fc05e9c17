//! Which break is on: `BEAMFIX_MUTANT`. With `BEAMFIX_MUTANT_SEEN` a file gets the number of each break that was come by.

use std::collections::BTreeSet;
use std::io::Write;
use std::string::ToString;
use std::sync::{LazyLock, Mutex};

static ON: LazyLock<u32> =
    LazyLock::new(|| std::env::var("BEAMFIX_MUTANT").ok().and_then(|id| id.parse().ok()).unwrap_or(0));

static SEEN: LazyLock<Option<Mutex<(std::fs::File, BTreeSet<u32>)>>> = LazyLock::new(|| {
    let path = std::env::var("BEAMFIX_MUTANT_SEEN").ok()?;
    let file = std::fs::OpenOptions::new().append(true).create(true).open(path).ok()?;
    Some(Mutex::new((file, BTreeSet::new())))
});

/// Whether this break is on.
pub fn on(id: u32) -> bool {
    if let Some(seen) = &*SEEN {
        let mut seen = seen.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if seen.1.insert(id) {
            let line = id.to_string() + "\n";
            let _ = seen.0.write_all(line.as_bytes());
        }
    }
    *ON == id
}
