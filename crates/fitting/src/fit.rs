//! Fits of the parameters of a system.

use std::cmp::Ordering;
use std::fmt;

use argmin::core::{Executor, State as _, TerminationReason};
use metriplectic_dynamics::{Differentiable, Parametrised, Point};
use metriplectic_fields::{Dimension as _, Real, Space};
use metriplectic_integrators::step::Element;
use metriplectic_integrators::tangent::{Fittable, LinearisedAlong};
use metriplectic_integrators::{Flow, Schedule, Stepper, Systems};
use nalgebra::{SMatrix, SVector};

use crate::bounds::{Bounds, WITHOUT, Which};
use crate::error::FitError;
use crate::fitted::{FLAT, Fitted, Parts, Stop};
use crate::least_squares::Squares;
use crate::levenberg_marquardt::LevenbergMarquardt;
use crate::model::{Failure, ManifoldOf, Measured, Model, PointOf, Residuals};
use crate::robust::Robust;
use crate::systems::Observed;
use crate::unknowns::{Names, Unknown, unknowns};

/// The longest step of a logarithm.
const STEEP: f64 = 3.0;

/// The noise, relative to the data, that the round-off of runs may be mistaken for.
const ROUNDED: f64 = 4096.0 * f64::EPSILON;

/// A fit of the parameters of a system to data, by least squares.
///
/// | of | the system | derivatives of the runs |
/// |---|---|---|
/// | [`Fit::of`] a [`Family`](metriplectic_dynamics::Family) | closed | exact, those of the discrete steps |
/// | [`Fit::of`] a family with [surroundings](metriplectic_integrators::FamilySurroundings) | with ports, baths, a clock or noise | differences of runs in the same steps |
/// | [`Fit::of_systems`] | of any kind: with ports, baths and noise, a lattice, one of your own | differences of runs in the same steps |
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
pub struct Fit<Y, const P: usize> {
    of: Y,
}

impl<Y, const P: usize> fmt::Debug for Fit<Y, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Fit").finish_non_exhaustive()
    }
}

impl<const P: usize> Fit<(), P> {
    /// Starts a fit of the parameters of a [`Family`](metriplectic_dynamics::Family), or of one with ports, baths, a clock or noise, whose
    /// derivatives are those of [`of_systems`](Fit::of_systems).
    pub fn of<Y: Fittable<P>>(family: &Y) -> Fit<Y::Systems<'_>, P> {
        Fit { of: family.systems() }
    }
}

impl<'a, Y: Parametrised<P>, const P: usize> Fit<&'a Y, P> {
    /// Says what was measured, as a closure of the state that returns `K` numbers. It is differentiated as a field is.
    pub fn observe<F, const K: usize>(
        self,
        observe: F,
    ) -> FitBuilder<&'a Y, F, FamilyStart<Point<Y::System>>, P, K>
    where
        F: Fn(&PointOf<Y, Real, P>) -> SVector<Real, K>,
    {
        FitBuilder { of: self.of, observe, start: None, options: Options::default() }
    }
}

