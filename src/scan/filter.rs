//! Beams that are better not believed: out of range, too weak, between two surfaces, alone.
//!
//! A removed beam stays in its place as [`NoReturn::Filtered`], so that neither order nor times change.

use super::{NoReturn, Range, Scan, Stored};
use crate::{
    config::{self, ConfigError},
    math,
};

/// What to remove. The default removes nothing but shadow points.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FilterConfig {
    /// Shorter ranges are removed (m). Default 0; a robot's own parts are a reason for more.
    pub min_range: f32,
    /// Longer ranges are removed (m). Default 65.279: none.
    pub max_range: f32,
    /// Least quality, in the unit of the beams. Default 0; what counts as weak differs from sensor to sensor.
    pub min_quality: u8,
    /// A point is a shadow if it lies on a line with both neighbours that is steeper to the beam than this (cotangent
    /// of the angle between them); 0 keeps all. Default 5.67, an angle of 10°: at an edge, a beam that meets both
    /// surfaces measures something between; a wall seen so flatly is lost, too.
    pub min_shadow_slope: f32,
    /// A point is alone if none of its four nearest neighbours is this near in range (m); 0 keeps all. Default 0:
    /// thin chair legs are alone as well.
    pub max_neighbour_gap: f32,
}

impl FilterConfig {
    /// Shadow points only.
    pub const DEFAULT: Self = Self {
        min_range: 0.0,
        max_range: 65.279,
        min_quality: 0,
        min_shadow_slope: 5.67,
        max_neighbour_gap: 0.0,
    };

    /// The same, if every setting is within its range; usable in a `const`.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is not.
    pub const fn checked(self) -> Result<Self, ConfigError> {
        let checks = [
            config::within("min_range", self.min_range, 0.0, 65.279),
            config::within("max_range", self.max_range, self.min_range, 65.279),
            config::within("min_shadow_slope", self.min_shadow_slope, 0.0, 1000.0),
            config::within("max_neighbour_gap", self.max_neighbour_gap, 0.0, 65.0),
        ];
        match config::all(&checks) {
            Ok(()) => Ok(self),
            Err(error) => Err(error),
        }
    }
}

impl Default for FilterConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// How many beams were removed, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Removed {
    /// Too near or too far.
    pub range: u16,
    /// Too weak.
    pub quality: u16,
    /// Between two surfaces.
    pub shadow: u16,
    /// Without neighbours.
    pub alone: u16,
}

impl<const N: usize> Scan<N> {
    /// Removes what `config` says; about 40 instructions a beam.
    pub fn filter(&mut self, config: &FilterConfig) -> Removed {
        filter(&mut self.beams, config)
    }
}

fn filter(beams: &mut [Stored], config: &FilterConfig) -> Removed {
    let mut removed = Removed::default();
    let (min_mm, max_mm) = (math::to_mm(config.min_range), math::to_mm(config.max_range));
    let gap_mm = math::to_mm(config.max_neighbour_gap);
    for beam in beams.iter_mut() {
        let Ok(mm) = beam.range.mm() else { continue };
        if mm < min_mm || mm > max_mm {
            removed.range += 1;
        } else if beam.quality < config.min_quality {
            removed.quality += 1;
        } else {
            continue;
        }
        beam.range = Range::none(NoReturn::Filtered);
    }
    // Neighbours are judged by what they were, so decisions lag behind by the two beams that still look back.
    // 2π/65536 in Q22 times the slope in Q6.
    let slope_q28 = math::min(config.min_shadow_slope * 64.0, 64_000.0) as u32 * 402;
    let mut before = [Place::NONE; 2];
    for k in 0..beams.len() {
        let at = |k: usize| beams.get(k).map_or(Place::NONE, Place::of);
        let (this, after) = (at(k), [at(k + 1), at(k + 2)]);
        if this.mm != 0 {
            let [previous, earlier] = before;
            let [next, later] = after;
            let is_shadow = slope_q28 != 0
                && (previous.mm < this.mm) == (this.mm < next.mm)
                && this.is_steep_to(previous, slope_q28)
                && this.is_steep_to(next, slope_q28);
            let is_alone = gap_mm != 0
                && ![previous, earlier, next, later]
                    .iter()
                    .any(|other| other.mm != 0 && other.mm.abs_diff(this.mm) <= gap_mm);
            removed.shadow += u16::from(is_shadow);
            removed.alone += u16::from(is_alone && !is_shadow);
            if let Some(beam) = beams.get_mut(k).filter(|_| is_shadow || is_alone) {
                beam.range = Range::none(NoReturn::Filtered);
            }
        }
        let [previous, _] = before;
        before = [this, previous];
    }
    removed
}

