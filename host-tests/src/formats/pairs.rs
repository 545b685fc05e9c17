//! Lists of scan pairs: two text files for the PC, or one binary file for an emulated board.
//!
//! `scans_*.txt[.gz]`: `scans rays first_angle angle_step range_min range_max`, then a line a scan:
//! `index time x y theta odo_x odo_y odo_theta r0 …`. `pairs_*.csv[.gz]`:
//! `pair,ref,sens,level,gx,gy,gth,tx,ty,tth`. `*.bin` (little-endian): `i32` pairs, beams, `f32` first angle, angle step,
//! longest range, then per pair `f32` guess\[3\], truth\[3\], reference ranges, current ranges. Metres and radians.

use std::collections::HashMap;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use beamfix::geometry::Pose;
use beamfix::scan::{Beam, Bearing};

use super::bytes;
use super::no_return::{Limits, Rule};

/// One pair of a list.
#[derive(Debug, Clone)]
pub struct Pair {
    /// Its number in the list.
    pub id: i64,
    /// How far the guess is off: 0 odometry, -1 none, 1 to 4 disturbed.
    pub level: i32,
    /// Which of [`Pairs::scans`] is the reference.
    pub reference: usize,
    /// Which of [`Pairs::scans`] is matched to it.
    pub current: usize,
    /// Where the matcher starts: the current scan's pose in the frame of the reference.
    pub guess: Pose,
    /// Where it should arrive.
    pub truth: Pose,
}

/// A list of pairs with its scans.
#[derive(Debug, Clone, Default)]
pub struct Pairs {
    /// The scans, all beams at time 0.
    pub scans: Vec<Vec<Beam>>,
    /// The pairs.
    pub pairs: Vec<Pair>,
    /// Lines left out because they are broken, with the first of them.
    pub skipped: Vec<String>,
}

/// Directions and limits that all scans of a list share.
struct Layout {
    first: f64,
    step: f64,
    limits: Limits,
}

impl Layout {
    /// The beams of all scans.
    fn scans(&self, scans: &[Vec<f32>]) -> Vec<Vec<Beam>> {
        let rule = Rule::of(scans.iter().map(|readings| (&readings[..], self.limits)));
        let beam = |(k, &reading): (usize, &f32)| Beam {
            bearing: Bearing::from_radians((self.first + self.step * k as f64) as f32),
            range: rule.range(reading, self.limits),
            time_us: 0,
            quality: 0,
        };
        let beams = |readings: &Vec<f32>| readings.iter().enumerate().map(beam).collect();
        scans.iter().map(beams).collect()
    }
}

/// Reads a scan file and a pair list.
pub fn read(scans: &Path, pairs: &Path) -> Result<Pairs> {
    let (scan_text, pair_text) = (text(scans)?, text(pairs)?);
    let mut list = Pairs::default();
    let by_index =
        parse_scans(&scan_text, &mut list).with_context(|| scans.display().to_string())?;
    parse_pairs(&pair_text, &by_index, &mut list).with_context(|| pairs.display().to_string())?;
    Ok(list)
}

/// Reads a binary list.
pub fn read_binary(path: &Path) -> Result<Pairs> {
    let content = bytes::load(path)?;
    parse_binary(&content.bytes).with_context(|| path.display().to_string())
}

fn text(path: &Path) -> Result<String> {
    let content = bytes::load(path)?;
    if let Some(cut) = content.cut {
        bail!("{}: {cut}", path.display());
    }
    String::from_utf8(content.bytes)
        .with_context(|| format!("{}: bytes where text should be", path.display()))
}

fn parse_scans(text: &str, list: &mut Pairs) -> Result<HashMap<i64, usize>> {
    let mut lines = text.lines();
    let header: Vec<f64> = lines
        .next()
        .map_or(Ok(Vec::new()), |line| {
            line.split_whitespace().map(str::parse).collect()
        })
        .context("line 1: not numbers")?;
    let [_, rays, first, step, nearest, farthest] = header[..] else {
        bail!(
            "line 1: {} words, 6 wanted: scans rays first_angle angle_step range_min range_max",
            header.len()
        );
    };
    let layout = Layout {
        first,
        step,
        limits: Limits::stated(nearest as f32, farthest as f32),
    };
    let mut scans = Vec::new();
    let mut by_index = HashMap::new();
    for (number, line) in lines.enumerate() {
        match parse_scan(line, rays as usize) {
            Ok((index, ranges)) => {
                by_index.insert(index, scans.len());
                scans.push(ranges);
            }
            Err(error) => list
                .skipped
                .push(format!("scan line {}: {error:#}", number + 2)),
        }
    }
    ensure!(!scans.is_empty(), "no usable scan");
    list.scans = layout.scans(&scans);
    Ok(by_index)
}

fn parse_scan(line: &str, rays: usize) -> Result<(i64, Vec<f32>)> {
    let words: Vec<&str> = line.split_whitespace().collect();
    ensure!(
        words.len() == 8 + rays,
        "{} words, {} wanted",
        words.len(),
        8 + rays
    );
    let index = words[0]
        .parse()
        .with_context(|| format!("{:?} is not an index", words[0]))?;
    let ranges = words[8..].iter().map(|word| {
        word.parse()
            .with_context(|| format!("{word:?} is not a range"))
    });
    Ok((index, ranges.collect::<Result<_>>()?))
}

