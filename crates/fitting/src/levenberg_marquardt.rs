//! The method of Levenberg and Marquardt.

use argmin::core::{
    Error, IterState, KV, Problem, Solver, State as _, TerminationReason, TerminationStatus,
};
use nalgebra::{DMatrix, DVector};

use crate::bounds::{Bound, WITHOUT, held};
use crate::least_squares::{LeastSquares, Squares};
use crate::projected::InBox;
use crate::robust::Robust;
use crate::trust_region::Linear;

/// The method of Levenberg (1944) and Marquardt (1963) with a trust region (Moré 1978), as a solver for argmin's
/// [`Executor`](argmin::core::Executor): observers, checkpoints and limits are those of argmin.
///
/// An iteration is one trial, and one evaluation of the problem: with `D` the largest lengths that the columns of `J` have had,
///
/// ```math
/// \delta = \operatorname*{arg\,min}_{|D \delta| \le \Delta}\, |J \delta + r|^2
///        = \operatorname*{arg\,min}_\delta\, |J \delta + r|^2 + \lambda |D \delta|^2
/// ```
///
/// by the singular values of `J D⁻¹`, so that the unit of a parameter does not matter. A trial that lowers `|r|²` is taken. The radius
/// `Δ` is doubled where the linear model is good and divided by four where it is not; `λ ≥ 0` is the one of this radius. So the damped
/// step *is* the best one in the trust region, and another step in the same region, such as the dogleg of Powell (1970), predicts a
/// smaller reduction.
///
/// Within [`bounds`](Self::bounds) an unknown that a step would take out of them is put on its bound, to the last bit, and the others take
/// the best step beside it (`projected.rs`). A [`robust`](Self::robust) loss replaces `|r|²` by `Σ C² ρ(r²/C²)`, of which the squares
/// `|J̃ δ + r̃|²` are the model.
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
    /// The damping `λ` of the first step, whose length is the first radius.
    pub damping: f64,
    /// The radius `Δ` of the trust region; NaN to begin with.
    pub radius: f64,
    /// The largest lengths that the columns of `J` have had; empty to begin with.
    pub lengths: Vec<f64>,
    /// The cosine between residuals and columns at which a minimum is reached.
    pub cosine: f64,
    /// The relative reduction of the sum of squares, predicted and actual, at which a minimum is reached.
    pub reduction: f64,
    /// The change of the residuals by the longest step of an unknown, in units of their root mean square, below which the unknown is
    /// left where it is: no residual depends on it. The logarithm of a parameter that is zero ends here, and has no minimum.
    pub negligible: f64,
    /// The longest step of each unknown; none if the list is shorter. A whole step is cut to them.
    pub limits: Vec<f64>,
    /// The iterations in a row that have changed the sum of squares by less than `10⁻⁷` of it; 0 to begin with. Eight of them are
    /// a minimum: the runs differ by more, where their steps go another way.
    pub stalled: u32,
    /// The least and the largest value of each unknown; none if the list is shorter. A [fit](crate::Fit) replaces them by
    /// [its own](crate::FitBuilder::between).
    pub bounds: Vec<[f64; 2]>,
    /// The loss of the residuals in place of their squares, if there is one.
    pub robust: Option<Robust>,
}

impl Default for LevenbergMarquardt {
    fn default() -> Self {
        Self {
            damping: 1e-3,
            radius: f64::NAN,
            lengths: Vec::new(),
            cosine: 1e-8,
            reduction: 1e-12,
            negligible: 1e-2,
            limits: Vec::new(),
            stalled: 0,
            bounds: Vec::new(),
            robust: None,
        }
    }
}

/// The state of an iteration.
type Iteration = IterState<Vec<f64>, (), DMatrix<f64>, (), DVector<f64>, f64>;

/// A relative change of the sum of squares that hardly counts, and how many of them in a row are a minimum.
const SLOW: (f64, u32) = (1e-7, 8);

/// The ratios of the actual to the predicted reduction below which the radius falls, and above which it grows, with their factors.
const POOR: (f64, f64) = (0.25, 0.25);
const GOOD: (f64, f64) = (0.75, 2.0);

impl LevenbergMarquardt {
    /// Returns whether several iterations in a row had no effect.
    pub(crate) const fn has_stalled(&self) -> bool {
        self.stalled >= SLOW.1
    }

    /// The sum that is minimised: `|r|²`, or that of the loss.
    pub(crate) fn sum(&self, whole: &Squares) -> f64 {
        self.robust.map_or_else(|| whole.sum(), |loss| loss.sum(whole.residuals.as_slice()))
    }

