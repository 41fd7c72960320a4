//! Losses over runs, with gradients for argmin's solvers.

use std::cell::RefCell;
use std::fmt;

use argmin::core::{CostFunction, Error, Executor, Gradient, State as _};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::LBFGS;
use metriplectic_dynamics::{Parametrised, Point};
use metriplectic_fields::{Real, Space};
use metriplectic_integrators::step::Element;
use metriplectic_integrators::tangent::{Fittable, LinearisedAlong};
use metriplectic_integrators::{
    Adjoints as _, Flow, Method as _, Schedule, Stepper, Systems, Watch as _,
};
use nalgebra::{DVector, SVector};

use crate::error::FitError;
use crate::model::{Failure, ManifoldOf, PointOf, at_rest_too};
use crate::systems::{Beside, sides, slope};

/// A loss over runs of a system, as a function of its parameters:
///
/// ```math
/// \ell(\theta) = \sum_i \sum_k \ell_{ik}\bigl( x_i(t_k; \theta) \bigr) ,
/// ```
///
/// with one run for each start `i` and a term for each time `k`. The gradient over runs [of](Self::of) a
/// [`Family`](metriplectic_dynamics::Family) is that of the discrete steps, by their [adjoint](metriplectic_integrators::Adjoints): the
/// price does not grow with the number of parameters. That over runs of systems of any kind is by differences
/// ([`of_systems`](Self::of_systems)). [`minimise`](LossOver::minimise) is argmin's L-BFGS (Liu and Nocedal 1989) with the line search of Moré
/// and Thuente (1994). For few parameters and their errors, [`Fit`](crate::Fit) is the better tool.
///
/// A [`LossOver`] is an argmin problem ([`CostFunction`] and [`Gradient`] of a `Vec<f64>`), for its other solvers, observers and
/// checkpoints.
///
/// ```
/// use metriplectic_dynamics::{Family, Symplectic};
/// use metriplectic_fields::Real;
/// use metriplectic_fitting::Loss;
/// use metriplectic_integrators::{DormandPrince5, Method, Span, Watch};
/// use metriplectic_manifolds::Euclidean;
/// use nalgebra::{Vector2, vector};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let spring = Family::on(Euclidean::<2>)
///     .parameters(["stiffness", "hardening"])
///     .bracket(Symplectic)
///     .energy(|x: &Vector2<Real>, t: &Vector2<Real>| {
///         x.y * x.y * 0.5 + x.x * x.x * t.x * 0.5 + x.x * x.x * x.x * x.x * t.y * 0.25
///     })
///     .build()?;
///
/// // What was measured, from two starts: here two runs.
/// let (starts, times) = ([vector![1.0, 0.0], vector![0.0, 1.5]], [1.0, 2.0, 3.0]);
/// let span = Span::steps(0.1, 30);
/// let truth = spring.at(vector![1.5, 0.4]);
/// let data = starts.map(|x0| DormandPrince5.run(&truth, x0, span.output_at(times)).unwrap());
///
/// let loss = Loss::of(&spring)
///     .starts(&starts)
///     .times(&times)
///     .term(|i, k, x: &Vector2<Real>| {
///         (x - data[i].states()[k + 1].point.map(Real::from)).norm_squared()
///     })
///     .over(DormandPrince5, span);
/// let found = loss.minimise(vector![1.0, 0.0], 50)?;
/// assert!((found.parameters - vector![1.5, 0.4]).norm() < 1e-5 && found.value < 1e-9);
/// # Ok(())
/// # }
/// ```
pub struct Loss<Y, X, T, const P: usize> {
    of: Y,
    starts: Vec<X>,
    times: Vec<f64>,
    term: T,
}

impl<Y, X, T, const P: usize> fmt::Debug for Loss<Y, X, T, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Loss")
            .field("runs", &self.starts.len())
            .field("times", &self.times.len())
            .finish_non_exhaustive()
    }
}

