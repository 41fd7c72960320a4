//! A step that was taken, or a part of one.

use metriplectic_dynamics::system::Point;
use metriplectic_dynamics::{Differentiable, Metriplectic};
use metriplectic_fields::{Column as _, Dimension as _, Vector};

use super::linearised::Piece;
use crate::run::last_step::LastStep;
use crate::step::{Components, CountOf, Dim, EntropyStep, Laws, Memory, Numbers, StepStart, Taken};

/// A system of a run.
pub(super) type Wide<D> = <D as Differentiable>::Wide;

/// A step of a system that was taken, or a part of one.
#[allow(
    missing_debug_implementations,
    reason = "it stands in signatures of a trait, and its entries are private"
)]
pub struct Part<D: Differentiable> {
    pub(super) x: Point<D>,
    pub(super) end: Point<D>,
    pub(super) h: f64,
    pub(super) entropy_step: Option<EntropyStep>,
    pub(super) stage_count: Option<u32>,
    pub(super) stage_velocities: Vec<f64>,
    pub(super) allowed: Option<Vector<<Wide<D> as Metriplectic>::Manifold>>,
    pub(super) reference: Laws<Numbers<D>>,
}

impl<D: Differentiable> Part<D> {
    pub(super) fn new(start: &StepStart<'_, D>, ended: &Ended<'_, D>) -> Self {
        let allowed = start.allowed.as_ref().map(widened::<D>);
        let (x, end, reference) = (start.x.clone(), ended.end.clone(), start.reference);
        Self {
            x,
            end,
            h: ended.h,
            entropy_step: ended.entropy_step,
            stage_count: ended.stage_count,
            stage_velocities: ended.stage_velocities.clone(),
            allowed,
            reference,
        }
    }

    /// The part as one of the system itself.
    pub(super) fn narrow(&self) -> Piece<'_, D> {
        let allowed = self.allowed.as_ref();
        Piece {
            x: &self.x,
            end: &self.end,
            h: self.h,
            moving: Dim::<D>::LEN,
            allowed: allowed.map(|a| Vector::<D::Manifold>::from_index(|i| a[i])),
            targets: self.reference,
            entropy_step: self.entropy_step,
            stage_count: self.stage_count,
            stage_velocities: &self.stage_velocities,
        }
    }

    /// The part as one of the wide system.
    pub(super) fn with<T>(&self, system: &D, f: impl FnOnce(&Piece<'_, Wide<D>>) -> T) -> T {
        let (x, end) = (&system.widened(&self.x), &system.widened(&self.end));
        let Laws { energy, entropy, ref invariants } = self.reference;
        let listed = invariants.as_ref();
        let invariants = CountOf::<Wide<D>>::array(|k| listed.get(k).copied().unwrap_or_default());
        f(&Piece {
            x,
            end,
            h: self.h,
            moving: Dim::<D>::LEN,
            allowed: self.allowed,
            targets: Laws { energy, entropy, invariants },
            entropy_step: self.entropy_step,
            stage_count: self.stage_count,
            stage_velocities: &self.stage_velocities,
        })
    }
}

/// The end of a step that was taken.
pub(super) struct Ended<'a, D: Metriplectic> {
    pub(super) end: &'a Point<D>,
    pub(super) h: f64,
    pub(super) in_parts: bool,
    pub(super) entropy_step: Option<EntropyStep>,
    pub(super) stage_count: Option<u32>,
    pub(super) stage_velocities: Vec<f64>,
}

impl<'a, D: Metriplectic> Ended<'a, D> {
    /// The end of a step of size `h`, with the memory after it.
    pub(super) fn new(taken: &'a Taken<D>, h: f64, memory: &impl Memory) -> Self {
        Self {
            end: &taken.x,
            h,
            in_parts: taken.effort.splits > 0,
            entropy_step: taken.evidence.entropy_step,
            stage_count: memory.stage_count(),
            stage_velocities: memory.stage_velocities(),
        }
    }

    /// The end of the last step of a run.
    pub(super) fn of_run(end: &'a Point<D>, last: &LastStep<'_, D>) -> Self {
        Self {
            end,
            h: last.h,
            in_parts: last.in_parts,
            entropy_step: last.entropy_step,
            stage_count: last.stage_count,
            stage_velocities: last.stage_velocities.clone(),
        }
    }
}

/// Components of the wide system: those of the first factor, and zeros.
fn widened<D: Differentiable>(
    v: &Components<Vector<D::Manifold>>,
) -> Vector<<Wide<D> as Metriplectic>::Manifold> {
    let n = Dim::<D>::LEN;
    Vector::<<Wide<D> as Metriplectic>::Manifold>::from_index(|i| if i < n { v.0[i] } else { 0.0 })
}
