//! One step of a method with stages of a model in plain numbers: guess, solve, end; then the last digits. As in
//! [`crate::collocation`], whose rules it follows.

use metriplectic_equations::Path;

use super::covectors::zeros;
use super::equation::StageEquation;
use super::fallbacks;
use super::linear::Linear;
use super::memory::StageNumbers;
use super::solve::Solved;
use crate::collocation::fallbacks::StepFailure;
use crate::collocation::step::DAMPED_LAW;
use crate::collocation::tableau::Tableau;
use crate::implicit::algebra::is_finite;
use crate::implicit::drift;
use crate::implicit::start::{Around, Start, Step};
use crate::numbers::Lengths;
use crate::round_off::bound::{ROUNDED, breaks_first_law, breaks_invariants, falls, is_dissipated};
use crate::step::failure::{Cause, Fallbacks};
use crate::step::{Effort, Evidence, Laws, StageLaws};

/// A method with stages.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Collocation {
    /// Its coefficients.
    pub(crate) tableau: &'static Tableau,
    /// The first part of a step that is not solved is at least `2^{-splits}` of it.
    pub(crate) splits: usize,
}

impl Collocation {
    /// The start of a step with what earlier steps have left of the laws.
    fn start_of<'a, L: Lengths>(&self, start: &Start<'a, L>) -> Start<'a, L> {
        let mut start = start.clone();
        if self.tableau.one_sided {
            // The entropy that a correction on one side has added stays.
            start.accumulated_error.entropy = 0.0;
        }
        start
    }

    /// Tries a step whole.
    pub(in crate::implicit) fn try_step<L: Lengths>(
        &self,
        start: &Start<'_, L>,
        memory: &mut StageNumbers<L>,
        around: &dyn Around<L>,
        fallbacks: Fallbacks,
    ) -> Result<Step<L>, StepFailure> {
        let tableau = self.tableau;
        let start = &self.start_of(start);
        let &Start { parts, x, h, ref values, .. } = start;
        memory.keep_length(parts.n());
        memory.last = None;
        let guess = memory.guess(parts, tableau, h);
        let mut equation = StageEquation::new(tableau, start);
        if let Some(guess) = &guess {
            equation.drift = drift::target(start, &equation.displacement(guess));
        }
        let mut effort = Effort::default();
        let known = memory.linear.take().filter(|known| {
            guess.as_ref().is_some_and(|k| known.serves(tableau, h, &equation.displacement(k)))
        });
        let solved = fallbacks::solve(&equation, guess, known, fallbacks, &mut effort)?;
        let rests = solved.rests(&equation);
        let Solved { k, at, linear, evaluations, .. } = solved;
        let failed = |cause| StepFailure { cause, effort };
        // The linear part may be that of another state, which says nothing of the round-off here.
        if rests
            && let Some(velocity) = parts.velocity(x).filter(is_finite)
            && let Some(here) = Linear::of(&equation, &zeros(parts))
            && here.moves(&velocity, &parts.scales(x))
        {
            return Err(failed(Cause::Unsolved));
        }
        let rise = if tableau.one_sided { at.growth + at.surplus } else { at.growth };
        // What is left of a deviation by the ratio R produces R² hλ of what the step has produced, or more. A deviation that the
        // entropy does not show is round-off. It is damped where the ratio R²/(½ (1 − R²)) is at most 1.
        let produced = at.growth.abs() + at.surplus + ROUNDED * at.sizes.entropy;
        // hλ has no unit; where it is below 1, friction is resolved.
        let damped = linear.friction.max(1.0) * produced;
        let evidence = Evidence {
            entropy_slope: at.entropy_slope,
            dissipates: is_dissipated(rise.abs(), values.entropy),
            friction: if at.left <= damped { 0.0 } else { linear.friction },
            rests,
            stages: Some(StageLaws::new(at.error * ROUNDED, at.surplus)),
            ..Evidence::default()
        };
        // A root whose stages are off the energy by its whole size belongs to no motion from here.
        if at.excursion > values.energy.abs() {
            let [before, after] = parts.sizes_on_a_step([x, &at.end]);
            if at.excursion > before.max(after) {
                return Err(failed(Cause::Unsolved));
            }
        }
        if rests {
            memory.keep(k, linear, false);
            return Ok(Step { x: x.clone(), values: values.clone(), evidence, effort });
        }
        if !equation.is_on_its_way(&k, &at.end) {
            return Err(failed(Cause::Unsolved));
        }
        if around.is_outside(&at.end) {
            return Err(failed(Cause::Edge));
        }
        let u = equation.displacement(&k);
        memory.note(tableau, (parts, x, h), &k);
        // Elsewhere the frame in which they are formed turns.
        let is_kept = linear.is_kept(evaluations) && parts.is_flat();
        memory.keep(k, linear, is_kept);
        let compensated = memory.compensation.add(parts, Path::Chart, [x, &at.end], &u);
        let (mut x_end, mut after) = match compensated {
            Some(moved) => {
                let values = parts.laws(&moved);
                (moved, values)
            }
            None => (at.end, at.values),
        };
        // What was not taken back counts, as long as that is round-off.
        let error = if tableau.one_sided { equation.error(&after, &at.sizes) } else { at.error };
        if let Some(moved) = corrected(&equation, error, &x_end, &after, around) {
            after = parts.laws(&moved);
            x_end = moved;
            memory.compensation.0 = None;
        }
        let change = after.energy - values.energy;
        if !after.entropy.is_finite() {
            return Err(failed(Cause::Edge));
        }
        let sizes = || parts.sizes_on_a_step([x, &x_end]);
        if let Some(size) = breaks_first_law(change, after.energy, sizes) {
            return Err(failed(Cause::Energy { change, size }));
        }
        if breaks_another_law(start, &x_end, &after, around) {
            return Err(failed(Cause::Unsolved));
        }
        Ok(Step { x: x_end, values: after, evidence, effort })
    }
}

