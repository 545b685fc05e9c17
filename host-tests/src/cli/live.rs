//! `live`: a lidar on this computer's serial line, followed while the robot moves.

use std::fs::File;
use std::io::BufWriter;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Result, bail, ensure};
use beamfix::geometry::Pose;
use beamfix::lidar::{Model, Protocol};
use beamfix::odometry::Odometry;
use beamfix::pipeline::{Pipeline, Revolution};
use beamfix::scan::{Beam, Mount};
use beamfix_sim::TruePose;
use host_tests::bringup;
use host_tests::decode::{WithParser, with_parser};
use host_tests::formats::capture::{Content, Piece, Recorder};
use host_tests::formats::mount;
use host_tests::pipeline::{Pieces, config, is_measured};
use host_tests::report::hash::PoseHash;
use host_tests::report::live::{ADDRESS, Server};
use host_tests::report::terminal::View;
use host_tests::report::track::{At, Elapsed, Track};
use host_tests::size::{self, SIZES};
use serde_json::json;

use super::output;

/// Follow a lidar on a serial line of this computer: starts it, finds poses from scan to scan, and draws scan, path and
/// pose in the terminal (a line where there is none).
#[derive(clap::Args)]
pub struct Args {
    /// The serial line: /dev/ttyUSB0, COM3.
    port: String,
    /// The lidar: a name that `lidars` lists, or `auto`: by what it sends, or answers.
    #[arg(long, value_name = "MODEL", default_value = "auto")]
    lidar: String,
    /// The line's speed, where it is not the lidar's usual one.
    #[arg(long, value_name = "BAUD")]
    baud: Option<u32>,
    /// The lidar's place on the robot (m, m, deg); `,down` after it for one that hangs head down.
    #[arg(long, value_name = "X,Y,DEG[,down]", value_parser = mount::parse, allow_hyphen_values = true)]
    mount: Option<Mount>,
    /// Write the lidar's bytes here, for `replay`.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Seconds between two pictures or lines.
    #[arg(long, default_value_t = 0.5, value_name = "S")]
    every: f64,
    /// Give up where no revolution comes for so long.
    #[arg(long, value_name = "S", default_value_t = 10.0)]
    timeout: f64,
    /// Print a line instead of drawing in the terminal.
    #[arg(long)]
    plain: bool,
    /// Serve scans and poses to Foxglove or Lichtblick at ws://HOST:PORT, 127.0.0.1:8765 unless told; needs a build with
    /// `--features host-tests/foxglove`.
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, require_equals = true, default_missing_value = ADDRESS)]
    foxglove: Option<String>,
    /// Stop after so many scans.
    #[arg(long, value_name = "N")]
    scans: Option<usize>,
    /// Print one JSON object at the end.
    #[arg(long)]
    json: bool,
}

/// Room for the beams of a revolution.
const BEAMS: usize = SIZES[SIZES.len() - 1];
type Following = dyn Pieces<Odometry<BEAMS>, BEAMS>;

/// Every so many scans stay on the picture.
const DRAWN: usize = 5;

/// Starts, follows, reports.
pub fn run(args: &Args) -> Result<ExitCode> {
    for (name, value) in [("--every", args.every), ("--timeout", args.timeout)] {
        ensure!(
            value.is_finite() && value >= 0.0,
            "{name} {value}: not a time"
        );
    }
    let mut port = bringup::open(&args.port, args.baud.unwrap_or(230_400))?;
    let model = bringup::start(port.as_mut(), &args.lidar, args.baud)?;
    let zero = match Model::named(model.name) {
        Some(row) if row.zero_cdeg != model.zero_cdeg => format!(
            ", {:.2}° of its own look forward, by the unit",
            f64::from(model.zero_cdeg) / 100.0
        ),
        _ => String::new(),
    };
    output::remark(&[format!(
        "{}: {} at {} bits/s{zero}",
        args.port, model.name, model.baud
    )]);
    let directions = size::of_model(&model);
    ensure!(
        directions <= BEAMS,
        "{}: {directions} beams a revolution, {BEAMS} have room: record them on a board, `replay` thins them",
        model.name
    );
    let mut recorder = args.record.as_deref().map(output::create).transpose()?;
    let recorder = recorder.take().map(Recorder::new).transpose()?;
    let mut live = Live::new(args, &model, directions, recorder)?;
    let began = Instant::now();
    let mut bytes = [0; 4096];
    while !live.is_enough() {
        let n = bringup::read(port.as_mut(), &mut bytes)?;
        if n > 0 {
            live.take(began.elapsed(), &bytes[..n])?;
        }
        live.show()?;
        if live.heard.elapsed().as_secs_f64() > args.timeout {
            if live.seen.scans > 0 {
                live.finish(&model)?;
            }
            bail!("{}: no revolution for {} s", args.port, args.timeout);
        }
    }
    live.finish(&model)
}

struct Live<'a> {
    args: &'a Args,
    pipeline: Box<Following>,
    recorder: Option<Recorder<BufWriter<File>>>,
    seen: Seen,
    /// When the last revolution came.
    heard: Instant,
    drawn: Instant,
    view: Option<View>,
}

