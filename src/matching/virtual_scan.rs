//! What a lidar would see at a place, by what several scans saw elsewhere: turns scan to scan into scan to map.
//!
//! Each keyframe is projected into one polar scan; what is nearer hides what is behind (a z-buffer over bearings, as in
//! polar scan matching: Diosi and Kleeman, IJRR 2007). A surface that a keyframe saw from its other side hides, too, but
//! is no surface from here.

use heapless::Vec;

use crate::{
    geometry::Pose,
    math,
    scan::{Bearing, Points, ScanPoint, slots::Slots, surface::Gap},
};

/// The polar scan of several keyframes, in the order of bearings: what [`icp::Reference::assign`] takes.
///
/// 20·N + 8 bytes; N is best the number of beams of a turn. One arc tangent and one square root for each point of a
/// keyframe, one division for each bin between two of them.
///
/// [`icp::Reference::assign`]: crate::matching::icp::Reference::assign
#[derive(Debug, Clone)]
pub struct VirtualScan<const N: usize> {
    bins: [Bin; N],
    points: Vec<ScanPoint, N>,
}

/// What is seen in one direction: the mean of what the keyframes agree on. 12 bytes.
#[derive(Debug, Clone, Copy)]
struct Bin {
    /// Sum of the ranges (mm).
    range: u32,
    /// Sum of the bearings, counted from the bin's middle (1/65536 turn).
    bearing: i32,
    /// Number of terms; 0: nothing is seen.
    count: u8,
    /// Seen from behind.
    back: bool,
}

/// What is this near to what is seen (mm) is the same, measured again: the mean of the two, where the nearer alone would
/// be drawn towards the lidar by its noise.
const SAME: u32 = 80;

/// A point in the virtual lidar's frame.
#[derive(Debug, Clone, Copy)]
struct Seen {
    /// mm.
    x: f32,
    /// mm.
    y: f32,
    bearing: u16,
}

impl<const N: usize> VirtualScan<N> {
    /// Nothing seen.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            bins: [Bin::EMPTY; N],
            points: Vec::new(),
        }
    }

    /// The points in the order of bearings.
    #[must_use]
    pub fn as_slice(&self) -> &[ScanPoint] {
        &self.points
    }

    /// What a lidar at `at` would see by `keyframes`: points, and the pose from which they were seen in the frame of `at`.
    ///
    /// Points beyond a point's reach (32 m) are left out.
    pub fn assign<'a>(
        &mut self,
        at: Pose,
        keyframes: impl IntoIterator<Item = (&'a [ScanPoint], Pose)>,
    ) {
        self.clear();
        for (points, pose) in keyframes {
            self.add(at, points, pose);
        }
        self.finish();
    }

    /// Begins anew, for keyframes that are not all at hand at once: [`VirtualScan::add`] each, then
    /// [`VirtualScan::finish`].
    pub(crate) fn clear(&mut self) {
        self.bins.fill(Bin::EMPTY);
        self.points.clear();
    }

    /// Adds what a keyframe at `pose` saw, as seen from `at`.
    pub(crate) fn add(&mut self, at: Pose, points: &[ScanPoint], pose: Pose) {
        project(&mut self.bins, points, at.between(pose));
    }

    /// What was added so far shows at this distance in a direction (mm), if anything does.
    pub(crate) fn range(&self, bearing: Bearing) -> Option<u32> {
        self.bins
            .get(Slots::new(N).of(bearing.0))
            .filter(|bin| !bin.back)?
            .mean()
    }

    /// Makes points of what was added.
    pub(crate) fn finish(&mut self) {
        self.points.clear();
        for (k, bin) in self.bins.iter().enumerate() {
            if let Some(point) = bin.point(Slots::new(N).middle(k)) {
                // As many points as bins at most: it fits.
                let _ = self.points.push(point);
            }
        }
    }
}

impl<const N: usize> Default for VirtualScan<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// Adds a keyframe, `pose` as seen from the virtual lidar.
fn project(bins: &mut [Bin], points: &[ScanPoint], pose: Pose) {
    let (s, c) = math::sin_cos(pose.theta);
    let place = |p: &ScanPoint| {
        let (px, py) = (f32::from(p.x), f32::from(p.y));
        let (x, y) = (
            c * px - s * py + 1e3 * pose.x,
            s * px + c * py + 1e3 * pose.y,
        );
        Seen {
            x,
            y,
            bearing: math::atan2_turn(math::round_to_i32(y), math::round_to_i32(x)),
        }
    };
    // The segment before the point, if there is one: whether it faces the virtual lidar.
    let mut before: Option<(&ScanPoint, Seen, Option<bool>)> = None;
    for point in points {
        let here = place(point);
        let mut front = None;
        if let Some((last, there, last_front)) = before {
            if Gap::WALL.joins_points(last, point) {
                front = facing([last, point], [there, here]);
            }
            show(bins, there, last_front, front);
            if let Some(front) = front {
                fill(bins, there, here, front);
            }
        }
        before = Some((point, here, front));
    }
    if let Some((_, there, front)) = before {
        show(bins, there, front, None);
    }
}

