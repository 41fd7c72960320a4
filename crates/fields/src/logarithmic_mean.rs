//! The logarithmic mean, by which a rate of mass action is a conductance times an affinity.

use crate::Scalar;
use crate::series::arctangent_series;

/// The logarithmic mean of two positive numbers (Carlson 1972):
///
/// ```math
/// \Lambda(p, q) = \frac{p - q}{\ln p - \ln q}, \qquad \Lambda(p, p) = p .
/// ```
///
/// It lies between the geometric and the arithmetic mean. With the forward and the backward rate `p` and `q` of a reaction and
/// its affinity `A = ln(p/q)`, the rate of mass action is `p − q = Λ A`, so that `Λ` is the conductance of the reaction
/// (Mielke 2011; Maas 2011).
///
/// If `p` and `q` differ by less than a factor of two it is evaluated as `m r/artanh r` with `m = (p + q)/2` and
/// `r = (p − q)/(p + q)`, by the series of `artanh`, so that it and its derivatives are right at `p = q`. `Λ(p, 0) = 0`, where the
/// derivative is infinite: there, and of negative numbers, the derivatives or the value are not a number, and a run says so by an error.
///
/// ```
/// use metriplectic_fields::logarithmic_mean;
/// use num_dual::Dual64;
/// assert!((logarithmic_mean(2.0, 1.0) - 1.0 / 2.0_f64.ln()).abs() < 1e-15);
/// // dΛ/dp = 1/2 at p = q, where the formula is 0/0.
/// assert_eq!(logarithmic_mean(Dual64::new(3.0, 1.0), 3.0.into()), Dual64::new(3.0, 0.5));
/// ```
#[must_use]
pub fn logarithmic_mean<D: Scalar>(p: D, q: D) -> D {
    let sum = p + q;
    let r = (p - q) / sum;
    let s = r * r;
    if sum.re() > 0.0 && s.re() < 1.0 / 9.0 {
        return sum * 0.5 / arctangent_series(-s);
    }
    // The quotient has the digits of the value, and the logarithms have derivatives where those of the quotient overflow.
    let (logarithms, quotient) = (p.ln() - q.ln(), p.re() / q.re());
    let rounding = if quotient.is_normal() { quotient.ln() - logarithms.re() } else { 0.0 };
    (p - q) / (logarithms + rounding)
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::HyperDual64;

    /// `Λ`, `∂Λ/∂p`, `∂Λ/∂q`, `∂²Λ/∂p²` and `∂²Λ/∂p∂q`, computed with 60 digits.
    const VALUES: [([f64; 2], [f64; 5]); 6] = [
        ([1.0, 1.0], [1.0, 0.5, 0.5, -1.0 / 6.0, 1.0 / 6.0]),
        (
            [1.0, 1.000_000_1],
            [
                1.000_000_049_999_999_3,
                0.500_000_016_666_666_3,
                0.499_999_983_333_334_56,
                -0.166_666_674_999_999_85,
                0.166_666_658_333_334,
            ],
        ),
        (
            [0.7, 0.9],
            [
                0.795_815_828_673_594_9,
                0.544_655_379_256_600_8,
                0.460_618_959_104_415_9,
                -0.270_401_146_826_209_8,
                0.210_312_003_087_052_03,
            ],
        ),
        (
            [1.0, 1.9],
            [
                1.402_188_285_198_401,
                0.626_604_113_276_924,
                0.408_202_195_748_145_87,
                -0.232_108_992_177_292_4,
                0.122_162_627_461_732_84,
            ],
        ),
        (
            [2.0, 1.0],
            [
                std::f64::consts::LOG2_E,
                0.402_010_550_386_159_5,
                0.638_673_940_116_644_4,
                -0.059_636_382_175_753_13,
                0.119_272_764_351_506_24,
            ],
        ),
        (
            [3e-9, 2e-12],
            [
                4.099_425_207_111_540_5e-10,
                0.118_053_668_206_187_15,
                27.890_758_046_296_31,
                -4_533_334.803_010_915,
                6_800_002_204.516_374,
            ],
        ),
    ];

    #[test]
    fn it_and_its_derivatives_are_right_near_and_far_from_equal_numbers() {
        for ([p, q], exact) in VALUES {
            let mean = |[p1, p2]: [f64; 2], [q1, q2]: [f64; 2]| {
                logarithmic_mean(HyperDual64::new(p, p1, p2, 0.0), HyperDual64::new(q, q1, q2, 0.0))
            };
            let (pp, pq) = (mean([1.0, 1.0], [0.0, 0.0]), mean([1.0, 0.0], [0.0, 1.0]));
            let found = [pp.re, pq.eps1, pq.eps2, pp.eps1eps2, pq.eps1eps2];
            // Each derivative beyond the series, where |ln p − ln q| ≥ 0.69, may lose the digits of one more division by it.
            for (order, (found, exact)) in
                [0, 1, 1, 2, 2].into_iter().zip(found.into_iter().zip(exact))
            {
                let bound = 8.0 * 4_f64.powi(order) * f64::EPSILON * exact.abs();
                assert!(
                    (found - exact).abs() <= bound,
                    "{p}, {q}: order {order}: {found}, not {exact}"
                );
            }
        }
    }

    #[test]
    fn it_is_symmetric_homogeneous_and_without_a_jump() {
        // Where r² passes 1/9, and at sizes whose quotients overflow.
        for (p, q) in
            [(2.0, 1.0), (1.999_999_999_999, 1.0), (2.000_000_000_001, 1.0), (1.0, 1e-290)]
        {
            let mean: f64 = logarithmic_mean(p, q);
            let off = |other: f64| (other - mean).abs() / mean;
            assert!(off(logarithmic_mean(q, p)) <= 4.0 * f64::EPSILON);
            for scale in [2_f64.powi(-40), 2_f64.powi(300)] {
                assert!(off(logarithmic_mean(p * scale, q * scale) / scale) <= 4.0 * f64::EPSILON);
            }
            if q > 0.5 {
                let slope = 0.402;
                assert!(off(1.0 / 2_f64.ln() + slope * (p - 2.0)) <= 8.0 * f64::EPSILON);
            }
        }
        let far = HyperDual64::new(1e-200, 1.0, 0.0, 0.0);
        let mean = logarithmic_mean(far, HyperDual64::from(5e100));
        assert!((mean.re - 7.221_416_187_374_858e97).abs() <= 8.0 * f64::EPSILON * mean.re);
        assert!(mean.eps1.is_finite());
        let extreme: f64 = logarithmic_mean(1e-300, 1e300);
        assert!((extreme - 1e300 / (600.0 * std::f64::consts::LN_10)).abs() <= 1e-15 * extreme);
    }

    #[test]
    fn zero_has_no_derivative_and_negative_numbers_have_no_mean() {
        assert!(logarithmic_mean(2.0, 0.0_f64).abs() <= 0.0);
        assert!(
            logarithmic_mean(HyperDual64::from(2.0), HyperDual64::new(0.0, 1.0, 0.0, 0.0))
                .eps1
                .is_nan()
        );
        for [p, q] in [[-1.0_f64, 2.0], [2.0, -1.0], [-1.0, -1.1], [-1.0, -9.0], [0.0, 0.0]] {
            assert!(logarithmic_mean(p, q).is_nan(), "{p}, {q}");
        }
    }
}
