//! The steps of a run, whole or in parts, with their derivatives.

use metriplectic_dynamics::system::Point;
use metriplectic_dynamics::{Differentiable, Metriplectic};
use metriplectic_fields::{Column as _, Dimension as _, Square as _, Vector};

use super::columns::Columns;
use super::error::Unlinearised;
use super::linearised::{Linearised, Piece, Propagated};
use crate::step::{
    Components, CountOf, Dim, EntropyStep, Laws, Memory as _, Numbers, StepStart, Stepper,
};

/// A system of a run.
pub(super) type Wide<D> = <D as Differentiable>::Wide;

/// A part of a step, or all of it.
pub(super) struct Part<D: Differentiable> {
    pub(super) x: Point<D>,
    pub(super) end: Point<D>,
    pub(super) h: f64,
    pub(super) entropy_step: Option<EntropyStep>,
    pub(super) stage_count: Option<u32>,
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
            allowed,
            reference,
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
}

/// How often a step is halved at most.
const HALVES: usize = 64;

/// A step that is taken again in the halves in which it was taken.
struct Again<'a, D: Differentiable, M> {
    system: &'a D,
    method: &'a M,
    parts: Vec<Part<D>>,
}

impl<D: Differentiable, M: Stepper<D>> Again<'_, D, M> {
    /// Takes a step, in halves where it is refused, and returns the laws at its end, with the entropy that is the reference of
    /// the next one.
    fn take(&mut self, start: &StepStart<'_, D>, h: f64, left: usize) -> Option<Laws<Numbers<D>>> {
        let mut memory = M::Memory::default();
        if let Ok(taken) = self.method.attempt(self.system, start, h, &mut memory) {
            let entropy_step = taken.evidence.entropy_step;
            let reference = if taken.evidence.dissipates {
                taken.values.entropy
            } else {
                start.reference.entropy
            };
            let ended = Ended {
                end: &taken.x,
                h,
                in_parts: false,
                entropy_step,
                stage_count: memory.stage_count(),
            };
            self.parts.push(Part::new(start, &ended));
            return Some(Laws { entropy: reference, ..start.reference });
        }
        if left == 0 {
            return None;
        }
        let half = 0.5 * h;
        let reference = self.take(start, half, left - 1)?;
        let x = self.parts.last()?.end.clone();
        let values = crate::step::Flow::laws(self.system, &x);
        let (time, allowed) = (start.time + half, start.allowed);
        let middle = StepStart { x: &x, time, values, reference, allowed };
        self.take(&middle, half, left - 1)
    }
}

/// Components of the wide system: those of the first factor, and zeros.
fn widened<D: Differentiable>(
    v: &Components<Vector<D::Manifold>>,
) -> Vector<<Wide<D> as Metriplectic>::Manifold> {
    let n = Dim::<D>::LEN;
    Vector::<<Wide<D> as Metriplectic>::Manifold>::from_index(|i| if i < n { v.0[i] } else { 0.0 })
}

/// The parts in which a step was taken.
pub(super) fn parts<D, M>(
    (system, method): (&D, &M),
    start: &StepStart<'_, D>,
    ended: &Ended<'_, D>,
) -> Result<Vec<Part<D>>, Unlinearised>
where
    D: Differentiable,
    M: Stepper<D>,
{
    if !ended.in_parts {
        return Ok(vec![Part::new(start, ended)]);
    }
    let mut again = Again { system, method, parts: Vec::new() };
    let half = 0.5 * ended.h;
    let parts = (|| {
        let reference = again.take(start, half, HALVES)?;
        let x = again.parts.last()?.end.clone();
        let values = crate::step::Flow::laws(system, &x);
        let middle =
            StepStart { x: &x, time: start.time + half, values, reference, allowed: start.allowed };
        again.take(&middle, half, HALVES)
    })();
    parts.ok_or(Unlinearised::Singular)?;
    if let Some(last) = again.parts.last_mut() {
        last.end = ended.end.clone();
    }
    Ok(again.parts)
}

/// The tangent at the end of a step.
pub(super) fn propagate<D, M>(
    (system, method): (&D, &M),
    start: &StepStart<'_, D>,
    ended: &Ended<'_, D>,
    columns: &Columns<Wide<D>>,
) -> Result<Propagated<Wide<D>>, Unlinearised>
where
    D: Differentiable,
    M: Stepper<D> + Linearised<Wide<D>>,
{
    let parts = parts((system, method), start, ended)?;
    let (mut columns, is_whole) = (columns.clone(), parts.len() == 1);
    let mut along_h = Vector::<<Wide<D> as Metriplectic>::Manifold>::zero();
    for part in &parts {
        let next = part.with(system, |piece| method.propagate(system.wide(), piece, &columns))?;
        if is_whole {
            return Ok(next);
        }
        let before = columns.t;
        let share = before.solve(&along_h).ok_or(Unlinearised::Singular)?;
        along_h = next.columns.t * share + next.along_h * (part.h / ended.h);
        columns = next.columns;
    }
    Ok(Propagated { columns, along_h })
}
