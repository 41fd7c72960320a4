//! Systems that depend on time, along a step.

use std::fmt::Debug;

use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_fields::{Jet1, Real, ScalarField, Space};

use super::covectors::Law;
use super::tableau::{STAGES, Tableau};

/// The energy `H(t, x)` of a system along a step from `t` to `t'`.
pub(crate) trait EnergyInTime<M: Space>: Debug {
    /// The change `[H(t', x') − H(t', z)] − [H(t, x) − H(t, z)]`.
    fn change(&self, x: &M::Point<f64>, end: &M::Point<f64>, z: &M::Point<f64>) -> f64;

    /// The size of the terms of this change.
    fn size(&self, x: &M::Point<f64>, end: &M::Point<f64>, z: &M::Point<f64>) -> f64;

    /// Returns the change by time in the whole step at the rate `∂_tH` that it has at a fraction of it. The length of the step is
    /// the difference of the two times, which is not quite its nominal size.
    fn rate(&self, node: f64, x: &M::Point<f64>) -> f64;

    /// The derivative of `H` along the fraction of the step, with the point that moves.
    fn slope(&self, node: f64, x: &M::Point<Real>) -> f64;
}

/// A system at the times of the stages.
#[derive(Debug)]
pub(crate) struct InTime<'a, Y: Metriplectic> {
    pub(crate) systems: &'a [Y; STAGES],
    pub(crate) energy: &'a dyn EnergyInTime<Y::Manifold>,
}

impl<Y: Metriplectic> Clone for InTime<'_, Y> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<Y: Metriplectic> Copy for InTime<'_, Y> {}

/// The energy of a system in time, less that of a frozen state `z`, as a law along a step.
#[derive(Debug)]
pub(super) struct Timed<'a, Y: Metriplectic> {
    pub(super) in_time: InTime<'a, Y>,
    pub(super) tableau: &'static Tableau,
    pub(super) x: &'a Point<Y>,
    pub(super) z: &'a Point<Y>,
}

impl<Y: Metriplectic> Law<Y::Manifold> for Timed<'_, Y> {
    fn end(&self, start: f64, end: &Point<Y>) -> f64 {
        start + self.in_time.energy.change(self.x, end, self.z)
    }

    fn size(&self, end: &Point<Y>) -> f64 {
        self.in_time.energy.size(self.x, end, self.z)
    }

    fn jet1(&self, stage: usize, x: &Point<Y>) -> Jet1<Y::Manifold> {
        self.in_time.systems[stage].energy().jet1(x)
    }

    fn rate(&self, stage: usize, x: &Point<Y>) -> Option<f64> {
        let (node, energy) = (self.tableau.nodes[stage], self.in_time.energy);
        Some(energy.rate(node, x) - energy.rate(node, self.z))
    }

    fn slope(&self, node: f64, x: &<Y::Manifold as Space>::Point<Real>) -> f64 {
        let energy = self.in_time.energy;
        energy.slope(node, x) - energy.slope(node, &Y::Manifold::constant(self.z))
    }
}
