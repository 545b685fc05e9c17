//! Hokuyo SCIP 2.0: the reply to an endless MD command.

use beamfix::lidar::Model;
use beamfix::lidar::model::Steps;

use super::{Shot, Sweep, Wire};

/// Scans with three characters a value.
#[derive(Debug)]
pub struct Scans {
    steps: Steps,
    first: u64,
    last: u64,
    shots: Vec<Shot>,
    begun: bool,
}

impl Scans {
    /// An URG-04LX's 240°, or another's 270°.
    #[must_use]
    pub fn new(steps: Steps) -> Self {
        let (first, last) = if steps == Steps::URG04LX {
            (44, 725)
        } else {
            (0, 1080)
        };
        Self {
            steps,
            first,
            last,
            shots: Vec::new(),
            begun: false,
        }
    }
}

/// Characters of six bits each, with a check character at the end.
fn line_of(characters: &str) -> String {
    let sum = characters.bytes().map(u32::from).sum::<u32>();
    let check = char::from((sum & 0x3f) as u8 + 0x30);
    format!("{characters}{check}\n")
}

fn encode(value: u32, width: u32) -> String {
    (0..width)
        .rev()
        .map(|k| char::from((value >> (6 * k) & 0x3f) as u8 + 0x30))
        .collect()
}

impl Wire for Scans {
    fn sweep(&self, model: &Model) -> Sweep {
        let per_revolution = f64::from(self.steps.per_revolution);
        let sweep_us = 1e7 / f64::from(model.revolutions_per_10s);
        Sweep {
            first: (self.first as f64 - f64::from(self.steps.front)) / per_revolution,
            step: 1.0 / per_revolution,
            period_us: sweep_us / per_revolution,
            beams: self.last - self.first + 1,
            sweep_us,
        }
    }

    fn add(&mut self, shot: Shot, line: &mut Vec<u8>) {
        self.shots.push(shot);
        if (self.shots.len() as u64) <= self.last - self.first {
            return;
        }
        let command = format!("MD{:04}{:04}01000", self.first, self.last);
        let mut text = String::new();
        if !self.begun {
            text += &format!("{command}\n{}\n", line_of("00"));
            self.begun = true;
        }
        text += &format!("{command}\n{}", line_of("99"));
        let stamp = (self.shots[0].time_us / 1000.0) as u32 & 0x00ff_ffff;
        text += &line_of(&encode(stamp, 4));
        let values: String = self
            .shots
            .drain(..)
            .map(|shot| encode((shot.mm.round() as u32).min(65_535), 3))
            .collect();
        for start in (0..values.len()).step_by(64) {
            text += &line_of(&values[start..values.len().min(start + 64)]);
        }
        text.push('\n');
        line.extend(text.bytes());
    }
}
