//! The steps of a run, whole or in parts, with their derivatives.

use metriplectic_dynamics::{Differentiable, Metriplectic};
use metriplectic_fields::{Column as _, Vector};

use super::along::LinearisedAlong;
use super::columns::Columns;
use super::error::Unlinearised;
use super::linearised::Propagated;
use super::part::{Ended, Part, Wide};
use crate::step::{Laws, Numbers, StepStart, Stepper};

/// A step is not halved more often than it has digits.
const DIGITS: u32 = f64::MANTISSA_DIGITS;

/// A step that is taken again in the halves in which it was taken.
struct Again<'a, D: Differentiable, M> {
    method: &'a M,
    parts: Vec<Part<D>>,
}

impl<D: Differentiable, M: Stepper<D>> Again<'_, D, M> {
    /// Takes a step, in halves where it is refused, and returns the laws at its end, with the entropy that is the reference of
    /// the next one.
    fn take(&mut self, start: &StepStart<'_, D>, h: f64, left: u32) -> Option<Laws<Numbers<D>>> {
        let mut memory = M::Memory::default();
        if let Ok(taken) = self.method.attempt(start, h, &mut memory) {
            let reference = if taken.evidence.dissipates {
                taken.values.entropy
            } else {
                start.reference.entropy
            };
            self.parts.push(Part::new(start, &Ended::new(&taken, h, &memory)));
            return Some(Laws { entropy: reference, ..start.reference });
        }
        if left == 0 {
            return None;
        }
        let half = 0.5 * h;
        let reference = self.take(start, half, left - 1)?;
        let x = self.parts.last()?.end.clone();
        let (flow, time, allowed) = (start.flow, start.time + half, start.allowed);
        let values = crate::step::Flow::laws(flow, &x);
        let middle = StepStart { flow, x: &x, time, values, reference, allowed };
        self.take(&middle, half, left - 1)
    }
}

/// The parts in which a step was taken.
pub(super) fn parts<D, M>(
    method: &M,
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
    let mut again = Again { method, parts: Vec::new() };
    let half = 0.5 * ended.h;
    let parts = (|| {
        let reference = again.take(start, half, DIGITS)?;
        let x = again.parts.last()?.end.clone();
        let (flow, time, allowed) = (start.flow, start.time + half, start.allowed);
        let values = crate::step::Flow::laws(flow, &x);
        let middle = StepStart { flow, x: &x, time, values, reference, allowed };
        again.take(&middle, half, DIGITS)
    })();
    parts.ok_or(Unlinearised::Singular)?;
    if let Some(last) = again.parts.last_mut() {
        last.end = ended.end.clone();
    }
    Ok(again.parts)
}

/// The tangent at the end of a step.
pub(super) fn propagate<D, M>(
    method: &M,
    start: &StepStart<'_, D>,
    ended: &Ended<'_, D>,
    columns: &Columns<Wide<D>>,
) -> Result<Propagated<Wide<D>>, Unlinearised>
where
    D: Differentiable,
    M: Stepper<D> + LinearisedAlong<D>,
{
    let (system, parts) = (start.flow, parts(method, start, ended)?);
    let (mut columns, is_whole) = (columns.clone(), parts.len() == 1);
    let mut along_h = Vector::<<Wide<D> as Metriplectic>::Manifold>::zero();
    for part in &parts {
        let next = method.propagate_along(system, part, &columns)?;
        if is_whole {
            return Ok(next);
        }
        // By the derivative of the part itself, since the columns may have become dependent where friction is strong.
        if along_h.magnitude() > 0.0 {
            let here = Columns::start(system.wide(), &system.widened(&part.x));
            along_h = method.propagate_along(system, part, &here)?.columns.t * along_h;
        }
        along_h += next.along_h * (part.h / ended.h);
        columns = next.columns;
    }
    Ok(Propagated { columns, along_h })
}
