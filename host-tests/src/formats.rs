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
pub mod pairs;
pub mod ros;
pub mod ros_map;

use std::path::Path;

use anyhow::{Result, bail};
use beamfix::geometry::Pose;
use beamfix::scan::Beam;

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
    /// Where the lidar sits on the robot, as far as the log tells.
    pub robot_from_lidar: Pose,
    /// Lines or frames left out because they are broken.
    pub skipped: usize,
    /// The first of these and what is wrong with it.
    pub first_skipped: Option<String>,
    /// Readings that are negative or not a number: kept as beams without a return.
    pub bad_readings: usize,
    /// Why the file ends before it should.
    pub cut: Option<String>,
}

impl Log {
    /// Counts something left out; the first one is remembered by `place` and `why`.
    pub(crate) fn skip(&mut self, place: impl std::fmt::Display, why: impl std::fmt::Display) {
        self.skipped += 1;
        if self.first_skipped.is_none() {
            self.first_skipped = Some(format!("{place}: {why}"));
        }
    }

    /// One line about what was left out, if anything was.
    #[must_use]
    pub fn remarks(&self) -> Option<String> {
        let mut parts = Vec::new();
        if let Some(first) = &self.first_skipped {
            parts.push(format!("{} left out, the first at {first}", self.skipped));
        }
        if self.bad_readings > 0 {
            parts.push(format!(
                "{} readings negative or not a number, taken as no return",
                self.bad_readings
            ));
        }
        (!parts.is_empty()).then(|| parts.join("; "))
    }
}

/// Reads a CARMEN text log, an `.lscan` file, a ROS 2 recording (MCAP) or a capture ([`capture`]),
/// packed with gzip or not; the content tells which.
pub fn read(path: &Path) -> Result<Log> {
    let content = bytes::load(path)?;
    let name = path.display();
    if content.bytes.starts_with(capture::MAGIC) {
        return capture::log::parse(&name.to_string(), content, "auto");
    }
    let mut log = if content.bytes.starts_with(lscan::MAGIC) {
        lscan::parse(&content.bytes).map_err(|error| error.context(name.to_string()))?
    } else if content.bytes.starts_with(ros::MAGIC) {
        ros::parse(&content.bytes)
    } else {
        carmen::parse(&content.bytes)
    };
    if log.cut.is_none() {
        log.cut = content.cut;
    }
    if log.scans.is_empty() {
        let lines = content.bytes.split(|&b| b == b'\n').count();
        match (&log.first_skipped, &log.cut) {
            (Some(first), _) => bail!(
                "{name}: no usable scan in {lines} lines; {} broken, the first at {first}",
                log.skipped
            ),
            (None, Some(cut)) => bail!("{name}: no usable scan: {cut}"),
            (None, None) => bail!(
                "{name}: no usable scan: no FLASER or ROBOTLASER1 line in {lines} lines, and neither an .lscan nor an MCAP file"
            ),
        }
    }
    Ok(log)
}
