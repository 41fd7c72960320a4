//! The linear system of a step with the derivatives of all stages, for steps on which one Jacobian does not serve them all. As in
//! [`crate::collocation`].

use super::covectors::zeros;
use super::equation::{Evaluated, StageEquation, Unknowns};
use crate::collocation::full::{DIFFERENCE, factored};
use crate::implicit::parts::Parts;
use crate::numbers::Lengths;

/// The decomposition of the derivatives of the residual along the velocities of all stages.
pub(super) struct Full {
    /// The unknowns, `s` times `n`.
    size: usize,
    /// The factors `L` and `U`, row by row.
    factors: Vec<f64>,
    /// The row of each pivot.
    pivots: Vec<usize>,
    /// The equation at which it was formed has been evaluated so often.
    pub(super) evaluations: usize,
}

impl Full {
    /// The derivatives at these velocities, where the equation has been evaluated, by differences in units of the entries and of a
    /// `correction`; `None` if they are singular, or the equation is not defined around there.
    pub(super) fn of<L: Lengths>(
        equation: &StageEquation<'_, L>,
        k: &Unknowns<L>,
        at: &Evaluated<L>,
        correction: &Unknowns<L>,
    ) -> Option<Self> {
        let (s, n) = (equation.tableau.stages, equation.parts.n());
        let (size, scales) = (s * n, equation.parts.scales(equation.x));
        let mut matrix = vec![0.0; size * size];
        let (mut evaluations, mut moved) = (0, k.clone());
        for j in 0..s {
            for c in 0..n {
                let longest = |v: &Unknowns<L>| {
                    v[..s].iter().map(|v| (equation.h * v[c]).abs()).fold(0.0, f64::max)
                };
                let known = scales[c] + at.d[c].abs() + longest(k);
                // An entry that starts at zero has the size that it is about to reach.
                let entry = if known > 0.0 { known } else { longest(correction) };
                let whole = (DIFFERENCE * entry).max(f64::MIN_POSITIVE);
                // On the edge of a domain the other side is defined.
                let sides = [whole, -whole, 1e-3 * whole, -1e-3 * whole];
                let (there, step) = sides.into_iter().find_map(|step| {
                    moved[j][c] = k[j][c] + step / equation.h;
                    evaluations += 1;
                    Some((equation.evaluate(&moved)?, moved[j][c] - k[j][c]))
                })?;
                moved[j][c] = k[j][c];
                for i in 0..s {
                    for r in 0..n {
                        let change = at.residual[i][r] - there.residual[i][r];
                        matrix[(i * n + r) * size + j * n + c] = change / step;
                    }
                }
            }
        }
        let (factors, pivots) = factored(matrix, size)?;
        Some(Self { size, factors, pivots, evaluations })
    }

    /// The correction of a residual.
    pub(super) fn solve<L: Lengths>(
        &self,
        parts: &Parts<'_, L>,
        residual: &Unknowns<L>,
    ) -> Unknowns<L> {
        let (n, size) = (parts.n(), self.size);
        let mut x: Vec<f64> = (0..size).map(|i| residual[i / n][i % n]).collect();
        for (k, &pivot) in self.pivots.iter().enumerate() {
            x.swap(k, pivot);
        }
        for i in 0..size {
            let known: f64 = (0..i).map(|j| self.factors[i * size + j] * x[j]).sum();
            x[i] -= known;
        }
        for k in (0..size).rev() {
            let known: f64 = (k + 1..size).map(|j| self.factors[k * size + j] * x[j]).sum();
            x[k] = (x[k] - known) / self.factors[k * size + k];
        }
        let mut solved = zeros(parts);
        for (i, x) in x.into_iter().enumerate() {
            solved[i / n][i % n] = x;
        }
        solved
    }
}
