//! Trajectories as text: a pose for every scan, and whether it is only a guess.

use std::io::{self, Write};

use beamfix::geometry::Pose;

/// How a trajectory is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(not(target_family = "wasm"), derive(clap::ValueEnum))]
pub enum Format {
    /// `timestamp x y theta` (s, m, m, rad); ` # guess` follows a pose that no match confirms.
    #[default]
    Plain,
    /// `timestamp x y z qx qy qz qw`, as evo reads it; `# guess` stands in a line before a pose that no match confirms.
    Tum,
}

/// Writes a trajectory line by line.
#[derive(Debug)]
pub struct Trajectory<W> {
    output: W,
    format: Format,
}

impl<W: Write> Trajectory<W> {
    /// Nothing written yet.
    pub const fn new(output: W, format: Format) -> Self {
        Self { output, format }
    }

    /// Appends the pose of a scan with this stamp (s).
    pub fn push(&mut self, stamp: &str, pose: Pose, is_guess: bool) -> io::Result<()> {
        let Pose { x, y, theta } = pose;
        match self.format {
            Format::Plain => {
                let mark = if is_guess { " # guess" } else { "" };
                writeln!(self.output, "{stamp} {x} {y} {theta}{mark}")
            }
            Format::Tum => {
                if is_guess {
                    writeln!(self.output, "# guess")?;
                }
                let half = 0.5 * f64::from(theta);
                let (qz, qw) = (libm::sin(half), libm::cos(half));
                writeln!(self.output, "{stamp} {x} {y} 0 0 0 {qz} {qw}")
            }
        }
    }

    /// Ends it.
    pub fn finish(mut self) -> io::Result<W> {
        self.output.flush()?;
        Ok(self.output)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_formats_keep_the_stamp_and_mark_guesses() {
        for (format, expected) in [
            (Format::Plain, "1.50 1 -2 0\n1.60 1 -2 0.5 # guess\n"),
            (
                Format::Tum,
                "1.50 1 -2 0 0 0 0 1\n# guess\n1.60 1 -2 0 0 0 0.247403959",
            ),
        ] {
            let mut trajectory = Trajectory::new(Vec::new(), format);
            let pose = |theta| Pose::new(1.0, -2.0, theta);
            trajectory.push("1.50", pose(0.0), false).expect("memory");
            trajectory.push("1.60", pose(0.5), true).expect("memory");
            let written = trajectory.finish().expect("memory");
            let text = String::from_utf8(written).expect("text");
            assert!(text.starts_with(expected), "{text}");
        }
    }
}
