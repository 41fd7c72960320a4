//! How a run goes.

use crate::run::adaptive::Adaptive;
use crate::run::controller::Rule;
use crate::run::corners::Corners;
use crate::run::direction::direction;
use crate::run::requests::Requests;
use crate::run::sequence::{Frozen, StepSequence};
use crate::run::span_error::{SpanError, check_step_size, check_steps};

/// How a run goes: what [`Method::steps`](crate::Method::steps) and [`Method::run`](crate::Method::run)
/// make of what they are given.
///
/// | given | steps | until |
/// |---|---|---|
/// | a number `h` | of size `h` | you stop |
/// | [`Span::steps`](crate::Span::steps)`(h, count)` | of size `h` | `count` of them |
/// | [`Span::until`](crate::Span::until)`(end)` | that follow a tolerance | `t = end` |
///
/// Each of them may ask for states at given times and for events: see [`Watch`](crate::Watch).
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    pub(crate) size: Size,
    /// The time at which the run starts.
    pub(crate) start: f64,
    /// Whether it goes back in time.
    pub(crate) backward: bool,
    pub(crate) count: Option<usize>,
    pub(crate) every: usize,
    /// The most states to record.
    pub(crate) most: Option<usize>,
    pub(crate) rest: Option<f64>,
    /// The outputs and the events.
    pub(crate) watch: Requests,
    /// The times across which no step goes.
    pub(crate) corners: Corners,
    /// The steps of another run.
    pub(crate) frozen: Frozen,
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
        let (watch, corners, frozen) = (Requests::default(), Corners::default(), Frozen::No);
        Self {
            size: Size::Fixed(h),
            start,
            backward: false,
            count: None,
            every,
            most,
            rest,
            watch,
            corners,
            frozen,
        }
    }
}

impl Schedule {
    /// Leaves out [`until_rest`](crate::Until::until_rest), so that the run goes on at rest.
    ///
    /// Rest is found at the end of a step. So the end of a run until rest jumps where a parameter changes the steps, and a loss of it
    /// has no slope.
    #[must_use]
    pub fn without_rest(self) -> Self {
        Self { rest: None, ..self }
    }

    /// Notes the steps that a run takes which follows a tolerance, for runs [beside it](Self::taking). A run of this schedule begins the
    /// sequence anew.
    #[must_use]
    pub fn noting(self, sequence: &StepSequence) -> Self {
        Self { frozen: Frozen::noting(sequence), ..self }
    }

    /// Takes the steps of another run of this schedule in place of those that the tolerance asks for: each is taken whatever its error
    /// is. One that cannot be taken, because its equation has no solution or the entropy would fall, is taken in parts, and the run goes on
    /// with the steps after it. Where the sequence has no more steps, and where it has none, the tolerance chooses them; steps of one size
    /// stay as they are.
    #[must_use]
    pub fn taking(self, sequence: &StepSequence) -> Self {
        Self { frozen: Frozen::taking(sequence), ..self }
    }

    /// Whether the run ends where the state comes to rest.
    pub const fn ends_at_rest(&self) -> bool {
        self.rest.is_some()
    }

    /// Whether all steps have one size.
    pub(crate) const fn is_fixed(&self) -> bool {
        matches!(self.size, Size::Fixed(_))
    }

    /// How long the run may last, if the sizes of the entries matter to it: to its errors, or to its rest.
    pub(crate) fn span(&self) -> Option<f64> {
        match &self.size {
            Size::Tolerance(adaptive) => Some((adaptive.end() - self.start).abs()),
            Size::Fixed(h) if self.rest.is_some() => {
                Some(self.count.map_or(*h, |count| count as f64 * h))
            }
            Size::Fixed(_) => None,
        }
    }

    /// When the run ends; infinite if it does not.
    pub(crate) fn end(&self) -> f64 {
        match &self.size {
            Size::Fixed(h) => {
                let h = direction(self.backward) * h;
                self.count.map_or(h.signum() * f64::INFINITY, |n| self.start + n as f64 * h)
            }
            Size::Tolerance(adaptive) => adaptive.end(),
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
                    check_steps(self.start, direction(self.backward) * h, count)?;
                }
            }
            Size::Tolerance(adaptive) => adaptive.check(self.start, self.backward)?,
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
        if self.backward && !self.corners.is_empty() {
            return Err(SpanError::BackwardCorners);
        }
        self.corners.check(self.end())?;
        match self.rest {
            Some(tolerance) if !(tolerance > 0.0 && tolerance < 1.0) => {
                Err(SpanError::Rest { tolerance })
            }
            _ => Ok(()),
        }
    }
}
