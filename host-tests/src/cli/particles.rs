//! `particles`: how many particles localization needs, by where they are drawn from.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use beamfix::localization::particles::{ParticleConfig, Proposal, Weighting};
use beamfix::sensor_model::{BeamModel, beam_model::BeamTable};
use clap::ValueEnum;
use host_tests::formats;
use host_tests::particles::{Course, Errors, MOST};
use serde_json::json;

use super::output;

/// How far off localization by particles is, by their number: drawn from the wheels alone, and from wheels and match.
///
/// Maps a log in the tier of 512k and localizes the same log in this map, from its first pose on, once a seed. The error is
/// the distance from the pose that the map gives each scan in the end, at most 1 m a scan.
#[derive(clap::Args)]
pub struct Args {
    /// The log.
    log: PathBuf,
    /// Seeds of the random numbers.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..))]
    seeds: u32,
    /// The first of them.
    #[arg(long, default_value_t = 0)]
    first_seed: u32,
    /// Numbers of particles drawn from the wheels alone.
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u16).range(1..=MOST as i64), default_values_t = [5, 10, 20, 40, 80, 160, 320, 640])]
    motion: Vec<u16>,
    /// Numbers of particles drawn from wheels and match.
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u16).range(1..=MOST as i64), default_values_t = [1, 2, 4, 8, 16, 32])]
    improved: Vec<u16>,
    /// What weighs the scans.
    #[arg(long, value_enum, default_value_t = Weight::Field)]
    weight: Weight,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// What weighs the scans.
#[derive(Clone, Copy, ValueEnum)]
enum Weight {
    /// The likelihood field.
    Field,
    /// The beam model.
    Beams,
}

/// A point of a curve: so many particles, and the means over all seeds.
struct Row {
    proposal: Proposal,
    particles: u16,
    errors: Errors,
    /// The worst seed's (m).
    worst: f64,
}

/// Maps, localizes, compares.
pub fn run(args: &Args) -> Result<ExitCode> {
    let log = formats::read(&args.log)?;
    let bar = output::progress(log.scans.len(), "mapping");
    let course = Course::mapped(&log, &mut || bar.inc(1))?;
    bar.finish_and_clear();
    let table = BeamTable::new(&BeamModel::DEFAULT);
    let weighting = match args.weight {
        Weight::Field => Weighting::LikelihoodField,
        Weight::Beams => Weighting::BeamModel(&table),
    };
    let counts = |proposal: Proposal, counts: &[u16]| -> Vec<(Proposal, u16)> {
        counts.iter().map(|&count| (proposal, count)).collect()
    };
    let mut points = counts(Proposal::Motion, &args.motion);
    points.extend(counts(Proposal::Improved, &args.improved));
    let bar = output::progress(points.len() * args.seeds as usize, "localizing");
    let mut rows = Vec::new();
    for (proposal, particles) in points {
        let mut runs = Vec::new();
        for seed in args.first_seed..args.first_seed + args.seeds {
            let config = ParticleConfig {
                proposal,
                particles: particles.min(MOST as u16),
                seed,
                ..ParticleConfig::DEFAULT
            };
            runs.push(course.run(&config, weighting)?);
            bar.inc(1);
        }
        rows.push(Row {
            proposal,
            particles,
            errors: mean(&runs),
            worst: runs.iter().map(|run| run.metres).fold(0.0, f64::max),
        });
    }
    bar.finish_and_clear();
    let mut text = String::from(
        "drawn from        particles  error m    deg  worst seed m  lost %  known %  normalised  matched %  scans weighed\n",
    );
    let mut list = Vec::new();
    for Row {
        proposal,
        particles,
        errors,
        worst,
    } in &rows
    {
        let name = name(*proposal);
        text += &format!(
            "{name:<17} {particles:>9} {:>8.4} {:>6.3} {worst:>13.4} {:>7.2} {:>8.1} {:>11.2} {:>10.1} {:>14}\n",
            errors.metres,
            errors.degrees,
            100.0 * errors.lost,
            100.0 * errors.known,
            errors.normalised,
            100.0 * errors.matched,
            errors.updates
        );
        list.push(json!({
            "proposal": name, "particles": particles, "metres": errors.metres, "degrees": errors.degrees,
            "worst_metres": worst, "lost": errors.lost, "known": errors.known,
            "normalised": errors.normalised, "matched": errors.matched, "updates": errors.updates,
        }));
    }
    let (motion, improved): (Vec<&Row>, Vec<&Row>) = rows
        .iter()
        .partition(|row| row.proposal == Proposal::Motion);
    text += "\nfor an error as small as from the wheels alone, wheels and match need\n";
    for row in motion {
        let enough = improved
            .iter()
            .find(|other| other.errors.metres <= row.errors.metres);
        let told = enough.map_or_else(
            || "more than were tried".to_owned(),
            |enough| {
                format!(
                    "{} of {}: 1 / {:.1}",
                    enough.particles,
                    row.particles,
                    f64::from(row.particles) / f64::from(enough.particles)
                )
            },
        );
        text += &format!("{:.4} m: {told}\n", row.errors.metres);
    }
    let value = json!({"seeds": args.seeds, "first_seed": args.first_seed, "rows": list});
    output::report(args.json, &value, text.trim_end())?;
    Ok(ExitCode::SUCCESS)
}

fn name(proposal: Proposal) -> &'static str {
    match proposal {
        Proposal::Motion => "wheels",
        Proposal::Improved => "wheels and match",
    }
}

fn mean(runs: &[Errors]) -> Errors {
    let of = |what: fn(&Errors) -> f64| runs.iter().map(what).sum::<f64>() / runs.len() as f64;
    Errors {
        metres: of(|run| run.metres),
        degrees: of(|run| run.degrees),
        lost: of(|run| run.lost),
        updates: runs.first().map_or(0, |run| run.updates),
        matched: of(|run| run.matched),
        known: of(|run| run.known),
        normalised: of(|run| run.normalised),
    }
}
