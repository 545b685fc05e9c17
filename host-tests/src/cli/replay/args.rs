//! What `replay` takes.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail, ensure};
use beamfix::geometry::Pose;
use beamfix::linalg::Covariance;
use beamfix::scan::Mount;
use beamfix::sensor_model::likelihood_field::LikelihoodField;
use beamfix_sim::TruePose;
use clap::ValueEnum;
use host_tests::formats::mount;
use host_tests::formats::order::Order;
use host_tests::formats::trajectory::{Format, Trajectory};
use host_tests::formats::{Log, Options, Recorded};
use host_tests::report::picture;
use host_tests::report::run::{self, Left, Run, Setup, Titles};
use host_tests::report::track::{At, Elapsed};

use crate::cli::output::{self, RecordingFormat};
use crate::cli::prior::Prior;

/// About so many scans are drawn into a picture.
const DRAWN: usize = 400;

/// Run the firmware's pipeline over a recorded log: CARMEN .log, .lscan, a ROS 2 bag (MCAP, SQLite, or its folder), a
/// capture of `simulate` (lidar.rec, run.mcap), or a raw serial capture; packed or not.
#[derive(clap::Args)]
pub struct Args {
    /// The log.
    pub log: PathBuf,
    /// Take the log as raw bytes of this sensor.
    #[arg(long, value_name = "MODEL")]
    pub lidar: Option<String>,
    /// The laser topic of a ROS bag. Default: /scan, or the one with the most scans.
    #[arg(long, value_name = "TOPIC")]
    pub scan_topic: Option<String>,
    /// The odometry topic of a ROS bag. Default: /odom, or the one with the most messages.
    #[arg(long, value_name = "TOPIC")]
    pub odom_topic: Option<String>,
    /// In which order the ranges of a ROS scan were measured. Default: the order in which scans fit best where the robot
    /// turns: many drivers turn the array round and do not say so.
    #[arg(long, value_enum)]
    pub beams: Option<Order>,
    /// What runs over the scans.
    #[arg(long, value_enum, default_value_t = Mode::Odometry)]
    pub mode: Mode,
    /// Where the guess for each match comes from: the log's wheel odometry, or the last velocity.
    #[arg(long, value_enum, default_value_t = Prior::Odometry)]
    pub prior: Prior,
    /// The memory configuration. Default: the smallest one with room for the log's scans.
    #[arg(long, value_enum)]
    pub tier: Option<Tier>,
    /// Where to write a line `timestamp x y theta` for every scan; ` # guess` after it where no match confirms it.
    #[arg(long, value_name = "FILE")]
    pub trajectory: Option<PathBuf>,
    /// How the trajectory is written: `timestamp x y theta`, or as evo reads it.
    #[arg(long, value_enum, default_value_t = Format::Plain)]
    pub trajectory_format: Format,
    /// The map to localize in: a ROS map's YAML file, or a table that `field` wrote. Only read, with --mode localize.
    #[arg(long, value_name = "FILE")]
    pub map: Option<PathBuf>,
    /// Write the map here, as a ROS map: this YAML file and a picture beside it. With --mode slam.
    #[arg(long, value_name = "FILE")]
    pub map_out: Option<PathBuf>,
    /// Write pictures (map.png, errors.svg, match.png, match.gif, with a map field.png), what was seen as a ROS map
    /// (seen.yaml), and a recording into this folder.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// How the run is recorded in the folder: run.mcap for Foxglove and Lichtblick (docs/foxglove.json is its layout), or
    /// a ROS 2 bag.
    #[arg(long, value_enum, default_value_t = RecordingFormat::Foxglove)]
    pub recording_format: RecordingFormat,
    /// Draw what was seen and driven into this file, .png or .svg; a file called errors, match or field shows errors over time,
    /// a match before and after, the likelihood field of the map. Several times: several pictures.
    #[arg(long, value_name = "FILE")]
    pub picture: Vec<PathBuf>,
    /// The lidar's place on the robot (m, m, deg), where the log does not tell or tells it wrong; `,down` after it for a
    /// lidar that hangs head down.
    #[arg(long, value_name = "X,Y,DEG[,down]", value_parser = mount::parse, allow_hyphen_values = true)]
    pub mount: Option<Mount>,
    /// Where the robot starts in the map (m, m, deg). Default: it finds itself.
    #[arg(long, value_name = "X,Y,DEG", value_parser = mount::pose, allow_hyphen_values = true)]
    pub start: Option<Pose>,
    /// Stop after so many scans.
    #[arg(long, value_name = "N")]
    pub scans: Option<usize>,
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// What runs over the scans.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub enum Mode {
    Odometry,
    Slam,
    Localize,
}

/// Compiled memory configurations, by the RAM of the controller: how many beams a revolution may have.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub enum Tier {
    /// 360 beams.
    #[value(name = "16k")]
    Small = 360,
    /// 512 beams; with --mode slam a map that rolls with the robot, without loops.
    #[value(name = "64k")]
    Middle = 512,
    /// 720 beams.
    #[value(name = "192k")]
    Large = 720,
    /// 1024 beams.
    #[value(name = "512k")]
    Huge = 1024,
}

