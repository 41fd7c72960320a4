//! Dissipations: the symmetric positive semidefinite tensor `K` that produces entropy.
//!
//! | type | `K_w(α, β)` | from |
//! |---|---|---|
//! | [`MetricDissipation`] | `G*(w,w) G*(α,β) − G*(w,α) G*(w,β)` | the metric of the system |
//! | [`CometricDissipation`] | the same | a semidefinite matrix `G*(x)` on covectors |
//! | [`KulkarniNomizu`] | `σ(w,w) μ(α,β) − σ(w,α) μ(w,β) − μ(w,α) σ(w,β) + μ(w,w) σ(α,β)` | two of them |
//! | [`CasimirDissipation`] | `κ([w,α], [w,β])` | a semidefinite form `κ` on a Lie algebra |
//! | [`FieldDissipation`] | `K(x, w)(α, β)` | a closure that annihilates `w` itself |
//! | [`OnsagerDissipation`] | `Σ ρ_r ⟨α, b_r⟩ ⟨b_r, β⟩` | a closure that returns its terms |
//! | [`ProjectedDissipation`] | `K(x)(Qᵀα, Qᵀβ)`, `Qᵀα = α − w G*(w,α)/G*(w,w)` | a closure of the point alone |
//! | [`Scaled`] | `κ(x) K_w(α, β)` | any of these, and a number `κ(x) ≥ 0` |
//! | [`NoDissipation`] | 0 | |

mod casimir;
mod choice;
mod cometric;
mod field;
mod kulkarni_nomizu;
mod metric;
mod none;
mod onsager;
mod projected;
mod scaled;

pub use casimir::{CasimirDissipation, FormError};
pub use choice::{Choice, Given};
pub use cometric::CometricDissipation;
pub use field::FieldDissipation;
pub(crate) use field::along_velocities;
pub use kulkarni_nomizu::KulkarniNomizu;
pub use metric::MetricDissipation;
pub use none::NoDissipation;
pub use onsager::OnsagerDissipation;
pub use projected::ProjectedDissipation;
pub use scaled::Scaled;

use metriplectic_fields::{ChartPoint, Column, Dimension, Matrix, Scalar, Square, Vector};
use metriplectic_manifolds::{Manifold, MetricAt, MetricError, Riemannian};
use num_dual::Dual64;

use crate::bracket::epsilon;