    /// The bound that holds each unknown.
    pub(crate) fn held(&self, whole: &Squares, here: &[f64]) -> Vec<Option<Bound>> {
        match self.robust {
            _ if self.bounds.is_empty() => Vec::new(),
            Some(loss) => held(&loss.scaled(whole), here, &self.bounds),
            None => held(whole, here, &self.bounds),
        }
    }

    /// The residuals and the columns of the unknowns that they depend on and that no bound holds.
    pub(crate) fn relevant(&self, whole: &Squares, here: &[f64]) -> Squares {
        let mut at = self.robust.map_or_else(|| whole.clone(), |loss| loss.scaled(whole));
        let least = self.negligible * (self.sum(whole) / whole.residuals.len() as f64).sqrt();
        for (mut column, limit) in at.jacobian.column_iter_mut().zip(&self.limits) {
            if column.norm() * limit < least {
                column.fill(0.0);
            }
        }
        for (mut column, held) in at.jacobian.column_iter_mut().zip(self.held(whole, here)) {
            if held.is_some() {
                column.fill(0.0);
            }
        }
        at
    }

    /// Lengthens the units by which columns are measured.
    fn measure(&mut self, jacobian: &DMatrix<f64>) {
        self.lengths.resize(jacobian.ncols(), 0.0);
        for (length, column) in self.lengths.iter_mut().zip(jacobian.column_iter()) {
            *length = length.max(column.norm());
        }
    }

    /// The step within the radius and the bounds.
    fn step(&mut self, at: &Squares, here: &[f64]) -> Option<Step> {
        let lengths: Vec<f64> =
            self.lengths.iter().map(|&l| if l > 0.0 { l } else { 1.0 }).collect();
        let whole = if self.bounds.is_empty() {
            let linear = Linear::of(at, &lengths)?;
            if self.radius.is_nan() {
                self.radius = linear.damped(self.damping).norm();
            }
            let hat = linear.within(self.radius);
            DVector::from_fn(hat.len(), |k, _| hat[k] / lengths[k])
        } else {
            // The columns of those that a bound holds are zero, and so are columns of no effect.
            let is_held: Vec<bool> =
                at.jacobian.column_iter().map(|column| column.norm() == 0.0).collect();
            let room: Vec<[f64; 2]> = (here.iter().enumerate())
                .map(|(j, phi)| self.bounds_of(j).map(|bound| bound - phi))
                .collect();
            let model = InBox { at, lengths: &lengths, room: &room };
            if self.radius.is_nan() {
                self.radius = model.damped(self.damping, &is_held)?;
            }
            model.within(self.radius, &is_held)?
        };
        let cut = whole.iter().zip(&self.limits).fold(1.0, |cut: f64, (step, limit)| {
            if step.abs() > *limit { cut.min(limit / step.abs()) } else { cut }
        });
        let delta = whole * cut;
        let linear = &at.jacobian * &delta + &at.residuals;
        let hat = DVector::from_fn(delta.len(), |k, _| delta[k] * lengths[k]);
        let there = (here.iter().enumerate())
            .map(|(j, phi)| {
                let ([lower, upper], delta) = (self.bounds_of(j), delta[j]);
                if delta <= lower - phi {
                    lower
                } else if delta >= upper - phi {
                    upper
                } else {
                    (phi + delta).clamp(lower, upper)
                }
            })
            .collect();
        Some(Step { there, length: hat.norm(), predicted: at.sum() - linear.norm_squared() })
    }

    fn bounds_of(&self, j: usize) -> [f64; 2] {
        self.bounds.get(j).copied().unwrap_or(WITHOUT)
    }
}

