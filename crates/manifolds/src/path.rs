//! An aim for a logarithm that shooting alone does not find: argmin's L-BFGS minimises the energy of a broken
//! path between the two points.
//!
//! L-BFGS stagnates far above round-off. So Newton's method refines the whole path by multiple shooting, and
//! the caller then refines the one geodesic.

use std::cell::Cell;
use std::marker::PhantomData;

use argmin::core::{CostFunction, Executor, Gradient, State as _};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::LBFGS;
use metriplectic_fields::newton::{self, Cause, Limits, Problem, Progress};
use metriplectic_fields::{
    Column, Dimension, Matrix, MatrixField, MatrixJet, Space, Square, Vector,
};
use nalgebra::{DMatrix, DVector};

use crate::Manifold;
use crate::chart_metric;
use crate::geodesic_jet::{self, GeodesicJet};

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
}

/// A smooth function of a column of numbers.
trait Objective {
    /// Its value; infinite outside the domain.
    fn value(&self, path: &[f64]) -> f64;

    /// Its gradient.
    fn gradient(&self, path: &[f64]) -> Vec<f64>;
}

impl<M: Space, F: MatrixField<M>> PathEnergy<'_, M, F> {
    /// The corner `k`, where the first and the last corner are the ends.
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
        (b - a, chart_metric::metric_jet(self.field, self.x, &((a + b) * 0.5)))
    }
}

impl<M: Space, F: MatrixField<M>> Objective for PathEnergy<'_, M, F> {
    fn value(&self, path: &[f64]) -> f64 {
        let mut energy = 0.0;
        for k in 0..PIECES {
            let (step, g) = self.piece(path, k);
            let square = step.dot(&(g.value * step));
            // Beyond the edge of a chart the metric is not positive, or not a number.
            if !(square >= 0.0 && square.is_finite()) {
                return f64::INFINITY;
            }
            energy += 0.5 * PIECES as f64 * square;
        }
        energy
    }

    fn gradient(&self, path: &[f64]) -> Vec<f64> {
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
        gradient
    }
}

/// An objective for argmin, with its evaluations counted. It has one type, so L-BFGS is compiled once.
struct Counted<'a> {
    objective: &'a dyn Objective,
    evaluations: Cell<u32>,
}

impl Counted<'_> {
    /// Counts an evaluation, and fails at the limit. Without it, a line search through a metric that is not
    /// smooth may not end.
    fn spend(&self) -> Result<(), argmin::core::Error> {
        self.evaluations.set(self.evaluations.get() + 1);
        if self.evaluations.get() <= EVALUATIONS {
            Ok(())
        } else {
            Err(argmin::core::Error::msg("the path is not found in the evaluations allowed"))
        }
    }
}

impl CostFunction for Counted<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, path: &Vec<f64>) -> Result<f64, argmin::core::Error> {
        self.spend().map(|()| self.objective.value(path))
    }
}

impl Gradient for Counted<'_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, path: &Vec<f64>) -> Result<Vec<f64>, argmin::core::Error> {
        self.spend().map(|()| self.objective.gradient(path))
    }
}

/// Minimises an objective by L-BFGS.
fn minimised(objective: &dyn Objective, start: Vec<f64>) -> Option<Vec<f64>> {
    let counted = Counted { objective, evaluations: Cell::new(0) };
    let solver = LBFGS::new(MoreThuenteLineSearch::new(), MEMORY);
    let result = Executor::new(counted, solver)
        .configure(|state| state.param(start).max_iters(ITERATIONS))
        .run()
        .ok()?;
    result.state().get_best_param().cloned()
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
    let path = minimised(&PathEnergy { field, x, end: *end, space: PhantomData }, straight)?;
    let corner = |k: usize| match k {
        0 => x.clone(),
        PIECES => M::chart(x, end),
        _ => M::chart(x, &Vector::<M>::from_index(|i| path[(k - 1) * n + i])),
    };
    let corners: [M::Point<f64>; PIECES + 1] = std::array::from_fn(corner);
    let velocities = std::array::from_fn(|k| M::coordinates(&corners[k], &corners[k + 1]));
    let shooting = MultipleShooting { field, space: PhantomData };
    newton::solve(&shooting, Pieces { corners, velocities }, LIMITS).ok()
}

/// The limits of Newton's method for a path.
const LIMITS: Limits = Limits { iterations: 12, halvings: 0 };

/// The last correction of a path, relative to a piece, that single shooting can take over from.
const CLOSE: f64 = 1e-9;

/// The equations of multiple shooting (Stoer and Bulirsch 2002, §7.3.5): each geodesic ends where the next
/// one starts, with the velocity of the next one. The unknowns are the inner corners `q_k` and the velocities
/// `v_k` of all pieces, so that errors do not grow exponentially along the whole way.
struct MultipleShooting<'a, M, F> {
    field: &'a F,
    space: PhantomData<M>,
}

