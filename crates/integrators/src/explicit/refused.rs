//! Why an explicit step is not taken.

use super::flow::StageFlow;
use crate::step::{Effort, Element, Refusal, StepError};

/// Why a step is not taken.
pub(super) enum Refused {
    /// A stage is beyond the edge of the chart or the domain, or has no value; at a site, if the flow says which.
    Outside(Option<usize>),
    /// No state near by has the laws of the run.
    Far,
    /// The entropy would fall, where friction produces this much in the step.
    Falls(f64),
    /// No smaller step can be taken either.
    Never(StepError),
}

impl Refused {
    /// Converts to the refusal of a step of size `h` from `time`.
    pub(super) fn into_refusal(self, time: f64, h: f64) -> Refusal {
        let tried = Effort::default();
        let second_law = matches!(self, Self::Falls(_));
        let error = match self {
            Self::Outside(Some(site)) => Some(StepError::SiteOutOfDomain { time, h, site, tried }),
            Self::Never(error) => Some(error),
            _ => None,
        };
        Refusal { effort: tried, error, second_law }
    }

    /// A displacement leads out of the domain.
    #[cold]
    pub(super) fn outside<F: StageFlow>(flow: &F, x: &Element<F>, d: &F::Vector) -> Self {
        Self::Outside(flow.site_outside(x, d))
    }
}
