//! What a place makes of a robot and its lidar.

use super::text::numbers;
use crate::lidar::Ranging;
use crate::robot::{Steering, WheelErrors};

/// What a place makes of a robot and its lidar: nothing by default.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Nature {
    /// The robot's wheels.
    pub steering: Steering,
    /// Slips a second, and the least and the largest, as shares of what a wheel rolls.
    pub slip: Option<[f64; 3]>,
    /// As [`Ranging`] has them: bias, growth of the noise with the range and where faces are grazed, width of a beam.
    pub bias: f64,
    /// See there.
    pub sigma_share: f64,
    /// See there.
    pub grazing: f64,
    /// See there.
    pub width: f64,
    /// The motor is faster and slower by this share of its speed.
    pub sway: f64,
    /// Messages of the wheels a second; `None`: one for each revolution of the lidar.
    pub wheels_per_s: Option<f64>,
    /// Bias and noise of a gyroscope (rad/s), where there is one.
    pub gyro: Option<[f64; 2]>,
    /// When (s) the lidar is knocked, and by how much it is turned (rad).
    pub knock: Option<[f64; 2]>,
}

impl Nature {
    /// A lidar's ranging there.
    #[must_use]
    pub fn ranging(&self, ranging: Ranging) -> Ranging {
        Ranging {
            bias: ranging.bias + self.bias,
            sigma_share: ranging.sigma_share.max(self.sigma_share),
            grazing: ranging.grazing.max(self.grazing),
            width: ranging.width.max(self.width),
            ..ranging
        }
    }

    /// What wheels get wrong there.
    #[must_use]
    pub fn wheels(&self, wheels: WheelErrors) -> WheelErrors {
        match self.slip {
            None => wheels,
            Some([slips_per_s, least, most]) => WheelErrors {
                slips_per_s,
                slip: [least, most],
                ..wheels
            },
        }
    }

    /// Reads a line of a description: its first word, and the rest.
    pub(super) fn take(&mut self, word: &str, rest: &str) -> Result<(), String> {
        let (name, rest) = match word {
            "slip" | "wheels" | "gyro" | "knock" => (word, rest),
            _ => rest.trim().split_once(' ').unwrap_or((rest.trim(), "")),
        };
        let numbers = numbers(rest)?;
        match (word, name, &numbers[..]) {
            ("drive", "differential", []) => self.steering = Steering::Differential,
            ("drive", "omni", []) => self.steering = Steering::Omni,
            ("drive", "ackermann", [radius]) if *radius > 0.0 => {
                self.steering = Steering::Ackermann(*radius);
            }
            ("slip", _, [often, least, most])
                if *often >= 0.0
                    && (0.0..=100.0).contains(least)
                    && (*least..=100.0).contains(most) =>
            {
                self.slip = Some([*often, 0.01 * least, 0.01 * most]);
            }
            ("wheels", _, [rate]) if *rate > 0.0 => self.wheels_per_s = Some(*rate),
            ("gyro", _, [bias, noise]) if *noise >= 0.0 => {
                self.gyro = Some([bias.to_radians(), noise.to_radians()]);
            }
            ("knock", _, [seconds, degrees]) => self.knock = Some([*seconds, degrees.to_radians()]),
            ("lidar", "bias", [bias]) => self.bias = *bias,
            ("lidar", "distance", [share]) if *share >= 0.0 => self.sigma_share = *share,
            ("lidar", "grazing", [times]) if *times >= 0.0 => self.grazing = *times,
            ("lidar", "width", [degrees]) if *degrees >= 0.0 => self.width = degrees.to_radians(),
            ("lidar", "sway", [share]) if (0.0..0.5).contains(share) => self.sway = *share,
            _ => {
                return Err(format!(
                    "{word} cannot be made of: {} {}",
                    name,
                    rest.trim()
                ));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::Place;
    use crate::world::Surface;

    fn parse(text: &str) -> Result<Place, String> {
        Place::parse(text, &mut |name| Err(format!("{name} is not there")))
    }

    #[test]
    fn a_description_says_what_faces_robot_and_lidar_are_like() {
        let text = "rectangle 8 6\nmirror -4 -1 -4 1\nglass 4 -1 4 1\nblack -1 3 1 3\nstart 0 0 0\nway 2 0\n\
                    drive ackermann 0.6\nslip 2 30 100\nlidar bias 0.02\nlidar distance 0.01\nlidar grazing 1\n\
                    lidar width 0.3\nlidar sway 0.05";
        let place = parse(text).expect("a place");
        let of = |surface| {
            let faces = place.world.segments.iter();
            faces.filter(|face| face.surface == surface).count()
        };
        let all = [
            Surface::Plain,
            Surface::Mirror,
            Surface::Glass,
            Surface::Black,
        ]
        .map(of);
        assert_eq!(all, [4, 1, 1, 1]);
        let Nature {
            steering,
            bias,
            sway,
            ..
        } = place.nature;
        assert_eq!(
            (steering, bias, sway),
            (Steering::Ackermann(0.6), 0.02, 0.05)
        );
        let ranging = place.nature.ranging(Ranging::DEFAULT);
        assert_eq!((ranging.bias, ranging.sigma_share), (0.02, 0.01));
        assert_eq!((ranging.grazing, ranging.width), (1.0, 0.3f64.to_radians()));
        let wheels = place.nature.wheels(WheelErrors::DEFAULT);
        assert_eq!((wheels.slips_per_s, wheels.slip), (2.0, [0.3, 1.0]));
        for line in [
            "drive sledge",
            "drive ackermann",
            "slip 1 50 20",
            "slip 1 50 120",
            "lidar",
            "lidar sway 2",
            "lidar colour 1",
            "rectangle 3",
            "glass 1 1",
        ] {
            let why = parse(&format!("{text}\n{line}")).expect_err(line);
            assert!(why.contains("line 14"), "{line}: {why}");
        }
    }
}
