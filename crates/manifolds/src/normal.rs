//! Normal coordinates on a space of constant curvature.

use metriplectic_fields::series::stumpff;
use metriplectic_fields::{Scalar, dot};
use nalgebra::{SMatrix, SVector};

use crate::InnerProduct;

/// The metric of a space of constant sectional curvature `K` in normal coordinates `q`,
///
/// ```math
/// g(q) = \sigma^2 \Bigl(1 - \frac{q q^T}{|q|^2}\Bigr) + \frac{q q^T}{|q|^2}, \qquad
/// \sigma = \frac{\sin(\sqrt K |q|)}{\sqrt K |q|} ,
/// ```
///
/// the identity at the centre. Lengths along rays do not change, and lengths across them shrink by `σ`
/// (do Carmo 1992, §5.2). The unit sphere has `K = 1`, SO(3) with `⟨â, b̂⟩ = a·b` has `K = ¼`.
#[derive(Clone, Copy, Debug)]
pub struct Normal<D, const N: usize> {
    q: SVector<D, N>,
    /// `σ`.
    across: D,
    /// `(1 − σ)/|q|²`, which is `K c₃(K|q|²)`.
    bend: D,
}

impl<D: Scalar, const N: usize> Normal<D, N> {
    #[inline]
    pub(crate) fn at(q: &SVector<D, N>, curvature: f64) -> Self {
        let [_, across, _, c3] = stumpff(dot(q, q) * curvature);
        Self { q: *q, across, bend: c3 * curvature }
    }

    /// Whether this is the identity at the centre, where the compiler knows the coordinates of most points.
    #[inline(always)]
    fn is_centre(&self) -> bool {
        D::NDERIV == 0 && self.q.iter().all(|q| q.re() == 0.0)
    }

    /// The density `√det g = σⁿ⁻¹`.
    #[inline]
    pub(crate) fn volume_density(&self) -> D {
        (1..N).fold(D::one(), |product, _| product * self.across)
    }

    /// The matrix `g(q)`.
    pub(crate) fn matrix(&self) -> SMatrix<D, N, N> {
        let square = self.across * self.across;
        let rays = self.bend * (self.across + 1.0);
        SMatrix::from_fn(|i, j| {
            let ray = self.q[i] * self.q[j] * rays;
            if i == j { ray + square } else { ray }
        })
    }
}

impl<D: Scalar, const N: usize> InnerProduct<SVector<D, N>> for Normal<D, N> {
    #[inline]
    fn flat(&self, v: &SVector<D, N>) -> SVector<D, N> {
        let square = self.across * self.across;
        v * square + self.q * (self.bend * (self.across + 1.0) * dot(&self.q, v))
    }

    /// By the symmetric root of `g`, which is `σ` across the ray and 1 along it.
    #[inline]
    fn orthonormal(&self, alpha: &SVector<D, N>) -> SVector<D, N> {
        if self.is_centre() {
            return *alpha;
        }
        (alpha - self.q * (self.bend * dot(&self.q, alpha))) * self.across.recip()
    }

    #[inline]
    fn from_orthonormal(&self, a: &SVector<D, N>) -> SVector<D, N> {
        self.orthonormal(a)
    }
}