impl Args {
    /// Refuses what does not go together, before anything is read or written.
    pub fn check(&self) -> Result<()> {
        for path in &self.picture {
            picture::Kind::of(path)?;
        }
        match (&self.map, self.mode) {
            (None, Mode::Localize) => {
                bail!(
                    "--mode localize needs --map: a ROS map's YAML file, or a table that `field` wrote"
                )
            }
            (Some(path), Mode::Odometry | Mode::Slam) => bail!(
                "--map {}: the map that goes in, for --mode localize; --picture FILE draws what was seen and driven",
                path.display()
            ),
            _ => {}
        }
        let keeps_map = self.mode == Mode::Slam && self.tier != Some(Tier::Middle);
        ensure!(
            self.map_out.is_none() || keeps_map,
            "--map-out: the map that was made, with --mode slam; one that rolls with the robot (tier 64k) is not kept"
        );
        ensure!(
            self.start.is_none() || self.mode == Mode::Localize,
            "--start: a place in a map, for --mode localize"
        );
        Ok(())
    }

    /// What the command line says about the log.
    pub fn options(&self) -> Options {
        Options {
            lidar: self.lidar.clone(),
            beams: self.beams,
            scan_topic: self.scan_topic.clone(),
            odom_topic: self.odom_topic.clone(),
            mount: self.mount,
        }
    }

    /// How the lidar sits on the robot: as told here, else as the log tells.
    pub fn mount_of(&self, log: &Log) -> Mount {
        self.mount.unwrap_or(log.mount)
    }

    /// Whether wheels and gyroscope of the log are the guess.
    pub fn uses_wheels(&self) -> bool {
        self.prior == Prior::Odometry
    }

    /// Begins the trajectory, where one is written.
    pub fn open_trajectory(&self) -> Result<Option<Trajectory<BufWriter<File>>>> {
        let file = self.trajectory.as_deref().map(output::create).transpose()?;
        Ok(file.map(|file| Trajectory::new(file, self.trajectory_format)))
    }

    /// Begins what is left behind: a picture, a folder, both or nothing.
    pub fn leave(&self, log: &Log, is_sampled: bool) -> Result<Leave> {
        let mount = self.mount_of(log);
        let scans = self.count(log.scans.len());
        let drawn = (scans / DRAWN).max(1);
        let start = log.scans.iter().find_map(|scan| scan.wheels);
        let setup = Setup {
            origin: TruePose::default(),
            mount,
            scans,
            drawn,
            has: (false, start.is_some()),
            is_sampled,
        };
        let left = Left {
            folder: self.folder(),
            pictures: &self.picture,
        };
        let is_wanted = left.folder.is_some() || !left.pictures.is_empty();
        let run = is_wanted.then(|| Run::create(&left, &setup));
        Ok(Leave {
            run: run.transpose()?,
            elapsed: Elapsed::default(),
            start,
        })
    }

    /// The folder for all that a run leaves behind.
    fn folder(&self) -> Option<(&Path, run::Format)> {
        let folder = self.out.as_deref()?;
        Some((folder, self.recording_format.into()))
    }

    /// How many of a log's scans are replayed.
    pub fn count(&self, scans: usize) -> usize {
        self.scans.map_or(scans, |most| most.min(scans))
    }

    /// The log's name without its folders.
    pub fn name(&self) -> String {
        let name = self.log.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    }
}

/// What a replay leaves behind.
pub struct Leave {
    run: Option<Run>,
    elapsed: Elapsed,
    /// The wheels' first pose.
    start: Option<Pose>,
}

impl Leave {
    /// Takes a scan in: where the robot is at its end, how well that is known, whether a match confirms it.
    pub fn push(
        &mut self,
        scan: &Recorded,
        estimate: Pose,
        covariance: Option<Covariance>,
        is_measured: bool,
    ) -> Result<()> {
        let wheels = self.start.zip(scan.wheels);
        let at = At {
            time: self.elapsed.at(&scan.beams),
            estimate,
            covariance,
            is_measured,
            truth: None,
            wheels: wheels.map(|(start, now)| start.between(now)),
        };
        match &mut self.run {
            Some(run) => run.push(scan, at),
            None => Ok(()),
        }
    }

    /// Draws and closes.
    pub fn finish(
        self,
        args: &Args,
        (title, caption): (String, String),
        field: Option<LikelihoodField<&[u8]>>,
    ) -> Result<()> {
        let Some(run) = self.run else {
            return Ok(());
        };
        let (files, mut remarks) = run.finish(Titles { title, caption }, None, field)?;
        if let Some(folder) = &args.out {
            remarks.push(format!("{}: {}", folder.display(), files.join(" ")));
        }
        output::remark(&remarks);
        Ok(())
    }
}
