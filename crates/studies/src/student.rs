//! The quantile of Student's t distribution that turns a standard error into an interval.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

/// The `t` with `P(|T_ν| ≤ t) = confidence` for `ν ≥ 1` degrees of freedom, by bisection of
/// [`enclosed`] in `θ = arctan(t/√ν)`, on which it rises from 0 to 1 over `(0, π/2)`.
pub(crate) fn two_sided(confidence: f64, degrees: usize) -> f64 {
    let (mut low, mut high) = (0.0, FRAC_PI_2);
    // Each iteration halves the bracket: 60 of them exhaust the 53 bits of θ.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if enclosed(middle, degrees) < confidence { low = middle } else { high = middle }
    }
    (degrees as f64).sqrt() * low.tan()
}

/// `A(t|ν) = P(|T_ν| ≤ t)` at `t = √ν tan θ` (Abramowitz & Stegun 1964, eqs. 26.7.3-26.7.4):
///
/// - odd `ν`: `2/π (θ + sin θ (cos θ + 2/3 cos³θ + … + 2·4…(ν−3)/(1·3…(ν−2)) cos^{ν−2}θ))`,
/// - even `ν`: `sin θ (1 + 1/2 cos²θ + … + 1·3…(ν−3)/(2·4…(ν−2)) cos^{ν−2}θ)`.
fn enclosed(theta: f64, degrees: usize) -> f64 {
    let (sin, cos) = theta.sin_cos();
    let odd = degrees % 2 == 1;
    let first = if odd { cos } else { 1.0 };
    let exponents = (usize::from(odd)..degrees.saturating_sub(1)).step_by(2);
    let terms = exponents.scan(first, |term, exponent| {
        let this = *term;
        *term *= cos * cos * (exponent + 1) as f64 / (exponent + 2) as f64;
        Some(this)
    });
    let sum: f64 = terms.sum();
    if odd { FRAC_2_PI * (theta + sin * sum) } else { sin * sum }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Abramowitz & Stegun 1964, table 26.10, and the normal limit.
    #[test]
    fn the_quantile_is_the_tabulated_one() {
        let table = [
            (1, 12.706),
            (2, 4.303),
            (3, 3.182),
            (4, 2.776),
            (5, 2.571),
            (10, 2.228),
            (29, 2.045),
            (120, 1.980),
            (100_000, 1.960),
        ];
        for (degrees, expected) in table {
            let t = two_sided(0.95, degrees);
            assert!((t - expected).abs() < 5.1e-4, "ν = {degrees}: {t} instead of {expected}");
        }
        assert!((two_sided(0.99, 7) - 3.499).abs() < 5.1e-4);
    }
}
