//! How far a run goes, in which steps, and what of it is recorded.

/// The time span of a run: the step size, the number of steps, and every how many a state is kept.
///
/// ```
/// use metriplectic_integrators::Span;
/// // A million steps of which a thousand are recorded.
/// let span = Span::steps(0.1, 1_000_000).every(1_000);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    step: f64,
    count: usize,
    every: usize,
}

/// The most states that a run makes room for beforehand: it may end long before its span.
const ROOM: usize = 1 << 12;

impl Span {
    /// `count` steps of size `step`, each of them recorded.
    pub const fn steps(step: f64, count: usize) -> Self {
        Self { step, count, every: 1 }
    }

    /// Records the start and every `every`-th state after it, and always the last.
    pub const fn every(self, every: usize) -> Self {
        Self { every, ..self }
    }

    /// Records at most `states` states, evenly spaced but for the last. The start and the last state
    /// are always recorded, so two are the fewest.
    ///
    /// ```
    /// use metriplectic_integrators::Span;
    /// // Every 1002nd: the start, 998 states, and the last.
    /// let span = Span::steps(0.1, 1_000_000).at_most(1000);
    /// let recorded = (0..=span.count()).filter(|&step| span.records(step)).count();
    /// assert_eq!(recorded, 1000);
    /// ```
    pub const fn at_most(self, states: usize) -> Self {
        let intervals = if states > 2 { states - 1 } else { 1 };
        self.every(self.count.div_ceil(intervals))
    }

    /// The step size.
    pub const fn step_size(&self) -> f64 {
        self.step
    }

    /// The number of steps.
    pub const fn count(&self) -> usize {
        self.count
    }

    /// Whether the state after `step` steps is recorded.
    pub const fn records(&self, step: usize) -> bool {
        step == self.count || step.is_multiple_of(self.every)
    }

    /// The states that a run makes room for before it starts.
    pub(crate) fn room(&self) -> usize {
        (self.count / self.every).min(ROOM) + 2
    }

    pub(crate) fn check(&self) -> Result<(), SpanError> {
        check_step_size(self.step)?;
        if self.count == 0 {
            return Err(SpanError::NoSteps);
        }
        if self.every == 0 {
            return Err(SpanError::RecordsNothing);
        }
        Ok(())
    }
}

/// Accepts a positive, finite step size.
pub(crate) fn check_step_size(h: f64) -> Result<(), SpanError> {
    if h > 0.0 && h.is_finite() { Ok(()) } else { Err(SpanError::StepSize { h }) }
}

/// A span that cannot be run.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpanError {
    /// The step size is zero, negative, infinite or NaN.
    #[error(
        "the step size is {h}; it must be a positive finite number (entropy grows only forward in time)"
    )]
    StepSize {
        /// The step size.
        h: f64,
    },
    /// Zero steps.
    #[error("the span has no steps; ask for at least one")]
    NoSteps,
    /// `every(0)`.
    #[error("`every(0)` records nothing; use `every(1)` to record each step")]
    RecordsNothing,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bounded_record_has_its_ends_and_no_more_states_than_asked_for() {
        for count in 1..60 {
            for states in 0..70 {
                let span = Span::steps(0.1, count).at_most(states);
                let recorded = (0..=count).filter(|&step| span.records(step)).count();
                assert!(recorded <= states.max(2), "{recorded} of {states}, {count} steps");
                // Spaced as closely as that allows.
                let closer = count.div_ceil(span.every.saturating_sub(1).max(1)) + 1;
                assert!(span.every == 1 || closer > states.max(2), "{states}, {count} steps");
                assert!(span.records(0) && span.records(count) && span.check().is_ok());
            }
        }
        assert_eq!(Span::steps(0.1, 0).at_most(10).check(), Err(SpanError::NoSteps));
        assert_eq!(
            Span::steps(0.1, usize::MAX).at_most(2),
            Span::steps(0.1, usize::MAX).every(usize::MAX)
        );
    }
}
