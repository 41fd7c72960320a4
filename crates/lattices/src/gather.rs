//! Energies and entropies that depend on a sum over the neighbours of a site: embedded atoms, smoothed densities.
//!
//! With a function `φ` of a bond and `ρ_i = Σ φ` over the bonds of site `i`, the function `Σ_i g(x_i, ρ_i)` is no sum over
//! bonds. Its differential takes one more pass over them: with `λ_i = ∂g/∂ρ(x_i, ρ_i)`,
//!
//! ```math
//! w_i = \partial_x g(x_i, \rho_i) + \sum_{j} (\lambda_i + \lambda_j)\, \partial_{x_i} \varphi .
//! ```

use metriplectic_fields::{Column, Jet1, Real, ScalarField};
use metriplectic_manifolds::{Product, Times};

use crate::fields::Absent;

/// A function of a site and of a sum over its bonds.
pub trait Gather<M: Times<M>>: Sync {
    /// True if there is one; a function that is not there is zero.
    const PRESENT: bool = true;

    /// Computes the function `φ` of a bond and its differential.
    fn weight(&self, x: &(M::Point<f64>, M::Point<f64>)) -> Jet1<Product<M, M>>;

    /// Computes `g(x, ρ)` with its differential along `x`, and `∂g/∂ρ`.
    fn embedded(&self, x: &M::Point<f64>, rho: f64) -> Embedded<M>;
}

/// A function `g(x, ρ)` with its derivatives.
#[derive(Clone, Debug)]
pub struct Embedded<M: Times<M>> {
    /// The value, and the differential along `x`.
    pub jet: Jet1<M>,
    /// The derivative along `ρ`.
    pub along_rho: f64,
}

impl<M: Times<M>> Gather<M> for Absent {
    const PRESENT: bool = false;

    #[inline]
    fn weight(&self, _: &(M::Point<f64>, M::Point<f64>)) -> Jet1<Product<M, M>> {
        Jet1 { value: 0.0, df: Column::zero() }
    }

    #[inline]
    fn embedded(&self, _: &M::Point<f64>, _: f64) -> Embedded<M> {
        Embedded { jet: Jet1 { value: 0.0, df: Column::zero() }, along_rho: 0.0 }
    }
}

/// The sums over bonds that energy and entropy gather.
#[derive(Clone, Copy, Debug, Default)]
pub struct Gathers<E, S> {
    pub(crate) energy: E,
    pub(crate) entropy: S,
}

/// A function `g(x_i, Σ φ)` of two closures.
#[derive(Clone, Copy, Debug)]
pub struct Gathered<P, G> {
    pub(crate) phi: P,
    pub(crate) embed: G,
}

impl<M, P, G> Gather<M> for Gathered<P, G>
where
    M: Times<M>,
    P: ScalarField<Product<M, M>> + Sync,
    G: Fn(&M::Point<Real>, Real) -> Real + Sync,
{
    #[inline]
    fn weight(&self, x: &(M::Point<f64>, M::Point<f64>)) -> Jet1<Product<M, M>> {
        self.phi.jet1(x)
    }

    #[inline]
    fn embedded(&self, x: &M::Point<f64>, rho: f64) -> Embedded<M> {
        let jet = ScalarField::<M>::jet1(&|x: &M::Point<Real>| (self.embed)(x, rho.into()), x);
        let along_rho = (self.embed)(&M::constant(x), Real::new(rho, 1.0, 0.0, 0.0)).eps1;
        Embedded { jet, along_rho }
    }
}