impl<B, F, Error, const P: usize> Fit<Systems<B, P>, P>
where
    B: Fn(&SVector<f64, P>) -> Result<F, Error>,
    F: Flow,
    Error: Into<Failure>,
{
    /// Starts a fit of any system, from the names of its parameters and a closure that builds it at values of them.
    ///
    /// The system may have ports, baths, noise of a fixed seed, an energy in time; it may be a lattice or of a type of your own. Its
    /// derivatives along a parameter are central differences of runs in the [same steps](metriplectic_integrators::StepSequence), by
    /// `ε^{1/3}` of the parameter, or of its guess if that is larger: an evaluation takes `2P + 1` runs, and the derivatives have about
    /// ten digits. A closed system is better fitted by [`of`](Self::of) its [`Family`](metriplectic_dynamics::Family), whose derivatives
    /// are exact.
    ///
    /// ```
    /// use metriplectic_dynamics::{Bath, Contact, Symplectic, System};
    /// use metriplectic_fields::Real;
    /// use metriplectic_fitting::Fit;
    /// use metriplectic_integrators::{DormandPrince8, Method, OpenBuilder, OpenState, Span, Watch};
    /// use metriplectic_manifolds::Euclidean;
    /// use nalgebra::{Vector2, vector};
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// // A body on a spring that hardens, in air.
    /// let oscillator = |t: &Vector2<f64>| {
    ///     let (stiffness, friction) = (t.x, t.y);
    ///     System::on(Euclidean::<2>)
    ///         .bracket(Symplectic)
    ///         .energy(move |x: &Vector2<Real>| (x.y * x.y + x.x * x.x * stiffness) * 0.5 + x.x * x.x * x.x * x.x * 0.25)
    ///         .bath("air", Bath::at(0.7).friction(move |_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
    ///             [Contact { rate: friction.into(), along: vector![0.0.into(), 1.0.into()] }]
    ///         }))
    ///         .build()
    /// };
    /// let times: Vec<f64> = (1..=20).map(f64::from).collect();
    /// let span = Span::until(20.0).tolerance(1e-8);
    /// let truth = oscillator(&vector![1.5, 0.1])?;
    /// let start = truth.start(vector![1.0, 0.0]);
    /// let run = DormandPrince8.run(&truth, start, span.output_at(times.clone()))?;
    /// let data: Vec<_> = run.states()[1..].iter().map(|state| vector![state.point.x.x]).collect();
    ///
    /// let fit = Fit::of_systems(["stiffness", "friction"], oscillator)
    ///     .observe(|state: &OpenState<Vector2<f64>>| vector![state.x.x])
    ///     .data(&times, &data)
    ///     .start_from(|oscillator, _| oscillator.start(vector![1.0, 0.0]))
    ///     .run(DormandPrince8, span, vector![1.4, 0.05])?;
    /// println!("{fit}");
    /// assert!((fit.parameters[1] - 0.1).abs() < 1e-6);
    /// # Ok(())
    /// # }
    /// ```
    pub const fn of_systems(names: [&'static str; P], build: B) -> Self {
        Self { of: Systems::new(names, build) }
    }

    /// Says what was measured, as a closure of the state that returns `K` numbers: those of an open system may be its work and heat.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the fit, and a name for it would hide them"
    )]
    pub fn observe<O, const K: usize>(
        self,
        observe: O,
    ) -> FitBuilder<
        Systems<B, P>,
        impl Fn(&SVector<f64, P>, &Element<F>) -> SVector<f64, K>,
        SystemStart<F, P>,
        P,
        K,
    >
    where
        O: Fn(&Element<F>) -> SVector<f64, K>,
    {
        self.observe_with(move |_, x| observe(x))
    }

    /// Says what was measured, as a closure `|θ, x|` of the parameters too, such as those of a meter.
    pub fn observe_with<O, const K: usize>(
        self,
        observe: O,
    ) -> FitBuilder<Systems<B, P>, O, SystemStart<F, P>, P, K>
    where
        O: Fn(&SVector<f64, P>, &Element<F>) -> SVector<f64, K>,
    {
        FitBuilder { of: self.of, observe, start: None, options: Options::default() }
    }
}

/// The start of the runs of a family.
#[derive(Clone, Debug)]
pub struct FamilyStart<X> {
    point: X,
    /// True of a guess, which is fitted too.
    is_free: bool,
}

/// The start of the runs of other systems, which may depend on the system and on the parameters.
pub type SystemStart<S, const P: usize> = Box<dyn Fn(&S, &SVector<f64, P>) -> Element<S>>;

/// The numbers that are observed of a run at a time, with their derivatives along the parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Observation<const P: usize, const K: usize> {
    /// The numbers that are observed.
    pub value: SVector<f64, K>,
    /// The derivative of each number along each parameter.
    pub along: SMatrix<f64, K, P>,
}

/// Data, noise, parameters and solver of a fit.
#[derive(Clone, Debug)]
pub(crate) struct Options<const K: usize> {
    times: Vec<f64>,
    rows: Vec<SVector<f64, K>>,
    noise: Option<[f64; K]>,
    free: Names,
    positive: Names,
    bounds: Bounds,
    robust: Option<Robust>,
    iterations: u64,
    solver: LevenbergMarquardt,
}

impl<const K: usize> Default for Options<K> {
    fn default() -> Self {
        Self {
            times: Vec::new(),
            rows: Vec::new(),
            noise: None,
            free: Names::All,
            positive: Names::None,
            bounds: Bounds::default(),
            robust: None,
            iterations: 100,
            solver: LevenbergMarquardt::default(),
        }
    }
}

