//! A map that rolls with the robot: what the last keyframes around it saw, as one scan, under every scan.
//!
//! Odometry drifts at each change of its keyframe. Here a scan is matched once more, against what up to [`SEEN`] keyframes
//! around it show together; so the robot that comes back to a place that is still in the window is where it was. No loop is
//! closed beyond the window, and no keyframe moves.

use heapless::Vec;

use super::{
    closing::MATCH_INFLATION,
    growth::growth,
    keeping::{CARRIED, MIN_POINTS},
    store::PackedScan,
};
use crate::{
    geometry::Pose,
    linalg::{Covariance, Sym3},
    matching::{
        Match,
        icp::projective::{IcpConfig, Reference, align},
        virtual_scan::VirtualScan,
    },
    math,
    scan::ScanPoint,
};

/// Of the odometry's keyframes one is kept where none of the window is so near (m).
const KEYFRAME_DISTANCE: f32 = 0.35;
/// A lidar that does not see all around has one keyframe kept at a place for each such angle (rad).
const KEYFRAME_ROTATION: f32 = 0.5;
/// Most keyframes that are seen as one.
const SEEN: usize = 12;
/// Keyframes farther away than this (m, a turn counted as `TURN` says) are left out of it.
const REACH: f32 = 6.0;
/// What a rotation counts in the choice of keyframes (m/rad).
const TURN: f32 = 0.5;
/// They are seen anew from where the robot is once it has moved so far (m) from where they were seen last.
const VIEW_DISTANCE: f32 = 0.3;
/// They are seen anew once the robot has turned so far (rad) since they were seen last.
const VIEW_ROTATION: f32 = 0.5;
/// Least score of a match.
const MIN_SCORE: f32 = 0.4;
/// Least share of the beams that meet what the keyframes saw.
const MIN_OVERLAP: f32 = 0.4;
/// Farthest that a match may be from where odometry leads (m; half as many radians).
const MAX_CORRECTION: f32 = 0.3;
/// How much of the way from there to the match the robot is moved: errors of a single match are halved, those of odometry are
/// gone after a few.
const GAIN: f32 = 0.5;
/// A direction that a smaller share of the beams constrains is left as odometry says.
const SHARE: f32 = 0.035;
/// The same share while something moves along with the robot, which hides up to a sixth of the view.
const COMPANION: f32 = 0.17;
/// Something moves along where one in so many points of a keyframe did.
const COMPANIONS: usize = 20;
/// For so many keyframes after it was seen last, something is taken to move along.
const COMPANY: u8 = 20;
/// The window begins anew with a keyframe after so many scans in a row that did not fit.
const MOST_UNMATCHED: u8 = 5;

/// The last K keyframes of B points, and what they show together in V directions: about `(46 + 2·B)·K + 32·V + 8·B` bytes.
#[derive(Debug, Clone)]
pub(crate) struct RollingMap<const K: usize, const B: usize, const V: usize> {
    keyframes: Vec<Kept<B>, K>,
    /// Where the next keyframe goes once the window is full: the place of the oldest.
    oldest: usize,
    view: VirtualScan<V>,
    reference: Reference<V>,
    /// Points of a keyframe at hand.
    other: Vec<ScanPoint, B>,
    /// Where the keyframes are seen from, and how far off they are there.
    at: Pose,
    known: Covariance,
    /// They are seen from there: not yet since it was decided.
    is_shown: bool,
    last: Option<Last>,
    unmatched: u8,
    /// Keyframes for which something that moved along is still expected.
    company: u8,
}

/// A keyframe.
#[derive(Debug, Clone)]
struct Kept<const B: usize> {
    /// Of the lidar.
    pose: Pose,
    covariance: Covariance,
    scan: PackedScan<B>,
}

/// The last scan: the lidar by odometry, and in the map.
#[derive(Debug, Clone, Copy)]
struct Last {
    odometry: Pose,
    told: Covariance,
    pose: Pose,
    covariance: Covariance,
    /// The odometry's keyframe: where that was by odometry, and how far off it told that to be.
    since: (Pose, Covariance),
}

/// What odometry says of a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Told {
    /// Robot at the scan's end, in the frame in which it started (m, rad).
    pub pose: Pose,
    /// Covariance of `pose` since the start (m², m·rad, rad²).
    pub covariance: Covariance,
    /// A match says so: it is not only a prediction.
    pub is_measured: bool,
    /// Later scans are matched with this one: what moves along with the robot is not among its points.
    pub is_keyframe: bool,
    /// Points that were left out of a keyframe, as they move along.
    pub companions: u16,
}

