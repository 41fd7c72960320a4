//! The balance at the end of an implicit step.

use super::halves::Failure;
use crate::round_off::bound::{ROUNDED, breaks_first_law};
use crate::step::failure::Cause;
use crate::step::{Effort, Element, Flow, Laws, StepStart};

/// The error of the balance, relative to the terms of the energy, up to which it is one of last digits.
const LAST_DIGITS: f64 = 1e-11;

/// The end of a step that was booked, with its laws.
pub(super) type End<F> = (Element<F>, Laws<<F as Flow>::Numbers>);

/// The end of an implicit step with the last digits of its balance, if it then has that of the run.
pub(super) fn balanced<F: Flow>(
    start: &StepStart<'_, F>,
    end: Element<F>,
    effort: Effort,
) -> Result<End<F>, Failure> {
    let failed = |cause| Failure { cause, residual: f64::INFINITY, effort };
    let (end, values) = with_last_digits(start, end);
    if !(values.energy.is_finite() && values.entropy.is_finite()) {
        return Err(failed(Cause::Edge));
    }
    let change = values.energy - start.reference.energy;
    let sizes = || start.flow.energy_sizes([start.x, &end]);
    match breaks_first_law(change, values.energy, sizes) {
        Some(size) => Err(failed(Cause::Energy { change, size })),
        None => Ok((end, values)),
    }
}

/// The end of an implicit step with the last digits of its balance. Where friction is fast and a step short, the rounding of
/// the end makes heat that is larger than a rounding of the energy. The point is moved onto the balance, with its entropy
/// where that does not depend on it, unless the entropy would fall.
fn with_last_digits<F: Flow>(start: &StepStart<'_, F>, x: Element<F>) -> End<F> {
    let flow = start.flow;
    let values = flow.laws(&x);
    let off = |laws: &Laws<F::Numbers>| (laws.energy - start.reference.energy).abs();
    let size = flow.term_sizes(&x).energy;
    if !(off(&values) > ROUNDED * size && off(&values) <= LAST_DIGITS * size) {
        return (x, values);
    }
    let both = flow.onto(&x, &start.reference, Some(values.entropy));
    let moved = both.or_else(|| flow.onto(&x, &start.reference, None));
    let moved = moved.map(|moved| (flow.laws(&moved), moved));
    match moved.filter(|(laws, _)| off(laws) < off(&values) && laws.entropy >= start.values.entropy)
    {
        Some((laws, moved)) => (moved, laws),
        None => (x, values),
    }
}
