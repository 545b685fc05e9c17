//! `worlds`: the default settings in every place that is built in.

use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use beamfix::geometry::Pose;
use beamfix::lidar::Model;
use beamfix::odometry::Odometry;
use beamfix::scan::Mount;
use beamfix_sim::Settings;
use beamfix_sim::place::{self, Place};
use host_tests::decode;
use host_tests::formats::capture::simulated;
use host_tests::pipeline::{config, follow, is_measured};
use host_tests::report::scene::Outcome;
use host_tests::sized;
use serde_json::{Value, json};

use super::output;
use super::simulate::{self, Driven};

/// Drive through every built-in place: pose error, refused, wrong and confident.
#[derive(clap::Args)]
pub struct Args {
    /// Only this place; may be given several times.
    #[arg(long, value_name = "NAME")]
    world: Vec<String>,
    /// The lidar on board: a name that `lidars` lists.
    #[arg(long, value_name = "MODEL", default_value = "ld06")]
    lidar: String,
    /// Runs in each place.
    #[arg(long, default_value_t = 3)]
    seeds: u64,
    /// Stop each after so many seconds.
    #[arg(long, default_value_t = Settings::DEFAULT.seconds)]
    seconds: f64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Drives, reports.
pub fn run(args: &Args) -> Result<ExitCode> {
    let model = decode::model(&args.lidar, &[])?;
    let all = place::NAMES.map(|(name, _)| name);
    if let Some(unknown) = args.world.iter().find(|world| !all.contains(&&world[..])) {
        bail!("--world {unknown}: none of {}", all.join(", "));
    }
    if args.seeds == 0 || !(args.seconds > 0.0) {
        bail!("--seeds, --seconds: must be above 0");
    }
    let is_wanted = |name: &&str| args.world.is_empty() || args.world.iter().any(|w| w == name);
    let names: Vec<&str> = all.into_iter().filter(is_wanted).collect();
    let bar = output::progress(names.len() * args.seeds as usize, "worlds");
    let mut text = format!(
        "{:<10} {:>7} {:>7} {:>8} {:>6} {:>9} {:>9} {:>8} {:>5} {:>6}",
        "world", "driven", "scans", "end cm", "deg", "worst cm", "deg", "refused", "lost", "w+c"
    );
    let (mut rows, mut confident): (Vec<Value>, u32) = (Vec::new(), 0);
    for name in names {
        let mut outcomes = Vec::new();
        for seed in 1..=args.seeds {
            outcomes.push(one(args, name, seed, model).with_context(|| name.to_owned())?);
            bar.inc(1);
        }
        let most = |of: fn(&Outcome) -> f64| outcomes.iter().map(of).fold(0.0, f64::max);
        let sum = |of: fn(&Outcome) -> u32| outcomes.iter().map(of).sum::<u32>();
        let driven: f64 = outcomes.iter().map(|outcome| outcome.driven).sum();
        let (scans, refused, lost) = (sum(|o| o.scans), sum(|o| o.refused), sum(|o| o.lost));
        let last = (most(|o| o.last.0), most(|o| o.last.1.abs()));
        let largest = (most(|o| o.largest.0), most(|o| o.largest.1));
        let wrong = sum(|o| o.confident);
        confident += wrong;
        text += &format!(
            "\n{name:<10} {driven:>5.0} m {scans:>7} {:>8.1} {:>6.2} {:>9.1} {:>9.2} {:>6.1} % {lost:>5} {wrong:>6}",
            100.0 * last.0,
            last.1,
            100.0 * largest.0,
            largest.1,
            100.0 * f64::from(refused) / f64::from(scans.max(1)),
        );
        rows.push(json!({
            "world": name, "distance_m": driven, "scans": scans, "refused": refused, "lost": lost,
            "final_error_m": last.0, "final_error_deg": last.1, "max_error_m": largest.0, "max_error_deg": largest.1,
            "wrong_and_confident": wrong,
        }));
    }
    bar.finish_and_clear();
    text += &format!("\n{confident} scans wrong and confident");
    let value = json!({
        "lidar": args.lidar, "seeds": args.seeds, "worlds": rows, "wrong_and_confident": confident,
    });
    output::report(args.json, &value, &text)?;
    Ok(ExitCode::SUCCESS)
}

/// One drive.
fn one(args: &Args, name: &str, seed: u64, model: &'static Model) -> Result<Outcome> {
    let settings = Settings {
        seed,
        seconds: args.seconds,
        ..simulated::settings(model)
    };
    let place = Place::named(name, seed).context("a built-in place")?;
    let driven = simulate::drive(place, &settings, model)?;
    let size = driven.size();
    sized!(size, follow_one(&settings, &driven))
}

fn follow_one<const N: usize>(settings: &Settings, driven: &Driven) -> Result<Outcome> {
    let mount = Mount {
        robot_from_lidar: settings.mount.into(),
        ..Mount::DEFAULT
    };
    let origin = driven.moments.first().context("not one revolution")?.truth;
    let mut outcome = Outcome {
        driven: driven.drive.distance,
        ..Outcome::default()
    };
    let mut moments = driven.moments.iter();
    let odometry = Odometry::<N>::new(config(mount, N));
    let followed = follow(
        &driven.log,
        (usize::MAX, true),
        odometry,
        &mut |_, _: Pose, step| {
            let now = moments.next().context("a moment for each scan")?;
            outcome.push(now.time, step, origin.between(now.truth));
            outcome.refused += u32::from(!is_measured(step));
            Ok(())
        },
    )?;
    outcome.scans = followed.scans as u32;
    outcome.lost = followed.estimator.counters().lost;
    Ok(outcome)
}
