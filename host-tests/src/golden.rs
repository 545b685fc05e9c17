//! Runs whose every pose is known bit by bit, and the files that keep these bits.

use std::fmt::Write;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use beamfix::geometry::Pose;
use beamfix::lidar::Model;
use beamfix::odometry::Odometry;

use crate::board::commands::Commands;
use crate::formats::{self, Log, capture};
use crate::pipeline::follow;
use crate::report::hash::PoseHash;
use crate::shared;
use beamfix_sim::encoder::ld06::Sensor;
use beamfix_sim::{Settings, TruePose};

/// A run to be repeated bit by bit.
pub struct Golden {
    /// Name of its file in `host-tests/golden`, without the ending.
    pub name: &'static str,
    /// What it is.
    pub what: &'static str,
    /// As it reaches a board.
    pub commands: Commands,
    log: Log,
}

/// Seconds of the simulated drive.
const SECONDS: f64 = 60.0;
/// Scans of the recorded log.
const INTEL: usize = 1000;

/// All runs; recorded data only where `../shared` exists.
pub fn all() -> Result<Vec<Golden>> {
    let mut all = vec![simulated()?];
    all.extend(intel()?);
    Ok(all)
}

/// The simulated flat as LD06 bytes, wheel odometry between the packets.
pub fn simulated() -> Result<Golden> {
    let settings = Settings {
        seconds: SECONDS,
        mount: TruePose::new(0.0, 0.0, 0.0),
        ..Settings::DEFAULT
    };
    let drive = beamfix_sim::drive(&settings, &mut Sensor::ld06());
    let (bytes, ..) = capture::simulated::capture(&drive, settings.mount, &Model::LDROBOT_LD06)?;
    let commands = Commands::of_capture(&bytes);
    let content = formats::bytes::Content { bytes, cut: None };
    Ok(Golden {
        name: "simulated",
        what: "60 s in the simulated flat, as LD06 bytes",
        commands,
        log: capture::log::parse("the simulated drive", content, "auto")?,
    })
}

/// The first scans of the Intel log with its wheel odometry.
fn intel() -> Result<Option<Golden>> {
    let Some(path) = shared::folder().map(|folder| folder.join("datasets/logs/intel.log.gz"))
    else {
        return Ok(None);
    };
    let mut log = formats::read(&path)?;
    log.scans.truncate(INTEL);
    Ok(Some(Golden {
        name: "intel-1000",
        what: "the first 1000 scans of intel.log",
        commands: Commands::of_log(&log.scans),
        log,
    }))
}

impl Golden {
    /// Poses by the library alone, as `replay` calls it.
    ///
    /// # Panics
    /// Never: nothing that could fail is done with a pose.
    #[must_use]
    pub fn poses(&self) -> Vec<Pose> {
        let mut poses = Vec::new();
        let odometry = Odometry::<{ beamfix_app::BEAMS }>::new(beamfix_app::CONFIG.odometry);
        let followed = follow(
            &self.log,
            (usize::MAX, true),
            odometry,
            &mut |_, pose, _| {
                poses.push(pose);
                Ok(())
            },
        );
        followed.expect("a pose is kept");
        poses
    }

    /// The file that keeps the bits.
    #[must_use]
    pub fn path(&self) -> PathBuf {
        PathBuf::from(env!("CARGO_MANIFEST_DIR"))
            .join("golden")
            .join(self.name)
            .with_extension("poses")
    }

    /// The poses that the file keeps.
    pub fn kept(&self) -> Result<Vec<Pose>> {
        let path = self.path();
        let text = std::fs::read_to_string(&path)
            .with_context(|| format!("{}: `beamfix verify --bless` writes it", path.display()))?;
        parse(&text).with_context(|| path.display().to_string())
    }

    /// Writes the file.
    pub fn bless(&self, poses: &[Pose]) -> Result<()> {
        let path = self.path();
        let folder = path.parent().context("a file lies in a folder")?;
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        std::fs::write(&path, self.text(poses)).with_context(|| path.display().to_string())
    }

    fn text(&self, poses: &[Pose]) -> String {
        let mut text = format!(
            "# {}: bits of x y theta (f32) after every scan; `beamfix verify` compares, `--bless` rewrites.\n# pose hash {}\n",
            self.what,
            hash(poses)
        );
        for pose in poses {
            let [x, y, theta] = bits(*pose);
            let _ = writeln!(text, "{x:08x} {y:08x} {theta:08x}");
        }
        text
    }
}

fn parse(text: &str) -> Result<Vec<Pose>> {
    let mut poses = Vec::new();
    for (number, line) in text
        .lines()
        .enumerate()
        .filter(|(_, line)| !line.starts_with('#'))
    {
        let words: Vec<u32> = line
            .split_whitespace()
            .map(|word| u32::from_str_radix(word, 16))
            .collect::<Result<_, _>>()
            .with_context(|| format!("line {}", number + 1))?;
        let [x, y, theta] = words[..] else {
            bail!("line {}: three numbers wanted", number + 1);
        };
        poses.push(Pose {
            x: f32::from_bits(x),
            y: f32::from_bits(y),
            theta: f32::from_bits(theta),
        });
    }
    Ok(poses)
}

fn bits(pose: Pose) -> [u32; 3] {
    [pose.x.to_bits(), pose.y.to_bits(), pose.theta.to_bits()]
}

/// Hash of all poses.
#[must_use]
pub fn hash(poses: &[Pose]) -> PoseHash {
    let mut hash = PoseHash::new();
    poses.iter().for_each(|&pose| hash.push(pose));
    hash
}

/// The first scan at which two runs differ, in words; `None` where every bit is the same.
#[must_use]
pub fn difference(wanted: &[Pose], found: &[Pose]) -> Option<String> {
    let differs = wanted
        .iter()
        .zip(found)
        .position(|(a, b)| bits(*a) != bits(*b));
    match differs {
        Some(scan) => Some(format!(
            "scan {scan} differs: {:?}, wanted {:?}",
            found[scan], wanted[scan]
        )),
        None if wanted.len() != found.len() => Some(format!(
            "scan {} differs: {} poses, wanted {}",
            wanted.len().min(found.len()),
            found.len(),
            wanted.len()
        )),
        None => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_differing_scan_is_named_and_files_keep_every_bit() {
        let a = [
            Pose::IDENTITY,
            Pose {
                x: 0.1,
                y: -0.0,
                theta: 3.0,
            },
        ];
        let mut b = a;
        b[1].y = 0.0;
        assert_eq!(difference(&a, &a), None);
        assert!(difference(&a, &b).is_some_and(|text| text.starts_with("scan 1 differs")));
        assert!(
            difference(&a, &a[..1]).is_some_and(|text| text.starts_with("scan 1 differs: 1 poses"))
        );
        let golden = Golden {
            name: "x",
            what: "x",
            commands: Commands::new(),
            log: Log::default(),
        };
        assert_eq!(
            difference(&a, &parse(&golden.text(&a)).expect("just written")),
            None
        );
        assert!(parse("1 2\n").is_err());
    }
}
