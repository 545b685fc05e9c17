//! All that a run leaves in its folder: pictures, an animation, a recording.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use beamfix::geometry::Pose;
use beamfix::scan::Mount;
use beamfix::sensor_model::likelihood_field::LikelihoodField;
use beamfix_sim::{TruePose, World};

use super::mcap::McapFile;
use super::picture::heat::Heat;
use super::picture::{self, Drawing};
use super::rosbag::RosBag;
use super::sample::Sample;
use super::track::{At, Errors, Track};
use crate::formats::{Recorded, ros_map};

/// How a run is recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// `run.mcap`, with Foxglove's schemas.
    Foxglove,
    /// The folder `bag`, a ROS 2 bag.
    Ros2,
}

/// What is known before the first scan.
pub struct Setup {
    /// Where the start lies on the picture.
    pub origin: TruePose,
    /// How the lidar sits on the robot.
    pub mount: Mount,
    /// How many scans there will be.
    pub scans: usize,
    /// Every so many scans are drawn.
    pub drawn: usize,
    /// Poses beside the estimate that every scan has: the truth, the wheels.
    pub has: (bool, bool),
    /// Whether two scans are matched before everybody's eyes: not those of a ring of rangers.
    pub is_sampled: bool,
}

enum Recording {
    Foxglove(Box<McapFile>),
    Ros2(Box<RosBag>),
}

/// A run being written.
pub struct Run {
    folder: PathBuf,
    track: Track,
    sample: Option<Sample>,
    recording: Recording,
    has: (bool, bool),
}

/// What stands over the pictures.
pub struct Titles {
    /// Of all pictures.
    pub title: String,
    /// Of the map.
    pub caption: String,
}

impl Run {
    /// Makes the folder and starts the recording.
    pub fn create(folder: &Path, format: Format, setup: &Setup) -> Result<Self> {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        let mut poses = vec!["estimate"];
        poses.extend(setup.has.0.then_some("truth"));
        poses.extend(setup.has.1.then_some("wheels"));
        let recording = match format {
            Format::Foxglove => {
                let file = McapFile::create(&folder.join("run.mcap"), &poses)?;
                Recording::Foxglove(Box::new(file))
            }
            Format::Ros2 => {
                Recording::Ros2(Box::new(RosBag::create(&folder.join("bag"), setup.mount)?))
            }
        };
        Ok(Self {
            folder: folder.to_owned(),
            track: Track::new(setup.origin, setup.mount.robot_from_lidar, setup.drawn),
            sample: setup
                .is_sampled
                .then(|| Sample::new(setup.mount, setup.scans)),
            recording,
            has: setup.has,
        })
    }

    /// Keeps a file's bytes inside `run.mcap`; a bag keeps none.
    pub fn attach(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        match &mut self.recording {
            Recording::Foxglove(file) => file.attach(name, bytes),
            Recording::Ros2(_) => Ok(()),
        }
    }

    /// Takes a scan in.
    pub fn push(&mut self, scan: &Recorded, at: At) -> Result<()> {
        let points = self.track.push(at, &scan.beams);
        if let Some(sample) = &mut self.sample {
            sample.push(&at, &scan.beams);
        }
        match &mut self.recording {
            Recording::Foxglove(file) => {
                let or_start = |pose: Option<Pose>| pose.unwrap_or(Pose::IDENTITY);
                let mut poses = vec![at.estimate];
                poses.extend(self.has.0.then(|| or_start(at.truth)));
                poses.extend(self.has.1.then(|| or_start(at.wheels)));
                file.push(at.time, &points, &poses)
            }
            Recording::Ros2(bag) => bag.push(scan, &at),
        }
    }

    /// Of the estimates against the truth.
    #[must_use]
    pub fn errors(&self) -> Errors {
        self.track.errors()
    }

    /// Draws and closes; gives the names of what was written, and remarks.
    pub fn finish(
        self,
        titles: Titles,
        world: Option<World>,
        field: Option<LikelihoodField<&[u8]>>,
    ) -> Result<(Vec<String>, Vec<String>)> {
        let Titles { title, caption } = titles;
        let map = self.track.map(title.clone(), caption.clone(), world);
        let chart = self.track.chart(title.clone());
        let pair = self.sample.as_ref().and_then(Sample::picture);
        let heat = field.map(|field| Heat {
            title: format!("{title}: likelihood field"),
            caption,
            field,
            path: self.track.driven(),
        });
        let grid = self.track.grid();
        let folder = self.folder.clone();
        let mut files = Vec::new();
        std::thread::scope(|scope| -> Result<()> {
            // The map is half of the work.
            let drawn = scope.spawn(|| save(&map, &folder, "map.png"));
            files.push(save_unless(
                chart.is_empty(),
                &chart,
                &folder,
                "errors.svg",
            )?);
            if let Some(pair) = &pair {
                files.push(Some(save(pair, &folder, "match.png")?));
                picture::animate(&pair.frames(), &folder.join("match.gif"))?;
                files.push(Some("match.gif".into()));
            }
            if let Some(heat) = &heat {
                files.push(Some(save(heat, &folder, "field.png")?));
            }
            let name = drawn.join().map_err(|_| anyhow::anyhow!("map.png"))??;
            files.insert(0, Some(name));
            Ok(())
        })?;
        if let Some(grid) = &grid {
            ros_map::write(grid, &folder.join("seen.yaml"))?;
            files.push(Some("seen.yaml seen.pgm".into()));
        }
        let mut remarks = Vec::new();
        match self.recording {
            Recording::Foxglove(mut file) => {
                if let Some(grid) = &grid {
                    file.push_map(grid)?;
                }
                file.finish()?;
                files.push(Some("run.mcap".into()));
            }
            Recording::Ros2(mut bag) => {
                if let Some(grid) = &grid {
                    bag.push_map(grid)?;
                }
                remarks.extend(bag.moved());
                bag.finish()?;
                files.push(Some("bag/".into()));
            }
        }
        Ok((files.into_iter().flatten().collect(), remarks))
    }
}

fn save(drawing: &impl Drawing, folder: &Path, name: &str) -> Result<String> {
    picture::save(drawing, &folder.join(name))?;
    Ok(name.into())
}

fn save_unless(
    is_empty: bool,
    drawing: &impl Drawing,
    folder: &Path,
    name: &str,
) -> Result<Option<String>> {
    if is_empty {
        return Ok(None);
    }
    save(drawing, folder, name).map(Some)
}
