//! What the subcommands share: results on stdout, progress on stderr, files.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::ValueEnum;
use host_tests::formats::ros_map;
use host_tests::report::live::Server;
use host_tests::report::run::Format;
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

/// A bar on stderr with rate and time left; nothing where stderr is no terminal.
pub fn progress(steps: usize, doing: &'static str) -> ProgressBar {
    let bar = ProgressBar::new(steps as u64).with_message(doing);
    if let Ok(style) =
        ProgressStyle::with_template("{msg:>10} {bar:40} {pos}/{len}  {per_sec}  {eta} left")
    {
        bar.set_style(style);
    }
    bar
}

/// How a run is recorded in its folder.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub enum RecordingFormat {
    /// run.mcap with Foxglove's schemas.
    Foxglove,
    /// A ROS 2 bag: the folder bag, with its metadata.yaml and an MCAP file.
    Ros2,
}

impl From<RecordingFormat> for Format {
    fn from(format: RecordingFormat) -> Self {
        match format {
            RecordingFormat::Foxglove => Self::Foxglove,
            RecordingFormat::Ros2 => Self::Ros2,
        }
    }
}

/// Creates a file for writing.
pub fn create(path: &Path) -> Result<BufWriter<File>> {
    File::create(path)
        .map(BufWriter::new)
        .with_context(|| path.display().to_string())
}

/// Prints remarks about what was read, a line each, on stderr.
pub fn remark(remarks: &[String]) {
    for line in remarks {
        eprintln!("beamfix: {line}");
    }
}

/// Refuses to write over what is read: a file, any file of a folder, a map's picture.
pub fn spare(read: &[&Path], written: &[Option<&Path>]) -> Result<()> {
    let mut inputs: Vec<PathBuf> = Vec::new();
    for input in read {
        let is_map = input
            .extension()
            .is_some_and(|ending| ["yaml", "yml"].iter().any(|yaml| ending == *yaml));
        if let Ok(folder) = input.read_dir() {
            inputs.extend(folder.flatten().map(|entry| entry.path()));
        } else if is_map {
            inputs.extend(ros_map::files(input));
        } else {
            inputs.push(input.to_path_buf());
        }
    }
    for output in written.iter().flatten() {
        ensure!(
            !inputs.iter().any(|input| is_same(input, output)),
            "{}: it is read, and would be overwritten",
            output.display()
        );
    }
    Ok(())
}

/// Whether two names are one file, by whatever links.
fn is_same(one: &Path, other: &Path) -> bool {
    let (Ok(one), Ok(other)) = (one.metadata(), other.metadata()) else {
        return false;
    };
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        one.is_file() && (one.dev(), one.ino()) == (other.dev(), other.ino())
    }
    #[cfg(not(unix))]
    {
        one.is_file() && one.modified().ok() == other.modified().ok() && one.len() == other.len()
    }
}

/// Starts the server of `--foxglove`, and tells where it listens.
pub fn serve(address: Option<&str>) -> Result<Option<Server>> {
    let Some(address) = address else {
        return Ok(None);
    };
    let server = Server::start(address)?;
    let host = address.rsplit_once(':').map_or(address, |(host, _)| host);
    remark(&[format!("Foxglove: ws://{host}:{}", server.port())]);
    Ok(Some(server))
}
