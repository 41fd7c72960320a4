//! Finds a better guess where Newton's method fails: argmin's L-BFGS minimises `½|F(u)|²`.
//!
//! It stalls far above round-off and costs many evaluations, so it only delivers a better guess;
//! Newton's method polishes.

use std::cell::{Cell, RefCell};

use argmin::core::{CostFunction, Executor, Gradient};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::LBFGS;
use metriplectic_fields::{Column, Space, Square, Vector};

use crate::newton::Equation;

/// Iterations that a globaliser may take.
const ITERATIONS: u64 = 100;
/// Evaluations that it may take: a line search through a residual that is not smooth may never end.
const EVALUATIONS: u32 = 1000;
/// Pairs of differences that L-BFGS remembers.
const MEMORY: usize = 7;

/// The least squares at one point.
struct Squares {
    /// `|F(u)|`.
    residual: f64,
    /// `½|F(u)|²`.
    cost: f64,
    /// Its gradient `Jᵀ F`.
    gradient: Vec<f64>,
}

/// `u ↦ ½|F(u)|²`. The equation is behind a pointer, so that the minimisation is compiled once and not for
/// every system.
struct LeastSquares<'a> {
    squares: &'a dyn Fn(&[f64]) -> Option<Squares>,
    evaluations: Cell<u32>,
    /// The least `|F(u)|` so far, and where.
    best: &'a RefCell<(f64, Vec<f64>)>,
}

impl LeastSquares<'_> {
    /// The squares at `u`, as long as there may be more evaluations.
    fn at(&self, u: &[f64]) -> Result<Option<Squares>, argmin::core::Error> {
        self.evaluations.set(self.evaluations.get() + 1);
        if self.evaluations.get() > EVALUATIONS {
            return Err(argmin::core::Error::msg("no root is found in the evaluations allowed"));
        }
        let at = (self.squares)(u);
        if let Some(at) = &at
            && at.residual < self.best.borrow().0
        {
            *self.best.borrow_mut() = (at.residual, u.to_vec());
        }
        Ok(at)
    }
}

impl CostFunction for LeastSquares<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, u: &Vec<f64>) -> Result<f64, argmin::core::Error> {
        Ok(self.at(u)?.map_or(f64::INFINITY, |at| at.cost))
    }
}

impl Gradient for LeastSquares<'_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, u: &Vec<f64>) -> Result<Vec<f64>, argmin::core::Error> {
        let at = self.at(u)?;
        let at =
            at.ok_or_else(|| argmin::core::Error::msg("outside the domain of the equation"))?;
        Ok(at.gradient)
    }
}

/// Where the residual is smaller than at `start`, if such a point is found.
fn minimise(squares: &dyn Fn(&[f64]) -> Option<Squares>, start: Vec<f64>) -> Option<Vec<f64>> {
    let before = squares(&start)?.residual;
    let best = RefCell::new((before, start.clone()));
    let problem = LeastSquares { squares, evaluations: Cell::new(0), best: &best };
    let solver = LBFGS::new(MoreThuenteLineSearch::new(), MEMORY);
    // How the search ends does not matter: what it has found counts, and is polished.
    let _ = Executor::new(problem, solver)
        .configure(|state| state.param(start).max_iters(ITERATIONS))
        .run();
    let (after, u) = best.into_inner();
    (after < before).then_some(u)
}

/// A point with a smaller residual than `start`, if one is found.
pub(super) fn descend<M: Space>(
    equation: &impl Equation<M>,
    start: &Vector<M>,
) -> Option<Vector<M>> {
    let squares = |u: &[f64]| {
        let at = equation.linearise(&Vector::<M>::from_index(|i| u[i]))?;
        let gradient = at.jacobian.transpose_times(&at.residual);
        Some(Squares {
            residual: at.residual.magnitude(),
            cost: 0.5 * at.residual.dot(&at.residual),
            gradient: (0..Vector::<M>::LEN).map(|i| gradient[i]).collect(),
        })
    };
    let start = (0..Vector::<M>::LEN).map(|i| start[i]).collect();
    minimise(&squares, start).map(|u| Vector::<M>::from_index(|i| u[i]))
}