/// The corners of a path, and the velocities of its pieces.
struct Pieces<M: Space> {
    corners: [M::Point<f64>; PIECES + 1],
    velocities: [Vector<M>; PIECES],
}

impl<M: Manifold, F: MatrixField<M>> MultipleShooting<'_, M, F> {
    /// The Newton correction, with the unknowns in the order v₀, q₁, v₁, q₂, v₂, …
    fn correction(&self, Pieces { corners, velocities }: &Pieces<M>) -> Option<DVector<f64>> {
        let n = M::Dim::LEN;
        let size = (2 * PIECES - 1) * n;
        let (mut jacobian, mut errors) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for k in 0..PIECES {
            let (along_q, along_v) = shots(self.field, &corners[k], &velocities[k])?;
            let (row, next) = (2 * k * n, k + 1);
            let gap = M::coordinates(&along_v.point, &corners[next]);
            let velocity = M::transport(&along_v.point, &corners[next], &along_v.velocity);
            for i in 0..n {
                errors[row + i] = gap[i];
                for j in 0..n {
                    jacobian[(row + i, v_at::<M>(k) + j)] = along_v.dpoint[(i, j)];
                    if k > 0 {
                        jacobian[(row + i, q_at::<M>(k) + j)] = along_q.dpoint[(i, j)];
                    }
                    if next < PIECES {
                        jacobian[(row + n + i, v_at::<M>(k) + j)] = along_v.dvelocity[(i, j)];
                        if k > 0 {
                            jacobian[(row + n + i, q_at::<M>(k) + j)] = along_q.dvelocity[(i, j)];
                        }
                    }
                }
                if next < PIECES {
                    errors[row + n + i] = velocities[next][i] - velocity[i];
                    jacobian[(row + i, q_at::<M>(next) + i)] = -1.0;
                    jacobian[(row + n + i, v_at::<M>(next) + i)] = -1.0;
                }
            }
        }
        jacobian.lu().solve(&errors).filter(|c| c.iter().all(|c| c.is_finite()))
    }
}

/// The first row of the unknown `v_k`.
fn v_at<M: Space>(k: usize) -> usize {
    2 * k * M::Dim::LEN
}

/// The first row of the unknown `q_k`.
fn q_at<M: Space>(k: usize) -> usize {
    (2 * k - 1) * M::Dim::LEN
}

impl<M: Manifold> Pieces<M> {
    /// The path after a Newton correction.
    fn corrected(&self, correction: &DVector<f64>) -> Self {
        let (mut corners, mut velocities) = (self.corners.clone(), self.velocities);
        for k in 0..PIECES {
            velocities[k] += Vector::<M>::from_index(|i| correction[v_at::<M>(k) + i]);
            if k > 0 {
                let q = Vector::<M>::from_index(|i| correction[q_at::<M>(k) + i]);
                let moved = M::chart(&corners[k], &q);
                velocities[k] = M::transport(&corners[k], &moved, &velocities[k]);
                corners[k] = moved;
            }
        }
        Self { corners, velocities }
    }

    /// The initial velocity of the whole path.
    fn velocity(&self) -> Vector<M> {
        self.velocities[0] * PIECES as f64
    }
}

impl<M: Manifold, F: MatrixField<M>> Problem for MultipleShooting<'_, M, F> {
    type Iterate = Pieces<M>;
    type Correction = Pieces<M>;
    type Root = Vector<M>;
    type Error = Unsolved;

    fn correct(&self, here: &Pieces<M>) -> Result<Progress<Vector<M>, Pieces<M>>, Unsolved> {
        let correction = self.correction(here).ok_or(Unsolved)?;
        let next = here.corrected(&correction);
        let close = correction.norm() <= CLOSE * next.velocities[0].magnitude();
        Ok(if close { Progress::Root(next.velocity()) } else { Progress::Correction(next, 1.0) })
    }

    fn advance(&self, _: &Pieces<M>, next: &Pieces<M>, _: f64) -> Option<Pieces<M>> {
        Some(Pieces { corners: next.corners.clone(), velocities: next.velocities })
    }

    fn stop(&self, last: Pieces<M>, _: Cause, _: usize) -> Result<Vector<M>, Unsolved> {
        // Single shooting decides whether the aim is good.
        Ok(last.velocity())
    }
}

/// Multiple shooting meets a singular system, or a geodesic that ends early.
struct Unsolved;

/// A geodesic with its derivatives along its start and along its velocity.
fn shots<M: Manifold>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    v: &Vector<M>,
) -> Option<(GeodesicJet<M>, GeodesicJet<M>)> {
    let (zero, one) = (Matrix::<M>::zeros(), Matrix::<M>::one());
    let shot = |dpoint, dvelocity| {
        let start = GeodesicJet { point: x.clone(), velocity: *v, dpoint, dvelocity };
        geodesic_jet::follow(field, &start).ok()
    };
    Some((shot(one, zero)?, shot(zero, one)?))
}
