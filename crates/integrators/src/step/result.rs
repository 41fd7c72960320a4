//! The input and the result of a step.

use super::{Effort, Element, Evidence, Flow, Laws, StepError};

/// Where a step starts.
#[derive(Debug)]
pub struct StepStart<'a, F: Flow + ?Sized> {
    /// The flow.
    pub flow: &'a F,
    /// The state.
    pub x: &'a Element<F>,
    /// The time.
    pub time: f64,
    /// The laws there.
    pub values: Laws<F::Numbers>,
    /// The laws at the start of the run; for the entropy, after the last step that dissipated. A method
    /// may aim at these values, so that round-off does not add up.
    pub reference: Laws<F::Numbers>,
    /// The error that each entry is allowed in this step, if the steps follow a tolerance.
    pub allowed: Option<F::Vector>,
}

impl<'a, F: Flow + ?Sized> StepStart<'a, F> {
    /// The first step of a run from `x`.
    pub fn first(flow: &'a F, x: &'a Element<F>) -> Self {
        let values = flow.laws(x);
        Self { flow, x, time: 0.0, reference: values.clone(), values, allowed: None }
    }
}

/// The two ends of a step that was taken.
#[derive(Debug)]
pub struct StepEnds<'a, F: Flow + ?Sized> {
    /// The flow.
    pub flow: &'a F,
    /// The state at its start.
    pub x: &'a Element<F>,
    /// The state at its end.
    pub end: &'a Element<F>,
    /// Its size.
    pub h: f64,
    /// The laws at both.
    pub values: [&'a Laws<F::Numbers>; 2],
    /// The laws at the start of the run, as in [`StepStart::reference`].
    pub reference: &'a Laws<F::Numbers>,
}

/// Two times of a step, between which a function of the state may have left its sign and come back.
pub struct Excursion<'a, X> {
    /// The state at the first time.
    pub from: &'a X,
    /// Both times as fractions of the step.
    pub fractions: [f64; 2],
    /// The values of the function, of one sign.
    pub values: [f64; 2],
    /// The function at the first time.
    pub function: &'a dyn Fn(&X) -> f64,
}

impl<X> std::fmt::Debug for Excursion<'_, X> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Excursion")
            .field("fractions", &self.fractions)
            .field("values", &self.values)
            .finish_non_exhaustive()
    }
}

/// A step that was taken.
#[derive(Clone, Debug)]
pub struct Taken<F: Flow + ?Sized> {
    /// The state at its end.
    pub x: Element<F>,
    /// The laws there.
    pub values: Laws<F::Numbers>,
    /// Evidence about the motion.
    pub evidence: Evidence,
    /// The effort of the solver.
    pub effort: Effort,
}

/// A step that was not taken, where a smaller one may be.
#[derive(Clone, Debug)]
pub struct Refusal {
    /// The effort of the solver.
    pub effort: Effort,
    /// The error that a run ends with if no smaller step is taken either, where there is a particular one.
    pub error: Option<StepError>,
    /// Whether the entropy would have fallen. Steps then stay smaller for a while.
    pub second_law: bool,
}
