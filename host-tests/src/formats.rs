//! Recorded logs: each format gives the same list of scans with wheel odometry and stamps.
//!
//! A file is read whole. What is broken inside it is counted and left out; a file cut short gives the scans before
//! the cut and says so in [`Log::cut`]; a file without a usable scan is an error of one line.

pub mod bytes;
pub mod capture;
pub mod carmen;
pub mod clock;
pub mod field;
pub mod lscan;
pub mod mirror;
pub mod mount;
pub mod no_return;
pub mod order;
pub mod pairs;
pub mod ros;
pub mod ros_map;
pub mod trajectory;
pub(crate) mod unknown;

use std::path::Path;

use anyhow::{Result, bail, ensure};
use beamfix::geometry::Pose;
use beamfix::lidar::Model;
use beamfix::scan::decimator::{Decimator, Keep};
use beamfix::scan::{Beam, Mount};

use self::no_return::Odd;
use self::order::Order;

/// What the user says about a log.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The log is raw bytes of this sensor.
    pub lidar: Option<String>,
    /// In which order the beams of a `LaserScan` were measured. Default: what fits best where the robot turns.
    pub beams: Option<Order>,
    /// The laser topic of a ROS bag.
    pub scan_topic: Option<String>,
    /// The odometry topic of a ROS bag.
    pub odom_topic: Option<String>,
    /// How the lidar sits on the robot, whatever the log says.
    pub mount: Option<Mount>,
}

/// One scan of a log.
#[derive(Debug, Clone)]
pub struct Recorded {
    /// The log's own time stamp (s), to the last digit.
    pub stamp: String,
    /// Wheel odometry at the scan, in the wheels' own frame, where the log has it.
    pub wheels: Option<Pose>,
    /// The measurements in order.
    pub beams: Vec<Beam>,
}

/// A log, read.
#[derive(Debug, Clone, Default)]
pub struct Log {
    /// The scans in the order of the file.
    pub scans: Vec<Recorded>,
    /// How the lidar sits on the robot.
    pub mount: Mount,
    /// Whether [`Log::mount`] is from the log.
    pub is_mount_told: bool,
    /// What the log is and what of it is read, in a few words.
    pub source: String,
    /// The lidar's model or topic, where the log names it.
    pub lidar: Option<String>,
    /// Lines or frames left out because they are broken.
    pub skipped: usize,
    /// What is wrong with the first of these, or with all.
    pub first_skipped: Option<String>,
    /// Readings that are no ranges: kept as beams without a return.
    pub odd: Odd,
    /// Why the file ends before it should.
    pub cut: Option<String>,
    /// The bytes that the scans were decoded from, where the pipeline can take these instead: wheels and a gyroscope of
    /// any rate are among them.
    pub capture: Option<Capture>,
}

/// A capture in memory.
#[derive(Debug, Clone)]
pub struct Capture {
    /// As [`capture`] has it.
    pub bytes: Vec<u8>,
    /// The lidar that it is from.
    pub model: &'static Model,
}

impl Log {
    /// Thins scans of more beams than `most`; gives the number of beams that this costs.
    ///
    /// Bytes that the scans were decoded from are given up then: they hold all beams.
    pub fn thin(&mut self, most: usize) -> usize {
        let beams = |log: &Self| -> usize { log.scans.iter().map(|scan| scan.beams.len()).sum() };
        let before = beams(self);
        for scan in &mut self.scans {
            if scan.beams.len() > most {
                scan.beams = thinned(std::mem::take(&mut scan.beams), most);
                self.capture = None;
            }
        }
        before - beams(self)
    }

    /// Most beams of a scan that have a range.
    #[must_use]
    pub fn most_ranges(&self) -> usize {
        let ranges = |scan: &Recorded| scan.beams.iter().filter(|b| b.range.is_some()).count();
        self.scans.iter().map(ranges).max().unwrap_or(0)
    }

    /// Counts something left out; the first one is remembered by `place` and `why`.
    pub(crate) fn skip(&mut self, place: impl std::fmt::Display, why: impl std::fmt::Display) {
        self.skipped += 1;
        if self.first_skipped.is_none() {
            self.first_skipped = Some(format!("the first at {place}: {why}"));
        }
    }

