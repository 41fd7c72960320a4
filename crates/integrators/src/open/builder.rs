//! The parts of a builder that make an open system.

use std::marker::PhantomData;
use std::sync::Arc;

use metriplectic_dynamics::exchange::{Bath, Named, Names, Port};
use metriplectic_dynamics::{Surroundings, SystemBuilder};
use metriplectic_fields::{Real, Velocity};
use metriplectic_manifolds::Manifold;

use super::clock::{AtTime, InTime, Still};
use super::system::OpenSystem;
use crate::noise::Fluctuates;

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

/// Surroundings that may be opened further: none yet, [`Opened`], or these with noise.
pub trait Opening: Sized {
    /// Whether the energy depends on time.
    type Clock;
    /// The ports and baths so far.
    type Exchange;
    /// These surroundings with another clock, and with more ports and baths.
    type With<C, X>;

    /// Replaces the clock, the ports and the baths.
    fn open<C, X>(
        self,
        replace: impl FnOnce(Opened<Self::Clock, Self::Exchange>) -> Opened<C, X>,
    ) -> Self::With<C, X>;
}

impl Opening for () {
    type Clock = Still;
    type Exchange = ();
    type With<C, X> = Opened<C, X>;

    fn open<C, X>(self, replace: impl FnOnce(Opened<Still, ()>) -> Opened<C, X>) -> Opened<C, X> {
        replace(Opened { exchange: (), names: Vec::new(), clock: PhantomData })
    }
}

impl<D, Z> Opening for Opened<D, Z> {
    type Clock = D;
    type Exchange = Z;
    type With<C, X> = Opened<C, X>;

    fn open<C, X>(self, replace: impl FnOnce(Self) -> Opened<C, X>) -> Opened<C, X> {
        replace(self)
    }
}

impl<P: Opening, U> Opening for Fluctuates<P, U> {
    type Clock = P::Clock;
    type Exchange = P::Exchange;
    type With<C, X> = Fluctuates<P::With<C, X>, U>;

    fn open<C, X>(
        self,
        replace: impl FnOnce(Opened<P::Clock, P::Exchange>) -> Opened<C, X>,
    ) -> Self::With<C, X> {
        self.map(|surroundings| surroundings.open(replace))
    }
}

impl<C, X> Opened<C, X> {
    /// The surroundings with an energy that depends on time.
    pub(crate) fn in_time(self) -> Opened<InTime, X> {
        Opened { exchange: self.exchange, names: self.names, clock: PhantomData }
    }

    /// The surroundings with one more port.
    pub(crate) fn work<F>(self, name: &Arc<str>, velocity: F) -> Opened<C, (X, Port<F>)> {
        self.with(name, Port::new(Arc::clone(name), velocity), false)
    }

    /// The surroundings with one more bath.
    pub(crate) fn bath<B>(self, name: &Arc<str>, bath: B) -> Opened<C, (X, Named<B>)> {
        self.with(name, Named::new(Arc::clone(name), bath), true)
    }

    fn with<T>(mut self, name: &Arc<str>, part: T, is_bath: bool) -> Opened<C, (X, T)> {
        self.names.push((Arc::clone(name), is_bath));
        Opened { exchange: (self.exchange, part), names: self.names, clock: PhantomData }
    }
}

/// Surroundings with one more part.
pub type With<P, T> = <P as Opening>::With<<P as Opening>::Clock, (<P as Opening>::Exchange, T)>;
/// Surroundings with a clock.
pub type Timed<P> = <P as Opening>::With<InTime, <P as Opening>::Exchange>;

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
    fn energy_in_time<F>(self, energy: F) -> SystemBuilder<M, G, B, K, AtTime<F>, S, L, Timed<P>>
    where
        F: Fn(Real, &M::Point<Real>) -> Real;

    /// Appends a port: a velocity `F(t, x)` that does the work `⟨dH, F⟩` and carries no entropy, `⟨dS, F⟩ = 0`, from a
    /// closure `|t, x| -> F`. A feedback law is a port too.
    fn work<F>(
        self,
        name: impl Into<Arc<str>>,
        velocity: F,
    ) -> SystemBuilder<M, G, B, K, H, S, L, With<P, Port<F>>>
    where
        F: Fn(Real, &M::Point<Real>) -> Velocity<M, Real>;

    /// Appends a [`Bath`].
    fn bath<T, R>(
        self,
        name: impl Into<Arc<str>>,
        bath: Bath<T, R>,
    ) -> SystemBuilder<M, G, B, K, H, S, L, With<P, Named<Bath<T, R>>>>;
}

impl<M: Manifold, G, B, K, H, S, L, P: Opening> OpenBuilder<M, G, B, K, H, S, L, P>
    for SystemBuilder<M, G, B, K, H, S, L, P>
{
    fn energy_in_time<F>(self, energy: F) -> SystemBuilder<M, G, B, K, AtTime<F>, S, L, Timed<P>>
    where
        F: Fn(Real, &M::Point<Real>) -> Real,
    {
        self.energy(AtTime(energy)).surrounded(|surroundings| surroundings.open(Opened::in_time))
    }

    fn work<F>(
        self,
        name: impl Into<Arc<str>>,
        velocity: F,
    ) -> SystemBuilder<M, G, B, K, H, S, L, With<P, Port<F>>>
    where
        F: Fn(Real, &M::Point<Real>) -> Velocity<M, Real>,
    {
        let name = name.into();
        self.surrounded(|surroundings| surroundings.open(|opened| opened.work(&name, velocity)))
    }

    fn bath<T, R>(
        self,
        name: impl Into<Arc<str>>,
        bath: Bath<T, R>,
    ) -> SystemBuilder<M, G, B, K, H, S, L, With<P, Named<Bath<T, R>>>> {
        let name = name.into();
        self.surrounded(|surroundings| surroundings.open(|opened| opened.bath(&name, bath)))
    }
}
