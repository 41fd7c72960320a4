//! The functions of a small angle, in one place.
//!
//! Exponentials and logarithms of rotations and spheres are entire functions of the *squared* angle
//! `s = θ²`, but their textbook formulas divide by `θ` and take its square root, whose derivative at
//! zero is not a number. Every solver starts there. The functions here are evaluated by their power
//! series near zero, so that they and their derivatives of every order are right under dual numbers.

use crate::Scalar;

/// Below this squared angle the power series is used: its terms fall from the first, and the closed
/// forms lose no more than a digit above it.
const NEAR: f64 = 1.0;

/// Terms of a power series. The last, `1/24!`, is far below `ε`, with room for derivatives.
const TERMS: u32 = 12;

/// The Stumpff function `c_n(s) = Σ_k (−s)^k / (2k + n)!` for `s ≥ 0` (Stumpff 1947):
///
/// ```math
/// c_0 = \cos\theta,\quad c_1 = \frac{\sin\theta}{\theta},\quad
/// c_2 = \frac{1 - \cos\theta}{\theta^2},\quad c_3 = \frac{\theta - \sin\theta}{\theta^3},
/// \qquad \theta^2 = s .
/// ```
///
/// ```
/// use metriplectic_fields::series::stumpff;
/// use num_dual::Dual64;
/// // d(sin θ/θ)/ds = −1/6 at zero, where the textbook formula is 0/0.
/// assert_eq!(stumpff(1, Dual64::new(0.0, 1.0)).eps, -1.0 / 6.0);
/// ```
pub fn stumpff<D: Scalar>(n: u32, s: D) -> D {
    if s.re().abs() < NEAR {
        return power_series(n, s);
    }
    let theta = s.sqrt();
    match n {
        0 => theta.cos(),
        1 => theta.sin() / theta,
        2 => (theta * 0.5).sin().powi(2) * 2.0 / s,
        // c_n = (1/(n−2)! − c_{n−2})/s.
        _ => (-stumpff(n - 2, s) + factorial(n - 2).recip()) / s,
    }
}

/// `Σ_k (−s)^k / (2k + n)!` by Horner's scheme.
fn power_series<D: Scalar>(n: u32, s: D) -> D {
    let mut sum = D::one();
    for k in (1..=TERMS).rev() {
        let (a, b) = (f64::from(2 * k + n), f64::from(2 * k + n - 1));
        sum = -(s * sum) * (a * b).recip() + 1.0;
    }
    sum * factorial(n).recip()
}

fn factorial(n: u32) -> f64 {
    (1..=n).map(f64::from).product()
}

/// `θ / sin θ` from the squared sine and the cosine of an angle `0 ≤ θ < π`.
///
/// At `θ = π` it is infinite: the direction of the logarithm is lost at the antipode.
pub fn angle_over_sine<D: Scalar>(squared_sine: D, cosine: D) -> D {
    if cosine.re() > 0.0 && squared_sine.re() < 0.1 * NEAR {
        // atan(t)/t for t = tan θ, in t².
        let squared_tangent = squared_sine / (cosine * cosine);
        return arctangent_series(squared_tangent) / cosine;
    }
    let sine = squared_sine.sqrt();
    sine.atan2(cosine) / sine
}

/// `atan(t)/t = Σ_k (−t²)^k/(2k + 1)` for `t² ≤ 1/9`.
fn arctangent_series<D: Scalar>(squared: D) -> D {
    let mut sum = D::zero();
    for k in (0..20_u32).rev() {
        sum = -(squared * sum) + f64::from(2 * k + 1).recip();
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::{Dual64, HyperDual64};

    /// `c_n` by its definition with 60 terms, which converges for every angle up to π.
    fn reference(n: u32, s: f64) -> f64 {
        let mut terms = Vec::new();
        let mut term = factorial(n).recip();
        for k in 1..60 {
            terms.push(term);
            term *= -s / (f64::from(2 * k + n) * f64::from(2 * k + n - 1));
        }
        terms.iter().rev().sum()
    }

    #[test]
    fn stumpff_functions_are_their_series() {
        for n in 0..=5 {
            for k in 0..200 {
                let s = 0.05 * f64::from(k);
                let (value, exact) = (stumpff(n, s), reference(n, s));
                // The alternating reference itself rounds its largest term.
                let bound = 16.0 * f64::EPSILON * s.sqrt().exp() * factorial(n).recip();
                assert!((value - exact).abs() <= bound, "c_{n}({s}) = {value}, not {exact}");
            }
        }
    }

    #[test]
    fn derivatives_are_right_at_zero_and_across_the_junction() {
        // c_n' = −(c_{n+1} − n c_{n+2})/2 holds for every Stumpff function.
        for n in 0..=3 {
            for s in [0.0, 1e-12, 0.3, 0.999_999, 1.000_001, 4.0, 9.0] {
                let derivative = stumpff(n, Dual64::new(s, 1.0)).eps;
                let exact = -0.5 * (reference(n + 1, s) - f64::from(n) * reference(n + 2, s));
                assert!((derivative - exact).abs() < 1e-14, "c_{n}'({s})");
            }
        }
        let second = stumpff(0, HyperDual64::new(0.0, 1.0, 1.0, 0.0)).eps1eps2;
        // cos √s = 1 − s/2 + s²/24.
        assert!((second - 1.0 / 12.0).abs() < 1e-16);
    }

    #[test]
    fn the_angle_is_found_from_its_sine_and_cosine() {
        for k in 1..=3000 {
            let theta = 1e-3 * f64::from(k);
            let (sine, cosine) = theta.sin_cos();
            let ratio = angle_over_sine(sine * sine, cosine);
            let bound = 8.0 * f64::EPSILON * ratio;
            assert!((ratio - theta / sine).abs() <= bound, "θ = {theta}: {ratio}");
        }
        let at_zero = angle_over_sine(Dual64::new(0.0, 1.0), Dual64::new(1.0, -0.5));
        // θ/sin θ = 1 + θ²/6.
        assert!((at_zero.re - 1.0).abs() < 1e-16 && (at_zero.eps - 1.0 / 6.0).abs() < 1e-15);
    }
}
