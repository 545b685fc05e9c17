//! What a simulated lidar measures: one beam from where it is at that moment.

use beamfix::scan::{Beam, Bearing, Range};

use super::noise::Noise;
use super::pose::TruePose;
use super::world::{Surface, World};

/// What a sensor can measure, and what it gets wrong.
#[derive(Debug, Clone, Copy)]
pub struct Ranging {
    /// Standard deviation of a range (m). Default 0.01.
    pub sigma: f64,
    /// Nearest range (m). Default 0.02.
    pub nearest: f64,
    /// Farthest range (m). Default 12.
    pub farthest: f64,
    /// The standard deviation's growth with the range (share of it). Default 0.
    pub sigma_share: f64,
    /// Its growth where a face is grazed: by so many times the inverse cosine less one, up to five. Default 0.
    pub grazing: f64,
    /// By how much ranges are too long (m). Default 0.
    pub bias: f64,
    /// Width of a beam (rad): at an edge it measures anything between the near face and the far one. Default 0.
    pub width: f64,
}

/// Black faces return so little light that they are seen to this share of the farthest range.
const BLACK: f64 = 0.25;
/// Mirrors on a beam's way, at most.
const MIRRORS: usize = 4;
/// Faces this near behind each other (m) are no edge.
const EDGE: f64 = 0.05;

impl Ranging {
    /// The LD06.
    pub const DEFAULT: Self = Self {
        sigma: 0.01,
        nearest: 0.02,
        farthest: 12.0,
        sigma_share: 0.0,
        grazing: 0.0,
        bias: 0.0,
        width: 0.0,
    };

    /// What there is, however far.
    pub const TRUE: Self = Self {
        sigma: 0.0,
        nearest: 0.0,
        farthest: f64::INFINITY,
        ..Self::DEFAULT
    };

    /// Range (mm, with noise) from `sensor` in the direction `bearing` (rad, counter-clockwise from its front).
    pub fn measure(
        &self,
        world: &World,
        sensor: TruePose,
        bearing: f64,
        noise: &mut Noise,
    ) -> Option<f64> {
        let direction = sensor.theta + bearing;
        // Drawn in any case, so that a shot's noise does not depend on the shots before it.
        let error = noise.normal(self.sigma);
        let from = [sensor.x, sensor.y];
        let (seen, cos) = if self.width > 0.0 {
            let sides = [-0.5, 0.5].map(|side| {
                let towards = direction + side * self.width;
                self.seen(world, from, towards, noise)
            });
            match sides {
                [Some(a), Some(b)] if (a.0 - b.0).abs() > EDGE => {
                    let share = noise.even(0.0, 1.0);
                    (a.0 + share * (b.0 - a.0), a.1)
                }
                _ => self.seen(world, from, direction, noise)?,
            }
        } else {
            self.seen(world, from, direction, noise)?
        };
        let mut error = error;
        if self.sigma_share > 0.0 {
            error *= libm::hypot(1.0, self.sigma_share * seen / self.sigma.max(1e-6));
        }
        if self.grazing > 0.0 {
            error *= (1.0 + self.grazing * (1.0 / cos.max(1e-3) - 1.0)).min(5.0);
        }
        let range = seen + error + self.bias;
        (self.nearest..=self.farthest)
            .contains(&range)
            .then_some(range * 1000.0)
    }

    /// Range (mm, with noise) of something that is so far (m).
    pub fn at(&self, range: f64, noise: &mut Noise) -> Option<f64> {
        let range = range + noise.normal(self.sigma) + self.bias;
        (self.nearest..=self.farthest)
            .contains(&range)
            .then_some(range * 1000.0)
    }