/// A fit in the making: each method replaces one part.
#[must_use = "a fit does nothing until `run` is called"]
pub struct FitBuilder<Y, F, X, const P: usize, const K: usize> {
    of: Y,
    observe: F,
    start: Option<X>,
    options: Options<K>,
}

impl<Y, F, X, const P: usize, const K: usize> fmt::Debug for FitBuilder<Y, F, X, P, K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FitBuilder")
            .field("rows", &self.options.rows.len())
            .field("free", &self.options.free)
            .finish_non_exhaustive()
    }
}

impl<Y, F, X, const P: usize, const K: usize> FitBuilder<Y, F, X, P, K> {
    fn with(self, options: impl FnOnce(Options<K>) -> Options<K>) -> Self {
        Self { options: options(self.options), ..self }
    }

    /// Sets the data: a row of `K` numbers for each time, in rising order.
    ///
    /// A state belongs to a row by its time. Runs go on at rest, up to the last row, although the schedule ends them
    /// [there](metriplectic_integrators::Until::until_rest): the residuals would jump with the steps. Where no run goes on, the state at
    /// rest stands for all later rows. A run that ends early in another way, at an event that stops it, is no run of the
    /// model: [`Unpaired`](metriplectic_integrators::Unpaired) names the row and the ending.
    pub fn data(self, times: &[f64], rows: &[SVector<f64, K>]) -> Self {
        let (times, rows) = (times.to_vec(), rows.to_vec());
        self.with(|options| Options { times, rows, ..options })
    }

    /// Sets the standard deviation of all numbers. Without it, it is estimated from the residuals.
    pub fn noise(self, sigma: f64) -> Self {
        self.noise_each([sigma; K])
    }

    /// Sets the standard deviation of each column.
    pub fn noise_each(self, sigma: [f64; K]) -> Self {
        self.with(|options| Options { noise: Some(sigma), ..options })
    }

    /// Frees these parameters, and fixes the others at their guess. Without it all are free.
    pub fn free<T: Into<String>>(self, names: impl IntoIterator<Item = T>) -> Self {
        let free = Names::Some(names.into_iter().map(Into::into).collect());
        self.with(|options| Options { free, ..options })
    }

    /// Fits the logarithms of these parameters, so that they stay positive.
    pub fn positive<T: Into<String>>(self, names: impl IntoIterator<Item = T>) -> Self {
        let positive = Names::Some(names.into_iter().map(Into::into).collect());
        self.with(|options| Options { positive, ..options })
    }

    /// Fits the logarithms of all parameters.
    pub fn positive_all(self) -> Self {
        self.with(|options| Options { positive: Names::All, ..options })
    }

    /// Keeps a parameter, given by its name or by its place, between two numbers, each of which may be infinite. No run is taken outside
    /// of them. A guess outside is [refused](FitError::OutOfBounds) and not moved; bounds that are no interval are
    /// [refused](FitError::Bounds) too.
    ///
    /// A parameter that ends at a bound beyond which the residuals still fall has the bits of the bound, and no standard error: it is
    /// NaN, and [`Estimate::held`](crate::Estimate::held) and the text of the fit say so. The errors of the others are those of a fit with
    /// the parameter fixed there.
    ///
    /// ```
    /// # use metriplectic_dynamics::Family;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_fitting::{Bound, Fit};
    /// # use metriplectic_integrators::{DormandPrince8, Span};
    /// # use metriplectic_manifolds::Euclidean;
    /// # use nalgebra::{Vector1, Vector2, vector};
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// // x' = −k x, with the energy y; measured is the decay of k = 1.
    /// let decay = Family::on(Euclidean::<2>)
    ///     .parameters(["rate"])
    ///     .energy(|x: &Vector2<Real>, _: &Vector1<Real>| x.y)
    ///     .entropy(|x: &Vector2<Real>, t: &Vector1<Real>| -(x.x * x.x * t.x * 0.5))
    ///     .build()?;
    /// let times = [0.5, 1.0, 1.5, 2.0];
    /// let fit = Fit::of(&decay)
    ///     .observe(|x: &Vector2<Real>| vector![x.x])
    ///     .data(&times, &times.map(|t| vector![f64::exp(-t)]))
    ///     .start_at(vector![1.0, 0.0])
    ///     .between("rate", 0.0, 0.8)
    ///     .run(DormandPrince8, Span::until(2.0).tolerance(1e-8), vector![0.5])?;
    /// assert_eq!((fit.parameters[0], fit.estimates[0].held), (0.8, Some(Bound::Upper)));
    /// assert!(fit.to_string().contains("held at its upper bound"));
    /// # Ok(())
    /// # }
    /// ```
    pub fn between(self, which: impl Into<Which>, lower: f64, upper: f64) -> Self {
        let which = which.into();
        self.with(|mut options| {
            options.bounds.set(which, [lower, upper]);
            options
        })
    }

