//! The residuals of runs, and those of a family of systems.

use metriplectic_dynamics::{Metriplectic, Parametrised, Point};
use metriplectic_fields::{Column as _, Dimension as _, Real, Space, Vector};
use metriplectic_integrators::tangent::{LinearisedAlong, TangentState};
use metriplectic_integrators::{Schedule, Stepper, Tangents as _, Watch as _};
use metriplectic_manifolds::Manifold as _;
use nalgebra::{DMatrix, DVector, SVector};
use num_dual::Dual64;

use crate::least_squares::{LeastSquares, Squares};
use crate::unknowns::{Unknown, parameters};

/// The manifold of the systems of a family.
pub(crate) type ManifoldOf<Y, const P: usize> =
    <<Y as Parametrised<P>>::System as Metriplectic>::Manifold;

/// A point of it at a scalar.
pub(crate) type PointOf<Y, D, const P: usize> = <ManifoldOf<Y, P> as Space>::Point<D>;

/// The data, and their times.
#[derive(Clone, Debug)]
pub(crate) struct Measured<const K: usize> {
    pub(crate) times: Vec<f64>,
    pub(crate) rows: Vec<SVector<f64, K>>,
    /// The noise of each column; 1 if it is not known.
    pub(crate) noise: [f64; K],
}

impl<const K: usize> Measured<K> {
    /// The mean square of the data in units of the noise.
    pub(crate) fn mean_square(&self) -> f64 {
        let squares = self.rows.iter().flat_map(|row| row.iter().zip(&self.noise));
        let sum: f64 = squares.map(|(number, noise)| (number / noise).powi(2)).sum();
        sum / (self.rows.len() * K) as f64
    }
}

/// The residuals `(o(x(t_i; θ)) − data_i)/σ` of a run.
pub(crate) struct Model<'a, Y: Parametrised<P>, M, F, const P: usize, const K: usize> {
    pub(crate) family: &'a Y,
    pub(crate) method: M,
    pub(crate) schedule: &'a dyn Fn(&SVector<f64, P>) -> Schedule,
    pub(crate) observe: &'a F,
    pub(crate) measured: &'a Measured<K>,
    pub(crate) unknowns: &'a [Unknown],
    pub(crate) guess: SVector<f64, P>,
    pub(crate) start: Point<Y::System>,
    /// Whether the coordinates of the start, in the chart at its guess, are unknowns too.
    pub(crate) free_start: bool,
}

/// The residuals `(o(x(t_i; θ)) − data_i)/σ` of runs, at unknowns.
pub(crate) trait Residuals<const P: usize>: LeastSquares {
    /// The residuals and their Jacobian, or why there are none.
    fn evaluate(&self, phi: &[f64]) -> Result<Squares, Failure>;

    /// The parameters, and the entries of the start.
    fn at(&self, phi: &[f64]) -> (SVector<f64, P>, Vec<f64>);

    /// The runs that an evaluation takes.
    fn runs(&self) -> u64 {
        1
    }
}

/// Runs up to the last datum, at rest too: the end of a run [until rest](Schedule::without_rest) jumps where a parameter changes its
/// steps. Where no run goes on at rest, it is the run until rest.
pub(crate) fn at_rest_too<R, E>(
    schedule: &Schedule,
    run: impl Fn(Schedule) -> Result<R, E>,
) -> Result<R, E> {
    match run(schedule.clone().without_rest()) {
        Err(_) if schedule.ends_at_rest() => run(schedule.clone()),
        run => run,
    }
}

/// Why a run failed.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