    /// How far (m) the face is that a beam returns from, through panes and by mirrors, and the cosine of its incidence.
    fn seen(
        &self,
        world: &World,
        mut from: [f64; 2],
        direction: f64,
        noise: &mut Noise,
    ) -> Option<(f64, f64)> {
        let mut towards = [libm::cos(direction), libm::sin(direction)];
        let mut way = 0.0;
        for _ in 0..=MIRRORS {
            let hit = world.hit(from, towards)?;
            way += hit.range;
            let dot = towards[0] * hit.normal[0] + towards[1] * hit.normal[1];
            let at = [0, 1].map(|k: usize| from[k] + hit.range * towards[k]);
            match hit.surface {
                Surface::Plain => return Some((way, dot.abs())),
                Surface::Black => {
                    return (way < BLACK * self.farthest).then_some((way, dot.abs()));
                }
                // Which of the three a beam does hangs on dirt and angle: from beam to beam.
                Surface::Glass => match noise.even(0.0, 1.0) {
                    ..0.4 => {}
                    0.4..0.8 => return None,
                    _ => return Some((way, dot.abs())),
                },
                Surface::Mirror => {
                    towards = [0, 1].map(|k: usize| towards[k] - 2.0 * dot * hit.normal[k]);
                }
            }
            // On behind the pane, or before the mirror.
            from = [0, 1].map(|k: usize| at[k] + 1e-6 * towards[k]);
        }
        None
    }
}

/// A scan taken at one moment, for scan pairs.
#[derive(Debug, Clone, Copy)]
pub struct Still {
    /// Number of beams.
    pub beams: usize,
    /// Direction of the first (rad).
    pub first: f64,
    /// From one to the next, counter-clockwise (rad).
    pub step: f64,
    /// What the sensor can measure.
    pub ranging: Ranging,
}

impl Still {
    /// `beams` all around, starting behind.
    #[must_use]
    pub fn full_turn(beams: usize) -> Self {
        use core::f64::consts::{PI, TAU};
        Self {
            beams,
            first: -PI,
            step: TAU / beams as f64,
            ranging: Ranging::DEFAULT,
        }
    }

    /// The beams seen from `sensor`, all at time 0.
    pub fn scan(&self, world: &World, sensor: TruePose, noise: &mut Noise) -> Vec<Beam> {
        (0..self.beams)
            .map(|k| {
                let bearing = self.first + self.step * k as f64;
                let mm = self.ranging.measure(world, sensor, bearing, noise);
                Beam {
                    bearing: Bearing::from_radians(bearing as f32),
                    range: Range::from_mm(libm::round(mm.unwrap_or(0.0)) as u32),
                    time_us: 0,
                    quality: quality(mm),
                }
            })
            .collect()
    }
}