impl<const P: usize> Loss<(), (), (), P> {
    /// Starts a loss over runs of a [`Family`](metriplectic_dynamics::Family), or of one with ports, baths, a clock or noise, whose gradient
    /// is that of [`of_systems`](Loss::of_systems).
    pub fn of<Y: Fittable<P>>(family: &Y) -> Loss<Y::Systems<'_>, Y::Start, (), P> {
        Loss { of: family.systems(), starts: Vec::new(), times: Vec::new(), term: () }
    }
}

impl<'a, Y: Parametrised<P>, T, const P: usize> Loss<&'a Y, Point<Y::System>, T, P> {
    /// Sets the terms, a closure `|i, k, x| -> Real` of the number of the run, the number of the time, and the state.
    pub fn term<F>(self, term: F) -> Loss<&'a Y, Point<Y::System>, F, P>
    where
        F: Fn(usize, usize, &PointOf<Y, Real, P>) -> Real,
    {
        self.with(term)
    }
}

impl<B, S, Error, const P: usize> Loss<Systems<B, P>, Element<S>, (), P>
where
    B: Fn(&SVector<f64, P>) -> Result<S, Error>,
    S: Flow,
    Error: Into<Failure>,
{
    /// Starts a loss over runs of any system, from the names of its parameters and a closure that builds it at values of them.
    ///
    /// A gradient is one of central differences, as in [`Fit::of_systems`](crate::Fit::of_systems), so it takes `2P + 1` runs for each start.
    /// No parameter may be zero then, which has no size.
    pub const fn of_systems(names: [&'static str; P], build: B) -> Self {
        let of = Systems::new(names, build);
        Self { of, starts: Vec::new(), times: Vec::new(), term: () }
    }
}

impl<B, S, Error, T, const P: usize> Loss<Systems<B, P>, Element<S>, T, P>
where
    B: Fn(&SVector<f64, P>) -> Result<S, Error>,
    S: Flow,
{
    /// Sets the terms, a closure `|i, k, x| -> f64` of the number of the run, the number of the time, and the state.
    pub fn term<F>(self, term: F) -> Loss<Systems<B, P>, Element<S>, F, P>
    where
        F: Fn(usize, usize, &Element<S>) -> f64,
    {
        self.with(term)
    }
}

impl<Y, X, T, const P: usize> Loss<Y, X, T, P> {
    fn with<F>(self, term: F) -> Loss<Y, X, F, P> {
        let Self { of, starts, times, .. } = self;
        Loss { of, starts, times, term }
    }

    /// Sets the starts of the runs.
    #[must_use]
    pub fn starts(self, starts: &[X]) -> Self
    where
        X: Clone,
    {
        Self { starts: starts.to_vec(), ..self }
    }

    /// Sets the times of the terms, from the start of the runs to their end.
    ///
    /// A state belongs to a term by its time. Runs go on at rest, up to the last term, although the schedule ends them
    /// [there](metriplectic_integrators::Until::until_rest): the loss would jump with the steps. Where no run goes on, the state at rest
    /// stands for all later terms. A run that ends early in another way has no loss: the error names the time and the ending.
    #[must_use]
    pub fn times(self, times: &[f64]) -> Self {
        Self { times: times.to_vec(), ..self }
    }

    /// Says how runs are taken: by a method over a schedule.
    pub fn over<M>(self, method: M, schedule: impl Into<Schedule>) -> LossOver<Y, X, T, M, P> {
        let schedule = schedule.into();
        self.over_each(method, move |_| schedule.clone())
    }

    /// Says how runs are taken: by a method over a schedule that depends on the parameters, as the map of a
    /// [jump](metriplectic_integrators::Watched::jump) or the threshold of an event. Jumps need
    /// [derivatives](metriplectic_integrators::Jumping::differentiable) for runs of a family.
    pub fn over_each<M>(
        self,
        method: M,
        schedule: impl Fn(&SVector<f64, P>) -> Schedule + Send + Sync + 'static,
    ) -> LossOver<Y, X, T, M, P> {
        LossOver { loss: self, method, schedule: Box::new(schedule) }
    }
}

/// A loss over runs by a method: a problem for argmin.
pub struct LossOver<Y, X, T, M, const P: usize> {
    loss: Loss<Y, X, T, P>,
    method: M,
    schedule: Box<AtParameters<P>>,
}

/// The schedule at values of the parameters.
type AtParameters<const P: usize> = dyn Fn(&SVector<f64, P>) -> Schedule + Send + Sync;

impl<Y, X, T, M, const P: usize> LossOver<Y, X, T, M, P> {
    /// The schedule at parameters, with outputs at the terms.
    fn schedule(&self, theta: &SVector<f64, P>) -> Schedule {
        (self.schedule)(theta).output_at(self.loss.times.iter().copied())
    }
}

impl<Y, X, T, M, const P: usize> fmt::Debug for LossOver<Y, X, T, M, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LossOver").field("loss", &self.loss).finish_non_exhaustive()
    }
}

