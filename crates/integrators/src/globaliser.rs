//! Brings a lost Newton iteration back: `½|F(u)|²` is minimised by argmin's L-BFGS.
//!
//! It stalls far above round-off and costs many evaluations, so it only delivers a better guess;
//! Newton's method polishes.

use argmin::core::{CostFunction, Executor, Gradient, State as _};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::LBFGS;
use metriplectic_fields::{Column, Space, Square, Vector};
use std::marker::PhantomData;

use crate::root_finder::Equation;

/// Iterations that a globaliser may take.
const ITERATIONS: u64 = 100;
/// Pairs of differences that L-BFGS remembers.
const MEMORY: usize = 7;

/// `u ↦ ½|F(u)|²` and its gradient `Jᵀ F`.
struct LeastSquares<'a, M, E> {
    equation: &'a E,
    space: PhantomData<M>,
}

impl<M: Space, E: Equation<M>> CostFunction for LeastSquares<'_, M, E> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, u: &Vec<f64>) -> Result<f64, argmin::core::Error> {
        let linearised = self.equation.linearise(&column::<M>(u));
        Ok(linearised.map_or(f64::INFINITY, |at| 0.5 * at.residual.dot(&at.residual)))
    }
}

impl<M: Space, E: Equation<M>> Gradient for LeastSquares<'_, M, E> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, u: &Vec<f64>) -> Result<Vec<f64>, argmin::core::Error> {
        let at = self
            .equation
            .linearise(&column::<M>(u))
            .ok_or_else(|| argmin::core::Error::msg("outside the domain of the equation"))?;
        Ok(entries::<M>(&at.jacobian.transpose_times(&at.residual)))
    }
}

/// A point with a smaller residual than `start`, if one is found.
pub(crate) fn descend<M: Space>(
    equation: &impl Equation<M>,
    start: &Vector<M>,
) -> Option<Vector<M>> {
    let before = equation.linearise(start)?.residual.magnitude();
    let problem = LeastSquares { equation, space: PhantomData };
    let solver = LBFGS::new(MoreThuenteLineSearch::new(), MEMORY);
    let result = Executor::new(problem, solver)
        .configure(|state| state.param(entries::<M>(start)).max_iters(ITERATIONS))
        .run()
        .ok()?;
    let best = column::<M>(result.state().get_best_param()?);
    let after = equation.linearise(&best)?.residual.magnitude();
    (after < before).then_some(best)
}

fn column<M: Space>(entries: &[f64]) -> Vector<M> {
    Vector::<M>::from_index(|i| entries[i])
}

fn entries<M: Space>(column: &Vector<M>) -> Vec<f64> {
    (0..Vector::<M>::LEN).map(|i| column[i]).collect()
}
