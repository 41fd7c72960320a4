//! The method of Levenberg and Marquardt.

use argmin::core::{
    Error, IterState, KV, Problem, Solver, State as _, TerminationReason, TerminationStatus,
};
use nalgebra::{DMatrix, DVector};

use crate::least_squares::{LeastSquares, Squares};

/// The method of Levenberg (1944) and Marquardt (1963), as a solver for argmin's
/// [`Executor`](argmin::core::Executor): observers, checkpoints and limits are those of argmin.
///
/// An iteration is one trial, and one evaluation of the problem: with `D` the lengths of the columns of `J`,
///
/// ```math
/// \delta = \operatorname*{arg\,min}_\delta\, |J \delta + r|^2 + \lambda |D \delta|^2
/// ```
///
/// by a QR decomposition, so that the unit of a parameter does not matter. A trial that lowers `|r|²` is taken; `λ` follows the ratio of
/// the actual to the predicted reduction (Nielsen 1999).
///
/// ```
/// use argmin::core::{Executor, State};
/// use metriplectic_fitting::{LeastSquares, LevenbergMarquardt, Squares};
/// use nalgebra::{dmatrix, dvector};
///
/// /// Rosenbrock's valley.
/// struct Valley;
///
/// impl LeastSquares for Valley {
///     fn squares(&self, x: &[f64]) -> Option<Squares> {
///         let residuals = dvector![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]];
///         Some(Squares { residuals, jacobian: dmatrix![-20.0 * x[0], 10.0; -1.0, 0.0] })
///     }
/// }
///
/// let solver = LevenbergMarquardt::default();
/// let found = Executor::new(Valley, solver)
///     .configure(|state| state.param(vec![-1.2, 1.0]).max_iters(100))
///     .run()
///     .unwrap();
/// let best = found.state().get_best_param().unwrap();
/// assert!((best[0] - 1.0).abs() < 1e-9 && (best[1] - 1.0).abs() < 1e-9);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct LevenbergMarquardt {
    /// The damping to begin with, relative to the lengths of the columns.
    pub damping: f64,
    /// The cosine between residuals and columns at which a minimum is reached.
    pub cosine: f64,
    /// The relative reduction of the sum of squares, predicted and actual, at which a minimum is reached.
    pub reduction: f64,
    /// The length of a column of `J`, in units of the root mean square of the residuals, below which its unknown is left where it is: no
    /// residual depends on it. The logarithm of a parameter that is zero ends here, and has no minimum.
    pub negligible: f64,
    /// The longest step of each unknown; none if the list is shorter. A whole step is cut to them.
    pub limits: Vec<f64>,
    /// The iterations in a row that have changed the sum of squares by less than `10⁻⁷` of it; 0 to begin with. Eight of them are
    /// a minimum: the runs differ by more, where their steps go another way.
    pub stalled: u32,
}

impl Default for LevenbergMarquardt {
    fn default() -> Self {
        Self {
            damping: 1e-3,
            cosine: 1e-8,
            reduction: 1e-12,
            negligible: 1e-2,
            limits: Vec::new(),
            stalled: 0,
        }
    }
}

/// The state of an iteration.
type Iteration = IterState<Vec<f64>, (), DMatrix<f64>, (), DVector<f64>, f64>;

/// A relative change of the sum of squares that hardly counts, and how many of them in a row are a minimum.
const SLOW: (f64, u32) = (1e-7, 8);

/// A damping from which on a step is a rounding of the parameters.
const LARGEST: f64 = 1e16;

impl LevenbergMarquardt {
    /// The residuals and the columns of the unknowns that they depend on.
    fn relevant(&self, whole: &Squares) -> Squares {
        let mut at = whole.clone();
        let least = self.negligible * (whole.sum() / whole.residuals.len() as f64).sqrt();
        for mut column in at.jacobian.column_iter_mut() {
            if column.norm() < least {
                column.fill(0.0);
            }
        }
        at
    }

    /// The step with the damping `λ`, and the reduction of the sum of squares that it predicts.
    fn step(
        &self,
        at: &Squares,
        scales: &DVector<f64>,
        lambda: f64,
    ) -> Option<(DVector<f64>, f64)> {
        let (rows, n) = at.jacobian.shape();
        let root = lambda.sqrt();
        let damped = DMatrix::from_fn(rows + n, n, |i, j| match i.checked_sub(rows) {
            None => at.jacobian[(i, j)] / scales[j],
            Some(k) if k == j => root,
            Some(_) => 0.0,
        });
        let right =
            DVector::from_fn(rows + n, |i, _| if i < rows { -at.residuals[i] } else { 0.0 });
        let qr = damped.qr();
        let hat = qr.r().solve_upper_triangular(&(qr.q().transpose() * right))?;
        let whole = hat.zip_map(scales, |hat, scale| hat / scale);
        let cut = whole.iter().zip(&self.limits).fold(1.0, |cut: f64, (step, limit)| {
            if step.abs() > *limit { cut.min(limit / step.abs()) } else { cut }
        });
        let delta = whole * cut;
        let linear = &at.jacobian * &delta + &at.residuals;
        Some((delta, at.sum() - linear.norm_squared()))
    }
}

/// The lengths of the columns; those of a column of zeros are 1.
fn lengths(jacobian: &DMatrix<f64>) -> DVector<f64> {
    DVector::from_fn(jacobian.ncols(), |j, _| {
        let length = jacobian.column(j).norm();
        if length > 0.0 { length } else { 1.0 }
    })
}

