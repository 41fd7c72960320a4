//! Forward and back in time.

/// The sign of the time of a run, and of its steps.
pub(crate) const fn direction(backward: bool) -> f64 {
    if backward { -1.0 } else { 1.0 }
}
