//! What one edge adds to the normal equations.

use crate::{geometry::Pose, linalg::Sym3, math, slam::graph::Edge};

/// A 3×3 block by rows.
pub(super) type Block = [[f32; 3]; 3];

/// An edge's part of `H δ = −b`, its nodes moved as `pose ⊕ δ`.
pub(super) struct Normal {
    /// `AᵀΛA`, `BᵀΛB` and, rows for `from`, `AᵀΛB`.
    pub from: Sym3,
    pub to: Sym3,
    pub between: Block,
    /// `−AᵀΛe` and `−BᵀΛe`.
    pub from_side: [f32; 3],
    pub to_side: [f32; 3],
}

/// `e = h − z` with `h = from⁻¹ ⊕ to`: `A = ∂e/∂from = −[1 0 −h_y; 0 1 h_x; 0 0 1]`, `B = ∂e/∂to = [R(h_θ) 0; 0 1]`.
pub(super) fn normal(edge: &Edge, from: Pose, to: Pose, phi: f32) -> Normal {
    let seen = from.between(to);
    let error = edge.error(from, to);
    let information = edge.information.0.scaled(edge.weight(error, phi));
    let (s, c) = math::sin_cos(seen.theta);
    // Columns of −A and of B.
    let a = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-seen.y, seen.x, 1.0]];
    let b = [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]];
    let [la, lb] = [a, b].map(|columns| columns.map(|column| information.times(column)));
    let side = information.times(error);
    Normal {
        from: symmetric(&a, &la),
        to: symmetric(&b, &lb),
        between: a.map(|column| lb.map(|other| -dot(column, other))),
        from_side: a.map(|column| dot(column, side)),
        to_side: b.map(|column| -dot(column, side)),
    }
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `CᵀM C` from the columns of `C` and of `M C`.
fn symmetric(columns: &Block, images: &Block) -> Sym3 {
    let at = |i: usize, j: usize| dot(columns[i], images[j]);
    Sym3 {
        xx: at(0, 0),
        xy: at(0, 1),
        xt: at(0, 2),
        yy: at(1, 1),
        yt: at(1, 2),
        tt: at(2, 2),
    }
}
