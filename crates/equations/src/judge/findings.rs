//! The laws that are violated at a point.

use super::balance::TOLERANCE;
use crate::model_error::ModelError;
use crate::report::LawResidual;

/// The findings at one point: the residuals of the laws, and the first error.
pub(super) struct Findings<'a> {
    pub(super) point: Vec<f64>,
    pub(super) laws: &'a mut Vec<LawResidual>,
    pub(super) first: Option<ModelError>,
}

impl Findings<'_> {
    /// Records the violation of a law, and the first error.
    pub(super) fn note(
        &mut self,
        law: &'static str,
        size: f64,
        error: fn(Vec<f64>, f64) -> ModelError,
    ) {
        if !self.record(law, size, TOLERANCE) && self.first.is_none() {
            let point = self.point.clone();
            // All values of the model are finite here, so their products overflow.
            self.first = Some(if size.is_finite() {
                error(point, size)
            } else {
                ModelError::Overflow { law, point }
            });
        }
    }

    /// Records the violation of a law here if it is the worst of all points, and returns whether it is
    /// allowed.
    pub(super) fn record(&mut self, law: &'static str, size: f64, allowed: f64) -> bool {
        let known = self.laws.iter_mut().find(|residual| residual.law == law);
        if known.as_ref().is_none_or(|known| size > known.size || size.is_nan()) {
            let here = LawResidual { law, size, allowed, point: self.point.clone() };
            match known {
                None => self.laws.push(here),
                Some(known) => *known = here,
            }
        }
        size <= allowed
    }
}
