//! A simulated robot that is driven by hand, and what comes over its lines.

use anyhow::{Context, Result, anyhow, ensure};
use beamfix::lidar::Model;
use beamfix::scan::Mount;
use beamfix_sim::encoder::{self, Encoder};
use beamfix_sim::place::Place;
use beamfix_sim::robot::PERIOD;
use beamfix_sim::{Noise, Settings, TruePose, Underway};
use host_tests::decode;
use host_tests::formats::capture::{Content, Recorder, simulated};
use host_tests::size;

use crate::twin::BEAMS;

/// Nearest that the robot's middle comes to anything (m): half its width.
const NEAREST: f64 = 0.13;
/// Messages of the wheels a second, where the place does not say otherwise.
const WHEELS: f64 = 20.0;

/// The drive so far.
pub struct Live {
    pub model: &'static Model,
    pub settings: Settings,
    pub underway: Underway,
    sensor: Box<dyn Encoder>,
    recorder: Recorder<Vec<u8>>,
    noise: Noise,
    periods: u32,
    /// Time between two messages of the wheels (periods).
    wheels: u32,
    /// Time left of the last call (s).
    left: f64,
}

/// The lidars whose revolutions fit whole.
pub fn lidars() -> impl Iterator<Item = &'static Model> {
    Model::ALL
        .iter()
        .filter(|model| size::of_model(model) <= BEAMS)
}

impl Live {
    /// A robot with the lidar of this name in the world of this name, or of this description.
    pub fn start(lidar: &str, world: &str, seed: u64) -> Result<Self> {
        let model = decode::model(lidar, &[])?;
        let place = Place::named(world, seed).map_or_else(
            || {
                Place::parse(world, &mut |_| {
                    Err("no map here: walls, boxes, columns".into())
                })
                .map_err(|why| anyhow!("the world: {why}"))
            },
            Ok,
        )?;
        let settings = Settings {
            seed,
            ..simulated::settings(model)
        };
        let wheels_per_s = place.nature.wheels_per_s.unwrap_or(WHEELS);
        let wheels = (1.0 / (wheels_per_s * PERIOD)).round().max(1.0) as u32;
        let mut sensor = encoder::for_model(model);
        ensure!(
            sensor.sway(place.nature.sway),
            "the simulated {} turns steadily",
            model.name
        );
        let mut recorder = Recorder::new(Vec::new())?;
        recorder.push(0, Content::Lidar(model.name))?;
        let mount = Mount {
            robot_from_lidar: settings.mount.into(),
            ..Mount::DEFAULT
        };
        recorder.push(0, Content::Mount(mount))?;
        // It drives by hand.
        let place = Place {
            way: Vec::new(),
            ..place
        };
        Ok(Self {
            underway: Underway::new(place, &settings, sensor.as_mut()),
            sensor,
            model,
            settings,
            recorder,
            noise: Noise::new(seed, 3),
            periods: 0,
            wheels,
            left: 0.0,
        })
    }

    /// Drives on; `take` gets what comes over the lines, with its time (µs).
    pub fn advance(
        &mut self,
        seconds: f64,
        (speed, turn): (f64, f64),
        take: &mut dyn FnMut(u64, Content<'_>),
    ) -> Result<()> {
        self.left += seconds;
        while self.left >= PERIOD {
            self.left -= PERIOD;
            self.period(speed, turn);
            self.hand_on(take)?;
        }
        Ok(())
    }

    fn period(&mut self, speed: f64, turn: f64) {
        let before = self.underway.robot.pose;
        self.underway.robot.aim(speed, turn);
        self.underway.go_on(self.sensor.as_mut());
        self.periods += 1;
        // A wall holds the robot, and its wheels slip on.
        let after = self.underway.robot.pose;
        let clearance = |pose: TruePose| self.underway.world.clearance([pose.x, pose.y]);
        if clearance(after) < NEAREST.min(clearance(before)) {
            self.underway.robot.pose = TruePose {
                theta: after.theta,
                ..before
            };
        }
    }

    fn hand_on(&mut self, take: &mut dyn FnMut(u64, Content<'_>)) -> Result<()> {
        let Self {
            underway, recorder, ..
        } = self;
        let mut hand = |time_us: u64, content: Content<'_>| -> Result<()> {
            recorder.push(time_us, content)?;
            take(time_us, content);
            Ok(())
        };
        for (seconds, rate) in underway.gyro.drain(..) {
            hand((seconds * 1e6) as u64, Content::Gyro(rate as f32))?;
        }
        if self.periods.is_multiple_of(self.wheels) {
            let time_us = (underway.now * 1e6) as u64;
            hand(time_us, Content::Wheels(underway.robot.wheels.into()))?;
        }
        let mut start = 0;
        for &(end, measured_us) in &underway.frames {
            let bytes = underway.bytes.get(start..end).context("a frame's bytes")?;
            let on_line_us = bytes.len() as f64 * 1e7 / f64::from(self.model.baud);
            hand((measured_us + on_line_us) as u64, Content::Bytes(bytes))?;
            start = end;
        }
        underway.bytes.clear();
        underway.frames.clear();
        underway.moments.clear();
        Ok(())
    }

    /// Puts the robot elsewhere, unless something stands there.
    pub fn carry(&mut self, pose: TruePose) -> bool {
        let is_free = self.is_free(pose);
        if is_free {
            self.underway.robot.pose = pose;
        }
        is_free
    }

    /// Puts the robot at some free place, at least 1.5 m from where it was.
    pub fn kidnap(&mut self) {
        let (low, high) = self.underway.world.extent();
        let before = self.underway.robot.pose;
        for _ in 0..10_000 {
            let [x, y] = [0, 1].map(|k| self.noise.even(low[k], high[k]));
            let pose = TruePose::new(x, y, self.noise.even(-3.1, 3.1));
            let far = before.between(pose).distance() > 1.5;
            if far && self.underway.world.clearance([x, y]) > 0.4 && self.is_free(pose) {
                self.underway.robot.pose = pose;
                return;
            }
        }
    }

    /// Whether nothing stands there, and walls all around: the robot is inside.
    fn is_free(&self, pose: TruePose) -> bool {
        let place = [pose.x, pose.y];
        let is_walled = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]
            .iter()
            .all(|&towards| self.underway.world.cast(place, towards).is_some());
        let is_open = self.underway.ranging().farthest > 30.0;
        self.underway.world.clearance(place) > NEAREST && (is_walled || is_open)
    }

    /// What `beamfix replay` reads.
    pub fn recording(&self) -> Vec<u8> {
        self.recorder.written().clone()
    }
}
