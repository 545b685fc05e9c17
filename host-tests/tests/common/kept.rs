//! Results whose every bit is kept: a line of `golden/rooms.txt` for each, its name and a hash of how it prints.
//!
//! How a number prints (`{:?}`) tells all its bits. Where a change is meant, `UPDATE_EXPECT=1 cargo test --release -p host-tests kept`
//! writes the file, and the commit says what the change did to accuracy and cost.

use std::collections::BTreeMap;
use std::fmt::{Debug, Write};
use std::path::PathBuf;
use std::sync::Mutex;

use beamfix_selftest::hash::Fnv1a;

/// What one room of the library gives.
pub struct Kept {
    room: &'static str,
    lines: BTreeMap<String, (Fnv1a, u32)>,
}

impl Kept {
    pub fn of(room: &'static str) -> Self {
        let lines = BTreeMap::new();
        Self { room, lines }
    }

    /// One more result under this name.
    pub fn push(&mut self, name: &str, result: impl Debug) {
        let mut text = String::new();
        write!(text, "{result:?};").expect("a string takes it");
        let line = self.lines.entry(name.to_owned());
        let (hash, count) = line.or_insert((Fnv1a::EMPTY, 0));
        hash.push(text.as_bytes());
        *count += 1;
    }

    /// # Panics
    /// Where a result is not what it was.
    pub fn check(self) {
        static FILE: Mutex<()> = Mutex::new(());
        let _alone = FILE.lock();
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("golden/rooms.txt");
        let kept = std::fs::read_to_string(&path).unwrap_or_default();
        let mine = |line: &&str| line.split('/').next() == Some(self.room);
        let now: Vec<String> = self
            .lines
            .iter()
            .map(|(name, (hash, count))| format!("{}/{name} {count} {:016x}", self.room, hash.0))
            .collect();
        if std::env::var_os("UPDATE_EXPECT").is_some() {
            let others = kept.lines().filter(|line| !mine(line)).map(str::to_owned);
            let mut all: Vec<String> = others.chain(now).collect();
            all.sort();
            std::fs::write(&path, all.join("\n") + "\n").expect("the file is written");
            return;
        }
        let kept: Vec<&str> = kept.lines().filter(mine).collect();
        let changed: Vec<_> = now
            .iter()
            .filter(|line| !kept.contains(&line.as_str()))
            .collect();
        assert!(
            changed.is_empty() && now.len() == kept.len(),
            "not the bits that are kept: {changed:?}; if that is meant, UPDATE_EXPECT=1"
        );
    }
}