/// A loss that is evaluated with its gradient. Law: the gradient is that of the value, over the steps of one run.
pub trait Graded<const P: usize> {
    /// Evaluates the loss.
    ///
    /// # Errors
    ///
    /// The error of a run, or [`Unpaired`](metriplectic_integrators::Unpaired) if a run ends before a term.
    fn evaluate(&self, theta: &SVector<f64, P>) -> Result<f64, Failure>;

    /// Evaluates the loss and its gradient along the parameters.
    ///
    /// # Errors
    ///
    /// The error of a run, or of its derivative.
    fn differentiate(&self, theta: &SVector<f64, P>) -> Result<(f64, SVector<f64, P>), Failure>;
}

impl<Y, T, M, const P: usize> Graded<P> for LossOver<&Y, Point<Y::System>, T, M, P>
where
    Y: Parametrised<P>,
    T: Fn(usize, usize, &PointOf<Y, Real, P>) -> Real,
    M: Clone + Stepper<Y::System> + LinearisedAlong<Y::System>,
{
    fn evaluate(&self, theta: &SVector<f64, P>) -> Result<f64, Failure> {
        let (system, schedule) = (self.loss.of.at_parameters(*theta), self.schedule(theta));
        let mut sum = 0.0;
        for (i, start) in self.loss.starts.iter().enumerate() {
            let run = |schedule| self.method.clone().run(&system, start.clone(), schedule);
            let run = at_rest_too(&schedule, run)?;
            for (k, index) in run.indices_at(&self.loss.times)?.into_iter().enumerate() {
                let point = &run.states()[index].point;
                sum += (self.loss.term)(i, k, &ManifoldOf::<Y, P>::constant(point)).re;
            }
        }
        Ok(sum)
    }

    fn differentiate(&self, theta: &SVector<f64, P>) -> Result<(f64, SVector<f64, P>), Failure> {
        let (system, schedule) = (self.loss.of.at_parameters(*theta), self.schedule(theta));
        let (mut sum, mut slope) = (0.0, SVector::zeros());
        for (i, start) in self.loss.starts.iter().enumerate() {
            let run = |schedule| self.method.clone().adjoint(&system, start.clone(), schedule);
            let run = at_rest_too(&schedule, run)?;
            // The terms of each state: at rest the last one has all that are left.
            let mut terms = vec![Vec::new(); run.states().len()];
            for (k, index) in run.indices_at(&self.loss.times)?.into_iter().enumerate() {
                terms[index].push(k);
            }
            let loss = run.gradient(|index, x| {
                let term = |sum: Real, k: &usize| sum + (self.loss.term)(i, *k, x);
                terms[index].iter().fold(Real::from(0.0), term)
            })?;
            sum += loss.value;
            slope += SVector::<f64, P>::from_column_slice(loss.along_parameters().as_slice());
        }
        Ok((sum, slope))
    }
}

