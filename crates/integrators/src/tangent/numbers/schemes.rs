//! The derivative of a self-adjoint midpoint step of a model, by two linearisations, as in [`schemes`](super::super::schemes), whose
//! formulas it has.
//!
//! On a vector space the end `x' = x + d` moves with the unknown `d` of the step, and the start with that of the step of the opposite
//! size from `x'` to `x`. So `E = F = 1`, and with the Jacobians `A = ∂R/∂x'` and `B = −∂R/∂x` of the residual `R = d − h V`
//!
//! ```math
//! J = A^{-1} B, \qquad \frac{\partial x'}{\partial h} = A^{-1} \frac{d}{h}, \qquad J^T \lambda = B^T A^{-T} \lambda .
//! ```
//!
//! At fixed ends the residual depends on parameters `θ` through the discrete gradients and the parts of the velocity alone, and with
//! `C = h ∂V/∂θ` there
//!
//! ```math
//! \frac{\partial x'}{\partial\theta} = A^{-1} C, \qquad
//! \Bigl(\frac{\partial x'}{\partial\theta}\Bigr)^T \lambda = C^T A^{-T} \lambda .
//! ```

use std::borrow::Cow;

use metriplectic_dynamics::SecondLaw;
use metriplectic_equations::{ENTROPY, Path};
use nalgebra::{DMatrix, DVector};

use super::super::error::Unlinearised;
use super::super::factors::Refined;
use super::units::{differential, first_law, relative, scaled, units};
use super::{Derivative, Pulled, StepOfModel};
use crate::implicit::{self, FromEnd, from_end};
use crate::numbers::AtRunTime;
use crate::step::{GradientKind, PathOfStep};

/// Returns whether a step is the same seen from either end.
pub(in crate::tangent) fn is_self_adjoint(line: PathOfStep) -> bool {
    line.path != Path::Exponential && line.gradient != GradientKind::ItohAbe
}

fn column(v: &[f64]) -> DVector<f64> {
    DVector::from_column_slice(v)
}

/// Both linearisations of a step, in units of the entries.
struct Both {
    /// `A` and `B`.
    jacobians: [DMatrix<f64>; 2],
    /// `C`.
    motion: DMatrix<f64>,
    /// The differentials of the energy at the start and at the end.
    energy: [DVector<f64>; 2],
    /// The displacement.
    d: DVector<f64>,
    units: DVector<f64>,
}

/// The equation of a step along its end, and that of the opposite step along the start.
fn from_both_ends(
    step: &StepOfModel<'_>,
    line: PathOfStep,
) -> Result<[FromEnd<AtRunTime>; 2], Unlinearised> {
    if !is_self_adjoint(line) {
        return Err(Unlinearised::NotSymmetric);
    }
    let &StepOfModel { model, x, end, h, .. } = step;
    let there = from_end(model, line, [x, end], h).ok_or(Unlinearised::Singular)?;
    let back = from_end(model, line, [end, x], -h).ok_or(Unlinearised::Singular)?;
    Ok([there, back])
}

/// `h ∂V/∂θ` at fixed ends, and the derivatives of the growth of the entropy.
fn along_parameters(
    step: &StepOfModel<'_>,
    line: PathOfStep,
) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let &StepOfModel { model, x, end, h, parameters: count, .. } = step;
    let n = x.len();
    let (mut motion, mut growth) = (DMatrix::zeros(n, count), DVector::zeros(count));
    for first in (0..count).step_by(n) {
        let chunk = first..count.min(first + n);
        let (at, len) = (chunk.start, chunk.len());
        let along = implicit::along_parameters(model, line, [x, end], h, chunk)?;
        let columns = DMatrix::from_row_slice(n, n, along.motion.numbers());
        motion.columns_mut(at, len).copy_from(&columns.columns(0, len));
        (0..len).for_each(|c| growth[at + c] = along.growth[c]);
    }
    Some((motion, growth))
}

impl Both {
    fn of(step: &StepOfModel<'_>, line: PathOfStep) -> Result<Self, Unlinearised> {
        let units = units(step);
        let [there, back] = from_both_ends(step, line)?;
        let (x, end) = (column(step.x), column(step.end));
        let (mut motion, _) = along_parameters(step, line).ok_or(Unlinearised::Singular)?;
        (0..units.len()).for_each(|i| motion.row_mut(i).unscale_mut(units[i]));
        Ok(Self {
            motion,
            jacobians: [&there, &back].map(|at| scaled(at.jacobian.numbers(), &units)),
            energy: [&back, &there].map(|at| column(at.energy.numbers())),
            d: end - x,
            units,
        })
    }