    /// Minimises a loss that outliers move little in place of the sum of squares, with a scale in units of the noise, or of the data if
    /// no noise is given. Standard errors are those of Huber (1973), and need no known noise. A scale that is not positive and finite is
    /// [refused](FitError::Scale).
    ///
    /// ```
    /// # use metriplectic_dynamics::Family;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_fitting::{Fit, Robust};
    /// # use metriplectic_integrators::{DormandPrince8, Span};
    /// # use metriplectic_manifolds::Euclidean;
    /// # use nalgebra::{Vector1, Vector2, vector};
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let decay = Family::on(Euclidean::<2>)
    /// #     .parameters(["rate"])
    /// #     .energy(|x: &Vector2<Real>, _: &Vector1<Real>| x.y)
    /// #     .entropy(|x: &Vector2<Real>, t: &Vector1<Real>| -(x.x * x.x * t.x * 0.5))
    /// #     .build()?;
    /// let times = [0.5, 1.0, 1.5, 2.0];
    /// let mut data = times.map(|t| vector![f64::exp(-t)]);
    /// data[2].x += 1.0; // a slip of the pen
    /// let fit = Fit::of(&decay)
    ///     .observe(|x: &Vector2<Real>| vector![x.x])
    ///     .data(&times, &data)
    ///     .start_at(vector![1.0, 0.0])
    ///     .robust(Robust::Cauchy(0.01))
    ///     .run(DormandPrince8, Span::until(2.0).tolerance(1e-8), vector![0.9])?;
    /// assert!((fit.parameters[0] - 1.0).abs() < 1e-3);
    /// # Ok(())
    /// # }
    /// ```
    pub fn robust(self, loss: Robust) -> Self {
        self.with(|options| Options { robust: Some(loss), ..options })
    }

    /// Replaces the options of the solver.
    pub fn solver(self, solver: LevenbergMarquardt) -> Self {
        self.with(|options| Options { solver, ..options })
    }

    /// Sets the most iterations, 100 without it.
    pub fn iterations(self, iterations: u64) -> Self {
        self.with(|options| Options { iterations, ..options })
    }
}

