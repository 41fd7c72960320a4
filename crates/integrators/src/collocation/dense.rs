//! States inside a step with stages, and the error of a step.

use metriplectic_dynamics::Metriplectic;
use metriplectic_fields::{Column, Space as _, Vector};

use super::PointOf;
use super::chart::in_chart_at;
use super::covectors::combined;
use super::equation::StageEquation;
use super::fallbacks;
use super::memory::{LastStep, StageMemory};
use super::tableau::Tableau;
use crate::method::{Components, Effort, Flow as _, Promises, StepEnds};
use crate::midpoint::Dim;
use crate::run::dense::{self, cubic, limited};
use crate::step_failure::Fallbacks;

/// The state at the fraction `θ` of a step: a step of size `θh`, guessed by the polynomial of the whole one, and moved
/// onto the laws of the run with an entropy that does not fall from one fraction to a later one.
pub(super) fn between<Y: Metriplectic>(
    tableau: &'static Tableau,
    system: &Y,
    step: &StepEnds<'_, Y>,
    promises: Promises,
    memory: &StageMemory<Dim<Y>>,
    theta: f64,
) -> Option<PointOf<Y>> {
    if theta <= 0.0 || step.x == step.end {
        return Some(step.x.clone());
    }
    if theta >= 1.0 {
        return Some(step.end.clone());
    }
    let part = memory.last.and_then(|last| part(tableau, system, step, &last, theta));
    // A step that was taken in parts has no polynomial.
    let Some(y) = part else { return dense::between(system, step, promises, theta) };
    let q = Y::Manifold::coordinates(step.x, step.end);
    let line = || Y::Manifold::chart(step.x, &(q * theta));
    let entropy = promises.entropy.then(|| entropy(system, step, theta));
    Some(dense::onto_laws(system, step, promises, (theta, entropy), (y, line)))
}

/// The end of a step of size `θh`.
fn part<Y: Metriplectic>(
    tableau: &'static Tableau,
    system: &Y,
    step: &StepEnds<'_, Y>,
    last: &LastStep<Dim<Y>>,
    theta: f64,
) -> Option<PointOf<Y>> {
    let (x, h, values) = (step.x, theta * step.h, *step.values[0]);
    let equation = StageEquation::new(tableau, system, x, values, h);
    let guess = std::array::from_fn(|i| {
        combined(tableau.stages, &tableau.velocity(theta * tableau.nodes[i]), &last.k)
    });
    let mut effort = Effort::default();
    let solved =
        fallbacks::solve(&equation, Some(guess), Fallbacks::FirstTries, &mut effort).ok()?;
    Some(solved.at.end)
}

/// The entropy at the fraction `θ` of a step: the cubic with the production as its slope, limited so that it is
/// monotone (Fritsch, Carlson 1980).
fn entropy<Y: Metriplectic>(system: &Y, step: &StepEnds<'_, Y>, theta: f64) -> f64 {
    let [start, end] = step.values.map(|laws| laws.entropy);
    let rise = end - start;
    if rise <= 0.0 {
        return start;
    }
    let slopes = match (system.production(step.x), system.production(step.end)) {
        (Some(a), Some(b)) => limited(rise, [step.h * a, step.h * b]),
        _ => [rise, rise],
    };
    (start + cubic(rise, slopes, theta)).min(end)
}

/// The error of a step, by a norm: the larger one of
///
/// ```math
/// h M^{-1} (u'(0) - f(x)), \qquad h M^{-1} (u'(1) - f(x')) ,
/// ```
///
/// the defects of its polynomial at both ends. `M = I − γhJ` leaves of a stiff component what it may contribute
/// to the end (Hairer, Wanner, Solving ODEs II, §IV.8).
pub(super) fn error<Y: Metriplectic>(
    tableau: &'static Tableau,
    system: &Y,
    step: &StepEnds<'_, Y>,
    memory: &StageMemory<Dim<Y>>,
    norm: impl Fn(&Components<Vector<Y::Manifold>>) -> f64,
) -> Option<f64> {
    let &StepEnds { x, end, h, values, .. } = step;
    let LastStep { k, filter } = memory.last.as_ref()?;
    let equation = StageEquation::new(tableau, system, x, *values[0], h);
    let chart = equation.chart(k)?;
    let polynomial = equation.polynomial(&chart, k);
    let zero = Vector::<Y::Manifold>::zero();
    let defect = |tau: f64, at: &PointOf<Y>| {
        let q = chart.d * (tau - 0.5);
        let slope = polynomial.combined(&tableau.velocity(tau));
        let there = in_chart_at::<Y::Manifold>(at, &chart.z, &q, &slope);
        let off = there - system.rates(at, &Components(zero))?.0 * h;
        let middle = in_chart_at::<Y::Manifold>(&chart.z, at, &zero, &off);
        Some(norm(&Components(*filter * chart.to_start(x, &middle))))
    };
    Some(defect(0.0, x)?.max(defect(1.0, end)?))
}
