//! Families with surroundings: ports, baths, a clock and noise, which depend on the parameters too.

use std::convert::Infallible;
use std::fmt;
use std::marker::PhantomData;
use std::sync::Arc;

use metriplectic_dynamics::exchange::{Bath, Named, Port};
use metriplectic_dynamics::family::Freeze;
use metriplectic_dynamics::noise::Fluctuation;
use metriplectic_dynamics::{
    Family, FamilyBuilder, Frozen, Parametrised, Surroundings, SystemBuilder, system::Point,
};
use metriplectic_fields::{Real, Scalar, ScalarField, Space, Velocity};
use metriplectic_manifolds::{Euclidean, Manifold, Product, Times};
use nalgebra::SVector;

use super::systems::{SystemAt, Systems};
use crate::noise::{Fluctuates, Noise};
use crate::open::{AtTime, OfTime, Opening, Timed, With};
use crate::step::{Element, Flow};

/// A function of the parameters.
type OfParameters<Q, const P: usize> = dyn Fn(&SVector<f64, P>) -> Q + Send + Sync;

/// Surroundings `Q` of a family, as a function of its parameters.
pub struct SurroundingsOf<Q, const P: usize> {
    at: Arc<OfParameters<Q, P>>,
    is_open: bool,
}

impl<Q, const P: usize> Clone for SurroundingsOf<Q, P> {
    fn clone(&self) -> Self {
        Self { at: Arc::clone(&self.at), ..*self }
    }
}

impl<Q, const P: usize> fmt::Debug for SurroundingsOf<Q, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SurroundingsOf").finish_non_exhaustive()
    }
}

impl<Q: 'static, const P: usize> SurroundingsOf<Q, P> {
    /// The surroundings with one part replaced.
    fn then<R>(
        self,
        is_open: bool,
        replace: impl Fn(Q, &SVector<f64, P>) -> R + Send + Sync + 'static,
    ) -> SurroundingsOf<R, P> {
        let before = self.at;
        let at = Arc::new(move |theta: &SVector<f64, P>| replace(before(theta), theta));
        SurroundingsOf { at, is_open: is_open || self.is_open }
    }
}

impl<Q, const P: usize> Surroundings for SurroundingsOf<Q, P> {
    type Built<Y> = OpenFamily<Y, Q, P>;

    fn around<Y>(self, family: Y) -> OpenFamily<Y, Q, P> {
        OpenFamily { family, surroundings: self }
    }

    fn is_open(&self) -> bool {
        self.is_open
    }
}

/// The surroundings of a family in the making: none yet, or [`SurroundingsOf`].
pub trait Depends<const P: usize> {
    /// The surroundings at one `θ`.
    type At: Opening + 'static;

    /// The surroundings as a function of the parameters.
    fn of(self) -> SurroundingsOf<Self::At, P>;
}

impl<const P: usize> Depends<P> for () {
    type At = ();

    fn of(self) -> SurroundingsOf<(), P> {
        SurroundingsOf { at: Arc::new(|_| ()), is_open: false }
    }
}

impl<Q: Opening + 'static, const P: usize> Depends<P> for SurroundingsOf<Q, P> {
    type At = Q;

    fn of(self) -> Self {
        self
    }
}

/// A bath that may depend on parameters: a [`Bath`], or a closure `|θ: &SVector<f64, P>| -> Bath`.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no bath of a family with {P} parameters",
    note = "write a `Bath`, or a closure `|theta: &SVector<f64, {P}>| Bath::at(..)..` that owns what it captures"
)]
pub trait BathOf<const P: usize>: Send + Sync + 'static {
    /// Its temperature.
    type Temperature: 'static;
    /// Its friction.
    type Friction: 'static;

    /// Returns the bath at values of the parameters.
    fn at(&self, theta: &SVector<f64, P>) -> Bath<Self::Temperature, Self::Friction>;
}

impl<T, R, const P: usize> BathOf<P> for Bath<T, R>
where
    T: Clone + Send + Sync + 'static,
    R: Clone + Send + Sync + 'static,
{
    type Temperature = T;
    type Friction = R;

    fn at(&self, _: &SVector<f64, P>) -> Self {
        self.clone()
    }
}

