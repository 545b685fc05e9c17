//! Candidates for the pose, and how each has fitted so far.

use crate::{geometry::Pose, math};

/// Most candidates.
pub const MOST: usize = 32;

/// One candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// The lidar's pose in the map.
    pub pose: Pose,
    /// Sum of the qualities of its scans.
    pub sum: f32,
    /// Of the last scan.
    pub last: f32,
    /// Scans weighed.
    pub scans: u8,
}

impl Hypothesis {
    /// Mean quality over its scans.
    #[must_use]
    pub fn mean(&self) -> f32 {
        self.sum / f32::from(self.scans.max(1))
    }
}

/// Candidates in descending order of their sums. 24 bytes each.
#[derive(Debug, Clone)]
pub struct Hypotheses {
    list: heapless::Vec<Hypothesis, MOST>,
}

impl Hypotheses {
    pub(crate) const fn new() -> Self {
        Self {
            list: heapless::Vec::new(),
        }
    }

    pub(crate) fn clear(&mut self) {
        self.list.clear();
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    pub(crate) fn len(&self) -> usize {
        self.list.len()
    }

    /// The best one.
    pub(crate) fn best(&self) -> Option<Hypothesis> {
        self.list.first().copied()
    }

    /// The candidates, best first.
    pub(crate) fn as_slice(&self) -> &[Hypothesis] {
        &self.list
    }

    /// Keeps a candidate if it is among the best and no better one is within `metres` and `radians` of it.
    pub(crate) fn offer(&mut self, new: Hypothesis, metres: f32, radians: f32) {
        let twin = |old: &Hypothesis| alike(old.pose, new.pose, metres, radians);
        if self.list.iter().any(|old| twin(old) && old.sum >= new.sum) {
            return;
        }
        self.list.retain(|old| !twin(old));
        if self.list.is_full() {
            if self.worst() >= new.sum {
                return;
            }
            self.list.pop();
        }
        if self.list.push(new).is_err() {
            return;
        }
        // From the end to its place: behind all that are at least as good.
        let mut rest = self.list.as_mut_slice();
        while let [.., before, last] = rest {
            if before.sum >= last.sum {
                break;
            }
            core::mem::swap(before, last);
            let shorter = rest.len() - 1;
            rest = rest.get_mut(..shorter).unwrap_or_default();
        }
    }

    /// What a candidate must exceed to be kept.
    pub(crate) fn worst(&self) -> f32 {
        match self.list.last() {
            Some(last) if self.list.is_full() => last.sum,
            _ => f32::NEG_INFINITY,
        }
    }

    /// Moves all along.
    pub(crate) fn moved(&mut self, motion: Pose) {
        for one in &mut self.list {
            one.pose = one.pose * motion;
        }
    }

    /// Gives each candidate its pose and quality by the next scan; joins those that have met, and drops the hopeless.
    pub(crate) fn weigh(&mut self, mut look: impl FnMut(Pose) -> (Pose, f32)) {
        let mut old = heapless::Vec::<Hypothesis, MOST>::new();
        core::mem::swap(&mut old, &mut self.list);
        for one in old {
            let (pose, quality) = look(one.pose);
            let weighed = Hypothesis {
                pose,
                sum: one.sum + quality,
                last: quality,
                scans: one.scans.saturating_add(1),
            };
            self.offer(weighed, 0.3, 0.2);
        }
        let Some(best) = self.best() else { return };
        // Half a scan's quality a scan behind: it will not catch up.
        self.list
            .retain(|one| one.sum > best.sum - 0.35 * f32::from(best.scans));
    }

    /// How far the best is ahead of the next, summed over the scans; infinite where there is no next.
    pub(crate) fn margin(&self) -> f32 {
        match self.list.as_slice() {
            [first, second, ..] => first.sum - second.sum,
            _ => f32::INFINITY,
        }
    }
}

/// Whether two poses are the same place: within `metres` and `radians`.
pub(super) fn alike(a: Pose, b: Pose, metres: f32, radians: f32) -> bool {
    let (x, y) = (b.x - a.x, b.y - a.y);
    x * x + y * y <= metres * metres && math::abs(math::wrap_angle(b.theta - a.theta)) <= radians
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f32, sum: f32) -> Hypothesis {
        Hypothesis {
            pose: Pose::new(x, 0.0, 0.0),
            sum,
            last: sum,
            scans: 1,
        }
    }

    #[test]
    fn the_best_of_each_place_is_kept_in_order() {
        let mut all = Hypotheses::new();
        for one in [at(0.0, 0.5), at(5.0, 0.7), at(0.1, 0.6), at(0.05, 0.4)] {
            all.offer(one, 0.3, 0.2);
        }
        let kept: heapless::Vec<(f32, f32), MOST> =
            all.as_slice().iter().map(|h| (h.pose.x, h.sum)).collect();
        assert_eq!(kept.as_slice(), [(5.0, 0.7), (0.1, 0.6)]);
        assert!((all.margin() - 0.1).abs() < 1e-6);
        for k in 0..2 * MOST {
            all.offer(at(10.0 + k as f32, 0.3 + 0.001 * k as f32), 0.3, 0.2);
        }
        assert_eq!(all.len(), MOST);
        assert!(all.worst() > 0.3);
        all.weigh(|pose| {
            (
                Pose::new(0.0, 0.0, 0.0),
                if pose.x == 5.0 { 0.9 } else { 0.1 },
            )
        });
        assert_eq!(all.len(), 1, "they have all met");
        assert_eq!(all.margin(), f32::INFINITY);
    }
}
