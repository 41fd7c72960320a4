//! A state of a run with its derivatives.

use std::fmt;
use std::ops::Index;

use metriplectic_dynamics::{Differentiable, Metriplectic};
use metriplectic_fields::{
    ChartPoint, Column as _, Dimension as _, Matrix, Space, Square as _, Vector,
};
use nalgebra::{DMatrix, DVector};

use super::columns::Carried;
use crate::step::{Dim, Element, Flow};

/// A state of a run with its derivatives along the start and along the parameters.
pub struct TangentState<F: Flow> {
    /// The steps before it.
    pub step: usize,
    /// The time.
    pub time: f64,
    /// The point.
    pub point: Element<F>,
    pub(super) carried: Carried,
    pub(super) names: Vec<&'static str>,
}

impl<F: Flow> Clone for TangentState<F> {
    fn clone(&self) -> Self {
        let Self { step, time, point, carried, names } = self;
        let (point, carried, names) = (point.clone(), carried.clone(), names.clone());
        Self { step: *step, time: *time, point, carried, names }
    }
}

impl<F: Flow> fmt::Debug for TangentState<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TangentState")
            .field("time", &self.time)
            .field("point", &self.point)
            .field("along_start", &self.along_start())
            .field("along_parameters", &self.along_parameters())
            .finish()
    }
}

impl<F: Flow> TangentState<F> {
    /// The numbers of directions of a state, and of all with those of the parameters.
    pub(super) fn lengths(&self) -> [usize; 2] {
        let all = self.carried.t.nrows();
        [all - self.names.len(), all]
    }

    /// The matrix `∂x/∂x₀`, `n × n`, from the frame of the chart at the start to that at this point.
    pub fn along_start(&self) -> DMatrix<f64> {
        let [n, _] = self.lengths();
        self.carried.t.view((0, 0), (n, n)).into_owned()
    }

    /// The matrix `∂x/∂θ`, `n × P`, in the frame of the chart at this point; in units of the state over those of the parameters.
    pub fn along_parameters(&self) -> DMatrix<f64> {
        let [n, all] = self.lengths();
        self.carried.t.view((0, n), (n, all - n)).into_owned()
    }

    /// The column of `∂x/∂θ` of a parameter; `None` if there is none of this name.
    pub fn along(&self, parameter: &str) -> Option<DVector<f64>> {
        let k = self.names.iter().position(|name| *name == parameter)?;
        let [n, _] = self.lengths();
        Some(self.carried.t.view((0, n + k), (n, 1)).column(0).into_owned())
    }

    /// The matrix `∂x/∂(x₀, θ)`, `n × (n + P)`.
    pub fn matrix(&self) -> DMatrix<f64> {
        let [n, all] = self.lengths();
        self.carried.t.view((0, 0), (n, all)).into_owned()
    }

    /// The derivative of a function `f` of the state along start and parameters, `df T`, from its differential in the frame of the chart
    /// at this point, with an entry for each row of [`matrix`](Self::matrix): of an open system for clock and ledger too.
    pub fn derivative_of(&self, df: &impl Index<usize, Output = f64>) -> DVector<f64> {
        let [n, all] = self.lengths();
        DVector::from_fn(all, |j, _| {
            (0..n).fold(0.0, |sum, i| sum + df[i] * self.carried.t[(i, j)])
        })
    }
}

impl<Y: Metriplectic> TangentState<Y> {
    /// The matrix `∂x/∂x₀` of [`along_start`](Self::along_start), of the size that the compiler knows.
    pub fn derivative(&self) -> Matrix<Y::Manifold> {
        Matrix::<Y::Manifold>::from_entries(|i, j| self.carried.t[(i, j)])
    }

    /// The column of `∂x/∂θ` of a parameter, [`along`](Self::along), of the size that the compiler knows.
    pub fn derivative_along(&self, parameter: &str) -> Option<Vector<Y::Manifold>> {
        let column = self.along(parameter)?;
        Some(Vector::<Y::Manifold>::from_index(|i| column[i]))
    }
}

impl<D: Differentiable> TangentState<D> {
    /// The matrix `∂x/∂(x₀, θ)` with the [velocities](Space::embed) of the space as rows: entries of a tangent vector of a sphere, a body
    /// angular velocity. Its columns are those of [`matrix`](Self::matrix).
    pub fn embedded(&self) -> DMatrix<f64> {
        let all = Dim::<D::Wide>::LEN;
        let rows = <<D::Manifold as Space>::Velocity as metriplectic_fields::Dimension>::LEN;
        let centre = ChartPoint::<D::Manifold>::centre(&self.point);
        let mut embedded = DMatrix::zeros(rows, all);
        for j in 0..all {
            let column = Vector::<D::Manifold>::from_index(|i| self.carried.t[(i, j)]);
            let velocity = <D as Metriplectic>::Manifold::embed(&centre, &column);
            for i in 0..rows {
                embedded[(i, j)] = velocity[i];
            }
        }
        embedded
    }
}
