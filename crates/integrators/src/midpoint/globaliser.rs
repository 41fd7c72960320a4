//! Finds a better guess where Newton's method fails: argmin's L-BFGS minimises `½|F(u)|²`.
//!
//! It stalls far above round-off and costs many evaluations, so it only delivers a better guess;
//! Newton's method polishes.

use std::cell::Cell;
use std::rc::Rc;

use argmin::core::{CostFunction, Executor, Gradient};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::LBFGS;
use metriplectic_fields::{Column, Space, Square, Vector};

use crate::newton::{Equation, Linearised};

/// Iterations that a globaliser may take.
const ITERATIONS: u64 = 100;
/// Evaluations that it may take: a line search through a residual that is not smooth has no end of its
/// own.
const EVALUATIONS: u32 = 1000;
/// Pairs of differences that L-BFGS remembers.
const MEMORY: usize = 7;

/// `u ↦ ½|F(u)|²` and its gradient `Jᵀ F`.
struct LeastSquares<'a, M: Space, E> {
    equation: &'a E,
    evaluations: Cell<u32>,
    /// The least `|F(u)|` so far, and where.
    best: Rc<Cell<(f64, Vector<M>)>>,
}

impl<M: Space, E: Equation<M>> LeastSquares<'_, M, E> {
    /// The equation at `u`, as long as there may be more evaluations.
    fn at(&self, u: &[f64]) -> Result<Option<Linearised<M, E::Evidence>>, argmin::core::Error> {
        self.evaluations.set(self.evaluations.get() + 1);
        if self.evaluations.get() > EVALUATIONS {
            return Err(argmin::core::Error::msg("no root is found in the evaluations allowed"));
        }
        let u = column::<M>(u);
        let at = self.equation.linearise(&u);
        if let Some(at) = &at
            && at.residual.magnitude() < self.best.get().0
        {
            self.best.set((at.residual.magnitude(), u));
        }
        Ok(at)
    }
}

impl<M: Space, E: Equation<M>> CostFunction for LeastSquares<'_, M, E> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, u: &Vec<f64>) -> Result<f64, argmin::core::Error> {
        Ok(self.at(u)?.map_or(f64::INFINITY, |at| 0.5 * at.residual.dot(&at.residual)))
    }
}

impl<M: Space, E: Equation<M>> Gradient for LeastSquares<'_, M, E> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, u: &Vec<f64>) -> Result<Vec<f64>, argmin::core::Error> {
        let at = self.at(u)?;
        let at =
            at.ok_or_else(|| argmin::core::Error::msg("outside the domain of the equation"))?;
        Ok(entries::<M>(&at.jacobian.transpose_times(&at.residual)))
    }
}

/// A point with a smaller residual than `start`, if one is found.
pub(crate) fn descend<M: Space>(
    equation: &impl Equation<M>,
    start: &Vector<M>,
) -> Option<Vector<M>> {
    let before = equation.linearise(start)?.residual.magnitude();
    let (evaluations, best) = (Cell::new(0), Rc::new(Cell::new((before, *start))));
    let problem = LeastSquares { equation, evaluations, best: Rc::clone(&best) };
    let solver = LBFGS::new(MoreThuenteLineSearch::new(), MEMORY);
    // How the search ends does not matter: what it has found counts, and is polished.
    let _ = Executor::new(problem, solver)
        .configure(|state| state.param(entries::<M>(start)).max_iters(ITERATIONS))
        .run();
    let (after, u) = best.get();
    (after < before).then_some(u)
}

fn column<M: Space>(entries: &[f64]) -> Vector<M> {
    Vector::<M>::from_index(|i| entries[i])
}

fn entries<M: Space>(column: &Vector<M>) -> Vec<f64> {
    (0..Vector::<M>::LEN).map(|i| column[i]).collect()
}
