//! Fields `E_a` with `Σ E_a E_aᵀ = g⁻¹` that are smooth on the whole manifold.

use metriplectic_fields::{Column, Dimension, Real, Space, Vector};
use metriplectic_manifolds::{
    Canonical, Constant, FieldMetric, Flat, InnerProduct, Manifold, MetricAt, MetricError,
    Riemannian, out_of_chart,
};
use nalgebra::Const;

use crate::exchange::components;

/// A metric with fields `E_a` of vectors, `Σ_a E_a ⊗ E_a = g⁻¹`, that are smooth on the whole manifold.
///
/// No frame of a sphere is. There these are the `n + 1` projections of the axes of the space around it, on SO(3) the three
/// rotations about the axes of the body, on a half line `s ∂_s`, on a vector space an orthonormal basis of the metric, and on a
/// product those of the factors. For the canonical metric they are [`Manifold::leg`].
#[diagnostic::on_unimplemented(
    message = "the noise of the metric `{Self}` on `{M}` is not known",
    note = "it is for the canonical metric, and for `Metric::constant` and `Metric::field` on a vector space or a chart; write the friction as `OnsagerDissipation(|x, w| [Contact {{ rate, along }}])` otherwise"
)]
pub trait NoiseFrame<M: Manifold>: Riemannian<M> {
    /// True if `Σ_{ab} (div X_ab) X_ab = 0` for all `X_ab = E_a ⟨w, E_b⟩ − E_b ⟨w, E_a⟩` with `w = dH`.
    const IS_CLOSED: bool;

    /// The number of fields.
    fn legs() -> usize {
        M::Dim::LEN
    }

    /// Computes the fields at a point, in the frame of its chart.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the metric or the chart cannot be used there.
    fn frame(g: &MetricAt<'_, M, Self, Real>) -> Result<Vec<Vector<M, Real>>, MetricError>
    where
        Self: Sized;
}

impl<M: Manifold> NoiseFrame<M> for Canonical
where
    Self: Riemannian<M>,
{
    const IS_CLOSED: bool = true;

    fn legs() -> usize {
        <<M as Space>::Velocity as Dimension>::LEN
    }

    fn frame(g: &MetricAt<'_, M, Self, Real>) -> Result<Vec<Vector<M, Real>>, MetricError> {
        let x = g.x.point();
        let legs = (0..<Self as NoiseFrame<M>>::legs()).map(|a| components(g.x, &M::leg(&x, a)));
        legs.collect::<Option<_>>().ok_or_else(|| out_of_chart(g.x))
    }
}

/// The orthonormal basis of a metric on a space whose charts are translations of one another.
fn orthonormal<M: Manifold, G: Riemannian<M>>(
    g: &MetricAt<'_, M, G, Real>,
) -> Result<Vec<Vector<M, Real>>, MetricError> {
    let inner = g.inner()?;
    Ok((0..M::Dim::LEN).map(|a| inner.from_orthonormal(&Vector::<M, Real>::basis(a))).collect())
}

impl<M, const N: usize> NoiseFrame<M> for Constant<N>
where
    M: Manifold + Flat + Space<Dim = Const<N>>,
{
    const IS_CLOSED: bool = true;

    fn frame(g: &MetricAt<'_, M, Self, Real>) -> Result<Vec<Vector<M, Real>>, MetricError> {
        orthonormal(g)
    }
}

impl<M: Manifold + Flat, F> NoiseFrame<M> for FieldMetric<F>
where
    Self: Riemannian<M>,
{
    const IS_CLOSED: bool = false;

    fn frame(g: &MetricAt<'_, M, Self, Real>) -> Result<Vec<Vector<M, Real>>, MetricError> {
        orthonormal(g)
    }
}
