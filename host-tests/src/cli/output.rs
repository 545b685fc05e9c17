//! What the subcommands share: results on stdout, progress on stderr, files.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::Value;

/// Prints the result: one JSON object, or the text.
pub fn report(json: bool, value: &Value, text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    let written = if json {
        writeln!(out, "{value}")
    } else {
        writeln!(out, "{text}")
    };
    match written {
        // Whoever reads has seen enough: `beamfix … | head`.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => other.context("standard output"),
    }
}

/// A bar on stderr; nothing where stderr is no terminal.
pub fn progress(steps: usize, doing: &'static str) -> ProgressBar {
    let bar = ProgressBar::new(steps as u64).with_message(doing);
    if let Ok(style) = ProgressStyle::with_template("{msg:>10} {bar:40} {pos}/{len}  {elapsed}") {
        bar.set_style(style);
    }
    bar
}

/// Creates a file for writing.
pub fn create(path: &Path) -> Result<BufWriter<File>> {
    File::create(path)
        .map(BufWriter::new)
        .with_context(|| path.display().to_string())
}
