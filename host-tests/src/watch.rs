//! Following a board by what it sends: its path, what its lidar sees, how it is; and a recording of the lidar's bytes.

use std::io::{self, Write};

use beamfix::{
    geometry::{Point, Pose},
    scan::Mount,
};
use beamfix_app::{
    link::{Counters, Receiver},
    telemetry::{Health, Quality, Ready, Reset, Telemetry},
};

use crate::decode::Unwrapped;
use crate::formats::capture::{Content, Recorder, telemetry};
use crate::report::hash::PoseHash;
use crate::report::live::Server;
use crate::report::picture::{
    colour,
    map::{Map, Path},
};

/// About so many points are drawn.
const POINTS: usize = 60_000;

/// What has come from a board so far.
pub struct Watch<W> {
    receiver: Receiver,
    recorder: Option<Recorder<W>>,
    qualities: Option<W>,
    /// Where scans and poses are sent on to, if anywhere.
    pub server: Option<Server>,
    /// Starts of the board.
    pub starts: u32,
    /// What it said at its start.
    pub ready: Option<Ready>,
    /// How it was last.
    pub health: Option<Health>,
    /// Poses.
    pub poses: u32,
    /// Poses that are missing, by their numbers.
    pub missing: u32,
    /// Over all poses.
    pub hash: PoseHash,
    /// The last pose.
    pub pose: Option<beamfix_app::telemetry::Pose>,
    /// How good its match was.
    pub quality: Option<Quality>,
    /// Matches that were told about in numbers.
    pub qualities_seen: u32,
    /// Of these, the ones with a direction that is hardly determined.
    pub weak: u32,
    /// Bytes recorded.
    pub recorded: usize,
    clock: telemetry::Clock,
    /// The poses' clock, which wraps after 71.6 minutes on the link.
    pose_clock: Unwrapped,
    pose_us: u64,
    path: Vec<[f64; 2]>,
    truth: Vec<[f64; 2]>,
    /// Beams of the revolution in progress, in the robot's frame.
    revolution: Vec<Point>,
    revolutions: usize,
    points: Vec<[f64; 2]>,
}

impl<W: Write> Watch<W> {
    /// Nothing so far; the lidar's bytes go into `recording`, how good each match was as lines of CSV into `qualities`.
    pub fn new(recording: Option<W>, mut qualities: Option<W>) -> io::Result<Self> {
        if let Some(qualities) = &mut qualities {
            writeln!(qualities, "{QUALITY_COLUMNS}")?;
        }
        Ok(Self {
            receiver: Receiver::new(),
            recorder: recording.map(Recorder::new).transpose()?,
            qualities,
            server: None,
            starts: 0,
            ready: None,
            health: None,
            poses: 0,
            missing: 0,
            hash: PoseHash::new(),
            pose: None,
            quality: None,
            qualities_seen: 0,
            weak: 0,
            recorded: 0,
            clock: telemetry::Clock::default(),
            pose_clock: Unwrapped::default(),
            pose_us: 0,
            path: Vec::new(),
            truth: Vec::new(),
            revolution: Vec::new(),
            revolutions: 0,
            points: Vec::new(),
        })
    }

    /// Takes bytes that came from the board.
    pub fn push(&mut self, bytes: &[u8]) -> io::Result<()> {
        for &byte in bytes {
            if let Some(message) = self.receiver.push::<Telemetry>(byte) {
                self.take(message)?;
            }
        }
        // Whoever ends it by a signal keeps what came so far.
        if let Some(qualities) = &mut self.qualities {
            qualities.flush()?;
        }
        if let Some(recorder) = &mut self.recorder {
            recorder.flush()?;
        }
        Ok(())
    }

    /// Frames seen and damaged.
    pub fn counters(&self) -> Counters {
        self.receiver.counters()
    }

    /// Ends the recording and the list.
    pub fn finish(&mut self) -> io::Result<()> {
        if let Some(mut qualities) = self.qualities.take() {
            qualities.flush()?;
        }
        match self.recorder.take() {
            Some(recorder) => recorder.finish().map(drop),
            None => Ok(()),
        }
    }

    fn take(&mut self, message: Telemetry) -> io::Result<()> {
        match message {
            Telemetry::Ready(ready) => {
                if ready.reset != Reset::Asked {
                    self.starts += 1;
                    // It starts from the origin again, and so may its clock.
                    self.pose = None;
                    self.pose_clock = Unwrapped::default();
                }
                // Once: whoever is asked again says the same.
                if let Some(recorder) = &mut self.recorder
                    && self.ready.is_none()
                {
                    for content in telemetry::setup(&ready) {
                        recorder.push(0, content)?;
                    }
                }
                self.ready = Some(ready);
            }
            Telemetry::Pose(pose) => {
                if let Some(last) = &self.pose {
                    let step = pose.sequence.wrapping_sub(last.sequence);
                    self.missing += u32::from(step).saturating_sub(1);
                }
                let [x, y, theta] = pose.pose;
                self.hash.push(Pose { x, y, theta });
                self.path.push([x.into(), y.into()]);
                self.poses += 1;
                self.pose_us = self.pose_clock.at(pose.time_us);
                self.pose = Some(pose);
            }
            Telemetry::Health(health) => self.health = Some(health),
            Telemetry::Quality(quality) => {
                self.qualities_seen += 1;
                let found = quality.found.ok();
                self.weak += u32::from(found.is_some_and(|found| found.weak.is_some()));
                self.quality = Some(quality);
                let pose = self.pose.filter(|pose| pose.sequence == quality.sequence);
                if let (Some(file), Some(pose)) = (&mut self.qualities, pose) {
                    writeln!(file, "{}", quality_line(&pose, self.pose_us, &quality))?;
                }
            }
            Telemetry::Truth(truth) => {
                self.truth
                    .push([truth.pose[0].into(), truth.pose[1].into()]);
            }
            Telemetry::Raw(_) | Telemetry::Wheels(_) | Telemetry::Gyro(_) | Telemetry::Zero(_) => {
                if let Some((time_us, content)) = telemetry::content(&message) {
                    if let Content::Bytes(bytes) = content {
                        self.recorded += bytes.len();
                    }
                    let now_us = self.clock.after(time_us);
                    if let Some(recorder) = &mut self.recorder {
                        recorder.push(now_us, content)?;
                    }
                }
            }
            Telemetry::Scan(piece) => {
                // A board that was not heard starting: as if the lidar sat at the robot's centre, looking forward.
                let mount = self
                    .ready
                    .as_ref()
                    .map_or(Mount::DEFAULT, |ready| ready.mount.mount());
                for (k, (bearing, mm)) in piece.beams().enumerate() {
                    if piece.turn_start == Some(k as u8) {
                        self.place();
                    }
                    if mm > 0 {
                        let bearing = match mount.upside_down {
                            true => -bearing.radians(),
                            false => bearing.radians(),
                        };
                        let (s, c) = beamfix::math::sin_cos(bearing);
                        let metres = f32::from(mm) / 1000.0;
                        let seen = Point::new(metres * c, metres * s);
                        self.revolution.push(mount.robot_from_lidar * seen);
                    }
                }
            }
            Telemetry::Cost(_) => {}
        }
        Ok(())
    }