/// Returns whether a step changes a further invariant, or lowers the entropy, by more than round-off beside a dependent invariant: the
/// covectors of the stages are so long there that their terms have no digits of it.
pub(super) fn breaks_another_law<L: Lengths>(
    &Start { parts, x, h, ref values, .. }: &Start<'_, L>,
    end: &L::State,
    after: &Laws<L::Invariants>,
    around: &dyn Around<L>,
) -> bool {
    let rises = parts.is_exact && h > 0.0;
    let sizes = || [x, end].map(|x| parts.term_sizes(x));
    let is_broken =
        breaks_invariants([values, after], sizes) || (rises && falls([values, after], sizes));
    // An invariant that is independent is solved for within the round-off of the stages.
    is_broken && [x, end].into_iter().any(|x| around.dependent_invariant(x).is_some())
}

/// The end with the last digits of the laws, where the stages have lost them, as they do if friction is stiff: moved onto the energy and
/// the further invariants with its entropy, or that of the start if the entropy has fallen. `None` if nothing is lost, or no state near
/// by has these laws.
fn corrected<L: Lengths>(
    equation: &StageEquation<'_, L>,
    error: f64,
    end: &L::State,
    values: &Laws<L::Invariants>,
    around: &dyn Around<L>,
) -> Option<L::State> {
    let StageEquation { tableau, parts, h, values: before, drift, .. } = equation;
    let falls = before.entropy - values.entropy > ROUNDED * before.entropy.abs();
    let falls = falls && parts.is_exact && *h > 0.0;
    let most = if tableau.one_sided { DAMPED_LAW } else { 1.0 };
    if error <= most && !falls {
        return None;
    }
    let mut laws = before.clone();
    laws.energy -= drift.energy;
    for a in 0..parts.kinds.len() {
        laws.invariants[a] -= drift.invariants[a];
    }
    let entropy = if falls { before.entropy } else { values.entropy };
    let on_all = if parts.is_exact { around.onto(end, &laws, Some(entropy)) } else { None };
    // Near an equilibrium the other laws determine the entropy.
    on_all.or_else(|| around.onto(end, &laws, None))
}
