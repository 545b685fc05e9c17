//! Places that look like the one at hand, wherever they are: for a robot that was carried.
//!
//! The outline of a scan, 64 directions of ranges by their logarithms, is laid over that of every keyframe of another submap
//! in every rotation. What fits best is matched; the outline alone decides nothing.

use heapless::Vec;

use super::{
    Slam,
    graph::Slot,
    loops::Candidate,
    task::{Recognition, Work},
};
use crate::{geometry::Pose, scan::ScanPoint};

/// Directions of an outline.
const DIRECTIONS: usize = 64;
/// Directions that both outlines must have: a scan of 180° has 32.
const FEWEST: u32 = 24;
/// Two ranges differ by this at most: an octave. What is hidden or has moved counts no more.
const MOST: u8 = 16;
/// Keyframes whose outlines are compared in one piece of work.
const AT_ONCE: Slot = 8;
/// Of keyframes nearer to each other (m) only the likeliest is matched.
const APART: f32 = 1.5;

/// What a scan shows in each direction: the logarithm of the nearest range in sixteenths of an octave, 0 for none.
#[derive(Debug, Clone, Copy)]
struct Outline([u8; DIRECTIONS]);

impl Outline {
    fn of(points: &[ScanPoint]) -> Self {
        let mut outline = [0; DIRECTIONS];
        for point in points {
            let value = logarithm(point.range);
            if let Some(entry) = outline.get_mut(usize::from(point.bearing.0 >> 10))
                && (*entry == 0 || value < *entry)
            {
                *entry = value;
            }
        }
        Self(outline)
    }

    /// By how much this outline, turned by the rotation that fits best, differs from another one (256ths of a sixteenth of an
    /// octave), and that rotation in directions. `None` where they have too little in common.
    fn compare(&self, other: &Self) -> Option<(u32, u8)> {
        let mut best: Option<(u32, u8)> = None;
        for turn in 0..DIRECTIONS {
            let Some((before, after)) = other.0.split_at_checked(turn) else {
                continue;
            };
            let (mut sum, mut count) = (0u32, 0u32);
            for (&a, &b) in self.0.iter().zip(after.iter().chain(before)) {
                if a > 0 && b > 0 {
                    sum += u32::from(a.abs_diff(b).min(MOST));
                    count += 1;
                }
            }
            if count < FEWEST {
                continue;
            }
            let difference = (256 * sum).checked_div(count).unwrap_or(u32::MAX);
            if best.is_none_or(|(least, _)| difference < least) {
                best = Some((difference, turn as u8));
            }
        }
        best
    }
}

/// Logarithm of a range (mm) in sixteenths of an octave, from 1 on.
const fn logarithm(range: u16) -> u8 {
    let range = if range == 0 { 1 } else { range as u32 };
    let octave = range.ilog2();
    // The fraction by its first four bits: off by less than a sixteenth and a half.
    let fraction = ((range << 4) >> octave) & 15;
    let sixteenths = 16 * octave + fraction;
    if sixteenths < 255 {
        sixteenths as u8 + 1
    } else {
        u8::MAX
    }
}

impl<const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>
    Slam<K, E, L, B, V>
{
    /// A search for the newest keyframe's place, if there is another submap and it was not searched so far.
    pub(super) fn recognition(&mut self) -> Option<Recognition> {
        let last = self.last?;
        let own = self.graph.node(last.slot)?.submap;
        let is_alone = self.graph.nodes().all(|(_, node)| node.submap == own);
        if is_alone || self.searched == Some(last.id) {
            return None;
        }
        self.searched = Some(last.id);
        Some(Recognition {
            slot: last.slot,
            next: 0,
            best: Vec::new(),
        })
    }

    /// Compares some keyframes; at the end the likeliest are to be matched.
    pub(super) fn recognize(&mut self, mut search: Recognition) -> Work {
        let Some(scan) = self.scans.get(usize::from(search.slot)) else {
            return Work::Idle;
        };
        scan.unpack(&mut self.own);
        let outline = Outline::of(&self.own);
        for slot in search.next..search.next.saturating_add(AT_ONCE) {
            self.compare(&mut search, slot, &outline);
        }
        search.next = search.next.saturating_add(AT_ONCE);
        if usize::from(search.next) < K {
            return Work::Recognize(search);
        }
        let mut candidates = Vec::new();
        for (_, slot, turn) in search.best.iter().rev() {
            let theta = f32::from(*turn) * (core::f32::consts::TAU / DIRECTIONS as f32);
            // As many as there is room for.
            let _ = candidates.push(Candidate {
                slot: *slot,
                guess: Pose::new(0.0, 0.0, theta),
                variance: (f32::INFINITY, f32::INFINITY),
            });
        }
        Work::meet(search.slot, candidates)
    }

    fn compare(&mut self, search: &mut Recognition, slot: Slot, outline: &Outline) {
        let Some((node, scan)) = self.graph.node(slot).zip(self.scans.get(usize::from(slot)))
        else {
            return;
        };
        if self.graph.are_in_one(slot, search.slot) {
            return;
        }
        scan.unpack(&mut self.other);
        let Some((difference, turn)) = outline.compare(&Outline::of(&self.other)) else {
            return;
        };
        let (graph, best) = (&self.graph, &mut search.best);
        let near = |other: Slot| {
            let other = graph.node(other);
            other.is_some_and(|other| {
                other.submap == node.submap && other.pose.between(node.pose).distance() < APART
            })
        };
        if best
            .iter()
            .any(|&(least, other, _)| least <= difference && near(other))
        {
            return;
        }
        best.retain(|&(_, other, _)| !near(other));
        let found = (difference, slot, turn);
        if best.push(found).is_err()
            && let Some(worst) = best.last_mut()
            && difference < worst.0
        {
            *worst = found;
        }
        for k in (1..best.len()).rev() {
            if let Some([a, b]) = best.get_mut(k - 1..=k)
                && b.0 < a.0
            {
                core::mem::swap(a, b);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::Bearing;

    #[test]
    fn an_outline_is_found_again_in_its_rotation() {
        let scan = |turn: u16| -> Vec<ScanPoint, 256> {
            let point = |k: u16| {
                let range = 1000 + 37 * ((k * k) % 101);
                ScanPoint::at(Bearing((k << 8).wrapping_add(turn)), range)
            };
            (0..256).map(point).collect()
        };
        let here = Outline::of(&scan(0));
        for turns in [0, 1, 17, 63u8] {
            let there = Outline::of(&scan(u16::from(turns) << 10));
            assert_eq!(here.compare(&there), Some((0, turns)));
        }
    }

    #[test]
    fn logarithms_rise_by_a_sixteenth_of_an_octave() {
        assert_eq!(logarithm(0), 1);
        assert_eq!(logarithm(2000) - logarithm(1000), 16);
        assert_eq!(logarithm(32_767), 16 * 14 + 16);
        assert_eq!(logarithm(u16::MAX), u8::MAX);
        let values: Vec<u8, 64> = (0..64).map(|k| logarithm(1000 + 16 * k)).collect();
        assert!(values.windows(2).all(|pair| pair[1] >= pair[0]));
    }
}
