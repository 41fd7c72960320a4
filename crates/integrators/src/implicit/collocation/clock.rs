//! Models whose energy depends on time, along a step. As in [`crate::collocation`], whose formulas it has.

use metriplectic_equations::ENERGY;

use crate::collocation::Stages;
use crate::collocation::in_time::share;
use crate::collocation::tableau::Tableau;
use crate::implicit::parts::Parts;
use crate::numbers::{Lengths, List};

/// The times at both ends of a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TimeOfStep(pub(crate) [f64; 2]);

impl TimeOfStep {
    /// The time at a fraction of the step.
    pub(crate) fn at(self, node: f64) -> f64 {
        let Self([t, end]) = self;
        // The end exactly, at which a protocol may jump.
        if node >= 1.0 { end } else { t + node * (end - t) }
    }

    /// The difference of the two times, which is not quite the nominal size of the step.
    pub(crate) fn length(self) -> f64 {
        self.0[1] - self.0[0]
    }
}

/// The work of the time in the energy, in a step.
pub(crate) trait WorkOfTime {
    /// The work `H(t', x) − H(t, x)` at a frozen state.
    fn frozen(&self, x: &[f64]) -> f64;

    /// The rate `∂_tH(t, x)`.
    fn power(&self, t: f64, x: &[f64]) -> f64;
}

/// The energy `H(t, x)` of a model along a step.
pub(in crate::implicit) struct Clock<'a, L: Lengths> {
    /// The model at the times of both ends.
    pub(in crate::implicit) ends: [Parts<'a, L>; 2],
    pub(in crate::implicit) times: TimeOfStep,
    pub(in crate::implicit) work: &'a dyn WorkOfTime,
}

impl<L: Lengths> Clock<'_, L> {
    /// The change by time in the whole step at the rate `∂_tH` that it has at a fraction of it.
    fn rate(&self, node: f64, x: &L::State) -> f64 {
        self.times.length() * self.work.power(self.times.at(node), x.numbers())
    }

    /// The share of the frozen state in the work of the time.
    pub(super) fn share(&self, tableau: &Tableau, stages: &Stages<L::State>, z: &L::State) -> f64 {
        share(tableau, |i| {
            let node = tableau.nodes[i];
            [self.rate(node, &stages[i]), self.rate(node, z)]
        })
    }
}

/// The energy less a share of that of a frozen state, as a law along a step.
pub(super) struct Timed<'a, L: Lengths> {
    pub(super) clock: &'a Clock<'a, L>,
    /// The model at the times of the stages.
    pub(super) in_time: &'a [Parts<'a, L>],
    pub(super) x: &'a L::State,
    pub(super) z: &'a L::State,
    /// The share of the frozen state.
    pub(super) share: f64,
}

impl<L: Lengths> Timed<'_, L> {
    /// The change `H(t', x') − H(t, x) − θ [H(t', z) − H(t, z)]`, and the size of its terms.
    pub(super) fn change(&self, end: &L::State) -> [f64; 2] {
        let [first, last] = &self.clock.ends;
        let energy = |parts: &Parts<'_, L>, x: &L::State| parts.value(ENERGY, x);
        let frozen = self.clock.work.frozen(self.z.numbers());
        let change = (energy(last, end) - energy(first, self.x)) - self.share * frozen;
        let terms = [(last, end), (last, self.z), (first, self.x), (first, self.z)];
        [change, terms.into_iter().map(|(parts, x)| energy(parts, x).abs()).sum()]
    }

    /// The rate of the work of the time at a place beside that of the frozen state, and the size of its terms.
    pub(super) fn rate(&self, node: f64, x: &L::State) -> [f64; 2] {
        let [rate, frozen] = [x, self.z].map(|x| self.clock.rate(node, x));
        let frozen = self.share * frozen;
        [rate - frozen, rate.abs() + frozen.abs()]
    }

    /// The slope `⟨dH, v⟩` at a fraction of the step.
    pub(super) fn slope(&self, node: f64, x: &L::State, v: &L::Vector) -> f64 {
        let [slope, _] = self.in_time[0].at(self.clock.times.at(node)).along(ENERGY, x, v);
        slope
    }
}
