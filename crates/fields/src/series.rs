//! Functions of a small angle, right under dual numbers.
//!
//! Exponentials and logarithms of rotations and spheres are entire functions of the *squared* angle
//! `s = θ²`, but their textbook formulas divide by `θ` and take its square root, whose derivative at
//! zero is not a number. Every solver starts at zero. The functions of this module use their power series near
//! zero, so they and their derivatives of every order are right under dual numbers.

use crate::Scalar;

/// The squared angle below which the power series are used. Their terms decrease there, and above it the closed
/// forms cancel at most one digit.
const NEAR: f64 = 1.0;
/// The squared angle below which a few terms are enough.
const TINY: f64 = 1.0 / 32.0;

/// The Stumpff functions `[c_0, c_1, c_2, c_3]`, `c_n(s) = Σ_k (−s)^k / (2k + n)!`, for `s ≥ 0`
/// (Stumpff 1947):
///
/// ```math
/// c_0 = \cos\theta,\quad c_1 = \frac{\sin\theta}{\theta},\quad
/// c_2 = \frac{1 - \cos\theta}{\theta^2},\quad c_3 = \frac{\theta - \sin\theta}{\theta^3},
/// \qquad \theta^2 = s .
/// ```
///
/// Near zero the last two are summed, and `c_n = 1/n! − s c_{n+2}` gives the others.
///
/// ```
/// use metriplectic_fields::series::stumpff;
/// use num_dual::Dual64;
/// // d(sin θ/θ)/ds = −1/6 at zero, where the textbook formula is 0/0.
/// let [_, c1, ..] = stumpff(Dual64::new(0.0, 1.0));
/// assert_eq!(c1.eps, -1.0 / 6.0);
/// ```
#[inline(always)]
pub fn stumpff<D: Scalar>(s: D) -> [D; 4] {
    if D::NDERIV == 0 && s.re() == 0.0 {
        return [1.0, 1.0, 1.0 / 2.0, 1.0 / 6.0].map(D::from);
    }
    by_size(s)
}

#[inline]
fn by_size<D: Scalar>(s: D) -> [D; 4] {
    // Each derivative removes a term from the end of a series.
    match s.re().abs() {
        size if size < TINY => power_series(s, 5 + D::NDERIV),
        size if size < NEAR => power_series(s, 9 + D::NDERIV),
        _ => closed_forms(s),
    }
}

fn closed_forms<D: Scalar>(s: D) -> [D; 4] {
    let theta = s.sqrt();
    let (sine, cosine) = (theta * 0.5).sin_cos();
    let (c0, c1) = (-(sine * sine * 2.0) + 1.0, sine * cosine * 2.0 / theta);
    [c0, c1, sine * sine * 2.0 / s, (-c1 + 1.0) / s]
}

/// The first terms of the series, by Horner's scheme.
#[inline(always)]
fn power_series<D: Scalar>(s: D, terms: usize) -> [D; 4] {
    let (mut c2, mut c3) = (D::zero(), D::zero());
    for k in (0..terms).rev() {
        c2 = -(s * c2) + RECIPROCAL_FACTORIALS[2 * k + 2];
        c3 = -(s * c3) + RECIPROCAL_FACTORIALS[2 * k + 3];
    }
    [-(s * c2) + 1.0, -(s * c3) + 1.0, c2, c3]
}

/// `1/k!`.
const RECIPROCAL_FACTORIALS: [f64; 40] = {
    let (mut factorial, mut reciprocals, mut k) = (1.0, [1.0; 40], 1);
    while k < 40 {
        factorial *= k as f64;
        reciprocals[k] = 1.0 / factorial;
        k += 1;
    }
    reciprocals
};

/// `θ / sin θ` from the squared sine and the cosine of an angle `0 ≤ θ < π`.
///
/// At `θ = π` it is infinite: the direction of the logarithm is undefined at the antipode.
pub fn angle_over_sine<D: Scalar>(squared_sine: D, cosine: D) -> D {
    if cosine.re() > 0.0 && squared_sine.re() < 0.1 * NEAR {
        // atan(t)/t for t = tan θ, in t².
        let squared_tangent = squared_sine / (cosine * cosine);
        return arctangent_series(squared_tangent) / cosine;
    }
    let sine = squared_sine.sqrt();
    sine.atan2(cosine) / sine
}

/// `atan(t)/t = Σ_k (−t²)^k/(2k + 1)` for `|t²| ≤ 1/9`; that of `−t²` is `artanh(t)/t`.
pub(crate) fn arctangent_series<D: Scalar>(squared: D) -> D {
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
        let mut term = RECIPROCAL_FACTORIALS[n as usize];
        for k in 1..60 {
            terms.push(term);
            term *= -s / (f64::from(2 * k + n) * f64::from(2 * k + n - 1));
        }
        terms.iter().rev().sum()
    }

    #[test]
    fn stumpff_functions_are_their_series() {
        for k in 0..2000 {
            let s = 0.005 * f64::from(k);
            for (n, value) in (0..).zip(stumpff(s)) {
                let exact = reference(n, s);
                // The alternating reference itself rounds its largest term.
                let bound = 4.0 * f64::EPSILON * s.sqrt().exp() * RECIPROCAL_FACTORIALS[n as usize];
                assert!((value - exact).abs() <= bound, "c_{n}({s}) = {value}, not {exact}");
            }
        }
    }

    #[test]
    fn derivatives_are_right_at_zero_and_across_the_junctions() {
        // c_n' = −(c_{n+1} − n c_{n+2})/2 holds for every Stumpff function.
        let slope = |n: u32, c: &dyn Fn(u32) -> f64| -0.5 * (c(n + 1) - f64::from(n) * c(n + 2));
        for s in [0.0, 1e-12, 0.031, 0.0313, 0.3, 0.999_999, 1.000_001, 4.0, 9.0] {
            let values = stumpff(HyperDual64::new(s, 1.0, 1.0, 0.0));
            for (n, value) in (0..).zip(values) {
                let first = slope(n, &|n| reference(n, s));
                let second = slope(n, &|n| slope(n, &|n| reference(n, s)));
                // A derivative of a closed form divides its round-off by s.
                assert!((value.eps1 - first).abs() < 1e-15, "c_{n}'({s})");
                assert!((value.eps1eps2 - second).abs() < 4e-15, "c_{n}''({s})");
            }
        }
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
