//! The steps of a run, whole or in parts, with their derivatives.

use metriplectic_dynamics::system::Point;
use metriplectic_dynamics::{Differentiable, Metriplectic};
use metriplectic_fields::{Column as _, Dimension as _, Square as _, Vector};

use super::columns::Columns;
use super::error::Unlinearised;
use super::linearised::{Linearised, Piece, Propagated};
use crate::step::{Components, Dim, EntropyStep, Laws, Numbers, StepStart, Stepper};

/// A system of a run.
pub(super) type Wide<D> = <D as Differentiable>::Wide;

/// A part of a step.
struct Part<D: Metriplectic> {
    x: Point<D>,
    end: Point<D>,
    h: f64,
    entropy_step: Option<EntropyStep>,
}

/// The end of a step that was taken.
pub(super) struct Ended<'a, D: Metriplectic> {
    pub(super) end: &'a Point<D>,
    pub(super) h: f64,
    pub(super) in_parts: bool,
    pub(super) entropy_step: Option<EntropyStep>,
}

/// How often a step is halved at most.
const HALVES: usize = 64;

/// A step that is taken again in the halves in which it was taken.
struct Again<'a, D: Metriplectic, M> {
    system: &'a D,
    method: &'a M,
    parts: Vec<Part<D>>,
}

impl<D: Metriplectic, M: Stepper<D>> Again<'_, D, M> {
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
            let x = start.x.clone();
            self.parts.push(Part { x, end: taken.x, h, entropy_step });
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
    let allowed = start.allowed.as_ref().map(widened::<D>);
    let piece = |x: &Point<D>, end: &Point<D>, h, entropy_step, columns: &Columns<Wide<D>>| {
        let (x, end) = (&system.widened(x), &system.widened(end));
        let piece = Piece { x, end, h, moving: Dim::<D>::LEN, allowed, entropy_step };
        method.propagate(system.wide(), &piece, columns)
    };
    if !ended.in_parts {
        return piece(start.x, ended.end, ended.h, ended.entropy_step, columns);
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
    let (mut columns, last) = (columns.clone(), again.parts.len() - 1);
    let mut along_h = Vector::<<Wide<D> as Metriplectic>::Manifold>::zero();
    for (k, Part { x, end, h, entropy_step }) in again.parts.iter().enumerate() {
        let end = if k == last { ended.end } else { end };
        let next = piece(x, end, *h, *entropy_step, &columns)?;
        let before = columns.t;
        let share = before.solve(&along_h).ok_or(Unlinearised::Singular)?;
        along_h = next.columns.t * share + next.along_h * (h / ended.h);
        columns = next.columns;
    }
    Ok(Propagated { columns, along_h })
}
