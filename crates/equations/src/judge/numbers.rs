//! Sums and largest values of lists of numbers.

/// The sum `⟨α, v⟩`.
pub(super) fn dot(alpha: &[f64], v: &[f64]) -> f64 {
    alpha.iter().zip(v).map(|(a, v)| a * v).sum()
}

/// The largest absolute value, and NaN if one is NaN.
pub(super) fn max_abs(numbers: &[f64]) -> f64 {
    numbers.iter().map(|number| number.abs()).fold(0.0, worse)
}

/// Returns whether all numbers are finite.
pub(super) fn all_finite(numbers: &[f64]) -> bool {
    numbers.iter().all(|number| number.is_finite())
}

/// Returns the larger of two sizes, where NaN is the largest.
pub(crate) fn worse(old: f64, new: f64) -> f64 {
    if new > old || new.is_nan() { new } else { old }
}
