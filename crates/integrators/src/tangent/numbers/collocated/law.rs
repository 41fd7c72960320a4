//! A law along a step with stages: its covectors and the number `δ` by which they miss its change, as in
//! [`law`](super::super::super::collocated).

use nalgebra::{DMatrix, DVector};

use super::along::{Along, Around, Number, column, dense};
use crate::collocation::trust;
use crate::numbers::List as _;
use crate::round_off::stable_gradient::{but_round_off, short};
use crate::step::Entries;

/// A law along a step.
pub(super) struct LawAlong {
    /// The covectors `dF(X_i)`.
    pub(super) covectors: Vec<Along>,
    /// The number `δ`.
    pub(super) lost: Number,
}

/// The sum `Σ b_i ⟨dF(X_i), Y_i⟩`, and the sizes of its terms and of those of its derivatives.
struct Slope {
    sum: Number,
    size: f64,
    along: DVector<f64>,
}

impl Slope {
    fn of(around: &Around<'_>, stages: &[(DVector<f64>, DMatrix<f64>)]) -> Self {
        let (n, columns, tableau) = (around.n(), around.columns(), around.tableau);
        let mut slope =
            Self { sum: Number::zero(columns), size: 0.0, along: DVector::zeros(columns) };
        for (i, (df, hf)) in stages.iter().enumerate() {
            let (y, b) = (&around.displacements[i], tableau.weights[i]);
            slope.sum.value += b * df.dot(y);
            slope.size += b * df.abs().dot(&y.abs());
            let mut block = |at: usize, c: f64, is_own: bool| {
                for k in 0..n {
                    for r in 0..n {
                        let own = if is_own && r == k { df[r] } else { 0.0 };
                        let term = b * (hf[(r, k)] * c * y[r] + own);
                        slope.sum.row[at + k] += term;
                        slope.along[at + k] += term.abs();
                    }
                }
            };
            block(0, 1.0, false);
            for j in 0..tableau.stages {
                block((j + 1) * n, tableau.matrix[i][j], i == j);
            }
        }
        slope
    }
}

/// The change of a law along the polynomial of the step, as an integral.
fn integral(around: &Around<'_>, law: usize) -> Number {
    let Around { parts, tableau, .. } = around;
    let one = DMatrix::identity(around.n(), around.n());
    tableau.points().iter().fold(Number::zero(around.columns()), |sum, point| {
        // Their positions are those from the middle.
        let position = std::array::from_fn(|j| point.position[j] + 0.5 * tableau.weights[j]);
        let second = parts.second(law, &around.state(&position));
        let (df, hf) = (column(&second.df), dense(&second.hf, around.n()));
        let df = Along { value: df, slope: around.spread((1.0, &position), &hf) };
        let value = around.combined(&point.velocity);
        let velocity = Along { value, slope: around.spread((0.0, &point.velocity), &one) };
        Number::sum([1.0, point.weight], [&sum, &df.dot(&velocity)])
    })
}

impl LawAlong {
    pub(super) fn of(around: &Around<'_>, law: usize) -> Self {
        let &Around { ref parts, tableau, step, .. } = around;
        let stages: Vec<_> = (0..tableau.stages)
            .map(|i| {
                let second = parts.second(law, &around.state(&tableau.matrix[i]));
                (column(&second.df), dense(&second.hf, around.n()))
            })
            .collect();
        let ends = [step.x, step.end].map(|x| {
            let (value, df) = parts.jet(law, &Entries::of(x));
            (value, column(&df))
        });
        let lost = lost(around, law, &stages, &ends);
        let covectors = stages.into_iter().enumerate().map(|(i, (value, hf))| {
            let slope = around.spread((1.0, &tableau.matrix[i]), &hf);
            Along { value, slope }
        });
        Self { covectors: covectors.collect(), lost }
    }

    pub(super) fn is_finite(&self) -> bool {
        self.covectors.iter().all(|w| w.slope.iter().all(|slope| slope.is_finite()))
    }
}

/// The number `δ = F(x') − F(x) − Σ b_i ⟨dF(X_i), Y_i⟩`.
fn lost(
    around: &Around<'_>,
    law: usize,
    stages: &[(DVector<f64>, DMatrix<f64>)],
    [before, after]: &[(f64, DVector<f64>); 2],
) -> Number {
    let tableau = around.tableau;
    let Slope { sum: slope, size, along } = Slope::of(around, stages);
    let rows = |start, c, df: &DVector<f64>| {
        let row = around.spread((start, c), &DMatrix::from_row_slice(1, df.len(), df.as_slice()));
        row.transpose().column(0).into_owned()
    };
    let of_start = rows(1.0, &[0.0; crate::collocation::STAGES], &before.1);
    let of_end = rows(1.0, &tableau.weights, &after.1);
    let sizes = along + of_start.abs() + of_end.abs();
    let change = Number { value: after.0 - before.0, row: of_end - of_start };
    let lost = Number::sum([1.0, -1.0], [&change, &slope]);
    // How far the integral is trusted, by the size of the change and the function.
    let scales = DVector::from_column_slice(around.step.end).abs();
    let mut rounded = before.0.abs() + after.0.abs();
    for ((df, _), b) in stages.iter().zip(&tableau.weights) {
        rounded += b * df.abs().dot(&scales);
    }
    let fraction = short(size, rounded);
    if fraction == 0.0 {
        return lost;
    }
    let integral = Number::sum([1.0, -1.0], [&integral(around, law), &slope]);
    let bounds = [size, f64::EPSILON * rounded];
    let weight = fraction * trust(integral.value, bounds, tableau.stages);
    if weight == 0.0 {
        return lost;
    }
    let lost = Number::sum([1.0 - weight, weight], [&lost, &integral]);
    // What is divided by the square of the velocity near rest must not be rounding.
    Number { value: but_round_off(lost.value, size), row: lost.row.zip_map(&sizes, but_round_off) }
}
