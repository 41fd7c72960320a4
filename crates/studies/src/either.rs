//! A retraction and a discrete gradient that are chosen at run time.

use std::fmt;

use metriplectic_fields::{Matrix, Scalar, ScalarField, Vector};
use metriplectic_integrators::{DiscreteGradient, Gonzalez, ItohAbe, MeanValue, SymmetricItohAbe};
use metriplectic_manifolds::retraction::{Nodes, PointPair, StepPath, StepPathJet, Tangent};
use metriplectic_manifolds::{Manifold, MetricError, Retraction, Riemannian};

/// One of two retractions, so that one compiled run serves both. A step is the same, bit for bit, as with the
/// retraction itself.
#[derive(Clone, Copy, Debug)]
pub enum Either<A, B> {
    /// The first.
    First(A),
    /// The second.
    Second(B),
}

/// Calls a method of whichever it is.
macro_rules! of_either {
    ($self:ident.$method:ident($($argument:expr),*)) => {
        match $self {
            Self::First(retraction) => retraction.$method($($argument),*),
            Self::Second(retraction) => retraction.$method($($argument),*),
        }
    };
}

impl<M, G, A, B> Retraction<M, G> for Either<A, B>
where
    M: Manifold,
    G: Riemannian<M>,
    A: Retraction<M, G>,
    B: Retraction<M, G>,
{
    fn step_path<D: Scalar>(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M, D>,
    ) -> Result<StepPath<M, D>, MetricError> {
        of_either!(self.step_path(metric, x, u))
    }

    fn real_step_path(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M>,
    ) -> Result<StepPath<M>, MetricError> {
        of_either!(self.real_step_path(metric, x, u))
    }

    fn end(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M>,
    ) -> Result<M::Point<f64>, MetricError> {
        of_either!(self.end(metric, x, u))
    }

    fn along(&self, metric: &G, x: &M::Point<f64>, u: &Vector<M>) -> Result<Nodes<M>, MetricError> {
        of_either!(self.along(metric, x, u))
    }

    fn lost_digits(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M>,
        end: &M::Point<f64>,
    ) -> Vector<M> {
        of_either!(self.lost_digits(metric, x, u, end))
    }

    fn accuracy(&self, metric: &G) -> f64 {
        of_either!(self.accuracy(metric))
    }

    fn step_path_jet(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M>,
    ) -> Result<StepPathJet<M>, MetricError> {
        of_either!(self.step_path_jet(metric, x, u))
    }

    fn pair(&self, metric: &G, tangent: &Tangent<M>) -> Result<PointPair<M>, MetricError> {
        of_either!(self.pair(metric, tangent))
    }

    fn inverse(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        y: &M::Point<f64>,
    ) -> Result<Tangent<M>, MetricError> {
        of_either!(self.inverse(metric, x, y))
    }
}

/// One of the four discrete gradients, so that one compiled run serves all. It is printed like the gradient
/// itself.
#[derive(Clone, Copy)]
pub enum AnyGradient {
    /// The gradient of Gonzalez.
    Gonzalez,
    /// The mean value of the differential.
    MeanValue,
    /// Difference quotients along the coordinates.
    ItohAbe,
    /// Their mean over both directions.
    SymmetricItohAbe,
}

/// Calls a method of the gradient that it stands for.
macro_rules! of_any {
    ($self:ident.$method:ident($($argument:expr),*)) => {
        match $self {
            Self::Gonzalez => Gonzalez.$method($($argument),*),
            Self::MeanValue => MeanValue.$method($($argument),*),
            Self::ItohAbe => ItohAbe.$method($($argument),*),
            Self::SymmetricItohAbe => SymmetricItohAbe.$method($($argument),*),
        }
    };
}

impl fmt::Debug for AnyGradient {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Gonzalez => Gonzalez.fmt(f),
            Self::MeanValue => MeanValue.fmt(f),
            Self::ItohAbe => ItohAbe.fmt(f),
            Self::SymmetricItohAbe => SymmetricItohAbe.fmt(f),
        }
    }
}

impl DiscreteGradient for AnyGradient {
    fn mean<M: Manifold, D: Scalar>(
        &self,
        f: &impl ScalarField<M>,
        x: &M::Point<f64>,
        path: &StepPath<M, D>,
    ) -> Vector<M, D> {
        of_any!(self.mean(f, x, path))
    }

    fn real_mean<M: Manifold>(
        &self,
        f: &impl ScalarField<M>,
        x: &M::Point<f64>,
        path: &StepPath<M>,
    ) -> Vector<M> {
        of_any!(self.real_mean(f, x, path))
    }

    fn mean_jet<M: Manifold>(
        &self,
        f: &impl ScalarField<M>,
        x: &M::Point<f64>,
        path: &StepPathJet<M>,
    ) -> (Vector<M>, Matrix<M>) {
        of_any!(self.mean_jet(f, x, path))
    }

    fn slope_at_base<M: Manifold>(
        &self,
        f: &impl ScalarField<M>,
        z: &M::Point<f64>,
        d: &Vector<M>,
        mean: &Vector<M>,
    ) -> f64 {
        of_any!(self.slope_at_base(f, z, d, mean))
    }
}
