//! The right-hand side of an equation of motion.

use metriplectic_fields::{ChartPoint, Scalar, Vector};
use metriplectic_manifolds::{Manifold, MetricError};

/// A vector field on the manifold `M`, at every scalar. Every [`Metriplectic`](crate::Metriplectic)
/// system has one, `Π dH + K dS`.
pub trait VectorField<M: Manifold> {
    /// Evaluates the velocity `Π dH + K dS` by its definition. `K` annihilates the further invariants.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the metric cannot be used at `x`.
    fn velocity<D: Scalar>(&self, x: &ChartPoint<M, D>) -> Result<Vector<M, D>, MetricError>;
}
