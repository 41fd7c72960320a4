//! How far a run goes in steps of one size, and what of it is recorded.

use crate::run::corners::Corners;
use crate::run::requests::Requests;
use crate::run::schedule::{Schedule, Size};
use crate::run::sequence::Frozen;

/// The time span of a run: the step size, the number of steps, and every how many a state is kept.
///
/// A program writes this word alone: [`Span::steps`], or [`Span::until`] for steps that follow a tolerance, and then outputs and events
/// in the same chain. [`Until`](crate::Until), [`Schedule`] and [`Watched`](crate::Watched) are the types in between, and
/// [`Watch`](crate::Watch) is the trait of their methods, which the prelude brings in.
///
/// ```
/// use metriplectic_integrators::Span;
/// // A million steps of which a thousand are recorded.
/// let span = Span::steps(0.1, 1_000_000).every(1_000);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    start: f64,
    step: f64,
    count: usize,
    every: usize,
    rest: Option<f64>,
    backward: bool,
}

impl Span {
    /// `count` steps of size `step`, each of them recorded.
    pub const fn steps(step: f64, count: usize) -> Self {
        Self { start: 0.0, step, count, every: 1, rest: None, backward: false }
    }

    /// The time at which the run starts, 0 without another one.
    ///
    /// ```
    /// use metriplectic_integrators::Span;
    /// // From t = 100 to t = 200.
    /// let span = Span::steps(0.1, 1000).starting_at(100.0);
    /// ```
    #[must_use]
    pub const fn starting_at(self, start: f64) -> Self {
        Self { start, ..self }
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

    /// Ends the run as soon as the state is at rest, see [`Ending::Rest`](crate::Ending::Rest); the
    /// number of steps is then a bound.
    #[must_use]
    pub const fn until_rest(self, tolerance: f64) -> Self {
        Self { rest: Some(tolerance), ..self }
    }

    /// Goes back in time: the steps end at `t₀ − h, t₀ − 2h, …`, see [`Watch::backward`](crate::Watch::backward).
    #[must_use]
    pub const fn backward(self) -> Self {
        Self { backward: true, ..self }
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
}

impl From<Span> for Schedule {
    fn from(Span { start, step, count, every, rest, backward }: Span) -> Self {
        let (size, watch) = (Size::Fixed(step), Requests::default());
        let (count, corners, frozen) = (Some(count), Corners::default(), Frozen::No);
        Self { size, start, backward, count, every, most: None, rest, watch, corners, frozen }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::span_error::SpanError;

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
                assert!(
                    span.records(0) && span.records(count) && Schedule::from(span).check().is_ok()
                );
            }
        }
        let none = Schedule::from(Span::steps(0.1, 0).at_most(10));
        assert_eq!(none.check(), Err(SpanError::NoSteps));
        assert_eq!(
            Span::steps(0.1, usize::MAX).at_most(2),
            Span::steps(0.1, usize::MAX).every(usize::MAX)
        );
    }
}