/// What came of the revolutions so far.
struct Seen {
    track: Track,
    server: Option<Server>,
    elapsed: Elapsed,
    hash: PoseHash,
    scans: usize,
    most: usize,
    refused: usize,
    keyframes: usize,
    last: Pose,
}

/// Makes the pipeline for a lidar.
struct Make(Odometry<BEAMS>);

impl WithParser for Make {
    type Output = Box<Following>;

    fn run<P: Protocol + 'static>(self, parser: P) -> Box<Following> {
        Box::new(Pipeline::new(parser, self.0))
    }
}

impl<'a> Live<'a> {
    fn new(
        args: &'a Args,
        model: &Model,
        directions: usize,
        mut recorder: Option<Recorder<BufWriter<File>>>,
    ) -> Result<Self> {
        let mount = args.mount.unwrap_or(Mount::DEFAULT);
        if let Some(recorder) = &mut recorder {
            recorder.push(0, Content::Lidar(model.name))?;
            recorder.push(0, Content::Mount(mount))?;
            if Model::named(model.name).is_some_and(|row| row.zero_cdeg != model.zero_cdeg) {
                recorder.push(0, Content::Zero(model.zero_cdeg))?;
            }
        }
        let odometry = Odometry::new(config(mount, directions));
        let track = Track::new(TruePose::default(), mount.robot_from_lidar, DRAWN);
        Ok(Self {
            args,
            pipeline: with_parser(model, Make(odometry)),
            recorder,
            seen: Seen {
                track,
                server: output::serve(args.foxglove.as_deref())?,
                elapsed: Elapsed::default(),
                hash: PoseHash::new(),
                scans: 0,
                most: args.scans.unwrap_or(usize::MAX),
                refused: 0,
                keyframes: 0,
                last: Pose::IDENTITY,
            },
            heard: Instant::now(),
            drawn: Instant::now(),
            view: if args.plain { None } else { View::open() },
        })
    }

    fn take(&mut self, since: Duration, bytes: &[u8]) -> Result<()> {
        let time_us = since.as_micros() as u64;
        let content = Content::Bytes(bytes);
        if let Some(recorder) = &mut self.recorder {
            recorder.push(time_us, content)?;
            recorder.flush()?;
        }
        let piece = Piece {
            time_us: Some(time_us),
            content,
        };
        let seen = &mut self.seen;
        if self
            .pipeline
            .take(&piece, true, &mut |revolution| seen.take(&revolution))
        {
            self.heard = Instant::now();
        }
        Ok(())
    }

    fn is_enough(&self) -> bool {
        self.seen.scans >= self.seen.most
    }

    /// Draws, where it is time to.
    fn show(&mut self) -> Result<()> {
        if self.drawn.elapsed().as_secs_f64() < self.args.every || self.seen.scans == 0 {
            return Ok(());
        }
        self.drawn = Instant::now();
        let status = self.seen.status();
        if self.view.is_none() {
            eprintln!("{status}");
        }
        if self.view.is_none() && self.seen.server.is_none() {
            return Ok(());
        }
        let title = format!("beamfix: live from {}", self.args.port);
        let map = self.seen.track.map(title, status, None);
        if let Some(server) = &mut self.seen.server {
            server.seen(&map.points);
        }
        if let Some(view) = &mut self.view {
            view.draw(&map)?;
        }
        Ok(())
    }

    fn finish(&mut self, model: &Model) -> Result<ExitCode> {
        self.drawn -= Duration::from_secs_f64(self.args.every);
        self.show()?;
        if let Some(view) = self.view.take() {
            view.close();
        }
        if let Some(recorder) = self.recorder.take() {
            recorder.finish()?;
        }
        let seen = &self.seen;
        let Pose { x, y, theta } = seen.last;
        let value = json!({
            "lidar": model.name, "baud": model.baud, "scans": seen.scans, "refused": seen.refused,
            "keyframes": seen.keyframes, "last_pose": {"x": x, "y": y, "theta": theta},
            "pose_hash": seen.hash.to_string(),
        });
        let text = format!("{}\npose hash {}", seen.status(), seen.hash);
        output::report(self.args.json, &value, &text)?;
        Ok(ExitCode::SUCCESS)
    }
}

impl Seen {
    fn take(&mut self, revolution: &Revolution<'_, Odometry<BEAMS>, BEAMS>) {
        if self.scans >= self.most {
            return;
        }
        let step = revolution.step;
        let is_measured = is_measured(step);
        self.scans += 1;
        self.refused += usize::from(!is_measured);
        self.keyframes += usize::from(step.keyframe);
        self.hash.push(step.pose);
        self.last = step.pose;
        let beams: Vec<Beam> = revolution.scan.beams().collect();
        let at = At {
            time: self.elapsed.at(&beams),
            estimate: step.pose,
            covariance: Some(step.covariance),
            is_measured,
            truth: None,
            wheels: None,
        };
        let points = self.track.push(at, &beams);
        if let Some(server) = &self.server {
            server.scan(&points, step.pose);
        }
    }

    /// One line: how it is.
    fn status(&self) -> String {
        let Pose { x, y, theta } = self.last;
        format!(
            "{} scans, {} refused, {} keyframes, x {x:.3} m, y {y:.3} m, heading {:.2}°",
            self.scans,
            self.refused,
            self.keyframes,
            theta.to_degrees()
        )
    }
}
