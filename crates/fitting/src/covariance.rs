//! Standard errors and correlations, from a Jacobian.

use nalgebra::{DMatrix, DVector};

use crate::least_squares::UNSEEN;

/// The covariance `s² (JᵀJ)⁻¹` of the unknowns, and the combinations that the data do not see.
#[derive(Clone, Debug)]
pub struct Covariance {
    /// The matrix; infinite along what the data do not see.
    pub matrix: DMatrix<f64>,
    /// The directions that the data do not see, in units of the columns' lengths.
    pub unseen: Vec<DVector<f64>>,
    /// The direction that the data see least, in the same units.
    pub flattest: DVector<f64>,
    /// The smallest singular value of the columns in units of their lengths, relative to the largest.
    pub fraction: f64,
}

impl Covariance {
    /// Computes the covariance from the singular values of the Jacobian with columns of length one, so that units do not matter.
    /// `variance` is that of a residual.
    pub fn of(jacobian: &DMatrix<f64>, variance: f64) -> Self {
        let n = jacobian.ncols();
        let lengths = DVector::from_fn(n, |j, _| {
            let length = jacobian.column(j).norm();
            if length > 0.0 { length } else { f64::MIN_POSITIVE }
        });
        let unit = DMatrix::from_fn(jacobian.nrows(), n, |i, j| jacobian[(i, j)] / lengths[j]);
        // The squares of singular values, in JᵀJ, would lose half of the digits.
        let r = unit.qr().r().svd(false, true);
        let values = r.singular_values.clone();
        let largest = values.max();
        let fraction = if largest > 0.0 { values.min() / largest } else { 0.0 };
        let v = r.v_t.map_or_else(|| DMatrix::identity(n, n), |v| v.transpose());
        let is_unseen = |k: usize| values[k].is_nan() || values[k] <= UNSEEN * largest;
        // What has no part in a direction that is not seen has a rounding there.
        let is_in = |i: usize, k: usize| !is_unseen(k) || v[(i, k)].abs() > UNSEEN;
        let matrix = DMatrix::from_fn(n, n, |i, j| {
            let term = |k: usize| match v[(i, k)] * v[(j, k)] {
                0.0 => 0.0,
                term if is_unseen(k) => term.signum() * f64::INFINITY,
                term => term / (values[k] * values[k]),
            };
            let sum: f64 = (0..n).filter(|&k| is_in(i, k) && is_in(j, k)).map(term).sum();
            variance * sum / (lengths[i] * lengths[j])
        });
        let unseen = (0..n).filter(|&k| is_unseen(k)).map(|k| v.column(k).into_owned()).collect();
        let flattest = v.column(values.imin()).into_owned();
        Self { matrix, unseen, flattest, fraction }
    }

    /// Computes the covariance of some unknowns at fixed values of the others, which have NaN and are in no direction.
    pub(crate) fn of_some(jacobian: &DMatrix<f64>, free: &[usize], variance: f64) -> Self {
        let n = jacobian.ncols();
        if free.len() == n {
            return Self::of(jacobian, variance);
        }
        let place = |i: usize| free.iter().position(|j| *j == i);
        let mut all = Self {
            matrix: DMatrix::from_element(n, n, f64::NAN),
            unseen: Vec::new(),
            flattest: DVector::zeros(n),
            fraction: 1.0,
        };
        if free.is_empty() {
            return all;
        }
        let some = Self::of(&jacobian.select_columns(free), variance);
        for (k, &i) in free.iter().enumerate() {
            for (l, &j) in free.iter().enumerate() {
                all.matrix[(i, j)] = some.matrix[(k, l)];
            }
        }
        let spread =
            |along: &DVector<f64>| DVector::from_fn(n, |i, _| place(i).map_or(0.0, |k| along[k]));
        all.unseen = some.unseen.iter().map(spread).collect();
        (all.flattest, all.fraction) = (spread(&some.flattest), some.fraction);
        all
    }

    /// Returns whether the data do not see a combination of the unknowns.
    pub fn is_singular(&self) -> bool {
        self.fraction < UNSEEN
    }

    /// The standard error of an unknown.
    pub fn standard_error(&self, i: usize) -> f64 {
        self.matrix[(i, i)].sqrt()
    }

    /// The correlation of two unknowns.
    pub fn correlation(&self, i: usize, j: usize) -> f64 {
        self.matrix[(i, j)] / (self.standard_error(i) * self.standard_error(j))
    }
}
