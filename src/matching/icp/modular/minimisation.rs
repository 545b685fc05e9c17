//! Fifth and sixth stage: what distance is made small, and how.
//!
//! All three work about the current lidar's place, so that large coordinates do not cost digits.

use crate::{
    geometry::{Point, Pose},
    linalg::Sym3,
    matching::icp::modular::{normals::Cloud, pair::Pair},
    math,
};

/// Finds the motion that makes the pairs' residuals small.
pub trait Minimise {
    /// Which distance of a pair is made small (m).
    fn residual(&self, pair: &Pair) -> f32;

    /// The motion to add to `pose`: its place in the reference's frame, its heading; `None` where the pairs leave a
    /// direction open.
    fn step(&mut self, pairs: &[Pair], reference: Cloud<'_>, pose: Pose) -> Option<Pose>;
}

/// A counting pair about the pose's place.
struct Row {
    /// The point (m).
    p: [f32; 2],
    /// The reference point (m), on its line.
    q: [f32; 2],
    /// The line's normal.
    n: [f32; 2],
    w: f32,
}

/// The pairs that count.
fn rows<'a>(pairs: &'a [Pair], reference: Cloud<'a>, pose: Pose) -> impl Iterator<Item = Row> + 'a {
    let counting = pairs.iter().filter(|pair| pair.weight > 0.0);
    counting.filter_map(move |pair| {
        let surface = reference.surfaces.get(usize::from(pair.reference))?;
        let about = |p: Point| [p.x - pose.x, p.y - pose.y];
        Some(Row {
            p: about(pair.place),
            q: about(surface.foot),
            n: surface.normal,
            w: pair.weight,
        })
    })
}

/// Distances between points, in closed form (Besl and McKay 1992; in the plane by two sums).
///
/// Where there are no surfaces: sparse scans, pillars. Slides slowly along walls, and the points of two scans of a wall
/// are never the same: several times less accurate than point to line.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PointToPoint;

impl Minimise for PointToPoint {
    fn residual(&self, pair: &Pair) -> f32 {
        pair.distance
    }

    fn step(&mut self, pairs: &[Pair], reference: Cloud<'_>, pose: Pose) -> Option<Pose> {
        let rows = || rows(pairs, reference, pose);
        let mut means = [0.0; 5];
        for Row { p, q, w, .. } in rows() {
            let terms = [w, w * p[0], w * p[1], w * q[0], w * q[1]];
            for (mean, term) in means.iter_mut().zip(terms) {
                *mean += term;
            }
        }
        let [total, ..] = means;
        if !(total > 0.0) {
            return None;
        }
        let [_, px, py, qx, qy] = means.map(|v| v / total);
        let (mut cosine, mut sine) = (0.0, 0.0);
        for Row { p, q, w, .. } in rows() {
            let (ax, ay, bx, by) = (p[0] - px, p[1] - py, q[0] - qx, q[1] - qy);
            cosine += w * (ax * bx + ay * by);
            sine += w * (ax * by - ay * bx);
        }
        let theta = math::atan2(sine, cosine);
        let (s, c) = math::sin_cos(theta);
        Some(Pose::new(qx - c * px + s * py, qy - s * px - c * py, theta))
    }
}

/// Distances from lines, by Gauss–Newton (Chen and Medioni 1991): the default. Slides freely along walls, converges
/// quadratically.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PointToLine;

/// `JᵀWJ` and `−JᵀWe` of the distances from the lines, over (m, m, rad) about `pose`.
pub(super) fn normal_equations(
    pairs: &[Pair],
    reference: Cloud<'_>,
    pose: Pose,
) -> (Sym3, [f32; 3]) {
    let (mut h, mut b) = (Sym3::default(), [0.0; 3]);
    for Row { p, q, n, w } in rows(pairs, reference, pose) {
        let [x, y] = n;
        let t = y * p[0] - x * p[1];
        let e = x * (p[0] - q[0]) + y * (p[1] - q[1]);
        h = h.plus(&Sym3 {
            xx: w * x * x,
            xy: w * x * y,
            xt: w * x * t,
            yy: w * y * y,
            yt: w * y * t,
            tt: w * t * t,
        });
        b = [b[0] - w * e * x, b[1] - w * e * y, b[2] - w * e * t];
    }
    (h, b)
}

impl Minimise for PointToLine {
    fn residual(&self, pair: &Pair) -> f32 {
        pair.across
    }

