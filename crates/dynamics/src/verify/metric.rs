//! The laws of the metric.

use metriplectic_fields::{ChartPoint, Column, Square, Vector};
use metriplectic_manifolds::{Manifold, Riemannian};

use super::place::unusable;
use crate::metriplectic::{Metriplectic, Point};
use crate::model_error::ModelError;

/// Checks that the metric can be factored and differentiated, and that it has a geodesic.
pub(super) fn examine<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Point<Y>,
) -> Result<(), ModelError> {
    let metric = system.metric();
    if let Some(slopes) = metric.slopes(x)
        && !slopes.as_ref().iter().all(|slope| slope.max_abs().is_finite())
    {
        let point = Y::Manifold::entries(x);
        return Err(ModelError::DerivativeNotFinite { field: "metric", point });
    }
    let centre = ChartPoint::<Y::Manifold>::centre(x);
    let at = metric.at(&centre).and_then(|_| metric.exp(&centre, &Vector::<Y::Manifold>::zero()));
    at.map(|_| ()).map_err(unusable::<Y::Manifold>(x))
}
