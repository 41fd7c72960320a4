//! A step that was taken, linearised at its root.

use std::ops::Range;

use metriplectic_equations::Model;

use super::equation::{AlongParameters, Equation, FromEnd};
use crate::implicit::drift;
use crate::implicit::parts::{Parts, is_flat};
use crate::numbers::{AtRunTime, List as _};
use crate::step::{Directions, Entries, PathOfStep};

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
    at_root(model, line, [x, end], h, |equation, u| equation.at_root(u))
}

/// The equation of such a step along parameters, with both ends where they are; `None` where it has no derivatives, and off vector spaces
/// with the canonical metric.
pub(crate) fn along_parameters(
    model: &dyn Model,
    line: PathOfStep,
    ends: [&[f64]; 2],
    h: f64,
    parameters: Range<usize>,
) -> Option<AlongParameters<AtRunTime>> {
    at_root(model, line, ends, h, |equation, u| equation.along_parameters(u, parameters))
}

/// Calls `f` with the equation of a step and its root.
fn at_root<T>(
    model: &dyn Model,
    line: PathOfStep,
    [x, end]: [&[f64]; 2],
    h: f64,
    f: impl FnOnce(&Equation<'_, AtRunTime>, &Directions) -> Option<T>,
) -> Option<T> {
    if !is_flat(model) {
        return None;
    }
    let (parts, [x, end]) = (&Parts::of(model), [x, end].map(Entries::of));
    let values = parts.laws(&x);
    let drift = drift::nothing::<AtRunTime>(&values);
    f(&Equation { parts, line, x: &x, h, values, drift }, &parts.between(&x, &end))
}
