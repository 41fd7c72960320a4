//! A point at which laws are checked.

use metriplectic_fields::{Jet2, ScalarField, Vector};
use metriplectic_manifolds::{Manifold, MetricError};

use crate::metriplectic::{Metriplectic, Point};
use crate::model_error::ModelError;

/// A point at which laws are judged, with the differentials of the two fields there.
pub(super) struct Place<'a, Y: Metriplectic + ?Sized> {
    pub(super) system: &'a Y,
    pub(super) x: &'a Point<Y>,
    /// The sizes of the coordinates.
    pub(super) units: &'a Vector<Y::Manifold>,
    pub(super) energy: Jet2<Y::Manifold>,
    pub(super) entropy: Jet2<Y::Manifold>,
}

impl<'a, Y: Metriplectic + ?Sized> Place<'a, Y> {
    /// The point and the sizes of its coordinates.
    pub(super) const fn at(&self) -> At<'a, Y> {
        At { system: self.system, x: self.x, units: self.units }
    }
}

/// A point and the sizes of its coordinates.
pub(super) struct At<'a, Y: Metriplectic + ?Sized> {
    pub(super) system: &'a Y,
    pub(super) x: &'a Point<Y>,
    pub(super) units: &'a Vector<Y::Manifold>,
}

/// Converts the error of a metric that cannot be used at `x`.
pub(super) fn unusable<M: Manifold>(x: &M::Point<f64>) -> impl Fn(MetricError) -> ModelError + '_ {
    |source| ModelError::Metric { source, point: M::entries(x) }
}

/// Evaluates value, differential and Hessian, which must be finite.
pub(super) fn jet<M: Manifold>(
    f: &impl ScalarField<M>,
    field: &'static str,
    x: &M::Point<f64>,
) -> Result<Jet2<M>, ModelError> {
    let jet = f.jet2(x);
    if jet.is_finite() {
        Ok(jet)
    } else {
        Err(ModelError::DerivativeNotFinite { field, point: M::entries(x) })
    }
}