impl<B, S, Error, T, M, const P: usize> LossOver<Systems<B, P>, Element<S>, T, M, P>
where
    B: Fn(&SVector<f64, P>) -> Result<S, Error>,
    S: Flow,
    Error: Into<Failure>,
    T: Fn(usize, usize, &Element<S>) -> f64,
    M: Clone + Stepper<S>,
{
    /// The terms of one run, summed.
    fn of_run(
        &self,
        i: usize,
        theta: &SVector<f64, P>,
        schedule: Schedule,
    ) -> Result<f64, Failure> {
        let system = self.loss.of.build(theta).map_err(Into::into)?;
        let run = self.method.clone().run(&system, self.loss.starts[i].clone(), schedule)?;
        let indices = run.indices_at(&self.loss.times)?.into_iter().enumerate();
        Ok(indices.map(|(k, at)| (self.loss.term)(i, k, &run.states()[at].point)).sum())
    }
}

impl<B, S, Error, T, M, const P: usize> Graded<P> for LossOver<Systems<B, P>, Element<S>, T, M, P>
where
    B: Fn(&SVector<f64, P>) -> Result<S, Error>,
    S: Flow,
    Error: Into<Failure>,
    T: Fn(usize, usize, &Element<S>) -> f64,
    M: Clone + Stepper<S>,
{
    fn evaluate(&self, theta: &SVector<f64, P>) -> Result<f64, Failure> {
        let over = self.schedule(theta);
        let of_run = |i| at_rest_too(&over, |schedule| self.of_run(i, theta, schedule));
        (0..self.loss.starts.len()).map(of_run).sum()
    }

    fn differentiate(&self, theta: &SVector<f64, P>) -> Result<(f64, SVector<f64, P>), Failure> {
        if let Some(k) = (0..P).find(|&k| theta[k] == 0.0) {
            return Err(FitError::NoSize { name: self.loss.of.names()[k] }.into());
        }
        let (mut sum, mut gradient) = (0.0, SVector::zeros());
        for i in 0..self.loss.starts.len() {
            let runs = Beside::default();
            let here =
                runs.first(&self.schedule(theta), |schedule| self.of_run(i, theta, schedule))?;
            for k in 0..P {
                let beside = sides(theta[k], theta[k].abs()).map(|side| {
                    let mut theta = *theta;
                    theta[k] = side;
                    let over = self.schedule(&theta);
                    let there = runs.next(&over, |schedule| self.of_run(i, &theta, schedule));
                    (side, there.map(|value| DVector::from_element(1, value)))
                });
                gradient[k] += slope((theta[k], &DVector::from_element(1, here)), beside)?[0];
            }
            sum += here;
        }
        Ok((sum, gradient))
    }
}

/// A minimum of a loss, as far as it was found.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Minimised<const P: usize> {
    /// The parameters of the least loss that was found.
    pub parameters: SVector<f64, P>,
    /// The loss there.
    pub value: f64,
    /// The iterations that were made.
    pub iterations: u64,
    /// The evaluations of the loss.
    pub losses: u64,
    /// The evaluations of its gradient.
    pub gradients: u64,
}

/// Pairs of differences that L-BFGS remembers.
const MEMORY: usize = 10;

