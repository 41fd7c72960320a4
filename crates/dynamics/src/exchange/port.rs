//! Ports: velocities that do work.

use std::fmt;
use std::sync::Arc;

use metriplectic_fields::{ChartPoint, Real, Vector, Velocity};
use metriplectic_manifolds::{Manifold, MetricError, out_of_chart};

use super::components;

/// A velocity `F(t, x)` that does work on a system and carries no entropy: a motor, a control torque, a field.
///
/// The closure `|t, x| -> F` returns a velocity as in [`Space::embed`](metriplectic_fields::Space::embed): components on
/// a vector space, entries of `x'` on a sphere, the body angular velocity on SO(3).
#[derive(Clone)]
pub struct Port<F> {
    pub(super) name: Arc<str>,
    pub(super) velocity: F,
}

impl<F> Port<F> {
    /// The port with this name.
    pub fn new(name: impl Into<Arc<str>>, velocity: F) -> Self {
        Self { name: name.into(), velocity }
    }

    /// The velocity in the frame of the chart at `x`.
    pub(super) fn at<M: Manifold>(
        &self,
        t: f64,
        x: &ChartPoint<M, Real>,
    ) -> Result<Vector<M, Real>, MetricError>
    where
        F: Fn(Real, &M::Point<Real>) -> Velocity<M, Real>,
    {
        let velocity = (self.velocity)(Real::from(t), &x.point());
        components(x, &velocity).ok_or_else(|| out_of_chart(x))
    }
}

// By hand, because closures have no `Debug`.
impl<F> fmt::Debug for Port<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Port").field("name", &self.name).finish_non_exhaustive()
    }
}
