//! The parts of a builder that make an open system.

use std::marker::PhantomData;
use std::sync::Arc;

use metriplectic_dynamics::exchange::{Bath, Named, Names, Port};
use metriplectic_dynamics::{Surroundings, SystemBuilder};
use metriplectic_fields::{Real, Velocity};
use metriplectic_manifolds::Manifold;

use super::clock::{AtTime, InTime, Still};
use super::system::OpenSystem;

/// The surroundings of a system in the making: a clock `C` in its energy, or [`Still`], and ports and baths `X`.
#[derive(Clone, Debug)]
pub struct Opened<C, X> {
    exchange: X,
    names: Names,
    clock: PhantomData<C>,
}

impl<C, X> Surroundings for Opened<C, X> {
    type Built<Y> = OpenSystem<Y, C, X>;

    fn around<Y>(self, system: Y) -> OpenSystem<Y, C, X> {
        OpenSystem::new(system, self.exchange, &self.names)
    }
}

/// Surroundings that may be opened further: none yet, or [`Opened`].
pub trait Opening: Sized {
    /// Whether the energy depends on time.
    type Clock;
    /// The ports and baths so far.
    type Exchange;

    /// The surroundings as they are opened.
    fn opened(self) -> Opened<Self::Clock, Self::Exchange>;
}

impl Opening for () {
    type Clock = Still;
    type Exchange = ();

    fn opened(self) -> Opened<Still, ()> {
        Opened { exchange: (), names: Vec::new(), clock: PhantomData }
    }
}

impl<C, X> Opening for Opened<C, X> {
    type Clock = C;
    type Exchange = X;

    fn opened(self) -> Self {
        self
    }
}

impl<C, X> Opened<C, X> {
    fn with<T>(mut self, name: &Arc<str>, part: T, is_bath: bool) -> Opened<C, (X, T)> {
        self.names.push((Arc::clone(name), is_bath));
        Opened { exchange: (self.exchange, part), names: self.names, clock: PhantomData }
    }
}

/// A builder with one more part of its surroundings.
type With<M, G, B, K, H, S, L, P, T> = SystemBuilder<
    M,
    G,
    B,
    K,
    H,
    S,
    L,
    Opened<<P as Opening>::Clock, (<P as Opening>::Exchange, T)>,
>;

/// Opens a system: its energy may depend on time, ports do work on it, and baths give heat to it.
///
/// ```
/// use metriplectic_dynamics::{Bath, Contact, Symplectic, System};
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{DormandPrince8, Method, OpenBuilder, Span};
/// use metriplectic_manifolds::Euclidean;
/// use nalgebra::{Vector2, vector};
/// use num_dual::DualNum;
/// # fn main() -> Result<(), metriplectic_integrators::Error> {
/// // A pendulum whose string is pulled, with a motor, in air at a temperature of 0.7.
/// let pendulum = System::on(Euclidean::<2>)
///     .bracket(Symplectic)
///     .energy_in_time(|t: Real, x: &Vector2<Real>| {
///         x.y * x.y * 0.5 - x.x.cos() * ((t * 0.9).cos() * 0.3 + 1.0)
///     })
///     .work("motor", |t: Real, _: &Vector2<Real>| vector![0.0.into(), (t * 1.3).sin() * 0.4])
///     .bath("air", Bath::at(0.7).friction(|_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
///         [Contact { rate: 0.08.into(), along: vector![0.0.into(), 1.0.into()] }]
///     }))
///     .build()?;
/// let span = Span::until(20.0).tolerance(1e-8);
/// let run = DormandPrince8.run(&pendulum, pendulum.start(vector![0.5, 0.0]), span)?;
/// assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
/// let state = &run.last().point;
/// let change = pendulum.energy_at(state) - run.certificate().initial_energy;
/// let ledger = &state.ledger;
/// let flowed = ledger.parameter_work() + ledger.work("motor").unwrap() + ledger.heat("air").unwrap();
/// assert!((change - flowed).abs() < 1e-13);
/// # Ok(())
/// # }
/// ```
#[allow(
    clippy::type_complexity,
    reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
)]
pub trait OpenBuilder<M: Manifold, G, B, K, H, S, L, P: Opening>: Sized {
    /// Sets an energy `H(t, x)` that depends on time, from a closure `|t, x| -> Real`.
    fn energy_in_time<F>(
        self,
        energy: F,
    ) -> SystemBuilder<M, G, B, K, AtTime<F>, S, L, Opened<InTime, P::Exchange>>
    where
        F: Fn(Real, &M::Point<Real>) -> Real;

    /// Appends a port: a velocity `F(t, x)` that does the work `⟨dH, F⟩` and carries no entropy, `⟨dS, F⟩ = 0`, from a
    /// closure `|t, x| -> F`. A feedback law is a port too.
    fn work<F>(
        self,
        name: impl Into<Arc<str>>,
        velocity: F,
    ) -> With<M, G, B, K, H, S, L, P, Port<F>>
    where
        F: Fn(Real, &M::Point<Real>) -> Velocity<M, Real>;

    /// Appends a [`Bath`].
    fn bath<T, R>(
        self,
        name: impl Into<Arc<str>>,
        bath: Bath<T, R>,
    ) -> With<M, G, B, K, H, S, L, P, Named<Bath<T, R>>>;
}

impl<M: Manifold, G, B, K, H, S, L, P: Opening> OpenBuilder<M, G, B, K, H, S, L, P>
    for SystemBuilder<M, G, B, K, H, S, L, P>
{
    fn energy_in_time<F>(
        self,
        energy: F,
    ) -> SystemBuilder<M, G, B, K, AtTime<F>, S, L, Opened<InTime, P::Exchange>>
    where
        F: Fn(Real, &M::Point<Real>) -> Real,
    {
        self.energy(AtTime(energy)).surrounded(|surroundings| {
            let Opened { exchange, names, .. } = surroundings.opened();
            Opened { exchange, names, clock: PhantomData }
        })
    }

    fn work<F>(
        self,
        name: impl Into<Arc<str>>,
        velocity: F,
    ) -> With<M, G, B, K, H, S, L, P, Port<F>>
    where
        F: Fn(Real, &M::Point<Real>) -> Velocity<M, Real>,
    {
        let name = name.into();
        self.surrounded(|surroundings| {
            let port = Port::new(Arc::clone(&name), velocity);
            surroundings.opened().with(&name, port, false)
        })
    }

    fn bath<T, R>(
        self,
        name: impl Into<Arc<str>>,
        bath: Bath<T, R>,
    ) -> With<M, G, B, K, H, S, L, P, Named<Bath<T, R>>> {
        let name = name.into();
        self.surrounded(|surroundings| {
            surroundings.opened().with(&name, Named::new(Arc::clone(&name), bath), true)
        })
    }
}
