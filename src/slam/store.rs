//! Keyframes as they are kept: two bytes for each of B directions.

use heapless::Vec;

use crate::scan::{Bearing, ScanPoint};

/// The points of a scan by bearing, thinned to B directions over the lidar's field of view: 2·B + 6 bytes.
///
/// A direction holds the range in 4095 steps of as many whole millimetres as the longest range needs (8 mm for 32 m), and
/// where in the direction the point lies, to a sixteenth: for B = 180 over 180°, 0.03° and at 10 m half a centimetre.
/// Neighbours that share a direction and a surface are averaged; of those on two surfaces the nearer one is kept.
#[derive(Debug, Clone, Copy)]
pub(super) struct PackedScan<const B: usize> {
    /// Bearing of the first direction's start, and of all directions together (1/65536 turn; 0 stands for a full turn).
    first: u16,
    span: u16,
    /// A step of the range (mm).
    unit: u16,
    /// Range in the upper 12 bits, 0 for none; place in the direction in the lower 4.
    cells: [u16; B],
}

/// Two points in one direction lie on one surface if their ranges differ by less (mm), or by less than a 16th: what a wall
/// at 75° of incidence changes over 1°.
const SAME: u16 = 50;

impl<const B: usize> PackedScan<B> {
    /// No points.
    pub(super) const EMPTY: Self = Self {
        first: 0,
        span: 0,
        unit: 1,
        cells: [0; B],
    };

    /// Packs the points of a scan, given in the order of measurement.
    pub(super) fn new(points: &[ScanPoint]) -> Self {
        let longest = points.iter().map(|point| point.range).max().unwrap_or(1);
        let (first, span) = field_of_view(points);
        let mut packed = Self {
            first,
            span,
            unit: longest.div_ceil(4095).max(1),
            cells: [0; B],
        };
        // Sums over the points that share a direction.
        let mut run: Option<Run> = None;
        for point in points {
            let place = packed.place(point.bearing);
            let cell = place >> 4;
            match &mut run {
                Some(run) if run.cell == cell => run.add(place, point.range),
                _ => {
                    packed.write(run);
                    run = Some(Run::new(place, point.range));
                }
            }
        }
        packed.write(run);
        packed
    }

    /// The points in the order of bearings, in place of those in `points`.
    pub(super) fn unpack(&self, points: &mut Vec<ScanPoint, B>) {
        points.clear();
        let sixteenths = 16 * B.max(1) as u64;
        for (k, &cell) in (0u64..).zip(&self.cells) {
            let range = (cell >> 4) * self.unit;
            if range == 0 {
                continue;
            }
            // The middle of the sixteenth.
            let place = 2 * (16 * k + u64::from(cell & 15)) + 1;
            let off = (place * u64::from(self.width())).checked_div(2 * sixteenths);
            let bearing = self.first.wrapping_add(off.unwrap_or(0) as u16);
            // As many points as directions at most: it fits.
            let _ = points.push(ScanPoint::at(Bearing(bearing), range));
        }
    }

    /// All that it is, as words: 3 + B.
    #[cfg(feature = "embedded-storage")]
    pub(super) fn words(&self) -> impl Iterator<Item = u16> + '_ {
        let head = [self.first, self.span, self.unit];
        head.into_iter().chain(self.cells.iter().copied())
    }

    /// The same, to be set.
    #[cfg(feature = "embedded-storage")]
    pub(super) fn words_mut(&mut self) -> impl Iterator<Item = &mut u16> {
        let head = [&mut self.first, &mut self.span, &mut self.unit];
        head.into_iter().chain(&mut self.cells)
    }

    /// Whether the lidar sees all around (to within 45°).
    pub(super) const fn sees_all_around(&self) -> bool {
        self.span == 0
    }

    fn width(&self) -> u32 {
        if self.span == 0 {
            65_536
        } else {
            u32::from(self.span)
        }
    }

    /// Sixteenths of directions from the first one's start.
    fn place(&self, bearing: Bearing) -> u32 {
        let sixteenths = 16 * B as u32;
        let off = u32::from(bearing.0.wrapping_sub(self.first));
        let place = (u64::from(off) * u64::from(sixteenths)).checked_div(u64::from(self.width()));
        (place.unwrap_or(0) as u32).min(sixteenths.saturating_sub(1))
    }

    fn write(&mut self, run: Option<Run>) {
        let Some(run) = run else { return };
        let (place, range) = run.mean();
        let steps = (range + self.unit / 2).checked_div(self.unit).unwrap_or(0);
        let Some(cell) = self.cells.get_mut((place >> 4) as usize) else {
            return;
        };
        let before = *cell >> 4;
        if steps > 0 && (before == 0 || steps < before) {
            *cell = (steps.min(4095) << 4) | (place & 15) as u16;
        }
    }
}

/// Points in a row that share a direction and a surface.
#[derive(Clone, Copy)]
struct Run {
    cell: u32,
    places: u32,
    ranges: u32,
    last: u16,
    count: u32,
}

impl Run {
    fn new(place: u32, range: u16) -> Self {
        Self {
            cell: place >> 4,
            places: place,
            ranges: u32::from(range),
            last: range,
            count: 1,
        }
    }

