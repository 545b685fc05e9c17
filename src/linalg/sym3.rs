//! Symmetric 3×3 matrices: products, inverse, eigenvalues.

use crate::math;

/// Symmetric 3×3 matrix, rows and columns `(x, y, θ)`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sym3 {
    /// Row x, column x.
    pub xx: f32,
    /// Row x, column y.
    pub xy: f32,
    /// Row x, column θ.
    pub xt: f32,
    /// Row y, column y.
    pub yy: f32,
    /// Row y, column θ.
    pub yt: f32,
    /// Row θ, column θ.
    pub tt: f32,
}

impl Sym3 {
    /// Matrix with nothing off its diagonal.
    #[must_use]
    pub const fn diagonal(xx: f32, yy: f32, tt: f32) -> Self {
        Self {
            xx,
            xy: 0.0,
            xt: 0.0,
            yy,
            yt: 0.0,
            tt,
        }
    }

    /// `v vᵀ`.
    #[must_use]
    pub const fn outer([x, y, t]: [f32; 3]) -> Self {
        Self {
            xx: x * x,
            xy: x * y,
            xt: x * t,
            yy: y * y,
            yt: y * t,
            tt: t * t,
        }
    }

    /// Matrix times vector.
    #[must_use]
    pub fn times(&self, v: [f32; 3]) -> [f32; 3] {
        let [x, y, t] = v;
        [
            self.xx * x + self.xy * y + self.xt * t,
            self.xy * x + self.yy * y + self.yt * t,
            self.xt * x + self.yt * y + self.tt * t,
        ]
    }

    /// `vᵀ M v`.
    #[must_use]
    pub fn quadratic(&self, v: [f32; 3]) -> f32 {
        let [a, b, c] = self.times(v);
        a * v[0] + b * v[1] + c * v[2]
    }

    /// Sum of two matrices.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            xt: self.xt + other.xt,
            yy: self.yy + other.yy,
            yt: self.yt + other.yt,
            tt: self.tt + other.tt,
        }
    }

    /// Every entry times `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f32) -> Self {
        Self {
            xx: self.xx * factor,
            xy: self.xy * factor,
            xt: self.xt * factor,
            yy: self.yy * factor,
            yt: self.yt * factor,
            tt: self.tt * factor,
        }
    }

    /// `D M D` with `D = diag(1, 1, factor)`: the same matrix with θ in another unit.
    #[must_use]
    pub fn theta_scaled(&self, factor: f32) -> Self {
        Self {
            xt: self.xt * factor,
            yt: self.yt * factor,
            tt: self.tt * factor * factor,
            ..*self
        }
    }

    /// The same quadratic form over motions whose turn is about `(x, y)`, given that over motions whose turn is about the
    /// origin.
    #[must_use]
    pub fn about(&self, x: f32, y: f32) -> Self {
        // A turn about (x, y) is one about the origin and a shift by (y, -x) for each radian.
        let (xt, yt) = (
            self.xt + self.xx * y - self.xy * x,
            self.yt + self.xy * y - self.yy * x,
        );
        Self {
            xt,
            yt,
            tt: self.tt + y * (xt + self.xt) - x * (yt + self.yt),
            ..*self
        }
    }

    /// `A M A` for a symmetric `A`.
    #[must_use]
    pub fn congruent(&self, a: &Self) -> Self {
        let rows = [
            a.times([self.xx, self.xy, self.xt]),
            a.times([self.xy, self.yy, self.yt]),
            a.times([self.xt, self.yt, self.tt]),
        ];
        // Column i of (A M)ᵀ is row i of A M.
        let column = |i: usize| a.times([rows[0][i], rows[1][i], rows[2][i]]);
        let ([xx, xy, xt], [_, yy, yt], [_, _, tt]) = (column(0), column(1), column(2));
        Self {
            xx,
            xy,
            xt,
            yy,
            yt,
            tt,
        }
    }

    /// Inverse of a positive definite matrix; `None` where it is singular or indefinite.
    ///
    /// Cholesky, so that a matrix which is positive definite but badly scaled still inverts.
    #[must_use]
    pub fn inverse(&self) -> Option<Self> {
        let l = self.cholesky()?;
        let ([xx, xy, xt], [_, yy, yt], [_, _, tt]) = (
            l.solve([1.0, 0.0, 0.0]),
            l.solve([0.0, 1.0, 0.0]),
            l.solve([0.0, 0.0, 1.0]),
        );
        Some(Self {
            xx,
            xy,
            xt,
            yy,
            yt,
            tt,
        })
    }

    /// Solution `v` of `M v = b`; `None` unless the matrix is positive definite.
    #[must_use]
    pub fn solve(&self, b: [f32; 3]) -> Option<[f32; 3]> {
        Some(self.cholesky()?.solve(b))
    }

    /// A matrix whose product with its transpose is this one: it makes numbers of this covariance from independent ones of
    /// variance 1. `None` unless this one is positive definite.
    #[must_use]
    pub fn root(&self) -> Option<Root> {
        let Ldl { d, l10, l20, l21 } = self.cholesky()?;
        let [a, b, c] = d.map(math::sqrt);
        Some(Root {
            diagonal: [a, b, c],
            yx: l10 * a,
            tx: l20 * a,
            ty: l21 * b,
        })
    }

    /// `M = L D Lᵀ`; `None` where a pivot is not clearly positive.
    fn cholesky(&self) -> Option<Ldl> {
        /// A pivot this much smaller than its diagonal entry is only rounding.
        const SINGULAR: f32 = 1e-6;
        let d0 = self.xx;
        if !(d0 > 0.0 && d0 < f32::INFINITY) {
            return None;
        }
        let (l10, l20) = (self.xy / d0, self.xt / d0);
        let d1 = self.yy - l10 * self.xy;
        if !(d1 > SINGULAR * self.yy && d1 < f32::INFINITY) {
            return None;
        }
        let l21 = (self.yt - l20 * self.xy) / d1;
        let d2 = self.tt - l20 * self.xt - l21 * l21 * d1;
        if !(d2 > SINGULAR * self.tt && d2 < f32::INFINITY) {
            return None;
        }
        Some(Ldl {
            d: [d0, d1, d2],
            l10,
            l20,
            l21,
        })
    }

    /// Eigenvalues in ascending order, each with its unit eigenvector: Jacobi rotations, four sweeps.
    ///
    /// Give entries of similar size (see [`Sym3::theta_scaled`]): the error is about 1e-6 of the largest.
    #[must_use]
    pub fn eigen(&self) -> [(f32, [f32; 3]); 3] {
        let mut m = [
            [self.xx, self.xy, self.xt],
            [self.xy, self.yy, self.yt],
            [self.xt, self.yt, self.tt],
        ];
        let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for _ in 0..4 {
            for (p, q, r) in [(0, 1, 2), (0, 2, 1), (1, 2, 0)] {
                rotate(&mut m, &mut v, p, q, r);
            }
        }
        let mut pairs = [(m[0][0], v[0]), (m[1][1], v[1]), (m[2][2], v[2])];
        for (a, b) in [(0, 1), (1, 2), (0, 1)] {
            if pairs[b].0 < pairs[a].0 {
                pairs.swap(a, b);
            }
        }
        pairs
    }
}

