//! The terms of a dissipation.

use std::ops::Range;

use metriplectic_fields::{Column, Real, ScalarField, Vector};
use metriplectic_manifolds::{LieDual, Manifold, MetricAt, MetricError, Riemannian};
use nalgebra::SVector;

use super::frame::NoiseFrame;
use crate::dissipation::{
    CasimirDissipation, Dissipation, MetricDissipation, NoDissipation, Scaled,
};

/// A term `ρ b bᵀ` of a dissipation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseTerm<V> {
    /// The rate `ρ ≥ 0`.
    pub rate: Real,
    /// The vector `b`, annihilated by `w`, in the frame of the chart.
    pub b: V,
}

/// A dissipation that is a sum of terms, `K_w = Σ_r ρ_r b_r b_rᵀ`, with `b_r(x, w)` smooth on the whole manifold and
/// `⟨w, b_r⟩ = 0`.
///
/// | dissipation | terms | how many |
/// |---|---|---|
/// | [`MetricDissipation`] | `E_a ⟨w, E_b⟩ − E_b ⟨w, E_a⟩` for each pair of a [`NoiseFrame`] | `n(n−1)/2`, `n(n+1)/2` on a sphere |
/// | [`CasimirDissipation`] | `ad*_w c_a` with `κ = Σ c_a c_aᵀ` | `n` |
/// | [`OnsagerDissipation`](crate::OnsagerDissipation) | its contacts | as many |
/// | [`Scaled`] | those of its dissipation, times `κ(x)` | as many |
///
/// A matrix has no terms: its square root has a derivative of its own.
///
/// Laws: 1. `Σ ρ_r b_r b_rᵀ` is the dissipation; 2. `⟨w, b_r⟩ = 0`; 3. where
/// [`is_closed`](Self::is_closed), the kinetic drift `Σ c_r b_r` vanishes for the measure 1. A run checks the first.
#[diagnostic::on_unimplemented(
    message = "the dissipation `{Self}` has no terms, so its noise is not known (`NoiseNeedsTerms`)",
    note = "write the friction as `OnsagerDissipation(|x, w| [Contact {{ rate, along }}])`, or take `MetricDissipation` or `CasimirDissipation`"
)]
pub trait NoiseTerms<M: Manifold, G: Riemannian<M>>: Dissipation<M, G> {
    /// Returns the number of terms.
    fn count(&self) -> usize;

    /// Passes each of these terms to the visitor, with its number.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the metric or the chart cannot be used there.
    fn each(
        &self,
        g: &MetricAt<'_, M, G, Real>,
        w: &Vector<M, Real>,
        terms: Range<usize>,
        visit: &mut dyn FnMut(usize, NoiseTerm<Vector<M, Real>>),
    ) -> Result<(), MetricError>;

    /// Returns whether `Σ_r c_r b_r = 0` for every energy, with the measure 1.
    fn is_closed(&self) -> bool {
        false
    }
}

impl<M: Manifold, G: Riemannian<M>> NoiseTerms<M, G> for NoDissipation {
    fn count(&self) -> usize {
        0
    }

    fn each(
        &self,
        _: &MetricAt<'_, M, G, Real>,
        _: &Vector<M, Real>,
        _: Range<usize>,
        _: &mut dyn FnMut(usize, NoiseTerm<Vector<M, Real>>),
    ) -> Result<(), MetricError> {
        Ok(())
    }

    fn is_closed(&self) -> bool {
        true
    }
}

impl<M: Manifold, G: NoiseFrame<M>> NoiseTerms<M, G> for MetricDissipation {
    fn count(&self) -> usize {
        let legs = G::legs();
        legs * legs.saturating_sub(1) / 2
    }

    fn each(
        &self,
        g: &MetricAt<'_, M, G, Real>,
        w: &Vector<M, Real>,
        terms: Range<usize>,
        visit: &mut dyn FnMut(usize, NoiseTerm<Vector<M, Real>>),
    ) -> Result<(), MetricError> {
        let frame = G::frame(g)?;
        let pairs = (0..frame.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
        for (r, (a, b)) in pairs.enumerate().skip(terms.start).take(terms.len()) {
            let b = frame[a] * frame[b].dot(w) - frame[b] * frame[a].dot(w);
            visit(r, NoiseTerm { rate: Real::from(1.0), b });
        }
        Ok(())
    }

    fn is_closed(&self) -> bool {
        G::IS_CLOSED
    }
}

impl<const N: usize, G: Riemannian<LieDual<N>>> NoiseTerms<LieDual<N>, G>
    for CasimirDissipation<N>
{
    fn count(&self) -> usize {
        N
    }

    fn each(
        &self,
        _: &MetricAt<'_, LieDual<N>, G, Real>,
        w: &SVector<Real, N>,
        terms: Range<usize>,
        visit: &mut dyn FnMut(usize, NoiseTerm<SVector<Real, N>>),
    ) -> Result<(), MetricError> {
        let columns = self.columns();
        for r in terms {
            let c = SVector::<Real, N>::from_fn(|i, _| Real::from(columns[(i, r)]));
            let b = self.algebra().coadjoint(w, &c);
            visit(r, NoiseTerm { rate: Real::from(1.0), b });
        }
        Ok(())
    }

    /// The tensor of a term is constant and skew, and the Hessian of the energy is symmetric.
    fn is_closed(&self) -> bool {
        true
    }
}

impl<M, G, F, K> NoiseTerms<M, G> for Scaled<F, K>
where
    M: Manifold,
    G: Riemannian<M>,
    F: ScalarField<M>,
    K: NoiseTerms<M, G>,
{
    fn count(&self) -> usize {
        self.1.count()
    }

    fn each(
        &self,
        g: &MetricAt<'_, M, G, Real>,
        w: &Vector<M, Real>,
        terms: Range<usize>,
        visit: &mut dyn FnMut(usize, NoiseTerm<Vector<M, Real>>),
    ) -> Result<(), MetricError> {
        let kappa = self.0.at_real(&g.x.point());
        self.1.each(g, w, terms, &mut |r, NoiseTerm { rate, b }| {
            visit(r, NoiseTerm { rate: rate * kappa, b });
        })
    }
}
