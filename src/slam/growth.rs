//! What odometry tells of a motion: by how much its covariance grew.

use crate::{
    geometry::Pose,
    linalg::{Covariance, Sym3},
    math,
};

/// By how much the covariance of odometry grew from one pose to a later one, rotated by `turn`: as it tells, and without what
/// it tells of x, y and heading together.
///
/// A difference of two covariances need not be one. Where it is negative in some direction by more than `least`, the first is
/// the second: no variance is negative there.
pub(super) fn growth(
    before: (Pose, &Covariance),
    now: (Pose, &Covariance),
    turn: f32,
    least: &Covariance,
) -> [Covariance; 2] {
    let (dx, dy) = (now.0.x - before.0.x, now.0.y - before.0.y);
    let minus = before.1.transported(dx, dy).0.scaled(-1.0);
    let turn = Pose {
        x: 0.0,
        y: 0.0,
        theta: turn,
    };
    let grown = Covariance(now.1.0.plus(&minus)).rotated(turn);
    let is_growth = grown.plus(least).information().is_some();
    let Sym3 { xx, yy, tt, .. } = grown.0;
    let [xx, yy, tt] = [xx, yy, tt].map(|variance| math::max(variance, 0.0));
    let axes = Covariance(Sym3::diagonal(xx, yy, tt));
    [if is_growth { grown } else { axes }, axes]
}
