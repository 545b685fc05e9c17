//! A lidar on a serial line, from its name or from nothing to a stream of measurements.

use std::io::{self, ErrorKind};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use beamfix::lidar::identify::identify;
use beamfix::lidar::model::{Model, Start};
use beamfix::lidar::startup::{Action, StartConfig, Startup};
use serialport::SerialPort;

use crate::decode;

/// How long one read waits.
const PATIENCE: Duration = Duration::from_millis(20);
/// How long a line is listened to at one speed: some revolutions of the slowest lidar.
const LISTENED: Duration = Duration::from_millis(600);
/// Waiting times for a sensor of which nobody knows whether it is there.
const HASTY: StartConfig = StartConfig {
    drain_ms: 50,
    answer_ms: 150,
    tries: 1,
    reset_ms: 500,
    spin_up_ms: 300,
    stall_ms: 5000,
};

/// Opens a serial line.
pub fn open(path: &str, baud: u32) -> Result<Box<dyn SerialPort>> {
    let port = serialport::new(path, baud).timeout(PATIENCE).open();
    port.map_err(|error| {
        let kind = io::Error::from(error.clone()).kind();
        anyhow::Error::new(error).context(format!("{path}{}", advice(kind)))
    })
}

/// What helps where a serial line does not open, after its name.
#[must_use]
pub fn advice(kind: io::ErrorKind) -> String {
    match kind {
        io::ErrorKind::NotFound => {
            let ports = serialport::available_ports().unwrap_or_default();
            let names: Vec<String> = ports.into_iter().map(|port| port.port_name).collect();
            match names.is_empty() {
                true => " (no serial line is there: is it plugged in?)".to_owned(),
                false => format!(" (there are: {})", names.join(", ")),
            }
        }
        io::ErrorKind::PermissionDenied => {
            " (on Linux it is most often the group dialout's: sudo usermod -aG dialout $USER, and log in again)".to_owned()
        }
        _ => String::new(),
    }
}

/// Starts the lidar called `name`, or finds out which it is for `auto`; `baud` where its line has another speed than
/// usual. From here on its measurements come.
pub fn start(port: &mut dyn SerialPort, name: &str, baud: Option<u32>) -> Result<Model> {
    if name != "auto" {
        let model = *decode::model(name, &[])?;
        let model = Model {
            baud: baud.unwrap_or(model.baud),
            ..model
        };
        port.set_baud_rate(model.baud)?;
        return asked(port, &model, StartConfig::DEFAULT);
    }
    let mut bauds: Vec<u32> = match baud {
        Some(baud) => vec![baud],
        None => Model::ALL.iter().map(|model| model.baud).collect(),
    };
    bauds.sort_unstable();
    bauds.dedup();
    // Whoever sends without being asked is heard at one of the speeds.
    for &baud in &bauds {
        port.set_baud_rate(baud)?;
        if let Some(model) = told(port)? {
            return with_zero(port, Model { baud, ..model });
        }
    }
    // Whoever must be asked is asked in each of the ways, at its speed.
    let mut tried: Vec<(u32, Start)> = Vec::new();
    for model in Model::ALL {
        let way = (model.baud, model.start);
        let is_new = model.start != Start::Listen && !tried.contains(&way);
        if !is_new || !bauds.contains(&model.baud) {
            continue;
        }
        tried.push(way);
        port.set_baud_rate(model.baud)?;
        if asked(port, model, HASTY).is_ok()
            && let Some(found) = told(port)?
        {
            let baud = model.baud;
            return with_zero(port, Model { baud, ..found });
        }
    }
    bail!(
        "no lidar is heard at {bauds:?} bits/s, nor answers: --lidar names it; is the line's cable right, does it spin?"
    )
}

/// A model that was heard, with the zero that its unit keeps, where it keeps one: it is started again for that.
fn with_zero(port: &mut dyn SerialPort, heard: Model) -> Result<Model> {
    match heard.start {
        Start::Ydlidar { keeps_zero: true } => asked(port, &heard, StartConfig::DEFAULT),
        _ => Ok(heard),
    }
}

/// Which lidar speaks, by what it sends.
fn told(port: &mut dyn SerialPort) -> Result<Option<Model>> {
    let (mut heard, mut bytes, start) = (Vec::new(), [0; 4096], Instant::now());
    while start.elapsed() < LISTENED {
        let n = read(port, &mut bytes)?;
        heard.extend_from_slice(&bytes[..n]);
    }
    Ok(identify(&heard).map(|finding| *finding.model))
}

/// Sends what a sensor is started with, and reads its answers; gives the model with what the unit told of itself.
fn asked(port: &mut dyn SerialPort, model: &Model, config: StartConfig) -> Result<Model> {
    let mut startup = Startup::new(model, config);
    let (began, mut bytes) = (Instant::now(), [0; 256]);
    loop {
        match startup.poll(began.elapsed().as_micros() as u32) {
            Action::Send(request) => port.write_all(&request)?,
            Action::SetBaud(baud) => {
                port.flush()?;
                port.set_baud_rate(baud)?;
            }
            // The adapters of RPLIDARs switch the motor off by this line, those of others on. A line without it has none.
            Action::MotorOn => {
                let is_on = model.start != Start::Rplidar;
                let _ = port.write_data_terminal_ready(is_on);
            }
            Action::Wait => {
                let n = read(port, &mut bytes)?;
                bytes[..n].iter().for_each(|&byte| startup.push(byte));
            }
            // In the mode that the model's parser reads.
            Action::Ready(_) => {
                return Ok(Model {
                    zero_cdeg: startup.zero_cdeg().unwrap_or(model.zero_cdeg),
                    ..*model
                });
            }
            Action::Failed(error) => bail!("{}: {error}", model.name),
        }
    }
}

/// What has come in by now, at most; none where nothing has.
pub fn read(port: &mut dyn SerialPort, bytes: &mut [u8]) -> Result<usize> {
    match port.read(bytes) {
        Ok(n) => Ok(n),
        Err(error)
            if [
                ErrorKind::TimedOut,
                ErrorKind::WouldBlock,
                ErrorKind::Interrupted,
            ]
            .contains(&error.kind()) =>
        {
            Ok(0)
        }
        Err(error) => Err(error).context("the line"),
    }
}
