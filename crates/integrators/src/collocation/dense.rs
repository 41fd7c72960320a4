//! States inside a step with stages, and the error of a step.

use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_fields::{Column, Space as _, Vector};

use super::chart::in_chart_at;
use super::covectors::combined;
use super::equation::StageEquation;
use super::fallbacks;
use super::memory::{LastStep, StageMemory};
use super::tableau::Tableau;
use crate::step::dense;
use crate::step::failure::Fallbacks;
use crate::step::{Components, Dim, Effort, Flow, Promises, StepEnds};

/// The fraction `θ` of a step that was taken.
pub(crate) struct Within<'a, F: Flow> {
    pub(crate) tableau: &'static Tableau,
    pub(crate) step: &'a StepEnds<'a, F>,
    pub(crate) theta: f64,
}

/// The state at the fraction `θ` of a step: a step of size `θh`, guessed by the polynomial of the whole one, and moved
/// onto the laws of the run.
pub(crate) fn between<Y: Metriplectic>(
    within: &Within<'_, Y>,
    promises: Promises,
    memory: &StageMemory<Dim<Y>>,
) -> Option<Point<Y>> {
    let &Within { step, theta, .. } = within;
    if theta <= 0.0 || step.x == step.end {
        return Some(step.x.clone());
    }
    if theta >= 1.0 {
        return Some(step.end.clone());
    }
    let y = part(within, &memory.last?)?;
    let q = Y::Manifold::coordinates(step.x, step.end);
    let line = || Y::Manifold::chart(step.x, &(q * theta));
    let entropy = promises.entropy.then(|| within.entropy(step.flow.laws(&y).entropy));
    let target = dense::Target::new(step, promises, theta, entropy);
    Some(target.reached_from(&y, line))
}

/// The end of a step of size `θh`.
fn part<Y: Metriplectic>(
    &Within { tableau, step, theta }: &Within<'_, Y>,
    last: &LastStep<Dim<Y>>,
) -> Option<Point<Y>> {
    let (x, h, values) = (step.x, theta * step.h, *step.values[0]);
    let equation = StageEquation::new(tableau, step.flow, x, values, h);
    let guess = std::array::from_fn(|i| {
        combined(tableau.stages, &tableau.velocity(theta * tableau.nodes[i]), &last.k)
    });
    let mut effort = Effort::default();
    let solved =
        fallbacks::solve(&equation, Some(guess), Fallbacks::FirstTries, &mut effort).ok()?;
    Some(solved.at.end)
}

impl<F: Flow> Within<'_, F> {
    /// The entropy at the fraction `θ` of a step: the one that the part of the step has `reached`, between those at the
    /// ends of the step. Two parts of a step have errors of their own, of the order of the method. So a later one may have
    /// less entropy by as much where production vanishes inside the step, and the outputs of a run are
    /// [raised](crate::run) onto the entropy of the output before.
    pub(crate) fn entropy(&self, reached: f64) -> f64 {
        let [start, end] = self.step.values.map(|laws| laws.entropy);
        reached.min(end).max(start)
    }
}

/// The error of a step, by a norm: the larger one of its [defects].
pub(crate) fn error<Y: Metriplectic>(
    tableau: &'static Tableau,
    step: &StepEnds<'_, Y>,
    memory: &StageMemory<Dim<Y>>,
    norm: impl Fn(&Components<Vector<Y::Manifold>>) -> f64,
) -> Option<f64> {
    let &StepEnds { flow: system, x, end, h, values, .. } = step;
    let equation = StageEquation::new(tableau, system, x, *values[0], h);
    let velocity = |at: &Point<Y>| Some(system.rates(at, &Components(Column::zero()))?.0);
    let velocities = [velocity(x)?, velocity(end)?];
    let [first, second] = defects(&equation, memory, end, velocities)?;
    Some(norm(&Components(first)).max(norm(&Components(second))))
}

/// The numbers
///
/// ```math
/// h M^{-1} (u'(0) - f(x)), \qquad h M^{-1} (u'(1) - f(x')) ,
/// ```
///
/// the defects of the polynomial of a step at both ends, where the motion has these velocities. `M = I − γhJ` leaves of a
/// stiff component what it may contribute to the end (Hairer, Wanner, Solving ODEs II, §IV.8).
pub(super) fn defects<Y: Metriplectic>(
    equation: &StageEquation<'_, Y>,
    memory: &StageMemory<Dim<Y>>,
    end: &Point<Y>,
    velocities: [Vector<Y::Manifold>; 2],
) -> Option<[Vector<Y::Manifold>; 2]> {
    let &StageEquation { tableau, x, h, .. } = equation;
    let LastStep { k, filter } = memory.last.as_ref()?;
    let chart = equation.chart(k)?;
    let polynomial = equation.polynomial(&chart, k);
    let zero = Vector::<Y::Manifold>::zero();
    let defect = |tau: f64, at: &Point<Y>, velocity: Vector<Y::Manifold>| {
        let q = chart.d * (tau - 0.5);
        let slope = polynomial.combined(&tableau.velocity(tau));
        let there = in_chart_at::<Y::Manifold>(at, &chart.z, &q, &slope);
        let off = there - velocity * h;
        let middle = in_chart_at::<Y::Manifold>(&chart.z, at, &zero, &off);
        *filter * chart.to_start(x, &middle)
    };
    let [first, second] = velocities;
    Some([defect(0.0, x, first), defect(1.0, end, second)])
}
