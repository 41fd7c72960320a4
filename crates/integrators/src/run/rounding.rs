//! Two expressions of one time.

/// By how much a time of a run that began at `start` may differ from another expression of the same time.
pub(crate) fn rounding(start: f64, time: f64) -> f64 {
    2.0 * f64::EPSILON * start.abs().max(time.abs())
}
