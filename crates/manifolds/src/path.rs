//! Brings a lost logarithm back: the energy of a broken path between two points is minimised by
//! argmin's L-BFGS.
//!
//! It stalls far above round-off, so Newton's method polishes: first for the whole path, by multiple
//! shooting, then for the one geodesic.

use std::cell::Cell;
use std::marker::PhantomData;

use argmin::core::{CostFunction, Executor, Gradient, State as _};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::LBFGS;
use metriplectic_fields::{
    Column, Dimension, Matrix, MatrixField, MatrixJet, Space, Square, Vector,
};
use nalgebra::{DMatrix, DVector};

use crate::Manifold;
use crate::geodesic::{self, GeodesicJet};

/// Pieces of the path.
const PIECES: usize = 24;
/// Iterations that the relaxation may take.
const ITERATIONS: u64 = 200;
/// Evaluations of its energy or of the gradient, at most.
const EVALUATIONS: u32 = 2000;
/// Pairs of differences that L-BFGS remembers.
const MEMORY: usize = 7;

/// `½ m Σ Δᵀ g(middle) Δ` over the pieces of a path from `q = 0` to `end` in the chart at `x`, with
/// the inner corners as one column.
struct PathEnergy<'a, M: Space, F> {
    field: &'a F,
    x: &'a M::Point<f64>,
    end: Vector<M>,
    space: PhantomData<M>,
    evaluations: Cell<u32>,
}

impl<M: Space, F: MatrixField<M>> PathEnergy<'_, M, F> {
    /// Notes an evaluation, as long as there may be more: a line search through a metric that is not
    /// smooth has no end of its own.
    fn spend(&self) -> Result<(), argmin::core::Error> {
        self.evaluations.set(self.evaluations.get() + 1);
        if self.evaluations.get() <= EVALUATIONS {
            Ok(())
        } else {
            Err(argmin::core::Error::msg("the path is not found in the evaluations allowed"))
        }
    }

    /// The corner `k`, the ends among them.
    fn corner(&self, path: &[f64], k: usize) -> Vector<M> {
        match k {
            0 => Vector::<M>::zero(),
            PIECES => self.end,
            _ => Vector::<M>::from_index(|i| path[(k - 1) * M::Dim::LEN + i]),
        }
    }

    /// A piece, and the metric with its derivatives in its middle.
    fn piece(&self, path: &[f64], k: usize) -> (Vector<M>, MatrixJet<M>) {
        let (a, b) = (self.corner(path, k), self.corner(path, k + 1));
        (b - a, geodesic::metric_jet(self.field, self.x, &((a + b) * 0.5)))
    }
}

impl<M: Space, F: MatrixField<M>> CostFunction for PathEnergy<'_, M, F> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, path: &Vec<f64>) -> Result<f64, argmin::core::Error> {
        self.spend()?;
        let mut energy = 0.0;
        for k in 0..PIECES {
            let (step, g) = self.piece(path, k);
            let square = step.dot(&(g.value * step));
            // Beyond the edge of a chart the metric is not positive, or not a number.
            if !(square >= 0.0 && square.is_finite()) {
                return Ok(f64::INFINITY);
            }
            energy += 0.5 * PIECES as f64 * square;
        }
        Ok(energy)
    }
}

impl<M: Space, F: MatrixField<M>> Gradient for PathEnergy<'_, M, F> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, path: &Vec<f64>) -> Result<Vec<f64>, argmin::core::Error> {
        self.spend()?;
        let n = M::Dim::LEN;
        let mut gradient = vec![0.0; path.len()];
        for k in 0..PIECES {
            let (step, g) = self.piece(path, k);
            let pull = g.value * step * PIECES as f64;
            let bend =
                Vector::<M>::from_index(|i| 0.25 * PIECES as f64 * step.dot(&(g.slopes[i] * step)));
            for i in 0..n {
                if k > 0 {
                    gradient[(k - 1) * n + i] += bend[i] - pull[i];
                }
                if k + 1 < PIECES {
                    gradient[k * n + i] += bend[i] + pull[i];
                }
            }
        }
        Ok(gradient)
    }
}

