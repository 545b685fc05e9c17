//! `pairs`: matches each pair of a list.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use beamfix::geometry::Pose;
use beamfix::matching::icp::{IcpConfig, Search};
use clap::ValueEnum;
use host_tests::formats::pairs::{self, Pairs};
use host_tests::matcher::Matcher;
use host_tests::report::hash::PoseHash;
use host_tests::report::picture::{self, pair::PairPicture};
use host_tests::report::score::{Score, error, is_right, mean, quantile};
use host_tests::{size, sized};
use serde_json::{Value, json};

use super::output;

/// Match each pair of a list: formats in ../shared/pairs/README.md.
#[derive(clap::Args)]
pub struct Args {
    /// Scans: scans_*.txt, packed or not.
    scans: PathBuf,
    /// Pairs: pairs_*.csv, packed or not.
    pairs: PathBuf,
    /// Where to write `pair,x,y,th,ok,iterations,vxx,vxy,vyy,vxt,vyt,vtt`; a refused pair has ok 0 and its guess.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// How far the guesses may be off: a few centimetres and degrees, or 40 cm and 45°, or there is none.
    #[arg(long, value_enum, default_value_t = Mode::Local)]
    mode: Mode,
    /// Draw this pair of the list, before and after the match.
    #[arg(long, value_name = "PAIR")]
    picture: Option<i64>,
    /// Where to draw it: pair-PAIR.png and pair-PAIR.svg.
    #[arg(long, value_name = "DIR", default_value = "target/beamfix")]
    pictures: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Mode {
    Local,
    Global,
}

/// Matches the pairs.
pub fn run(args: &Args) -> Result<ExitCode> {
    output::spare(&[&args.scans, &args.pairs], &[args.out.as_deref()])?;
    let list = pairs::read(&args.scans, &args.pairs)?;
    let config = IcpConfig {
        search: match args.mode {
            Mode::Local => Search::Local,
            Mode::Global => Search::Global,
        },
        ..IcpConfig::DEFAULT
    };
    let size = size::fitting(list.scans.iter().map(|scan| &scan[..]));
    if let Some(id) = args.picture {
        sized!(size, draw(args, &list, &config, id))?;
    }
    let (score, hash) = sized!(size, match_all(args, &list, &config))?;
    let levels: Vec<Value> = score
        .0
        .iter()
        .map(|(level, s)| {
            json!({
                "level": level, "pairs": s.pairs, "right": s.right, "wrong": s.wrong, "refused": s.pairs - s.right - s.wrong,
                "error_mm_mean": 1e3 * mean(&s.metres), "error_mm_median": 1e3 * quantile(&s.metres, 0.5),
                "error_deg_mean": mean(&s.degrees), "error_deg_median": quantile(&s.degrees, 0.5),
            })
        })
        .collect();
    let mut text = String::new();
    for (level, s) in &score.0 {
        let percent = |n: usize| 100.0 * n as f64 / s.pairs as f64;
        text += &format!(
            "level {level:>2}: {:>4} pairs, right {:6.2} %, wrong {:5.2} %, refused {:5.2} %; mean {:7.2} mm {:6.3}°, median {:6.2} mm {:6.3}°\n",
            s.pairs,
            percent(s.right),
            percent(s.wrong),
            percent(s.pairs - s.right - s.wrong),
            1e3 * mean(&s.metres),
            mean(&s.degrees),
            1e3 * quantile(&s.metres, 0.5),
            quantile(&s.degrees, 0.5)
        );
    }
    text += &format!("pose hash {hash}");
    let value = json!({"pairs": list.pairs.len(), "skipped": list.skipped.len(), "levels": levels, "pose_hash": hash.to_string()});
    output::report(args.json, &value, &text)?;
    if let Some(first) = list.skipped.first() {
        eprintln!(
            "beamfix: {} lines left out, the first: {first}",
            list.skipped.len()
        );
    }
    Ok(ExitCode::SUCCESS)
}

fn match_all<const N: usize>(
    args: &Args,
    list: &Pairs,
    config: &IcpConfig,
) -> Result<(Score, PoseHash)> {
    let mut matcher = Matcher::<N>::new();
    let (mut score, mut hash) = (Score::default(), PoseHash::new());
    let mut out = args.out.as_deref().map(output::create).transpose()?;
    if let Some(out) = &mut out {
        writeln!(out, "pair,x,y,th,ok,iterations,vxx,vxy,vyy,vxt,vyt,vtt")?;
    }
    let bar = output::progress(list.pairs.len(), "matching");
    for pair in &list.pairs {
        let found = matcher.run(list, pair, config, |_| ());
        let pose = found.as_ref().map_or(pair.guess, |found| found.pose);
        score.push(pair.level, pose, pair.truth, found.is_ok());
        hash.push(pose);
        if let Some(out) = &mut out {
            let Pose { x, y, theta } = pose;
            let rest = match &found {
                Ok(m) => {
                    let c = m.covariance.0;
                    format!(
                        "1,{},{},{},{},{},{},{}",
                        m.iterations, c.xx, c.xy, c.yy, c.xt, c.yt, c.tt
                    )
                }
                Err(_) => "0,0,,,,,,".to_owned(),
            };
            writeln!(out, "{},{x},{y},{theta},{rest}", pair.id)?;
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    if let (Some(mut out), Some(path)) = (out, &args.out) {
        out.flush().with_context(|| path.display().to_string())?;
    }
    Ok((score, hash))
}

/// Draws one pair.
fn draw<const N: usize>(args: &Args, list: &Pairs, config: &IcpConfig, id: i64) -> Result<()> {
    let pair = list
        .pairs
        .iter()
        .find(|pair| pair.id == id)
        .with_context(|| format!("--picture: there is no pair {id}"))?;
    let mut matcher = Matcher::<N>::new();
    let mut path = Vec::new();
    let found = matcher.run(list, pair, config, |pose| path.push(pose));
    let pose = found.as_ref().map_or(pair.guess, |found| found.pose);
    let (metres, degrees) = error(pose, pair.truth);
    let verdict = match &found {
        Ok(found) => format!(
            "{}: off by {:.1} mm, {:.3}°; {} inliers, residual {:.1} mm, score {:.2}",
            if is_right((metres, degrees)) {
                "right"
            } else {
                "WRONG"
            },
            1e3 * metres,
            degrees,
            found.inliers,
            1e3 * found.residual,
            found.score
        ),
        Err(error) => format!("refused: {error}"),
    };
    let name = args
        .pairs
        .file_name()
        .map_or(String::new(), |name| name.to_string_lossy().into_owned());
    let picture = PairPicture::new(
        (
            format!("pair {id} of {name}, level {}", pair.level),
            verdict,
        ),
        (&matcher.reference_points, matcher.reference()),
        &matcher.points,
        (pair.guess, pair.truth),
        found.ok().map(|found| (found.pose, found.covariance)),
        path,
    );
    std::fs::create_dir_all(&args.pictures).with_context(|| args.pictures.display().to_string())?;
    for ending in ["png", "svg"] {
        picture::save(&picture, &args.pictures.join(format!("pair-{id}.{ending}")))?;
    }
    Ok(())
}
