//! A board's messages as ROS 2's.

use std::collections::VecDeque;

use beamfix::geometry::{Pose, Twist};
use beamfix::lidar::Model;
use beamfix::scan::Mount;
use beamfix_app::link::Receiver;
use beamfix_app::telemetry::{self, Health, LidarState, Ready, Reset, Task, Telemetry, Verdict};
use host_tests::report::ros::message::{
    Diagnostics, Estimate, LaserScan, Odometry, Status, Time, Transform,
};
use host_tests::report::ros::{
    LIDAR, MAP, ODOM, ROBOT, header, mounted, not_known, placed, six_by_six, transform,
};

use crate::clock::Clock;
use crate::message::Message;
use crate::sweep::{Array, Sweep};

/// How long poses of the wheels are kept (ns): longer than a pose of the board can be late.
const KEPT_NS: i64 = 2_000_000_000;
/// Longest gap between two poses (s) over which a speed is told.
const LONGEST_STEP: f32 = 1.0;

/// What one board says, turned into messages.
pub struct Converter {
    receiver: Receiver,
    clock: Clock,
    sweep: Sweep,
    task: Task,
    model: Option<&'static Model>,
    lidar: String,
    health: Option<Health>,
    last: Option<Measured>,
    /// Time of the last revolution (s), once two poses have come.
    period: Option<f32>,
    /// The last pose is that of the revolution that comes to its end next.
    is_fresh: bool,
    /// When (ns) and where the wheels have been lately.
    wheels: VecDeque<(i64, Pose)>,
    /// Level and text that were told last.
    told: Option<(u8, String)>,
    /// The board has told what it is.
    pub is_known: bool,
    /// Starts of the board that were heard.
    pub starts: u32,
    /// Poses so far.
    pub poses: u32,
    /// Poses lost on the way, by their numbers.
    pub missing: u32,
}

/// A pose, and when.
#[derive(Clone, Copy)]
struct Measured {
    pose: telemetry::Pose,
    at: Pose,
    stamp_ns: i64,
}

impl Converter {
    /// Nothing has come yet; the task is the one that a board has that was not heard starting.
    #[must_use]
    pub fn new(task: Task) -> Self {
        Self {
            receiver: Receiver::new(),
            clock: Clock::default(),
            sweep: Sweep::default(),
            task,
            model: None,
            lidar: String::new(),
            health: None,
            last: None,
            period: None,
            is_fresh: false,
            wheels: VecDeque::new(),
            told: None,
            is_known: false,
            starts: 0,
            poses: 0,
            missing: 0,
        }
    }

    /// Takes bytes of the board that came at `now_ns` since the epoch; gives what they make.
    pub fn push(&mut self, bytes: &[u8], now_ns: i64) -> Vec<Message> {
        let mut messages = Vec::new();
        for &byte in bytes {
            match self.receiver.push::<Telemetry>(byte) {
                Some(Telemetry::Ready(ready)) => messages.push(self.ready(&ready, now_ns)),
                Some(Telemetry::Pose(pose)) => self.pose(pose, now_ns, &mut messages),
                Some(Telemetry::Scan(piece)) => {
                    if let Some(array) = self.sweep.push(&piece) {
                        messages.extend(self.scan(array));
                    }
                }
                Some(Telemetry::Health(health)) => {
                    self.health = Some(health);
                    self.told = None;
                    messages.extend(self.diagnostics(now_ns));
                }
                _ => {}
            }
        }
        messages
    }

    /// Takes the robot's pose by its wheels. In a map, where they tell how the robot moves, they are a transform.
    pub fn wheels(&mut self, pose: Pose, stamp_ns: i64) -> Option<Message> {
        if !pose.is_finite() {
            return None;
        }
        self.wheels.push_back((stamp_ns, pose));
        while let Some(&(oldest, _)) = self.wheels.front()
            && oldest < stamp_ns - KEPT_NS
        {
            self.wheels.pop_front();
        }
        (self.task == Task::Localization)
            .then(|| Message::Transforms(vec![step(stamp_ns, [ODOM, ROBOT], pose)]))
    }

    /// Nothing has come for a while.
    pub fn silence(&mut self, now_ns: i64) -> Option<Message> {
        self.tell(now_ns, 2, "nothing comes from the board")
    }

