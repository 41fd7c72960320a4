//! How the size of a step follows from the errors of the steps before it.

/// How steps follow a tolerance: with the error `r` of a step in units of the one allowed, and that of the step
/// before it, `r₋`,
///
/// ```math
/// h_+ = h \, \min\bigl(r_{\max}, \max(r_{\min}, \; s\, r^{-\alpha} r_-^{\beta}) \bigr) .
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Control {
    /// The power of the tolerance to which the error of a step is held.
    pub power: f64,
    /// The exponent `α`.
    pub alpha: f64,
    /// The exponent `β`.
    pub beta: f64,
    /// The exponent of a step that is rejected, without `r₋`.
    pub rejected: f64,
    /// The least ratio of two steps, and the largest.
    pub ratios: [f64; 2],
}

impl Control {
    /// The PI controller of Gustafsson (1991) for a method of order `p`, with local errors `∝ τ^{(p+1)/p}`: the
    /// error at the end of a run is proportional to the tolerance.
    #[must_use]
    pub const fn of_order(p: u32) -> Self {
        #[allow(clippy::cast_lossless, reason = "`f64::from` is not constant")]
        let (order, local) = (p as f64, (p + 1) as f64);
        Self {
            power: local / order,
            alpha: 0.7 / local,
            beta: 0.4 / local,
            rejected: 1.0 / local,
            ratios: [0.2, 5.0],
        }
    }
}
