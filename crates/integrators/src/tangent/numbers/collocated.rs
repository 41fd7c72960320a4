//! The derivative of a step with stages of a model, by the implicit function theorem at its root, as in
//! [`collocated`](super::super::collocated).
//!
//! On a vector space the unknowns are the displacements `Y_i = h k_i` of the stages, with `X_i = x + Σ a_ij Y_j` and
//! `x' = x + Σ b_j Y_j`. They solve `R_i = Y_i − h V_i = 0`, so
//!
//! ```math
//! J = 1 - (b^T \otimes 1) \Bigl(\frac{\partial R}{\partial Y}\Bigr)^{-1} \frac{\partial R}{\partial x}, \qquad
//! \frac{\partial x'}{\partial h} = -(b^T \otimes 1) \Bigl(\frac{\partial R}{\partial Y}\Bigr)^{-1} \frac{\partial R}{\partial h} ,
//! ```
//!
//! and along parameters as along `h`.

pub(super) mod along;
mod equation;
mod heat;
mod law;
mod stage;

use std::borrow::Cow;

use metriplectic_dynamics::SecondLaw;
use metriplectic_equations::ENTROPY;
use nalgebra::{DMatrix, DVector};

use self::along::Around;
use super::super::error::Unlinearised;
use super::super::factors::Refined;
use super::units::{differential, relative, reproduced, units};
use super::{Derivative, Pulled, StepOfModel};
use crate::collocation::Tableau;
use crate::implicit::is_flat;

/// A step linearised at its root, in units of the entries.
struct AtRoot {
    /// `∂R/∂Y`.
    matrix: DMatrix<f64>,
    /// `∂R/∂x`.
    along_x: DMatrix<f64>,
    /// `∂R/∂θ`.
    along_parameters: DMatrix<f64>,
    /// `∂R/∂h`.
    along_h: DVector<f64>,
    /// The derivatives of the production of entropy along `x`, `Y` and `θ`.
    produced: [DVector<f64>; 3],
    tableau: &'static Tableau,
    units: DVector<f64>,
}

impl AtRoot {
    fn of(step: &StepOfModel<'_>, tableau: &'static Tableau) -> Result<Self, Unlinearised> {
        if !is_flat(step.model) {
            return Err(Unlinearised::Singular);
        }
        let around = Around::new(step, tableau).ok_or(Unlinearised::Singular)?;
        reproduced(step, around.end())?;
        let (units, n) = (units(step), around.n());
        let equation::Derivatives { mut residual, mut produced } = equation::derivatives(&around)?;
        let (size, at_h) = (residual.nrows(), around.size_column());
        for c in 0..at_h {
            let unit = units[c % n];
            residual.column_mut(c).scale_mut(unit);
            produced[c] *= unit;
        }
        for r in 0..size {
            residual.row_mut(r).unscale_mut(units[r % n]);
        }
        let blocks = [(0, n), (n, size), (at_h + 1, step.parameters)];
        Ok(Self {
            matrix: residual.columns(n, size).into_owned(),
            along_x: residual.columns(0, n).into_owned(),
            along_parameters: residual.columns(at_h + 1, step.parameters).into_owned(),
            along_h: residual.column(at_h).into_owned(),
            produced: blocks.map(|(at, len)| produced.rows(at, len).into_owned()),
            tableau,
            units,
        })
    }

    /// `Σ b_j v_j`.
    fn end_of(&self, v: &DVector<f64>) -> DVector<f64> {
        let n = self.units.len();
        let weights = self.tableau.weights.iter().take(self.tableau.stages).enumerate();
        weights.fold(DVector::zeros(n), |sum, (j, b)| sum + v.rows(j * n, n) * *b)
    }