impl<Y, F, const P: usize, const K: usize> FitBuilder<&Y, F, FamilyStart<Point<Y::System>>, P, K>
where
    Y: Parametrised<P>,
    F: Fn(&PointOf<Y, Real, P>) -> SVector<Real, K>,
{
    /// Sets the state at the start, which is known.
    pub fn start_at(self, x0: Point<Y::System>) -> Self {
        Self { start: Some(FamilyStart { point: x0, is_free: false }), ..self }
    }

    /// Sets a guess of the state at the start, which is fitted too.
    pub fn free_start(self, x0: Point<Y::System>) -> Self {
        Self { start: Some(FamilyStart { point: x0, is_free: true }), ..self }
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
        let schedule = schedule.into();
        self.run_each(method, |_| schedule.clone(), guess)
    }

    /// Finds the parameters as [`run`](Self::run) does, over a schedule that depends on them: on the restitution of a jump, or on the
    /// threshold of a switch.
    ///
    /// A ball bounces, and its height is measured. The restitution is a parameter of the map of the jump alone:
    ///
    /// ```
    /// use metriplectic_dynamics::{Family, Symplectic};
    /// use metriplectic_fields::Real;
    /// use metriplectic_fitting::Fit;
    /// use metriplectic_integrators::{DormandPrince8, Method, Schedule, Span, Watch};
    /// use metriplectic_manifolds::Euclidean;
    /// use nalgebra::{Vector1, Vector2, vector};
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let ball = Family::on(Euclidean::<2>)
    ///     .parameters(["restitution"])
    ///     .bracket(Symplectic)
    ///     .energy(|x: &Vector2<Real>, _: &Vector1<Real>| x.y * x.y * 0.5 + x.x)
    ///     .build()?;
    /// type Wide = (Vector2<Real>, Vector1<Real>);
    /// let bounces = |e: &Vector1<f64>| -> Schedule {
    ///     let e = e.x;
    ///     Span::until(4.0)
    ///         .tolerance(1e-9)
    ///         .event("floor", |x: &Vector2<f64>| x.x)
    ///         .falling()
    ///         .jump(move |_, x: &Vector2<f64>| vector![x.x, -e * x.y])
    ///         .differentiable(|_, (x, _): &Wide| x.x, |_, (x, e): &Wide| (vector![x.x, -e.x * x.y], *e))
    ///         .into()
    /// };
    /// let (start, times) = (vector![0.5, 0.0], [1.2, 1.6, 2.0, 2.4, 2.8, 3.2, 3.6, 4.0]);
    /// let run = DormandPrince8.run(&ball.at(vector![0.8]), start, bounces(&vector![0.8]).output_at(times))?;
    /// let rows: Vec<_> = run.states()[1..].iter().map(|s| vector![(s.point.x * 1e3).round() / 1e3]).collect();
    ///
    /// let fit = Fit::of(&ball)
    ///     .observe(|x: &Vector2<Real>| vector![x.x])
    ///     .data(&times, &rows)
    ///     .start_at(start)
    ///     .run_each(DormandPrince8, bounces, vector![0.75])?;
    /// let error = fit.estimates[0].standard_error;
    /// assert!((fit.parameters[0] - 0.8).abs() < 4.0 * error && error < 1e-3);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// [`FitError`].
    pub fn run_each<M>(
        self,
        method: M,
        schedule: impl Fn(&SVector<f64, P>) -> Schedule,
        guess: SVector<f64, P>,
    ) -> Result<Fitted, FitError>
    where
        M: Clone + Stepper<Y::System> + LinearisedAlong<Y::System>,
    {
        self.options.check()?;
        let Self { of: family, observe, start, options } = self;
        let Some(FamilyStart { point: start, is_free }) = start else {
            return Err(FitError::Solver(
                "no start was given; say `start_at` or `free_start`".into(),
            ));
        };
        let known = family.at_parameters(guess).parameters().to_vec();
        let unknowns = options.unknowns(&known, guess.as_slice())?;
        let measured = options.measured();
        let model = Model {
            family,
            method,
            schedule: &schedule,
            observe: &observe,
            measured: &measured,
            unknowns: &unknowns,
            guess,
            start,
            free_start: is_free,
        };
        let coordinates = if is_free { <ManifoldOf<Y, P> as Space>::Dim::LEN } else { 0 };
        options.nearest(&model, &measured, &unknowns, (guess, coordinates))
    }
}

impl<B, S, Error, F, const P: usize, const K: usize>
    FitBuilder<Systems<B, P>, F, SystemStart<S, P>, P, K>