impl<F, T: 'static, R: 'static, const P: usize> BathOf<P> for F
where
    F: Fn(&SVector<f64, P>) -> Bath<T, R> + Send + Sync + 'static,
{
    type Temperature = T;
    type Friction = R;

    fn at(&self, theta: &SVector<f64, P>) -> Bath<T, R> {
        self(theta)
    }
}

/// An energy `H(t, x, θ)` from a closure; as a field on `M × Rᴾ` it is `H(0, x, θ)`.
pub struct InTimeOf<M, F> {
    energy: Arc<F>,
    space: PhantomData<fn(&M)>,
}

impl<M, F> fmt::Debug for InTimeOf<M, F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("InTimeOf").finish_non_exhaustive()
    }
}

#[diagnostic::do_not_recommend]
impl<M, F, const P: usize> ScalarField<Product<M, Euclidean<P>>> for InTimeOf<M, F>
where
    M: Times<Euclidean<P>>,
    F: Fn(Real, &M::Point<Real>, &SVector<Real, P>) -> Real,
{
    fn at<D: Scalar>(&self, x: &(M::Point<D>, SVector<D, P>)) -> D {
        let closure =
            |(x, t): &(M::Point<Real>, SVector<Real, P>)| (self.energy)(Real::from(0.0), x, t);
        ScalarField::<Product<M, Euclidean<P>>>::at(&closure, x)
    }
}

/// The closure `f` of the time, a point and parameters at one `θ`.
fn frozen<M, T, F, const P: usize>(f: &Arc<F>, theta: &SVector<Real, P>) -> OfTime<M, T>
where
    M: Space,
    F: Fn(Real, &M::Point<Real>, &SVector<Real, P>) -> T + Send + Sync + 'static,
{
    let (f, theta) = (Arc::clone(f), *theta);
    Box::new(move |t, x| f(t, x, &theta))
}

impl<M, F, const P: usize> Freeze<P> for InTimeOf<M, F>
where
    M: Space,
    F: Fn(Real, &M::Point<Real>, &SVector<Real, P>) -> Real + Send + Sync + 'static,
{
    type Narrow = AtTime<OfTime<M, Real>>;

    fn freeze(&self, theta: &SVector<Real, P>) -> Self::Narrow {
        AtTime(frozen::<M, _, _, P>(&self.energy, theta))
    }
}

/// The builder of a family with surroundings.
type Around<M, G, B, K, H, S, L, Q, const P: usize> = FamilyBuilder<
    SystemBuilder<Product<M, Euclidean<P>>, G, B, K, H, S, L, SurroundingsOf<Q, P>>,
    P,
>;

