//! Means over paths, with their standard errors.

use std::fmt;

/// The mean `m` of `n` independent numbers, with its standard error `s/√n`, `s² = Σ (x − m)²/(n − 1)`.
///
/// ```
/// use metriplectic_ensembles::Estimate;
/// let estimate = Estimate::of([1.02, 0.98, 1.01, 0.99]);
/// assert_eq!(estimate.to_string(), "1.0000 ± 0.0091");
/// assert!(estimate.errors_from(1.01) > 1.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Estimate {
    /// The mean; NaN of no numbers.
    pub mean: f64,
    /// The standard error of the mean; NaN of fewer than two numbers.
    pub standard_error: f64,
    /// How many numbers there are.
    pub count: usize,
}

impl Estimate {
    /// Estimates the mean of numbers, one for each path, in their order (Welford 1962).
    pub fn of(numbers: impl IntoIterator<Item = f64>) -> Self {
        let (mut mean, mut squares, mut count) = (0.0, 0.0, 0_usize);
        for x in numbers {
            count += 1;
            let before = x - mean;
            mean += before / count as f64;
            squares += before * (x - mean);
        }
        let n = count as f64;
        let standard_error = if count > 1 { (squares / (n - 1.0) / n).sqrt() } else { f64::NAN };
        Self { mean: if count == 0 { f64::NAN } else { mean }, standard_error, count }
    }

    /// The distance of the mean from a value, in standard errors.
    #[must_use]
    pub fn errors_from(&self, value: f64) -> f64 {
        (self.mean - value).abs() / self.standard_error
    }
}

/// Writes the mean with two digits of its standard error, `0.9987 ± 0.0041`.
impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { mean, standard_error, .. } = *self;
        let first = standard_error.log10().floor();
        if !(-9.0..9.0).contains(&first) || mean.abs() >= 1e9 {
            return write!(f, "{mean:e} ± {standard_error:.1e}");
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "0 ≤ digits ≤ 10"
        )]
        let digits = (1.0 - first).max(0.0) as usize;
        write!(f, "{mean:.digits$} ± {standard_error:.digits$}")
    }
}

/// A fluctuation theorem `⟨e^{−σ}⟩ = 1` over paths, each with its exact `σ`.
///
/// | | `σ` | the paths |
/// |---|---|---|
/// | [`jarzynski`](Self::jarzynski) (Jarzynski 1997) | `(W − ΔF)/kT` | begin in equilibrium, and a parameter does work |
/// | [`integral`](Self::integral) (Seifert 2005) | `ΔS/k_B` | begin uniformly on an energy shell of a closed system |
///
/// Rare paths dominate such a mean, so its standard error is too small where
/// [`effective`](Self::effective) is. It is no proof of a law: many wrong ones satisfy it.
///
/// ```
/// use metriplectic_ensembles::FluctuationTheorem;
/// // Of Gaussian works with the variance v, the mean is ΔF + v/(2kT).
/// let works = [0.1, 0.9, 0.5, 0.7, 0.3];
/// let check = FluctuationTheorem::jarzynski(works, 1.0, 0.45);
/// assert!(check.to_string().starts_with("⟨exp(−(W − ΔF)/kT)⟩ = 0.99 ± 0.14"), "{check}");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FluctuationTheorem {
    /// The mean of `e^{−σ}`.
    pub estimate: Estimate,
    /// The effective number of paths, `(Σ e^{−σ})²/Σ e^{−2σ}` (Kish 1965).
    pub effective: f64,
    /// The name of the mean.
    mean: &'static str,
}

impl FluctuationTheorem {
    /// Jarzynski's equality for the works of paths, with the thermal energy `kT` and the difference `ΔF` of the free energy.
    pub fn jarzynski(
        works: impl IntoIterator<Item = f64>,
        thermal_energy: f64,
        free_energy: f64,
    ) -> Self {
        let exponents = works.into_iter().map(|work| (free_energy - work) / thermal_energy);
        Self::of("⟨exp(−(W − ΔF)/kT)⟩", exponents)
    }

