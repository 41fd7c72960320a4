//! A step that was taken, linearised at its root.

use metriplectic_equations::Model;

use super::equation::{Equation, FromEnd};
use crate::implicit::drift;
use crate::implicit::parts::{Parts, is_flat};
use crate::numbers::{AtRunTime, List as _};
use crate::step::{Entries, PathOfStep};

/// The equation of the step of size `h` between two states of a model, along its end; `None` where it has no derivatives, and off vector spaces with the canonical metric.
///
/// A step from `x` to `x'` and the step of the opposite size from `x'` to `x` have the same base, if it is in the middle, opposite
/// displacements and the same discrete gradients, so that the residual of one is that of the other less its sign.
pub(crate) fn from_end(
    model: &dyn Model,
    line: PathOfStep,
    [x, end]: [&[f64]; 2],
    h: f64,
) -> Option<FromEnd<AtRunTime>> {
    if !is_flat(model) {
        return None;
    }
    let (parts, [x, end]) = (&Parts::of(model), [x, end].map(Entries::of));
    let values = parts.laws(&x);
    let drift = drift::nothing::<AtRunTime>(&values);
    Equation { parts, line, x: &x, h, values, drift }.at_root(&parts.between(&x, &end))
}
