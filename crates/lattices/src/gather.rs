//! Energies that depend on a sum over the neighbours of a site: embedded atoms, smoothed densities.
//!
//! With a function `φ` of a bond and `ρ_i = Σ φ` over the bonds of site `i`, the energy `Σ_i g(x_i, ρ_i)` is no sum over
//! bonds. Its differential takes one more pass over them: with `λ_i = ∂g/∂ρ(x_i, ρ_i)`,
//!
//! ```math
//! w_i = \partial_x g(x_i, \rho_i) + \sum_{j} (\lambda_i + \lambda_j)\, \partial_{x_i} \varphi .
//! ```

use metriplectic_fields::{Column, Jet1, Real, ScalarField, Space};
use metriplectic_manifolds::{Product, Times};

use crate::fields::{Absent, LocalField, Uniform, WithData};

/// The energy of a site, which may depend on a sum over its bonds.
pub trait SiteEnergy<M: Times<M>, D>: LocalField<M, D> {
    /// Whether it does.
    const GATHERS: bool = false;

    /// Computes the function `φ` of a bond and its differential.
    fn weight(&self, x: &(M::Point<f64>, M::Point<f64>)) -> Jet1<Product<M, M>> {
        let _ = x;
        Jet1 { value: 0.0, df: Column::zero() }
    }

    /// Computes the energy `g(x, ρ)` with its differential along `x`, and `∂g/∂ρ`.
    fn embedded(&self, x: &M::Point<f64>, rho: f64) -> (Jet1<M>, f64) {
        let _ = (x, rho);
        (Jet1 { value: 0.0, df: Column::zero() }, 0.0)
    }
}

impl<M: Times<M>, D> SiteEnergy<M, D> for Absent {}

impl<M: Times<M>, D, F: ScalarField<M> + Sync> SiteEnergy<M, D> for Uniform<F> {}

impl<M: Times<M>, D, F: Fn(&M::Point<Real>, &D) -> Real + Sync> SiteEnergy<M, D> for WithData<F> {}

/// An energy `h(x_i) + g(x_i, Σ φ)`.
#[derive(Clone, Copy, Debug)]
pub struct Gathered<H, P, G> {
    pub(crate) energy: H,
    pub(crate) phi: P,
    pub(crate) embed: G,
}

impl<M, D, H, P, G> LocalField<M, D> for Gathered<H, P, G>
where
    M: Space,
    H: LocalField<M, D>,
    P: Sync,
    G: Sync,
{
    #[inline]
    fn value(&self, x: &M::Point<f64>, data: &D) -> f64 {
        self.energy.value(x, data)
    }

    #[inline]
    fn jet(&self, x: &M::Point<f64>, data: &D) -> Jet1<M> {
        self.energy.jet(x, data)
    }
}

impl<M, D, H, P, G> SiteEnergy<M, D> for Gathered<H, P, G>
where
    M: Times<M>,
    H: LocalField<M, D>,
    P: ScalarField<Product<M, M>> + Sync,
    G: Fn(&M::Point<Real>, Real) -> Real + Sync,
{
    const GATHERS: bool = true;

    #[inline]
    fn weight(&self, x: &(M::Point<f64>, M::Point<f64>)) -> Jet1<Product<M, M>> {
        self.phi.jet1(x)
    }

    #[inline]
    fn embedded(&self, x: &M::Point<f64>, rho: f64) -> (Jet1<M>, f64) {
        let jet = ScalarField::<M>::jet1(&|x: &M::Point<Real>| (self.embed)(x, rho.into()), x);
        let along_rho = (self.embed)(&M::constant(x), Real::new(rho, 1.0, 0.0, 0.0)).eps1;
        (jet, along_rho)
    }
}
