//! How far a run goes, in which steps, and what of it is recorded.

use crate::run::controller::Rule;
use crate::run::type_names::short;
use crate::run::until::Adaptive;
use crate::run::watch::Requests;

/// The time span of a run: the step size, the number of steps, and every how many a state is kept.
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
}

/// The most states that a run makes room for beforehand: it may end long before its span.
pub(crate) const ROOM: usize = 1 << 12;

impl Span {
    /// `count` steps of size `step`, each of them recorded.
    pub const fn steps(step: f64, count: usize) -> Self {
        Self { start: 0.0, step, count, every: 1, rest: None }
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

/// How a run goes: what [`Method::steps`](crate::Method::steps) and [`Method::run`](crate::Method::run)
/// make of what they are given.
///
/// | given | steps | until |
/// |---|---|---|
/// | a number `h` | of size `h` | you stop |
/// | [`Span::steps`]`(h, count)` | of size `h` | `count` of them |
/// | [`Span::until`]`(end)` | that follow a tolerance | `t = end` |
///
/// Each of them may ask for states at given times and for events: see [`Watch`](crate::Watch).
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    pub(crate) size: Size,
    /// The time at which the run starts.
    pub(crate) start: f64,
    pub(crate) count: Option<usize>,
    pub(crate) every: usize,
    /// The most states to record.
    pub(crate) most: Option<usize>,
    pub(crate) rest: Option<f64>,
    /// The outputs and the events.
    pub(crate) watch: Requests,
}

/// How large the steps of a course are.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Size {
    Fixed(f64),
    Tolerance(Adaptive),
}

impl From<f64> for Schedule {
    fn from(h: f64) -> Self {
        let (start, every, most, rest) = (0.0, 1, None, None);
        let watch = Requests::default();
        Self { size: Size::Fixed(h), start, count: None, every, most, rest, watch }
    }
}

impl From<Span> for Schedule {
    fn from(Span { start, step, count, every, rest }: Span) -> Self {
        let (size, watch) = (Size::Fixed(step), Requests::default());
        Self { size, start, count: Some(count), every, most: None, rest, watch }
    }
}

impl Schedule {
    /// Whether all steps have one size.
    pub(crate) const fn is_fixed(&self) -> bool {
        matches!(self.size, Size::Fixed(_))
    }

    /// How long the run may last, if the sizes of the entries matter to it: to its errors, or to its rest.
    pub(crate) fn span(&self) -> Option<f64> {
        match &self.size {
            Size::Tolerance(adaptive) => Some(adaptive.end() - self.start),
            Size::Fixed(h) if self.rest.is_some() => {
                Some(self.count.map_or(*h, |count| count as f64 * h))
            }
            Size::Fixed(_) => None,
        }
    }

    /// Accepts a tolerance that a method with this rule can hold.
    pub(crate) fn check_tolerance(&self, rule: &Rule) -> Result<(), SpanError> {
        match &self.size {
            Size::Fixed(_) => Ok(()),
            Size::Tolerance(adaptive) => adaptive.check_tolerance(rule),
        }
    }

    pub(crate) fn check(&self) -> Result<(), SpanError> {
        match &self.size {
            Size::Fixed(h) => {
                check_step_size(*h)?;
                if let Some(count) = self.count.filter(|count| *count > 0) {
                    check_steps(self.start, *h, count)?;
                }
            }
            Size::Tolerance(adaptive) => adaptive.check(self.start)?,
        }
        if self.count == Some(0) {
            return Err(SpanError::NoSteps);
        }
        if self.every == 0 {
            return Err(SpanError::RecordsNothing);
        }
        if self.watch.has_outputs() && (self.every != 1 || self.most.is_some()) {
            return Err(SpanError::TwoRecords);
        }
        match self.rest {
            Some(tolerance) if !(tolerance > 0.0 && tolerance < 1.0) => {
                Err(SpanError::Rest { tolerance })
            }
            _ => Ok(()),
        }
    }
}

/// Accepts a positive, finite step size.
pub(crate) fn check_step_size(h: f64) -> Result<(), SpanError> {
    if h > 0.0 && h.is_finite() { Ok(()) } else { Err(SpanError::StepSize { h }) }
}

/// Accepts a finite time after `start`.
pub(crate) fn check_end(start: f64, end: f64) -> Result<(), SpanError> {
    if start.is_finite() && end > start && end.is_finite() {
        Ok(())
    } else {
        Err(SpanError::End { start, end })
    }
}

