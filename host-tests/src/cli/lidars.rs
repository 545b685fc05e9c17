//! `lidars`: the sensors that the library reads, what stands behind each, and how to wire it.

use std::process::ExitCode;

use anyhow::Result;
use beamfix::lidar::Model;
use beamfix::lidar::model::{Motor, Proof, Start};
use serde_json::json;

use super::output;

/// List the lidars: line, pace, range, what proves their decoding, wiring.
#[derive(clap::Args)]
pub struct Args {
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Prints the list.
pub fn run(args: &Args) -> Result<ExitCode> {
    let rows: Vec<_> = Model::ALL
        .iter()
        .map(|model| {
            json!({
                "name": model.name, "baud": model.baud, "points_per_s": model.points_per_s,
                "revolutions_per_s": f64::from(model.revolutions_per_10s) / 10.0,
                "min_range_m": f64::from(model.min_range_mm) / 1000.0,
                "max_range_m": f64::from(model.max_range_mm) / 1000.0,
                "proof": proof(model), "wiring": wiring(model),
            })
        })
        .collect();
    let mut text = format!(
        "{:<18} {:>7} {:>8} {:>5} {:>13}  {:<15}  wiring (signals of 3.3 V; read the data sheet before you connect)",
        "name", "baud", "points/s", "rev/s", "range m", "decoding proven"
    );
    for model in Model::ALL {
        let range = format!(
            "{:.2} to {:.1}",
            f64::from(model.min_range_mm) / 1000.0,
            f64::from(model.max_range_mm) / 1000.0
        );
        text += &format!(
            "\n{:<18} {:>7} {:>8} {:>5.1} {range:>13}  {:<15}  {}",
            model.name,
            model.baud,
            model.points_per_s,
            f64::from(model.revolutions_per_10s) / 10.0,
            proof(model),
            wiring(model),
        );
    }
    output::report(args.json, &json!({ "lidars": rows }), &text)?;
    Ok(ExitCode::SUCCESS)
}

/// What stands behind the rules by which it is decoded.
fn proof(model: &Model) -> &'static str {
    match model.proof {
        Proof::RealBytes => "real bytes",
        Proof::MakersParser => "maker's parser",
        Proof::Document => "document",
        Proof::OneSource => "one source",
        _ => "unknown",
    }
}

/// What to connect besides power and ground.
fn wiring(model: &Model) -> String {
    let line = match model.start {
        Start::Listen => "its TX to your RX",
        Start::Scip => "both lines, or USB",
        Start::Sick => "both lines, over an RS-232 or RS-422 driver",
        _ => "its TX to your RX, its RX to your TX",
    };
    let motor = match model.motor {
        Motor::Own => "the motor runs by itself",
        Motor::OwnOrPwm => "the motor runs by itself with its PWM pin low",
        Motor::Pwm => "you drive the motor by PWM",
        Motor::Commands => "the motor starts on command",
        _ => "see its data sheet for the motor",
    };
    format!("{line}; {motor}")
}