    fn derivative(&self) -> Option<Derivative> {
        let (factors, units) = (Refined::of(Cow::Borrowed(&self.matrix))?, &self.units);
        let n = units.len();
        let mut along_x = DMatrix::zeros(n, n);
        for k in 0..n {
            let y = factors.solve(&self.along_x.column(k).into_owned())?;
            let mut column = -self.end_of(&y).component_mul(units) / units[k];
            column[k] += 1.0;
            along_x.set_column(k, &column);
        }
        let moved = |residual: &DVector<f64>| {
            Some(-self.end_of(&factors.solve(residual)?).component_mul(units))
        };
        let along_h = moved(&self.along_h)?;
        let mut along_parameters = DMatrix::zeros(n, self.along_parameters.ncols());
        for (k, residual) in self.along_parameters.column_iter().enumerate() {
            along_parameters.set_column(k, &moved(&residual.into_owned())?);
        }
        Some(Derivative { along_x, along_parameters, along_h })
    }

    /// `Jᵀ λ` and `(∂x'/∂θ)ᵀ λ`, without `J`.
    fn transposed(&self, costate: &[f64]) -> Option<Pulled> {
        let (n, size) = (self.units.len(), self.matrix.nrows());
        let costate = DVector::from_column_slice(costate);
        let row = costate.component_mul(&self.units);
        let right = DVector::from_fn(size, |r, _| self.tableau.weights[r / n] * row[r % n]);
        let y = Refined::of(Cow::Owned(self.matrix.transpose()))?.solve(&right)?;
        let pulled = costate - self.along_x.tr_mul(&y).component_div(&self.units);
        Some((pulled, -self.along_parameters.tr_mul(&y)))
    }

    /// The derivative of the production of entropy where the start, and the parameters behind it, move along `δ`.
    fn production(&self, delta: &DVector<f64>) -> Option<f64> {
        let (n, count) = (self.units.len(), self.along_parameters.ncols());
        let (start, theta) = (delta.rows(0, n).component_div(&self.units), delta.rows(n, count));
        let residual = &self.along_x * &start + &self.along_parameters * theta;
        let y = -Refined::of(Cow::Borrowed(&self.matrix))?.solve(&residual)?;
        let [along_x, along_y, along] = &self.produced;
        Some(along_x.dot(&start) + along_y.dot(&y) + along.dot(&theta))
    }
}

/// The derivatives of a step of a method with stages.
///
/// # Errors
///
/// [`Unlinearised`] if the root is not found or is that of another step, or the step has no derivative there.
pub(in crate::tangent) fn derivative(
    step: &StepOfModel<'_>,
    tableau: &'static Tableau,
) -> Result<Derivative, Unlinearised> {
    AtRoot::of(step, tableau)?.derivative().ok_or(Unlinearised::Singular)
}

/// The derivatives of a loss along the start of a step and along the parameters from that along its end.
///
/// # Errors
///
/// [`Unlinearised`] as for the [derivative].
pub(in crate::tangent) fn pull_back(
    step: &StepOfModel<'_>,
    tableau: &'static Tableau,
    costate: &[f64],
) -> Result<Pulled, Unlinearised> {
    AtRoot::of(step, tableau)?.transposed(costate).ok_or(Unlinearised::Singular)
}

/// The error of `dS(x') δ' − dS(x) δ = δΣ` with the entropy `Σ` that the step says it has produced, for a column `δ` at its start and `δ'`
/// at its end, relative to its terms. `None` if the entropy has no discrete gradient, or the step has no derivative.
pub(in crate::tangent) fn entropy_law(
    step: &StepOfModel<'_>,
    tableau: &'static Tableau,
    [before, after]: [&[f64]; 2],
) -> Option<f64> {
    let &StepOfModel { model, x, end, .. } = step;
    if model.second_law() != SecondLaw::Exact {
        return None;
    }
    let [before, after] = [before, after].map(DVector::from_column_slice);
    let produced = AtRoot::of(step, tableau).ok()?.production(&before)?;
    Some(relative(&[
        differential(model, ENTROPY, end, step.parameters).dot(&after),
        -differential(model, ENTROPY, x, step.parameters).dot(&before),
        -produced,
    ]))
}
