//! The checks that find errors of metrics and geodesics.

pub use metriplectic_equations::MetricError;

use metriplectic_fields::{ChartPoint, Column, Scalar, Space, Square};

/// Returns the error of a geodesic that stops at `time`, if the matrix `g` there is the cause.
pub(crate) fn stopped<D: Scalar>(time: f64, g: &impl Square<D>) -> Option<MetricError> {
    let not_positive = g.cholesky().err()?;
    let edge = !not_positive.pivot.is_finite();
    Some(if edge {
        MetricError::Edge { time }
    } else {
        MetricError::Degenerate { time, not_positive }
    })
}

/// Converts the times of an error on a part of a geodesic, from `start` with the length `fraction`.
pub(crate) fn on_part(error: MetricError, start: f64, fraction: f64) -> MetricError {
    let whole = |time| start + fraction * time;
    match error {
        MetricError::Edge { time } => MetricError::Edge { time: whole(time) },
        MetricError::Degenerate { time, not_positive } => {
            MetricError::Degenerate { time: whole(time), not_positive }
        }
        MetricError::Uneven { time, pieces } => MetricError::Uneven { time: whole(time), pieces },
        other => other,
    }
}

/// Makes the error of a point at the edge of its chart.
#[cold]
pub fn out_of_chart<M: Space, D: Scalar>(x: &ChartPoint<M, D>) -> MetricError {
    MetricError::OutOfChart { distance: x.q.magnitude() }
}

/// Refuses a geodesic that reaches the injectivity `radius`, up to the rounding of its length.
#[inline]
pub(crate) fn within(radius: f64, length: f64) -> Result<(), MetricError> {
    if length < radius - 4.0 * f64::EPSILON { Ok(()) } else { Err(beyond(radius, length)) }
}

/// Makes the error of a length that is too large, or NaN.
#[cold]
fn beyond(radius: f64, length: f64) -> MetricError {
    if length.is_nan() {
        MetricError::NotFinite { quantity: "the length of the geodesic", value: length }
    } else {
        MetricError::CutLocus { length, radius }
    }
}

/// Refuses a number that is not finite.
#[inline]
pub(crate) fn finite<D: Scalar>(quantity: &'static str, number: D) -> Result<D, MetricError> {
    let value = number.re();
    if value.is_finite() { Ok(number) } else { Err(MetricError::NotFinite { quantity, value }) }
}

/// Refuses a column with a component that is not finite.
#[inline]
pub(crate) fn finite_column<D: Scalar, V: Column<D>>(
    quantity: &'static str,
    v: V,
) -> Result<V, MetricError> {
    for i in 0..V::LEN {
        finite(quantity, v[i])?;
    }
    Ok(v)
}
