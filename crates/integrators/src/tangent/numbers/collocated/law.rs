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

/// A law at a stage: its differential, its Hessian, and the derivatives of the differential along the parameters.
struct OfStage {
    df: DVector<f64>,
    hf: DMatrix<f64>,
    along: DMatrix<f64>,
}

impl Slope {
    fn of(around: &Around<'_>, stages: &[OfStage]) -> Self {
        let (n, columns, tableau) = (around.n(), around.columns(), around.tableau);
        let mut slope =
            Self { sum: Number::zero(columns), size: 0.0, along: DVector::zeros(columns) };
        for (i, OfStage { df, hf, along }) in stages.iter().enumerate() {
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
            for (k, along) in along.column_iter().enumerate() {
                let c = around.size_column() + 1 + k;
                slope.sum.row[c] += b * along.dot(y);
                slope.along[c] += b * along.abs().dot(&y.abs());
            }
        }
        slope
    }
}

/// The change of a law along the polynomial of the step, as an integral.
fn integral(around: &Around<'_>, law: usize) -> Number {
    let tableau = around.tableau;
    let one = DMatrix::identity(around.n(), around.n());
    tableau.points().iter().fold(Number::zero(around.columns()), |sum, point| {
        // Their positions are those from the middle.
        let position = std::array::from_fn(|j| point.position[j] + 0.5 * tableau.weights[j]);
        let df = around.covector((law, &around.state(&position)), (1.0, &position));
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
                let place = around.state(&tableau.matrix[i]);
                let second = parts.second(law, &place);
                let (df, hf) = (column(&second.df), dense(&second.hf, around.n()));
                OfStage { df, hf, along: around.along_parameters(law, &place).1 }
            })
            .collect();
        let ends = [step.x, step.end].map(|x| {
            let (value, df) = parts.jet(law, &Entries::of(x));
            (value, column(&df), around.along_parameters(law, x).0)
        });
        let lost = lost(around, law, &stages, &ends);
        let covectors = stages.into_iter().enumerate().map(|(i, OfStage { df, hf, along })| {
            let mut slope = around.spread((1.0, &tableau.matrix[i]), &hf);
            around.set_along_parameters(&mut slope, &along);
            Along { value: df, slope }
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
    stages: &[OfStage],
    [before, after]: &[(f64, DVector<f64>, DVector<f64>); 2],
) -> Number {
    let tableau = around.tableau;
    let Slope { sum: slope, size, along } = Slope::of(around, stages);
    let rows = |c, (_, df, along): &(f64, DVector<f64>, DVector<f64>)| {
        let df = DMatrix::from_row_slice(1, df.len(), df.as_slice());
        let mut row = around.spread((1.0, c), &df);
        let along = DMatrix::from_row_slice(1, along.len(), along.as_slice());
        around.set_along_parameters(&mut row, &along);
        row.transpose().column(0).into_owned()
    };
    let of_start = rows(&[0.0; crate::collocation::STAGES], before);
    let of_end = rows(&tableau.weights, after);
    let sizes = along + of_start.abs() + of_end.abs();
    let change = Number { value: after.0 - before.0, row: of_end - of_start };
    let lost = Number::sum([1.0, -1.0], [&change, &slope]);
    // How far the integral is trusted, by the size of the change and the function.
    let scales = DVector::from_column_slice(around.step.end).abs();
    let mut rounded = before.0.abs() + after.0.abs();
    for (OfStage { df, .. }, b) in stages.iter().zip(&tableau.weights) {
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
