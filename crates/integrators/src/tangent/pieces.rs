//! The steps of a run, whole or in parts, with their derivatives.

use nalgebra::DVector;

use super::columns::{Carried, Moved};
use super::differentiated::Differentiated;
use super::error::Unlinearised;
use super::part::{Ended, Part};
use super::smooth::{FlowOf, SmoothFlow as _};
use crate::step::{Flow, Laws, StepStart, Stepper};

/// A step is not halved more often than it has digits.
const DIGITS: u32 = f64::MANTISSA_DIGITS;

/// A step that is taken again in the halves in which it was taken.
struct Again<'a, F: Flow, M> {
    method: &'a M,
    parts: Vec<Part<F>>,
}

impl<F: Flow, M: Stepper<F>> Again<'_, F, M> {
    /// Takes a step, in halves where it is refused, and returns the laws at its end, with the entropy that is the reference of
    /// the next one.
    fn take(&mut self, start: &StepStart<'_, F>, h: f64, left: u32) -> Option<Laws<F::Numbers>> {
        let mut memory = M::Memory::default();
        if let Ok(taken) = self.method.attempt(start, h, &mut memory) {
            let reference = if taken.evidence.dissipates {
                taken.values.entropy
            } else {
                start.reference.entropy
            };
            self.parts.push(Part::new(start, &Ended::new(&taken, h, &memory)));
            return Some(Laws { entropy: reference, ..start.reference.clone() });
        }
        if left == 0 {
            return None;
        }
        let half = 0.5 * h;
        let reference = self.take(start, half, left - 1)?;
        let x = self.parts.last()?.end.clone();
        let (flow, time, allowed) = (start.flow, start.time + half, start.allowed.clone());
        let values = flow.laws(&x);
        let middle = StepStart { flow, x: &x, time, values, reference, allowed };
        self.take(&middle, half, left - 1)
    }
}

/// The parts in which a step was taken.
pub(super) fn parts<F, M>(
    method: &M,
    start: &StepStart<'_, F>,
    ended: &Ended<'_, F>,
) -> Result<Vec<Part<F>>, Unlinearised>
where
    F: Flow,
    M: Stepper<F>,
{
    // Steps beside one in parts are taken in the same parts.
    if !ended.in_parts || ended.again.is_some() {
        return Ok(vec![Part::new(start, ended)]);
    }
    let mut again = Again { method, parts: Vec::new() };
    let half = 0.5 * ended.h;
    let parts = (|| {
        let reference = again.take(start, half, DIGITS)?;
        let x = again.parts.last()?.end.clone();
        let (flow, time, allowed) = (start.flow, start.time + half, start.allowed.clone());
        let values = flow.laws(&x);
        let middle = StepStart { flow, x: &x, time, values, reference, allowed };
        again.take(&middle, half, DIGITS)
    })();
    parts.ok_or(Unlinearised::Singular)?;
    if let Some(last) = again.parts.last_mut() {
        last.end = ended.end.clone();
    }
    Ok(again.parts)
}

/// The derivatives at the end of a step of size `h` in parts.
pub(super) fn through<D, M>(
    (system, method): (&D, &M),
    (parts, h): (&[Part<FlowOf<D>>], f64),
    carried: &Carried,
) -> Result<Moved, Unlinearised>
where
    D: Differentiated<M>,
    M: Stepper<FlowOf<D>>,
{
    let n = system.as_flow().directions();
    let (mut carried, is_whole) = (carried.clone(), parts.len() == 1);
    let mut along_h = DVector::zeros(n);
    for part in parts {
        let next = system.propagate(method, part, &carried)?;
        if is_whole {
            return Ok(next);
        }
        // By the derivative of the part itself, since the columns may have become dependent where friction is strong.
        if along_h.iter().any(|along| *along != 0.0) {
            let here = Carried::start(system.wide_rows(&part.x));
            let moved = system.propagate(method, part, &here)?.carried.t;
            along_h = moved.view((0, 0), (n, n)) * along_h;
        }
        along_h += next.along_h * (part.h / h);
        carried = next.carried;
    }
    Ok(Moved { carried, along_h })
}
