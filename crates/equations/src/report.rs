//! The residual of every law of a model.

use std::fmt;

use crate::model_error::ModelError;

/// A law of the model, with its largest violation among the samples.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LawResidual {
    /// The law as a formula.
    pub law: &'static str,
    /// The violation, relative to the terms that should cancel.
    pub size: f64,
    /// The violation that is taken for round-off; infinite if the law is not required.
    pub allowed: f64,
    /// The entries of the point where it is largest.
    pub point: Vec<f64>,
}

impl LawResidual {
    /// Returns whether the law holds at every sample.
    pub fn holds(&self) -> bool {
        self.size <= self.allowed
    }
}

/// The residual of every law of a model, and the first error if there is one; see
/// [`Judge::report`](crate::judge::Judge::report).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Report {
    /// The laws, in the order in which they are checked.
    pub laws: Vec<LawResidual>,
    /// Points at which the model was judged.
    pub judged: usize,
    /// Points at which a value was not finite. Each was drawn again, nearer to the start.
    pub passed_over: usize,
    /// Directions of the frame at the start that the dissipation of the metric moves and the bracket does not, if there are others
    /// that it does. An internal energy is one. A parameter is not: it would not stay constant, and belongs into a
    /// `Family`.
    pub moved_by_friction: Vec<usize>,
    /// The result of [`Judge::verify`](crate::judge::Judge::verify).
    pub verdict: Result<(), ModelError>,
}

impl Report {
    /// Adds a law that was judged beside those of the model.
    pub fn note(&mut self, law: &'static str, size: f64, allowed: f64, point: Vec<f64>) {
        self.laws.push(LawResidual { law, size, allowed, point });
    }

    /// The report of an examination that has not begun.
    pub(crate) const fn new() -> Self {
        Self {
            laws: Vec::new(),
            judged: 0,
            passed_over: 0,
            moved_by_friction: Vec::new(),
            verdict: Ok(()),
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "model judged at {} points ({} passed over)", self.judged, self.passed_over)?;
        for residual in &self.laws {
            let LawResidual { law, size, allowed, .. } = residual;
            if allowed.is_finite() {
                let mark = if residual.holds() { "ok    " } else { "BROKEN" };
                writeln!(f, "  {mark}  {law:<22} {size:9.2e}  (allowed {allowed:.0e})")?;
            } else {
                writeln!(f, "  ------  {law:<22} {size:9.2e}  (not asked for)")?;
            }
        }
        if !self.moved_by_friction.is_empty() {
            writeln!(
                f,
                "  note    directions {:?} are moved by friction alone; a parameter among them belongs into a `Family`",
                self.moved_by_friction
            )?;
        }
        match &self.verdict {
            Ok(()) => write!(f, "verdict: the model keeps its laws"),
            Err(error) => write!(f, "verdict: {error}"),
        }
    }
}
