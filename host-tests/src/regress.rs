//! Many recordings, replayed and compared with what they gave before.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context as _, Result, bail, ensure};
use serde::{Deserialize, Serialize};

use crate::formats::bytes;

/// Largest manifest (bytes): some ten thousand recordings.
const MAX_MANIFEST: u64 = 16 << 20;

/// A recording of a manifest.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// The recording, from the manifest's folder on.
    pub log: PathBuf,
    /// What it is called. Default: the recording as it is written.
    #[serde(default)]
    pub name: String,
    /// Further options of `replay`.
    #[serde(default)]
    pub options: Vec<String>,
    /// True motions between moments of it: `time time x y z roll pitch yaw` a line.
    #[serde(default)]
    pub relations: Option<PathBuf>,
}

/// Reads a manifest: a YAML list of entries; names must differ.
pub fn manifest(path: &Path) -> Result<Vec<Entry>> {
    let name = || path.display().to_string();
    let content = bytes::load_at_most(path, MAX_MANIFEST)?;
    let text = String::from_utf8(content.bytes).with_context(name)?;
    let options = serde_saphyr::options! { with_snippet: false };
    let mut entries: Vec<Entry> =
        serde_saphyr::from_str_with_options(&text, options).map_err(|error| {
            let first = error.to_string();
            let first = first.lines().next().unwrap_or_default().to_owned();
            anyhow::anyhow!("{}: not a list of recordings: {first}", path.display())
        })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut names = BTreeMap::new();
    for (k, entry) in entries.iter_mut().enumerate() {
        if entry.name.is_empty() {
            entry.name = entry.log.display().to_string();
        }
        if let Some(first) = names.insert(entry.name.clone(), k) {
            bail!(
                "{}: entries {} and {} are both called {}: give them names",
                path.display(),
                first + 1,
                k + 1,
                entry.name
            );
        }
        entry.log = folder.join(&entry.log);
        entry.relations = entry.relations.take().map(|file| folder.join(file));
        for taken in ["--json", "--trajectory"] {
            let is_taken = |option: &String| option.split('=').next() == Some(taken);
            ensure!(
                !entry.options.iter().any(is_taken),
                "{}: {}: {taken} is not for a manifest",
                path.display(),
                entry.name
            );
        }
    }
    ensure!(!entries.is_empty(), "{}: no recordings", path.display());
    Ok(entries)
}

/// What a recording gave.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Outcome {
    /// Over all poses; empty where the replay failed.
    pub pose_hash: String,
    /// Scans, and those whose pose is only predicted.
    pub scans: u64,
    /// See `scans`.
    pub refused: u64,
    /// Times that a keyframe, or the place in the map, was given up.
    pub lost: u64,
    /// Mean error over the relations (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metres: Option<f64>,
    /// Mean error over the relations (degrees).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub degrees: Option<f64>,
    /// Why the replay failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

/// How an outcome compares with the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// The same poses, bit for bit.
    Same,
    /// Other poses.
    Changed,
    /// There is none to compare with.
    New,
    /// The replay failed.
    Failed,
}

impl Change {
    /// The change from the outcome before, if there was one.
    #[must_use]
    pub fn of(now: &Outcome, before: Option<&Outcome>) -> Self {
        match before {
            _ if now.error.is_some() => Self::Failed,
            None => Self::New,
            Some(before) if before.pose_hash == now.pose_hash => Self::Same,
            Some(_) => Self::Changed,
        }
    }

    /// In a word.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Same => "same",
            Self::Changed => "CHANGED",
            Self::New => "new",
            Self::Failed => "FAILED",
        }
    }
}

/// Outcomes by name.
pub type Outcomes = BTreeMap<String, Outcome>;

/// Reads a baseline; none where there is no such file yet.
pub fn baseline(path: &Path) -> Result<Outcomes> {
    if !path.exists() {
        return Ok(Outcomes::new());
    }
    let text = fs::read_to_string(path).with_context(|| path.display().to_string())?;
    serde_json::from_str(&text).with_context(|| path.display().to_string())
}

/// Writes a baseline in one go: never half of one.
pub fn bless(path: &Path, outcomes: &Outcomes) -> Result<()> {
    let name = || path.display().to_string();
    let part = path.with_extension("part");
    fs::write(&part, serde_json::to_string_pretty(outcomes)? + "\n").with_context(name)?;
    fs::rename(&part, path).with_context(name)
}

/// A part of all recordings: the `index`-th of `count`, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    index: usize,
    count: usize,
}

impl Shard {
    /// All of them.
    pub const ALL: Self = Self { index: 1, count: 1 };

    /// Whether the entry at this place (from 0) belongs to it.
    #[must_use]
    pub const fn holds(self, place: usize) -> bool {
        place % self.count == self.index - 1
    }
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').map(|(a, b)| (a.parse(), b.parse()));
        match parts {
            Some((Ok(index), Ok(count))) if 0 < index && index <= count => {
                Ok(Self { index, count })
            }
            _ => Err("I/N is wanted, I from 1 to N".into()),
        }
    }
}
