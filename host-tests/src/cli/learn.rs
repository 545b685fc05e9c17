//! `learn`: beam-model parameters from data.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use beamfix::sensor_model::BeamModel;
use host_tests::formats;
use host_tests::formats::ros_map;
use host_tests::learn::{self, Pair};
use host_tests::report::picture::{self, density::Density};
use serde_json::{Value, json};

use super::output;

/// Beam-model parameters from a log with good poses and a map, by expectation maximisation.
///
/// Prints the mean log-likelihood of a beam at every step, the parameters, and those by angle of incidence.
#[derive(clap::Args)]
pub struct Args {
    /// The log, its poses in the map's frame: a mapper's corrected log.
    log: PathBuf,
    /// The map. Default: one made from the log itself.
    #[arg(long, value_name = "MAP.yaml")]
    map: Option<PathBuf>,
    /// Keep the map made from the log here.
    #[arg(long, value_name = "MAP.yaml", conflicts_with = "map")]
    keep_map: Option<PathBuf>,
    /// Cells of a map made from the log (m).
    #[arg(long, default_value_t = 0.05)]
    resolution: f32,
    /// Longest range of the sensor (m). Default: the longest in the log.
    #[arg(long, value_name = "M")]
    range_max: Option<f32>,
    /// Most steps.
    #[arg(long, default_value_t = 60)]
    steps: usize,
    /// Where to draw the data and the fitted density, .png or .svg.
    #[arg(
        long,
        value_name = "FILE",
        default_value = "target/beamfix/beam-model.png"
    )]
    picture: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Learns and reports.
pub fn run(args: &Args) -> Result<ExitCode> {
    let map = args.map.as_deref().unwrap_or(&args.log);
    let picture_of_map = args
        .keep_map
        .as_ref()
        .map(|path| path.with_extension("pgm"));
    output::spare(
        &[&args.log, map],
        &[
            Some(&args.picture),
            args.keep_map.as_deref(),
            picture_of_map.as_deref(),
        ],
    )?;
    picture::Kind::of(&args.picture).context("--picture")?;
    let log = formats::read(&args.log)?;
    let ranges = log
        .scans
        .iter()
        .flat_map(|scan| &scan.beams)
        .filter_map(|beam| beam.range.metres().ok());
    let longest = ranges.fold(0.0f32, |a, b| if a > b { a } else { b });
    let range_max = args.range_max.unwrap_or(longest + 0.01);
    ensure!(
        (0.5..=65.0).contains(&range_max),
        "{}: a longest range of {range_max} m: 0.5 to 65 m are possible",
        args.log.display()
    );
    let map = match &args.map {
        Some(path) => {
            let mut remarks = Vec::new();
            let map = ros_map::read_remarking(path, &mut remarks)?;
            output::remark(&remarks);
            map
        }
        None => learn::map_from_log(&log, args.resolution, range_max)?,
    };
    if let Some(path) = &args.keep_map {
        ros_map::write(&map, path)?;
    }
    let pairs = learn::pairs(&log, &map, range_max);
    ensure!(
        pairs.len() >= 1000,
        "{}: only {} beams meet something that the map knows; learning takes 1000",
        args.log.display(),
        pairs.len()
    );
    let start = BeamModel {
        range_max,
        ..BeamModel::DEFAULT
    };
    let learned = learn::learn(&pairs, start, args.steps);
    if !args.json {
        for (step, mean) in learned.log_likelihoods.iter().enumerate() {
            println!("step {step:>2}: {mean:.5} nat a beam");
        }
    }
    let by_incidence = learn::learn_by_incidence(&pairs, start, args.steps);
    if let Some(folder) = args
        .picture
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
    {
        std::fs::create_dir_all(folder)?;
    }
    picture::save(&drawing(&pairs, &learned.model), &args.picture)?;
    let mut text = format!(
        "{} beams\n{}",
        pairs.len(),
        line("all", pairs.len(), &learned.model)
    );
    for (name, (count, model)) in ["0-30°", "30-60°", "60-80°", "80-90°"]
        .into_iter()
        .zip(&by_incidence)
    {
        text += &format!("\n{}", line(name, *count, model));
    }
    text += &format!("\nwrote {}", args.picture.display());
    let value = json!({
        "beams": pairs.len(), "log_likelihood": learned.log_likelihoods, "model": parameters(&learned.model),
        "by_incidence": by_incidence.map(|(count, model)| json!({ "beams": count, "model": parameters(&model) })),
        "picture": args.picture,
    });
    output::report(args.json, &value, &text)?;
    Ok(ExitCode::SUCCESS)
}

fn line(name: &str, count: usize, model: &BeamModel) -> String {
    let BeamModel {
        z_hit,
        z_short,
        z_max,
        z_rand,
        sigma,
        lambda,
        ..
    } = model;
    format!(
        "{name:>7} {count:>8} beams: hit {z_hit:.3} unexpected {z_short:.3} none {z_max:.3} random {z_rand:.3}, \
         sigma {sigma:.4} m, lambda {lambda:.3} /m"
    )
}

fn parameters(model: &BeamModel) -> Value {
    json!({
        "z_hit": model.z_hit, "z_short": model.z_short, "z_max": model.z_max, "z_rand": model.z_rand,
        "sigma": model.sigma, "lambda": model.lambda, "range_max": model.range_max,
    })
}

/// Deviations from the expected range: how many there are, and how many the model expects.
fn drawing(pairs: &[Pair], model: &BeamModel) -> Density {
    const LOW: f32 = -3.0;
    const STEP: f32 = 0.05;
    const BINS: usize = 80;
    let mut data = vec![0.0; BINS];
    for pair in pairs {
        let bin = pair
            .range
            .map(|range| ((range - pair.expected - LOW) / STEP).floor());
        if let Some(count) = bin
            .filter(|bin| *bin >= 0.0)
            .and_then(|bin| data.get_mut(bin as usize))
        {
            *count += 1.0 / (pairs.len() as f64 * f64::from(STEP));
        }
    }
    // The mixture over the expected ranges that occur, a few thousand of them.
    let some: Vec<&Pair> = pairs.iter().step_by(pairs.len() / 2000 + 1).collect();
    let fitted = (0..BINS)
        .map(|bin| {
            let over_bin = |pair: &&&Pair| {
                (0..5)
                    .map(|part| LOW + STEP * (bin as f32 + 0.1 + 0.2 * part as f32))
                    .map(|off| {
                        if pair.expected + off > 0.0 {
                            f64::from(model.likelihood(Some(pair.expected + off), pair.expected))
                        } else {
                            0.0
                        }
                    })
                    .sum::<f64>()
                    / 5.0
            };
            some.iter().map(|pair| over_bin(&pair)).sum::<f64>() / some.len() as f64
        })
        .collect();
    Density {
        title: "Beam model".into(),
        caption: format!(
            "{} beams: deviation from the range that the map says; hit {:.3}, unexpected {:.3}, none {:.3}, random {:.3}, sigma {:.3} m",
            pairs.len(),
            model.z_hit,
            model.z_short,
            model.z_max,
            model.z_rand,
            model.sigma
        ),
        low: f64::from(LOW),
        step: f64::from(STEP),
        data,
        fitted,
    }
}
