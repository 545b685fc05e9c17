//! When a scan becomes a keyframe, and the edge that joins it to the one before.

use super::{
    Last, Placed, Slam,
    graph::{Edge, Kind, Node, Slot},
    growth::growth,
    pruning,
    store::PackedScan,
    task::Work,
};
use crate::{
    geometry::Pose,
    linalg::{Covariance, Information, Sym3},
    math,
    scan::ScanPoint,
};

/// Fewest points of a keyframe: what a match needs.
pub(super) const MIN_POINTS: usize = 30;
/// Odometry whose variance of the heading grows by more (rad²) from one scan to the next has given up its keyframe: the robot may be
/// anywhere.
pub(super) const CARRIED: f32 = 1.0;
/// What is known of a motion that nobody measured: 10 m and 180°.
const NOTHING: Covariance = Covariance(Sym3::diagonal(100.0, 100.0, 10.0));
/// No robot drives farther between two keyframes (m).
const FARTHEST: f32 = 32.0;

impl<const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>
    Slam<K, E, L, B, V>
{
    /// Takes a scan's points, seen from `robot_from_lidar` on a robot that odometry says is at `robot`, with the covariance
    /// that it tells of this pose since the start: how much that grows between two keyframes is how far off the motion between them may
    /// be, so that errors which the next scan undoes do not belong there. Says in which keyframe's frame the lidar is.
    ///
    /// `None` for a pose that is not finite, and as long as there is no keyframe, of the place to which the robot was
    /// carried either. Takes no time but for a keyframe.
    pub fn update(
        &mut self,
        robot: Pose,
        covariance: &Covariance,
        robot_from_lidar: Pose,
        points: &[ScanPoint],
    ) -> Option<Placed> {
        let odometry = robot * robot_from_lidar;
        let covariance = &covariance.transported(odometry.x - robot.x, odometry.y - robot.y);
        if !odometry.is_finite() {
            return None;
        }
        let Sym3 { tt, .. } = covariance.0;
        self.adrift |= self.last.is_some() && tt - self.heading_variance > CARRIED;
        self.heading_variance = tt;
        let Some(last) = self.last else {
            if points.len() < MIN_POINTS {
                return None;
            }
            let slot = match self.newest() {
                None => self.keep(odometry, 0, points)?,
                Some(newest) => self.keep_again(newest, points)?,
            };
            return self.now_at(slot, odometry, covariance);
        };
        let motion = last.odometry.between(odometry);
        self.adrift |= !(motion.distance() < FARTHEST);
        if self.adrift {
            return self.begin(&last, odometry, covariance, points);
        }
        let here = Placed {
            keyframe: last.id,
            motion,
        };
        let near = motion.distance() < self.config.keyframe_distance
            && math::abs(motion.theta) < self.config.keyframe_rotation;
        if near || points.len() < MIN_POINTS {
            return Some(here);
        }
        let kept = self.keep_next(&last, odometry, covariance, points);
        if kept.is_none() {
            self.counters.no_room = self.counters.no_room.wrapping_add(1);
        }
        kept.or(Some(here))
    }

    /// Begins a submap: the robot was carried. Its poses follow on those of before, and tell nothing of where it is to them.
    fn begin(
        &mut self,
        last: &Last,
        odometry: Pose,
        covariance: &Covariance,
        points: &[ScanPoint],
    ) -> Option<Placed> {
        if points.len() < MIN_POINTS {
            return None;
        }
        self.drop_lone(last.slot);
        let kept = self.keep_apart(last, odometry, points);
        let Some(slot) = kept else {
            self.counters.no_room = self.counters.no_room.wrapping_add(1);
            return None;
        };
        self.adrift = false;
        self.counters.carried = self.counters.carried.wrapping_add(1);
        self.now_at(slot, odometry, covariance)
    }

    /// Keeps the first keyframe of a submap, with a gap before it; `None`, and nothing done, where there is no room.
    fn keep_apart(&mut self, last: &Last, odometry: Pose, points: &[ScanPoint]) -> Option<Slot> {
        if self.graph.edges_are_full() || self.fresh.is_full() {
            return None;
        }
        let before = self.newest()?;
        let submap = self.graph.free_submap()?;
        let motion = Some(last.odometry.between(odometry));
        let motion = motion.filter(|motion| motion.distance() < FARTHEST);
        let motion = motion.unwrap_or_default();
        let pose = self.graph.pose(before)? * motion;
        let slot = self.keep(pose, submap, points)?;
        let gap = Edge {
            from: before,
            to: slot,
            kind: Kind::Gap,
            motion,
            information: NOTHING.information()?,
        };
        // There was room.
        let _ = self.graph.join(gap);
        let _ = self.fresh.push_back(slot);
        Some(slot)
    }

    /// Removes a keyframe that is alone in its submap: one that was made while the robot was carried.
    fn drop_lone(&mut self, slot: Slot) {
        let with_it = |other| self.graph.are_in_one(slot, other);
        let lone = self
            .graph
            .nodes()
            .filter(|(other, _)| with_it(*other))
            .count()
            == 1;
        if !lone || self.graph.len() < 2 {
            return;
        }
        self.graph.remove(slot);
        self.pending.forget(slot);
        let mut fresh = core::mem::take(&mut self.fresh);
        while let Some(waiting) = fresh.pop_front() {
            if waiting != slot {
                // As many as before at most.
                let _ = self.fresh.push_back(waiting);
            }
        }
        // What is under way may be about it; another keyframe is to take its slot.
        if !matches!(self.work, Work::Solve) {
            self.work = Work::Idle;
        }
        self.solver.restart();
    }

    /// The newest keyframe.
    fn newest(&self) -> Option<Slot> {
        let newest = self.graph.nodes().max_by_key(|(_, node)| node.id);
        newest.map(|(slot, _)| slot)
    }

    /// Keeps the first keyframe after a map was loaded, about where the newest one is.
    fn keep_again(&mut self, newest: Slot, points: &[ScanPoint]) -> Option<Slot> {
        /// How far off the robot may have been put (m, rad).
        const PUT: (f32, f32) = (1.0, 0.5);
        if self.graph.edges_are_full() {
            return None;
        }
        let Node { pose, submap, .. } = *self.graph.node(newest)?;
        let slot = self.keep(pose, submap, points)?;
        let (far, turned) = (PUT.0 * PUT.0, PUT.1 * PUT.1);
        let about = Covariance(Sym3::diagonal(far, far, turned));
        let edge = Edge {
            from: newest,
            to: slot,
            kind: Kind::Chain,
            motion: Pose::IDENTITY,
            information: about.information()?,
        };
        // There was room, and it is the first one that waits.
        let _ = self.graph.join(edge);
        let _ = self.fresh.push_back(slot);
        Some(slot)
    }

    /// Keeps a keyframe with the edge to it from the last one; `None`, and nothing done, where there is no room.
    fn keep_next(
        &mut self,
        last: &Last,
        odometry: Pose,
        covariance: &Covariance,
        points: &[ScanPoint],
    ) -> Option<Placed> {
        if self.graph.edges_are_full() || self.fresh.is_full() {
            return None;
        }
        let (motion, information) = self.told(last, odometry, covariance)?;
        let Node { pose, submap, .. } = *self.graph.node(last.slot)?;
        let slot = self.keep(pose * motion, submap, points)?;
        let edge = Edge {
            from: last.slot,
            to: slot,
            kind: Kind::Chain,
            motion,
            information,
        };
        if self.graph.join(edge).is_err() {
            self.graph.remove(slot);
            return None;
        }
        // There was room.
        let _ = self.fresh.push_back(slot);
        self.now_at(slot, odometry, covariance)
    }

    /// What odometry tells of the motion since the last keyframe, in that one's frame: by how much its covariance grew, and
    /// what no odometry knows of itself.
    ///
    /// One that tells nonsense is taken for one that tells nothing, to 10 m and 180°.
    fn told(
        &self,
        last: &Last,
        odometry: Pose,
        covariance: &Covariance,
    ) -> Option<(Pose, Information)> {
        let motion = last.odometry.between(odometry);
        let (far, turned) = (
            self.config.min_chain_sigma,
            self.config.min_chain_heading_sigma,
        );
        let least = Covariance(Sym3::diagonal(far * far, far * far, turned * turned));
        // Where it is negative by less than the least error, the sum with that would tell of a motion known to fractions of a
        // millimetre.
        let half = Covariance(least.0.scaled(0.5));
        let before = (last.odometry, &last.covariance);
        let now = (odometry, covariance);
        let [grown, axes] = growth(before, now, -last.odometry.theta, &half);
        let information = [grown.plus(&least), axes.plus(&least), NOTHING]
            .iter()
            .filter_map(Covariance::information)
            .find(|information| information.covariance().is_some())?;
        Some((motion, information))
    }

    fn now_at(&mut self, slot: Slot, odometry: Pose, covariance: &Covariance) -> Option<Placed> {
        let id = self.graph.node(slot)?.id;
        self.last = Some(Last {
            slot,
            id,
            odometry,
            covariance: *covariance,
        });
        Some(Placed {
            keyframe: id,
            motion: Pose::IDENTITY,
        })
    }

    fn keep(&mut self, pose: Pose, submap: u8, points: &[ScanPoint]) -> Option<Slot> {
        let slot = self.graph.add(pose, submap)?;
        *self.scans.get_mut(usize::from(slot))? = PackedScan::new(points);
        // Those around it are worth less from now on, and stay: it is this one that tells little where they told it all.
        *self.worth.get_mut(usize::from(slot))? = pruning::UNWEIGHED;
        self.counters.keyframes = self.counters.keyframes.wrapping_add(1);
        self.quiet = 0;
        self.stuck = false;
        // The sums under way lack the new node.
        self.solver.restart();
        Some(slot)
    }
}
