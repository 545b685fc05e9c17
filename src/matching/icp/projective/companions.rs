//! Points on things that move along with the robot: a follower, a trailer, the robot's own mast.

use crate::{
    geometry::Pose,
    matching::icp::projective::{
        accumulate::{Placed, Projection},
        fixed_pose::FixedPose,
        line::Line,
        reference::Reference,
    },
    math::{reciprocal, rough_length},
    scan::{Points, ScanPoint},
};

/// A point nearer than this to a line of the reference as it stands, the motion left out, may have moved along (mm).
const ALONG: u32 = 80;
/// A point farther than this from its line where the motion puts it does not belong to the world (mm).
const ELSEWHERE: u32 = 200;

/// Removes the points that fit `reference` better as if the lidar had not moved than at `pose`, to which it has moved;
/// gives their number.
///
/// Nothing is removed where more than a third of the points would be: then the pose is wrong. Costs two passes over the
/// points.
pub(crate) fn remove_companions<const N: usize>(
    reference: &Reference<N>,
    points: &mut Points<N>,
    pose: Pose,
) -> u16 {
    let Some(at) = FixedPose::new(pose) else {
        return 0;
    };
    let Some(still) = FixedPose::new(Pose::IDENTITY) else {
        return 0;
    };
    let lines = reference.lines();
    let count = |points: &Points<N>| {
        let mut judge = Judge::new(lines, still, at);
        let along = |point| usize::from(judge.moved_along(point));
        points.as_slice().iter().map(along).sum::<usize>()
    };
    let found = count(points);
    if found == 0 || 3 * found > points.as_slice().len() {
        return 0;
    }
    let mut judge = Judge::new(lines, still, at);
    points.retain(|point| !judge.moved_along(point));
    found as u16
}

/// The reference as it stands, and as the motion puts the points into it.
struct Judge<'a> {
    still: Projection<'a>,
    moved: Projection<'a>,
}

impl<'a> Judge<'a> {
    fn new(lines: &'a [Line], still: FixedPose, at: FixedPose) -> Self {
        Self {
            still: Projection::new(lines, still),
            moved: Projection::new(lines, at),
        }
    }

    fn moved_along(&mut self, point: &ScanPoint) -> bool {
        let placed = self.moved.place(point);
        let moved = self.moved.line(point, placed);
        let stood = self.still.place(point);
        let along = self.still.line(point, stood);
        let (Some(moved), Some(along)) = (moved, along) else {
            return false;
        };
        distance(moved, placed) > ELSEWHERE && distance(along, stood) < ALONG
    }
}

/// Distance of a point from its line (mm), the line's weight taken off.
fn distance(line: &Line, placed: Placed) -> u32 {
    let (dx, dy) = (
        (placed.x >> 4) - i32::from(line.qx),
        (placed.y >> 4) - i32::from(line.qy),
    );
    let (mx, my) = (i32::from(line.mx), i32::from(line.my));
    let weighted = (mx.wrapping_mul(dx))
        .wrapping_add(my.wrapping_mul(dy))
        .unsigned_abs()
        >> 10;
    weighted.saturating_mul(reciprocal(rough_length(mx, my)) >> 4) >> 10
}