where
    B: Fn(&SVector<f64, P>) -> Result<S, Error>,
    S: Flow,
    Error: Into<Failure>,
    F: Fn(&SVector<f64, P>, &Element<S>) -> SVector<f64, K>,
{
    /// Sets the state at the start, which is known.
    pub fn start_at(self, x0: Element<S>) -> Self
    where
        Element<S>: 'static,
    {
        self.start_from(move |_, _| x0.clone())
    }

    /// Sets the state at the start as a function `|system, θ| x₀` of the system, which begins the ledger of an open one, and of the
    /// parameters, some of which may be entries of the start.
    pub fn start_from(self, start: impl Fn(&S, &SVector<f64, P>) -> Element<S> + 'static) -> Self {
        Self { start: Some(Box::new(start)), ..self }
    }

    /// Evaluates what is observed at some times, with its derivatives along all parameters, at values of them that are not zero. Entries of
    /// the start are parameters too, if the start [says so](Self::start_from).
    ///
    /// ```
    /// # use metriplectic_dynamics::{Symplectic, System};
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_fitting::Fit;
    /// # use metriplectic_integrators::{Gauss, Span};
    /// # use metriplectic_manifolds::Euclidean;
    /// # use nalgebra::{Vector2, vector};
    /// # fn main() -> Result<(), metriplectic_fitting::FitError> {
    /// // The height of a ball, along the gravity and along the velocity with which it is thrown.
    /// let found = Fit::of_systems(["gravity", "thrown"], |t: &Vector2<f64>| {
    ///     let g = t.x;
    ///     System::on(Euclidean::<2>)
    ///         .bracket(Symplectic)
    ///         .energy(move |x: &Vector2<Real>| x.y * x.y * 0.5 + x.x * g)
    ///         .build()
    /// })
    /// .observe(|x| vector![x.x])
    /// .start_from(|_, t| vector![0.0, t.y])
    /// .derivatives(Gauss::<2>, Span::steps(0.1, 20), vector![9.8, 5.0], &[1.0, 2.0])?;
    /// assert!((found[1].along - nalgebra::matrix![-2.0, 2.0]).norm() < 1e-8);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// [`FitError`]; [`FitError::NoSize`] for a parameter that is zero.
    pub fn derivatives<M>(
        self,
        method: M,
        schedule: impl Into<Schedule>,
        theta: SVector<f64, P>,
        times: &[f64],
    ) -> Result<Vec<Observation<P, K>>, FitError>
    where
        M: Clone + Stepper<S>,
    {
        let rows = vec![SVector::zeros(); times.len()];
        let options = Options { times: times.to_vec(), rows, ..Options::default() };
        let schedule = schedule.into();
        let schedule = move |_: &SVector<f64, P>| schedule.clone();
        Self { options, ..self }.runs(method, &schedule, theta, |model, _| {
            let phi: Vec<f64> = theta.iter().copied().collect();
            let Squares { residuals, jacobian } = model.evaluate(&phi).map_err(FitError::Guess)?;
            let observation = |i: usize| Observation {
                value: SVector::from_fn(|k, _| residuals[i * K + k]),
                along: SMatrix::from_fn(|k, j| jacobian[(i * K + k, j)]),
            };
            Ok((0..times.len()).map(observation).collect())
        })
    }

    /// Finds the parameters with which runs by a method over a schedule come nearest to the data, from a guess.
    ///
    /// The runs should be more accurate than the noise: an error of the runs is an error of the parameters that no
    /// standard error shows.
    ///
    /// # Errors
    ///
    /// [`FitError`]; [`FitError::NoSize`] for a parameter whose guess is zero.
    pub fn run<M>(
        self,
        method: M,
        schedule: impl Into<Schedule>,
        guess: SVector<f64, P>,
    ) -> Result<Fitted, FitError>
    where
        M: Clone + Stepper<S>,
    {
        let schedule = schedule.into();
        self.run_each(method, |_| schedule.clone(), guess)
    }

    /// Finds the parameters as [`run`](Self::run) does, over a schedule that depends on them: on the restitution of a jump, or on the
    /// threshold of a switch.
    ///
    /// # Errors
    ///
    /// The errors of [`run`](Self::run).
    pub fn run_each<M>(
        self,
        method: M,
        schedule: impl Fn(&SVector<f64, P>) -> Schedule,
        guess: SVector<f64, P>,
    ) -> Result<Fitted, FitError>
    where
        M: Clone + Stepper<S>,
    {
        let with = |model: &Observed<'_, B, S, M, F, P, K>, options: Options<K>| {
            options.nearest(model, model.measured, model.unknowns, (guess, 0))
        };
        self.runs(method, &schedule, guess, with)
    }

    /// Looks at the data, and calls `f` with the runs at unknowns.
    fn runs<M, T>(
        self,
        method: M,
        schedule: &dyn Fn(&SVector<f64, P>) -> Schedule,
        guess: SVector<f64, P>,
        f: impl FnOnce(&Observed<'_, B, S, M, F, P, K>, Options<K>) -> Result<T, FitError>,
    ) -> Result<T, FitError> {
        self.options.check()?;
        let Self { of: systems, observe, start, options } = self;
        let Some(start) = start else {
            return Err(FitError::Solver(
                "no start was given; say `start_at` or `start_from`".into(),
            ));
        };
        let unknowns = options.unknowns(systems.names(), guess.as_slice())?;
        let without = |unknown: &&Unknown| guess[unknown.index] == 0.0;
        if let Some(Unknown { name, .. }) = unknowns.iter().find(without) {
            return Err(FitError::NoSize { name });
        }
        let measured = options.measured();
        let model = Observed {
            systems: &systems,
            method,
            schedule,
            observe: &observe,
            measured: &measured,
            unknowns: &unknowns,
            guess,
            start: &*start,
        };
        f(&model, options)
    }
}

