//! The firmware of both boards with an RP2040 in rp2040js: cycles, bytes at their exact times, tests for the chip itself.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use anyhow::{Context as _, Result, ensure};
use serde::{Deserialize, Serialize};

use super::{Replay, emulator::Folder, firmware::Firmware, root};

/// With rp2040-hal, by interrupts.
pub const PICO: Firmware = Firmware::new("pico", "thumbv6m-none-eabi");
/// With embassy-rp, by await.
pub const PICO_EMBASSY: Firmware = Firmware::new("pico-embassy", "thumbv6m-none-eabi");

/// What the lidar does.
#[derive(Debug, Clone, Serialize)]
pub struct Job {
    #[serde(skip)]
    firmware: Firmware,
    #[serde(skip)]
    bytes: Vec<u8>,
    lidar: PathBuf,
    telemetry: PathBuf,
    /// Of the lidar's line.
    pub baud: u32,
    /// From which byte on a piece begins how long after the start (µs): the lidar's packets come one by one.
    pub pieces: Vec<(usize, u64)>,
    /// From which byte on how many bytes arrive in the very same moment.
    pub bursts: Vec<(usize, usize)>,
    /// How long it goes on after the last byte (s).
    pub rest: f64,
}

/// What became of it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Report {
    /// Bytes sent.
    pub sent: usize,
    /// Bytes that found the UART full.
    pub overruns: u32,
    /// Simulated time from the first byte to the last.
    pub seconds: f64,
    /// Cycles of the core in that time that it was awake.
    pub cycles: u64,
    /// The others.
    pub sleeping: u64,
    /// When the watchdog bit (s after the start), if it did: there it ended.
    pub reset: Option<f64>,
    /// What the motor's line was set to (%), and when (s after the start).
    pub duties: Vec<(f64, u8)>,
    /// What the firmware has sent.
    #[serde(skip)]
    pub replay: Replay,
}

impl Job {
    /// A lidar that sends these bytes, a packet each 12/4500 s, at its own speed.
    #[must_use]
    pub fn ld06(firmware: Firmware, bytes: &[u8]) -> Self {
        let packets = bytes.len() / 47;
        Self {
            firmware,
            bytes: bytes.to_vec(),
            lidar: PathBuf::new(),
            telemetry: PathBuf::new(),
            baud: beamfix_app::LIDAR_BAUD,
            pieces: (0..packets)
                .map(|packet| (47 * packet, packet as u64 * 12_000_000 / 4500))
                .collect(),
            bursts: Vec::new(),
            rest: 0.2,
        }
    }

    /// No lidar for some time: what a firmware does by itself.
    #[must_use]
    pub fn alone(firmware: Firmware, seconds: f64) -> Self {
        Self {
            rest: seconds,
            ..Self::ld06(firmware, &[])
        }
    }

    /// Runs it; `None`, after a line that says why, where node or rp2040js is missing.
    pub fn run(self) -> Result<Option<Report>> {
        let Some((mut report, sent)) = self.execute()? else {
            return Ok(None);
        };
        report.replay = Replay::from_bytes(&sent)?;
        Ok(Some(report))
    }

    /// The same for a firmware that sends lines.
    pub fn run_text(self) -> Result<Option<String>> {
        Ok(self
            .execute()?
            .map(|(_, sent)| String::from_utf8_lossy(&sent).into_owned()))
    }

    fn execute(mut self) -> Result<Option<(Report, Vec<u8>)>> {
        let Some(here) = installed() else {
            return Ok(None);
        };
        let elf = self.firmware.build("")?;
        let folder = Folder::new()?;
        self.lidar = folder.0.join("lidar.bin");
        self.telemetry = folder.0.join("telemetry.bin");
        fs::write(&self.lidar, &self.bytes)?;
        let job = folder.0.join("job.json");
        fs::write(&job, serde_json::to_string(&self)?)?;
        let output = Command::new("node")
            .arg(here.join("run.js"))
            .arg(elf)
            .arg(job)
            .stdin(Stdio::null())
            .output()
            .context("node could not be started: `./test setup` installs it")?;
        ensure!(
            output.status.success(),
            "rp2040js: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        let report = serde_json::from_slice(&output.stdout)?;
        Ok(Some((report, fs::read(&self.telemetry)?)))
    }
}

/// Runs one test of an ELF file made with embedded-test, as probe-rs does: by its address. Gives the exit status; `None`,
/// after a line that says why, where node or rp2040js is missing.
pub fn run_test(elf: &Path, address: u32) -> Result<Option<i32>> {
    let Some(here) = installed() else {
        return Ok(None);
    };
    let output = Command::new("node")
        .arg(here.join("test.js"))
        .arg(elf)
        .arg(format!("run_addr {address}"))
        .stdin(Stdio::null())
        .output()
        .context("node could not be started: `./test setup` installs it")?;
    Ok(Some(output.status.code().unwrap_or(-1)))
}

fn installed() -> Option<PathBuf> {
    let here = root().join("host-tests/rp2040js");
    if here.join("node_modules/rp2040js").exists() {
        return Some(here);
    }
    println!("left out: rp2040js is not there; `./test setup` installs it");
    None
}

impl Report {
    /// Share of the core's time that it was awake.
    #[must_use]
    pub fn load(&self) -> f64 {
        self.cycles as f64 / (self.cycles + self.sleeping) as f64
    }
}
