//! The builder of a [`Family`].

use std::fmt;
use std::sync::Arc;

use metriplectic_fields::{Dimension as _, Form, Plus, Real, ScalarField, Velocity};
use metriplectic_manifolds::{
    Canonical, Euclidean, Inert, LieDual, Manifold, ParametricMetric, Product, Riemannian, Times,
};
use nalgebra::{Const, SVector};

use super::{BracketOf, Family, FieldOf, ForcedOf, OfPair, OnFirst};
use crate::bracket::{Bracket, LiePoisson, NaturalBracket, Zero};
use crate::builder::{Built, NoEnergy, Surroundings, SystemBuilder};
use crate::dissipation::{Choice, Dissipation, Given, MetricDissipation, NoDissipation, Scaled};
use crate::invariants::{Casimir, Invariants, Momentum};
use crate::metriplectic::SecondLaw;
use crate::system::{BuildError, NoEntropy, System};

/// A family in the making: as a [`SystemBuilder`], with closures of two arguments, `|x, θ|`. The trait `FamilySurroundings` of
/// the integrators gives it ports, baths, an energy that depends on time, and noise.
#[must_use = "a builder does nothing until `build` is called"]
pub struct FamilyBuilder<Y, const P: usize> {
    wide: Y,
    names: [&'static str; P],
}

impl<Y, const P: usize> fmt::Debug for FamilyBuilder<Y, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FamilyBuilder").field("names", &self.names).finish_non_exhaustive()
    }
}

/// The manifold of a family whose parameters have not been named yet.
#[derive(Clone, Copy, Debug)]
pub struct Unnamed<M>(M);

/// A builder on `M × Rᴾ`, with surroundings `Q`.
type Wide<M, G, B, K, H, S, L, const P: usize, Q = ()> =
    SystemBuilder<Product<M, Euclidean<P>>, G, B, K, H, S, L, Q>;

impl Family<(), 0> {
    /// Starts a family of systems on a manifold, with its canonical metric and its natural bracket.
    pub const fn on<M: NaturalBracket>(manifold: M) -> Unnamed<M> {
        Unnamed(manifold)
    }
}

/// A family without energy and entropy.
type Bare<M, const P: usize> = FamilyBuilder<
    Wide<
        M,
        (Canonical, Inert),
        (<M as NaturalBracket>::Bracket, Zero),
        NoDissipation,
        NoEnergy,
        NoEntropy,
        (),
        P,
    >,
    P,
>;

impl<M: NaturalBracket> Unnamed<M> {
    /// Names the parameters, which are as many.
    pub fn parameters<const P: usize>(self, names: [&'static str; P]) -> Bare<M, P>
    where
        M: Times<Euclidean<P>>,
    {
        let bracket = (self.0.natural_bracket(), Zero);
        let wide = System::on(Product(self.0, Euclidean::<P>));
        FamilyBuilder { wide: wide.any_metric((Canonical, Inert)).bracket(bracket), names }
    }
}

impl<M, G, B, K, H, S, L, Q, const P: usize> FamilyBuilder<Wide<M, G, B, K, H, S, L, P, Q>, P>
where
    M: Manifold + Times<Euclidean<P>>,
{
    /// Replaces the builder on `M × Rᴾ`, on which the parts of the family are those of a system.
    #[doc(hidden)]
    pub fn with<T>(
        self,
        replace: impl FnOnce(Wide<M, G, B, K, H, S, L, P, Q>) -> T,
    ) -> FamilyBuilder<T, P> {
        FamilyBuilder { wide: replace(self.wide), names: self.names }
    }

    /// Sets the energy `H(x, θ)`, a closure `|x, θ| -> Real`.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn energy<F>(self, energy: F) -> FamilyBuilder<Wide<M, G, B, K, OfPair<F>, S, L, P, Q>, P>
    where
        F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Real,
    {
        self.with(|wide| wide.energy(OfPair(Arc::new(energy))))
    }

    /// Sets the entropy `S(x, θ)`, a closure `|x, θ| -> Real`, as [`SystemBuilder::entropy`] does.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn entropy<F>(
        self,
        entropy: F,
    ) -> FamilyBuilder<Wide<M, G, B, K::WithEntropy, H, OfPair<F>, L, P, Q>, P>
    where
        F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Real,
        K: Choice,
    {
        self.with(|wide| wide.entropy(OfPair(Arc::new(entropy))))
    }

    /// Sets the metric on `M`, which does not depend on the parameters.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn metric<F: Riemannian<M>>(
        self,
        metric: F,
    ) -> FamilyBuilder<Wide<M, (F, Inert), B, K, H, S, L, P, Q>, P> {
        self.with(|wide| wide.metric((metric, Inert)))
    }

    /// Sets the metric by a closure `|x, θ| -> g(x, θ)`, with the matrices of
    /// [`Metric::field`](metriplectic_manifolds::Metric::field). Where `g(x, θ)` is not symmetric and positive, a run is
    /// [`MetricError`](metriplectic_manifolds::MetricError).
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn field_metric<F>(
        self,
        metric: F,
    ) -> FamilyBuilder<Wide<M, ParametricMetric<F>, B, K, H, S, L, P, Q>, P>
    where
        F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Form<M, Real>,
    {
        self.with(|wide| wide.any_metric(ParametricMetric::new(metric)))
    }