/// The bounds of unknowns and of so many coordinates; none if all are infinite.
fn bounds(unknowns: &[Unknown], coordinates: usize) -> Vec<[f64; 2]> {
    let mut bounds: Vec<[f64; 2]> = unknowns.iter().map(Unknown::range).collect();
    if bounds.iter().flatten().all(|bound| bound.is_infinite()) {
        return Vec::new();
    }
    bounds.extend(vec![WITHOUT; coordinates]);
    bounds
}

impl<const K: usize> Options<K> {
    fn measured(&self) -> Measured<K> {
        let (times, rows) = (self.times.clone(), self.rows.clone());
        Measured { times, rows, noise: self.noise.unwrap_or([1.0; K]) }
    }

    fn unknowns(&self, known: &[&'static str], guess: &[f64]) -> Result<Vec<Unknown>, FitError> {
        unknowns(known, guess, [&self.free, &self.positive], &self.bounds)
    }

    /// Finds the least sum of squares from a guess, with so many coordinates of the start beside the parameters.
    fn nearest<const P: usize>(
        self,
        model: &impl Residuals<P>,
        measured: &Measured<K>,
        unknowns: &[Unknown],
        (guess, coordinates): (SVector<f64, P>, usize),
    ) -> Result<Fitted, FitError> {
        let mut phi: Vec<f64> = unknowns.iter().map(|u| u.of(guess[u.index])).collect();
        phi.extend(vec![0.0; coordinates]);
        let data = measured.rows.len() * K;
        if data <= phi.len() {
            return Err(FitError::TooFewData { data, unknowns: phi.len() });
        }
        model.evaluate(&phi).map_err(FitError::Guess)?;
        // A factor of e⁻³ in a step: the slope of a logarithm vanishes with its parameter.
        let limit = |u: &Unknown| if u.positive { STEEP } else { f64::INFINITY };
        let mut solver = self.solver;
        if solver.limits.is_empty() {
            solver.limits = unknowns.iter().map(limit).collect();
        }
        solver.bounds = bounds(unknowns, coordinates);
        solver.robust = self.robust.or(solver.robust);
        let executor = Executor::new(model, solver)
            .configure(|state| state.param(phi).max_iters(self.iterations));
        let found = executor.run().map_err(|error| FitError::Solver(error.to_string()))?;
        let evaluations = 1 + found.problem.counts.get("squares").copied().unwrap_or(0);
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
        let held = found.solver.held(&squares, &best);
        let free = best.len() - held.iter().flatten().count();
        // A promise that no trial has kept, or that none was left for.
        let variance = match found.solver.robust {
            Some(loss) => loss.spread(squares.residuals.as_slice(), free).scaled,
            None => squares.sum() / (data - free) as f64,
        };
        let variance = variance.max(ROUNDED * ROUNDED * measured.mean_square());
        let runs = |evaluations: u64| evaluations * model.runs();
        if found.solver.relevant(&squares, &best).promised() > FLAT * variance {
            let (runs, chi_squared) = (
                usize::try_from(runs(evaluations)).unwrap_or(usize::MAX),
                found.solver.sum(&squares),
            );
            return Err(FitError::NotConverged { runs, chi_squared, parameters });
        }
        Ok(Fitted::new(Parts {
            unknowns,
            phi: &best,
            squares: &squares,
            parameters,
            start,
            noise_is_known: self.noise.is_some(),
            runs: runs(evaluations + 1),
            stop,
            held,
            robust: found.solver.robust,
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
        if let Some(loss) = self.robust.or(self.solver.robust) {
            loss.check()?;
        }
        let bad = |sigma: &f64| !(*sigma > 0.0 && sigma.is_finite());
        match self.noise.and_then(|noise| noise.iter().position(bad).map(|k| (k, noise[k]))) {
            Some((column, sigma)) => Err(FitError::Noise { column, sigma }),
            None => Ok(()),
        }
    }
}