    fn derivative(&self, h: f64) -> Option<Derivative> {
        let Self { jacobians: [a, b], motion, d, units, .. } = self;
        let a = Refined::of(Cow::Borrowed(a))?;
        let mut along_x = DMatrix::zeros(units.len(), units.len());
        for k in 0..units.len() {
            let column = a.solve(&b.column(k).into_owned())?;
            along_x.set_column(k, &(column.component_mul(units) / units[k]));
        }
        let along_h = a.solve(&(d.component_div(units) / h))?.component_mul(units);
        let mut along_parameters = motion.clone();
        for mut column in along_parameters.column_iter_mut() {
            let moved = a.solve(&column.clone_owned())?.component_mul(units);
            column.copy_from(&moved);
        }
        Some(Derivative { along_x, along_parameters, along_h })
    }

    /// `Jᵀ λ` and `(∂x'/∂θ)ᵀ λ` for each row.
    fn transposed<const K: usize>(&self, rows: [&DVector<f64>; K]) -> Option<[Pulled; K]> {
        let Self { jacobians: [a, b], motion, units, .. } = self;
        let a = Refined::of(Cow::Owned(a.transpose()))?;
        let mut pulled = rows.map(|row| (row.clone(), DVector::zeros(0)));
        for (row, along) in &mut pulled {
            let through = a.solve(&row.component_mul(units))?;
            *row = b.tr_mul(&through).component_div(units);
            *along = motion.tr_mul(&through);
        }
        Some(pulled)
    }
}

/// The derivatives of a step along a line.
///
/// # Errors
///
/// [`Unlinearised`] if the step is not symmetric, or its Jacobian is singular or not a number.
pub(in crate::tangent) fn derivative(
    step: &StepOfModel<'_>,
    line: PathOfStep,
) -> Result<Derivative, Unlinearised> {
    Both::of(step, line)?.derivative(step.h).ok_or(Unlinearised::Singular)
}

/// The derivatives of a loss along the start of a step and along the parameters from that along its end, if the first law of the step
/// holds.
///
/// # Errors
///
/// [`Unlinearised`] as for the [derivative], and if `dH(x') J` is not `dH(x)`.
pub(in crate::tangent) fn pull_back(
    step: &StepOfModel<'_>,
    line: PathOfStep,
    costate: &[f64],
) -> Result<Pulled, Unlinearised> {
    let both = Both::of(step, line)?;
    let [before, after] = &both.energy;
    let costate = DVector::from_column_slice(costate);
    let pulled = both.transposed([&costate, after]);
    let [loss, (energy, _)] = pulled.ok_or(Unlinearised::Singular)?;
    first_law(step.x, [&energy, before])?;
    Ok(loss)
}

/// The error of the second law of tangents in a step, `dS(x') δ' − dS(x) δ = δ(h ⟨w_S, K̃ w_S⟩)`, for a column `δ` at its start and `δ'` at
/// its end, relative to its terms. `None` if the entropy has no discrete gradient, or the step has no derivative.
pub(in crate::tangent) fn entropy_law(
    step: &StepOfModel<'_>,
    line: PathOfStep,
    [before, after]: [&[f64]; 2],
) -> Option<f64> {
    let &StepOfModel { model, x, end, .. } = step;
    if model.second_law() != SecondLaw::Exact {
        return None;
    }
    let [there, back] = from_both_ends(step, line).ok()?;
    let (_, growth) = along_parameters(step, line)?;
    let along = |row: &[f64], v: &[f64]| row.iter().zip(v).map(|(a, b)| a * b).sum::<f64>();
    Some(relative(&[
        differential(model, ENTROPY, end, step.parameters).dot(&column(after)),
        -differential(model, ENTROPY, x, step.parameters).dot(&column(before)),
        -along(there.growth.numbers(), after),
        // The growth of the step of size −h is that of the step less its sign.
        along(back.growth.numbers(), before),
        -along(growth.as_slice(), &before[x.len()..]),
    ]))
}
