//! Spans that cannot be run.

use crate::run::direction::direction;
use crate::step::type_names::short;

/// Advice on a run back in time.
const fn backwards(is_backwards: bool) -> &'static str {
    if is_backwards { "; where nothing dissipates, `.backward()` leads back" } else { "" }
}

/// A span that cannot be run.
#[derive(Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpanError {
    /// The step size is zero, negative, infinite or NaN.
    #[error(
        "the step size is {h}; it must be a positive finite number (entropy grows only forward in time{})",
        backwards(*.h < 0.0)
    )]
    StepSize {
        /// The step size.
        h: f64,
    },
    /// The end is not after the start, or one of them is infinite or NaN; with steps of one size the end
    /// may be too large for a number.
    #[error(
        "the run would start at t = {start} and end at t = {end}; its end must be a later, finite time{}",
        backwards(end < start)
    )]
    End {
        /// The time at which it starts.
        start: f64,
        /// The time asked for.
        end: f64,
    },
    /// A run back in time has an end that is not before its start, or one of them is infinite or NaN.
    #[error(
        "the run would go back from t = {start} to t = {end}; its end must be an earlier, finite time, or leave `.backward()` out"
    )]
    BackwardEnd {
        /// The time at which it starts.
        start: f64,
        /// The time asked for.
        end: f64,
    },
    /// A model with an entropy is to run back in time.
    #[error(
        "a model with an entropy has no run back in time: the second law lets it grow only forward; an entropy that \
         nothing produces is a Casimir, so list it as one"
    )]
    BackwardEntropy,
    /// A system in surroundings is to run back in time.
    #[error(
        "a system with ports or baths has no run back in time: what they have taken is not given back"
    )]
    BackwardExchange,
    /// A run with noise is to go back in time.
    #[error("a run with noise does not go back in time: its path is not known before its start")]
    BackwardNoise,
    /// A run with a jump is to go back in time.
    #[error(
        "an event with a jump has no run back in time: the state before the jump is not known from the one after it"
    )]
    BackwardJump,
    /// A run with corners is to go back in time.
    #[error(
        "a run back in time has no corners: steps are not cut there; run from corner to corner, each to its own end"
    )]
    BackwardCorners,
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
    /// A corner is not a finite time.
    #[error("a corner was named at t = {time}; it must be a finite time")]
    Corner {
        /// The time.
        time: f64,
    },
    /// The interval of samples is not positive and finite, or is not seen in the time.
    #[error(
        "the interval between samples is {interval}; it must be a positive finite number that the time of the run sees"
    )]
    Sampling {
        /// The interval.
        interval: f64,
    },
    /// A run of an open system is to end at rest.
    #[error(
        "an open system has no rest: what drives it may begin at any time; leave `until_rest` out, or stop at an event"
    )]
    NoRestInTime,
    /// The surroundings of an event that gives heat have no positive temperature.
    #[error("event {index} gives heat at a temperature of {temperature}; it has to be positive")]
    JumpTemperature {
        /// Which event, in the order in which they were asked for, counted from 0.
        index: usize,
        /// The temperature.
        temperature: f64,
    },
    /// The resolution of an event is not a positive finite time, or the time of the run does not see it.
    #[error(
        "event {index} has a resolution of {resolution}; it must be a positive finite time that the time of the run sees"
    )]
    EventResolution {
        /// Which event, in the order in which they were asked for, counted from 0.
        index: usize,
        /// The resolution.
        resolution: f64,
    },
    /// A run is to stop after an event has happened no times.
    #[error("event {index} is to stop the run after 0 times; it must be at least one")]
    StopAfterNone {
        /// Which event, in the order in which they were asked for, counted from 0.
        index: usize,
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

metriplectic_equations::debug_is_the_sentence!(SpanError);

/// Accepts a positive, finite step size.
pub(crate) fn check_step_size(h: f64) -> Result<(), SpanError> {
    if h > 0.0 && h.is_finite() { Ok(()) } else { Err(SpanError::StepSize { h }) }
}

/// Accepts a finite time after `start`, or one before it in a run back in time.
pub(crate) fn check_end(start: f64, end: f64, backward: bool) -> Result<(), SpanError> {
    let span = direction(backward) * (end - start);
    match (start.is_finite() && span > 0.0 && end.is_finite(), backward) {
        (true, _) => Ok(()),
        (false, true) => Err(SpanError::BackwardEnd { start, end }),
        (false, false) => Err(SpanError::End { start, end }),
    }
}

/// Accepts steps of one size that end at a finite time, and of which the first is seen in the time. Times are
/// products of the count, so later ones are no shorter than their last digit by more than a rounding. They are negative in a run
/// back in time.
pub(crate) fn check_steps(start: f64, h: f64, count: usize) -> Result<(), SpanError> {
    let end = start + count as f64 * h;
    if start.is_finite() && h.signum() * ((start + h) - start) <= 0.0 {
        return Err(SpanError::Standstill { time: start, h: h.abs() });
    }
    check_end(start, end, h < 0.0)
}
