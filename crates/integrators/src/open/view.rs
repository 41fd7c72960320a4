//! An open system between two times, as a system that does not depend on time.

use std::marker::PhantomData;

use metriplectic_dynamics::exchange::{Driven, Exchange};
use metriplectic_dynamics::{Metriplectic, SecondLaw, parts_of};
use metriplectic_fields::{
    Evaluation, Jet1, Jet2, Matrix, Real, Scalar, ScalarField, Space, Vector,
};

use super::clock::Clock;

/// The energy `½ (H(t, x) + H(t', x))`.
#[derive(Debug)]
pub struct EnergyAt<'a, C, H> {
    energy: &'a H,
    times: [f64; 2],
    clock: PhantomData<C>,
}

impl<C, H> Clone for EnergyAt<'_, C, H> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<C, H> Copy for EnergyAt<'_, C, H> {}

#[diagnostic::do_not_recommend]
impl<M: Space, C: Clock<M, H>, H> ScalarField<M> for EnergyAt<'_, C, H> {
    #[inline]
    fn at<D: Scalar>(&self, x: &M::Point<D>) -> D {
        C::at(self.energy, self.times, x)
    }

    #[inline]
    fn at_real(&self, x: &M::Point<Real>) -> Real {
        C::at_real(self.energy, self.times, x)
    }

    fn evaluation(&self, x: &M::Point<f64>) -> Evaluation {
        C::still(self.energy).map_or(Evaluation::Function, |still| still.evaluation(x))
    }

    #[inline]
    fn jet1(&self, x: &M::Point<f64>) -> Jet1<M> {
        let mean = |x: &M::Point<Real>| self.at_real(x);
        C::still(self.energy)
            .map_or_else(|| ScalarField::<M>::jet1(&mean, x), |still| still.jet1(x))
    }

    #[inline]
    fn jet2(&self, x: &M::Point<f64>) -> Jet2<M> {
        let mean = |x: &M::Point<Real>| self.at_real(x);
        C::still(self.energy)
            .map_or_else(|| ScalarField::<M>::jet2(&mean, x), |still| still.jet2(x))
    }

    #[inline]
    fn differential_at(&self, x: &M::Point<f64>, q: &Vector<M>) -> Vector<M> {
        let mean = |x: &M::Point<Real>| self.at_real(x);
        C::still(self.energy).map_or_else(
            || ScalarField::<M>::differential_at(&mean, x, q),
            |still| still.differential_at(x, q),
        )
    }

    #[inline]
    fn hessian_at(&self, x: &M::Point<f64>, q: &Vector<M>) -> Matrix<M> {
        let mean = |x: &M::Point<Real>| self.at_real(x);
        C::still(self.energy).map_or_else(
            || ScalarField::<M>::hessian_at(&mean, x, q),
            |still| still.hessian_at(x, q),
        )
    }
}

/// An open system with the mean of its energies at two times, and with its ports and baths at the time in the middle.
#[derive(Debug)]
pub struct Frozen<'a, Y: Metriplectic, C, X> {
    closed: &'a Y,
    energy: EnergyAt<'a, C, Y::Energy>,
    bracket: Driven<'a, Y::Bracket, X>,
}

impl<Y: Metriplectic, C, X> Clone for Frozen<'_, Y, C, X> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<Y: Metriplectic, C, X> Copy for Frozen<'_, Y, C, X> {}

impl<'a, Y: Metriplectic, C, X> Frozen<'a, Y, C, X> {
    pub(super) fn new(closed: &'a Y, exchange: &'a X, [t, end]: [f64; 2]) -> Self {
        let energy = EnergyAt { energy: closed.energy(), times: [t, end], clock: PhantomData };
        let bracket = Driven::new(closed.bracket(), exchange, t + 0.5 * (end - t));
        Self { closed, energy, bracket }
    }
}

impl<'a, Y, C, X> Metriplectic for Frozen<'a, Y, C, X>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
{
    parts_of!(self.closed: Y {
        manifold: Manifold, metric: Metric, dissipation: Dissipation, entropy: Entropy,
        invariants: Invariants,
    });

    type Energy = EnergyAt<'a, C, Y::Energy>;
    type Bracket = Driven<'a, Y::Bracket, X>;

    #[inline]
    fn energy(&self) -> &Self::Energy {
        &self.energy
    }

    #[inline]
    fn bracket(&self) -> &Self::Bracket {
        &self.bracket
    }

    #[inline]
    fn second_law(&self) -> SecondLaw {
        self.closed.second_law()
    }
}

/// An open system at one time, without its ports and baths: the model whose laws are verified.
#[derive(Debug)]
pub struct Closed<'a, Y: Metriplectic, C> {
    closed: &'a Y,
    energy: EnergyAt<'a, C, Y::Energy>,
    verified: bool,
}

impl<'a, Y: Metriplectic, C> Closed<'a, Y, C> {
    pub(super) fn new(closed: &'a Y, t: f64, verified: bool) -> Self {
        let energy = EnergyAt { energy: closed.energy(), times: [t; 2], clock: PhantomData };
        Self { closed, energy, verified }
    }
}

impl<'a, Y, C> Metriplectic for Closed<'a, Y, C>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
{
    parts_of!(self.closed: Y {
        manifold: Manifold, metric: Metric, bracket: Bracket, dissipation: Dissipation, entropy: Entropy,
        invariants: Invariants,
    });

    type Energy = EnergyAt<'a, C, Y::Energy>;

    #[inline]
    fn energy(&self) -> &Self::Energy {
        &self.energy
    }

    #[inline]
    fn second_law(&self) -> SecondLaw {
        self.closed.second_law()
    }

    #[inline]
    fn is_verified(&self) -> bool {
        self.verified || self.closed.is_verified()
    }
}
