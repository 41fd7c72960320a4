//! The residuals of systems of any kind, and differences of their runs.
//!
//! The derivative of an observed number `o` along an unknown `φ` is the central difference
//!
//! ```math
//! \partial_\varphi o \approx \frac{o(\varphi + \delta) - o(\varphi - \delta)}{2\delta} , \qquad \delta = \epsilon^{1/3} s ,
//! ```
//!
//! of two runs in the steps of a third one at `φ` ([`StepSequence`]; Bock 1981). `s` is the size of the parameter, or 1 for a logarithm.
//! Round-off and truncation are both about `ε^{2/3}` of it. No run is taken outside of the bounds of a parameter: beside one the
//! derivative is that of the parabola through `φ` and two points inside.

use metriplectic_integrators::step::Element;
use metriplectic_integrators::{
    Flow, Method as _, Schedule, StateSpace as _, StepSequence, Stepper, Systems, Watch as _,
};
use nalgebra::{DMatrix, DVector, SVector};

use crate::least_squares::{LeastSquares, Squares};
use crate::model::{Failure, Measured, Residuals, at_rest_too};
use crate::unknowns::{Unknown, parameters};

/// A run, and those beside it in the same steps.
#[derive(Default)]
pub(crate) struct Beside {
    sequence: StepSequence,
}

impl Beside {
    /// The run that chooses the steps.
    pub(crate) fn first<R, E>(
        &self,
        schedule: &Schedule,
        run: impl Fn(Schedule) -> Result<R, E>,
    ) -> Result<R, E> {
        at_rest_too(schedule, |schedule| run(schedule.noting(&self.sequence)))
    }

    /// A run that takes them.
    pub(crate) fn next<R, E>(
        &self,
        schedule: &Schedule,
        run: impl Fn(Schedule) -> Result<R, E>,
    ) -> Result<R, E> {
        at_rest_too(schedule, |schedule| run(schedule.taking(&self.sequence)))
    }
}

/// A number, and those on both sides of it at a distance of which sums and differences have the same digits.
pub(crate) fn sides(at: f64, size: f64) -> [f64; 2] {
    let step = f64::EPSILON.cbrt() * size;
    [at + step, at - step]
}

/// The slope of numbers between the sides of `at`. Where one side has no run, the slope on the other side.
pub(crate) fn slope(
    (at, here): (f64, &DVector<f64>),
    [(above, after), (below, before)]: [(f64, Result<DVector<f64>, Failure>); 2],
) -> Result<DVector<f64>, Failure> {
    match (after, before) {
        (Ok(after), Ok(before)) => Ok((after - before) / (above - below)),
        (Ok(after), Err(_)) => Ok((after - here) / (above - at)),
        (Err(_), Ok(before)) => Ok((here - before) / (at - below)),
        (Err(failure), Err(_)) => Err(failure),
    }
}

/// The points for a difference within bounds: the sides, or two at equal distances on the side with more room.
fn sides_within(at: f64, size: f64, [lower, upper]: [f64; 2]) -> [f64; 2] {
    let sides = sides(at, size);
    if sides.iter().all(|side| lower <= *side && *side <= upper) {
        return sides;
    }
    let step = sides[0] - at;
    let (end, step) = if upper - at >= at - lower { (upper, step) } else { (lower, -step) };
    if step.abs() * 2.0 <= (end - at).abs() {
        [at + step, at + 2.0 * step]
    } else {
        [0.5 * (at + end), end]
    }
}

/// The slope at `at` of the parabola through its numbers and those at two points on one side of it. Where one of them has no run, the
/// slope to the other one.
fn slope_on_one_side(
    (at, here): (f64, &DVector<f64>),
    [(near, first), (far, second)]: [(f64, Result<DVector<f64>, Failure>); 2],
) -> Result<DVector<f64>, Failure> {
    let (a, b) = (near - at, far - at);
    match (first, second) {
        (Ok(first), Ok(second)) => {
            Ok(((first - here) * (b * b) - (second - here) * (a * a)) / (a * b * (b - a)))
        }
        (Ok(first), Err(_)) => Ok((first - here) / a),
        (Err(_), Ok(second)) => Ok((second - here) / b),
        (Err(failure), Err(_)) => Err(failure),
    }
}

