//! A step that was taken, or a part of one.

use metriplectic_dynamics::{Differentiable, Metriplectic};
use metriplectic_fields::{Column as _, Dimension as _, Vector};

use super::error::Unlinearised;
use super::linearised::Piece;
use crate::run::last_step::LastStep;
use crate::step::{
    CountOf, Dim, Element, EntropyStep, Flow, Laws, Memory, Saved, StepStart, Stepper, Taken,
    Vector as _,
};

/// A system of a run.
pub(super) type Wide<D> = <D as Differentiable>::Wide;

/// The means to take a step again, and others beside it.
#[derive(Clone, Debug)]
pub(super) struct Again<V> {
    /// The memory of the method before it, without what it extrapolates from.
    pub(super) memory: Saved,
    /// The largest size that each entry has had in the run, or soon has from its start.
    pub(super) sizes: V,
    /// The size of the whole step.
    pub(super) whole: f64,
    /// A corner is near: no step beside it has another time or another size.
    pub(super) is_still: bool,
}

/// The memory with which a step is taken again.
pub(super) fn memory_before<F: Flow, M: Stepper<F>>(
    again: Option<&Again<F::Vector>>,
) -> Result<M::Memory, Unlinearised> {
    let restored = again.map(|again| M::Memory::restore(&again.memory));
    restored.transpose().map_err(|_| Unlinearised::Singular).map(Option::unwrap_or_default)
}

/// A step of a system that was taken, or a part of one.
#[allow(
    missing_debug_implementations,
    reason = "it stands in signatures of a trait, and its entries are private"
)]
pub struct Part<F: Flow> {
    pub(super) x: Element<F>,
    pub(super) end: Element<F>,
    pub(super) time: f64,
    pub(super) h: f64,
    pub(super) in_parts: bool,
    pub(super) again: Option<Again<F::Vector>>,
    pub(super) entropy_step: Option<EntropyStep>,
    pub(super) stage_count: Option<u32>,
    pub(super) stage_velocities: Vec<f64>,
    pub(super) allowed: Option<F::Vector>,
    pub(super) reference: Laws<F::Numbers>,
}

impl<F: Flow> Part<F> {
    pub(super) fn new(start: &StepStart<'_, F>, ended: &Ended<'_, F>) -> Self {
        let allowed = start.allowed.clone();
        let (x, end, reference) = (start.x.clone(), ended.end.clone(), start.reference.clone());
        Self {
            x,
            end,
            time: start.time,
            h: ended.h,
            in_parts: ended.in_parts,
            again: ended.again.clone(),
            entropy_step: ended.entropy_step,
            stage_count: ended.stage_count,
            stage_velocities: ended.stage_velocities.clone(),
            allowed,
            reference,
        }
    }
}

impl<D: Differentiable> Part<D> {
    /// The part as one of the system itself.
    pub(super) fn narrow(&self) -> Piece<'_, D> {
        let allowed = self.allowed.as_ref();
        Piece {
            x: &self.x,
            end: &self.end,
            h: self.h,
            moving: Dim::<D>::LEN,
            allowed: allowed.map(|a| a.0),
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
            allowed: self.allowed.as_ref().map(widened::<D>),
            targets: Laws { energy, entropy, invariants },
            entropy_step: self.entropy_step,
            stage_count: self.stage_count,
            stage_velocities: &self.stage_velocities,
        })
    }
}

/// The end of a step that was taken.
pub(super) struct Ended<'a, F: Flow> {
    pub(super) end: &'a Element<F>,
    pub(super) h: f64,
    pub(super) in_parts: bool,
    pub(super) entropy_step: Option<EntropyStep>,
    pub(super) stage_count: Option<u32>,
    pub(super) stage_velocities: Vec<f64>,
    /// If steps beside it are to be taken.
    pub(super) again: Option<Again<F::Vector>>,
}

impl<'a, F: Flow> Ended<'a, F> {
    /// The end of a step of size `h`, with the memory after it.
    pub(super) fn new(taken: &'a Taken<F>, h: f64, memory: &impl Memory) -> Self {
        Self {
            end: &taken.x,
            h,
            in_parts: taken.effort.splits > 0,
            entropy_step: taken.evidence.entropy_step,
            stage_count: memory.stage_count(),
            stage_velocities: memory.stage_velocities(),
            again: None,
        }
    }

    /// The end of the last step of a run.
    pub(super) fn of_run(end: &'a Element<F>, last: &LastStep<'_, F>) -> Self {
        Self {
            end,
            h: last.h,
            in_parts: last.in_parts,
            entropy_step: last.entropy_step,
            stage_count: last.stage_count,
            stage_velocities: last.stage_velocities.clone(),
            again: None,
        }
    }

    /// As it is, of a whole step of this size beside which others are to be taken, or of a part of it.
    pub(super) fn with_again(self, again: Option<&Again<F::Vector>>, whole: f64) -> Self {
        Self { again: again.map(|again| Again { whole, ..again.clone() }), ..self }
    }
}

/// Components of the wide system: those of the first factor, and zeros.
fn widened<D: Differentiable>(
    v: &<D as Flow>::Vector,
) -> Vector<<Wide<D> as Metriplectic>::Manifold> {
    let n = Dim::<D>::LEN;
    Vector::<<Wide<D> as Metriplectic>::Manifold>::from_index(
        |i| if i < n { v.get(i) } else { 0.0 },
    )
}
