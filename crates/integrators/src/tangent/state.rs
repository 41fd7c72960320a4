//! A state of a run with its derivatives.

use std::fmt;

use metriplectic_dynamics::system::Point;
use metriplectic_dynamics::{Differentiable, Metriplectic};
use metriplectic_fields::{ChartPoint, Column as _, Dimension as _, Space, Vector};
use nalgebra::{DMatrix, DVector};

use super::columns::Columns;
use crate::step::Dim;

/// A state of a run with its derivatives along the start and along the parameters.
pub struct TangentState<D: Differentiable> {
    /// The steps before it.
    pub step: usize,
    /// The time.
    pub time: f64,
    /// The point.
    pub point: Point<D>,
    pub(super) columns: Columns<D::Wide>,
    pub(super) names: Vec<&'static str>,
}

impl<D: Differentiable> Clone for TangentState<D> {
    fn clone(&self) -> Self {
        let Self { step, time, point, columns, names } = self;
        let (point, columns, names) = (point.clone(), columns.clone(), names.clone());
        Self { step: *step, time: *time, point, columns, names }
    }
}

impl<D: Differentiable> fmt::Debug for TangentState<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TangentState")
            .field("time", &self.time)
            .field("point", &self.point)
            .field("along_start", &self.along_start())
            .field("along_parameters", &self.along_parameters())
            .finish()
    }
}

impl<D: Differentiable> TangentState<D> {
    /// The matrix `∂x/∂x₀`, `n × n`, from the frame of the chart at the start to that at this point.
    pub fn along_start(&self) -> DMatrix<f64> {
        let n = Dim::<D>::LEN;
        DMatrix::from_fn(n, n, |i, j| self.columns.t[(i, j)])
    }

    /// The matrix `∂x/∂θ`, `n × P`, in the frame of the chart at this point; in units of the state over those of the parameters.
    pub fn along_parameters(&self) -> DMatrix<f64> {
        let (n, all) = (Dim::<D>::LEN, Dim::<D::Wide>::LEN);
        DMatrix::from_fn(n, all - n, |i, j| self.columns.t[(i, n + j)])
    }

    /// The column of `∂x/∂θ` of a parameter; `None` if there is none of this name.
    pub fn along(&self, parameter: &str) -> Option<DVector<f64>> {
        let k = self.names.iter().position(|name| *name == parameter)?;
        let n = Dim::<D>::LEN;
        Some(DVector::from_fn(n, |i, _| self.columns.t[(i, n + k)]))
    }

    /// The matrix `∂x/∂(x₀, θ)`, `n × (n + P)`.
    pub fn matrix(&self) -> DMatrix<f64> {
        let (n, all) = (Dim::<D>::LEN, Dim::<D::Wide>::LEN);
        DMatrix::from_fn(n, all, |i, j| self.columns.t[(i, j)])
    }

    /// The matrix `∂x/∂(x₀, θ)` with the [velocities](Space::embed) of the space as rows: entries of a tangent vector of a sphere, a body
    /// angular velocity. Its columns are those of [`matrix`](Self::matrix).
    pub fn embedded(&self) -> DMatrix<f64> {
        let all = Dim::<D::Wide>::LEN;
        let rows = <<D::Manifold as Space>::Velocity as metriplectic_fields::Dimension>::LEN;
        let centre = ChartPoint::<D::Manifold>::centre(&self.point);
        let mut embedded = DMatrix::zeros(rows, all);
        for j in 0..all {
            let column = Vector::<D::Manifold>::from_index(|i| self.columns.t[(i, j)]);
            let velocity = <D as Metriplectic>::Manifold::embed(&centre, &column);
            for i in 0..rows {
                embedded[(i, j)] = velocity[i];
            }
        }
        embedded
    }

    /// The derivative of a function `f` of the state along start and parameters, `df T`.
    pub fn derivative_of(&self, df: &Vector<D::Manifold>) -> DVector<f64> {
        let (n, all) = (Dim::<D>::LEN, Dim::<D::Wide>::LEN);
        DVector::from_fn(all, |j, _| {
            (0..n).fold(0.0, |sum, i| sum + df[i] * self.columns.t[(i, j)])
        })
    }
}