    fn ready(&mut self, ready: &Ready, now_ns: i64) -> Message {
        self.is_known = true;
        self.task = ready.task;
        self.model = Model::ALL
            .iter()
            .find(|model| model.name == ready.lidar.as_str());
        self.lidar = ready.lidar.as_str().to_owned();
        if ready.reset != Reset::Asked {
            self.starts += 1;
            // It starts from its origin, and so may its lidar's clock.
            (self.last, self.period, self.is_fresh) = (None, None, false);
            self.clock = Clock::default();
            self.sweep.interrupt();
        }
        Message::Mount(mount(ready.mount.mount(), now_ns))
    }

    fn pose(&mut self, pose: telemetry::Pose, now_ns: i64, messages: &mut Vec<Message>) {
        let [x, y, theta] = pose.pose;
        let at = Pose { x, y, theta };
        if !at.is_finite() || !pose.covariance.iter().all(|value| value.is_finite()) {
            return;
        }
        let stamp_ns = self.clock.stamp(pose.time_us, now_ns);
        let now = Measured { pose, at, stamp_ns };
        let before = self.last.replace(now);
        self.poses += 1;
        self.is_fresh = true;
        self.period = None;
        let mut twist = Twist::ZERO;
        if let Some(before) = before {
            // One that went back is that of a board that has started again, unheard.
            let steps = pose.sequence.wrapping_sub(before.pose.sequence);
            let steps = if steps < 1 << 15 { steps } else { 0 };
            let seconds = pose.time_us.wrapping_sub(before.pose.time_us) as f32 * 1e-6;
            self.missing += u32::from(steps).saturating_sub(1);
            if steps > 0 && seconds > 0.0 && seconds < LONGEST_STEP {
                self.period = Some(seconds / f32::from(steps));
                twist = Twist::from_motion(before.at.between(at), seconds);
            }
        }
        if !is_unknown(pose.verdict) {
            match self.task {
                Task::Odometry => {
                    messages.push(Message::Transforms(vec![step(stamp_ns, [ODOM, ROBOT], at)]));
                    messages.push(Message::Odometry(Box::new(odometry(&now, twist))));
                }
                Task::Localization => {
                    messages.push(Message::Transforms(self.in_map(at, stamp_ns)));
                    messages.push(Message::Pose(Box::new(Estimate {
                        header: header(time(stamp_ns), MAP),
                        pose: placed(at),
                        covariance: six_by_six(pose.covariance),
                    })));
                }
            }
        }
        messages.extend(self.diagnostics(now_ns));
    }