/// Where a scan is in a [`RollingMap`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rolled {
    /// Robot at the scan's end, in the frame in which it started (m, rad).
    pub pose: Pose,
    /// Covariance of `pose` since the start, in the same frame (m², m·rad, rad²).
    pub covariance: Covariance,
    /// Whether the scan fitted what the keyframes saw; else it is where odometry leads from the scan before.
    pub is_matched: bool,
}

impl<const K: usize, const B: usize, const V: usize> RollingMap<K, B, V> {
    /// Nothing seen.
    #[must_use]
    pub(crate) const fn new() -> Self {
        Self {
            keyframes: Vec::new(),
            oldest: 0,
            view: VirtualScan::new(),
            reference: Reference::new(),
            other: Vec::new(),
            at: Pose::IDENTITY,
            known: Covariance(Sym3::diagonal(0.0, 0.0, 0.0)),
            is_shown: false,
            last: None,
            unmatched: 0,
            company: 0,
        }
    }

    /// Keyframes in the window.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        self.keyframes.len()
    }

    /// Whether there is no keyframe.
    #[must_use]
    pub(crate) fn is_empty(&self) -> bool {
        self.keyframes.is_empty()
    }

    /// Takes a scan's points, seen from `robot_from_lidar` on a robot of which odometry says so much. Says where it is.
    ///
    /// Costs a match; and [`RollingMap::show`] where that was not called since it was due.
    pub(crate) fn update(
        &mut self,
        told: &Told,
        robot_from_lidar: Pose,
        points: &[ScanPoint],
    ) -> Rolled {
        let odometry = told.pose * robot_from_lidar;
        let (dx, dy) = (odometry.x - told.pose.x, odometry.y - told.pose.y);
        let covariance = told.covariance.transported(dx, dy);
        let mut now = Last {
            odometry,
            told: covariance,
            pose: odometry,
            covariance,
            since: (odometry, covariance),
        };
        if !odometry.is_finite() {
            return rolled(&now, robot_from_lidar, false);
        }
        if let Some(last) = &self.last {
            now = predicted(last, now);
            if covariance.0.tt - last.told.0.tt > CARRIED {
                self.keyframes.clear();
            }
        }
        let is_tried = told.is_measured && !self.is_empty();
        let is_matched = is_tried && self.correct(&mut now, points);
        if is_tried {
            self.unmatched = match is_matched {
                true => 0,
                false => self.unmatched.saturating_add(1),
            };
        }
        if told.is_keyframe {
            let many = usize::from(told.companions) * COMPANIONS > points.len();
            self.company = match many {
                true => COMPANY,
                false => self.company.saturating_sub(1),
            };
            now.since = (odometry, covariance);
            let is_new = self.is_empty() || told.is_measured && self.is_new(&now);
            if is_new && points.len() >= MIN_POINTS {
                self.keep(&now, points);
            }
        }
        let seen = self.at.between(now.pose);
        if seen.distance() > VIEW_DISTANCE || math::abs(seen.theta) > VIEW_ROTATION {
            self.look_from(now.pose);
        }
        self.last = Some(now);
        rolled(&now, robot_from_lidar, is_matched)
    }

    /// Sees the keyframes from where the robot is, if that is due; whether it was. Costs up to 12 keyframes' projections.
    pub(crate) fn show(&mut self) -> bool {
        if self.is_shown {
            return false;
        }
        self.is_shown = true;
        self.view.clear();
        let mut ranks: Vec<f32, K> = Vec::new();
        for kept in &self.keyframes {
            let off = self.at.between(kept.pose);
            // As many as there are keyframes: it fits.
            let _ = ranks.push(off.distance() + TURN * math::abs(off.theta));
        }
        let mut sum = Sym3::default();
        let mut count: f32 = 0.0;
        for _ in 0..SEEN {
            let Some((nearest, rank)) = ranks
                .iter_mut()
                .enumerate()
                .min_by(|(_, a), (_, b)| a.total_cmp(b))
            else {
                break;
            };
            if !(*rank <= REACH) {
                break;
            }
            *rank = f32::INFINITY;
            let Some(kept) = self.keyframes.get(nearest) else {
                break;
            };
            kept.scan.unpack(&mut self.other);
            self.view.add(self.at, &self.other, kept.pose);
            let (dx, dy) = (self.at.x - kept.pose.x, self.at.y - kept.pose.y);
            sum = sum.plus(&kept.covariance.transported(dx, dy).0);
            count += 1.0;
        }
        self.view.finish();
        self.reference.assign(self.view.as_slice());
        // Of what several saw the mean is taken. Their errors are no reason to believe it more: they have most in common.
        self.known = Covariance(sum.scaled(1.0 / math::max(count, 1.0)));
        true
    }

    fn look_from(&mut self, at: Pose) {
        self.at = at;
        self.is_shown = false;
    }

    /// Moves a scan from where odometry leads towards where it fits; whether it does.
    fn correct(&mut self, now: &mut Last, points: &[ScanPoint]) -> bool {
        self.show();
        let guess = self.at.between(now.pose);
        let Some((found, off)) = self.matched(guess, points) else {
            return false;
        };
        now.pose = self.at * (guess * Pose::new(GAIN * off.x, GAIN * off.y, GAIN * off.theta));
        // Along a direction that nothing determines the match is where odometry leads, and knows no more.
        if found.degenerate_direction.is_none() {
            let (dx, dy) = (now.pose.x - self.at.x, now.pose.y - self.at.y);
            let own = Covariance(found.covariance.0.scaled(MATCH_INFLATION)).rotated(self.at);
            // Nor does it settle what the odometry's match of the same scan left in doubt.
            let [doubt, _] = growth(
                (now.since.0, &now.since.1),
                (now.odometry, &now.told),
                now.pose.theta - now.odometry.theta,
                &NO_LOSS,
            );
            let by_match = self.known.transported(dx, dy).plus(&own).plus(&doubt);
            // Whatever the two errors have in common, a mean's variance is at most the mean of the variances.
            let mean = now.covariance.0.scaled(1.0 - GAIN);
            now.covariance = Covariance(mean.plus(&by_match.0.scaled(GAIN)));
        }
        true
    }

    /// The match of points from a guess, and how far off the guess it is, if it is one to be believed.
    fn matched(&self, guess: Pose, points: &[ScanPoint]) -> Option<(Match, Pose)> {
        let config = IcpConfig {
            min_constraint_share: if self.company > 0 { COMPANION } else { SHARE },
            ..IcpConfig::DEFAULT
        };
        let found = align(&self.reference, points, guess, &config).ok()?;
        let off = guess.between(found.pose);
        let is_believed = found.score >= MIN_SCORE
            && f32::from(found.overlap) >= MIN_OVERLAP * f32::from(found.beams)
            && off.distance() < MAX_CORRECTION
            && math::abs(off.theta) < 0.5 * MAX_CORRECTION;
        is_believed.then_some((found, off))
    }

    /// Whether no keyframe saw what is seen from here.
    fn is_new(&self, now: &Last) -> bool {
        self.unmatched >= MOST_UNMATCHED
            || self.keyframes.iter().all(|kept| {
                let off = kept.pose.between(now.pose);
                off.distance() > KEYFRAME_DISTANCE
                    || math::abs(off.theta) > KEYFRAME_ROTATION && !kept.scan.sees_all_around()
            })
    }

    fn keep(&mut self, now: &Last, points: &[ScanPoint]) {
        if self.unmatched >= MOST_UNMATCHED {
            self.keyframes.clear();
            self.unmatched = 0;
        }
        let kept = Kept {
            pose: now.pose,
            covariance: now.covariance,
            scan: PackedScan::new(points),
        };
        if self.is_empty() {
            self.oldest = 0;
        }
        if let Err(kept) = self.keyframes.push(kept) {
            if let Some(entry) = self.keyframes.get_mut(self.oldest) {
                *entry = kept;
            }
            self.oldest = if self.oldest + 1 < K {
                self.oldest + 1
            } else {
                0
            };
        }
        self.look_from(now.pose);
    }
}

/// Variances (m², rad²) below which a loss is none: a fraction of a millimetre.
const NO_LOSS: Covariance = Covariance(Sym3::diagonal(1e-7, 1e-7, 1e-8));

/// Where odometry leads from the last scan, and how far off that may be.
fn predicted(last: &Last, now: Last) -> Last {
    let pose = last.pose * last.odometry.between(now.odometry);
    let turn = pose.theta - now.odometry.theta;
    let before = (last.odometry, &last.told);
    let [grown, _] = growth(before, (now.odometry, &now.told), turn, &NO_LOSS);
    let (dx, dy) = (pose.x - last.pose.x, pose.y - last.pose.y);
    Last {
        pose,
        covariance: last.covariance.transported(dx, dy).plus(&grown),
        since: last.since,
        ..now
    }
}

/// What is told of a scan.
fn rolled(now: &Last, robot_from_lidar: Pose, is_matched: bool) -> Rolled {
    let pose = now.pose * robot_from_lidar.inverse();
    let (dx, dy) = (pose.x - now.pose.x, pose.y - now.pose.y);
    Rolled {
        pose,
        covariance: now.covariance.transported(dx, dy),
        is_matched,
    }
}