/// The residuals `(o(x(t_i; θ)) − data_i)/σ` of runs of systems of any kind.
pub(crate) struct Observed<'a, B, S: Flow, M, F, const P: usize, const K: usize> {
    pub(crate) systems: &'a Systems<B, P>,
    pub(crate) method: M,
    pub(crate) schedule: &'a dyn Fn(&SVector<f64, P>) -> Schedule,
    pub(crate) observe: &'a F,
    pub(crate) measured: &'a Measured<K>,
    pub(crate) unknowns: &'a [Unknown],
    pub(crate) guess: SVector<f64, P>,
    pub(crate) start: &'a dyn Fn(&S, &SVector<f64, P>) -> Element<S>,
}

impl<B, S, Error, M, F, const P: usize, const K: usize> Observed<'_, B, S, M, F, P, K>
where
    B: Fn(&SVector<f64, P>) -> Result<S, Error>,
    S: Flow,
    Error: Into<Failure>,
    M: Clone + Stepper<S>,
    F: Fn(&SVector<f64, P>, &Element<S>) -> SVector<f64, K>,
{
    /// The residuals of a run over a schedule.
    fn residuals(&self, phi: &[f64], schedule: Schedule) -> Result<DVector<f64>, Failure> {
        let theta = parameters(&self.guess, self.unknowns, phi);
        let system = self.systems.build(&theta).map_err(Into::into)?;
        let Measured { times, rows, noise } = self.measured;
        let start = (self.start)(&system, &theta);
        let run = self.method.clone().run(&system, start, schedule)?;
        let mut residuals = DVector::zeros(rows.len() * K);
        for (i, index) in run.indices_at(times)?.into_iter().enumerate() {
            let observed = (self.observe)(&theta, &run.states()[index].point);
            for k in 0..K {
                residuals[i * K + k] = (observed[k] - rows[i][k]) / noise[k];
            }
        }
        Ok(residuals)
    }
}

impl<B, S, Error, M, F, const P: usize, const K: usize> Residuals<P>
    for Observed<'_, B, S, M, F, P, K>
where
    B: Fn(&SVector<f64, P>) -> Result<S, Error>,
    S: Flow,
    Error: Into<Failure>,
    M: Clone + Stepper<S>,
    F: Fn(&SVector<f64, P>, &Element<S>) -> SVector<f64, K>,
{
    fn evaluate(&self, phi: &[f64]) -> Result<Squares, Failure> {
        let schedule = |phi: &[f64]| {
            let schedule = (self.schedule)(&parameters(&self.guess, self.unknowns, phi));
            schedule.output_at(self.measured.times.iter().copied())
        };
        let runs = Beside::default();
        let residuals = runs.first(&schedule(phi), |schedule| self.residuals(phi, schedule))?;
        let mut jacobian = DMatrix::zeros(residuals.len(), phi.len());
        for (j, unknown) in self.unknowns.iter().enumerate() {
            let guess = self.guess[unknown.index];
            let size = if unknown.positive { 1.0 } else { phi[j].abs().max(guess.abs()) };
            let points = sides_within(phi[j], size, unknown.range());
            let beside = points.map(|side| {
                let mut phi = phi.to_vec();
                phi[j] = side;
                (side, runs.next(&schedule(&phi), |schedule| self.residuals(&phi, schedule)))
            });
            let is_between = (points[0] - phi[j]) * (points[1] - phi[j]) < 0.0;
            let slope = if is_between { slope } else { slope_on_one_side };
            jacobian.set_column(j, &slope((phi[j], &residuals), beside)?);
        }
        Ok(Squares { residuals, jacobian })
    }

    fn at(&self, phi: &[f64]) -> (SVector<f64, P>, Vec<f64>) {
        let theta = parameters(&self.guess, self.unknowns, phi);
        let system = self.systems.build(&theta).ok();
        let start = system.map(|system| S::Space::numbers(&(self.start)(&system, &theta)));
        (theta, start.unwrap_or_default())
    }

    fn runs(&self) -> u64 {
        1 + 2 * self.unknowns.len() as u64
    }
}

impl<B, S, Error, M, F, const P: usize, const K: usize> LeastSquares
    for Observed<'_, B, S, M, F, P, K>
where
    B: Fn(&SVector<f64, P>) -> Result<S, Error>,
    S: Flow,
    Error: Into<Failure>,
    M: Clone + Stepper<S>,
    F: Fn(&SVector<f64, P>, &Element<S>) -> SVector<f64, K>,
{
    fn squares(&self, phi: &[f64]) -> Option<Squares> {
        self.evaluate(phi).ok()
    }
}