    /// Where the wheels' frame is in the map; without wheels, where the robot is, and the wheels' frame is the map's.
    fn in_map(&self, map_from_robot: Pose, stamp_ns: i64) -> Vec<Transform<'static>> {
        match self.wheels_at(stamp_ns) {
            Some(odom_from_robot) => {
                let map_from_odom = map_from_robot * odom_from_robot.inverse();
                vec![step(stamp_ns, [MAP, ODOM], map_from_odom)]
            }
            None => vec![
                step(stamp_ns, [MAP, ODOM], Pose::IDENTITY),
                step(stamp_ns, [ODOM, ROBOT], map_from_robot),
            ],
        }
    }

    /// Between the two poses of the wheels around a time, or the nearest one.
    fn wheels_at(&self, stamp_ns: i64) -> Option<Pose> {
        let next = self.wheels.partition_point(|(at, _)| *at <= stamp_ns);
        let after = self.wheels.get(next);
        let before = next.checked_sub(1).and_then(|k| self.wheels.get(k));
        match (before, after) {
            (Some(&(from, pose)), Some(&(to, later))) => {
                let share = (stamp_ns - from) as f32 / (to - from) as f32;
                let motion = Twist::from_motion(pose.between(later), 1.0).displacement(share);
                Some(pose * motion)
            }
            (one, other) => one.or(other).map(|&(_, pose)| pose),
        }
    }

    /// A revolution whose pose has come just before; without that nobody knows when it was.
    fn scan(&mut self, array: Array) -> Option<Message> {
        let end = std::mem::take(&mut self.is_fresh).then_some(self.last)??;
        let seconds = self.period?;
        let gaps = array.ranges.len().saturating_sub(1) as f32;
        let each = seconds / array.ranges.len() as f32;
        let sweep_ns = (f64::from(each * gaps) * 1e9) as i64;
        let (stamp_ns, time_increment) = if array.is_clockwise {
            (end.stamp_ns, -each)
        } else {
            (end.stamp_ns - sweep_ns, each)
        };
        let metres = |mm: u16| f32::from(mm) / 1000.0;
        let (nearest, farthest) = self
            .model
            .map_or((0, beamfix::scan::Range::MAX_MM), |model| {
                (model.min_range_mm, model.max_range_mm)
            });
        Some(Message::Scan(LaserScan {
            header: header(time(stamp_ns), LIDAR),
            angle_min: array.first,
            angle_max: array.first + array.step * gaps,
            angle_increment: array.step,
            time_increment,
            scan_time: seconds,
            range_min: metres(nearest),
            range_max: metres(farthest),
            ranges: array.ranges,
            intensities: Vec::new(),
        }))
    }

    /// How it is, where that is news.
    fn diagnostics(&mut self, now_ns: i64) -> Option<Message> {
        let lidar = self
            .health
            .map_or(LidarState::Unknown, |health| health.lidar);
        let is_lidar_well = matches!(
            lidar,
            LidarState::Turning | LidarState::Unknown | LidarState::Starting
        );
        let verdict = self.last.map(|last| last.pose.verdict);
        let (level, text) = match verdict {
            _ if !is_lidar_well => (2, format!("the lidar: {lidar:?}")),
            None => (1, "no pose yet".to_owned()),
            Some(Verdict::Measured | Verdict::Keyframe) => (0, "the pose is measured".to_owned()),
            Some(Verdict::First) => (0, "the first revolution".to_owned()),
            Some(verdict) if is_unknown(verdict) => {
                (2, format!("nobody knows the pose: {verdict:?}"))
            }
            Some(verdict) => (1, format!("the pose is only predicted: {verdict:?}")),
        };
        self.tell(now_ns, level, &text)
    }

    fn tell(&mut self, now_ns: i64, level: u8, text: &str) -> Option<Message> {
        let news = (level, text.to_owned());
        if self.told.as_ref() == Some(&news) {
            return None;
        }
        self.told = Some(news);
        let mut values = vec![("poses missing", self.missing.to_string())];
        if let Some(last) = &self.last {
            values.push(("beams that agree", last.pose.inliers.to_string()));
            values.push(("beams with a range", last.pose.beams.to_string()));
            values.push(("residual (m)", format!("{:.4}", last.pose.residual)));
        }
        if let Some(health) = &self.health {
            values.push(("lidar", format!("{:?}", health.lidar)));
            values.push(("packets damaged", health.check_errors.to_string()));
            values.push(("bytes lost", health.bytes_lost.to_string()));
        }
        Some(Message::Diagnostics(Diagnostics {
            header: header(time(now_ns), ""),
            status: vec![Status {
                level,
                name: "beamfix: pose",
                message: text.to_owned(),
                hardware_id: self.lidar.clone(),
                values,
            }],
        }))
    }
}

/// The lidar on the robot, as a transform that holds from now on.
#[must_use]
pub fn mount(mount: Mount, now_ns: i64) -> Transform<'static> {
    transform(time(now_ns), [ROBOT, LIDAR], mounted(mount))
}

/// A time since the epoch (ns).
#[must_use]
pub fn time(ns: i64) -> Time {
    Time {
        sec: ns.div_euclid(1_000_000_000) as i32,
        nanosec: ns.rem_euclid(1_000_000_000) as u32,
    }
}

fn step(stamp_ns: i64, frames: [&'static str; 2], pose: Pose) -> Transform<'static> {
    transform(time(stamp_ns), frames, placed(pose))
}

/// Whether the pose is all zeros because nobody knows it.
fn is_unknown(verdict: Verdict) -> bool {
    matches!(verdict, Verdict::Searching | Verdict::Choosing)
}

/// The velocity is that of the last step, of which the board tells no covariance.
fn odometry(now: &Measured, twist: Twist) -> Odometry<'static> {
    let [vx, vy, omega] = [twist.vx, twist.vy, twist.omega].map(f64::from);
    Odometry {
        header: header(time(now.stamp_ns), ODOM),
        child_frame_id: ROBOT,
        pose: placed(now.at),
        pose_covariance: six_by_six(now.pose.covariance),
        twist: [[vx, vy, 0.0], [0.0, 0.0, omega]],
        twist_covariance: not_known(),
    }
}
