//! `.lscan`: scans with wheel odometry as plain little-endian binary.
//!
//! Header of 40 bytes: `LSCN`, version (1), scans, beams (`u32` each), angle step (rad), range unit (m), longest range (m)
//! as `f64`. A scan: time (µs, `i64`), x, y, theta by wheel odometry, angle of the first beam (`f64` each), then the
//! ranges (`u16` units, 0 for nothing).

use anyhow::{Result, bail, ensure};
use beamfix::scan::{Beam, Bearing};

use super::mirror::Mirror;
use super::no_return::{Limits, Rule};
use super::{Log, Recorded, clock::Clock};
use beamfix_sim::TruePose;

/// The first bytes of such a file.
pub const MAGIC: &[u8] = b"LSCN";
const HEADER: usize = 40;
const SCAN_HEADER: usize = 40;

/// Reads the scans; a file shorter than its header says gives the whole ones before the cut.
pub fn parse(bytes: &[u8]) -> Result<Log> {
    ensure!(
        bytes.len() >= HEADER,
        "the header has 40 bytes, the file {}",
        bytes.len()
    );
    let (version, scans, beams) = (
        u32_at(bytes, 4),
        u32_at(bytes, 8) as usize,
        u32_at(bytes, 12) as usize,
    );
    ensure!(version == 1, "version {version}, only 1 is known");
    let (step, unit, longest) = (f64_at(bytes, 16), f64_at(bytes, 24), f64_at(bytes, 32));
    ensure!(
        step.is_finite() && step != 0.0 && unit > 0.0 && longest > 0.0,
        "angle step {step} rad, range unit {unit} m, longest range {longest} m"
    );
    ensure!((1..=65_536).contains(&beams), "{beams} beams a scan");
    let size = SCAN_HEADER + 2 * beams;
    let limits = Limits::stated(0.0, longest as f32);
    let readings = |scan: &[u8]| -> Vec<f32> {
        let units = scan[SCAN_HEADER..].chunks_exact(2);
        units
            .map(|pair| (f64::from(u16::from_le_bytes([pair[0], pair[1]])) * unit) as f32)
            .collect()
    };
    let all: Vec<Vec<f32>> = bytes[HEADER..]
        .chunks_exact(size)
        .take(scans)
        .map(readings)
        .collect();
    let rule = Rule::of(all.iter().map(|readings| (&readings[..], limits)));
    let mut log = Log {
        source: ".lscan file".into(),
        ..Log::default()
    };
    let mut clock = Clock::new();
    let whole = bytes[HEADER..].chunks_exact(size).take(scans);
    for (k, (scan, readings)) in whole.zip(&all).enumerate() {
        let time_us = u64_at(scan, 0) as i64;
        let odometry = TruePose::new(f64_at(scan, 8), f64_at(scan, 16), f64_at(scan, 24));
        let first = f64_at(scan, 32);
        if ![odometry.x, odometry.y, odometry.theta, first]
            .iter()
            .all(|v| v.is_finite())
        {
            log.skip(format!("scan {k}"), "a pose or an angle is not finite");
            continue;
        }
        let driver_us = clock.at(time_us as f64 * 1e-6);
        let mirror = Mirror::of(readings.len(), step);
        let beam = |(k, &reading): (usize, &f32)| Beam {
            bearing: Bearing::from_radians((first + step * k as f64) as f32),
            range: rule.range(reading, limits),
            time_us: driver_us.wrapping_sub(mirror.age_us(k)),
            quality: 0,
        };
        log.scans.push(Recorded {
            stamp: seconds(time_us),
            wheels: Some(odometry.into()),
            beams: readings.iter().enumerate().map(beam).collect(),
        });
    }
    let whole = (bytes.len() - HEADER) / size;
    if whole < scans {
        let cut = format!(
            "cut short: {scans} scans announced, {whole} whole ones in {} bytes",
            bytes.len()
        );
        if log.scans.is_empty() {
            bail!(cut);
        }
        log.cut = Some(cut);
    }
    Ok(log)
}

/// Microseconds as seconds with all six digits.
fn seconds(us: i64) -> String {
    let sign = if us < 0 { "-" } else { "" };
    let us = us.unsigned_abs();
    format!("{sign}{}.{:06}", us / 1_000_000, us % 1_000_000)
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    let mut four = [0; 4];
    four.copy_from_slice(&bytes[at..at + 4]);
    u32::from_le_bytes(four)
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from(u32_at(bytes, at)) | u64::from(u32_at(bytes, at + 4)) << 32
}

fn f64_at(bytes: &[u8], at: usize) -> f64 {
    f64::from_bits(u64_at(bytes, at))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(scans: u32) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        for word in [1, scans, 2] {
            bytes.extend_from_slice(&u32::to_le_bytes(word));
        }
        for value in [0.1f64, 0.01, 81.83] {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
        for scan in 0..scans {
            bytes.extend_from_slice(&(i64::from(scan) * 200_000 - 1).to_le_bytes());
            for value in [1.0f64, 2.0, 0.5, -0.1] {
                bytes.extend_from_slice(&value.to_le_bytes());
            }
            bytes.extend_from_slice(&[100, 0, 0xf7, 0x1f]);
        }
        bytes
    }

    #[test]
    fn whole_scans_are_read_and_a_cut_is_told() {
        let bytes = file(3);
        let log = parse(&bytes).expect("whole");
        assert_eq!((log.scans.len(), log.cut.is_none()), (3, true));
        assert_eq!(log.scans[0].stamp, "-0.000001");
        assert_eq!(log.scans[2].stamp, "0.399999");
        let mm: Vec<_> = log.scans[1]
            .beams
            .iter()
            .map(|b| b.range.mm().ok())
            .collect();
        assert_eq!(mm, [Some(1000), None]);
        let cut = parse(&bytes[..bytes.len() - 1]).expect("two are whole");
        assert_eq!(cut.scans.len(), 2);
        assert!(
            cut.cut
                .expect("told")
                .contains("3 scans announced, 2 whole")
        );
        for length in [4, 39, 60] {
            assert!(parse(&bytes[..length]).is_err(), "{length}");
        }
    }
}
