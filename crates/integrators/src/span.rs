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

    /// The step size.
    pub const fn step_size(&self) -> f64 {
        self.step
    }

    /// The number of steps.
    pub const fn count(&self) -> usize {
        self.count
    }

    /// Whether the state after `step` steps is recorded.
    pub(crate) const fn records(&self, step: usize) -> bool {
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
