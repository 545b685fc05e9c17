//! `tune`: what other values of a constant do to accuracy and cost.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail, ensure};
use host_tests::tuning::{self, Copy};
use serde_json::{Value, json};

use super::output;

/// Sweep a constant of the source: print accuracy and cost for each value.
///
/// The source is copied to target/tune, the constant is changed there, the tool is built and run. The checkout stays as it
/// is. The first build takes minutes, the next ones a minute or less. Without a name: list the constants.
#[derive(clap::Args)]
pub struct Args {
    /// The constant: NAME, or FILE:NAME where several files have one; NAME.1 is the second number of a tuple or array.
    name: Option<String>,
    /// First value.
    #[arg(long, value_name = "VALUE", allow_negative_numbers = true, requires_all = ["name", "to"])]
    from: Option<f64>,
    /// Last value.
    #[arg(
        long,
        value_name = "VALUE",
        allow_negative_numbers = true,
        requires = "from"
    )]
    to: Option<f64>,
    /// Values from the first to the last; the present value is measured too.
    #[arg(long, default_value_t = 5)]
    steps: u32,
    /// Drives through the simulated flat for each value.
    #[arg(long, default_value_t = 4)]
    seeds: u32,
    /// Match this list of pairs too: the scans and the pairs, as for `pairs`.
    #[arg(long, num_args = 2, value_names = ["SCANS", "PAIRS"])]
    pairs: Vec<PathBuf>,
    /// Run the table of scenes too, one seed each.
    #[arg(long)]
    scenes: bool,
    /// Leave the instructions on the emulated M4F out.
    #[arg(long)]
    no_cost: bool,
    /// Print the page docs/constants.md.
    #[arg(long, conflicts_with = "name")]
    table: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Lists the constants, or sweeps one.
pub fn run(args: &Args) -> Result<ExitCode> {
    let checkout = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let constants = tuning::all(&checkout.join("src"))?;
    let Some(name) = &args.name else {
        let text = if args.table {
            tuning::page(&constants)
        } else {
            constants
                .iter()
                .map(|c| format!("{:<60} {}\n", format!("{}:{}", c.file, c.name), c.text))
                .collect()
        };
        let rows: Vec<Value> = constants
            .iter()
            .map(|c| json!({"name": c.name, "file": c.file, "value": c.text, "about": c.about}))
            .collect();
        output::report(args.json, &json!({ "constants": rows }), text.trim_end())?;
        return Ok(ExitCode::SUCCESS);
    };
    let (name, index) = match name.rsplit_once('.') {
        Some((name, index)) if index.parse::<usize>().is_ok() => (name, index.parse()?),
        _ => (&name[..], 0),
    };
    let constant = tuning::named(&constants, name)?;
    let (Some(from), Some(to)) = (args.from, args.to) else {
        bail!(
            "{name} in src/{} is {}: say --from and --to",
            constant.file,
            constant.text
        );
    };
    ensure!(
        args.steps > 0 && from.is_finite() && to.is_finite(),
        "--steps, --from and --to: at least one value, each a number"
    );
    let lists: Vec<PathBuf> = args
        .pairs
        .iter()
        .map(|path| fs::canonicalize(path).with_context(|| path.display().to_string()))
        .collect::<Result<_>>()?;

    let original = fs::read_to_string(checkout.join("src").join(&constant.file))?;
    let mut trials = vec![("now".to_owned(), original.clone())];
    for step in 0..args.steps {
        let part = f64::from(step) / f64::from(args.steps.max(2) - 1);
        let value = from + part * (to - from);
        let value = if constant.is_float() || from.fract() + to.fract() != 0.0 {
            value
        } else {
            value.round()
        };
        let text = constant.replaced(&original, index, value)?;
        trials.push((format!("{value}"), text));
    }

    eprintln!("beamfix: copying the source; the first build takes minutes");
    let copy = Copy::new(checkout)?;
    let changed = copy.source().join(&constant.file);
    let bar = output::progress(trials.len(), "values");
    let mut rows = Vec::new();
    for (value, text) in &trials {
        fs::write(&changed, text).with_context(|| changed.display().to_string())?;
        rows.push((value.clone(), measure(&copy, args, &lists)));
        bar.inc(1);
    }
    bar.finish_and_clear();
    fs::write(&changed, &original).with_context(|| changed.display().to_string())?;

    let title = format!(
        "src/{}: {} = {}",
        constant.file, constant.name, constant.text
    );
    let values: Vec<Value> = rows
        .iter()
        .map(|(value, found)| match found {
            Ok(found) => {
                let measured: serde_json::Map<String, Value> = found
                    .iter()
                    .map(|(name, value)| ((*name).to_owned(), json!(value)))
                    .collect();
                json!({"value": value, "measured": measured})
            }
            Err(error) => json!({"value": value, "error": format!("{error:#}")}),
        })
        .collect();
    let value = json!({"constant": constant.name, "file": constant.file, "trials": values});
    output::report(args.json, &value, &table(&title, &rows))?;
    let all_done = rows.iter().all(|(_, found)| found.is_ok());
    Ok(ExitCode::from(u8::from(!all_done)))
}

