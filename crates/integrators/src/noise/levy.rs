//! The Brownian path of a term inside a step.

use super::numbers::Numbers;

/// The halvings of a step up to which its path is known; nearer times are joined by straight lines.
const DEPTH: u32 = 52;

/// Computes `W(θ)/√θ` of the Brownian path `W` of a term in a step, with `W(0) = 0` and `W(1) = ξ`, the number of the term; `None` if
/// the numbers have no values [between](Numbers::between) the ends.
///
/// The step is halved again and again (Lévy 1948). In the middle of an interval of the length `l` the path has the mean of its ends and
/// the variance `l/4`:
///
/// ```math
/// W\bigl(\tfrac{a + b}{2}\bigr) = \tfrac12 \bigl( W(a) + W(b) \bigr) + \tfrac12 \sqrt{b - a}\; \zeta_p .
/// ```
///
/// The place `p` is 1 for the whole step, and `2p` and `2p + 1` for the halves of the interval of `p`. So the value at a time does not
/// depend on the other times that are asked for.
pub fn levy(numbers: &impl Numbers, (step, term): (u64, usize), theta: f64) -> Option<f64> {
    let [mut a, mut b] = [0.0, 1.0];
    let [mut at_a, mut at_b] = [0.0, numbers.number(step, term)];
    let mut place = 1;
    for _ in 0..DEPTH {
        let middle = 0.5 * (a + b);
        let zeta = numbers.between(step, term, place)?;
        let at_middle = 0.5 * (at_a + at_b) + 0.5 * f64::sqrt(b - a) * zeta;
        if theta < middle {
            (b, at_b, place) = (middle, at_middle, 2 * place);
        } else {
            (a, at_a, place) = (middle, at_middle, 2 * place + 1);
        }
        if theta - a <= 0.0 {
            return Some(at_a / theta.sqrt());
        }
    }
    let straight = at_a + (at_b - at_a) * ((theta - a) / (b - a));
    Some(straight / theta.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::Counter;

    #[test]
    fn the_path_inside_a_step_is_brownian() {
        // Covariances E W(s) W(t) = min(s, t) at times that are no halves, of both laws of numbers.
        let times = [0.1, 0.3, 0.5, 0.81, 1.0 - 1e-9];
        let count = 40_000;
        for counter in [Counter::new(5), Counter::new(5).three_point()] {
            let mut sums = [[0.0; 5]; 5];
            let (mut fourth, mut mean) = (0.0, 0.0);
            for step in 0..count {
                let w = times.map(|t| levy(&counter, (step, 1), t).unwrap() * t.sqrt());
                for (i, row) in sums.iter_mut().enumerate() {
                    row.iter_mut().zip(w).for_each(|(sum, other)| *sum += w[i] * other);
                }
                fourth += (w[1] * w[1] / times[1]).powi(2);
                mean += w[3];
            }
            let n = count as f64;
            for (i, row) in sums.iter().enumerate() {
                for (j, sum) in row.iter().enumerate() {
                    let (s, t) = (times[i].min(times[j]), times[i].max(times[j]));
                    // The variance of a product of Gaussian numbers.
                    let error = ((s * t + s * s) / n).sqrt();
                    assert!((sum / n - s).abs() < 5.0 * error, "{s} {t}: {}", sum / n);
                }
            }
            assert!((fourth / n - 3.0).abs() < 5.0 * (96.0 / n).sqrt(), "{}", fourth / n);
            assert!((mean / n).abs() < 5.0 / n.sqrt());
        }
    }

    #[test]
    fn a_coarse_step_has_the_path_of_two_fine_ones() {
        for fine in
            [Counter::new(5).path(2), Counter::new(5).coarsened(1), Counter::new(5).three_point()]
        {
            let coarse = fine.coarsened(1);
            let at = |counter: Counter, step: u64, theta: f64| {
                levy(&counter, (step, 3), theta).unwrap() * theta.sqrt()
            };
            // The last intervals of the two are 2⁻⁵³ and 2⁻⁵² of a step, in which a path moves by their roots; no halves are left of 0.25.
            let allowed = 8.0 * 2.0_f64.powi(-26);
            for (theta, allowed) in [(0.11, allowed), (0.25, 1e-14), (0.7, allowed), (0.5, 1e-14)] {
                let first = at(fine, 14, theta) * 0.5_f64.sqrt();
                let off = (at(coarse, 7, 0.5 * theta) - first).abs();
                assert!(off < allowed, "{theta} of {}: {off:e}", fine.name());
                let second = (fine.number(14, 3) + at(fine, 15, theta)) * 0.5_f64.sqrt();
                assert!((at(coarse, 7, 0.5 + 0.5 * theta) - second).abs() < allowed);
            }
            assert_ne!(coarse.name(), fine.name());
        }
    }

    #[test]
    fn the_end_is_the_number_of_the_step() {
        let counter = Counter::new(5);
        let at = |theta: f64| levy(&counter, (7, 2), theta).unwrap() * theta.sqrt();
        assert!((at(1.0 - 1e-15) - counter.number(7, 2)).abs() < 1e-6);
        assert!(at(1e-15).abs() < 1e-6);
        // Half a step is a place of the construction.
        let half = 0.5 * counter.number(7, 2) + 0.5 * counter.between(7, 2, 1).unwrap();
        assert!((at(0.5) - half).abs() < 1e-15);
        assert!((at(0.5) - at(0.5 - 1e-13)).abs() < 1e-5);
    }
}