/// A lower triangle, rows and columns `(x, y, θ)`: a root of a [`Sym3`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Root {
    diagonal: [f32; 3],
    yx: f32,
    tx: f32,
    ty: f32,
}

impl Root {
    /// Matrix times vector.
    #[must_use]
    pub fn times(&self, [x, y, t]: [f32; 3]) -> [f32; 3] {
        let [xx, yy, tt] = self.diagonal;
        [
            xx * x,
            self.yx * x + yy * y,
            self.tx * x + self.ty * y + tt * t,
        ]
    }

    /// Its determinant: the volume that the unit cube becomes.
    #[must_use]
    pub fn determinant(&self) -> f32 {
        let [xx, yy, tt] = self.diagonal;
        xx * yy * tt
    }
}

/// One Jacobi rotation that clears `m[p][q]`; `r` is the third index, `v` holds eigenvectors as rows.
fn rotate(m: &mut [[f32; 3]; 3], v: &mut [[f32; 3]; 3], p: usize, q: usize, r: usize) {
    if p > 2 || q > 2 || r > 2 {
        return;
    }
    let off = m[p][q];
    if off == 0.0 {
        return;
    }
    let theta = 0.5 * (m[q][q] - m[p][p]) / off;
    let root = math::sqrt(theta * theta + 1.0);
    let t = if theta < 0.0 {
        -1.0 / (root - theta)
    } else {
        1.0 / (root + theta)
    };
    let c = 1.0 / math::sqrt(t * t + 1.0);
    let s = t * c;
    m[p][p] -= t * off;
    m[q][q] += t * off;
    m[p][q] = 0.0;
    m[q][p] = 0.0;
    let (mpr, mqr) = (m[p][r], m[q][r]);
    m[p][r] = c * mpr - s * mqr;
    m[q][r] = s * mpr + c * mqr;
    m[r][p] = m[p][r];
    m[r][q] = m[q][r];
    for k in 0..3 {
        let (vp, vq) = (v[p][k], v[q][k]);
        v[p][k] = c * vp - s * vq;
        v[q][k] = s * vp + c * vq;
    }
}

/// Factors of `L D Lᵀ`, `L` with ones on its diagonal.
struct Ldl {
    d: [f32; 3],
    l10: f32,
    l20: f32,
    l21: f32,
}

impl Ldl {
    fn solve(&self, b: [f32; 3]) -> [f32; 3] {
        let y1 = b[1] - self.l10 * b[0];
        let y2 = b[2] - self.l20 * b[0] - self.l21 * y1;
        let t = y2 / self.d[2];
        let y = y1 / self.d[1] - self.l21 * t;
        let x = b[0] / self.d[0] - self.l10 * y - self.l20 * t;
        [x, y, t]
    }
}