/// A dissipation `K`, given the covector `w` that it must annihilate: `dH` in the equations of motion,
/// a discrete gradient in a step. The same code serves both.
///
/// An implementation writes one method, [`apply`](Self::apply), at any scalar.
///
/// Laws ([`laws::dissipation`](crate::laws::dissipation)): 1. `K_w` is symmetric; 2. `K_w ⪰ 0`;
/// 3. `K_w w = 0`; 4. `linearise` is the derivative of `apply`.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a dissipation on `{M}`",
    note = "a dissipation of your own is `FieldDissipation(|x, w| matrix)`, which annihilates `w`, or `ProjectedDissipation(|x| matrix)`"
)]
pub trait Dissipation<M: Manifold, G: Riemannian<M>> {
    /// Computes the vector `K_w(x) α` at the point `x` of `g`, with components in the frame of its chart.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the metric cannot be used at `x`.
    fn apply<D: Scalar>(
        &self,
        g: &MetricAt<'_, M, G, D>,
        w: &Vector<M, D>,
        alpha: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError>;

    /// Computes `K_w α` at the centre of a chart, with its derivatives along `x`, `w` and `α`.
    ///
    /// # Errors
    ///
    /// The errors of [`apply`](Self::apply).
    fn linearise(
        &self,
        g: &MetricAt<'_, M, G>,
        w: &Vector<M>,
        alpha: &Vector<M>,
    ) -> Result<DissipationJet<M>, MetricError> {
        by_dual_numbers(self, g, w, alpha)
    }

    /// Computes the matrix `K_w(x)`.
    ///
    /// # Errors
    ///
    /// The errors of [`apply`](Self::apply).
    fn tensor(&self, g: &MetricAt<'_, M, G>, w: &Vector<M>) -> Result<Matrix<M>, MetricError> {
        let mut tensor = Matrix::<M>::zeros();
        for j in 0..M::Dim::LEN {
            let column = self.apply(g, w, &Vector::<M>::basis(j))?;
            for i in 0..M::Dim::LEN {
                tensor[(i, j)] = column[i];
            }
        }
        Ok(tensor)
    }

    /// Returns whether there is no dissipation by construction, so that no entropy is produced.
    fn is_none(&self) -> bool {
        false
    }

    /// Returns whether the dissipation is defined by the covectors that it annihilates. Then the further
    /// invariants of a system are projected out of it too. Any other dissipation must annihilate them by itself.
    fn adapts(&self) -> bool {
        false
    }

    /// Returns whether a projection makes the tensor annihilate `w`. `K` then differs from the tensor that was
    /// given; see [`ProjectedDissipation`].
    fn is_projected(&self) -> bool {
        false
    }

    /// Returns whether this is the dissipation of the metric with `κ = 1`, which a system with an entropy has by default.
    fn is_default(&self) -> bool {
        false
    }
}

/// The number of directions up to which the sum over pairs takes no more time than two projections.
/// A factor of four fails `dissipation.rs::a_turn_of_many_directions_is_by_projections`.
const PAIRS: usize = 8;

/// `−(p ∧ q) w` with `(p ∧ q)^{ij} = p^i q^j − q^i p^j`, that is `q (p·w) − p (q·w)`, evaluated so
/// that `⟨w, −(p ∧ q) w⟩` cancels in pairs instead of between two large numbers. With many directions the rounding of
/// `q (p·w) − p (q·w)` along `w` is taken out by a projection instead, in a number of operations that grows like `n`.
#[inline]
fn turn<M: Manifold, D: Scalar>(
    p: &Vector<M, D>,
    q: &Vector<M, D>,
    w: &Vector<M, D>,
) -> Vector<M, D> {
    if const { M::Dim::LEN > PAIRS } {
        let k = *q * p.dot(w) - *p * q.dot(w);
        let square = w.dot(w);
        return if square.re() > 0.0 { k - *w * (w.dot(&k) / square) } else { k };
    }
    let mut k = Vector::<M, D>::zero();
    for i in 0..M::Dim::LEN {
        for j in 0..i {
            let a = p[j] * q[i] - p[i] * q[j];
            k[i] += w[j] * a;
            k[j] -= w[i] * a;
        }
    }
    k
}

/// The definition of [`Dissipation::linearise`]: one dual number for each direction.
pub(crate) fn by_dual_numbers<M: Manifold, G: Riemannian<M>>(
    dissipation: &(impl Dissipation<M, G> + ?Sized),
    g: &MetricAt<'_, M, G>,
    w: &Vector<M>,
    alpha: &Vector<M>,
) -> Result<DissipationJet<M>, MetricError> {
    let value = dissipation.apply(g, w, alpha)?;
    let zero = Matrix::<M>::zeros();
    let mut jet = DissipationJet::<M> { value, along_z: zero, along_w: zero, tensor: zero };
    let base = &g.x.base;
    let still = ChartPoint::centre(base);
    let still = MetricAt::new(g.metric, &still);
    let (w, alpha) = (Vector::<M, Dual64>::embed(w), Vector::<M, Dual64>::embed(alpha));
    for k in 0..M::Dim::LEN {
        let e = epsilon::<M>(k);
        let moved = ChartPoint { base: base.clone(), q: e };
        let along_z = dissipation.apply(&MetricAt::new(g.metric, &moved), &w, &alpha)?;
        let along_w = dissipation.apply(&still, &(w + e), &alpha)?;
        let along_alpha = dissipation.apply(&still, &w, &(alpha + e))?;
        for i in 0..M::Dim::LEN {
            jet.along_z[(i, k)] = along_z[i].eps;
            jet.along_w[(i, k)] = along_w[i].eps;
            jet.tensor[(i, k)] = along_alpha[i].eps;
        }
    }
    Ok(jet)
}

/// `K_w α` at a real point, with its derivatives.
#[derive(Clone, Copy, Debug)]
pub struct DissipationJet<M: Manifold> {
    /// The vector `K_w α`.
    pub value: Vector<M>,
    /// `∂(K_w α)/∂z` in the chart at `z`.
    pub along_z: Matrix<M>,
    /// `∂(K_w α)/∂w`.
    pub along_w: Matrix<M>,
    /// `∂(K_w α)/∂α`, the tensor itself.
    pub tensor: Matrix<M>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::SVector;

    /// `q (p·w) − p (q·w)` for some vectors, by a turn and by pairs, and the sum `⟨w, v⟩` relative to its terms.
    fn turned<const N: usize>() -> ([SVector<f64, N>; 2], f64)
    where
        nalgebra::Const<N>: Dimension<Vector<f64> = SVector<f64, N>>,
    {
        let [p, q, w] = [0.3, 1.1, 2.3]
            .map(|phase| SVector::<f64, N>::from_fn(|i, _| (phase + i as f64 * 1.7).sin()));
        let v = turn::<Euclidean<N>, f64>(&p, &q, &w);
        let mut pairs = SVector::<f64, N>::zeros();
        for i in 0..N {
            for j in 0..i {
                let a = p[j] * q[i] - p[i] * q[j];
                pairs[i] += w[j] * a;
                pairs[j] -= w[i] * a;
            }
        }
        let terms: f64 = (0..N).map(|i| (w[i] * v[i]).abs()).sum();
        ([v, pairs], w.dot(&v).abs() / terms)
    }

    #[test]
    fn a_turn_of_many_directions_is_by_projections() {
        let ([v, pairs], off) = turned::<8>();
        assert!(v == pairs && off <= 8.0 * f64::EPSILON);
        let ([v, pairs], off) = turned::<9>();
        // Each of the sums is rounded once for each term.
        assert!(v != pairs && (v - pairs).amax() <= 18.0 * f64::EPSILON * 9.0);
        assert!(off <= 9.0 * f64::EPSILON, "{off}");
    }
}