/// Strength of a return: falls with the distance, as on the sensors.
#[must_use]
pub fn quality(range_mm: Option<f64>) -> u8 {
    range_mm.map_or(0, |mm| 250 - (mm / 64.0).clamp(0.0, 200.0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ranges (m) of many shots straight ahead, at a wall 3 m away behind a face of something at 2 m.
    fn ranges(surface: Surface, ranging: Ranging) -> Vec<Option<f64>> {
        let mut world = World::default();
        world.face([2.0, -5.0], [2.0, 5.0], surface);
        world.line([3.0, -5.0], [3.0, 5.0]);
        world.line([-1.0, -5.0], [-1.0, 5.0]);
        let mut noise = Noise::new(1, 0);
        (0..2000)
            .map(|_| {
                let mm = ranging.measure(&world, TruePose::default(), 0.0, &mut noise);
                mm.map(|mm| mm / 1000.0)
            })
            .collect()
    }

    const EXACT: Ranging = Ranging {
        sigma: 0.0,
        ..Ranging::DEFAULT
    };

    #[test]
    fn glass_is_passed_swallows_or_returns_mirrors_show_what_is_before_them_and_black_is_seen_near_by()
     {
        let share = |all: &[Option<f64>], is: Option<f64>| {
            let count = all
                .iter()
                .filter(|&&range| match (range, is) {
                    (Some(a), Some(b)) => (a - b).abs() < 1e-5,
                    (a, b) => a == b,
                })
                .count();
            count as f64 / all.len() as f64
        };
        let glass = ranges(Surface::Glass, EXACT);
        // Four standard errors of a share of 2000: 4.4 %.
        for (is, wanted) in [(Some(3.0), 0.4), (None, 0.4), (Some(2.0), 0.2)] {
            let found = share(&glass, is);
            assert!((found - wanted).abs() < 0.044, "{is:?}: {found}");
        }
        // 2 m there, 3 m back to the wall behind the lidar.
        assert_eq!(share(&ranges(Surface::Mirror, EXACT), Some(5.0)), 1.0);
        assert_eq!(share(&ranges(Surface::Black, EXACT), Some(2.0)), 1.0);
        let weak = Ranging {
            farthest: 7.0,
            ..EXACT
        };
        assert_eq!(share(&ranges(Surface::Black, weak), None), 1.0);
    }

    #[test]
    fn two_mirrors_that_face_each_other_end() {
        let mut world = World::default();
        for x in [-1.0, 1.0] {
            world.face([x, -5.0], [x, 5.0], Surface::Mirror);
        }
        let mut noise = Noise::new(1, 0);
        let found = EXACT.measure(&world, TruePose::default(), 0.0, &mut noise);
        assert_eq!(found, None);
    }

    #[test]
    fn bias_and_noise_by_range_and_incidence_are_as_they_are_set() {
        let spread = |ranging: Ranging, bearing: f64, away: f64| {
            let mut world = World::default();
            world.line([away, -90.0], [away, 90.0]);
            let mut noise = Noise::new(1, 0);
            let all: Vec<f64> = (0..4000)
                .filter_map(|_| ranging.measure(&world, TruePose::default(), bearing, &mut noise))
                .map(|mm| mm / 1000.0 - away / libm::cos(bearing))
                .collect();
            let mean = all.iter().sum::<f64>() / all.len() as f64;
            let square = all.iter().map(|e| (e - mean) * (e - mean)).sum::<f64>();
            (mean, libm::sqrt(square / all.len() as f64))
        };
        let usual = Ranging::DEFAULT;
        let (mean, _) = spread(
            Ranging {
                bias: 0.03,
                ..usual
            },
            0.0,
            2.0,
        );
        assert!((mean - 0.03).abs() < 0.001, "{mean}");
        let far = Ranging {
            sigma_share: 0.01,
            ..usual
        };
        let (_, sigma) = spread(far, 0.0, 8.0);
        // 1 cm and 8 cm together.
        assert!((sigma - 0.0806).abs() < 0.004, "{sigma}");
        let grazing = Ranging {
            grazing: 1.0,
            ..usual
        };
        let (_, sigma) = spread(grazing, core::f64::consts::FRAC_PI_3, 2.0);
        // At 60° the inverse cosine is 2.
        assert!((sigma - 0.02).abs() < 0.001, "{sigma}");
    }

    #[test]
    fn a_wide_beam_measures_between_the_faces_of_an_edge() {
        let mut world = World::default();
        world.line([2.0, -5.0], [2.0, 0.0]);
        world.line([4.0, -5.0], [4.0, 5.0]);
        let wide = Ranging {
            width: 0.006,
            ..EXACT
        };
        let mut noise = Noise::new(1, 0);
        let mut at = |ranging: &Ranging, bearing: f64| {
            let mm = ranging.measure(&world, TruePose::default(), bearing, &mut noise);
            mm.map_or(0.0, |mm| mm / 1000.0)
        };
        let mixed: Vec<f64> = (0..500).map(|_| at(&wide, 0.0)).collect();
        assert!(mixed.iter().all(|range| (2.0..4.0).contains(range)));
        let mean = mixed.iter().sum::<f64>() / 500.0;
        assert!((mean - 3.0).abs() < 0.1, "{mean}");
        // Beside the edge, and with a thin beam, there is no mixture.
        assert!((at(&wide, -0.02) - 2.0).abs() < 0.01);
        assert!((at(&wide, 0.02) - 4.0).abs() < 0.01);
        assert!((at(&EXACT, -1e-6) - 2.0).abs() < 0.01);
    }
}
