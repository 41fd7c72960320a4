//! Stages for stiff friction: the method of Runge, Kutta and Chebyshev of order 2.
//!
//! With `s` stages the method is stable on `[−β, 0]`, `β ≈ 0.65 (s² − 1)`, so that the number of stages grows with the
//! square root of `hρ`, where `ρ` is the spectral radius of the equation of motion (Sommeijer, Shampine, Verwer 1997,
//! eqs. 2.2 to 2.7). In the chart at the start of a step, with `q₀ = 0` and the rates `k_j` at `q_j`,
//!
//! ```math
//! q_1 = \tilde\mu_1 h k_0, \qquad
//! q_j = \mu_j q_{j-1} + \nu_j q_{j-2} + \tilde\mu_j h k_{j-1} + \tilde\gamma_j h k_0 .
//! ```
//!
//! The entropy that is produced obeys the same recursion. The spectral radius is found by the power method on
//! differences of rates (§3 of the same), and again after some steps, from the direction that was found last.

use super::flow::StageFlow;
use super::memory::{LastStep, MemoryOf};
use super::refused::Refused;
use super::spectrum::spectrum;
use super::stage::{Here, stage};
use super::tableau::Tableau;
use super::trial::Trial;
use crate::step::{Control, StepStart, Vector};

/// The tableau without rows, with the PI controller of order 2, by which the error at the end is
/// proportional to the tolerance.
pub(crate) const CHEBYSHEV: Tableau =
    Tableau::chebyshev("RungeKuttaChebyshev", Control::of_order(2));

/// The damping `ε`.
/// A factor of four fails `explicit/chebyshev.rs::the_step_is_of_order_two_and_stable_where_its_number_of_stages_says`.
const DAMPING: f64 = 2.0 / 13.0;
/// The most stages of a step; a step that needs more is too long.
/// A factor of four fails `explicit/chebyshev.rs::a_step_of_thousands_of_stages_is_taken_and_a_longer_one_is_not`.
const MOST: u32 = 4000;

/// The stages of a step of size `h`.
pub(super) fn stages<F: StageFlow>(
    &Trial { start: &StepStart { flow, x, .. }, h, .. }: &Trial<'_, F>,
    here: Here<F::Vector>,
    memory: &mut MemoryOf<F>,
) -> Result<LastStep<F::Vector>, Refused> {
    let Here { velocity: start, production } = here;
    let spectrum = spectrum(flow, x, &start, memory.spectrum.take());
    let count = spectrum.as_ref().map_or(2, |spectrum| stage_count(h.abs() * spectrum.radius));
    memory.spectrum = spectrum;
    if count > MOST {
        return Err(Refused::Far);
    }
    let mut c = Coefficients::new(count);
    let first = c.first;
    let [mut before, mut q] = [start.zero(), start.map(|k| first * h * k)];
    let [mut produced_before, mut produced] = [0.0, first * h * production];
    for _ in 2..=count {
        let Recursion { mu, nu, rate, start_rate } = c.next();
        let Here { velocity: k, production: sigma } =
            stage(flow, x, &q).ok_or_else(|| Refused::outside(flow, x, &q))?;
        let next = Vector::zip([&q, &before, &k, &start], |[q, before, k, start]| {
            mu * q + nu * before + h * (rate * k + start_rate * start)
        });
        before = std::mem::replace(&mut q, next);
        let next =
            mu * produced + nu * produced_before + h * (rate * sigma + start_rate * production);
        produced_before = std::mem::replace(&mut produced, next);
    }
    let zero = start.zero();
    let mut stages = Here::at_rest(&zero);
    stages[0] = Here { velocity: start, production };
    Ok(LastStep {
        stages,
        known: 1,
        before: zero,
        at_the_edge: false,
        end: q,
        rise: produced,
        count: Some(count),
    })
}

/// The estimate `0.8 (q₀ − q) + 0.4 h (k₀ + k)` of the local error (eq. 2.9).
pub(super) fn error<V: Vector>(last: &LastStep<V>, h: f64) -> V {
    let [start, end, ..] = &last.stages;
    V::zip([&last.end, &start.velocity, &end.velocity], |[q, start, end]| {
        0.4 * h * (start + end) - 0.8 * q
    })
}

