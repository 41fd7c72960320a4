//! The linear system of a step with the derivatives of all stages, for steps on which one Jacobian does not serve them
//! all: where friction is stiff and not linear.

use metriplectic_dynamics::Metriplectic;
use metriplectic_fields::{Column, Dimension, Space};
use metriplectic_manifolds::Manifold;

use super::covectors::Stages;
use super::equation::{Evaluated, StageEquation, Unknowns};
use super::tableau::STAGES;

/// The decomposition of the derivatives of the residual along the velocities of all stages.
#[derive(Clone, Debug)]
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

/// The difference at which a derivative is taken, relative to the size of an entry: near the root of round-off.
pub(crate) const DIFFERENCE: f64 = 1e-7;

impl Full {
    /// The derivatives at these velocities, where the equation has been evaluated, by differences in units of the
    /// entries and of a `correction`; `None` if they are singular, or the equation is not defined around there.
    pub(super) fn of<Y: Metriplectic>(
        equation: &StageEquation<'_, Y>,
        k: &Unknowns<Y>,
        at: &Evaluated<Y>,
        correction: &Unknowns<Y>,
    ) -> Option<Self> {
        let (s, n) = (equation.tableau.stages, <Y::Manifold as Space>::Dim::LEN);
        let (size, scales) = (s * n, Y::Manifold::scales(equation.x) + at.d.abs());
        let mut matrix = vec![0.0; size * size];
        let mut evaluations = 0;
        for j in 0..s {
            for c in 0..n {
                let longest = |v: &Unknowns<Y>| {
                    v[..s].iter().map(|v| (equation.h * v[c]).abs()).fold(0.0, f64::max)
                };
                let known = scales[c] + longest(k);
                // An entry that starts at zero has the size that it is about to reach.
                let entry = if known > 0.0 { known } else { longest(correction) };
                let whole = (DIFFERENCE * entry).max(f64::MIN_POSITIVE);
                // On the edge of a domain the other side is defined.
                let sides = [whole, -whole, 1e-3 * whole, -1e-3 * whole];
                let (there, step) = sides.into_iter().find_map(|step| {
                    let mut moved = *k;
                    moved[j][c] += step / equation.h;
                    evaluations += 1;
                    Some((equation.evaluate(&moved)?, moved[j][c] - k[j][c]))
                })?;
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
    pub(super) fn solve<V: Column<f64>>(&self, residual: &Stages<V>) -> Stages<V> {
        let (n, size) = (V::LEN, self.size);
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
        let mut solved = [V::zero(); STAGES];
        for (i, x) in x.into_iter().enumerate() {
            solved[i / n][i % n] = x;
        }
        solved
    }
}

/// The decomposition of a matrix with row pivoting, in units of the largest entry of each row; `None` if it is
/// singular or not a number.
pub(crate) fn factored(mut a: Vec<f64>, size: usize) -> Option<(Vec<f64>, Vec<usize>)> {
    let mut units: Vec<f64> = (0..size)
        .map(|i| a[i * size..(i + 1) * size].iter().fold(0.0_f64, |most, x| most.max(x.abs())))
        .collect();
    let mut pivots = Vec::with_capacity(size);
    for k in 0..size {
        let relative = |i: usize| (a[i * size + k] / units[i]).abs();
        let pivot = (k..size).max_by(|&i, &j| relative(i).total_cmp(&relative(j)))?;
        if !(relative(pivot) > 0.0 && relative(pivot).is_finite()) {
            return None;
        }
        for j in 0..size {
            a.swap(k * size + j, pivot * size + j);
        }
        units.swap(k, pivot);
        pivots.push(pivot);
        for i in k + 1..size {
            let factor = a[i * size + k] / a[k * size + k];
            for j in k + 1..size {
                a[i * size + j] -= factor * a[k * size + j];
            }
            a[i * size + k] = factor;
        }
    }
    Some((a, pivots))
}
