//! The units of entries, in which steps of models are solved for, and the differentials of their laws.

use metriplectic_equations::Model;
use metriplectic_fields::{length, power_of_two};
use nalgebra::{DMatrix, DVector};

use super::super::certificate::worse;
use super::super::error::Unlinearised;
use super::super::explicit::NEAR;
use super::StepOfModel;
use crate::implicit::law_along_parameters;
use crate::round_off::bound::BROKEN;
use crate::system::NO_CLOCK;

/// The unit of each entry, a power of two near its largest size on a step: in another one each number of a factorisation differs by a
/// power of two, so that its pivots are the same.
pub(super) fn units(step: &StepOfModel<'_>) -> DVector<f64> {
    let (x, end, whole) = (step.x, step.end, length(step.x));
    DVector::from_fn(x.len(), |i, _| {
        let size = x[i].abs().max(end[i].abs()).max((end[i] - x[i]).abs());
        let size = if size > 0.0 { size } else { whole };
        if size > 0.0 { power_of_two(size) } else { 1.0 }
    })
}

/// The matrix `A_ij s_j/s_i` in the units `s`, from its numbers row by row.
pub(super) fn scaled(numbers: &[f64], units: &DVector<f64>) -> DMatrix<f64> {
    let n = units.len();
    DMatrix::from_fn(n, n, |i, j| numbers[i * n + j] * units[j] / units[i])
}

/// The differential of a law at a state, and behind it the derivatives along so many parameters.
pub(super) fn differential(
    model: &dyn Model,
    law: usize,
    x: &[f64],
    parameters: usize,
) -> DVector<f64> {
    let mut df = DVector::zeros(x.len());
    model.jet(law, NO_CLOCK, x, df.as_mut_slice());
    let (along, _) = law_along_parameters(model, law, x, parameters);
    DVector::from_iterator(df.len() + parameters, df.iter().chain(&along).copied())
}

/// The sum of terms relative to their sizes; zero if they cancel.
pub(super) fn relative(terms: &[f64]) -> f64 {
    let off: f64 = terms.iter().sum();
    if off == 0.0 { 0.0 } else { off.abs() / terms.iter().map(|term| term.abs()).sum::<f64>() }
}

/// Refuses a step that is not the one that was taken: its end is another one, in an entry relative to its size.
pub(super) fn reproduced(step: &StepOfModel<'_>, end: &[f64]) -> Result<(), Unlinearised> {
    let off = (0..end.len()).fold(0.0, |worst: f64, i| {
        let [x, there] = [step.x[i], step.end[i]];
        let (off, size) = ((end[i] - there).abs(), x.abs().max(there.abs()));
        if off == 0.0 { worst } else { worse(worst, off / size.max((there - x).abs())) }
    });
    if off <= NEAR { Ok(()) } else { Err(Unlinearised::NotReproduced { off }) }
}

/// Refuses a derivative that breaks `dH(x') J = dH(x)`, relative to the terms `|∂_iH| |x_i|`.
pub(super) fn first_law(
    x: &[f64],
    [pulled, before]: [&DVector<f64>; 2],
) -> Result<(), Unlinearised> {
    let sum = |f: &dyn Fn(usize) -> f64| (0..x.len()).map(|i| f(i) * x[i].abs()).sum::<f64>();
    let off = sum(&|i| (pulled[i] - before[i]).abs());
    let terms = sum(&|i| pulled[i].abs() + before[i].abs());
    if off <= BROKEN * terms { Ok(()) } else { Err(Unlinearised::LawBroken { off: off / terms }) }
}
