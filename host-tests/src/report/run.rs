//! All that a run leaves behind: pictures, an animation, a recording.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow};
use beamfix::geometry::Pose;
use beamfix::scan::Mount;
use beamfix::sensor_model::likelihood_field::LikelihoodField;
use beamfix_sim::{TruePose, World};

use super::mcap::McapFile;
use super::picture::chart::Errors as Chart;
use super::picture::heat::Heat;
use super::picture::map::Map;
use super::picture::pair::PairPicture;
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

/// What is to be left behind, and where.
pub struct Left<'a> {
    /// The folder for all of it, and how the run is recorded there.
    pub folder: Option<(&'a Path, Format)>,
    /// Pictures beside it: `.png` or `.svg`. What each shows, its name says: `errors`, `match`, `field`, any other the map.
    pub pictures: &'a [PathBuf],
}

impl Left<'_> {
    /// Whether one of the pictures is a likelihood field.
    #[must_use]
    pub fn has_field(&self) -> bool {
        self.pictures.iter().any(|path| shows(path) == Shows::Field)
    }
}

/// What a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shows {
    Map,
    Errors,
    Match,
    Field,
}

fn shows(path: &Path) -> Shows {
    match path.file_stem().and_then(|stem| stem.to_str()) {
        Some("errors") => Shows::Errors,
        Some("match") => Shows::Match,
        Some("field") => Shows::Field,
        _ => Shows::Map,
    }
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
    track: Track,
    sample: Option<Sample>,
    folder: Option<(PathBuf, Recording)>,
    pictures: Vec<PathBuf>,
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
    /// Makes the folder and starts the recording, where there is to be one.
    pub fn create(left: &Left<'_>, setup: &Setup) -> Result<Self> {
        let mut poses = vec!["estimate"];
        poses.extend(setup.has.0.then_some("truth"));
        poses.extend(setup.has.1.then_some("wheels"));
        let begun = |(folder, format): (&Path, Format)| -> Result<(PathBuf, Recording)> {
            std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
            let recording = match format {
                Format::Foxglove => {
                    let file = McapFile::create(&folder.join("run.mcap"), &poses)?;
                    Recording::Foxglove(Box::new(file))
                }
                Format::Ros2 => {
                    let bag = RosBag::create(&folder.join("bag"), setup.mount)?;
                    Recording::Ros2(Box::new(bag))
                }
            };
            Ok((folder.to_owned(), recording))
        };
        Ok(Self {
            folder: left.folder.map(begun).transpose()?,
            pictures: left.pictures.to_vec(),
            track: Track::new(setup.origin, setup.mount.robot_from_lidar, setup.drawn),
            sample: setup
                .is_sampled
                .then(|| Sample::new(setup.mount, setup.scans)),
            has: setup.has,
        })
    }

    /// Keeps a file's bytes inside `run.mcap`; a bag keeps none.
    pub fn attach(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        match &mut self.folder {
            Some((_, Recording::Foxglove(file))) => file.attach(name, bytes),
            _ => Ok(()),
        }
    }

    /// Takes a scan in.
    pub fn push(&mut self, scan: &Recorded, at: At) -> Result<()> {
        let points = self.track.push(at, &scan.beams);
        if let Some(sample) = &mut self.sample {
            sample.push(&at, &scan.beams);
        }
        match &mut self.folder {
            None => Ok(()),
            Some((_, Recording::Foxglove(file))) => {
                let or_start = |pose: Option<Pose>| pose.unwrap_or(Pose::IDENTITY);
                let mut poses = vec![at.estimate];
                poses.extend(self.has.0.then(|| or_start(at.truth)));
                poses.extend(self.has.1.then(|| or_start(at.wheels)));
                file.push(at.time, &points, &poses)
            }
            Some((_, Recording::Ros2(bag))) => bag.push(scan, &at),
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
        let Self {
            track,
            sample,
            folder,
            pictures,
            ..
        } = self;
        let heat = field.map(|field| Heat {
            title: format!("{title}: likelihood field"),
            caption: caption.clone(),
            field,
            path: track.driven(),
        });
        let drawn = Drawn {
            map: track.map(title.clone(), caption, world),
            chart: track.chart(title),
            pair: sample.as_ref().and_then(Sample::picture),
            heat,
        };
        let mut remarks = Vec::new();
        for path in &pictures {
            remarks.extend(drawn.save(path)?);
        }
        let Some((folder, recording)) = folder else {
            return Ok((Vec::new(), remarks));
        };
        let grid = std::thread::scope(|scope| -> Result<_> {
            // Each of these is a third of the work.
            let map = scope.spawn(|| save(&drawn.map, &folder, "map.png"));
            let animated = scope.spawn(|| drawn.animate(&folder.join("match.gif")));
            let grid = track.grid();
            drawn.save_rest(&folder)?;
            for done in [map, animated] {
                done.join().map_err(|_| anyhow!("a picture's thread"))??;
            }
            Ok(grid)
        })?;
        let mut files = drawn.names();
        match &grid {
            Some(grid) => {
                ros_map::write(grid, &folder.join("seen.yaml"))?;
                files.push("seen.yaml seen.pgm");
            }
            None => {
                remarks.push("seen.yaml: not written: nothing, or more than 200 m of it".into())
            }
        }
        match recording {
            Recording::Foxglove(mut file) => {
                if let Some(grid) = &grid {
                    file.push_map(grid)?;
                }
                file.finish()?;
                files.push("run.mcap");
            }
            Recording::Ros2(mut bag) => {
                if let Some(grid) = &grid {
                    bag.push_map(grid)?;
                }
                remarks.extend(bag.moved());
                bag.finish()?;
                files.push("bag/");
            }
        }
        Ok((files.into_iter().map(str::to_owned).collect(), remarks))
    }
}

/// What can be drawn of a run.
struct Drawn<'a> {
    map: Map,
    chart: Chart,
    pair: Option<PairPicture>,
    heat: Option<Heat<'a>>,
}