    /// Sets the bracket by a closure `|x, θ| -> Π(x, θ)`, as [`Poisson::field`](crate::Poisson::field) has it.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn field_bracket<F>(
        self,
        bracket: F,
    ) -> FamilyBuilder<Wide<M, G, BracketOf<F>, K, H, S, L, P, Q>, P>
    where
        F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Form<M, Real>,
    {
        self.with(|wide| wide.bracket(BracketOf::new(bracket, true)))
    }

    /// Sets a skew tensor that need not be Poisson by a closure `|x, θ| -> Π(x, θ)`, as
    /// [`AlmostPoisson::field`](crate::AlmostPoisson::field) has it.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn almost_field_bracket<F>(
        self,
        bracket: F,
    ) -> FamilyBuilder<Wide<M, G, BracketOf<F>, K, H, S, L, P, Q>, P>
    where
        F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Form<M, Real>,
    {
        self.with(|wide| wide.bracket(BracketOf::new(bracket, false)))
    }

    /// Sets the dissipation `κ(x, θ) K` of the metric times a closure `|x, θ| -> κ ≥ 0`, as
    /// [`MetricDissipation::scaled`] has it.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn metric_dissipation<F>(
        self,
        kappa: F,
    ) -> FamilyBuilder<Wide<M, G, B, Given<Scaled<OfPair<F>, MetricDissipation>>, H, S, L, P, Q>, P>
    where
        F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Real,
    {
        self.with(|wide| wide.dissipation(MetricDissipation::scaled(OfPair(Arc::new(kappa)))))
    }

    /// Sets the bracket on `M`, which does not depend on the parameters.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn bracket<F>(
        self,
        bracket: F,
    ) -> FamilyBuilder<Wide<M, G, (F, Zero), K, H, S, L, P, Q>, P> {
        self.with(|wide| wide.bracket((bracket, Zero)))
    }

    /// Sets a dissipation on `M` that does not depend on the parameters.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn dissipation<F>(
        self,
        dissipation: F,
    ) -> FamilyBuilder<Wide<M, G, B, Given<OnFirst<F>>, H, S, L, P, Q>, P> {
        self.with(|wide| wide.dissipation(OnFirst(dissipation)))
    }

    /// Sets the dissipation by a closure `|x, w, θ| -> K` that annihilates `w`, as
    /// [`FieldDissipation`](crate::FieldDissipation) has it.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn field_dissipation<F>(
        self,
        dissipation: F,
    ) -> FamilyBuilder<Wide<M, G, B, Given<FieldOf<F>>, H, S, L, P, Q>, P>
    where
        F: Fn(&M::Point<Real>, &Velocity<M, Real>, &SVector<Real, P>) -> Form<M, Real>,
    {
        self.with(|wide| wide.dissipation(FieldOf(Arc::new(dissipation))))
    }

    /// Appends a further Casimir `C(x, θ)`, as [`SystemBuilder::casimir`] does.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn casimir<F>(
        self,
        casimir: F,
    ) -> FamilyBuilder<Wide<M, G, B, K, H, S, (L, Casimir<OfPair<F>>), P, Q>, P>
    where
        F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Real,
    {
        self.with(|wide| wide.casimir(OfPair(Arc::new(casimir))))
    }

    /// Appends a momentum `J(x, θ)`, as [`SystemBuilder::momentum`] does.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn momentum<F>(
        self,
        momentum: F,
    ) -> FamilyBuilder<Wide<M, G, B, K, H, S, (L, Momentum<OfPair<F>>), P, Q>, P>
    where
        F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Real,
    {
        self.with(|wide| wide.momentum(OfPair(Arc::new(momentum))))
    }

    /// Chooses the scheme that treats the entropy.
    pub fn second_law(self, second_law: SecondLaw) -> Self {
        self.with(|wide| wide.second_law(second_law))
    }

    /// Checks the structure and finishes the family.
    ///
    /// # Errors
    ///
    /// [`BuildError`] if the parts do not make a system.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn build(
        self,
    ) -> Result<Q::Built<Family<Built<Product<M, Euclidean<P>>, G, B, K, H, S, L>, P>>, BuildError>
    where
        Q: Surroundings,
        G: Riemannian<Product<M, Euclidean<P>>>,
        B: Bracket<Product<M, Euclidean<P>>, G>,
        K: Choice<Dissipation: Dissipation<Product<M, Euclidean<P>>, G>>,
        H: ScalarField<Product<M, Euclidean<P>>>,
        S: ScalarField<Product<M, Euclidean<P>>>,
        L: Invariants<Product<M, Euclidean<P>>>,
    {
        let (count, dimension) = (L::COUNT, M::Dim::LEN);
        if count > 0 && count >= dimension {
            return Err(BuildError::TooManyInvariants { count, dimension });
        }
        let (wide, surroundings) = self.wide.finish()?;
        Ok(surroundings.around(Family::new(wide, self.names)))
    }
}

impl<G, K, H, S, L, Q, const N: usize, const P: usize>
    FamilyBuilder<Wide<LieDual<N>, G, (LiePoisson, Zero), K, H, S, L, P, Q>, P>
where
    Const<N>: Plus<Const<P>>,
    K: Choice,
{
    /// Sets the force by a closure `|ξ, θ| -> F(ξ, θ)` of the equations `μ' = ad*_ξ(μ + F(ξ, θ))`, as
    /// [`SystemBuilder::force`] does.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn force<F>(
        self,
        force: F,
    ) -> FamilyBuilder<Wide<LieDual<N>, G, ForcedOf<F>, K::WithForce, H, S, L, P, Q>, P>
    where
        F: Fn(&SVector<Real, N>, &SVector<Real, P>) -> SVector<Real, N>,
    {
        self.with(|wide| wide.bracket(ForcedOf(Arc::new(force))).choose(K::with_force))
    }
}
