//! One step: guess, solve, end; then the last digits.

use metriplectic_dynamics::{Metriplectic, SecondLaw, system::Point};
use metriplectic_fields::{Column, Dimension, Space as _};
use metriplectic_manifolds::Manifold;

use super::equation::StageEquation;
use super::fallbacks::{self, StepFailure};
use super::linear::Linear;
use super::memory::{LastStep, StageMemory};
use super::solve::Solved;
use super::tableau::{STAGES, Tableau};
use crate::round_off::bound::{
    ROUNDED, breaks_first_law, breaks_invariants, falls, is_dissipated, sizes_on_a_step,
};
use crate::round_off::compensation::Displaced;
use crate::round_off::drift;
use crate::step::failure::{Cause, Fallbacks};
use crate::step::{
    Components, CountOf, Dim, Effort, Evidence, Flow as _, Laws, Numbers, StageLaws, Start,
    StepStart, Taken,
};

/// The start of a step with what earlier steps have left of the laws.
pub(crate) fn start_of<'a, Y: Metriplectic>(
    tableau: &Tableau,
    &StepStart { flow: system, x, time, values, reference, .. }: &StepStart<'a, Y>,
    h: f64,
) -> Start<'a, Y> {
    // The entropy that a correction on one side has added stays.
    let entropy = if tableau.one_sided { 0.0 } else { values.entropy - reference.entropy };
    let accumulated_error = Laws {
        energy: values.energy - reference.energy,
        entropy,
        invariants: CountOf::<Y>::array(|a| values.invariants[a] - reference.invariants[a]),
    };
    Start { system, x, time, h, values, accumulated_error }
}

/// The error of the laws of a method that damps, in units of their round-off, above which the end is moved onto them.
/// Near an equilibrium the entropy falls with the energy.
/// A factor of four fails `tests/stiff_friction.rs::gas_containers_with_a_wall_that_leaks_fast`.
pub(crate) const DAMPED_LAW: f64 = 0.125;

/// Tries a step whole.
pub(crate) fn try_step<Y: Metriplectic>(
    tableau: &'static Tableau,
    start: &Start<'_, Y>,
    memory: &mut StageMemory<Dim<Y>>,
    fallbacks: Fallbacks,
) -> Result<Taken<Y>, StepFailure> {
    memory.last = None;
    let &Start { system, x, h, values, .. } = start;
    let guess = memory.guess(tableau, h);
    let mut equation = StageEquation::new(tableau, system, x, values, h);
    if let Some(guess) = &guess {
        equation.drift = drift::target(system, start, &equation.displacement(guess));
    }
    let mut effort = Effort::default();
    let solved = fallbacks::solve(&equation, guess, fallbacks, &mut effort)?;
    let rests = solved.rests(&equation);
    let Solved { k, at, linear, .. } = solved;
    let failed = |cause, effort| StepFailure { cause, effort };
    // The linear part may be that of another state, which says nothing of the round-off here.
    if rests
        && let Some(Components(velocity)) = system.rates(x, &Components(Column::zero()))
        && let Some(here) = Linear::of(&equation, &[Column::zero(); STAGES])
        && here.moves(&velocity, &Y::Manifold::scales(x))
    {
        return Err(failed(Cause::Unsolved, effort));
    }
    let rise = if tableau.one_sided { at.growth + at.surplus } else { at.growth };
    // What is left of a deviation by the ratio R produces R² hλ of what the step has produced, or more. A deviation
    // that the entropy does not show is round-off. It is damped where the ratio R²/(½ (1 − R²)) is at most 1.
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
        let [before, after] = sizes_on_a_step(system, [x, &at.end]);
        if at.excursion > before.max(after) {
            return Err(failed(Cause::Unsolved, effort));
        }
    }
    if rests {
        memory.last = Some(LastStep { k, filter: *linear.filter() });
        return Ok(Taken { x: x.clone(), values, evidence, effort });
    }
    // A root beyond the chart belongs to another way between the ends.
    if !Y::Manifold::is_near(&(at.d * 0.5)) {
        return Err(failed(Cause::Unsolved, effort));
    }
    let end = at.end;
    if system.manifold().defect(&end).is_infinite() {
        return Err(failed(Cause::Edge, effort));
    }
    let u = equation.displacement(&k);
    let Some(chart) = equation.chart(&k) else { return Err(failed(Cause::Edge, effort)) };
    memory.note::<Y::Manifold>(tableau, x, h, &k, &chart, &end);
    memory.last = Some(LastStep { k, filter: *linear.filter() });
    let step = Displaced { x, d: &u, end: &end };
    let compensated = memory.compensation.add::<Y::Manifold>(Y::Manifold::lost_digits, &step);
    let (mut x_end, mut values_end) = match compensated {
        Some(moved) => {
            let values = system.laws(&moved);
            (moved, values)
        }
        None => (end, at.values),
    };
    // What was not taken back counts, as long as that is round-off.
    let error = if tableau.one_sided { equation.error(&values_end, &at.sizes) } else { at.error };
    if let Some(moved) = corrected(&equation, error, &x_end, &values_end) {
        values_end = system.laws(&moved);
        x_end = moved;
        memory.compensation.clear();
    }
    let change = values_end.energy - values.energy;
    if !values_end.entropy.is_finite() {
        return Err(failed(Cause::Edge, effort));
    }
    let sizes = || sizes_on_a_step(system, [x, &x_end]);
    if let Some(size) = breaks_first_law(change, values_end.energy, sizes) {
        return Err(failed(Cause::Energy { change, size }, effort));
    }
    if breaks_another_law(start, &x_end, &values_end) {
        return Err(failed(Cause::Unsolved, effort));
    }
    Ok(Taken { x: x_end, values: values_end, evidence, effort })
}

