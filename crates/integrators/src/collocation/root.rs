//! The root of a step that was taken, around which it is differentiated.

use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_fields::{Space as _, Vector};

use super::covectors::Stages;
use super::equation::StageEquation;
use super::fallbacks;
use super::heat::HeatStart;
use super::tableau::{STAGES, Tableau};
use crate::step::failure::Fallbacks;
use crate::step::{Dim, Effort, Flow as _};

/// The root of a step: with `d = Σ b_i h k_i` it goes from `φ_z(−d/2)` to `φ_z(d/2)`.
pub(crate) struct StepRoot<Y: Metriplectic> {
    pub(crate) tableau: &'static Tableau,
    /// The middle `z`.
    pub(crate) z: Point<Y>,
    /// The displacements `h k_i` of the stages in the chart at the middle.
    pub(crate) displacements: Stages<Vector<Y::Manifold>>,
    pub(crate) end: Point<Y>,
    /// The start, if what is lost of the energy becomes heat.
    pub(crate) heats: Option<HeatStart<Dim<Y>>>,
}

impl<Y: Metriplectic> StepRoot<Y> {
    /// The root of the step of size `h` from `x` to `end` with these velocities of its stages; without them it is solved from the
    /// straight line. `None` if it is not found.
    pub(crate) fn new(
        tableau: &'static Tableau,
        system: &Y,
        ([x, end], h): ([&Point<Y>; 2], f64),
        velocities: Option<Stages<Vector<Y::Manifold>>>,
    ) -> Option<Self> {
        let equation = StageEquation::new(tableau, system, x, system.laws(x), h);
        let solved = || {
            let straight = Y::Manifold::coordinates(x, end) * h.recip();
            let (guess, mut effort) = ([straight; STAGES], Effort::default());
            let solved = fallbacks::solve(&equation, Some(guess), Fallbacks::All, &mut effort);
            solved.ok().map(|solved| solved.k)
        };
        let k = velocities.or_else(solved)?;
        let chart = equation.chart(&k)?;
        let displacements = equation.polynomial(&chart, &k).k;
        let (z, end, heats) = (chart.z, chart.end, equation.heats);
        Some(Self { tableau, z, displacements, end, heats })
    }
}