    fn add(&mut self, place: u32, range: u16) {
        let nearer = range.min(self.last);
        if range.abs_diff(self.last) <= SAME.max(nearer / 16) {
            self.places += place;
            self.ranges += u32::from(range);
            self.last = range;
            self.count += 1;
        } else if range < self.last {
            *self = Self::new(place, range);
        }
    }

    /// Place and range (mm).
    fn mean(&self) -> (u32, u16) {
        let mean = |sum: u32| (sum + self.count / 2).checked_div(self.count).unwrap_or(0);
        (mean(self.places), mean(self.ranges) as u16)
    }
}

/// First bearing and span of what the points cover; span 0 where no gap is wider than 45°.
fn field_of_view(points: &[ScanPoint]) -> (u16, u16) {
    // A bit for each 64th of a turn in which there is a point.
    let mut seen = 0u64;
    for point in points {
        seen |= 1 << (point.bearing.0 >> 10);
    }
    // The longest run of empty ones, which may lie across bearing 0.
    let (mut longest, mut end, mut run) = (0, 0, 0);
    for k in 0..128u32 {
        run = if seen >> (k & 63) & 1 == 1 {
            0
        } else {
            run + 1
        };
        if run > longest {
            (longest, end) = (run, k & 63);
        }
    }
    if !(8..64).contains(&longest) {
        return (0, 0);
    }
    // Seen from the gap's end, the nearest and the farthest point.
    let origin = ((end + 1) << 10) as u16;
    let offs = points
        .iter()
        .map(|point| point.bearing.0.wrapping_sub(origin));
    let (nearest, farthest) = offs.fold((u16::MAX, 0), |(least, most), off| {
        (least.min(off), most.max(off))
    });
    // One more than the difference, so that the last point lies inside.
    let span = farthest.saturating_sub(nearest).saturating_add(1);
    (origin.wrapping_add(nearest), span)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(
        first: i32,
        step: f32,
        count: usize,
        range: impl Fn(usize) -> u16,
    ) -> Vec<ScanPoint, 1440> {
        let points = (0..count).map(|k| {
            let bearing = first + (k as f32 * step) as i32;
            ScanPoint::at(Bearing(bearing as u16), range(k))
        });
        points.collect()
    }

    #[test]
    fn points_come_back_to_half_a_step_and_a_32nd_of_a_direction() {
        //   first bearing, beams, step (1/65536 turn), field of view (same)
        for (first, count, step) in [
            (-16_384, 181, 182.04), // 180° in steps of 1°
            (-16_384, 361, 91.02),  // 180° in steps of 0.5°
            (0, 360, 182.04),       // a full turn
            (-24_576, 541, 91.02),  // 270°
            (20_000, 300, 100.0),   // across ±180°
        ] {
            let points = scan(first, step, count, |k| 2000 + 10 * k as u16);
            let packed = PackedScan::<180>::new(&points);
            let mut back = Vec::new();
            packed.unpack(&mut back);
            assert!(back.len() >= 175, "{first} {count}: {}", back.len());
            for point in &back {
                // The nearest one given; ranges rise by 10 mm a beam, and up to three beams were averaged.
                let near = points
                    .iter()
                    .min_by_key(|p| {
                        (p.bearing.0.wrapping_sub(point.bearing.0) as i16).unsigned_abs()
                    })
                    .expect("a point");
                assert!(near.range.abs_diff(point.range) <= 16, "{near:?} {point:?}");
                let off = near.bearing.0.wrapping_sub(point.bearing.0) as i16;
                assert!(off.unsigned_abs() <= 100, "{near:?} {point:?}");
            }
        }
    }

    #[test]
    fn one_point_for_each_direction_stays_the_same() {
        let points = scan(-16_384, 182.04, 181, |k| {
            if k % 7 == 0 { 0 } else { 500 + 13 * k as u16 }
        });
        let points: Vec<ScanPoint, 720> = points.into_iter().filter(|p| p.range > 0).collect();
        let mut back = Vec::new();
        let packed = PackedScan::<181>::new(&points);
        packed.unpack(&mut back);
        assert_eq!(back.len(), points.len());
        for (a, b) in points.iter().zip(&back) {
            let off = a.bearing.0.wrapping_sub(b.bearing.0) as i16;
            // A sixteenth of 1° is 11.4 of a 65536th turn.
            assert!(off.abs() <= 6 && a.range == b.range, "{a:?} {b:?}");
        }
    }

    #[test]
    fn the_nearer_of_two_surfaces_is_kept() {
        let points = scan(0, 45.5, 1440, |k| if k % 2 == 0 { 1000 } else { 9000 });
        let mut back = Vec::<ScanPoint, 180>::new();
        PackedScan::new(&points).unpack(&mut back);
        assert_eq!(back.len(), 180);
        assert!(back.iter().all(|p| p.range.abs_diff(1000) <= 2), "{back:?}");
    }

    #[test]
    fn nothing_and_one_point_are_no_trouble() {
        let mut back = Vec::<ScanPoint, 180>::new();
        PackedScan::new(&[]).unpack(&mut back);
        assert!(back.is_empty());
        let alone = [ScanPoint::at(Bearing(40_000), 32_000)];
        PackedScan::new(&alone).unpack(&mut back);
        assert_eq!(back.len(), 1);
        assert!(back[0].range.abs_diff(32_000) <= 8, "{back:?}");
    }
}