    /// The integral fluctuation theorem for the changes `ΔS` of the entropy of paths.
    pub fn integral(changes: impl IntoIterator<Item = f64>, k_b: f64) -> Self {
        Self::of("⟨exp(−ΔS/k_B)⟩", changes.into_iter().map(|change| -change / k_b))
    }

    fn of(mean: &'static str, exponents: impl Iterator<Item = f64>) -> Self {
        let weights: Vec<f64> = exponents.map(f64::exp).collect();
        let [sum, squares] = [1, 2].map(|k| weights.iter().map(|w| w.powi(k)).sum::<f64>());
        Self { estimate: Estimate::of(weights), effective: sum * sum / squares, mean }
    }

    /// Returns whether the mean is within so many standard errors of 1.
    #[must_use]
    pub fn holds_within(&self, standard_errors: f64) -> bool {
        self.estimate.errors_from(1.0) <= standard_errors
    }
}

impl fmt::Display for FluctuationTheorem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { estimate, effective, mean } = self;
        write!(
            f,
            "{mean} = {estimate}, {:.1} standard errors from 1; {} paths, effectively {effective:.0}",
            estimate.errors_from(1.0),
            estimate.count
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::{Draw, OF_THE_ROW};

    #[test]
    fn the_standard_error_is_that_of_the_mean() {
        let of = |n: usize| {
            let mut draw = Draw::of(1, OF_THE_ROW, n);
            Estimate::of((0..n).map(|_| draw.normal(3.0, 2.0)))
        };
        let estimate = of(10_000);
        assert!(estimate.errors_from(3.0) < 4.0 && (estimate.standard_error - 0.02).abs() < 1e-3);
        // Of a hundred means two thirds are within an error.
        let within = (100..200).filter(|n| of(*n).errors_from(3.0) < 1.0).count();
        assert!((55..80).contains(&within), "{within}");
        // Large numbers lose no digits.
        let far = Estimate::of([1e9 + 1.0, 1e9 + 2.0, 1e9 + 3.0]);
        assert!((far.standard_error - 3.0_f64.sqrt().recip()).abs() < 1e-12, "{far:?}");
        let [none, one] = [Estimate::of([]), Estimate::of([2.0])];
        assert!(none.mean.is_nan() && one.standard_error.is_nan() && one.count == 1);
    }

    #[test]
    fn both_have_the_digits_of_the_error() {
        for (mean, standard_error, text) in [
            (0.998_712, 0.004_13, "0.9987 ± 0.0041"),
            (12_345.6, 123.0, "12346 ± 123"),
            (1.0, f64::NAN, "1e0 ± NaN"),
            (4.8e-19, 3e-21, "4.8e-19 ± 3.0e-21"),
        ] {
            assert_eq!(Estimate { mean, standard_error, count: 9 }.to_string(), text);
        }
    }

    #[test]
    fn gaussian_works_satisfy_the_equality_of_jarzynski() {
        let (free_energy, variance) = (0.4, 0.6_f64);
        let works = |off: f64| {
            let mut draw = Draw::of(3, OF_THE_ROW, 0);
            (0..20_000)
                .map(move |_| draw.normal(free_energy + 0.5 * variance + off, variance.sqrt()))
        };
        let check = FluctuationTheorem::jarzynski(works(0.0), 1.0, free_energy);
        assert!(check.holds_within(4.0), "{check}");
        // ⟨e^{−σ}⟩² / ⟨e^{−2σ}⟩ = e^{−v} of the paths count.
        assert!((check.effective / 20_000.0 - (-variance).exp()).abs() < 0.05, "{check}");
        let wrong = FluctuationTheorem::jarzynski(works(0.05), 1.0, free_energy);
        assert!(!wrong.holds_within(4.0), "{wrong}");
        let changes = works(0.0).map(|work| 2.0 * (work - free_energy));
        let check = FluctuationTheorem::integral(changes, 2.0);
        assert!(check.holds_within(4.0) && check.to_string().starts_with("⟨exp(−ΔS/k_B)⟩ = "));
    }
}
