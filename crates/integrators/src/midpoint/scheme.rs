//! A scheme and its options.

use crate::discrete_gradient::{DiscreteGradient, Gonzalez};
use crate::newton::Newton;

/// A scheme: a retraction, and how hard to try to solve its equation.
///
/// ```
/// use metriplectic_integrators::{Newton, Scheme};
/// use metriplectic_manifolds::WeylMidpoint;
/// let scheme = Scheme { splits: 4, ..Scheme::new(WeylMidpoint) };
/// let patient = scheme.newton(Newton { iterations: 60, ..Newton::default() });
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scheme<R, W = Gonzalez> {
    /// Turns a vector into a pair of points.
    pub retraction: R,
    /// Accounts for the change of energy and entropy along a step.
    pub gradient: W,
    /// Solves the equation of a step.
    pub newton: Newton,
    /// How often a step that is not solved is split in halves; both laws hold for each half.
    pub splits: usize,
}

impl<R> Scheme<R> {
    /// The scheme of a retraction, with the discrete gradient of Gonzalez and the default solver.
    pub fn new(retraction: R) -> Self {
        Self { retraction, gradient: Gonzalez, newton: Newton::default(), splits: 10 }
    }
}

impl<R, W> Scheme<R, W> {
    /// Replaces the discrete gradient.
    #[must_use]
    pub fn gradient<V: DiscreteGradient>(self, gradient: V) -> Scheme<R, V> {
        let Self { retraction, newton, splits, .. } = self;
        Scheme { retraction, gradient, newton, splits }
    }

    /// Replaces the options of the solver.
    #[must_use]
    pub fn newton(self, newton: Newton) -> Self {
        Self { newton, ..self }
    }
}