    /// One line about what was left out, if anything was.
    #[must_use]
    pub fn remarks(&self) -> Option<String> {
        let mut parts = Vec::new();
        if let Some(first) = &self.first_skipped {
            parts.push(format!("{} left out: {first}", self.skipped));
        }
        if self.odd.bad > 0 {
            parts.push(format!(
                "{} readings negative or not a number, taken as no return",
                self.odd.bad
            ));
        }
        if self.odd.too_near > 0 {
            parts.push(format!(
                "{} readings of minus infinity, taken as too near",
                self.odd.too_near
            ));
        }
        (!parts.is_empty()).then(|| parts.join("; "))
    }
}

/// Reads a log of any format; its content tells which.
pub fn read(path: &Path) -> Result<Log> {
    read_with(path, &Options::default())
}

/// Reads a CARMEN text log, an `.lscan` file, a ROS 2 bag ([`ros`]), a capture ([`capture`]) or a board's telemetry, packed or
/// not; the content tells which, and `options` what it does not tell.
pub fn read_with(path: &Path, options: &Options) -> Result<Log> {
    let name = path.display().to_string();
    if path.is_dir() && options.lidar.is_none() {
        let log = ros::parse(ros::bag::Bag::of_folder(path)?, options)
            .map_err(|error| error.context(name.clone()))?;
        return with_scans(log, &name, String::new);
    }
    parse(name, bytes::load(path)?, options)
}

/// [`read_with`] for a file's content, unpacked.
pub fn parse(name: String, content: bytes::Content, options: &Options) -> Result<Log> {
    if let Some(lidar) = &options.lidar {
        return capture::log::parse(&name, content, lidar);
    }
    if content.bytes.starts_with(capture::MAGIC) {
        return capture::log::parse(&name, content, "auto");
    }
    let start = content.bytes[..content.bytes.len().min(unknown::LOOKED_AT)].to_vec();
    let lines = content.bytes.split(|&b| b == b'\n').count();
    let mut cut = content.cut.clone();
    let log = if content.bytes.starts_with(lscan::MAGIC) {
        lscan::parse(&content.bytes)
    } else if ros::bag::is_bag(&content.bytes) {
        let bag = ros::bag::Bag::of_file(content);
        cut = None;
        match &bag.attachment {
            // A ring of rangers has no bytes: its scans are a text.
            Some(bytes)
                if bag.topics.is_empty() && bytes.starts_with(carmen::WRITTEN.as_bytes()) =>
            {
                cut.clone_from(&bag.cut);
                Ok(carmen::parse(bytes))
            }
            Some(bytes) if bag.topics.is_empty() => {
                let content = bytes::Content {
                    bytes: bytes.clone(),
                    cut: bag.cut,
                };
                return capture::log::parse(&name, content, "auto");
            }
            _ => ros::parse(bag, options),
        }
    } else if let Some(bytes) = capture::telemetry::capture(&content.bytes) {
        return capture::log::parse(&name, bytes::Content { bytes, cut }, "auto");
    } else {
        Ok(carmen::parse(&content.bytes))
    };
    let mut log = log.map_err(|error| error.context(name.clone()))?;
    if log.cut.is_none() {
        log.cut = cut;
    }
    with_scans(log, &name, || unknown::what_it_is(&name, &start, lines))
}

/// The log if it has a scan, else why not; `what_it_is` says what the file may be instead.
fn with_scans(log: Log, name: &str, what_it_is: impl Fn() -> String) -> Result<Log> {
    if log.scans.is_empty() {
        match (&log.first_skipped, &log.cut) {
            (Some(first), _) => bail!(
                "{name}: no usable scan; {} broken, the first at {first}",
                log.skipped
            ),
            (None, Some(cut)) => bail!("{name}: no usable scan: {cut}"),
            (None, None) => bail!("{name}: no usable scan: {}", what_it_is()),
        }
    }
    let beams: usize = log.scans.iter().map(|scan| scan.beams.len()).sum();
    ensure!(
        beams > 0,
        "{name}: {} scans without a beam",
        log.scans.len()
    );
    Ok(log)
}

/// At most `most` beams: of more, one for each of so many directions.
#[must_use]
pub fn thinned(beams: Vec<Beam>, most: usize) -> Vec<Beam> {
    if beams.len() <= most {
        return beams;
    }
    let mut decimator = Decimator::new(most as u16, Keep::First);
    let mut kept: Vec<Beam> = beams
        .iter()
        .filter_map(|beam| decimator.push(*beam, false))
        .map(|(beam, _)| beam)
        .collect();
    // The last direction waits for the next beam.
    kept.extend(
        decimator
            .push(Beam { ..beams[0] }, true)
            .map(|(beam, _)| beam),
    );
    kept.truncate(most);
    kept
}