/// Name and value of what was measured, in the order of the columns.
type Measured = Vec<(&'static str, f64)>;

/// Builds the copy as it is and measures.
fn measure(copy: &Copy, args: &Args, lists: &[PathBuf]) -> Result<Measured> {
    copy.build()?;
    let mut found = Measured::new();
    let (mut metres, mut degrees, mut most, mut refused) = (0.0, 0.0, 0.0_f64, 0.0);
    for seed in 1..=args.seeds {
        let drive = copy.run(&["simulate", "--seed", &seed.to_string()])?;
        metres += number(&drive, "final_error_m")?;
        degrees += number(&drive, "final_error_deg")?;
        most = most.max(number(&drive, "max_error_m")?);
        refused += number(&drive, "refused")?;
    }
    if args.seeds > 0 {
        let seeds = f64::from(args.seeds);
        found.extend([
            ("drive end mm", 1e3 * metres / seeds),
            ("end deg", degrees / seeds),
            ("worst mm", 1e3 * most),
            ("refused", refused),
        ]);
    }
    if let [scans, pairs] = lists {
        let list = copy.run(&[
            "pairs",
            &scans.display().to_string(),
            &pairs.display().to_string(),
        ])?;
        let levels = list["levels"].as_array().context("levels of the list")?;
        let sum = |of: &str| {
            levels
                .iter()
                .map(|level| number(level, of))
                .sum::<Result<f64>>()
        };
        let all = sum("pairs")?;
        let level = |k: i64| levels.iter().find(|level| level["level"] == k);
        found.extend([
            ("right %", 100.0 * sum("right")? / all),
            ("wrong %", 100.0 * sum("wrong")? / all),
        ]);
        if let Some(one) = level(1) {
            found.push(("level 1 mm", number(one, "error_mm_mean")?));
            found.push(("level 1 deg", number(one, "error_deg_mean")?));
        }
    }
    if args.scenes {
        let scenes = copy.run(&["scenes", "--seeds", "1"])?;
        found.push(("confident", number(&scenes, "wrong_and_confident")?));
    }
    if !args.no_cost {
        let bench = copy.run(&["bench"])?;
        found.push(("bench right", number(&bench, "right")?));
        found.push(("M4F instr", number(&bench, "total_instructions")?));
    }
    Ok(found)
}

fn number(value: &Value, name: &str) -> Result<f64> {
    value[name]
        .as_f64()
        .with_context(|| format!("{name} in what the copy's tool printed"))
}

fn table(title: &str, rows: &[(String, Result<Measured>)]) -> String {
    let mut text = format!("{title}\n{:>10}", "value");
    let columns = rows.iter().find_map(|(_, found)| found.as_ref().ok());
    for (name, _) in columns.into_iter().flatten() {
        text += &format!(" {name:>13}");
    }
    for (value, found) in rows {
        text += &format!("\n{value:>10}");
        match found {
            Ok(found) => {
                for (_, value) in found {
                    text += &format!(" {value:>13.3}");
                }
            }
            Err(error) => text += &format!(" {error:#}"),
        }
    }
    text
}