/// A trial of an iteration.
struct Step {
    there: Vec<f64>,
    /// Its length in units of the columns.
    length: f64,
    /// The reduction of the sum that it predicts.
    predicted: f64,
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
        let is_inside = |(phi, [lower, upper]): (&f64, &[f64; 2])| lower <= phi && phi <= upper;
        if !start.iter().zip(&self.bounds).all(is_inside) {
            return Err(Error::msg("the start is outside of its bounds"));
        }
        let at = evaluate(problem, &start)?
            .ok_or_else(|| Error::msg("the start is outside of the domain of the problem"))?;
        let cost = self.sum(&at);
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
        let (at, sum) = (self.relevant(&whole, &here), self.sum(&whole));
        let keep = |state: Iteration, whole: Squares, here: Vec<f64>| {
            state.param(here).cost(sum).residuals(whole.residuals).jacobian(whole.jacobian)
        };
        let converged = TerminationReason::SolverConverged;
        if at.cosine() <= self.cosine || sum == 0.0 {
            return Ok((keep(state, whole, here).terminate_with(converged), None));
        }
        self.measure(&at.jacobian);
        let Some(Step { there, length, predicted }) = self.step(&at, &here) else {
            return Err(Error::msg("the Jacobian has no singular values"));
        };
        let is_rounding = here
            .iter()
            .zip(&there)
            .all(|(phi, there)| (there - phi).abs() <= 4.0 * f64::EPSILON * phi.abs());
        if predicted <= 0.1 * self.reduction * sum || is_rounding {
            return Ok((keep(state, whole, here).terminate_with(converged), None));
        }
        let next = evaluate(problem, &there)?;
        let kv = argmin::kv!("radius" => self.radius;);
        let after = next.as_ref().map_or(f64::INFINITY, |next| self.sum(next));
        let is_near = (after - sum).abs() <= SLOW.0 * sum;
        self.stalled = if is_near { self.stalled + 1 } else { 0 };
        let has_stalled = self.has_stalled();
        match next.filter(|_| after < sum) {
            Some(next) => {
                let reduction = sum - after;
                let ratio = reduction / predicted;
                if ratio < POOR.0 {
                    self.radius = POOR.1 * length;
                } else if ratio > GOOD.0 {
                    self.radius = self.radius.max(GOOD.1 * length);
                }
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
                self.radius = POOR.1 * length;
                let state = keep(state, whole, here);
                Ok((if has_stalled { state.terminate_with(converged) } else { state }, Some(kv)))
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

    /// Problems with narrow valleys (Moré, Garbow and Hillstrom 1981), with the evaluations that they take.
    #[test]
    fn valleys_are_followed() {
        /// The residuals and the rows of their derivatives.
        type Rows = (Vec<f64>, Vec<f64>);
        struct Problem(fn(&[f64]) -> Rows);
        impl LeastSquares for Problem {
            fn squares(&self, x: &[f64]) -> Option<Squares> {
                let (r, j) = self.0(x);
                let jacobian = DMatrix::from_row_slice(r.len(), x.len(), &j);
                Some(Squares { residuals: DVector::from_vec(r), jacobian })
            }
        }
        fn meyer(x: &[f64]) -> Rows {
            const Y: [f64; 16] = [
                34780.0, 28610.0, 23650.0, 19630.0, 16370.0, 13720.0, 11540.0, 9744.0, 8261.0,
                7030.0, 6005.0, 5147.0, 4427.0, 3820.0, 3307.0, 2872.0,
            ];
            let (mut r, mut j) = (Vec::new(), Vec::new());
            for (i, y) in Y.iter().enumerate() {
                let t = 50.0 + 5.0 * i as f64 + x[2];
                let e = (x[1] / t).exp();
                r.push(x[0] * e - y);
                j.extend([e, x[0] * e / t, -x[0] * e * x[1] / (t * t)]);
            }
            (r, j)
        }
        let rosenbrock = |x: &[f64]| {
            let r = vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]];
            (r, vec![-20.0 * x[0], 10.0, -1.0, 0.0])
        };
        // An unknown of 10⁶ whose column is 10⁻⁶ of the residuals: units do not matter.
        let brown = |x: &[f64]| {
            let r = vec![x[0] - 1e6, x[1] - 2e-6, x[0] * x[1] - 2.0];
            (r, vec![1.0, 0.0, 0.0, 1.0, x[1], x[0]])
        };
        let count = |name: &str, problem: Problem, x: &[f64], least: f64, most: u64| {
            let found = Executor::new(problem, LevenbergMarquardt::default())
                .configure(|state| state.param(x.to_vec()).max_iters(400))
                .run()
                .unwrap();
            let (sum, runs) = (found.state().get_best_cost(), found.problem.counts["squares"]);
            println!("{name}: {sum:.6e} after {runs} evaluations");
            assert!(sum <= least && runs <= most, "{name}: {sum:e} after {runs}");
        };
        count("Rosenbrock", Problem(rosenbrock), &[-1.2, 1.0], 1e-20, 30);
        count("Brown", Problem(brown), &[1.0, 1.0], 1e-20, 30);
        count("Meyer", Problem(meyer), &[0.02, 4000.0, 250.0], 87.95, 200);
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