/// Returns whether a step changes a further invariant, or lowers the entropy, by more than round-off beside a dependent invariant: the
/// covectors of the stages are so long there that their terms have no digits of it.
pub(super) fn breaks_another_law<Y: Metriplectic>(
    &Start { system, x, h, ref values, .. }: &Start<'_, Y>,
    end: &Point<Y>,
    after: &Laws<Numbers<Y>>,
) -> bool {
    let rises = system.second_law() == SecondLaw::Exact && h > 0.0;
    let term_sizes = |x: &Point<Y>| system.term_sizes(x);
    let is_broken = breaks_invariants([values, after], || [x, end].map(term_sizes))
        || (rises && falls([values, after], || [x, end].map(term_sizes)));
    // An invariant that is independent is solved for within the round-off of the stages.
    is_broken && [x, end].into_iter().any(|x| system.dependent_invariant(x).is_some())
}

/// The end with the last digits of the laws, where the stages have lost them, as they do if friction is stiff: moved onto
/// the energy and the further invariants with its entropy, or that of the start if the entropy has fallen. `None` if nothing is lost, or no state
/// near by has these laws.
fn corrected<Y: Metriplectic>(
    equation: &StageEquation<'_, Y>,
    error: f64,
    end: &Point<Y>,
    values: &Laws<Numbers<Y>>,
) -> Option<Point<Y>> {
    let StageEquation { system, values: before, drift, .. } = equation;
    let falls = before.entropy - values.entropy > ROUNDED * before.entropy.abs();
    let falls = falls && equation.is_exact() && equation.h > 0.0;
    let most = if equation.tableau.one_sided { DAMPED_LAW } else { 1.0 };
    if error <= most && !falls {
        return None;
    }
    let laws = Laws {
        energy: before.energy - drift.energy,
        entropy: before.entropy,
        invariants: CountOf::<Y>::array(|a| before.invariants[a] - drift.invariants[a]),
    };
    let entropy = if falls { before.entropy } else { values.entropy };
    let on_all = equation.is_exact().then(|| system.onto(end, &laws, Some(entropy))).flatten();
    // Near an equilibrium the other laws determine the entropy.
    on_all.or_else(|| system.onto(end, &laws, None))
}
