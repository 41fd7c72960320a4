//! The domain of a model: the points at which its parts have values.

use metriplectic_fields::{ChartPoint, Column, Dimension as _, ScalarField, Square};
use metriplectic_manifolds::{Manifold, Riemannian};

use crate::bracket::Bracket;
use crate::dissipation::Dissipation;
use crate::metriplectic::{Metriplectic, Point};
use crate::model_error::ModelError;

/// Finds a field whose value at `x` is not a finite number.
pub(crate) fn value_not_finite<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Point<Y>,
) -> Option<ModelError> {
    let at = ChartPoint::<Y::Manifold>::centre(x);
    let ds = system.entropy().jet1(x).df;
    let g = system.metric_at(&at);
    let bracket = system.bracket().tensor(&system.bracket_args(&g, &ds));
    let dh = system.energy().jet1(x).df;
    let force = system.bracket().force(&system.bracket_args(&g, &ds), &dh);
    let dissipation = system.dissipation().tensor(&g, &dh);
    let values = [
        ("energy", system.energy().at::<f64>(x)),
        ("entropy", system.entropy().at::<f64>(x)),
        ("metric", system.metric().matrix(&at).max_abs()),
        // If the metric cannot be used, it is reported, and not a bracket without a value.
        ("bracket", bracket.map_or(0.0, |tensor| tensor.max_abs())),
        // If a derivative of the energy is not finite, it is reported, and not the force.
        ("force", force.map_or(0.0, |f| if dh.is_finite() { f.magnitude() } else { 0.0 })),
        (
            "dissipation",
            dissipation.map_or(0.0, |k| if dh.is_finite() { k.max_abs() } else { 0.0 }),
        ),
    ];
    let (field, value) = values.into_iter().find(|(_, value)| !value.is_finite())?;
    Some(ModelError::ValueNotFinite { field, value, point: Y::Manifold::entries(x) })
}

/// Checks that the terms of a field at the start are zero, or that their last digits do not underflow. A term is
/// zero if one of its factors is.
pub(super) fn has_digits<M: Manifold>(
    f: &impl ScalarField<M>,
    field: &'static str,
    x0: &M::Point<f64>,
) -> Result<(), ModelError> {
    let jet = f.jet1(x0);
    let scales = M::scales(x0);
    let size = jet.value.abs() + jet.df.abs().dot(&scales);
    // A product may be zero by underflow alone: ½q² and its term q·q at q = 10⁻²⁰⁰.
    let is_lost = |i| jet.df[i] != 0.0 && scales[i] > 0.0;
    let underflows = if size > 0.0 {
        size * f64::EPSILON < f64::MIN_POSITIVE
    } else {
        size <= 0.0 && (0..M::Dim::LEN).any(is_lost)
    };
    if underflows {
        return Err(ModelError::Underflow { field, size, point: M::entries(x0) });
    }
    Ok(())
}
