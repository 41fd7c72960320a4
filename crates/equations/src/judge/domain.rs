//! The domain of a model: the states at which its parts have values.

use super::at::{At, all_finite, dot, max_abs, name};
use super::table::{Row, Table, zeros};
use crate::{Covectors, ENERGY, ENTROPY, ModelError, Part};

/// Finds a field whose value at a state is not a finite number.
pub(crate) fn value_not_finite(at: At<'_>) -> Option<ModelError> {
    let (model, n) = (at.model, at.n());
    let [(_, energy), (_, entropy)] = [ENERGY, ENTROPY].map(|law| at.jet(law));
    let w = Covectors { energy: &energy, entropy: &entropy };
    let mut metric = Table::zeros(n);
    model.metric(at.x, &zeros(n), metric.entries_mut());
    // If the metric cannot be used, it is reported, and not a part without a value.
    let of_tensor = |part| at.tensor(part, w).map_or(0.0, |tensor| tensor.max_abs());
    let of_force = || at.apply(Part::Gyroscopic, w, &energy).map_or(0.0, |force| max_abs(&force));
    // If a derivative of the energy is not finite, it is reported, and not what acts on it.
    let is_finite = all_finite(&energy);
    let acting = |value: &dyn Fn() -> f64| if is_finite { value() } else { 0.0 };
    let values = [
        ("energy", at.value(ENERGY)),
        ("entropy", at.value(ENTROPY)),
        ("metric", metric.max_abs()),
        ("bracket", of_tensor(Part::Reversible)),
        ("force", acting(&of_force)),
        ("dissipation", acting(&|| of_tensor(Part::Irreversible))),
    ];
    let (field, value) = values.into_iter().find(|(_, value)| !value.is_finite())?;
    Some(ModelError::ValueNotFinite { field, value, point: at.point() })
}

/// Checks that the terms of a field at the start are zero, or that their last digits do not underflow. A term is
/// zero if one of its factors is.
pub(super) fn has_digits(at: At<'_>, law: usize) -> Result<(), ModelError> {
    let ((value, df), scales) = (at.jet(law), at.scales());
    let slopes: Row = df.iter().map(|slope| slope.abs()).collect();
    let size = value.abs() + dot(&slopes, &scales);
    // A product may be zero by underflow alone: ½q² and its term q·q at q = 10⁻²⁰⁰.
    let mut lost = df.iter().zip(&scales).map(|(&slope, &scale)| slope != 0.0 && scale > 0.0);
    let underflows = if size > 0.0 {
        size * f64::EPSILON < f64::MIN_POSITIVE
    } else {
        size <= 0.0 && lost.any(|is_lost| is_lost)
    };
    if underflows {
        return Err(ModelError::Underflow { field: name(law), size, point: at.point() });
    }
    Ok(())
}
