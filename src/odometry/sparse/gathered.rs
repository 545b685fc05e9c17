//! The last scans of a sparse ranger, and the surfaces that they show together.

use crate::{
    geometry::Pose,
    linalg::{Covariance, Sym3},
    math,
    scan::{Bearing, Scan, ScanPoint, slots::Slots, wide},
};

/// Directions in which the scans are seen together: every 1.5°, narrower than a beam and wide enough for several places each.
pub(super) const DIRECTIONS: usize = 240;
/// Places in one direction lie on one surface if their distances differ by at most this (mm, and as a share of the distance):
/// noise of a few centimetres, and what a wall askew gains over a beam's width.
const GAP: (f32, f32) = (60.0, 0.12);
/// Places measured from nearer by than this (mm) count alike.
const NEAREST: u16 = 300;

/// Places hit in a direction, as far as they seem to lie on one surface.
#[derive(Debug, Clone, Copy)]
struct Heap {
    x: f32,
    y: f32,
    ranges: f32,
    weight: f32,
}

/// A scan that was kept: 40 + 4·N bytes.
#[derive(Debug, Clone)]
struct Kept<const N: usize> {
    /// Robot at the scan's end, and how sure that was.
    pose: Pose,
    covariance: Covariance,
    hits: heapless::Vec<(Bearing, u16), N>,
}

impl<const N: usize> Kept<N> {
    const NONE: Self = Self {
        pose: Pose::IDENTITY,
        covariance: Covariance(Sym3::diagonal(0.0, 0.0, 0.0)),
        hits: heapless::Vec::new(),
    };
}

/// The last K scans of N beams: K·(4·N + 40) bytes, and 6 KB.
#[derive(Debug, Clone)]
pub(super) struct Gathered<const N: usize, const K: usize> {
    scans: [Kept<N>; K],
    /// Where the next one goes, and how many there are.
    next: usize,
    count: usize,
    heaps: [Heap; DIRECTIONS],
    points: heapless::Vec<ScanPoint, DIRECTIONS>,
}

impl<const N: usize, const K: usize> Gathered<N, K> {
    const NO_HEAP: Heap = Heap {
        x: 0.0,
        y: 0.0,
        ranges: 0.0,
        weight: 0.0,
    };

    pub const fn new() -> Self {
        Self {
            scans: [const { Kept::NONE }; K],
            next: 0,
            count: 0,
            heaps: [Self::NO_HEAP; DIRECTIONS],
            points: heapless::Vec::new(),
        }
    }

    pub const fn len(&self) -> usize {
        self.count
    }

    /// The scans kept, the newest first.
    fn newest_first(&self) -> impl Iterator<Item = &Kept<N>> {
        newest_first(&self.scans, self.next, self.count)
    }

    /// Robot at the newest kept scan.
    pub fn newest(&self) -> Option<Pose> {
        Some(self.newest_first().next()?.pose)
    }

    /// Robot at the oldest kept scan, and how sure that was.
    pub fn oldest(&self) -> Option<(Pose, Covariance)> {
        let kept = self.newest_first().last()?;
        Some((kept.pose, kept.covariance))
    }

    /// Keeps a scan's places, in the place of the oldest.
    pub fn keep(&mut self, pose: Pose, covariance: Covariance, points: &[ScanPoint]) {
        if let Some(kept) = self.scans.get_mut(self.next) {
            (kept.pose, kept.covariance) = (pose, covariance);
            kept.hits.clear();
            for point in points {
                let _ = kept.hits.push((point.bearing, point.range));
            }
            self.next = if self.next + 1 < K { self.next + 1 } else { 0 };
            self.count = if self.count < K { self.count + 1 } else { K };
        }
    }