/// Gives a family surroundings, in any order with its other parts: an energy that depends on time, ports, baths and noise.
///
/// A member [`at`](OpenFamily::at) values of the parameters is the open system with these surroundings.
///
/// ```
/// use metriplectic_dynamics::{Bath, Contact, Family, Symplectic};
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{DormandPrince8, FamilySurroundings as _, Span, Tangents as _};
/// use metriplectic_manifolds::Euclidean;
/// use nalgebra::{Vector2, vector};
/// use num_dual::DualNum as _;
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// // A mass on a spring that is pushed, in air.
/// let pushed = Family::on(Euclidean::<2>)
///     .parameters(["push", "friction"])
///     .bracket(Symplectic)
///     .energy(|x: &Vector2<Real>, _: &Vector2<Real>| x.norm_squared() * 0.5)
///     .work("push", |t: Real, _: &Vector2<Real>, p: &Vector2<Real>| vector![0.0.into(), t.sin() * p.x])
///     .bath("air", |p: &Vector2<f64>| {
///         let rate = Real::from(p.y);
///         Bath::at(0.7).friction(move |_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
///             [Contact { rate, along: Vector2::<Real>::y() }]
///         })
///     })
///     .build()?;
/// let system = pushed.at(vector![0.4, 0.2]);
/// let start = system.start(vector![1.0, 0.0]);
/// let run = DormandPrince8.tangent(&system, start, Span::until(5.0).tolerance(1e-9))?;
/// let heat = run.last().heat_along("air").unwrap();
/// println!("∂Q/∂γ = {}", heat[heat.len() - 1]);
/// # assert!(heat[heat.len() - 1] < -0.1);
/// # Ok(())
/// # }
/// ```
#[allow(
    clippy::type_complexity,
    reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
)]
pub trait FamilySurroundings<M, G, B, K, H, S, L, Q, const P: usize>: Sized
where
    M: Manifold + Times<Euclidean<P>>,
    Q: Depends<P>,
{
    /// Sets an energy `H(t, x, θ)` that depends on time, from a closure `|t, x, θ| -> Real`.
    fn energy_in_time<F>(
        self,
        energy: F,
    ) -> Around<M, G, B, K, InTimeOf<M, F>, S, L, Timed<Q::At>, P>
    where
        F: Fn(Real, &M::Point<Real>, &SVector<Real, P>) -> Real + Send + Sync + 'static;

    /// Appends a port: a velocity `F(t, x, θ)` that does work and carries no entropy, from a closure `|t, x, θ| -> F`, as
    /// [`OpenBuilder::work`](crate::OpenBuilder::work) does.
    fn work<F>(
        self,
        name: impl Into<Arc<str>>,
        velocity: F,
    ) -> Around<M, G, B, K, H, S, L, With<Q::At, Port<OfTime<M, Velocity<M, Real>>>>, P>
    where
        F: Fn(Real, &M::Point<Real>, &SVector<Real, P>) -> Velocity<M, Real>
            + Send
            + Sync
            + 'static;

    /// Appends a [`Bath`], or the bath of a closure `|θ: &SVector<f64, P>| -> Bath`.
    fn bath<T: BathOf<P>>(
        self,
        name: impl Into<Arc<str>>,
        bath: T,
    ) -> Around<M, G, B, K, H, S, L, With<Q::At, Named<Bath<T::Temperature, T::Friction>>>, P>;

    /// Sets the strength of the noise, as [`NoiseBuilder::noise`](crate::NoiseBuilder::noise) does.
    fn noise<N>(self, noise: N) -> Around<M, G, B, K, H, S, L, Fluctuates<Q::At, N::Measure>, P>
    where
        N: Fluctuation<Measure: Clone + Send + Sync + 'static>;
}

impl<M, G, B, K, H, S, L, Q, const P: usize> FamilySurroundings<M, G, B, K, H, S, L, Q, P>
    for FamilyBuilder<SystemBuilder<Product<M, Euclidean<P>>, G, B, K, H, S, L, Q>, P>
where
    M: Manifold + Times<Euclidean<P>>,
    Q: Depends<P>,
{
    fn energy_in_time<F>(
        self,
        energy: F,
    ) -> Around<M, G, B, K, InTimeOf<M, F>, S, L, Timed<Q::At>, P>
    where
        F: Fn(Real, &M::Point<Real>, &SVector<Real, P>) -> Real + Send + Sync + 'static,
    {
        let energy = InTimeOf { energy: Arc::new(energy), space: PhantomData };
        self.with(|wide| {
            let timed = |surroundings: Q::At, _: &_| surroundings.open(|opened| opened.in_time());
            wide.energy(energy).surrounded(|surroundings| surroundings.of().then(true, timed))
        })
    }

    fn work<F>(
        self,
        name: impl Into<Arc<str>>,
        velocity: F,
    ) -> Around<M, G, B, K, H, S, L, With<Q::At, Port<OfTime<M, Velocity<M, Real>>>>, P>
    where
        F: Fn(Real, &M::Point<Real>, &SVector<Real, P>) -> Velocity<M, Real>
            + Send
            + Sync
            + 'static,
    {
        let (name, velocity) = (name.into(), Arc::new(velocity));
        let with = move |surroundings: Q::At, theta: &SVector<f64, P>| {
            let velocity = frozen::<M, _, _, P>(&velocity, &theta.map(Real::from));
            surroundings.open(|opened| opened.work(&name, velocity))
        };
        self.with(|wide| wide.surrounded(|surroundings| surroundings.of().then(true, with)))
    }

    fn bath<T: BathOf<P>>(
        self,
        name: impl Into<Arc<str>>,
        bath: T,
    ) -> Around<M, G, B, K, H, S, L, With<Q::At, Named<Bath<T::Temperature, T::Friction>>>, P> {
        let name = name.into();
        let with = move |surroundings: Q::At, theta: &SVector<f64, P>| {
            surroundings.open(|opened| opened.bath(&name, bath.at(theta)))
        };
        self.with(|wide| wide.surrounded(|surroundings| surroundings.of().then(true, with)))
    }

    fn noise<N>(self, noise: N) -> Around<M, G, B, K, H, S, L, Fluctuates<Q::At, N::Measure>, P>
    where
        N: Fluctuation<Measure: Clone + Send + Sync + 'static>,
    {
        let noise = Noise::of(noise);
        let with = move |surroundings: Q::At, _: &_| Fluctuates::new(surroundings, noise.clone());
        self.with(|wide| wide.surrounded(|surroundings| surroundings.of().then(false, with)))
    }
}

