//! What the lidar sees: line segments and circles, cast exactly.

use super::noise::Noise;
use super::pose::TruePose;

/// What a face is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Surface {
    /// It scatters light back.
    #[default]
    Plain,
    /// Of ten beams four pass, four are lost, two return.
    Glass,
    /// It shows what lies before it as if it were behind it.
    Mirror,
    /// It returns little light: see [`Ranging`](super::lidar::Ranging).
    Black,
}

/// A straight wall from one point to another (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Start.
    pub from: [f64; 2],
    /// End.
    pub to: [f64; 2],
    /// What it is made of.
    pub surface: Surface,
}

/// What a beam meets first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// How far (m).
    pub range: f64,
    /// Unit normal of the face there, to either side.
    pub normal: [f64; 2],
    /// What it is made of.
    pub surface: Surface,
}

/// A round column (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Centre.
    pub centre: [f64; 2],
    /// Radius.
    pub radius: f64,
}

/// All that stands around.
#[derive(Debug, Clone, Default)]
pub struct World {
    /// Straight faces.
    pub segments: Vec<Segment>,
    /// Round ones.
    pub circles: Vec<Circle>,
}

impl World {
    /// Lower left and upper right corner of all that is there.
    #[must_use]
    pub fn extent(&self) -> ([f64; 2], [f64; 2]) {
        let ends = self
            .segments
            .iter()
            .flat_map(|s| [(s.from, 0.0), (s.to, 0.0)]);
        let round = self.circles.iter().map(|c| (c.centre, c.radius));
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for (place, radius) in ends.chain(round) {
            for k in 0..2 {
                low[k] = low[k].min(place[k] - radius);
                high[k] = high[k].max(place[k] + radius);
            }
        }
        (low, high)
    }

    /// The faces between full and free cells of a grid of (columns, rows): cells of side `cell` (m), the first one's corner at
    /// `origin`. Cells outside are free. Faces in a row are one.
    #[must_use]
    pub fn of_cells(
        (columns, rows): (usize, usize),
        cell: f64,
        origin: TruePose,
        is_full: &dyn Fn(usize, usize) -> bool,
    ) -> Self {
        let full = |x: usize, y: usize| {
            // One is added to both, so that what is left of the first is none.
            (1..=columns).contains(&x) && (1..=rows).contains(&y) && is_full(x - 1, y - 1)
        };
        let mut world = Self::default();
        let mut face = |from: [usize; 2], to: [usize; 2]| {
            let [from, to] = [from, to].map(|[x, y]| {
                let place = origin.then(TruePose::new(x as f64 * cell, y as f64 * cell, 0.0));
                [place.x, place.y]
            });
            world.line(from, to);
        };
        for (along, across, is_row) in [(columns, rows, true), (rows, columns, false)] {
            for line in 0..=across {
                let differs = |k: usize| {
                    let (here, there) = if is_row {
                        (full(k + 1, line), full(k + 1, line + 1))
                    } else {
                        (full(line, k + 1), full(line + 1, k + 1))
                    };
                    here != there
                };
                let mut k = 0;
                while k < along {
                    let begin = k;
                    while k < along && differs(k) {
                        k += 1;
                    }
                    if k > begin {
                        if is_row {
                            face([begin, line], [k, line]);
                        } else {
                            face([line, begin], [line, k]);
                        }
                    }
                    k += 1;
                }
            }
        }
        world
    }

    /// Adds all that another world holds.
    pub fn add(&mut self, other: Self) {
        self.segments.extend(other.segments);
        self.circles.extend(other.circles);
    }