/// The initial velocity of a geodesic from `x` to the point with coordinates `end`, if a short path
/// between them is found and straightened.
pub(crate) fn aim<M: Manifold>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    end: &Vector<M>,
) -> Option<Vector<M>> {
    let n = M::Dim::LEN;
    let straight = (0..(PIECES - 1) * n)
        .map(|entry| end[entry % n] * (entry / n + 1) as f64 / PIECES as f64)
        .collect();
    let evaluations = Cell::new(0);
    let energy = PathEnergy { field, x, end: *end, space: PhantomData, evaluations };
    let solver = LBFGS::new(MoreThuenteLineSearch::new(), MEMORY);
    let result = Executor::new(energy, solver)
        .configure(|state| state.param(straight).max_iters(ITERATIONS))
        .run()
        .ok()?;
    let path = result.state().get_best_param()?;
    let corner = |k: usize| match k {
        0 => x.clone(),
        PIECES => M::chart(x, end),
        _ => M::chart(x, &Vector::<M>::from_index(|i| path[(k - 1) * n + i])),
    };
    straightened(field, &std::array::from_fn(corner))
}

/// Corrections of a path by multiple shooting, at most.
const CORRECTIONS: usize = 12;

/// Multiple shooting (Stoer and Bulirsch 2002, §7.3.5): Newton's method for the inner corners `q_k` and
/// the velocities `v_k` of all pieces at once, so that each geodesic ends where the next one starts,
/// with the velocity of the next one. It does not suffer from the exponential growth of errors along
/// the whole way.
fn straightened<M: Manifold>(
    field: &impl MatrixField<M>,
    corners: &[M::Point<f64>; PIECES + 1],
) -> Option<Vector<M>> {
    let n = M::Dim::LEN;
    let mut corners = corners.clone();
    let mut velocities: [Vector<M>; PIECES] =
        std::array::from_fn(|k| M::coordinates(&corners[k], &corners[k + 1]));
    // The unknowns in the order v₀, q₁, v₁, q₂, v₂, …
    let (v_at, q_at) = (|k: usize| 2 * k * n, |k: usize| (2 * k - 1) * n);
    for _ in 0..CORRECTIONS {
        let size = (2 * PIECES - 1) * n;
        let (mut jacobian, mut off) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for k in 0..PIECES {
            let (along_q, along_v) = shots(field, &corners[k], &velocities[k])?;
            let (row, next) = (2 * k * n, k + 1);
            let gap = M::coordinates(&along_v.point, &corners[next]);
            let velocity = M::transport(&along_v.point, &corners[next], &along_v.velocity);
            for i in 0..n {
                off[row + i] = gap[i];
                for j in 0..n {
                    jacobian[(row + i, v_at(k) + j)] = along_v.dpoint[(i, j)];
                    if k > 0 {
                        jacobian[(row + i, q_at(k) + j)] = along_q.dpoint[(i, j)];
                    }
                    if next < PIECES {
                        jacobian[(row + n + i, v_at(k) + j)] = along_v.dvelocity[(i, j)];
                        if k > 0 {
                            jacobian[(row + n + i, q_at(k) + j)] = along_q.dvelocity[(i, j)];
                        }
                    }
                }
                if next < PIECES {
                    off[row + n + i] = velocities[next][i] - velocity[i];
                    jacobian[(row + i, q_at(next) + i)] = -1.0;
                    jacobian[(row + n + i, v_at(next) + i)] = -1.0;
                }
            }
        }
        let correction = jacobian.lu().solve(&off).filter(|c| c.iter().all(|c| c.is_finite()))?;
        for k in 0..PIECES {
            velocities[k] += Vector::<M>::from_index(|i| correction[v_at(k) + i]);
            if k > 0 {
                let q = Vector::<M>::from_index(|i| correction[q_at(k) + i]);
                let moved = M::chart(&corners[k], &q);
                velocities[k] = M::transport(&corners[k], &moved, &velocities[k]);
                corners[k] = moved;
            }
        }
        if correction.norm() <= CLOSE * velocities[0].magnitude() {
            break;
        }
    }
    Some(velocities[0] * PIECES as f64)
}

/// The last correction of a path, relative to a piece, that single shooting can take over from.
const CLOSE: f64 = 1e-9;

/// A geodesic with its derivatives along its start and along its velocity.
fn shots<M: Manifold>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    v: &Vector<M>,
) -> Option<(GeodesicJet<M>, GeodesicJet<M>)> {
    let (zero, one) = (Matrix::<M>::zeros(), Matrix::<M>::one());
    let shot = |dpoint, dvelocity| {
        let start = GeodesicJet { point: x.clone(), velocity: *v, dpoint, dvelocity };
        geodesic::follow_jet(field, &start).ok()
    };
    Some((shot(one, zero)?, shot(zero, one)?))
}
