//! Linear systems whose solutions have all digits of their own.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector, Dyn, LU};

/// The factors of a matrix, whose solutions are refined once: then each row is solved to the round-off of its own terms
/// (Skeel 1980), so that an entry near rest has no digits of another one.
pub(super) struct Refined<'a> {
    matrix: Cow<'a, DMatrix<f64>>,
    factors: LU<f64, Dyn, Dyn>,
}

impl<'a> Refined<'a> {
    pub(super) fn of(matrix: Cow<'a, DMatrix<f64>>) -> Option<Self> {
        let finite = matrix.iter().all(|entry| entry.is_finite());
        finite.then(|| Self { factors: matrix.clone().into_owned().lu(), matrix })
    }

    pub(super) fn solve(&self, right: &DVector<f64>) -> Option<DVector<f64>> {
        let y = self.factors.solve(right)?;
        let left = right - &*self.matrix * &y;
        Some(y + self.factors.solve(&left)?)
    }
}
