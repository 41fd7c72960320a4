//! The best step of a linear model within a trust region.

use nalgebra::{DMatrix, DVector};

use crate::least_squares::Squares;

/// The relative difference of the length of a step from the radius, which is that of its damping too.
const SLACK: f64 = 0.05;

/// The linear model `|J δ + r|²` in units of the lengths of the columns, by its singular values.
pub(crate) struct Linear {
    v: DMatrix<f64>,
    values: DVector<f64>,
    /// The components `Uᵀ r`.
    right: DVector<f64>,
}

impl Linear {
    pub(crate) fn of(at: &Squares, lengths: &[f64]) -> Option<Self> {
        let (rows, n) = at.jacobian.shape();
        let hat = DMatrix::from_fn(rows, n, |i, j| at.jacobian[(i, j)] / lengths[j]);
        let qr = hat.qr();
        let svd = qr.r().svd(true, true);
        let right = svd.u?.transpose() * (qr.q().transpose() * &at.residuals);
        Some(Self { v: svd.v_t?.transpose(), values: svd.singular_values, right })
    }

    /// The step `D δ` of the damping `λ`; of the shortest of all where `λ = 0` and the columns depend on one another.
    pub(crate) fn damped(&self, lambda: f64) -> DVector<f64> {
        let least = f64::EPSILON * self.values.max();
        let along = |k: usize| match self.values[k] {
            value if value > least => -self.right[k] * value / (value * value + lambda),
            _ => 0.0,
        };
        &self.v * DVector::from_fn(self.values.len(), |k, _| along(k))
    }

    /// The step within the radius that predicts the largest reduction: the whole one, or the damped one of this length.
    pub(crate) fn within(&self, radius: f64) -> DVector<f64> {
        let whole = self.damped(0.0);
        if whole.norm() <= (1.0 + SLACK) * radius {
            return whole;
        }
        // The length falls with λ, from that of the whole step to less than |r| σ/λ.
        let most = self.values.max() * self.right.norm() / radius;
        let (mut low, mut high) = (most * f64::EPSILON * f64::EPSILON, most);
        while high > (1.0 + SLACK) * low {
            let middle = low.sqrt() * high.sqrt();
            if self.damped(middle).norm() > radius { low = middle } else { high = middle }
        }
        self.damped(high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The step of Powell's dogleg within a radius: down the steepest slope, and then towards the whole step.
    fn dogleg(jacobian: &DMatrix<f64>, residuals: &DVector<f64>, radius: f64) -> DVector<f64> {
        let slope = jacobian.transpose() * residuals;
        let steepest = -&slope * (slope.norm_squared() / (jacobian * &slope).norm_squared());
        let whole = -jacobian.clone().svd(true, true).solve(residuals, 1e-14).unwrap();
        if whole.norm() <= radius {
            return whole;
        }
        if steepest.norm() >= radius {
            return &steepest * (radius / steepest.norm());
        }
        let rest = whole - &steepest;
        let (a, b) = (rest.norm_squared(), steepest.dot(&rest));
        let c = steepest.norm_squared() - radius * radius;
        &steepest + rest * ((-b + (b * b - a * c).sqrt()) / a)
    }

    /// The damping is a trust region: no step of this length predicts a larger reduction, and a dogleg a smaller one.
    #[test]
    fn a_damped_step_is_the_best_in_its_region() {
        let number = |k: usize| (12.9898 * k as f64 + 0.7).sin();
        let mut gained = 0.0_f64;
        for case in 0..40 {
            let jacobian = DMatrix::from_fn(12, 4, |i, j| {
                number(97 * case + 4 * i + j) * [1.0, 7.0, 49.0, 343.0][j]
            });
            let residuals = DVector::from_fn(12, |i, _| number(31 * case + i + 5));
            let at = Squares { residuals, jacobian };
            let linear = Linear::of(&at, &[1.0; 4]).unwrap();
            let radius = linear.damped(0.0).norm() * 0.05 * (1 + case % 10) as f64;
            let damped = linear.within(radius);
            let predicted = |step: &DVector<f64>| {
                at.sum() - (&at.jacobian * step + &at.residuals).norm_squared()
            };
            let other = dogleg(&at.jacobian, &at.residuals, damped.norm());
            assert!((damped.norm() / radius - 1.0).abs() <= SLACK);
            assert!((other.norm() / damped.norm() - 1.0).abs() < 1e-9);
            assert!(predicted(&other) <= predicted(&damped) * (1.0 + 1e-12));
            gained = gained.max(1.0 - predicted(&other) / predicted(&damped));
        }
        println!("a dogleg predicts up to {gained:.2} less");
        assert!(gained > 0.1);
    }
}
