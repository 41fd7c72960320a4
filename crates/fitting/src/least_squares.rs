//! Residuals and their Jacobian.

use nalgebra::{DMatrix, DVector};

/// The fraction of the largest singular value below which the data do not see a combination: it is of the size of the errors of a
/// Jacobian from runs of a usual tolerance.
pub const UNSEEN: f64 = 1e-7;

/// The residuals at a point, and their Jacobian `∂r_i/∂φ_j`, from one evaluation.
#[derive(Clone, Debug)]
pub struct Squares {
    /// The residuals `r`.
    pub residuals: DVector<f64>,
    /// Their Jacobian.
    pub jacobian: DMatrix<f64>,
}

impl Squares {
    /// The sum of squares `|r|²`.
    pub fn sum(&self) -> f64 {
        self.residuals.norm_squared()
    }

    /// The largest cosine between the residuals and a column of the Jacobian, which has no unit and vanishes at a minimum.
    pub fn cosine(&self) -> f64 {
        let length = self.residuals.norm();
        let cosine = |column: nalgebra::DVectorView<'_, f64>| {
            let size = column.norm() * length;
            if size > 0.0 { column.dot(&self.residuals).abs() / size } else { 0.0 }
        };
        self.jacobian.column_iter().map(cosine).fold(0.0, f64::max)
    }

    /// The reduction of the sum of squares that the linear model promises, `|Q Qᵀ r|²` with a basis `Q` of the columns: none at a
    /// minimum. In units of the variance of a residual it is the square of the distance to the minimum in standard errors.
    pub fn promised(&self) -> f64 {
        let mut hat = self.jacobian.clone();
        for mut column in hat.column_iter_mut() {
            let length = column.norm();
            if length > 0.0 {
                column /= length;
            }
        }
        let qr = hat.qr();
        let svd = qr.r().svd(true, false);
        let Some(u) = svd.u else { return f64::NAN };
        let right = u.transpose() * (qr.q().transpose() * &self.residuals);
        let least = UNSEEN * svd.singular_values.max();
        let seen = (0..right.len()).filter(|&k| svd.singular_values[k] > least);
        seen.map(|k| right[k] * right[k]).sum()
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.residuals.iter().chain(self.jacobian.iter()).all(|x| x.is_finite())
    }
}

/// A problem of least squares, `min_φ |r(φ)|²`.
pub trait LeastSquares {
    /// Evaluates the residuals with their Jacobian; `None` outside of the domain of the problem.
    fn squares(&self, phi: &[f64]) -> Option<Squares>;
}

impl<T: LeastSquares> LeastSquares for &T {
    fn squares(&self, phi: &[f64]) -> Option<Squares> {
        (**self).squares(phi)
    }
}
