//! The board alone: the lidar is simulated on it, poses and their errors are lines on standard output.

use beamfix_app::{App, AppConfig, CONFIG, Output, telemetry::Reset};
use beamfix_selftest::demo::Demo;
use semihosting::io::{self, Write as _};

/// Lines for a terminal.
pub const TEXT: AppConfig = AppConfig {
    output: Output::Text,
    ..CONFIG
};
/// Two rounds of the circle.
const TURNS: u32 = 400;

/// Drives for [`TURNS`] revolutions of the lidar.
pub fn run<const N: usize>(app: &mut App<N>) -> io::Result<()> {
    let mut output = io::stdout()?;
    output.write_all(app.ready(Reset::Other))?;
    let mut demo = Demo::new();
    while app.seen().turns < TURNS {
        let packet = demo.packet();
        let mut rest = packet.as_slice();
        while !rest.is_empty() {
            let (taken, sent) = app.lidar(rest);
            rest = rest.get(taken..).unwrap_or_default();
            if !sent.is_empty() {
                output.write_all(sent)?;
                output.write_all(app.truth(|time_us| Some(demo.truth(time_us))))?;
            }
        }
    }
    Ok(())
}