    /// The revolution is complete: where its points are, the pose that came just before says.
    fn place(&mut self) {
        let revolution = std::mem::take(&mut self.revolution);
        let Some(pose) = &self.pose else {
            return;
        };
        let [x, y, theta] = pose.pose;
        let robot = Pose { x, y, theta };
        self.revolutions += 1;
        if let Some(server) = &self.server {
            server.scan(&revolution, robot);
        }
        // Of a long run, a part of all revolutions.
        if self.points.len() > POINTS {
            let mut k = 0;
            self.points.retain(|_| {
                k += 1;
                k % 2 == 0
            });
        }
        self.points.extend(revolution.into_iter().map(|point| {
            let seen = robot * point;
            [f64::from(seen.x), f64::from(seen.y)]
        }));
    }

    /// One line: how it is.
    pub fn status(&self) -> String {
        let counters = self.counters();
        let pose = self.pose.as_ref().map_or_else(String::new, |pose| {
            let [x, y, theta] = pose.pose;
            format!(
                ", x {x:.3} m, y {y:.3} m, heading {:.2}°, {:?}, {} of {} beams agree",
                theta.to_degrees(),
                pose.verdict,
                pose.inliers,
                pose.beams
            )
        });
        let health = self.health.as_ref().map_or_else(String::new, |health| {
            format!(
                ", lidar {:?}, {} bytes lost, {} packets damaged",
                health.lidar, health.bytes_lost, health.check_errors
            )
        });
        let found = self.quality.and_then(|quality| quality.found.ok());
        let quality = found.map_or_else(String::new, |found| {
            let weak = found.weak.map_or_else(String::new, |weak| {
                let [x, y, rotation] = weak.direction;
                format!(
                    ", hardly determined along ({x:.2}, {y:.2}, {rotation:.2}): {:.2} m",
                    weak.sigma
                )
            });
            format!(", score {:.2}{weak}", found.score)
        });
        format!(
            "{} poses ({} missing), {} frames damaged{pose}{quality}{health}",
            self.poses, self.missing, counters.errors
        )
    }

    /// Everything so far.
    pub fn map(&self, title: &str) -> Map {
        let path = |name: &str, colour, width, places: &Vec<[f64; 2]>| Path {
            name: name.into(),
            colour,
            width,
            places: places.clone(),
        };
        let mut paths = Vec::new();
        if !self.truth.is_empty() {
            paths.push(path("true path", colour::GREEN, 5, &self.truth));
        }
        paths.push(path("the board's path", colour::RED, 2, &self.path));
        Map {
            title: title.into(),
            caption: self.status(),
            world: None,
            points: self.points.clone(),
            paths,
            ellipses: None,
        }
    }
}

/// Columns of the list of qualities: `number_1`, `number_2` are what a refusal carries; what there is not is empty.
pub const QUALITY_COLUMNS: &str = "sequence,time_us,x,y,theta,verdict,score,inliers,overlap,beams,residual,xx,xy,yy,xt,yt,tt,\
    weak_x,weak_y,weak_turn,weak_sigma,iterations,starts,rival,number_1,number_2";

fn quality_line(pose: &beamfix_app::telemetry::Pose, time_us: u64, quality: &Quality) -> String {
    let [x, y, theta] = pose.pose;
    let start = format!(
        "{},{time_us},{x},{y},{theta},{:?}",
        pose.sequence, quality.verdict
    );
    let found = match &quality.found {
        Ok(found) => found,
        Err([one, two]) => return format!("{start},{}{one},{two}", ",".repeat(18)),
    };
    let [xx, xy, yy, xt, yt, tt] = found.covariance;
    let weak = found.weak.map_or_else(
        || ",,,".into(),
        |weak| {
            let [x, y, rotation] = weak.direction;
            format!("{x},{y},{rotation},{}", weak.sigma)
        },
    );
    format!(
        "{start},{},{},{},{},{},{xx},{xy},{yy},{xt},{yt},{tt},{weak},{},{},{},,",
        found.score,
        found.inliers,
        found.overlap,
        found.beams,
        found.residual,
        found.iterations,
        found.starts,
        found.rival
    )
}