    fn step(&mut self, pairs: &[Pair], reference: Cloud<'_>, pose: Pose) -> Option<Pose> {
        let (h, b) = normal_equations(pairs, reference, pose);
        let [x, y, t] = h.solve(b)?;
        Some(Pose::new(x, y, t))
    }
}

/// Distances from lines, in closed form with `cos² + sin² = 1` as a constraint (Censi, ICRA 2008).
///
/// The same minimum as [`PointToLine`]'s, in one step also for large turns; a quartic more to solve. After a rough guess
/// of the heading with pairs that are right.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Constrained;

/// Sums of the quadratic form over `(t_x, t_y, cos, sin)`: `[A B; Bᵀ D]`, and the linear part `(g1, g2)`, both halved.
#[derive(Default)]
struct Form {
    a: [f32; 3],
    b: [[f32; 2]; 2],
    d: [f32; 3],
    g1: [f32; 2],
    g2: [f32; 2],
}

impl Form {
    fn add(&mut self, Row { p, q, n, w }: Row) {
        let [x, y] = n;
        // e = x t_x + y t_y + u cos + v sin − d
        let (u, v) = (x * p[0] + y * p[1], y * p[0] - x * p[1]);
        let d = x * q[0] + y * q[1];
        for (sum, term) in self.a.iter_mut().zip([x * x, x * y, y * y]) {
            *sum += w * term;
        }
        for (sum, term) in self.d.iter_mut().zip([u * u, u * v, v * v]) {
            *sum += w * term;
        }
        self.b[0] = [self.b[0][0] + w * x * u, self.b[0][1] + w * x * v];
        self.b[1] = [self.b[1][0] + w * y * u, self.b[1][1] + w * y * v];
        self.g1 = [self.g1[0] - w * d * x, self.g1[1] - w * d * y];
        self.g2 = [self.g2[0] - w * d * u, self.g2[1] - w * d * v];
    }

    /// `A⁻¹ v`; `None` where all lines run the same way.
    fn solve_a(&self, v: [f32; 2]) -> Option<[f32; 2]> {
        let [xx, xy, yy] = self.a;
        let det = xx * yy - xy * xy;
        if !(det > 1e-6 * xx * yy) {
            return None;
        }
        Some([(yy * v[0] - xy * v[1]) / det, (xx * v[1] - xy * v[0]) / det])
    }

    /// The minimum under the constraint: translation, cosine, sine.
    fn minimum(&self) -> Option<([f32; 2], [f32; 2])> {
        let [[b00, b01], [b10, b11]] = self.b;
        // S = D − Bᵀ A⁻¹ B, h = g2 − Bᵀ A⁻¹ g1.
        let ([p0, p1], [q0, q1], [r0, r1]) = (
            self.solve_a([b00, b10])?,
            self.solve_a([b01, b11])?,
            self.solve_a(self.g1)?,
        );
        let [d0, d1, d2] = self.d;
        let s = [
            d0 - b00 * p0 - b10 * p1,
            d1 - b00 * q0 - b10 * q1,
            d2 - b01 * q0 - b11 * q1,
        ];
        let h = [
            self.g2[0] - b00 * r0 - b10 * r1,
            self.g2[1] - b01 * r0 - b11 * r1,
        ];
        let [c, sine] = on_circle(s, h)?;
        let rest = [
            self.g1[0] + b00 * c + b01 * sine,
            self.g1[1] + b10 * c + b11 * sine,
        ];
        let [x, y] = self.solve_a(rest)?;
        Some(([-x, -y], [c, sine]))
    }
}

/// The unit vector `y` with `(S + μ) y = −h` for the largest `μ`: `|adj(S)h + μh|² = det(S + μ)²`.
fn on_circle(s: [f32; 3], h: [f32; 2]) -> Option<[f32; 2]> {
    // In units of the trace, so that fourth powers stay near 1.
    let unit = s[0] + s[2];
    let norm = math::sqrt(h[0] * h[0] + h[1] * h[1]);
    if !(unit > 0.0 && norm > 0.0 && norm < f32::INFINITY) {
        return None;
    }
    let [xx, xy, yy] = s.map(|v| v / unit);
    let [hx, hy] = h.map(|v| v / unit);
    let det = xx * yy - xy * xy;
    let adj = [yy * hx - xy * hy, xx * hy - xy * hx];
    // Above all roots: |h| + |S|.
    let mut mu = norm / unit + 2.0;
    for _ in 0..60 {
        let d = mu * mu + mu + det;
        let v = [adj[0] + mu * hx, adj[1] + mu * hy];
        let f = d * d - (v[0] * v[0] + v[1] * v[1]);
        let slope = 2.0 * d * (2.0 * mu + 1.0) - 2.0 * (v[0] * hx + v[1] * hy);
        // From above the steps shorten; where rounding ends that, the root is found.
        if !(f > 0.0 && slope > 0.0) {
            break;
        }
        mu -= f / slope;
    }
    let d = mu * mu + mu + det;
    let (x, y) = (-(adj[0] + mu * hx) / d, -(adj[1] + mu * hy) / d);
    let length = math::sqrt(x * x + y * y);
    // Far from 1 there was no root: the lines do not fix the turn.
    ((0.99..1.01).contains(&length)).then(|| [x / length, y / length])
}

impl Minimise for Constrained {
    fn residual(&self, pair: &Pair) -> f32 {
        pair.across
    }