    /// Adds one straight face.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2]) {
        self.face(from, to, Surface::Plain);
    }

    /// Adds one straight face of something.
    pub fn face(&mut self, from: [f64; 2], to: [f64; 2], surface: Surface) {
        self.segments.push(Segment { from, to, surface });
    }

    /// Adds the four faces of the box between two opposite corners.
    pub fn block(&mut self, low: [f64; 2], high: [f64; 2]) {
        let middle = [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
        self.turned_block(middle, [high[0] - low[0], high[1] - low[1]], 0.0);
    }

    /// Adds a box of `size` around `middle`, turned by `angle` (rad).
    pub fn turned_block(&mut self, middle: [f64; 2], size: [f64; 2], angle: f64) {
        let (s, c) = (libm::sin(angle), libm::cos(angle));
        let corner = |u: f64, v: f64| {
            let (dx, dy) = (0.5 * u * size[0], 0.5 * v * size[1]);
            [middle[0] + c * dx - s * dy, middle[1] + s * dx + c * dy]
        };
        let corners = [
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ];
        for k in 0..4 {
            self.line(corners[k], corners[(k + 1) % 4]);
        }
    }

    /// Adds a column.
    pub fn column(&mut self, centre: [f64; 2], radius: f64) {
        self.circles.push(Circle { centre, radius });
    }

    /// Adds four thin legs at the corners of a table or a chair.
    pub fn legs(&mut self, middle: [f64; 2], size: [f64; 2], radius: f64) {
        for (u, v) in [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)] {
            self.column([middle[0] + u * size[0], middle[1] + v * size[1]], radius);
        }
    }

    /// Adds `count` boxes of 0.2 to 1.2 m at random places and angles inside `low`..`high`.
    pub fn clutter(&mut self, low: [f64; 2], high: [f64; 2], count: usize, noise: &mut Noise) {
        for _ in 0..count {
            let middle = [noise.even(low[0], high[0]), noise.even(low[1], high[1])];
            let size = [noise.even(0.2, 1.2), noise.even(0.2, 1.2)];
            self.turned_block(middle, size, noise.even(0.0, core::f64::consts::PI));
        }
    }

    /// The same world in a mirror that lies along the x axis.
    #[must_use]
    pub fn mirrored(mut self) -> Self {
        for segment in &mut self.segments {
            (segment.from[1], segment.to[1]) = (-segment.from[1], -segment.to[1]);
        }
        for circle in &mut self.circles {
            circle.centre[1] = -circle.centre[1];
        }
        self
    }

    /// Distance (m) from `from` along the unit vector `towards` to the first face, if there is one.
    #[must_use]
    pub fn cast(&self, from: [f64; 2], towards: [f64; 2]) -> Option<f64> {
        let straight = self.segments.iter().filter_map(|s| s.cast(from, towards));
        let round = self.circles.iter().filter_map(|c| c.cast(from, towards));
        straight
            .chain(round)
            .reduce(|a, b| if a < b { a } else { b })
    }

    /// The first face from `from` along the unit vector `towards`, if there is one.
    #[must_use]
    pub fn hit(&self, from: [f64; 2], towards: [f64; 2]) -> Option<Hit> {
        let (mut range, mut face) = (f64::INFINITY, None);
        for segment in &self.segments {
            if let Some(next) = segment.cast(from, towards)
                && next <= range
            {
                (range, face) = (next, Some(Face::Straight(segment)));
            }
        }
        for circle in &self.circles {
            if let Some(next) = circle.cast(from, towards)
                && next <= range
            {
                (range, face) = (next, Some(Face::Round(circle)));
            }
        }
        let (across, surface) = match face? {
            Face::Straight(s) => ([s.from[1] - s.to[1], s.to[0] - s.from[0]], s.surface),
            Face::Round(c) => {
                let at = [0, 1].map(|k: usize| from[k] + range * towards[k] - c.centre[k]);
                (at, Surface::Plain)
            }
        };
        let length = libm::hypot(across[0], across[1]);
        Some(Hit {
            range,
            normal: across.map(|side| side / length),
            surface,
        })
    }

    /// Distance (m) from `place` to the nearest face; infinite in an empty world.
    #[must_use]
    pub fn clearance(&self, place: [f64; 2]) -> f64 {
        let straight = self.segments.iter().map(|s| s.distance(place));
        let round = self.circles.iter().map(|c| c.distance(place));
        straight
            .chain(round)
            .fold(f64::INFINITY, |a, b| if a < b { a } else { b })
    }
}

/// A face that a beam may meet.
enum Face<'a> {
    Straight(&'a Segment),
    Round(&'a Circle),
}

impl Segment {
    fn cast(&self, from: [f64; 2], towards: [f64; 2]) -> Option<f64> {
        let along = [self.to[0] - self.from[0], self.to[1] - self.from[1]];
        let start = [self.from[0] - from[0], self.from[1] - from[1]];
        let across = towards[0] * along[1] - towards[1] * along[0];
        // Where on the segment, times `across`: most are missed, and division costs as much as all the rest.
        let place = start[0] * towards[1] - start[1] * towards[0];
        let is_met = match across > 0.0 {
            true => (0.0..=across).contains(&place),
            false => across < 0.0 && (across..=0.0).contains(&place),
        };
        if !is_met {
            return None;
        }
        let range = (start[0] * along[1] - start[1] * along[0]) / across;
        (range > 0.0).then_some(range)
    }

    fn distance(&self, place: [f64; 2]) -> f64 {
        let along = [self.to[0] - self.from[0], self.to[1] - self.from[1]];
        let start = [place[0] - self.from[0], place[1] - self.from[1]];
        let square = along[0] * along[0] + along[1] * along[1];
        let share = ((start[0] * along[0] + start[1] * along[1]) / square).clamp(0.0, 1.0);
        let off = [start[0] - share * along[0], start[1] - share * along[1]];
        libm::sqrt(off[0] * off[0] + off[1] * off[1])
    }
}

impl Circle {
    /// Distance (m) from `from` along the unit vector `towards` to it, if it is met.
    pub(crate) fn cast(&self, from: [f64; 2], towards: [f64; 2]) -> Option<f64> {
        let to = [self.centre[0] - from[0], self.centre[1] - from[1]];
        let along = to[0] * towards[0] + to[1] * towards[1];
        let across = to[0] * towards[1] - to[1] * towards[0];
        let square = self.radius * self.radius - across * across;
        if square < 0.0 {
            return None;
        }
        let half = libm::sqrt(square);
        // From inside, the near crossing lies behind.
        [along - half, along + half]
            .into_iter()
            .find(|&range| range > 0.0)
    }

    fn distance(&self, place: [f64; 2]) -> f64 {
        let off = [place[0] - self.centre[0], place[1] - self.centre[1]];
        (libm::sqrt(off[0] * off[0] + off[1] * off[1]) - self.radius).abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_end_at_the_first_face() {
        let mut world = World::default();
        world.block([2.0, -1.0], [3.0, 1.0]);
        world.column([0.0, 5.0], 1.0);
        for (towards, expected) in [
            ([1.0, 0.0], Some(2.0)),
            ([0.0, 1.0], Some(4.0)),
            ([-1.0, 0.0], None),
            ([0.6, 0.8], None),
        ] {
            assert_eq!(world.cast([0.0, 0.0], towards), expected, "{towards:?}");
        }
        assert_eq!(
            world.cast([0.0, 5.0], [1.0, 0.0]),
            Some(1.0),
            "from inside the column"
        );
        assert_eq!(world.clearance([0.0, 0.0]), 2.0);
        assert_eq!(world.clearance([0.0, 3.5]), 0.5);
    }
}
