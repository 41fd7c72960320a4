//! States inside a step with stages, and the error of a step. As in [`crate::collocation`].

use super::chart::StepChart;
use super::covectors::{combined, displacements, each_stage};
use super::equation::StageEquation;
use super::fallbacks;
use super::memory::{LastStep, StageNumbers};
use super::step::Collocation;
use crate::implicit::algebra::is_finite;
use crate::implicit::parts::Parts;
use crate::implicit::start::Start;
use crate::numbers::Lengths;
use crate::step::failure::Fallbacks;
use crate::step::{Effort, Vector as _};

impl Collocation {
    /// The end of a step of size `θh` from the start of the last one, whose polynomial is its guess.
    pub(in crate::implicit) fn part_of_step<L: Lengths>(
        &self,
        start: &Start<'_, L>,
        memory: &StageNumbers<L>,
        theta: f64,
    ) -> Option<L::State> {
        let (tableau, LastStep { k, .. }) = (self.tableau, memory.last.as_ref()?);
        let equation = StageEquation::new(tableau, &Start { h: theta * start.h, ..start.clone() });
        let guess = each_stage(start.parts, tableau.stages, |i| {
            let coefficients = tableau.velocity(theta * tableau.nodes[i]);
            combined(1.0, tableau.stages, &coefficients, k)
        });
        let mut effort = Effort::default();
        let solved =
            fallbacks::solve(&equation, Some(guess), None, Fallbacks::FirstTries, &mut effort)
                .ok()?;
        Some(solved.at.end)
    }

    /// The error of a step of size `h` between two states, by a norm: the larger one of its [defects](Self::defects).
    pub(in crate::implicit) fn error_of_step<L: Lengths>(
        &self,
        parts: &Parts<'_, L>,
        ends: [&L::State; 2],
        h: f64,
        memory: &StageNumbers<L>,
        norm: impl Fn(&L::Vector) -> f64,
    ) -> Option<f64> {
        let [first, second] = self.defects([parts; 2], ends, h, memory)?;
        Some(norm(&first).max(norm(&second)))
    }

    /// The defects
    ///
    /// ```math
    /// h M^{-1} (u'(0) - f(x)), \qquad h M^{-1} (u'(1) - f(x'))
    /// ```
    ///
    /// of the polynomial of a step of size `h` at both ends, with the model at the time of each end.
    pub(in crate::implicit) fn defects<L: Lengths>(
        &self,
        parts: [&Parts<'_, L>; 2],
        ends: [&L::State; 2],
        h: f64,
        memory: &StageNumbers<L>,
    ) -> Option<[L::Vector; 2]> {
        let velocity = |i: usize| parts[i].velocity(ends[i]).filter(is_finite);
        let [first, second] = [velocity(0)?, velocity(1)?];
        let (tableau, (k, filter)) = (self.tableau, memory.last_step()?);
        let (parts, x) = (parts[0], ends[0]);
        let u = combined(h, tableau.stages, &tableau.weights, k);
        let chart = StepChart::of(parts, x, u)?;
        let k = displacements(tableau, (parts, x, h), &chart, k);
        let defect = |tau: f64, at: &L::State, velocity: &L::Vector| {
            let slope = combined(1.0, tableau.stages, &tableau.velocity(tau), &k);
            if parts.is_flat() {
                return filter.times(&parts.vector(|c| slope[c] - velocity[c] * h));
            }
            let q = chart.d.map(|d| d * (tau - 0.5));
            let there = parts.velocity_at(at, (&chart.z, &q), &slope);
            let off = parts.vector(|c| there[c] - velocity[c] * h);
            let middle = parts.velocity_at(&chart.z, (at, &parts.zero()), &off);
            filter.times(&chart.to_start(parts, x, middle))
        };
        Some([defect(0.0, x, &first), defect(1.0, ends[1], &second)])
    }
}