/// Whether a segment is passed in the same direction by both lidars; `None` where one looks along it.
fn facing(points: [&ScanPoint; 2], seen: [Seen; 2]) -> Option<bool> {
    let turn = |[a, b]: [u16; 2]| b.wrapping_sub(a) as i16;
    let (here, there) = (
        turn(points.map(|p| p.bearing.0)),
        turn(seen.map(|p| p.bearing)),
    );
    (here != 0 && there != 0).then_some((here > 0) == (there > 0))
}

/// Enters a point between two segments: a surface if either faces the lidar, or there is none.
fn show(bins: &mut [Bin], seen: Seen, before: Option<bool>, after: Option<bool>) {
    let slots = Slots::new(bins.len());
    let at = slots.of(seen.bearing);
    let back = before != Some(true)
        && after != Some(true)
        && (before == Some(false) || after == Some(false));
    let range = math::sqrt(seen.x * seen.x + seen.y * seen.y);
    let off = seen.bearing.wrapping_sub(slots.middle(at)) as i16;
    if let Some(bin) = bins.get_mut(at) {
        bin.enter(range, off, back);
    }
}

/// Enters what lies between two points on one surface, where the bins are narrower than the keyframe's beams seem.
fn fill(bins: &mut [Bin], a: Seen, b: Seen, front: bool) {
    let (count, slots) = (bins.len(), Slots::new(bins.len()));
    let turn = b.bearing.wrapping_sub(a.bearing) as i16;
    let (first, last) = if turn > 0 { (a, b) } else { (b, a) };
    let (from, to) = (slots.of(first.bearing), slots.of(last.bearing));
    let (dx, dy) = (last.x - first.x, last.y - first.y);
    let cross = first.x * last.y - last.x * first.y;
    let between = if to >= from {
        to - from
    } else {
        to + count - from
    };
    for step in 1..between {
        let k = if from + step < count {
            from + step
        } else {
            from + step - count
        };
        let (s, c) = math::sin_cos_q15(slots.middle(k));
        // Where the ray meets the chord.
        let range = cross * 32_768.0 / (c as f32 * dy - s as f32 * dx);
        if let Some(bin) = bins.get_mut(k) {
            bin.enter(range, 0, !front);
        }
    }
}

impl Bin {
    const EMPTY: Self = Self {
        range: 0,
        bearing: 0,
        count: 0,
        back: false,
    };

    /// Mean range (mm), `None` where nothing is seen.
    fn mean(&self) -> Option<u32> {
        self.range.checked_div(u32::from(self.count))
    }

    /// Something `range` mm away, `off` the bin's middle: kept, merged or hidden.
    fn enter(&mut self, range: f32, off: i16, back: bool) {
        // The negated form refuses NaN, too.
        if !(range >= 1.0 && range <= f32::from(Points::<0>::MAX_RANGE_MM)) {
            return;
        }
        let range = math::round_to_i32(range).unsigned_abs();
        let alone = Self {
            range,
            bearing: i32::from(off),
            count: 1,
            back,
        };
        let Some(mean) = self.mean() else {
            *self = alone;
            return;
        };
        if range.abs_diff(mean) > SAME {
            if range < mean {
                *self = alone;
            }
        } else if self.back && !back {
            // The two sides of a thin wall: this one is seen.
            *self = alone;
        } else if self.back == back && self.count < u8::MAX {
            self.range += range;
            self.bearing += i32::from(off);
            self.count += 1;
        }
    }