/// Where a beam ended: 0 mm for nowhere.
#[derive(Debug, Clone, Copy)]
struct Place {
    mm: u16,
    bearing: u16,
}

impl Place {
    const NONE: Self = Self { mm: 0, bearing: 0 };

    fn of(beam: &Stored) -> Self {
        Self {
            mm: beam.range.mm().unwrap_or(0),
            bearing: beam.bearing.0,
        }
    }

    /// Whether the line to `other` is steeper to the beam than `slope_q28`, per bearing step.
    fn is_steep_to(self, other: Self, slope_q28: u32) -> bool {
        if other.mm == 0 {
            return false;
        }
        let step = (self.bearing.wrapping_sub(other.bearing) as i16).unsigned_abs();
        let nearer = self.mm.min(other.mm);
        // How far apart the two would be side by side, times the slope. (A twin of `surface::across_mm`, at any slope in
        // fractions and any angle, which 32 bits do not hold.)
        let aside = (u64::from(nearer) * u64::from(step) * u64::from(slope_q28)) >> 28;
        u64::from(self.mm.abs_diff(other.mm)) > aside
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{Beam, Bearing};

    /// Beams a degree apart.
    fn scan(ranges: &[u16]) -> Scan<16> {
        let mut scan = Scan::new();
        for (k, &mm) in ranges.iter().enumerate() {
            let beam = Beam {
                bearing: Bearing(182 * k as u16),
                range: Range::from_mm(mm.into()),
                time_us: 0,
                quality: k as u8,
            };
            scan.push(beam).expect("room");
        }
        scan
    }

    fn kept(scan: &Scan<16>) -> heapless::Vec<u16, 16> {
        scan.beams()
            .map(|beam| beam.range.mm().unwrap_or(0))
            .collect()
    }

    const ALL: FilterConfig = FilterConfig {
        min_shadow_slope: 0.0,
        ..FilterConfig::DEFAULT
    };

    #[test]
    fn near_far_and_weak_beams_go() {
        let mut scan = scan(&[50, 1000, 0, 9000, 1000, 1000]);
        let config = FilterConfig {
            min_range: 0.1,
            max_range: 8.0,
            min_quality: 2,
            ..ALL
        };
        let removed = scan.filter(&config);
        assert_eq!((removed.range, removed.quality, removed.shadow), (2, 1, 0));
        assert_eq!(kept(&scan), [0, 0, 0, 0, 1000, 1000]);
    }

    #[test]
    fn points_between_two_surfaces_go_and_edges_stay() {
        //                                    shadow
        let ranges = [1000, 1001, 1003, 1005, 1500, 2010, 2012, 2015];
        let mut shadowed = scan(&ranges);
        assert_eq!(shadowed.filter(&FilterConfig::DEFAULT).shadow, 1);
        assert_eq!(
            kept(&shadowed),
            [1000, 1001, 1003, 1005, 0, 2010, 2012, 2015]
        );
        let mut corner = scan(&[1000, 1001, 1003, 2010, 2012, 2015]);
        assert_eq!(corner.filter(&FilterConfig::DEFAULT), Removed::default());
        // A wall under 30° stays: 1 m away, a degree moves the point by 35 mm and changes the range by 30.
        let mut flat = scan(&[1000, 1031, 1064, 1099, 1136]);
        assert_eq!(flat.filter(&FilterConfig::DEFAULT), Removed::default());
        // A thin post in front of a wall is no shadow.
        let mut post = scan(&[3000, 3000, 1000, 3000, 3000]);
        assert_eq!(post.filter(&FilterConfig::DEFAULT), Removed::default());
    }

    #[test]
    fn points_without_neighbours_go() {
        let config = FilterConfig {
            max_neighbour_gap: 0.1,
            ..ALL
        };
        let mut scan = scan(&[3000, 3000, 1000, 3000, 0, 3050, 0, 0, 700, 0]);
        assert_eq!(scan.filter(&config).alone, 2);
        assert_eq!(kept(&scan), [3000, 3000, 0, 3000, 0, 3050, 0, 0, 0, 0]);
    }

    #[test]
    fn nothing_is_asked_of_an_empty_scan() {
        assert_eq!(scan(&[]).filter(&FilterConfig::DEFAULT), Removed::default());
    }
}