/// Accepts steps of one size that end at a finite time, and of which the first is seen in the time. Times are
/// products of the count, so later ones are no shorter than their last digit by more than a rounding.
pub(crate) fn check_steps(start: f64, h: f64, count: usize) -> Result<(), SpanError> {
    let end = start + count as f64 * h;
    if start.is_finite() && start + h <= start {
        return Err(SpanError::Standstill { time: start, h });
    }
    check_end(start, end)
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
    /// The end is not after the start, or one of them is infinite or NaN; with steps of one size the end
    /// may be too large for a number.
    #[error(
        "the run would start at t = {start} and end at t = {end}; its end must be a later, finite time"
    )]
    End {
        /// The time at which it starts.
        start: f64,
        /// The time asked for.
        end: f64,
    },
    /// The steps are shorter than the last digit of the time.
    #[error(
        "at t = {time:.6e} a step of size {h:.1e} does not change the time; let the run start at t = 0, or \
         take larger steps"
    )]
    Standstill {
        /// The time, the largest one of the run.
        time: f64,
        /// The step size.
        h: f64,
    },
    /// The list of `scale` or `absolute` has another length than the point has directions.
    #[error(
        "{found} numbers were given for the entries, and the chart has {expected} directions (in a lattice, that \
         of a site); give one for each"
    )]
    Entries {
        /// How many there are.
        found: usize,
        /// How many directions the chart has, or that of a site of a lattice.
        expected: usize,
    },
    /// A number in the list of `scale` or `absolute` is negative, infinite or NaN.
    #[error(
        "the number for direction {index} is {value}; it must be finite and positive, or zero for the \
         automatic one"
    )]
    Entry {
        /// Which direction.
        index: usize,
        /// The number.
        value: f64,
    },
    /// The tolerance is not a number, below the round-off of a step, or above the size of the entries.
    #[error(
        "the tolerance is {tolerance:e}; with this method it must be from {least:.0e} to {largest}"
    )]
    Tolerance {
        /// The tolerance asked for.
        tolerance: f64,
        /// The least one of the method.
        least: f64,
        /// The largest one.
        largest: f64,
    },
    /// The least step size is larger than the largest one.
    #[error("the least step size {least} is above the largest one, {largest}; swap them?")]
    StepSizes {
        /// The least step size.
        least: f64,
        /// The largest step size.
        largest: f64,
    },
    /// The tolerance of rest is not between 0 and 1.
    #[error(
        "the tolerance of rest is {tolerance}; it is compared with the speed relative to the \
         largest one, so it must be between 0 and 1"
    )]
    Rest {
        /// The tolerance asked for.
        tolerance: f64,
    },
    /// Zero steps.
    #[error("the span has no steps; ask for at least one")]
    NoSteps,
    /// A step size alone, where a run has to end.
    #[error("steps of one size have no end; say how many with `Span::steps`")]
    Endless,
    /// `every(0)`.
    #[error("`every(0)` records nothing; use `every(1)` to record each step")]
    RecordsNothing,
    /// Outputs are asked for, and `every` or `at_most` too.
    #[error(
        "outputs at given times are recorded in place of steps; leave out `every` and `at_most`, or the \
         outputs"
    )]
    TwoRecords,
    /// A time of an output is not one of the run.
    #[error("an output was asked for at t = {time}; the run goes from t = {start} to t = {end}")]
    Output {
        /// The time asked for.
        time: f64,
        /// The time at which the run starts.
        start: f64,
        /// The time at which it ends.
        end: f64,
    },
    /// The interval between outputs is zero, negative, infinite or NaN.
    #[error("the interval between outputs is {interval}; it must be a positive finite number")]
    OutputInterval {
        /// The interval.
        interval: f64,
    },
    /// Outputs follow each other so closely that they have one time.
    #[error(
        "at t = {time:.6e} outputs that are {interval:.1e} apart have one time; let the run start at t = 0, or \
         ask for a longer interval"
    )]
    OutputStandstill {
        /// The time, the largest one of the run; without an end that of its first step.
        time: f64,
        /// The interval.
        interval: f64,
    },
    /// The function of an event has points of another type than the run.
    #[error(
        "event {index} is a function of {}, and the points of the run are {}; say this type in the closure",
        short(found),
        short(expected)
    )]
    EventPoint {
        /// Which event, in the order in which they were asked for, counted from 0.
        index: usize,
        /// The type of its points.
        found: &'static str,
        /// The type of the points of the run.
        expected: &'static str,
    },
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