impl<Y, X, T, M, const P: usize> LossOver<Y, X, T, M, P>
where
    Self: Graded<P>,
{
    /// Evaluates the loss.
    ///
    /// # Errors
    ///
    /// The error of a run, or [`Unpaired`](metriplectic_integrators::Unpaired) if a run ends before a term.
    pub fn value(&self, theta: &SVector<f64, P>) -> Result<f64, Failure> {
        self.evaluate(theta)
    }

    /// Evaluates the loss and its gradient along the parameters.
    ///
    /// # Errors
    ///
    /// The error of a run, or of its derivative, or [`Unpaired`](metriplectic_integrators::Unpaired) if a run ends before a term.
    pub fn gradient_at(&self, theta: &SVector<f64, P>) -> Result<(f64, SVector<f64, P>), Failure> {
        self.differentiate(theta)
    }

    /// Minimises the loss from a guess by argmin's L-BFGS, in at most so many iterations.
    ///
    /// Parameters without a run have an infinite loss. The search may end before its last iteration, at a minimum or where no step
    /// along the gradient lowers the loss any more.
    ///
    /// # Errors
    ///
    /// [`FitError::Guess`] if there is no run or no derivative at the guess.
    pub fn minimise(
        &self,
        guess: SVector<f64, P>,
        iterations: u64,
    ) -> Result<Minimised<P>, FitError> {
        let (value, mut slope) = self.gradient_at(&guess).map_err(FitError::Guess)?;
        let best = RefCell::new((value, guess));
        let [mut taken, mut losses, mut gradients] = [0, 0, 1];
        while taken < iterations {
            let (before, start) = *best.borrow();
            let problem = Watched { loss: self, best: &best, unit: unit(&start, &slope) };
            let solver = LBFGS::new(MoreThuenteLineSearch::new(), MEMORY);
            let start = start.as_slice().to_vec();
            let executor = Executor::new(problem, solver)
                .configure(|state| state.param(start).max_iters(iterations - taken));
            // A line search that finds no better point ends with an error: what was found counts.
            let [made, cost, gradient] = executor.run().map_or([0; 3], |found| {
                let count = |name: &str| found.problem.counts.get(name).copied().unwrap_or(0);
                [found.state().get_iter(), count("cost_count"), count("gradient_count")]
            });
            (taken, losses, gradients) =
                (taken + made.max(1), losses + cost, gradients + gradient + 1);
            let (after, here) = *best.borrow();
            // A search that has ended early begins again, with another unit.
            match self.gradient_at(&here) {
                Ok((_, next)) if after < before => slope = next,
                _ => break,
            }
        }
        let (value, parameters) = *best.borrow();
        Ok(Minimised { parameters, value, iterations: taken, losses, gradients })
    }
}

/// The length of the first step of a search, relative to the parameters.
const FIRST: f64 = 0.1;

/// The unit of the loss in which the first step of L-BFGS, which is the gradient, has a sensible length.
fn unit<const P: usize>(theta: &SVector<f64, P>, slope: &SVector<f64, P>) -> f64 {
    let (size, steep) = (theta.norm(), slope.norm());
    let length = FIRST * if size > 0.0 { size } else { 1.0 };
    if steep > 0.0 { steep / length } else { 1.0 }
}

/// The loss, with the best parameters that were tried.
struct Watched<'a, L, const P: usize> {
    loss: &'a L,
    best: &'a RefCell<(f64, SVector<f64, P>)>,
    unit: f64,
}

impl<L, const P: usize> CostFunction for Watched<'_, L, P>
where
    L: CostFunction<Param = Vec<f64>, Output = f64>,
{
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, theta: &Vec<f64>) -> Result<f64, Error> {
        let value = self.loss.cost(theta)?;
        if value < self.best.borrow().0 {
            *self.best.borrow_mut() = (value, SVector::from_column_slice(theta));
        }
        Ok(value / self.unit)
    }
}

impl<L, const P: usize> Gradient for Watched<'_, L, P>
where
    L: Gradient<Param = Vec<f64>, Gradient = Vec<f64>>,
{
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, theta: &Vec<f64>) -> Result<Vec<f64>, Error> {
        let gradient = self.loss.gradient(theta)?;
        Ok(gradient.iter().map(|slope| slope / self.unit).collect())
    }
}

impl<Y, X, T, M, const P: usize> CostFunction for LossOver<Y, X, T, M, P>
where
    Self: Graded<P>,
{
    type Param = Vec<f64>;
    type Output = f64;

    /// The loss; infinite where there is no run.
    fn cost(&self, theta: &Vec<f64>) -> Result<f64, Error> {
        let value = self.value(&SVector::from_column_slice(theta));
        Ok(value.ok().filter(|value| !value.is_nan()).unwrap_or(f64::INFINITY))
    }
}

impl<Y, X, T, M, const P: usize> Gradient for LossOver<Y, X, T, M, P>
where
    Self: Graded<P>,
{
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, theta: &Vec<f64>) -> Result<Vec<f64>, Error> {
        let found = self.gradient_at(&SVector::from_column_slice(theta));
        let (_, slope) = found.map_err(|error| Error::msg(error.to_string()))?;
        Ok(slope.as_slice().to_vec())
    }
}
