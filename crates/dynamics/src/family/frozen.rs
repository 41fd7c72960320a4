//! A family at one `θ`, and the systems whose runs have a tangent.

use std::fmt;
use std::sync::Arc;

use metriplectic_fields::{Real, ScalarField, Space};
use metriplectic_manifolds::{Euclidean, Manifold, Product, Riemannian, Times};
use nalgebra::SVector;

use crate::bracket::Bracket;
use crate::dissipation::Dissipation;
use crate::invariants::Invariants;
use crate::metriplectic::{Metriplectic, Point, SecondLaw};
use crate::parts_of;
use crate::system::{Erase, System};

/// A [`Family`](crate::Family) at one `θ`: a system on `M`, which remembers its parameters.
pub struct Frozen<N, Y, const P: usize> {
    pub(super) narrow: N,
    pub(super) wide: Arc<Y>,
    pub(super) theta: SVector<f64, P>,
    pub(super) names: [&'static str; P],
    pub(super) tensors_depend: bool,
}

impl<N, Y, const P: usize> fmt::Debug for Frozen<N, Y, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Frozen").field("theta", &self.theta).finish_non_exhaustive()
    }
}

impl<N: Clone, Y, const P: usize> Clone for Frozen<N, Y, P> {
    fn clone(&self) -> Self {
        Self { narrow: self.narrow.clone(), wide: Arc::clone(&self.wide), ..*self }
    }
}

impl<N, Y, const P: usize> Frozen<N, Y, P> {
    /// The parameters.
    pub const fn theta(&self) -> &SVector<f64, P> {
        &self.theta
    }

    /// Returns the system without its parameters.
    pub fn into_system(self) -> N {
        self.narrow
    }
}

impl<N: Erase, Y: Erase + Clone, const P: usize> Erase for Frozen<N, Y, P> {
    type Erased = Frozen<N::Erased, Y::Erased, P>;

    fn erased(self) -> Self::Erased {
        let Self { narrow, wide, theta, names, tensors_depend } = self;
        let wide = Arc::new(Arc::unwrap_or_clone(wide).erased());
        Frozen { narrow: narrow.erased(), wide, theta, names, tensors_depend }
    }
}

impl<N: Metriplectic, Y, const P: usize> Metriplectic for Frozen<N, Y, P> {
    parts_of!(self.narrow: N {
        manifold: Manifold, metric: Metric, bracket: Bracket, dissipation: Dissipation, energy: Energy, entropy: Entropy,
        invariants: Invariants,
    });

    fn second_law(&self) -> SecondLaw {
        self.narrow.second_law()
    }
}

/// A point of a system at the scalar of closures.
pub type RealPoint<Y> = <<Y as Metriplectic>::Manifold as Space>::Point<Real>;

/// A system whose runs can be differentiated along their start and along parameters.
///
/// The first directions of the [`wide`](Self::wide) system are those of the system itself; those of the parameters stand
/// behind them, and nothing moves them.
pub trait Differentiable: Metriplectic {
    /// The system with its parameters as a factor; the system itself if there are none.
    type Wide: Metriplectic;

    /// The wide system.
    fn wide(&self) -> &Self::Wide;

    /// The state of the wide system.
    fn widened(&self, x: &Point<Self>) -> Point<Self::Wide>;

    /// The point of the wide system with the state `x` and the parameters `θ + ε₁ e_i + ε₂ e_j`; an index beyond the number of
    /// the parameters moves nothing.
    fn seeded(&self, x: RealPoint<Self>, along: [usize; 2]) -> RealPoint<Self::Wide>;

    /// The names of the parameters.
    fn parameters(&self) -> &[&'static str];

    /// Returns whether the metric, the bracket or the dissipation depends on the parameters, and not the fields alone. If it does
    /// not, the derivative of a velocity along a parameter is that along covectors.
    fn tensors_depend(&self) -> bool {
        true
    }
}

impl<M, G, B, K, H, S, L> Differentiable for System<M, G, B, K, H, S, L>
where
    M: Manifold,
    G: Riemannian<M>,
    B: Bracket<M, G>,
    K: Dissipation<M, G>,
    H: ScalarField<M>,
    S: ScalarField<M>,
    L: Invariants<M>,
{
    type Wide = Self;

    fn wide(&self) -> &Self {
        self
    }

    fn widened(&self, x: &M::Point<f64>) -> M::Point<f64> {
        x.clone()
    }

    fn seeded(&self, x: M::Point<Real>, _: [usize; 2]) -> M::Point<Real> {
        x
    }

    fn parameters(&self) -> &[&'static str] {
        &[]
    }
}

impl<M, N, Y, const P: usize> Differentiable for Frozen<N, Y, P>
where
    M: Manifold + Times<Euclidean<P>>,
    N: Metriplectic<Manifold = M>,
    Y: Metriplectic<Manifold = Product<M, Euclidean<P>>>,
{
    type Wide = Y;

    fn wide(&self) -> &Y {
        &self.wide
    }

    fn widened(&self, x: &M::Point<f64>) -> (M::Point<f64>, SVector<f64, P>) {
        (x.clone(), self.theta)
    }

    #[inline]
    fn seeded(&self, x: M::Point<Real>, [i, j]: [usize; 2]) -> (M::Point<Real>, SVector<Real, P>) {
        let along = |k, direction| if k == direction { 1.0 } else { 0.0 };
        let theta = |k, _| Real::new(self.theta[k], along(k, i), along(k, j), 0.0);
        (x, SVector::from_fn(theta))
    }

    fn parameters(&self) -> &[&'static str] {
        &self.names
    }

    fn tensors_depend(&self) -> bool {
        self.tensors_depend
    }
}
