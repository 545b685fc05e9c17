//! From a candidate to a loop: match, check, wait for others to confirm it.

use heapless::Vec;

use super::{
    PENDING, Slam,
    graph::{Edge, Kind, Slot},
    loops::{self, CANDIDATES, Candidate},
    store::PackedScan,
    verify,
};
use crate::{
    geometry::Pose,
    linalg::{Covariance, Sym3},
    matching::{
        Match,
        icp::projective::{IcpConfig, Search, align},
    },
};

/// Beams in the coarse passes of a search: with the usual 45 it is the longest piece of work by far, and finds no more.
const SEARCH_BEAMS: u16 = 32;
/// Matches of one place are not independent, and their errors larger than each tells by this factor (of σ²).
pub(super) const MATCH_INFLATION: f32 = 4.0;

impl<const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>
    Slam<K, E, L, B, V>
{
    /// Earlier keyframes that may see the place of `slot`, the likeliest last.
    pub(super) fn candidates(&mut self, slot: Slot) -> Vec<Candidate, CANDIDATES> {
        let scan = self.scans.get(usize::from(slot));
        let all_around = scan.is_some_and(PackedScan::sees_all_around);
        let doubt = self.config.max_drift_factor;
        self.drift.assign(&self.graph, slot, f32::INFINITY, doubt);
        let mut found = loops::candidates(&self.graph, &self.drift, slot, all_around, &self.config);
        found.reverse();
        found
    }

    /// Matches the points at hand from a guess of their pose in the candidate's frame, against what
    /// [`Slam::show`](Self::show) has shown from there; whether a loop is proposed.
    pub(super) fn meet(&mut self, slot: Slot, candidate: &Candidate, guess: Pose) -> bool {
        self.counters.tried = self.counters.tried.wrapping_add(1);
        let loose = candidate.is_loose();
        let believed = self.matched(guess, loose).filter(|found| {
            let off = candidate.guess.between(found.pose);
            verify::is_plausible(found, loose, &self.config)
                && verify::is_expected(off, candidate.variance, found)
        });
        let Some(found) = believed else {
            self.counters.refused = self.counters.refused.wrapping_add(1);
            return false;
        };
        if !candidate.is_anywhere() || self.is_likeliest(slot, found.score) {
            self.propose(slot, candidate.slot, &found, loose);
        }
        true
    }

    /// Makes what the keyframes around an earlier one see the reference, as seen from a guess of the pose of `slot` in its
    /// frame, and takes the points of `slot` to hand.
    pub(super) fn show(&mut self, slot: Slot, earlier: Slot, guess: Pose) {
        self.drift
            .assign(&self.graph, earlier, loops::WELL_KNOWN, 1.0);
        let at = self.graph.pose(earlier).unwrap_or_default() * guess;
        self.view.clear();
        for other in loops::neighbours(&self.graph, &self.drift, slot, at, &self.config) {
            let scan = self.scans.get(usize::from(other));
            if let Some((pose, scan)) = self.graph.pose(other).zip(scan) {
                scan.unpack(&mut self.other);
                self.view.add(at, &self.other, pose);
            }
        }
        self.view.finish();
        self.reference.assign(self.view.as_slice());
        if let Some(scan) = self.scans.get(usize::from(slot)) {
            scan.unpack(&mut self.own);
        }
    }

    fn matched(&self, guess: Pose, loose: bool) -> Option<Match> {
        let config = IcpConfig {
            search: if loose { Search::Global } else { Search::Local },
            coarse_beams: if loose {
                SEARCH_BEAMS
            } else {
                IcpConfig::DEFAULT.coarse_beams
            },
            ..IcpConfig::DEFAULT
        };
        let found = align(&self.reference, &self.own, Pose::IDENTITY, &config).ok()?;
        Some(Match {
            pose: guess * found.pose,
            covariance: found.covariance.rotated(guess),
            ..found
        })
    }

    /// Makes a match an edge, at once or when others confirm it.
    fn propose(&mut self, slot: Slot, earlier: Slot, found: &Match, loose: bool) {
        let (far, turned) = (
            self.config.min_loop_sigma,
            self.config.min_loop_heading_sigma,
        );
        let least = Covariance(Sym3::diagonal(far * far, far * far, turned * turned));
        let told = Covariance(found.covariance.0.scaled(MATCH_INFLATION));
        let Some(information) = told.plus(&least).information() else {
            return;
        };
        let edge = Edge {
            from: earlier,
            to: slot,
            kind: Kind::Loop,
            motion: found.pose,
            information,
        };
        if loose {
            self.pending.push(edge);
            self.counters.waited = self.counters.waited.wrapping_add(1);
            if self.graph.are_in_one(earlier, slot) {
                self.confirm(&edge);
            }
        } else {
            self.close(edge);
        }
    }

    /// Closes a new loop that waits, and those that close a cycle with it, if these are enough and more than those that do
    /// not.
    fn confirm(&mut self, new: &Edge) {
        let (mut votes, mut against) = (0u8, 0u8);
        for edge in self.pending.as_slice() {
            match verify::closes(&self.graph, new, edge, &self.config) {
                Some(true) => votes = votes.saturating_add(1),
                Some(false) => against = against.saturating_add(1),
                None => {}
            }
        }
        if votes < self.config.min_votes || votes <= against {
            return;
        }
        let mut confirmed: Vec<Edge, PENDING> = Vec::new();
        let (graph, config) = (&self.graph, &self.config);
        self.pending.retain(|edge| {
            let closes = verify::closes(graph, new, edge, config) == Some(true);
            let taken = edge == new || closes;
            if taken {
                // As many as wait at most: it fits.
                let _ = confirmed.push(*edge);
            }
            !taken
        });
        self.contradicted = true;
        for edge in &confirmed {
            self.close(*edge);
        }
    }

    pub(super) fn close(&mut self, edge: Edge) {
        // The chain must find room in any case.
        let room = self.graph.edges().len() + super::FRESH < E;
        if room && self.graph.join(edge).is_ok() {
            self.counters.loops = self.counters.loops.wrapping_add(1);
            self.changed = true;
        } else {
            self.counters.dropped = self.counters.dropped.wrapping_add(1);
        }
    }

    /// Removes some loops where there are most; whether there were any.
    pub(super) fn thin(&mut self) -> bool {
        let mut degrees = [0u16; K];
        for edge in self.graph.edges() {
            for end in [edge.from, edge.to] {
                if let Some(degree) = degrees.get_mut(usize::from(end)) {
                    *degree += 1;
                }
            }
        }
        let mut thinned = false;
        for _ in 0..E.div_ceil(64) {
            let degree = |slot: Slot| degrees.get(usize::from(slot)).copied().unwrap_or(0);
            let crowd = |edge: &&Edge| degree(edge.from).min(degree(edge.to));
            let edges = self.graph.edges().iter();
            let loops = edges.filter(|edge| edge.kind == Kind::Loop);
            let Some(most) = loops.max_by_key(crowd).copied() else {
                break;
            };
            self.graph.retain_edges(|edge| *edge != most);
            for end in [most.from, most.to] {
                if let Some(degree) = degrees.get_mut(usize::from(end)) {
                    *degree = degree.saturating_sub(1);
                }
            }
            self.counters.dropped = self.counters.dropped.wrapping_add(1);
            thinned = true;
        }
        thinned
    }
}