impl<O: LeastSquares> Solver<O, Iteration> for LevenbergMarquardt {
    fn name(&self) -> &'static str {
        "Levenberg-Marquardt"
    }

    fn init(
        &mut self,
        problem: &mut Problem<O>,
        mut state: Iteration,
    ) -> Result<(Iteration, Option<KV>), Error> {
        let start = state.take_param().ok_or_else(|| Error::msg("the solver has no start"))?;
        let at = evaluate(problem, &start)?
            .ok_or_else(|| Error::msg("the start is outside of the domain of the problem"))?;
        let cost = at.sum();
        Ok((state.param(start).cost(cost).residuals(at.residuals).jacobian(at.jacobian), None))
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<O>,
        mut state: Iteration,
    ) -> Result<(Iteration, Option<KV>), Error> {
        let missing = || Error::msg("the solver has lost its iterate");
        let here = state.take_param().ok_or_else(missing)?;
        let (residuals, jacobian) = (
            state.take_residuals().ok_or_else(missing)?,
            state.take_jacobian().ok_or_else(missing)?,
        );
        let whole = Squares { residuals, jacobian };
        let (at, sum) = (self.relevant(&whole), whole.sum());
        let keep = |state: Iteration, whole: Squares, here: Vec<f64>| {
            state.param(here).cost(sum).residuals(whole.residuals).jacobian(whole.jacobian)
        };
        let converged = TerminationReason::SolverConverged;
        if at.cosine() <= self.cosine || sum == 0.0 {
            return Ok((keep(state, whole, here).terminate_with(converged), None));
        }
        let scales = lengths(&at.jacobian);
        let Some((delta, predicted)) = self.step(&at, &scales, self.damping) else {
            self.damping *= 10.0;
            return Ok((keep(state, whole, here), None));
        };
        let is_rounding = here
            .iter()
            .zip(delta.iter())
            .all(|(phi, delta)| delta.abs() <= 4.0 * f64::EPSILON * phi.abs());
        if predicted <= 0.1 * self.reduction * sum || is_rounding {
            return Ok((keep(state, whole, here).terminate_with(converged), None));
        }
        let there: Vec<f64> =
            here.iter().zip(delta.iter()).map(|(phi, delta)| phi + delta).collect();
        let next = evaluate(problem, &there)?;
        let kv = argmin::kv!("damping" => self.damping;);
        let (slow, patience) = SLOW;
        let is_near = |next: &Squares| (next.sum() - sum).abs() <= slow * sum;
        self.stalled = if next.as_ref().is_some_and(is_near) { self.stalled + 1 } else { 0 };
        let has_stalled = self.stalled >= patience;
        match next.filter(|next| next.sum() < sum) {
            Some(next) => {
                let (after, reduction) = (next.sum(), sum - next.sum());
                let ratio = reduction / predicted;
                // Nielsen's rule, which changes λ smoothly.
                self.damping *= (1.0 - (2.0 * ratio - 1.0).powi(3)).clamp(0.1, 2.0);
                let is_over = has_stalled
                    || (reduction <= self.reduction * sum && predicted <= self.reduction * sum);
                let state = state
                    .param(there)
                    .cost(after)
                    .residuals(next.residuals)
                    .jacobian(next.jacobian);
                let state = if is_over { state.terminate_with(converged) } else { state };
                Ok((state, Some(kv)))
            }
            None => {
                self.damping *= 10.0;
                let state = keep(state, whole, here);
                let stuck = has_stalled || self.damping > LARGEST;
                Ok((if stuck { state.terminate_with(converged) } else { state }, Some(kv)))
            }
        }
    }

    fn terminate(&mut self, _: &Iteration) -> TerminationStatus {
        TerminationStatus::NotTerminated
    }
}

/// Evaluates the problem, which argmin counts.
fn evaluate<O: LeastSquares>(
    problem: &mut Problem<O>,
    phi: &[f64],
) -> Result<Option<Squares>, Error> {
    problem.problem("squares", |problem| Ok(problem.squares(phi).filter(Squares::is_finite)))
}

#[cfg(test)]
mod tests {
    use argmin::core::{Executor, TerminationReason};
    use nalgebra::{DMatrix, DVector};

    use super::*;

    /// `a x + e^φ x²` fitted to `2x − 0.01 x²` with an error of 0.1: the best coefficient of `x²` is negative.
    struct Bent;

    impl LeastSquares for Bent {
        fn squares(&self, u: &[f64]) -> Option<Squares> {
            let (a, b) = (u[0], u[1].exp());
            let x = |i: usize| 0.1 * (i + 1) as f64;
            let noise = |i: usize| if i.is_multiple_of(2) { 0.1 } else { -0.1 };
            let residual =
                |i, _| a * x(i) + b * x(i) * x(i) - 2.0 * x(i) + 0.01 * x(i) * x(i) + noise(i);
            let slope = |i, j| if j == 0 { x(i) } else { b * x(i) * x(i) };
            let (residuals, jacobian) =
                (DVector::from_fn(20, residual), DMatrix::from_fn(20, 2, slope));
            Some(Squares { residuals, jacobian })
        }
    }

    #[test]
    fn a_logarithm_without_a_minimum_is_left() {
        let solver = LevenbergMarquardt { limits: vec![f64::INFINITY, 3.0], ..Default::default() };
        let found = Executor::new(Bent, solver)
            .configure(|state| state.param(vec![1.0, -1.0]).max_iters(100))
            .run()
            .unwrap();
        let state = found.state();
        println!("{:?} after {} iterations", state.get_best_param(), state.get_iter());
        assert_eq!(state.get_termination_reason(), Some(&TerminationReason::SolverConverged));
        assert!(state.get_best_param().unwrap()[1] < -4.0 && state.get_iter() < 20);
    }
}
