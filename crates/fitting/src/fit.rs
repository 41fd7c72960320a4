//! Fits of the parameters of a family.

use std::cell::RefCell;
use std::cmp::Ordering;
use std::fmt;

use argmin::core::{Executor, State as _, TerminationReason};
use metriplectic_dynamics::{Differentiable, Parametrised, Point};
use metriplectic_fields::{Dimension as _, Real, Space};
use metriplectic_integrators::tangent::LinearisedAlong;
use metriplectic_integrators::{Schedule, Stepper};
use metriplectic_manifolds::Manifold as _;
use nalgebra::SVector;

use crate::error::FitError;
use crate::fitted::{FLAT, Fitted, Parts, Stop};
use crate::levenberg_marquardt::LevenbergMarquardt;
use crate::model::{ManifoldOf, Measured, Model, PointOf};
use crate::unknowns::{Names, Unknown, unknowns};

/// The longest step of a logarithm.
const STEEP: f64 = 3.0;

/// The noise, relative to the data, that the round-off of runs may be mistaken for.
const ROUNDED: f64 = 4096.0 * f64::EPSILON;

/// A fit of the parameters of a family to data, by least squares.
///
/// ```
/// use metriplectic_dynamics::Family;
/// use metriplectic_fields::Real;
/// use metriplectic_fitting::Fit;
/// use metriplectic_integrators::{DormandPrince8, Method, Span, Watch};
/// use metriplectic_manifolds::LieDual;
/// use nalgebra::{Vector3, Vector4, vector};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let body = Family::on(LieDual::so3())
///     .parameters(["I1", "I2", "I3", "friction"])
///     .energy(|p: &Vector3<Real>, t: &Vector4<Real>| {
///         (p.x * p.x / t.x + p.y * p.y / t.y + p.z * p.z / t.z) * 0.5
///     })
///     .entropy(|p: &Vector3<Real>, t: &Vector4<Real>| p.norm_squared() * t.w * 0.5)
///     .build()?;
///
/// // What was measured: here a run, with a little noise.
/// let (start, truth) = (vector![0.4, -1.0, 0.3], vector![3.0, 2.0, 1.0, 0.05]);
/// let times: Vec<f64> = (1..=40).map(|k| 0.5 * f64::from(k)).collect();
/// let span = Span::until(20.0).tolerance(1e-8);
/// let run = DormandPrince8.run(&body.at(truth), start, span.output_at(times.clone()))?;
/// let noise = |k: usize, i: usize| 1e-3 * ((12.9898 * k as f64 + 78.233 * i as f64).sin() * 43758.5).sin();
/// let data: Vec<Vector3<f64>> = run.states()[1..]
///     .iter()
///     .enumerate()
///     .map(|(k, state)| state.point + Vector3::from_fn(|i, _| noise(k, i)))
///     .collect();
///
/// let fit = Fit::of(&body)
///     .observe(|p: &Vector3<Real>| *p)
///     .data(&times, &data)
///     .positive_all()
///     .start_at(start)
///     .run(DormandPrince8, span, vector![2.6, 2.3, 1.2, 0.03])?;
/// println!("{fit}");
/// assert!((fit.parameters[3] - 0.05).abs() < 1e-3);
/// # Ok(())
/// # }
/// ```
pub struct Fit<'a, Y, const P: usize> {
    family: &'a Y,
}

impl<Y, const P: usize> fmt::Debug for Fit<'_, Y, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Fit").finish_non_exhaustive()
    }
}

impl<'a, Y: Parametrised<P>, const P: usize> Fit<'a, Y, P> {
    /// Starts a fit of the parameters of a family.
    pub const fn of(family: &'a Y) -> Self {
        Self { family }
    }

    /// Says what was measured, as a closure of the state that returns `K` numbers. It is differentiated as a field is.
    pub fn observe<F, const K: usize>(self, observe: F) -> FitBuilder<'a, Y, F, P, K>
    where
        F: Fn(&PointOf<Y, Real, P>) -> SVector<Real, K>,
    {
        FitBuilder {
            family: self.family,
            observe,
            times: Vec::new(),
            rows: Vec::new(),
            noise: None,
            free: Names::All,
            positive: Names::None,
            start: None,
            free_start: false,
            iterations: 100,
            solver: LevenbergMarquardt::default(),
        }
    }
}

