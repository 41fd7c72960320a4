//! Losses that outliers move little.

use crate::error::FitError;
use crate::least_squares::Squares;

/// A loss of residuals in place of their squares, with its scale `C`: the residual from which on it counts less.
///
/// The fit minimises `½ Σ_i C² ρ(r_i²/C²)`, as SciPy's `least_squares(.., loss=.., f_scale=C)` does:
///
/// | loss | `ρ(z)` | influence `ψ(r)` of a large residual |
/// |---|---|---|
/// | `Huber` (1964) | `z` up to `z = 1`, and `2√z − 1` beyond | `C` |
/// | `SoftL1` (Charbonnier et al. 1994) | `2(√(1 + z) − 1)` | `C` |
/// | `Cauchy` | `ln(1 + z)` | `C²/r`: it is forgotten, and there may be several minima |
///
/// Residuals are in units of the [noise](crate::FitBuilder::noise) where it was given, else in those of the data. With a Gaussian noise
/// `σ`, `Huber(1.345 σ)` has 95 % of the efficiency of least squares (Huber 1981).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Robust {
    /// Squares up to the scale, and the size beyond.
    Huber(f64),
    /// The smooth form of it.
    SoftL1(f64),
    /// The logarithm, which hardly grows.
    Cauchy(f64),
}

/// The least curvature of the model of a residual, as a fraction of its weight.
const CURVED: f64 = 1e-2;

impl Robust {
    /// The scale `C`.
    pub const fn scale(&self) -> f64 {
        match *self {
            Self::Huber(scale) | Self::SoftL1(scale) | Self::Cauchy(scale) => scale,
        }
    }

    pub(crate) fn check(&self) -> Result<(), FitError> {
        let scale = self.scale();
        if scale > 0.0 && scale.is_finite() { Ok(()) } else { Err(FitError::Scale { scale }) }
    }

    /// The function `ρ`, its derivative and `z ρ''`, at `z = r²/C²`.
    fn rho(&self, residual: f64) -> [f64; 3] {
        // The root of z: its square may be too large for a number.
        let u = residual.abs() / self.scale();
        match self {
            Self::Huber(_) if u <= 1.0 => [u * u, 1.0, 0.0],
            Self::Huber(_) => [2.0 * u - 1.0, u.recip(), -0.5 / u],
            Self::SoftL1(_) => {
                let root = u.hypot(1.0);
                // 2(√(1 + z) − 1) without a cancellation.
                [2.0 * u * (u / (root + 1.0)), root.recip(), -0.5 * (u / root).powi(2) / root]
            }
            Self::Cauchy(_) => {
                let rho = if u > 1e8 { 2.0 * u.ln() } else { (u * u).ln_1p() };
                let bend = u / (1.0 + u * u);
                [rho, (1.0 + u * u).recip(), -bend * bend]
            }
        }
    }

    /// The sum `Σ C² ρ(r²/C²)`, which is `|r|²` of small residuals.
    pub(crate) fn sum(&self, residuals: &[f64]) -> f64 {
        let sum: f64 = residuals.iter().map(|r| self.rho(*r)[0]).sum();
        self.scale() * self.scale() * sum
    }

    /// The influence `ψ(r) = ρ' r` of a residual, and its derivative `ψ' = ρ' + 2 z ρ''`.
    pub(crate) fn influence(&self, residual: f64) -> [f64; 2] {
        let [_, weight, bend] = self.rho(residual);
        [weight * residual, weight + 2.0 * bend]
    }

    /// The squares `J̃ = √a J`, `r̃ = ψ/√a` with the gradient `Jᵀψ` and the curvature `a = ψ'` of the loss (Triggs et al. 2000, §4.3).
    /// Where `ψ'` is less than a hundredth of the weight `ρ'` it is replaced by this: with the floor `ε` of SciPy `r̃` would be so large
    /// that its rounding is that of the gradient. The minimum is the same.
    pub(crate) fn scaled(&self, at: &Squares) -> Squares {
        let mut scaled = at.clone();
        for (i, residual) in at.residuals.iter().enumerate() {
            let [_, weight, bend] = self.rho(*residual);
            let root = (weight + 2.0 * bend).max(CURVED * weight).sqrt();
            scaled.residuals[i] = if root > 0.0 { weight / root * residual } else { 0.0 };
            scaled.jacobian.row_mut(i).scale_mut(root);
        }
        scaled
    }
}

