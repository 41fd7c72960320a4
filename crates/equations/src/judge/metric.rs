//! The laws of the metric.

use super::at::{At, all_finite};
use crate::ModelError;

/// Checks that the metric can be factored and differentiated, and that it has a geodesic.
pub(super) fn examine(at: At<'_>) -> Result<(), ModelError> {
    let n = at.n();
    let mut slopes = vec![0.0; n * n * n];
    if at.model.metric_slopes(at.x, &mut slopes) && !all_finite(&slopes) {
        return Err(ModelError::DerivativeNotFinite { field: "metric", point: at.point() });
    }
    at.model.check_metric(at.x, true).map_err(|source| at.unusable(source))
}
