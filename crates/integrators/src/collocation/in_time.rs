//! Systems that depend on time, along a step.

use std::fmt::Debug;

use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_fields::{Jet1, Real, ScalarField, Space};

use super::covectors::Law;
use super::tableau::{STAGES, Tableau};

/// The energy `H(t, x)` of a system along a step from `t` to `t'`.
pub(crate) trait EnergyInTime<M: Space>: Debug {
    /// The change `[H(t', x') − θ H(t', z)] − [H(t, x) − θ H(t, z)]`, with the share `θ` of a frozen state.
    fn change(&self, ends: [&M::Point<f64>; 2], frozen: (&M::Point<f64>, f64)) -> f64;

    /// The size of the terms of this change.
    fn size(&self, ends: [&M::Point<f64>; 2], z: &M::Point<f64>) -> f64;

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

/// The share `θ` of the frozen state `z` in the work of the time,
///
/// ```math
/// W_t = h \sum_i b_i\, \partial_t H(t_i, X_i) + \theta \Bigl( H(t', z) - H(t, z) - h \sum_i b_i\, \partial_t H(t_i, z) \Bigr), \qquad
/// \theta = \frac{A^2}{A^2 + B^2}, \qquad A = \sum_i b_i |\partial_t H(t_i, X_i)|, \qquad
/// B = \sum_i b_i |\partial_t H(t_i, X_i) - \partial_t H(t_i, z)| .
/// ```
///
/// The error of a rule grows with the numbers that it sums: `A` without the frozen state, `B` with it. At rest `B` vanishes,
/// and `1 − θ` as the square of the velocity. A stiff state follows the time, and the frozen one does not: there `B` is larger
/// than `A` by the stiffness. Only a method that damps follows such a state, so for the others `θ = 1`.
pub(super) fn frozen_share<Y: Metriplectic>(
    (tableau, in_time): (&Tableau, InTime<'_, Y>),
    stages: &[Point<Y>],
    z: &Point<Y>,
) -> f64 {
    share(tableau, |i| [&stages[i], z].map(|x| in_time.energy.rate(tableau.nodes[i], x)))
}

/// The share for the rates at each stage and at the frozen state.
pub(crate) fn share(tableau: &Tableau, rates: impl Fn(usize) -> [f64; 2]) -> f64 {
    if !tableau.one_sided {
        return 1.0;
    }
    let [mut along, mut beside] = [0.0; 2];
    for (i, weight) in tableau.weights.iter().enumerate().take(tableau.stages) {
        let [rate, frozen] = rates(i);
        along += weight * rate.abs();
        beside += weight * (rate - frozen).abs();
    }
    if beside == 0.0 {
        return 1.0;
    }
    let largest = along.max(beside);
    let [a, b] = [along, beside].map(|sum| (sum / largest).powi(2));
    a / (a + b)
}

/// The energy of a system in time, less a share of that of a frozen state `z`, as a law along a step.
#[derive(Debug)]
pub(super) struct Timed<'a, Y: Metriplectic> {
    pub(super) in_time: InTime<'a, Y>,
    pub(super) tableau: &'static Tableau,
    pub(super) x: &'a Point<Y>,
    pub(super) z: &'a Point<Y>,
    /// The share of the frozen state.
    pub(super) share: f64,
}

impl<Y: Metriplectic> Law<Y::Manifold> for Timed<'_, Y> {
    fn end(&self, start: f64, end: &Point<Y>) -> f64 {
        start + self.in_time.energy.change([self.x, end], (self.z, self.share))
    }

    fn size(&self, end: &Point<Y>) -> f64 {
        self.in_time.energy.size([self.x, end], self.z)
    }

    fn jet1(&self, stage: usize, x: &Point<Y>) -> Jet1<Y::Manifold> {
        self.in_time.systems[stage].energy().jet1(x)
    }

    fn rate(&self, stage: usize, x: &Point<Y>) -> Option<[f64; 2]> {
        let (node, energy) = (self.tableau.nodes[stage], self.in_time.energy);
        let [rate, frozen] = [energy.rate(node, x), self.share * energy.rate(node, self.z)];
        Some([rate - frozen, rate.abs() + frozen.abs()])
    }

    fn slope(&self, node: f64, x: &<Y::Manifold as Space>::Point<Real>) -> f64 {
        let energy = self.in_time.energy;
        energy.slope(node, x) - self.share * energy.slope(node, &Y::Manifold::constant(self.z))
    }
}
