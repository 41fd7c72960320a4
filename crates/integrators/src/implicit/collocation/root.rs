//! The root of a step that was taken, around which it is differentiated.

use metriplectic_equations::Model;

use super::covectors::each_stage;
use super::equation::StageEquation;
use super::fallbacks;
use crate::collocation::tableau::Tableau;
use crate::implicit::drift;
use crate::implicit::parts::Parts;
use crate::implicit::start::Start;
use crate::numbers::{AtRunTime, List as _};
use crate::step::failure::Fallbacks;
use crate::step::{Directions, Effort, Entries};

/// The root of a step from `x` to `x' = x + Σ b_i h k_i`.
pub(crate) struct StageRoot {
    /// The displacements `h k_i` of the stages.
    pub(crate) displacements: Vec<Directions>,
    /// The end `x'`.
    pub(crate) end: Entries,
    /// The entries that are not warmed, if what is lost of the energy becomes heat.
    pub(crate) still: Option<Vec<bool>>,
}

impl StageRoot {
    /// The root of the step of size `h` between two states with these velocities of its stages; without them it is solved from the
    /// straight line. `None` if it is not found.
    pub(crate) fn new(
        tableau: &'static Tableau,
        model: &dyn Model,
        ([x, end], h): ([&[f64]; 2], f64),
        velocities: &[f64],
    ) -> Option<Self> {
        let (parts, [x, end]) = (&Parts::<AtRunTime>::of(model), [x, end].map(Entries::of));
        let (n, s) = (parts.n(), tableau.stages);
        let values = parts.laws(&x);
        let accumulated_error = drift::nothing::<AtRunTime>(&values);
        let start = Start { parts, x: &x, time: 0.0, h, values, accumulated_error };
        let equation = StageEquation::new(tableau, &start);
        let k = if velocities.len() >= n * s && n > 0 {
            each_stage(parts, s, |i| Directions::of(&velocities[i * n..][..n]))
        } else {
            let straight = parts.between(&x, &end);
            let guess = each_stage(parts, s, |_| parts.vector(|c| straight[c] / h));
            let effort = &mut Effort::default();
            fallbacks::solve(&equation, Some(guess), None, Fallbacks::All, effort).ok()?.k
        };
        let chart = equation.chart(&k)?;
        let displacements = k[..s].iter().map(|k| parts.vector(|c| k[c] * h)).collect();
        let still = equation.heats.map(|heats| heats.still);
        Some(Self { displacements, end: chart.end, still })
    }
}
