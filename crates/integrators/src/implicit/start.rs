//! Where an implicit step of a model starts, and the laws of states there.

use metriplectic_equations::{ENERGY, ENTROPY};

use super::algebra::dot;
use super::parts::{OfLaws, Parts};
use crate::numbers::Lengths;
use crate::round_off::bound::{NO_DIGITS, ROUNDED};
use crate::step::{Effort, Evidence, Laws, Vector as _, both};

/// Where an implicit step starts.
pub(super) struct Start<'a, L: Lengths> {
    pub(super) parts: &'a Parts<'a, L>,
    /// The state `x`.
    pub(super) x: &'a L::State,
    /// The time at which the step starts, for its errors; that of the whole step for a part of it.
    pub(super) time: f64,
    /// The step size.
    pub(super) h: f64,
    /// The laws at `x`.
    pub(super) values: Laws<L::Invariants>,
    /// The round-off that earlier steps have left of the laws.
    pub(super) accumulated_error: Laws<L::Invariants>,
}

// By hand, because lengths have none.
impl<L: Lengths> Clone for Start<'_, L> {
    fn clone(&self) -> Self {
        let (values, accumulated_error) = (self.values.clone(), self.accumulated_error.clone());
        Self { values, accumulated_error, ..*self }
    }
}

/// A step that was taken.
pub(super) struct Step<L: Lengths> {
    pub(super) x: L::State,
    pub(super) values: Laws<L::Invariants>,
    pub(super) evidence: Evidence,
    pub(super) effort: Effort,
}

/// The questions of an implicit step to a flow beside the parts of its model.
pub(super) trait Around<L: Lengths> {
    /// The state near `y` with these laws, and with this entropy if it is given; `None` if there is none.
    fn onto(
        &self,
        y: &L::State,
        laws: &Laws<L::Invariants>,
        entropy: Option<f64>,
    ) -> Option<L::State>;

    /// Returns whether a state is outside of the domain.
    fn is_outside(&self, x: &L::State) -> bool;

    /// The further invariant whose differential depends on the others at a state, with the fraction of it that does not.
    fn dependent_invariant(&self, x: &L::State) -> Option<(usize, f64)>;
}

/// The round-off that earlier steps have left of the laws, from those at the start of a step and of the run.
pub(crate) fn accumulated<L: Lengths>(
    [values, reference]: [&Laws<L::Invariants>; 2],
) -> Laws<L::Invariants> {
    let mut invariants = values.invariants.clone();
    for (k, reference) in reference.invariants.as_ref().iter().enumerate() {
        invariants[k] -= reference;
    }
    let (energy, entropy) = (values.energy - reference.energy, values.entropy - reference.entropy);
    Laws { energy, entropy, invariants }
}

impl<L: Lengths> Parts<'_, L> {
    /// The size `|F| + Σ_i |∂_iF x_i|` of the terms of a law at a state.
    pub(super) fn size_of_terms(&self, law: usize, x: &L::State) -> f64 {
        let (value, df) = self.jet(law, x);
        value.abs() + dot(&self.vector(|i| df[i].abs()), &self.scales(x))
    }

    /// The sizes of the terms of all laws at a state.
    pub(super) fn term_sizes(&self, x: &L::State) -> Laws<L::Invariants> {
        let OfLaws { energy, entropy, invariants } =
            self.each_law(|law| self.size_of_terms(law, x));
        Laws { energy, entropy, invariants: L::invariants(&invariants) }
    }

    /// The round-off of an entropy increment, the larger one of the two ends.
    pub(super) fn of_an_increment(&self, [x, y]: [&L::State; 2]) -> f64 {
        let [at_x, at_y] = [self.scales(x), self.scales(y)];
        let scales = self.vector(|i| at_x[i].max(at_y[i]));
        let size = |x: &L::State| {
            let (value, df) = self.jet(ENTROPY, x);
            value.abs() + dot(&self.vector(|i| df[i].abs()), &scales)
        };
        ROUNDED * size(x).max(size(y)) + NO_DIGITS
    }

    /// The sizes of the terms of the energy on a step, at its two ends.
    pub(super) fn sizes_on_a_step(&self, [x, end]: [&L::State; 2]) -> [f64; 2] {
        let d = self.between(x, end).map(f64::abs);
        both([x, end], |x| {
            let (_, df) = self.jet(ENERGY, x);
            let exchanged = dot(&self.vector(|i| df[i].abs()), &d);
            self.size_of_terms(ENERGY, x) + exchanged
        })
    }

    /// The velocity at a state; `None` where it has no value.
    pub(super) fn velocity(&self, x: &L::State) -> Option<L::Vector> {
        let w = self.differentials(x);
        let mut v = if self.moves {
            let w = [&w.energy, &w.entropy, &w.energy];
            self.apply(metriplectic_equations::Part::Reversible, x, w)?
        } else {
            self.zero()
        };
        super::algebra::add(&mut v, 1.0, &self.irreversible((x, self.metric(x)?.units()), &w)?);
        Some(v)
    }
}