impl<Y, M, F, const P: usize, const K: usize> Model<'_, Y, M, F, P, K>
where
    Y: Parametrised<P>,
    M: Clone + Stepper<Y::System> + LinearisedAlong<Y::System>,
    F: Fn(&PointOf<Y, Real, P>) -> SVector<Real, K>,
{
    /// The dimension of the manifold.
    const N: usize = <ManifoldOf<Y, P> as Space>::Dim::LEN;

    /// The parameters and the start of unknowns.
    fn placed(&self, phi: &[f64]) -> (SVector<f64, P>, Point<Y::System>) {
        let theta = parameters(&self.guess, self.unknowns, phi);
        let start = match self.moved(phi) {
            Some(q) => ManifoldOf::<Y, P>::chart(&self.start, &q),
            None => self.start.clone(),
        };
        (theta, start)
    }

    /// The coordinates of the start.
    fn moved(&self, phi: &[f64]) -> Option<Vector<ManifoldOf<Y, P>>> {
        let first = self.unknowns.len();
        self.free_start.then(|| {
            Vector::<ManifoldOf<Y, P>>::from_index(|i| phi.get(first + i).copied().unwrap_or(0.0))
        })
    }

    /// The matrix from the coordinates of the start to the frame at it.
    fn frame(&self, phi: &[f64], start: &Point<Y::System>) -> Option<DMatrix<f64>> {
        let q = self.moved(phi)?;
        let mut frame = DMatrix::zeros(Self::N, Self::N);
        for k in 0..Self::N {
            let moved = Vector::<ManifoldOf<Y, P>, Dual64>::from_index(|i| {
                Dual64::new(q[i], if i == k { 1.0 } else { 0.0 })
            });
            let point = ManifoldOf::<Y, P>::chart(&self.start, &moved);
            let column = ManifoldOf::<Y, P>::coordinates(start, &point);
            for i in 0..Self::N {
                frame[(i, k)] = column[i].eps;
            }
        }
        Some(frame)
    }

    /// Evaluates what is observed at a state, with its derivatives along start and parameters.
    fn observed(&self, state: &TangentState<Y::System>) -> (SVector<f64, K>, DMatrix<f64>) {
        let seeded = ManifoldOf::<Y, P>::seeds(&state.point);
        let mut value = SVector::<f64, K>::zeros();
        let mut slope = DMatrix::zeros(K, Self::N);
        for i in (0..Self::N).step_by(2) {
            let observed = (self.observe)(&seeded(i, i + 1));
            for k in 0..K {
                value[k] = observed[k].re;
                slope[(k, i)] = observed[k].eps1;
                if i + 1 < Self::N {
                    slope[(k, i + 1)] = observed[k].eps2;
                }
            }
        }
        (value, slope * state.matrix())
    }

    /// The states at the times of the data. If no run goes on at rest, the last one stands for all later times.
    fn states(
        &self,
        (system, theta): (&Y::System, &SVector<f64, P>),
        start: &Point<Y::System>,
    ) -> Result<Vec<TangentState<Y::System>>, Failure> {
        let times = &self.measured.times;
        let schedule = (self.schedule)(theta).output_at(times.iter().copied());
        let run = |schedule| self.method.clone().tangent(system, start.clone(), schedule);
        let run = at_rest_too(&schedule, run)?;
        let indices = run.indices_at(times)?;
        Ok(indices.into_iter().map(|index| run.states()[index].clone()).collect())
    }
}

impl<Y, M, F, const P: usize, const K: usize> Residuals<P> for Model<'_, Y, M, F, P, K>
where
    Y: Parametrised<P>,
    M: Clone + Stepper<Y::System> + LinearisedAlong<Y::System>,
    F: Fn(&PointOf<Y, Real, P>) -> SVector<Real, K>,
{
    fn evaluate(&self, phi: &[f64]) -> Result<Squares, Failure> {
        let (theta, start) = self.placed(phi);
        let system = self.family.at_parameters(theta);
        let states = self.states((&system, &theta), &start)?;
        let (first, frame) = (self.unknowns.len(), self.frame(phi, &start));
        let all = first + if self.free_start { Self::N } else { 0 };
        let count = self.measured.rows.len() * K;
        let (mut residuals, mut jacobian) = (DVector::zeros(count), DMatrix::zeros(count, all));
        for (i, (state, row)) in states.iter().zip(&self.measured.rows).enumerate() {
            let (value, slope) = self.observed(state);
            let along_start = frame.as_ref().map(|frame| slope.columns(0, Self::N) * frame);
            for k in 0..K {
                let (line, sigma) = (i * K + k, self.measured.noise[k]);
                residuals[line] = (value[k] - row[k]) / sigma;
                for (j, unknown) in self.unknowns.iter().enumerate() {
                    let scale = unknown.slope(theta[unknown.index]) / sigma;
                    jacobian[(line, j)] = slope[(k, Self::N + unknown.index)] * scale;
                }
                for (j, along) in along_start
                    .iter()
                    .flat_map(|a| a.row(k).iter().copied().collect::<Vec<_>>())
                    .enumerate()
                {
                    jacobian[(line, first + j)] = along / sigma;
                }
            }
        }
        Ok(Squares { residuals, jacobian })
    }

    fn at(&self, phi: &[f64]) -> (SVector<f64, P>, Vec<f64>) {
        let (theta, start) = self.placed(phi);
        (theta, ManifoldOf::<Y, P>::entries(&start))
    }
}

impl<Y, M, F, const P: usize, const K: usize> LeastSquares for Model<'_, Y, M, F, P, K>
where
    Y: Parametrised<P>,
    M: Clone + Stepper<Y::System> + LinearisedAlong<Y::System>,
    F: Fn(&PointOf<Y, Real, P>) -> SVector<Real, K>,
{
    fn squares(&self, phi: &[f64]) -> Option<Squares> {
        self.evaluate(phi).ok()
    }
}