impl Drawn<'_> {
    /// Draws what the file's name says; a remark where there is no such thing.
    fn save(&self, path: &Path) -> Result<Option<String>> {
        let nothing = |why: &str| Ok(Some(format!("{}: not drawn: {why}", path.display())));
        match shows(path) {
            Shows::Map => picture::save(&self.map, path)?,
            Shows::Errors if self.chart.is_empty() => {
                return nothing("neither a truth nor a covariance is known");
            }
            Shows::Errors => picture::save(&self.chart, path)?,
            Shows::Match => match &self.pair {
                None => return nothing("no two scans to match"),
                Some(pair) => picture::save(pair, path)?,
            },
            Shows::Field => match &self.heat {
                None => return nothing("a field is of a map, and there is none"),
                Some(heat) => picture::save(heat, path)?,
            },
        }
        Ok(None)
    }

    fn animate(&self, path: &Path) -> Result<()> {
        match &self.pair {
            Some(pair) => picture::animate(&pair.frames(), path),
            None => Ok(()),
        }
    }

    /// Draws all but the map and the animation.
    fn save_rest(&self, folder: &Path) -> Result<()> {
        if !self.chart.is_empty() {
            save(&self.chart, folder, "errors.svg")?;
        }
        if let Some(pair) = &self.pair {
            save(pair, folder, "match.png")?;
        }
        match &self.heat {
            Some(heat) => save(heat, folder, "field.png"),
            None => Ok(()),
        }
    }

    /// Names of what is drawn into a folder.
    fn names(&self) -> Vec<&'static str> {
        let mut names = vec!["map.png"];
        names.extend((!self.chart.is_empty()).then_some("errors.svg"));
        if self.pair.is_some() {
            names.extend(["match.png", "match.gif"]);
        }
        names.extend(self.heat.is_some().then_some("field.png"));
        names
    }
}

fn save(drawing: &impl Drawing, folder: &Path, name: &str) -> Result<()> {
    picture::save(drawing, &folder.join(name))
}