    /// The surface seen, if it is one.
    fn point(&self, middle: u16) -> Option<ScanPoint> {
        if self.back {
            return None;
        }
        let count = u32::from(self.count);
        let range = (self.range + count / 2).checked_div(count)?;
        let off = self.bearing.checked_div(count as i32)?;
        let bearing = Bearing(middle.wrapping_add(off as u16));
        Some(ScanPoint::within(bearing, range as u16))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 360;

    fn metres(x: f32, y: f32) -> ScanPoint {
        let (x, y) = (
            math::round_to_i32(1000.0 * x),
            math::round_to_i32(1000.0 * y),
        );
        let range = math::sqrt((x * x + y * y) as f32);
        ScanPoint::at(
            Bearing(math::atan2_turn(y, x)),
            math::round_to_i32(range) as u16,
        )
    }

    /// A wall at `x` ahead, `half` to each side, a point each 2 cm, seen from (0, 0) counter-clockwise.
    fn wall(x: f32, half: f32) -> heapless::Vec<ScanPoint, 256> {
        let steps = math::round_to_i32(half / 0.02);
        let points = (-steps..=steps).map(|k| metres(x, 0.02 * k as f32));
        let points: heapless::Vec<_, 256> = points.collect();
        points
    }

    fn scan(at: Pose, keyframes: &[(&[ScanPoint], Pose)]) -> VirtualScan<N> {
        let mut scan = VirtualScan::new();
        scan.assign(at, keyframes.iter().copied());
        scan
    }

    #[test]
    fn one_keyframe_at_its_own_place_stays_as_it_is() {
        let points: [ScanPoint; N] = core::array::from_fn(|k| {
            let bearing = Bearing(Slots::new(N).middle(k));
            ScanPoint::at(bearing, 1000 + 7 * (k as u16 % 97))
        });
        for pose in [Pose::IDENTITY, Pose::new(3.0, -1.0, 2.0)] {
            let seen = scan(pose, &[(&points, pose)]);
            assert_eq!(seen.as_slice().len(), N);
            for (a, b) in seen.as_slice().iter().zip(&points) {
                // Places are whole millimetres: their bearings and ranges come back to half of one.
                let off = a.bearing.0.wrapping_sub(b.bearing.0) as i16;
                let far = a.range.abs_diff(b.range);
                assert!(off.abs() <= 8 && far <= 1, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn the_nearer_wall_hides_the_farther_one() {
        let (near, far) = (wall(2.0, 0.5), wall(3.0, 1.5));
        for order in [[&near, &far], [&far, &near]] {
            let seen = scan(
                Pose::IDENTITY,
                &order.map(|points| (points.as_slice(), Pose::IDENTITY)),
            );
            let ahead = seen.as_slice().iter().find(|p| p.bearing.0 < 100);
            assert!(ahead.is_some_and(|p| p.x.abs_diff(2000) < 3), "{ahead:?}");
            for point in seen.as_slice() {
                // The near wall ends at atan(0.5 / 2); the far one shows beside it.
                let side = f32::from(point.y).abs() / f32::from(point.x);
                let expected = if side < 0.24 { 2000 } else { 3000 };
                let edge = (0.24..0.26).contains(&side);
                assert!(edge || point.x.abs_diff(expected) < 10, "{point:?}");
            }
        }
    }

    #[test]
    fn a_wall_seen_from_behind_hides_but_is_no_surface() {
        // The keyframe stands 4 m ahead and looks back at a wall 2 m away; another sees a wall behind that.
        let (near, far) = (wall(2.0, 0.5), wall(3.0, 1.5));
        let from_behind = Pose::new(4.0, 0.0, core::f32::consts::PI);
        let seen = scan(
            Pose::IDENTITY,
            &[
                (near.as_slice(), from_behind),
                (far.as_slice(), Pose::IDENTITY),
            ],
        );
        assert!(seen.as_slice().len() > 20);
        for point in seen.as_slice() {
            let side = f32::from(point.y).abs() / f32::from(point.x);
            assert!(point.x.abs_diff(3000) < 10 && side > 0.23, "{point:?}");
        }
    }

    #[test]
    fn what_is_seen_again_is_averaged_and_not_drawn_near() {
        let walls = [1.98, 2.0, 2.02].map(|x| wall(x, 0.5));
        let seen = scan(
            Pose::IDENTITY,
            &[
                (&walls[0], Pose::IDENTITY),
                (&walls[1], Pose::IDENTITY),
                (&walls[2], Pose::IDENTITY),
            ],
        );
        for point in seen.as_slice().iter().filter(|p| p.y.abs() < 450) {
            // A wall with two points in a bin where the others have one weighs a quarter of 2 cm more; the nearest
            // alone would be 20 mm off.
            assert!(point.x.abs_diff(2000) < 8, "{point:?}");
        }
    }

    #[test]
    fn a_near_wall_is_filled_where_its_beams_were_farther_apart() {
        // Points 2 cm apart, seen from 20 cm: 5.7 degrees.
        let points = wall(2.0, 0.5);
        let seen = scan(Pose::new(1.8, 0.0, 0.0), &[(&points, Pose::IDENTITY)]);
        let ahead = seen.as_slice().iter().filter(|p| p.y.abs() < 200);
        assert!(ahead.clone().count() >= 88, "{}", ahead.clone().count());
        for point in ahead {
            assert!(point.x.abs_diff(200) < 3, "{point:?}");
        }
    }

    #[test]
    fn far_and_bad_points_are_left_out() {
        let points = [metres(20.0, 0.0), metres(20.0, 0.1)];
        assert!(
            scan(Pose::new(-20.0, 0.0, 0.0), &[(&points, Pose::IDENTITY)])
                .as_slice()
                .is_empty()
        );
        let nowhere = Pose {
            x: f32::NAN,
            y: 0.0,
            theta: 0.0,
        };
        assert!(
            scan(nowhere, &[(&points, Pose::IDENTITY)])
                .as_slice()
                .is_empty()
        );
    }
}