    /// The surfaces of all kept scans as a lidar sees them from `map_from_lidar`, counter-clockwise: a point for each direction
    /// in which something was hit, the mean of what lies there together. `robot_from_lidar` is the mount.
    pub fn seen_from(&mut self, map_from_lidar: Pose, robot_from_lidar: Pose) -> &[ScanPoint] {
        let slots = Slots::new(DIRECTIONS);
        self.heaps.fill(Self::NO_HEAP);
        for kept in newest_first(&self.scans, self.next, self.count) {
            let then = map_from_lidar.between(kept.pose * robot_from_lidar);
            let turn = Bearing::from_radians(then.theta).0;
            let at = [then.x, then.y].map(|metres| math::round_to_i32(metres * 1000.0));
            for &(bearing, range) in &kept.hits {
                let seen = ScanPoint::at(Bearing(bearing.0.wrapping_add(turn)), range);
                let (x, y) = (
                    at[0].saturating_add(seen.x.into()),
                    at[1].saturating_add(seen.y.into()),
                );
                if let Some(heap) = self.heaps.get_mut(slots.of(math::atan2_turn(y, x))) {
                    heap.add(x, y, range);
                }
            }
        }
        self.points.clear();
        for heap in &self.heaps {
            if let Some(point) = heap.mean() {
                let _ = self.points.push(point);
            }
        }
        &self.points
    }
}

/// Of scans in a ring of which the oldest is overwritten at `next`, the `count` newest, the newest first.
fn newest_first<const N: usize>(
    scans: &[Kept<N>],
    next: usize,
    count: usize,
) -> impl Iterator<Item = &Kept<N>> {
    let (late, early) = scans.split_at_checked(next).unwrap_or_default();
    late.iter().rev().chain(early.iter().rev()).take(count)
}

impl Heap {
    /// Takes a place (mm) that was `from` mm away when it was measured, if it lies with the others, or is the first.
    fn add(&mut self, x: i32, y: i32, from: u16) {
        let limit = i32::from(i16::MAX);
        if !(-limit..=limit).contains(&x) || !(-limit..=limit).contains(&y) {
            return;
        }
        let range = math::isqrt((x * x) as u32 + (y * y) as u32) as f32;
        let mean = if self.weight > 0.0 {
            self.ranges / self.weight
        } else {
            range
        };
        if math::abs(mean - range) <= GAP.0 + GAP.1 * range {
            // Range noise and a beam's width across both grow with the range.
            let weight = 1000.0 / f32::from(from.max(NEAREST));
            self.x += weight * x as f32;
            self.y += weight * y as f32;
            self.ranges += weight * range;
            self.weight += weight;
        }
    }

    fn mean(&self) -> Option<ScanPoint> {
        if self.weight <= 0.0 {
            return None;
        }
        let [x, y] = [self.x, self.y].map(|sum| math::round_to_i32(sum / self.weight));
        Some(ScanPoint {
            x: x as i16,
            y: y as i16,
            bearing: Bearing(math::atan2_turn(y, x)),
            range: math::isqrt((x * x) as u32 + (y * y) as u32) as u16,
        })
    }
}

/// The surfaces that a scan of beams `width` (1/65536 turn) wide reports, in the order of its beams; bearings run the other
/// way round for a ranger that hangs head down.
pub(super) fn places<const N: usize>(
    scan: &Scan<N>,
    width: u16,
    upside_down: bool,
    points: &mut heapless::Vec<ScanPoint, N>,
) {
    points.clear();
    let count = scan.len();
    for here in 0..count {
        // A full ring closes: the first beam's neighbour is the last.
        let beams = core::array::from_fn::<_, { wide::NEIGHBOURS }, _>(|k| {
            let from_here = k + wide::NEIGHBOURS / 2 * (count - 1);
            scan.beams().nth((here + from_here) % count)
        });
        if let Some((Bearing(bearing), range)) = wide::surface(&beams, width) {
            let bearing = if upside_down {
                bearing.wrapping_neg()
            } else {
                bearing
            };
            let _ = points.push(ScanPoint::at(Bearing(bearing), range));
        }
    }
}