    fn step(&mut self, pairs: &[Pair], reference: Cloud<'_>, pose: Pose) -> Option<Pose> {
        let mut form = Form::default();
        for row in rows(pairs, reference, pose) {
            form.add(row);
        }
        let ([x, y], [c, s]) = form.minimum()?;
        Some(Pose::new(x, y, math::atan2(s, c)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        matching::icp::modular::normals::Surface,
        scan::{Bearing, ScanPoint},
    };

    /// Twelve points on the walls of a room of 4 m by 3 m, paired with themselves after `motion`.
    fn moved(choice: &mut impl Minimise, motion: Pose) -> Pose {
        let walls = [(2.0, 0.0), (0.0, 1.5), (-2.0, 0.0), (0.0, -1.5)];
        let surfaces: [Surface; 12] = core::array::from_fn(|k| {
            let (x, y) = walls[k % 4];
            let along = 0.4 * (k / 4) as f32 - 0.5;
            let norm: f32 = x + y;
            let norm = norm.abs();
            Surface {
                foot: Point::new(x - along * y / norm, y + along * x / norm),
                normal: [-x / norm, -y / norm],
                edge: false,
            }
        });
        let points = [ScanPoint::at(Bearing(0), 2000); 12];
        let cloud = Cloud {
            points: &points,
            surfaces: &surfaces,
        };
        // Points as seen after the motion, at a guess of no motion.
        let pairs: [Pair; 12] = core::array::from_fn(|k| Pair {
            place: motion.inverse() * surfaces[k].foot,
            normal: [0.0; 2],
            point: k as u16,
            reference: k as u16,
            distance: 0.0,
            across: 0.0,
            residual: 0.0,
            weight: 1.0 + k as f32 % 3.0,
        });
        choice.step(&pairs, cloud, Pose::IDENTITY).expect("a step")
    }

    #[test]
    fn right_pairs_give_the_motion_in_one_step() {
        let large = Pose::new(0.3, -0.2, 0.4);
        let small = Pose::new(0.003, -0.002, 0.001);
        for (name, found, expected, allowed) in [
            (
                "point to point",
                moved(&mut PointToPoint, large),
                large,
                1e-5,
            ),
            // Exact but for rounding, which the quartic's squares double.
            ("constrained", moved(&mut Constrained, large), large, 1e-3),
            ("constrained", moved(&mut Constrained, small), small, 1e-3),
            // Linear: the square of 1 mrad and of 3 mm.
            ("point to line", moved(&mut PointToLine, small), small, 1e-5),
        ] {
            let off = expected.between(found);
            assert!(
                off.distance() < allowed && off.theta.abs() < allowed,
                "{name}: {found:?}"
            );
        }
    }

    #[test]
    fn parallel_lines_give_no_step() {
        let surfaces = [Surface {
            foot: Point::new(2.0, 0.0),
            normal: [-1.0, 0.0],
            edge: false,
        }; 4];
        let points = [ScanPoint::at(Bearing(0), 2000); 4];
        let cloud = Cloud {
            points: &points,
            surfaces: &surfaces,
        };
        let pairs: [Pair; 4] = core::array::from_fn(|k| Pair {
            place: Point::new(2.0, k as f32),
            normal: [0.0; 2],
            point: 0,
            reference: k as u16,
            distance: 0.0,
            across: 0.0,
            residual: 0.0,
            weight: 1.0,
        });
        assert_eq!(PointToLine.step(&pairs, cloud, Pose::IDENTITY), None);
        assert_eq!(Constrained.step(&pairs, cloud, Pose::IDENTITY), None);
        assert_eq!(PointToPoint.step(&[], cloud, Pose::IDENTITY), None);
    }
}