/// A [`Family`] `Y` with surroundings: ports, baths, an energy that depends on time, noise; built by the words of
/// [`FamilySurroundings`]. `Fit::of` and `Loss::of` take it as they take a closed family ([`Fittable`]).
pub struct OpenFamily<Y, Q, const P: usize> {
    family: Y,
    surroundings: SurroundingsOf<Q, P>,
}

impl<Y: Clone, Q, const P: usize> Clone for OpenFamily<Y, Q, P> {
    fn clone(&self) -> Self {
        Self { family: self.family.clone(), surroundings: self.surroundings.clone() }
    }
}

impl<Y: fmt::Debug, Q, const P: usize> fmt::Debug for OpenFamily<Y, Q, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("OpenFamily").field("family", &self.family).finish_non_exhaustive()
    }
}

impl<W, N, Q, const P: usize> OpenFamily<Family<W, P>, Q, P>
where
    Family<W, P>: Parametrised<P, System = Frozen<N, W, P>>,
    Q: Surroundings,
{
    /// Returns the names of the parameters.
    pub const fn names(&self) -> &[&'static str; P] {
        self.family.names()
    }

    /// Freezes the parameters: an [`OpenSystem`](crate::OpenSystem) or a [`Noisy`](crate::Noisy) one, with the bits of that whose
    /// closures capture `θ`. Its runs have derivatives along the parameters, by differences of steps ([`SystemAt`]).
    pub fn at(&self, theta: SVector<f64, P>) -> SystemAt<'_, Q::Built<N>> {
        let build = |theta: &SVector<f64, P>| {
            let closed = self.family.at_parameters(*theta).into_system();
            (self.surroundings.at)(theta).around(closed)
        };
        SystemAt::new(self.names(), theta, build(&theta), move |theta| Ok(build(theta)))
    }
}

/// Builds a member of a family at values of its `P` parameters.
pub type BuildMember<'a, S, const P: usize> =
    Box<dyn Fn(&SVector<f64, P>) -> Result<S, Infallible> + 'a>;

/// A family whose parameters are fitted: a closed one, whose members have exact derivatives along them, or one with surroundings.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no family with {P} parameters",
    note = "other systems with parameters are fitted by `Fit::of_systems`, from a closure that builds the system at values of them"
)]
pub trait Fittable<const P: usize> {
    /// The systems of a fit: a closed family itself, or [`Systems`] whose derivatives are differences of runs.
    type Systems<'a>
    where
        Self: 'a;
    /// A state at the start of a run.
    type Start;

    /// Returns the systems of a fit.
    fn systems(&self) -> Self::Systems<'_>;
}

impl<Y: Parametrised<P>, const P: usize> Fittable<P> for Y {
    type Systems<'a>
        = &'a Y
    where
        Self: 'a;
    type Start = Point<Y::System>;

    fn systems(&self) -> &Self {
        self
    }
}

impl<W, N, Q, const P: usize> Fittable<P> for OpenFamily<Family<W, P>, Q, P>
where
    Family<W, P>: Parametrised<P, System = Frozen<N, W, P>>,
    Q: Surroundings<Built<N>: Flow>,
{
    type Systems<'a>
        = Systems<BuildMember<'a, Q::Built<N>, P>, P>
    where
        Self: 'a;
    type Start = Element<Q::Built<N>>;

    fn systems(&self) -> Self::Systems<'_> {
        Systems::new(*self.names(), Box::new(|theta| Ok(self.at(*theta).into_system())))
    }
}