/// The spread of residuals in a robust fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spread {
    /// The variance `s²` with which the covariance of the unknowns is `s² (JᵀJ)⁻¹`; infinite where it has none.
    pub(crate) variance: f64,
    /// The mean square of the influence, of so many degrees of freedom, in units of the curvature: that of a residual of the scaled
    /// squares.
    pub(crate) scaled: f64,
}

impl Robust {
    /// Huber's (1973) first estimate, `s² = κ² (Σψ²/(n − p)) / (Σψ'/n)²` with `κ = 1 + (p/n) var(ψ')/(mean ψ')²`.
    pub(crate) fn spread(&self, residuals: &[f64], unknowns: usize) -> Spread {
        let (n, p) = (residuals.len() as f64, unknowns as f64);
        let (mut squares, mut mean, mut mean_square) = (0.0, 0.0, 0.0);
        for residual in residuals {
            let [psi, slope] = self.influence(*residual);
            squares += psi * psi / (n - p);
            mean += slope / n;
            mean_square += slope * slope / n;
        }
        if mean <= 0.0 {
            return Spread { variance: f64::INFINITY, scaled: squares };
        }
        let kappa = 1.0 + p / n * (mean_square / (mean * mean) - 1.0);
        Spread { variance: kappa * kappa * squares / (mean * mean), scaled: squares / mean }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{dmatrix, dvector};

    const ALL: [Robust; 3] = [Robust::Huber(0.3), Robust::SoftL1(0.3), Robust::Cauchy(0.3)];

    /// Influence and curvature are derivatives of the loss, and the scaled squares have its gradient.
    #[test]
    fn influence_and_curvature_are_the_derivatives_of_the_loss() {
        for robust in ALL {
            let half = |r: f64| 0.5 * robust.sum(&[r]);
            for r in [1e-9, -0.05, 0.2, -0.29, 0.31, 4.0, 1e5] {
                let d = 1e-5 * f64::abs(r);
                let slope = (half(r + d) - half(r - d)) / (2.0 * d);
                let bend = (robust.influence(r + d)[0] - robust.influence(r - d)[0]) / (2.0 * d);
                let [psi, curvature] = robust.influence(r);
                assert!((slope - psi).abs() < 1e-5 * psi.abs(), "{robust:?} {r}: {slope} {psi}");
                assert!((bend - curvature).abs() < 1e-5, "{robust:?} {r}: {bend} {curvature}");
            }
            let (residuals, jacobian) = (dvector![0.1, -0.5, 1e6], dmatrix![1.0; -3.0; 2.0]);
            let psi = residuals.map(|r| robust.influence(r)[0]);
            let gradient = jacobian.tr_mul(&psi)[0];
            let scaled = robust.scaled(&Squares { residuals, jacobian });
            let of_squares = scaled.jacobian.tr_mul(&scaled.residuals)[0];
            assert!((gradient - of_squares).abs() < 1e-14, "{robust:?}: {gradient} {of_squares}");
        }
    }

    /// No outlier: the spread is that of least squares; a few percent more where the loss bends.
    #[test]
    fn the_spread_of_small_residuals_is_that_of_squares() {
        let residuals: Vec<f64> = (0..20).map(|i| 1e-3 * f64::sin(f64::from(i))).collect();
        let squares = residuals.iter().map(|r| r * r).sum::<f64>() / 18.0;
        for robust in ALL {
            let Spread { variance, scaled } = robust.spread(&residuals, 2);
            assert!(
                (variance / squares - 1.0).abs() < 1e-4 && (scaled / squares - 1.0).abs() < 1e-4
            );
        }
        // All of them are outliers, and nothing says how they scatter.
        let far = Robust::Huber(1e-9).spread(&residuals[1..], 2);
        assert!(far.variance.is_infinite());
    }
}
