//! The laws of the metric.

use super::at::{At, all_finite};
use crate::{MetricError, ModelError};

/// Checks that the metric can be factored and differentiated, that it has a geodesic, and is the canonical one if the model says so.
pub(super) fn examine(at: At<'_>) -> Result<(), ModelError> {
    let n = at.n();
    let mut slopes = vec![0.0; n * n * n];
    if at.model.metric_slopes(at.x, &mut slopes) && !all_finite(&slopes) {
        return Err(ModelError::DerivativeNotFinite { field: "metric", point: at.point() });
    }
    if at.model.has_canonical_metric() {
        let mut g = vec![0.0; n * n];
        at.model.metric(at.x, &vec![0.0; n], &mut g);
        let off = |k: usize| g[k] - if k.is_multiple_of(n + 1) { 1.0 } else { 0.0 };
        if let Some(k) = (0..n * n).find(|&k| off(k).abs() > 0.0 || off(k).is_nan()) {
            let source = MetricError::NotCanonical { row: k / n, column: k % n, value: g[k] };
            return Err(at.unusable(source));
        }
    }
    at.model.check_metric(at.x, true).map_err(|source| at.unusable(source))
}
