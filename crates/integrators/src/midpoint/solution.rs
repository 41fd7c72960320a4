//! The solution of an equation of a step, for a system whose energy is not to stay what it is.

use metriplectic_dynamics::Metriplectic;
use metriplectic_dynamics::system::Point;
use metriplectic_fields::Vector;
use metriplectic_manifolds::{Manifold as _, Retraction};

use super::memory::MemoryOf;
use super::scheme::Scheme;
use super::step::Solved;
use crate::discrete_gradient::DiscreteGradient;
use crate::round_off::compensation::Displaced;
use crate::step::failure::{Cause, Fallbacks};
use crate::step::{Effort, Evidence, Start};

/// A step that was solved.
pub(crate) struct Solution<Y: Metriplectic> {
    /// The end of the step.
    pub(crate) end: Point<Y>,
    /// The base point `z`.
    pub(crate) z: Point<Y>,
    /// The discrete gradients of energy and entropy.
    pub(crate) energy: Vector<Y::Manifold>,
    pub(crate) entropy: Vector<Y::Manifold>,
    pub(crate) evidence: Evidence,
    pub(crate) effort: Effort,
}

/// A step that was not solved: why, the least residual, and what was done.
pub(crate) type Unsolved = (Cause, f64, Effort);

impl<R, W: DiscreteGradient> Scheme<R, W> {
    /// Solves the equation of a step, and adds the digits that earlier steps have lost of the position. What the step
    /// leaves of the laws is for the next one to take back.
    pub(crate) fn solution<Y>(
        &self,
        start: &Start<'_, Y>,
        memory: &mut MemoryOf<Y>,
        fallbacks: Fallbacks,
    ) -> Result<Solution<Y>, Unsolved>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        let solved = self.solved(start, memory, fallbacks);
        let Solved { equation, root, effort, evidence } =
            solved.map_err(|failure| (failure.cause, failure.residual, failure.effort))?;
        let failed = |cause| (cause, root.residual, effort);
        let system = start.system;
        let metric = system.metric();
        let path = self.retraction.real_step_path(metric, start.x, &root.u);
        let z = path.map_err(|_| failed(Cause::Edge))?.z.base;
        let jet = equation.jet(&root.u).ok_or_else(|| failed(Cause::Edge))?;
        let (energy, entropy) = (jet.energy, jet.entropy);
        if evidence.rests {
            let end = start.x.clone();
            return Ok(Solution { end, z, energy, entropy, evidence, effort });
        }
        let end = self.retraction.end(metric, start.x, &root.u);
        let end = end.map_err(|_| failed(Cause::Edge))?;
        if system.manifold().defect(&end).is_infinite() {
            return Err(failed(Cause::Edge));
        }
        memory.predictor.note::<Y::Manifold>(start.x, &root.u, &end);
        let lost = |x: &_, d: &_, end: &_| self.retraction.lost_digits(metric, x, d, end);
        let step = Displaced { x: start.x, d: &root.u, end: &end };
        let compensated = memory.compensation.add::<Y::Manifold>(lost, &step);
        let end = compensated.unwrap_or(end);
        Ok(Solution { end, z, energy, entropy, evidence, effort })
    }
}
