//! When a scan becomes a keyframe, and the edge that joins it to the one before.

use super::{
    Last, Placed, Slam,
    graph::{Edge, Kind, Slot},
    pruning,
    store::PackedScan,
};
use crate::{
    geometry::Pose,
    linalg::{Covariance, Information, Sym3},
    math,
    scan::ScanPoint,
};

/// Fewest points of a keyframe: what a match needs.
const MIN_POINTS: usize = 30;

impl<const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>
    Slam<K, E, L, B, V>
{
    /// Takes a scan's points, seen from `robot_from_lidar` on a robot that odometry says is at `robot`, with the covariance
    /// that it tells of this pose since the start. Says in which keyframe's frame the lidar is.
    ///
    /// `None` for a pose that is not finite, and as long as there is no keyframe. Takes no time but for a keyframe.
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
        let Some(last) = self.last else {
            if points.len() < MIN_POINTS {
                return None;
            }
            let slot = match self.newest() {
                None => self.keep(odometry, points)?,
                Some(newest) => self.keep_again(newest, points)?,
            };
            return self.now_at(slot, odometry, covariance);
        };
        let motion = last.odometry.between(odometry);
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

    /// The newest keyframe of a map that was loaded.
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
        let slot = self.keep(self.graph.pose(newest)?, points)?;
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
        let pose = self.graph.pose(last.slot)? * motion;
        let slot = self.keep(pose, points)?;
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
    /// One that jumps or tells nonsense is taken for one that tells nothing, to 10 m and 180°.
    fn told(
        &self,
        last: &Last,
        odometry: Pose,
        covariance: &Covariance,
    ) -> Option<(Pose, Information)> {
        /// No robot drives farther between two scans (m).
        const FARTHEST: f32 = 32.0;
        let nothing = Covariance(Sym3::diagonal(100.0, 100.0, 10.0));
        let motion = last.odometry.between(odometry);
        if !(motion.distance() < FARTHEST) {
            return Some((Pose::IDENTITY, nothing.information()?));
        }
        let (far, turned) = (
            self.config.min_chain_sigma,
            self.config.min_chain_heading_sigma,
        );
        let least = Covariance(Sym3::diagonal(far * far, far * far, turned * turned));
        let (dx, dy) = (odometry.x - last.odometry.x, odometry.y - last.odometry.y);
        let before = last.covariance.transported(dx, dy).0.scaled(-1.0);
        let back = Pose {
            x: 0.0,
            y: 0.0,
            theta: -last.odometry.theta,
        };
        let grown = Covariance(covariance.0.plus(&before)).rotated(back);
        // A difference of two covariances need not be one. Where it is negative in some direction, even by less than the least
        // error, the sum with that would tell of a motion known to fractions of a millimetre.
        let half = Covariance(least.0.scaled(0.5));
        let is_growth = grown.plus(&half).information().is_some();
        let Sym3 { xx, yy, tt, .. } = grown.0;
        let [xx, yy, tt] = [xx, yy, tt].map(|variance| math::max(variance, 0.0));
        let axes = Covariance(Sym3::diagonal(xx, yy, tt));
        let grown = if is_growth { grown } else { axes };
        let information = [grown.plus(&least), axes.plus(&least), nothing]
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

    fn keep(&mut self, pose: Pose, points: &[ScanPoint]) -> Option<Slot> {
        let slot = self.graph.add(pose)?;
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
