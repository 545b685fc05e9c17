//! Mapping on an emulated Cortex-M4F with just the RAM of a tier: the same bits as here, and what it costs.

use anyhow::{Context as _, Result, ensure};
use beamfix::geometry::Pose;
use beamfix::odometry::OdometryConfig;
use beamfix::slam::SlamConfig;
use beamfix_app::command;

use super::{
    BOARDS, Board, card,
    emulator::{self, Count},
};
use crate::formats::Log;
use crate::mapping::{self, Settings, Tier};
use crate::report::hash::PoseHash;

/// The emulated Cortex-M4F with the RAM of the tier of 64 KB.
const M4F_64K: Board = Board {
    firmware: BOARDS[0].firmware.with("tier-64k"),
    ram_bytes: 64 << 10,
    ..BOARDS[0]
};
/// Of 192 KB.
const M4F_192K: Board = Board {
    firmware: BOARDS[0].firmware.with("tier-192k"),
    ram_bytes: 192 << 10,
    ..BOARDS[0]
};
/// And of 512 KB.
const M4F_512K: Board = Board {
    firmware: BOARDS[0].firmware.with("tier-512k"),
    ram_bytes: 512 << 10,
    ..BOARDS[0]
};

/// What mapping a log costs.
#[derive(Debug, Clone)]
pub struct Costs {
    /// Scans of the log.
    pub scans: usize,
    /// Keyframes that are left in the end.
    pub keyframes: usize,
    /// Bytes of RAM there are.
    pub ram_bytes: u64,
    /// Statics (bytes).
    pub static_bytes: u64,
    /// Deepest stack (bytes).
    pub stack_bytes: u32,
    /// Instructions a scan: update and slice of work, mean.
    pub mean: f64,
    /// Instructions of the longest update, and of the longest slice of work.
    pub longest: [u32; 2],
    /// Over the poses of all scans as they came, and of the keyframes in the end.
    pub hash: PoseHash,
}

impl Costs {
    /// For people.
    #[must_use]
    pub fn text(&self, name: &str) -> String {
        format!(
            "{name}: {} scans, {} keyframes in the end, pose hash {}, as on the host\n\
             {} B of statics and {} B of stack of {} B of RAM\n\
             {:.2} M instructions a scan, {:.2} M the longest update, {:.2} M the longest slice of work",
            self.scans,
            self.keyframes,
            self.hash,
            self.static_bytes,
            self.stack_bytes,
            self.ram_bytes,
            self.mean / 1e6,
            f64::from(self.longest[0]) / 1e6,
            f64::from(self.longest[1]) / 1e6,
        )
    }
}

/// Maps the first scans of a log on the board and here.
///
/// Fails where one bit of a pose differs, and where statics and stack are more than the RAM of the tier.
pub fn measure(tier: Tier, log: &Log, scans: usize) -> Result<Costs> {
    let board = match tier {
        Tier::Of64k => M4F_64K,
        Tier::Of192k => M4F_192K,
        Tier::Of512k => M4F_512K,
    };
    let scans = scans.min(log.scans.len());
    let elf = board.build("slam")?;
    let ram = (board.ram_start, board.ram_start + board.ram_bytes);
    let (_, static_bytes) = card::sizes(&elf, &[ram])?;
    let output = emulator::run(&board, &elf, &input(log, scans), Count::Exact)?;
    let rows: Vec<[u32; 5]> = output
        .chunks_exact(20)
        .map(|row| std::array::from_fn(|k| word(&row[4 * k..])))
        .collect();
    ensure!(rows.len() > scans, "only {} rows came back", rows.len());
    let (each, rest) = rows.split_at(scans);
    let (&[longest, _, stack_bytes, _, _], keyframes) =
        rest.split_last().context("no row at the end")?;
    let poses = each.iter().map(|&[x, y, theta, ..]| [x, y, theta]);
    let there: Vec<[u32; 3]> = poses
        .chain(keyframes.iter().map(|&[_, x, y, theta, _]| [x, y, theta]))
        .collect();
    let (here, hash) = on_host(tier, log, scans)?;
    let first = there.iter().zip(&here).position(|(a, b)| a != b);
    ensure!(
        first.is_none() && there.len() == here.len(),
        "pose {first:?} of {} scans and the keyframes differs: {} there, {} here",
        scans,
        there.len(),
        here.len()
    );
    ensure!(
        static_bytes + u64::from(stack_bytes) <= board.ram_bytes,
        "{static_bytes} B of statics and {stack_bytes} B of stack are more than the tier has"
    );
    let total: f64 = each
        .iter()
        .map(|row| f64::from(row[3]) + f64::from(row[4]))
        .sum();
    Ok(Costs {
        scans,
        keyframes: keyframes.len(),
        ram_bytes: board.ram_bytes,
        static_bytes,
        stack_bytes,
        mean: total / scans as f64,
        longest: [each.iter().map(|row| row[3]).max().unwrap_or(0), longest],
        hash,
    })
}

fn on_host(tier: Tier, log: &Log, scans: usize) -> Result<(Vec<[u32; 3]>, PoseHash)> {
    let settings = Settings {
        tier,
        odometry: OdometryConfig::DEFAULT,
        slam: SlamConfig::DEFAULT,
        scans: (scans, true),
        pruning: None,
        resolution: None,
    };
    let map = mapping::run(log, &settings, &mut || {})?;
    let online = map.scans.iter().map(|scan| scan.online);
    let poses: Vec<Pose> = online
        .chain(map.keyframes.iter().map(|(_, pose)| *pose))
        .collect();
    let mut hash = PoseHash::new();
    poses.iter().for_each(|pose| hash.push(*pose));
    let bits = |pose: Pose| [pose.x, pose.y, pose.theta].map(f32::to_bits);
    Ok((poses.into_iter().map(bits).collect(), hash))
}

/// What the board's program reads.
fn input(log: &Log, scans: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    for scan in log.scans.iter().take(scans) {
        bytes.extend((scan.beams.len() as u16).to_le_bytes());
        bytes.extend(u16::from(scan.wheels.is_some()).to_le_bytes());
        let Pose { x, y, theta } = scan.wheels.unwrap_or_default();
        bytes.extend([x, y, theta].into_iter().flat_map(f32::to_le_bytes));
        let end_us = scan.beams.last().map_or(0, |beam| beam.time_us);
        bytes.extend(end_us.to_le_bytes());
        bytes.extend(scan.beams.iter().flat_map(command::beam_bytes));
    }
    bytes
}

fn word(bytes: &[u8]) -> u32 {
    u32::from_le_bytes(std::array::from_fn(|k| bytes[k]))
}
