//! `teach`: what the error of a pose depends on.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use beamfix::scan::Mount;
use beamfix::slam::SlamConfig;
use beamfix_sim::course::Course;
use beamfix_sim::sensor::Sensor;
use beamfix_sim::wheels::Wheels;
use beamfix_sim::{Revolution, Scene, TruePose, scenes};
use host_tests::formats::{Log, Recorded};
use host_tests::mapping::{self, Tier};
use host_tests::pipeline::config;
use host_tests::report::picture::{
    self,
    sweeps::{Sweep, Sweeps},
};
use host_tests::report::{scene, score};
use host_tests::size;
use serde_json::json;

use super::output;

/// Draw the error of a pose against turn rate, field of view, beams, range noise, speed and wheel slip.
#[derive(clap::Args)]
pub struct Args {
    /// The picture, .png or .svg.
    #[arg(long, value_name = "FILE", default_value = "target/beamfix/teach.png")]
    out: PathBuf,
    /// Runs for each value.
    #[arg(long, default_value_t = 2)]
    seeds: u64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// A quantity, its values, and the scene with each.
struct Quantity {
    name: &'static str,
    values: &'static [f64],
    scene: fn(f64) -> Scene,
}

const QUANTITIES: [Quantity; 6] = [
    Quantity {
        name: "turn rate (deg/s)",
        values: &[0.0, 45.0, 90.0, 180.0, 270.0, 360.0],
        scene: |value| {
            let turn = value.to_radians();
            let turned = room(TruePose::new(-0.5, -0.3, 0.0))
                .drive(6.0, 0.0, turn)
                .drive(6.0, 0.0, -turn);
            Scene::new(scenes::room(), turned)
        },
    },
    Quantity {
        name: "field of view (deg)",
        values: &[90.0, 120.0, 180.0, 240.0, 300.0, 360.0],
        scene: |value| {
            let mut scene = flat();
            // As many beams a degree as an LD06.
            scene.sensor.beams = (450.0 * value / 360.0) as usize;
            scene.sensor.sector = value.to_radians();
            scene
        },
    },
    Quantity {
        name: "beams a revolution",
        values: &[60.0, 120.0, 240.0, 360.0, 450.0, 720.0],
        scene: |value| {
            let mut scene = flat();
            scene.sensor.beams = value as usize;
            scene
        },
    },
    Quantity {
        name: "range noise, standard deviation (cm)",
        values: &[0.0, 1.0, 2.0, 3.0, 5.0, 8.0],
        scene: |value| {
            let mut scene = flat();
            scene.sensor.sigma = (0.01 * value, 0.0);
            scene
        },
    },
    Quantity {
        name: "speed (m/s)",
        values: &[0.25, 0.5, 1.0, 1.5, 2.0, 3.0],
        scene: |value| {
            let mut course = room(TruePose::new(-1.5, 0.2, 0.0)).accelerating(8.0, 5.0);
            for _ in 0..3 {
                let seconds = 2.6 / value;
                course = course.drive(seconds, value, 0.0).rest(0.5);
                course = course.drive(seconds, -value, 0.0).rest(0.5);
            }
            Scene::new(scenes::room(), course)
        },
    },
    Quantity {
        name: "wheel slip (%)",
        values: &[0.0, 10.0, 25.0, 50.0, 75.0, 100.0],
        scene: |value| {
            let mut scene = flat();
            scene.wheels = Some(Wheels {
                // From five seconds on the wheels tell so much less than was driven.
                slips: vec![(5.0, 1e9, 1.0 - 0.01 * value)],
                ..Wheels::USUAL
            });
            scene
        },
    },
];

/// Stands for a second, then goes.
fn room(start: TruePose) -> Course {
    Course::at(start).rest(1.0)
}

/// The round through the flat.
fn flat() -> Scene {
    let (start, way) = scenes::flat_round();
    Scene {
        sensor: Sensor::LD06,
        ..Scene::new(scenes::flat(), room(start).through(&way))
    }
}

/// Runs, draws, reports.
pub fn run(args: &Args) -> Result<ExitCode> {
    picture::Kind::of(&args.out).context("--out")?;
    if args.seeds == 0 {
        bail!("--seeds 0: must be above 0");
    }
    let values: usize = QUANTITIES.iter().map(|all| all.values.len()).sum();
    let bar = output::progress(values * args.seeds as usize, "scenes");
    let mut charts = Vec::new();
    for quantity in &QUANTITIES {
        let mut errors = vec![Vec::new(); 3];
        for &value in quantity.values {
            let mut sums = [0.0; 3];
            for seed in 1..=args.seeds {
                let found = largest(&(quantity.scene)(value), seed)?;
                for (sum, found) in sums.iter_mut().zip(found) {
                    *sum += 100.0 * found / args.seeds as f64;
                }
                bar.inc(1);
            }
            for (errors, sum) in errors.iter_mut().zip(sums) {
                errors.push(sum);
            }
        }
        charts.push(Sweep {
            name: quantity.name.into(),
            values: quantity.values.to_vec(),
            errors,
        });
    }
    bar.finish_and_clear();
    let lines = [
        "odometry with wheels",
        "odometry without wheels",
        "SLAM with wheels",
    ];
    let mut text = String::new();
    for chart in &charts {
        text += &format!("{}\n", chart.name);
        for (k, value) in chart.values.iter().enumerate() {
            let errors = [0, 1, 2].map(|line| chart.errors[line][k]);
            let [with, without, slam] = errors;
            text += &format!("{value:>8.2} {with:>9.1} cm {without:>9.1} cm {slam:>9.1} cm\n");
        }
    }
    text += &format!("({}); drawn to {}", lines.join(", "), args.out.display());
    let tables = charts.iter().map(
        |chart| json!({"quantity": chart.name, "values": chart.values, "errors_cm": chart.errors}),
    );
    let value = json!({"lines": lines, "quantities": tables.collect::<Vec<_>>()});
    if let Some(folder) = args.out.parent() {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let sweeps = Sweeps {
        title: "what the error of a pose depends on".into(),
        caption: format!(
            "simulated LD06, one quantity changed at a time; largest error of position on the way, mean of {} runs",
            args.seeds
        ),
        lines: lines.map(String::from).to_vec(),
        charts,
    };
    picture::save(&sweeps, &args.out)?;
    output::report(args.json, &value, &text)?;
    Ok(ExitCode::SUCCESS)
}

/// Largest error of position (m): odometry with wheels, without, SLAM.
fn largest(scene: &Scene, seed: u64) -> Result<[f64; 3]> {
    let scans = scene.run(seed);
    let odometry = |scans: &[Revolution]| {
        scene::drive(scene, (scans, scene::Runs::Odometry), |it| it, |_, _, _| ())
            .largest
            .0
    };
    let with = odometry(&scans);
    let mapped = slam(scene, &scans)?;
    let blind = scans.into_iter().map(|scan| Revolution {
        wheels: None,
        ..scan
    });
    Ok([with, odometry(&blind.collect::<Vec<_>>()), mapped])
}

fn slam(scene: &Scene, scans: &[Revolution]) -> Result<f64> {
    let mount = Mount {
        robot_from_lidar: scene.mount.into(),
        ..Mount::DEFAULT
    };
    let recorded = |scan: &Revolution| Recorded {
        stamp: format!("{:.6}", scan.end),
        wheels: scan.wheels.map(Into::into),
        beams: scan.beams.clone(),
    };
    let log = Log {
        scans: scans.iter().map(recorded).collect(),
        mount,
        ..Log::default()
    };
    let directions = size::fitting(log.scans.iter().map(|scan| &scan.beams[..]));
    let settings = mapping::Settings {
        tier: Tier::Of512k,
        odometry: config(mount, directions),
        slam: SlamConfig::DEFAULT,
        scans: (usize::MAX, true),
        pruning: None,
        resolution: None,
    };
    let map = mapping::run(&log, &settings, &mut || ())?;
    let origin = scans.first().context("no scan")?.truth;
    let poses = map.scans.iter().zip(scans);
    let errors =
        poses.map(|(found, scan)| score::error(found.pose, origin.between(scan.truth).into()).0);
    Ok(errors.fold(0.0, f64::max))
}
