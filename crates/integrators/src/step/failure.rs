//! How hard an implicit step is tried, and why it was not taken.

use super::StepError;

/// How hard to try.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fallbacks {
    /// Everything, because only halving the step comes after it.
    All,
    /// The first tries alone, because a smaller step is tried next.
    FirstTries,
}

/// Why a step was not taken.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Cause {
    /// The domain of the model is in the way.
    Edge,
    /// The equation is solved, but its end has another energy.
    Energy { change: f64, size: f64 },
    /// The iteration does not converge.
    Unsolved,
}

impl Cause {
    /// The error that names the first law, if the step was refused because its end has another energy.
    pub(crate) const fn first_law(self, time: f64, h: f64) -> Option<StepError> {
        match self {
            Self::Energy { change, size } => {
                Some(StepError::FirstLawBroken { time, h, change, size })
            }
            Self::Edge | Self::Unsolved => None,
        }
    }
}