fn parse_pairs(text: &str, by_index: &HashMap<i64, usize>, list: &mut Pairs) -> Result<()> {
    let mut lines = text.lines();
    let names: Vec<&str> = lines
        .next()
        .unwrap_or_default()
        .split(',')
        .map(str::trim)
        .collect();
    let column = |name: &str| {
        names
            .iter()
            .position(|&n| n == name)
            .with_context(|| format!("line 1: no column {name:?} in {names:?}"))
    };
    let mut columns = [0; 10];
    let wanted = [
        "pair", "ref", "sens", "level", "gx", "gy", "gth", "tx", "ty", "tth",
    ];
    for (slot, name) in columns.iter_mut().zip(wanted) {
        *slot = column(name)?;
    }
    for (number, line) in lines
        .enumerate()
        .filter(|(_, line)| !line.trim().is_empty())
    {
        match parse_pair(line, &columns, by_index) {
            Ok(pair) => list.pairs.push(pair),
            Err(error) => list
                .skipped
                .push(format!("pair line {}: {error:#}", number + 2)),
        }
    }
    ensure!(!list.pairs.is_empty(), "no usable pair");
    Ok(())
}

fn parse_pair(line: &str, columns: &[usize; 10], by_index: &HashMap<i64, usize>) -> Result<Pair> {
    let words: Vec<&str> = line.split(',').map(str::trim).collect();
    let mut values = [0.0f64; 10];
    for (value, &column) in values.iter_mut().zip(columns) {
        let word = words
            .get(column)
            .with_context(|| format!("{} columns", words.len()))?;
        *value = word
            .parse()
            .with_context(|| format!("{word:?} is not a number"))?;
        ensure!(value.is_finite(), "{word:?} is not finite");
    }
    let [id, reference, current, level, gx, gy, gth, tx, ty, tth] = values;
    let scan = |index: f64| {
        by_index
            .get(&(index as i64))
            .copied()
            .with_context(|| format!("there is no scan {index}"))
    };
    Ok(Pair {
        id: id as i64,
        level: level as i32,
        reference: scan(reference)?,
        current: scan(current)?,
        guess: Pose::new(gx as f32, gy as f32, gth as f32),
        truth: Pose::new(tx as f32, ty as f32, tth as f32),
    })
}

fn parse_binary(bytes: &[u8]) -> Result<Pairs> {
    let mut words = bytes
        .chunks_exact(4)
        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    ensure!(
        bytes.len() >= 20,
        "the header has 20 bytes, the file {}",
        bytes.len()
    );
    let mut word = || words.next().unwrap_or_default();
    let (pairs, beams) = (word() as usize, word() as usize);
    ensure!(
        pairs <= 1_000_000 && beams <= 65_536,
        "{pairs} pairs of {beams} beams: not such a file"
    );
    let needed = 20 + pairs * 4 * (6 + 2 * beams);
    ensure!(
        bytes.len() == needed,
        "{pairs} pairs of {beams} beams take {needed} bytes, the file has {}",
        bytes.len()
    );
    let mut float = || f32::from_bits(word());
    let (first, step, farthest) = (float(), float(), float());
    let layout = Layout {
        first: f64::from(first),
        step: f64::from(step),
        limits: Limits::stated(0.0, farthest),
    };
    let mut list = Pairs::default();
    let mut scans: Vec<Vec<f32>> = Vec::new();
    for k in 0..pairs {
        let mut pose = || Pose::new(float(), float(), float());
        let (guess, truth) = (pose(), pose());
        for _ in 0..2 {
            scans.push((0..beams).map(|_| float()).collect());
        }
        list.pairs.push(Pair {
            id: k as i64,
            level: 0,
            reference: 2 * k,
            current: 2 * k + 1,
            guess,
            truth,
        });
    }
    list.scans = layout.scans(&scans);
    Ok(list)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_lists_are_read_by_column_name() {
        let mut list = Pairs::default();
        let scans =
            "2 3 -0.1 0.1 0.05 30\n7 0 0 0 0 0 0 0 1.0 nan 31\nx\n9 0 0 0 0 0 0 0 1 2 0.01\n";
        let by_index = parse_scans(scans, &mut list).expect("two scans");
        let pairs = "level,pair,ref,sens,gx,gy,gth,tx,ty,tth\n2,5,7,9,.1,.2,.3,.4,.5,.6\n0,6,7,8,0,0,0,0,0,0\n";
        parse_pairs(pairs, &by_index, &mut list).expect("one pair");
        assert_eq!(
            (list.scans.len(), list.pairs.len(), list.skipped.len()),
            (2, 1, 2)
        );
        let pair = &list.pairs[0];
        assert_eq!(
            (pair.id, pair.level, pair.reference, pair.current),
            (5, 2, 0, 1)
        );
        assert_eq!(pair.truth, Pose::new(0.4, 0.5, 0.6));
        let mm: Vec<_> = list.scans[0].iter().map(|b| b.range.mm().ok()).collect();
        assert_eq!(mm, [Some(1000), None, None]);
        assert!(
            list.skipped[1].contains("there is no scan 8"),
            "{:?}",
            list.skipped
        );
        assert!(parse_pairs("pair,ref\n", &by_index, &mut list).is_err());
    }

    #[test]
    fn binary_lists_are_refused_when_their_length_is_wrong() {
        let mut bytes: Vec<u8> = [1i32, 2].iter().flat_map(|v| v.to_le_bytes()).collect();
        let floats = [
            0.0f32, 1.0, 5.0, 0.1, 0.0, 0.0, 0.2, 0.0, 0.0, 1.0, 2.0, 3.0, 0.0,
        ];
        bytes.extend(floats.iter().flat_map(|v| v.to_le_bytes()));
        let list = parse_binary(&bytes).expect("whole");
        assert_eq!(
            (list.scans.len(), list.pairs[0].truth),
            (2, Pose::new(0.2, 0.0, 0.0))
        );
        assert_eq!(list.scans[1][0].range.mm(), Ok(3000));
        for length in [0, 19, bytes.len() - 1] {
            assert!(parse_binary(&bytes[..length]).is_err(), "{length}");
        }
    }
}