/// A fit in the making: each method replaces one part.
#[must_use = "a fit does nothing until `run` is called"]
pub struct FitBuilder<'a, Y: Parametrised<P>, F, const P: usize, const K: usize> {
    family: &'a Y,
    observe: F,
    times: Vec<f64>,
    rows: Vec<SVector<f64, K>>,
    noise: Option<[f64; K]>,
    free: Names,
    positive: Names,
    start: Option<Point<Y::System>>,
    free_start: bool,
    iterations: u64,
    solver: LevenbergMarquardt,
}

impl<Y: Parametrised<P>, F, const P: usize, const K: usize> fmt::Debug
    for FitBuilder<'_, Y, F, P, K>
{
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FitBuilder")
            .field("rows", &self.rows.len())
            .field("free", &self.free)
            .finish_non_exhaustive()
    }
}

impl<Y, F, const P: usize, const K: usize> FitBuilder<'_, Y, F, P, K>
where
    Y: Parametrised<P>,
    F: Fn(&PointOf<Y, Real, P>) -> SVector<Real, K>,
{
    /// Sets the data: a row of `K` numbers for each time, in rising order.
    ///
    /// A state belongs to a row by its time. Runs go on at rest, up to the last row, although the schedule ends them
    /// [there](metriplectic_integrators::Until::until_rest): the residuals would jump with the steps. Where no run goes on, the state at
    /// rest stands for all later rows. A run that ends early in another way, at an event that stops it, is no run of the
    /// model: [`Unpaired`](metriplectic_integrators::Unpaired) names the row and the ending.
    pub fn data(mut self, times: &[f64], rows: &[SVector<f64, K>]) -> Self {
        (self.times, self.rows) = (times.to_vec(), rows.to_vec());
        self
    }

    /// Sets the standard deviation of all numbers. Without it, it is estimated from the residuals.
    pub fn noise(self, sigma: f64) -> Self {
        self.noise_each([sigma; K])
    }

    /// Sets the standard deviation of each column.
    pub fn noise_each(self, sigma: [f64; K]) -> Self {
        Self { noise: Some(sigma), ..self }
    }

    /// Frees these parameters, and fixes the others at their guess. Without it all are free.
    pub fn free<T: Into<String>>(self, names: impl IntoIterator<Item = T>) -> Self {
        Self { free: Names::Some(names.into_iter().map(Into::into).collect()), ..self }
    }

    /// Fits the logarithms of these parameters, so that they stay positive.
    pub fn positive<T: Into<String>>(self, names: impl IntoIterator<Item = T>) -> Self {
        Self { positive: Names::Some(names.into_iter().map(Into::into).collect()), ..self }
    }

    /// Fits the logarithms of all parameters.
    pub fn positive_all(self) -> Self {
        Self { positive: Names::All, ..self }
    }

    /// Sets the state at the start, which is known.
    pub fn start_at(self, x0: Point<Y::System>) -> Self {
        Self { start: Some(x0), free_start: false, ..self }
    }

    /// Sets a guess of the state at the start, which is fitted too.
    pub fn free_start(self, x0: Point<Y::System>) -> Self {
        Self { start: Some(x0), free_start: true, ..self }
    }

    /// Replaces the options of the solver.
    pub fn solver(self, solver: LevenbergMarquardt) -> Self {
        Self { solver, ..self }
    }

    /// Sets the most iterations, 100 without it.
    pub fn iterations(self, iterations: u64) -> Self {
        Self { iterations, ..self }
    }

    /// Finds the parameters with which runs by a method over a schedule come nearest to the data, from a guess.
    ///
    /// The runs should be more accurate than the noise: an error of the runs is an error of the parameters that no
    /// standard error shows.
    ///
    /// # Errors
    ///
    /// [`FitError`].
    pub fn run<M>(
        self,
        method: M,
        schedule: impl Into<Schedule>,
        guess: SVector<f64, P>,
    ) -> Result<Fitted, FitError>
    where
        M: Clone + Stepper<Y::System> + LinearisedAlong<Y::System>,
    {
        self.check()?;
        let Self { family, observe, times, rows, noise, free, positive, start, .. } = self;
        let Some(start) = start else {
            return Err(FitError::Solver(
                "no start was given; say `start_at` or `free_start`".into(),
            ));
        };
        let known = family.at_parameters(guess).parameters().to_vec();
        let unknowns = unknowns(&known, guess.as_slice(), [&free, &positive])?;
        let measured = Measured { times, rows, noise: noise.unwrap_or([1.0; K]) };
        let mut phi: Vec<f64> = unknowns.iter().map(|u| u.of(guess[u.index])).collect();
        if self.free_start {
            phi.extend(vec![0.0; <ManifoldOf<Y, P> as Space>::Dim::LEN]);
        }
        let data = measured.rows.len() * K;
        if data <= phi.len() {
            return Err(FitError::TooFewData { data, unknowns: phi.len() });
        }
        let model = Model {
            family,
            method,
            schedule: schedule.into(),
            observe: &observe,
            measured: &measured,
            unknowns: &unknowns,
            guess,
            start,
            free_start: self.free_start,
            failure: RefCell::new(None),
        };
        model.evaluate(&phi).map_err(FitError::Guess)?;
        // A factor of e⁻³ in a step: the slope of a logarithm vanishes with its parameter.
        let limit = |u: &Unknown| if u.positive { STEEP } else { f64::INFINITY };
        let mut solver = self.solver;
        if solver.limits.is_empty() {
            solver.limits = unknowns.iter().map(limit).collect();
        }
        let executor = Executor::new(&model, solver)
            .configure(|state| state.param(phi).max_iters(self.iterations));
        let found = executor.run().map_err(|error| FitError::Solver(error.to_string()))?;
        let runs = 1 + found.problem.counts.get("squares").copied().unwrap_or(0);
        let state = found.state();
        let best = state.get_best_param().cloned().unwrap_or_default();
        let squares = model.evaluate(&best).map_err(FitError::Guess)?;
        let (theta, start) = model.at(&best);
        let parameters = theta.as_slice().to_vec();
        let stop = match state.get_termination_reason() {
            Some(TerminationReason::SolverConverged) if !found.solver.has_stalled() => {
                Stop::Converged
            }
            _ => Stop::Unfinished,
        };
        // A promise that no trial has kept, or that none was left for.
        let variance = squares.sum() / (data - best.len()) as f64;
        let variance = variance.max(ROUNDED * ROUNDED * measured.mean_square());
        if found.solver.relevant(&squares).promised() > FLAT * variance {
            let (runs, chi_squared) = (usize::try_from(runs).unwrap_or(usize::MAX), squares.sum());
            return Err(FitError::NotConverged { runs, chi_squared, parameters });
        }
        Ok(Fitted::new(Parts {
            unknowns: &unknowns,
            phi: &best,
            squares: &squares,
            parameters,
            start: ManifoldOf::<Y, P>::entries(&start),
            noise_is_known: noise.is_some(),
            runs: runs + 1,
            stop,
        }))
    }

    /// Looks at the data.
    fn check(&self) -> Result<(), FitError> {
        let (rows, times) = (self.rows.len(), self.times.len());
        if rows != times {
            return Err(FitError::Rows { rows, times });
        }
        for (row, pair) in self.times.windows(2).enumerate() {
            if pair[1].partial_cmp(&pair[0]) != Some(Ordering::Greater) {
                return Err(FitError::Times { row: row + 1, time: pair[1] });
            }
        }
        for (row, numbers) in self.rows.iter().enumerate() {
            if let Some(column) = numbers.iter().position(|number| !number.is_finite()) {
                return Err(FitError::NotFinite { row, column, value: numbers[column] });
            }
        }
        let bad = |sigma: &f64| !(*sigma > 0.0 && sigma.is_finite());
        match self.noise.and_then(|noise| noise.iter().position(bad).map(|k| (k, noise[k]))) {
            Some((column, sigma)) => Err(FitError::Noise { column, sigma }),
            None => Ok(()),
        }
    }
}