/// The least number of stages with `hρ ≤ β`.
fn stage_count(radius: f64) -> u32 {
    let count = (1.0 + 1.54 * radius).sqrt().floor() + 1.0;
    // A number of stages that is too large, or none, is refused.
    (2..=MOST).find(|&s| f64::from(s) >= count).unwrap_or(MOST + 1)
}

/// The coefficients of the stages, from the Chebyshev polynomials at `w₀ = 1 + ε/s²`.
pub(crate) struct Coefficients {
    w0: f64,
    w1: f64,
    pub(crate) first: f64,
    /// `T_j`, `T_j'`, `T_j''` for the last `j` and the one before it.
    last: [f64; 3],
    before: [f64; 3],
    /// `b_j` for both, and `a_j` for the last.
    b: [f64; 2],
    a: f64,
}

/// The coefficients of one stage.
pub(crate) struct Recursion {
    pub(crate) mu: f64,
    pub(crate) nu: f64,
    pub(crate) rate: f64,
    pub(crate) start_rate: f64,
}

impl Coefficients {
    pub(crate) fn new(count: u32) -> Self {
        let w0 = 1.0 + DAMPING / f64::from(count).powi(2);
        let mut polynomials = [[1.0, 0.0, 0.0], [w0, 1.0, 0.0]];
        for _ in 2..=count {
            polynomials = [polynomials[1], following(w0, polynomials)];
        }
        let [_, slope, bend] = polynomials[1];
        let w1 = slope / bend;
        // T₂'' / T₂'² = 4 / (4 w₀)².
        let b = (4.0 * w0 * w0).recip();
        let first = b * w1;
        let [before, last] = [[1.0, 0.0, 0.0], [w0, 1.0, 0.0]];
        Self { w0, w1, first, last, before, b: [b, b], a: 1.0 - b * w0 }
    }

    pub(crate) fn next(&mut self) -> Recursion {
        let Self { w0, w1, b: [b_before, b_last], a, .. } = *self;
        let polynomials = following(w0, [self.before, self.last]);
        let [value, slope, bend] = polynomials;
        let b = bend / (slope * slope);
        let rate = 2.0 * b * w1 / b_last;
        (self.before, self.last) = (self.last, polynomials);
        (self.b, self.a) = ([b_last, b], 1.0 - b * value);
        Recursion { mu: 2.0 * b * w0 / b_last, nu: -b / b_before, rate, start_rate: -a * rate }
    }
}

/// `T_{j+1} = 2wT_j − T_{j−1}` with its two derivatives.
fn following(w: f64, [before, last]: [[f64; 3]; 2]) -> [f64; 3] {
    [
        2.0 * w * last[0] - before[0],
        2.0 * (last[0] + w * last[1]) - before[1],
        2.0 * (2.0 * last[1] + w * last[2]) - before[2],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The factor of a step on `x' = λx`, `z = hλ`.
    fn factor(count: u32, z: f64) -> f64 {
        let mut c = Coefficients::new(count);
        let [mut before, mut q] = [0.0, c.first * z];
        for _ in 2..=count {
            let Recursion { mu, nu, rate, start_rate } = c.next();
            let next = mu * q + nu * before + z * (rate * (1.0 + q) + start_rate);
            before = std::mem::replace(&mut q, next);
        }
        1.0 + q
    }

    #[test]
    fn the_step_is_of_order_two_and_stable_where_its_number_of_stages_says() {
        for count in [2, 3, 10, 60] {
            let z = 1e-3;
            // e^z = 1 + z + z²/2 + O(z³), with a third coefficient below 1/6.
            assert!((factor(count, z) - 1.0 - z - 0.5 * z * z).abs() < z.powi(3) / 5.0, "{count}");
        }
        for radius in [0.5, 10.0, 300.0, 1e4] {
            let count = stage_count(radius);
            let largest = (1..=2000).map(|k| factor(count, -radius * f64::from(k) / 2000.0).abs());
            assert!(largest.fold(0.0, f64::max) < 1.0, "{radius}");
            // And no more stages than it needs.
            assert!(count < 10 || factor(count, -1.2 * radius).abs() > 1.0, "{radius}: {count}");
        }
    }

    #[test]
    fn a_step_of_thousands_of_stages_is_taken_and_a_longer_one_is_not() {
        let count = stage_count(1e7);
        assert!((3900..3950).contains(&count), "{count}");
        assert!(stage_count(2e7) > MOST && stage_count(f64::INFINITY) > MOST);
    }
}
