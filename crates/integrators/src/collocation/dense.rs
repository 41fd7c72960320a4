//! States inside a step with stages, and the error of a step.

use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_fields::{Column, Space as _, Vector};

use super::chart::in_chart_at;
use super::covectors::combined;
use super::equation::StageEquation;
use super::fallbacks;
use super::memory::{LastStep, StageMemory};
use super::tableau::Tableau;
use crate::step::dense::{self, cubic, limited};
use crate::step::failure::Fallbacks;
use crate::step::{Components, Dim, Effort, Flow, Promises, StepEnds};

/// The fraction `θ` of a step that was taken.
pub(crate) struct Within<'a, F: Flow> {
    pub(crate) tableau: &'static Tableau,
    pub(crate) step: &'a StepEnds<'a, F>,
    pub(crate) theta: f64,
}

/// The state at the fraction `θ` of a step: a step of size `θh`, guessed by the polynomial of the whole one, and moved
/// onto the laws of the run with an entropy that does not fall from one fraction to a later one.
pub(super) fn between<Y: Metriplectic>(
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
    /// The entropy at the fraction `θ` of a step: the one that the part of the step has `reached`, of the order of the
    /// method, as far as it lies within a band around a monotone function of low order.
    ///
    /// The function of the entropy has the production as its slope at both ends. It is the cubic, limited so that it is monotone (Fritsch,
    /// Carlson 1980), and for a method that damps the rational function, which follows the rise of a fast transient. Half of
    /// its least slope `m` bounds the slope of the band `± ½m θ(1 − θ)`. So the entropy rises along each edge of the band, and
    /// inside of it where it differs from the function by a smooth remainder.
    pub(crate) fn entropy(&self, reached: f64) -> f64 {
        let &Self { tableau, step, theta } = self;
        let [start, end] = step.values.map(|laws| laws.entropy);
        let rise = end - start;
        if rise <= 0.0 {
            return start;
        }
        let slopes = match (step.flow.production(step.x), step.flow.production(step.end)) {
            (Some(a), Some(b)) => [step.h * a, step.h * b],
            _ => [rise, rise],
        };
        let (risen, least) = if tableau.one_sided && slopes.iter().all(|slope| slope.is_finite()) {
            (rational(rise, slopes, theta), least_slope_of_rational(rise, slopes))
        } else {
            let slopes = limited(rise, slopes);
            (cubic(rise, slopes, theta), least_slope_of_cubic(rise, slopes))
        };
        let band = 0.5 * least * theta * (1.0 - theta);
        let risen = risen + (reached - start - risen).clamp(-band, band);
        (start + risen).clamp(start, end)
    }
}

/// The least slope on `[0, 1]` of the cubic from 0 to `rise` with limited slopes at both ends; never negative.
fn least_slope_of_cubic(rise: f64, [start, end]: [f64; 2]) -> f64 {
    // The slope is aθ² + bθ + c.
    let (a, b) = (3.0 * (start + end - 2.0 * rise), 2.0 * (3.0 * rise - 2.0 * start - end));
    let lowest = -b / (2.0 * a);
    let inside = if a > 0.0 && (0.0..=1.0).contains(&lowest) {
        0.5_f64.mul_add(b * lowest, start)
    } else {
        f64::INFINITY
    };
    start.min(end).min(inside).max(0.0)
}

/// A lower bound for the slope of [`rational`] on `[0, 1]`,
///
/// ```math
/// \frac{\min(d_0, d_1, \Delta)\, \Delta^2}{\max(\Delta, (2\Delta + d_0 + d_1)/4)^2} .
/// ```
fn least_slope_of_rational(rise: f64, slopes: [f64; 2]) -> f64 {
    let [start, end] = slopes.map(|slope| (slope / rise).max(0.0));
    let most = (0.25 * (2.0 + start + end)).max(1.0);
    rise * start.min(end).min(1.0) / (most * most)
}

/// The rational quadratic function from 0 to `rise` with these slopes, which is monotone if they are not negative
/// (Gregory, Delbourgo 1982, IMA J. Numer. Anal. 2, 123-130):
///
/// ```math
/// \frac{\Delta \theta^2 + d_0\, \theta(1 - \theta)}{\Delta + (d_0 + d_1 - 2\Delta)\, \theta(1 - \theta)}\, \Delta .
/// ```
fn rational(rise: f64, slopes: [f64; 2], theta: f64) -> f64 {
    let [start, end] = slopes.map(|slope| (slope / rise).max(0.0));
    let both = theta * (1.0 - theta);
    rise * (theta * theta + start * both) / (1.0 + (start + end - 2.0) * both)
}

/// The error of a step, by a norm: the larger one of its [defects].
pub(super) fn error<Y: Metriplectic>(
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

#[cfg(test)]
mod tests {
    use super::{cubic, least_slope_of_cubic, least_slope_of_rational, limited, rational};

    #[test]
    fn the_entropy_inside_a_step_is_monotone_and_has_its_slopes() {
        let (rise, tiny) = (0.3, 1e-6);
        for slopes in [[0.3, 0.3], [2.0, 0.0], [0.0, 5.0], [1e12, 1e-3]] {
            let at = |theta| rational(rise, slopes, theta);
            assert!(at(0.0).abs() <= 0.0 && (at(1.0) - rise).abs() <= 1e-16);
            let values: Vec<f64> = (0..=1000).map(|k| at(f64::from(k) * 1e-3)).collect();
            assert!(values.is_sorted(), "{slopes:?}");
            if slopes[0] < 1e3 {
                let ends = [at(tiny) / tiny, (rise - at(1.0 - tiny)) / tiny];
                let off = [ends[0] - slopes[0], ends[1] - slopes[1]];
                assert!(off.iter().all(|off| off.abs() <= 1e-3), "{slopes:?}: {ends:?}");
            }
        }
        // A fast transient is over at once.
        assert!(rise - rational(rise, [1e12, 0.0], 0.1) <= 1e-11);
    }

    #[test]
    fn the_least_slope_is_none_that_a_difference_falls_below() {
        for [start, end] in
            [[1.0, 1.0], [0.2, 1.7], [2.9, 0.1], [0.0, 0.5], [1.2, 2.7], [50.0, 3.0]]
        {
            let (rise, step) = (0.3, 1e-3);
            let slopes = [start * rise, end * rise];
            let cubic_slopes = limited(rise, slopes);
            let [mut cubics, mut rationals] = [f64::INFINITY; 2];
            for k in 0..1000 {
                let [a, b] = [k, k + 1].map(|k| f64::from(k) * step);
                let difference = |f: &dyn Fn(f64) -> f64| (f(b) - f(a)) / step;
                cubics = cubics.min(difference(&|theta| cubic(rise, cubic_slopes, theta)));
                rationals = rationals.min(difference(&|theta| rational(rise, slopes, theta)));
            }
            // The cubic's is attained, up to the change of the slope within a difference.
            let least = least_slope_of_cubic(rise, cubic_slopes);
            assert!(
                least <= cubics + 1e-12 && cubics <= least + 20.0 * step * rise,
                "{start}, {end}"
            );
            let least = least_slope_of_rational(rise, slopes);
            assert!(least <= rationals + 1e-12, "{start}, {end}: {least} {rationals}");
        }
    }
}
