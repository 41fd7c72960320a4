//! Parts of a family, frozen at one `θ`.

use metriplectic_fields::Real;
use metriplectic_manifolds::parametric_metric::MetricAtParameters;
use metriplectic_manifolds::{Inert, ParametricMetric};
use nalgebra::SVector;

use super::{AtParameters, OfPair};
use crate::bracket::Zero;
use crate::dissipation::{MetricDissipation, NoDissipation, Scaled};
use crate::invariants::{Casimir, Momentum};
use crate::system::NoEntropy;

/// A part of a system on `M × Rᴾ` that is a part of one on `M` where the second factor is known.
pub trait Freeze<const P: usize> {
    /// The part of the system on `M`.
    type Narrow;

    /// Says whether a metric, a bracket or a dissipation depends on the parameters. A field always may.
    const DEPENDS: bool = true;

    /// Freezes the part at `θ`.
    fn freeze(&self, theta: &SVector<Real, P>) -> Self::Narrow;
}

/// A metric that does not depend on the parameters.
impl<G: Clone, const P: usize> Freeze<P> for (G, Inert) {
    type Narrow = G;

    const DEPENDS: bool = false;

    fn freeze(&self, _: &SVector<Real, P>) -> G {
        self.0.clone()
    }
}

/// A metric by a closure `|x, θ| -> g`.
impl<F, const P: usize> Freeze<P> for ParametricMetric<F> {
    type Narrow = MetricAtParameters<F, P>;

    fn freeze(&self, theta: &SVector<Real, P>) -> Self::Narrow {
        self.at_parameters(theta)
    }
}

/// The dissipation of the metric times a closure `|x, θ| -> κ`.
impl<F, const P: usize> Freeze<P> for Scaled<OfPair<F>, MetricDissipation> {
    type Narrow = Scaled<AtParameters<F, P>, MetricDissipation>;

    fn freeze(&self, theta: &SVector<Real, P>) -> Self::Narrow {
        Scaled(self.0.freeze(theta), self.1)
    }
}

/// A bracket that does not depend on the parameters.
impl<B: Clone, const P: usize> Freeze<P> for (B, Zero) {
    type Narrow = B;

    const DEPENDS: bool = false;

    fn freeze(&self, _: &SVector<Real, P>) -> B {
        self.0.clone()
    }
}

/// Parts that know no manifold.
macro_rules! the_same_anywhere {
    ($($part:ty),+) => {$(
        impl<const P: usize> Freeze<P> for $part {
            type Narrow = Self;

            const DEPENDS: bool = false;

            fn freeze(&self, _: &SVector<Real, P>) -> Self {
                *self
            }
        }
    )+};
}
the_same_anywhere!(NoDissipation, MetricDissipation, NoEntropy, ());

impl<L: Freeze<P>, F: Freeze<P>, const P: usize> Freeze<P> for (L, Casimir<F>) {
    type Narrow = (L::Narrow, Casimir<F::Narrow>);

    fn freeze(&self, theta: &SVector<Real, P>) -> Self::Narrow {
        (self.0.freeze(theta), Casimir(self.1.0.freeze(theta)))
    }
}

impl<L: Freeze<P>, F: Freeze<P>, const P: usize> Freeze<P> for (L, Momentum<F>) {
    type Narrow = (L::Narrow, Momentum<F::Narrow>);

    fn freeze(&self, theta: &SVector<Real, P>) -> Self::Narrow {
        (self.0.freeze(theta), Momentum(self.1.0.freeze(theta)))
    }
}
