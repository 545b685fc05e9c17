//! `decode`: raw bytes to beams.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use beamfix::lidar::identify;
use host_tests::decode;
use host_tests::formats::bytes;
use host_tests::formats::capture;
use host_tests::formats::capture::telemetry;
use serde_json::json;

use super::output;

/// Decode a raw capture into beams, as the sensor itself gives them.
#[derive(clap::Args)]
pub struct Args {
    /// The sensor that the bytes come from: a name that `lidars` lists, or `auto`, found by the bytes.
    #[arg(long, value_name = "MODEL", default_value = "auto")]
    lidar: String,
    /// The capture: the sensor's bytes, a recording of `simulate`, or what a board has sent; packed with gzip or not.
    file: PathBuf,
    /// Where to write `scan,time_us,angle_deg,range_mm,quality`; an empty range is no return.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Decodes the file.
pub fn run(args: &Args) -> Result<ExitCode> {
    let name = args.file.display();
    let mut content = bytes::load(&args.file)?;
    if let Some(capture) = telemetry::capture(&content.bytes) {
        content.bytes = capture;
    }
    output::spare(&[&args.file], &[args.csv.as_deref()])?;
    let model = decode::model_of(&name.to_string(), &args.lidar, &content.bytes)?;
    let mut csv = args.csv.as_deref().map(output::create).transpose()?;
    let mut written = Ok(());
    if let Some(csv) = &mut csv {
        written = writeln!(csv, "scan,time_us,angle_deg,range_mm,quality");
    }
    let mut ranges = 0u32;
    let summary = decode::decode(model.name, &content.bytes, &mut |row| {
        ranges += u32::from(row.range_mm.is_some());
        if let (Some(csv), Ok(())) = (&mut csv, &written) {
            let range = row.range_mm.map_or(String::new(), |mm| mm.to_string());
            written = writeln!(
                csv,
                "{},{},{},{range},{}",
                row.scan, row.time_us, row.angle_deg, row.quality
            );
        }
    })?;
    written
        .and_then(|()| csv.as_mut().map_or(Ok(()), Write::flush))
        .with_context(|| {
            args.csv
                .as_ref()
                .map_or(String::new(), |path| path.display().to_string())
        })?;
    // A second of the fastest line says what is wrong with it.
    let bytes = capture::plain(&content.bytes);
    let start = bytes.get(..100_000).unwrap_or(&bytes);
    let hints: Vec<String> = identify::hints(model, start)
        .map(|hint| hint.to_string())
        .collect();
    ensure!(
        summary.packets > 0,
        "{name}: no packet of the lidar {} in {} bytes; {} failed their check: {}",
        model.name,
        bytes.len(),
        summary.check_errors,
        hints.join("; ")
    );
    let decode::Summary {
        packets,
        check_errors,
        skipped_bytes,
        tail_bytes,
        scans,
        points,
    } = summary;
    let alternatives = decode::alternatives(&args.lidar, &content.bytes);
    let value = json!({
        "lidar": model.name, "alternatives": alternatives, "baud": model.baud, "hints": hints, "bytes": bytes.len(), "packets": packets, "check_errors": check_errors,
        "skipped_bytes": skipped_bytes, "tail_bytes": tail_bytes, "scans": scans, "points": points, "ranges": ranges,
    });
    let mut text = format!(
        "{}: {packets} packets, {points} points, {scans} revolutions; {check_errors} frames failed their check, \
         {skipped_bytes} bytes skipped, {tail_bytes} left at the end",
        model.name
    );
    if !alternatives.is_empty() {
        text += &format!(
            "\nthe bytes may as well be from: {}",
            alternatives.join(", ")
        );
    }
    for hint in &hints {
        text += &format!("\nhint: {hint}");
    }
    output::report(args.json, &value, &text)?;
    if points > 0 && ranges == 0 {
        eprintln!(
            "beamfix: {name}: none of {points} measurements has a range: a covered lidar, or one that spins up"
        );
    }
    let content_cut = content.cut.or_else(|| capture::cut(&content.bytes));
    match content_cut {
        Some(cut) => Err(anyhow::anyhow!("{name}: {cut}")),
        None => Ok(ExitCode::SUCCESS),
    }
}
