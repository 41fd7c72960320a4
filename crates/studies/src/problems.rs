//! The problems that orders and energies are measured on: every manifold, bracket and kind of metric,
//! none of them linear or separable.
//!
//! A problem is visited by a [`Study`], because each is of a type of its own. The functions that visit all
//! of them are marked `#[inline]`: their code is large, and is made where it is called, not here.

use std::f64::consts::FRAC_1_SQRT_2;

use metriplectic_dynamics::{
    AreaForm, MetricDissipation, Metriplectic, Nambu, Scaled, SecondLaw, Symplectic, System, Zero,
    system::Point,
};
use metriplectic_fields::{ChartPoint, Column, Real, Space, Vector};
use metriplectic_integrators::{Certificate, Method as _, Run, Scheme, Span};
use metriplectic_manifolds::{
    Canonical, Cayley, ChartMidpoint, Euclidean, Exponential, HalfLine, LieDual, Manifold, Metric,
    Product, Projection, Retraction, Riemannian as _, Rotations, Sphere, WeylMidpoint, rotations,
};
use nalgebra::{Matrix2, Matrix3, SVector, Vector1, Vector2, Vector3, Vector6, vector};
use num_dual::DualNum;

use crate::{Compared, Convergence, Either};

/// A system with a start, and names for tables.
#[derive(Clone, Debug)]
pub struct Problem<Y: Metriplectic> {
    /// What it is.
    pub name: &'static str,
    /// Where it lives, as a formula.
    pub manifold: &'static str,
    /// The metric in words.
    pub metric: &'static str,
    /// The system.
    pub system: Y,
    /// Its start.
    pub start: Point<Y>,
    /// The time over which errors are measured.
    pub time: f64,
    /// Where a step may be long, and its size: points, by their coordinates in the chart at the start,
    /// and for each retraction one at least from which a step spans two radians.
    pub strides: Vec<(Vector<Y::Manifold>, f64)>,
}

impl<Y: Metriplectic> Problem<Y> {
    /// The distance of a point from another one, by their entries.
    pub fn distance(x: &Point<Y>, y: &Point<Y>) -> f64 {
        let (x, y) = (Y::Manifold::entries(x), Y::Manifold::entries(y));
        x.iter().zip(y).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    }
}

/// The unit of energy of every problem: its entries and the terms of its `H` are of this size, and `H`, a sum
/// of terms of both signs, may be nearly zero. So an error is relative to `|H|`, or to this where it is larger.
const UNIT_OF_ENERGY: f64 = 1.0;

/// An error of the energy relative to the size of the energy.
fn relative(error: f64, energy: f64) -> f64 {
    error.abs() / energy.abs().max(UNIT_OF_ENERGY)
}

/// What is done with every problem, and each of the retractions that its manifold has.
pub trait Study {
    /// Called once for each problem and retraction; `order` is what theory says.
    fn visit<Y, R>(
        &mut self,
        problem: &Problem<Y>,
        scheme: &'static str,
        retraction: R,
        order: f64,
    ) where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric> + Copy;
}

/// The flow of the velocity `Π dH + K dS` over `time`, by another method: the classical Runge-Kutta method of order 4 in a
/// chart around each step's start (Munthe-Kaas 1998), with steps so small that what is left is
/// round-off; `None` if it leaves the domain.
pub fn flow<Y: Metriplectic>(system: &Y, start: &Point<Y>, time: f64) -> Option<Point<Y>> {
    const STEPS: u32 = 2000;
    let h = time / f64::from(STEPS);
    let velocity = |x: &Point<Y>, q: Vector<Y::Manifold>| {
        system.velocity(&ChartPoint { base: x.clone(), q }).ok()
    };
    (0..STEPS).try_fold(start.clone(), |x, _| {
        let a = velocity(&x, Vector::<Y::Manifold>::zero())?;
        let b = velocity(&x, a * (0.5 * h))?;
        let c = velocity(&x, b * (0.5 * h))?;
        let d = velocity(&x, c * h)?;
        let q = (a + (b + c) * 2.0 + d) * (h / 6.0);
        q.is_finite().then(|| Y::Manifold::chart(&x, &q))
    })
}

/// The orders of every scheme on the problems that are visited, and how well the energy was kept.
#[derive(Clone, Debug, PartialEq)]
pub struct Orders {
    coarsest: u32,
    /// A study for each problem and scheme.
    pub studies: Vec<Convergence>,
    /// The order that theory gives for each of them.
    pub expected: Vec<f64>,
    /// The worst energy error of any step, relative to `|H|` or to the unit of energy, 1, if that is larger.
    pub energy_error: f64,
    /// What went wrong, where an order could not be fitted.
    pub failures: Vec<String>,
}

impl Orders {
    /// Runs of `coarsest`, twice, four and eight times as many steps; of eight times as many again for
    /// schemes of order 1.
    const fn new(coarsest: u32) -> Self {
        Self {
            coarsest,
            studies: Vec::new(),
            expected: Vec::new(),
            energy_error: 0.0,
            failures: Vec::new(),
        }
    }

    /// All of them.
    #[inline]
    pub fn of_every_problem() -> Self {
        let mut all = Self::canonical();
        for part in [Self::closures(), Self::products()] {
            all.studies.extend(part.studies);
            all.expected.extend(part.expected);
            all.failures.extend(part.failures);
            all.energy_error = all.energy_error.max(part.energy_error);
        }
        all
    }

    /// Those of canonical metrics, with geodesics in closed form.
    #[inline]
    pub fn canonical() -> Self {
        let mut orders = Self::new(40);
        canonical(&mut orders);
        orders
    }

    /// Those of metrics from closures, with numerical geodesics.
    #[inline]
    pub fn closures() -> Self {
        let mut orders = Self::new(15);
        closures(&mut orders);
        orders
    }

    /// Those of products.
    #[inline]
    pub fn products() -> Self {
        let mut orders = Self::new(15);
        products(&mut orders);
        orders
    }
}

/// Steps that are far too large for accuracy, of each retraction on every problem.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LargeSteps {
    /// Those of each problem and scheme.
    pub rows: Vec<Strides>,
}

/// The steps of one scheme on one problem.
#[derive(Clone, Debug, PartialEq)]
pub struct Strides {
    /// Problem, manifold, metric and scheme.
    pub label: String,
    /// The largest `√G(d, d)` of the displacements `d = hv`, from `R_h⁻¹(x, x')`, of the steps that
    /// were taken whole.
    pub longest: f64,
    /// The largest `|H(x') − H(x)|` of all of them, relative to `|H|` or to the unit of energy, 1, if that is
    /// larger.
    pub energy_error: f64,
}

impl LargeSteps {
    /// Those of every problem.
    #[inline]
    pub fn of_every_problem() -> Self {
        let mut study = Self::default();
        each(&mut study);
        study
    }
}

impl Study for LargeSteps {
    fn visit<Y, R>(&mut self, problem: &Problem<Y>, scheme: &'static str, retraction: R, _: f64)
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric> + Copy,
    {
        let Problem { name, manifold, metric, system, start, strides, .. } = problem;
        let label = format!("{name} on {manifold} ({metric}), {scheme}");
        let mut row = Strides { label, longest: 0.0, energy_error: 0.0 };
        for (away, h) in strides {
            let x = Y::Manifold::chart(start, away);
            let span = Span::steps(*h, 1);
            let Ok(run) = Scheme::new(retraction).run(system, x.clone(), span) else { continue };
            let y = &run.last().point;
            let (before, after) = (system.energy_at(&x), system.energy_at(y));
            row.energy_error = row.energy_error.max(relative(after - before, before));
            if run.certificate().effort.splits == 0
                && let Ok(d) = retraction.inverse(system.metric(), &x, y)
                && let Ok(length) = system.metric().norm(&d.base, &d.vector)
            {
                row.longest = row.longest.max(length);
            }
        }
        self.rows.push(row);
    }
}

impl Study for Orders {
    fn visit<Y, R>(&mut self, problem: &Problem<Y>, scheme: &'static str, retraction: R, order: f64)
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric> + Copy,
    {
        let Problem { name, manifold, metric, system, start, time, .. } = problem;
        let Some(exact) = flow(system, start, *time) else {
            return self.failures.push(format!("{name} on {manifold} has no flow"));
        };
        let first = if order > 1.5 { self.coarsest } else { 8 * self.coarsest };
        let counts = [1, 2, 4, 8].map(|k| k * first);
        let labels = [name, manifold, metric, scheme];
        let study = Convergence::measure(labels, *time, &counts, |h, n| {
            let run = Scheme::new(retraction).run(system, start.clone(), Span::steps(h, n));
            run.map_or(f64::NAN, |run| {
                let certificate = run.certificate();
                let error = relative(certificate.max_energy_error, certificate.initial_energy);
                self.energy_error = self.energy_error.max(error);
                Problem::<Y>::distance(&run.last().point, &exact)
            })
        });
        match study {
            Ok(study) => {
                self.studies.push(study);
                self.expected.push(order);
            }
            Err(error) => {
                self.failures.push(format!("{name} on {manifold} ({metric}), {scheme}: {error}"));
            }
        }
    }
}

/// The exact scheme beside the published one, with the Weyl midpoint on every problem that has an
/// entropy which is a Casimir.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SecondLaws {
    /// A comparison for each of them.
    pub rows: Vec<Comparison>,
}

/// Both schemes on one problem.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Problem and manifold.
    pub problem: String,
    /// The balance of the exact scheme.
    pub exact: Certificate,
    /// The balance of the published one.
    pub published: Certificate,
}

impl SecondLaws {
    /// `steps` steps of size `h` on every problem.
    #[inline]
    pub fn of_every_problem(h: f64, steps: usize) -> Self {
        struct Runs(SecondLaws, f64, usize);
        impl Study for Runs {
            fn visit<Y, R>(&mut self, problem: &Problem<Y>, scheme: &'static str, _: R, _: f64)
            where
                Y: Metriplectic,
                R: Retraction<Y::Manifold, Y::Metric> + Copy,
            {
                let Problem { name, manifold, system, start, .. } = problem;
                if scheme != "Weyl midpoint" || system.second_law() != SecondLaw::Exact {
                    return;
                }
                let span = Span::steps(self.1, self.2).at_most(2);
                let schemes = [Compared::given(system), Compared::published(system)];
                let runs = schemes.map(|system| WeylMidpoint.run(&system, start.clone(), span));
                if let [Ok(exact), Ok(published)] = runs {
                    let problem = format!("{name} on {manifold}");
                    let [exact, published] =
                        [exact, published].map(|run| run.certificate().clone());
                    self.0.rows.push(Comparison { problem, exact, published });
                }
            }
        }
        let mut runs = Runs(Self::default(), h, steps);
        each(&mut runs);
        runs.0
    }

    /// The fraction by which the exact scheme solves more linear systems, over all problems.
    pub fn extra_iterations(&self) -> f64 {
        let sum = |of: fn(&Comparison) -> usize| self.rows.iter().map(of).sum::<usize>() as f64;
        sum(|row| row.exact.effort.iterations) / sum(|row| row.published.effort.iterations) - 1.0
    }
}

/// The spinning top's energy on S² (Celledoni, Eidnes, Owren, Ringholm 2019, example 1).
fn top(x: &Vector3<Real>) -> Real {
    let weights = [1.0, 0.5, 0.25];
    (0..3).map(|i| (x[i].powi(2) + x[i].powi(3) * (2.0 / 3.0)) * (0.5 * weights[i])).sum()
}

fn hill(x: &Vector3<Real>) -> Real {
    x.z + x.x * x.y * 0.3
}

fn tilt(x: &Vector3<Real>) -> Real {
    x.x - x.y * x.z * 0.2
}

/// `Σ a_i x_i² + b_i x_i³` with coefficients that no symmetry relates.
fn bumpy<const A: usize>(x: &SVector<Real, A>) -> Real {
    (0..A)
        .map(|i| {
            let k = i as f64;
            x[i].powi(2) * (0.5 + 0.3 * k) + x[i].powi(3) * (0.3 - 0.1 * k)
        })
        .sum()
}

/// `x_n + ⅓ Σ x_i x_{i+1}`.
fn slope<const A: usize>(x: &SVector<Real, A>) -> Real {
    (0..A - 1).map(|i| x[i] * x[i + 1] * (1.0 / 3.0)).sum::<Real>() + x[A - 1]
}

/// Two Casimirs on S⁵.
fn first_twist(x: &Vector6<Real>) -> Real {
    x[0] * x[3] - x[1] * x[4] * 0.5
}

fn second_twist(x: &Vector6<Real>) -> Real {
    x[2] + x[1] * x[5]
}

fn body_energy(p: &Vector3<Real>) -> Real {
    p.x.powi(2) * 0.05 + p.y.powi(2) * 0.1 + p.z.powi(2) * 0.5
}

fn rotation_energy(r: &Matrix3<Real>) -> Real {
    r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5
}

fn rotation_entropy(r: &Matrix3<Real>) -> Real {
    r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25
}

/// A point of norm 1 off every axis.
fn off_axis<const A: usize>() -> SVector<f64, A> {
    SVector::<f64, A>::from_fn(|i, _| 1.0 + 0.3 * i as f64).normalize()
}

fn attitude() -> Matrix3<f64> {
    rotations::exp(&vector![0.3, -0.2, 0.5])
}

const CANONICAL: &str = "canonical";

/// Visits every problem.
pub fn each(study: &mut impl Study) {
    canonical(study);
    closures(study);
    products(study);
}

/// Both geodesic retractions, as one type: the code of a study is made once for each problem.
fn geodesic<Y: Metriplectic>(study: &mut impl Study, problem: &Problem<Y>) {
    type Geodesic = Either<WeylMidpoint, Exponential>;
    study.visit(problem, "Weyl midpoint", Geodesic::First(WeylMidpoint), 2.0);
    study.visit(problem, "exponential", Geodesic::Second(Exponential), 1.0);
}

/// A retraction under its name in a study.
#[derive(Clone, Copy)]
struct Named<R> {
    scheme: &'static str,
    retraction: R,
}

/// Both geodesic retractions, and further ones of order 2, as one type.
fn with<Y: Metriplectic, R>(study: &mut impl Study, problem: &Problem<Y>, further: &[Named<R>])
where
    R: Retraction<Y::Manifold, Y::Metric> + Copy,
{
    type Any<R> = Either<Either<WeylMidpoint, Exponential>, R>;
    let first = |retraction| Any::<R>::First(retraction);
    study.visit(problem, "Weyl midpoint", first(Either::First(WeylMidpoint)), 2.0);
    study.visit(problem, "exponential", first(Either::Second(Exponential)), 1.0);
    for &Named { scheme, retraction } in further {
        study.visit(problem, scheme, Any::Second(retraction), 2.0);
    }
}

/// The retractions for a metric from a closure: those of its geodesics, the chart midpoint, and one of the
/// manifold's own.
fn all<Y: Metriplectic, R>(
    study: &mut impl Study,
    problem: &Problem<Y>,
    scheme: &'static str,
    retraction: R,
) where
    R: Retraction<Y::Manifold, Y::Metric> + Copy,
{
    type Cheap<R> = Either<ChartMidpoint, R>;
    let chart = Named { scheme: BY_THE_CHART.scheme, retraction: Cheap::First(ChartMidpoint) };
    let own = Named { scheme, retraction: Cheap::Second(retraction) };
    with(study, problem, &[chart, own]);
}

const BY_THE_CHART: Named<ChartMidpoint> =
    Named { scheme: "chart midpoint", retraction: ChartMidpoint };

/// Canonical metrics.
fn canonical(study: &mut impl Study) {
    let problem = |name, manifold, time| (name, manifold, CANONICAL, time);
    macro_rules! visit {
        ($labels:expr, $start:expr, $strides:expr, $system:expr, $scheme:literal by $retraction:expr) => {
            visit!(@ $labels, $start, $strides, $system, |study, problem| {
                with(study, problem, &[Named { scheme: $scheme, retraction: $retraction }])
            })
        };
        ($labels:expr, $start:expr, $strides:expr, $system:expr) => {
            visit!(@ $labels, $start, $strides, $system, geodesic)
        };
        (@ $labels:expr, $start:expr, $strides:expr, $system:expr, $all:expr) => {{
            let (name, manifold, metric, time) = $labels;
            let system = $system.build().expect("a problem is a system");
            let strides = $strides.to_vec();
            let problem = Problem { name, manifold, metric, system, start: $start, time, strides };
            $all(study, &problem);
        }};
    }
    visit!(
        problem("rigid body", "so(3)*", 10.0),
        vector![0.1, -1.0, 0.2],
        [(vector![1.0, -0.3, -0.8], 2.0)],
        System::on(LieDual::so3())
            .energy(body_energy)
            .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
    );
    let sphere = || System::on(Sphere::<2>::round()).energy(top);
    let diagonal = Vector3::from_element(3.0_f64.sqrt().recip());
    visit!(
        problem("spinning top", "S²", 5.0),
        diagonal,
        [(vector![0.6, -1.2], 4.0)],
        sphere().bracket(AreaForm),
        "projection" by Projection
    );
    visit!(
        problem("relaxation", "S²", 3.0),
        diagonal,
        [(vector![-0.4, 1.1], 4.0)],
        System::on(Sphere::<2>::round()).energy(hill).entropy(tilt),
        "projection" by Projection
    );
    visit!(
        problem("no Casimir", "S²", 3.0),
        diagonal,
        [(vector![0.3, 1.0], 8.0)],
        sphere().bracket(AreaForm).entropy(hill).second_law(SecondLaw::Published),
        "projection" by Projection
    );
    visit!(
        problem("Nambu", "S³", 2.0),
        off_axis::<4>(),
        [(vector![-1.1, -1.0, 0.1], 8.0)],
        System::on(Sphere::<3>::round())
            .bracket(Nambu::default())
            .energy(bumpy::<4>)
            .entropy(slope::<4>),
        "projection" by Projection
    );
    visit!(
        problem("Nambu", "S⁵", 2.0),
        off_axis::<6>(),
        [ (vector![0.4, 0.0, -1.2, 0.6, 0.2], 4.0), (vector![-0.1, -0.2, -0.7, 1.8, 0.2], 8.0)],
        System::on(Sphere::<5>::round())
            .bracket(Nambu::default().and(first_twist).and(second_twist))
            .energy(bumpy::<6>)
            .entropy(slope::<6>),
        "projection" by Projection
    );
    visit!(
        problem("Nambu", "SO(3)", 1.0),
        attitude(),
        [(vector![1.1, -1.2, 1.1], 2.0)],
        System::on(Rotations::bi_invariant())
            .bracket(Nambu::default())
            .energy(rotation_energy)
            .entropy(rotation_entropy),
        "Cayley" by Cayley
    );
}

/// Metrics from closures, with numerical geodesics.
fn closures(study: &mut impl Study) {
    let ambient = |x: &Vector3<Real>| {
        let mut g = Matrix3::from_diagonal(&vector![1.0, 1.5, 2.0]).cast::<Real>();
        g[(0, 1)] = x.z * 0.2;
        g[(1, 0)] = x.z * 0.2;
        g
    };
    let system = System::on(Sphere::<2>::round())
        .metric(Metric::field(ambient))
        .energy(top)
        .entropy(hill)
        .build()
        .expect("a problem is a system");
    let start = Vector3::from_element(3.0_f64.sqrt().recip());
    let strides = vec![(vector![0.7, -1.5], 32.0)];
    let (name, manifold, metric) = ("relaxation", "S²", "ambient closure");
    let problem = Problem { name, manifold, metric, system, start, time: 2.0, strides };
    all(study, &problem, "projection", Projection);

    // One closure for both, and so one type.
    let diagonal = Matrix3::from_diagonal(&vector![1.0, 1.5, 2.0]);
    let full = Matrix3::new(1.0, 0.2, 0.0, 0.2, 1.5, 0.1, 0.0, 0.1, 2.0);
    for (metric, inertia, leaning, strides) in [
        ("left-invariant", full, 0.0, [(vector![-0.2, 1.4, -0.3], 2.0)]),
        ("depends on R", diagonal, 0.5, [(vector![-0.2, 1.4, -0.3], 2.0)]),
    ] {
        let body = move |r: &Matrix3<Real>| {
            let lean = r.column(2).into_owned();
            inertia.cast::<Real>() + lean * lean.transpose() * Real::from(leaning)
        };
        let system = System::on(Rotations)
            .metric(Metric::field(body))
            .bracket(Nambu::default())
            .dissipation(Scaled(0.1, MetricDissipation))
            .energy(rotation_energy)
            .entropy(rotation_entropy)
            .build()
            .expect("a problem is a system");
        let (name, manifold, strides) = ("Nambu", "SO(3)", strides.to_vec());
        let problem =
            Problem { name, manifold, metric, system, start: attitude(), time: 1.0, strides };
        all(study, &problem, "Cayley", Cayley);
    }

    let leaning = |q: &Vector2<Real>| {
        let across = q.x.sin() * 0.4;
        Matrix2::new(q.y.powi(2) + 1.0, across, across, q.x.powi(2) * 0.5 + 1.0)
    };
    let system = System::on(Euclidean::<2>)
        .metric(Metric::field(leaning))
        .bracket(AreaForm)
        .energy(|q: &Vector2<Real>| q.x.powi(2) * 0.5 + q.y.powi(2) + q.x.powi(3) * 0.1)
        .build()
        .expect("a problem is a system");
    let strides = vec![(vector![0.0, 0.55], 2.0)];
    let (name, manifold, metric) = ("area form", "2-chart", "non-diagonal");
    let start = vector![0.6, 0.4];
    let problem = Problem { name, manifold, metric, system, start, time: 2.0, strides };
    with(study, &problem, &[BY_THE_CHART]);

    let leaning = |q: &Vector3<Real>| {
        let wave = Vector3::new(q.y.sin(), q.z.cos(), q.x * 0.5);
        Matrix3::identity() + wave * wave.transpose() * Real::from(0.4)
    };
    let system = System::on(Euclidean::<3>)
        .metric(Metric::field(leaning))
        .bracket(Nambu::default())
        .dissipation(Scaled(0.1, MetricDissipation))
        .energy(bumpy::<3>)
        .entropy(|q: &Vector3<Real>| q.norm_squared() * 0.5 + q.z.powi(3) * 0.1)
        .build()
        .expect("a problem is a system");
    let strides = vec![(vector![-1.1, 0.8, 0.9], 2.0)];
    let (name, manifold, metric) = ("Nambu", "3-chart", "non-diagonal");
    let start = vector![0.5, -0.4, 0.3];
    let problem = Problem { name, manifold, metric, system, start, time: 2.0, strides };
    with(study, &problem, &[BY_THE_CHART]);
}

/// Products.
fn products(study: &mut impl Study) {
    // H = h(n) + e(s) with the entropy itself as the second factor: a spin in a bath.
    let system = System::on(Product(Sphere::<2>::round(), Euclidean::<1>))
        .bracket((AreaForm, Zero))
        .energy(|(n, s): &(Vector3<Real>, Vector1<Real>)| top(n) + s.x.exp())
        .entropy(|(_, s): &(Vector3<Real>, Vector1<Real>)| s.x)
        .build()
        .expect("a problem is a system");
    let start = (Vector3::from_element(3.0_f64.sqrt().recip()), Vector1::new(0.1));
    let strides = vec![(vector![1.3, 0.2, 1.5], 2.0)];
    let (name, manifold, metric) = ("spin in a bath", "S² × R", CANONICAL);
    geodesic(study, &Problem { name, manifold, metric, system, start, time: 2.0, strides });

    let system = System::on(Product(Sphere::<2>::round(), HalfLine))
        .metric((Canonical, Canonical))
        .bracket((AreaForm, Zero))
        .energy(|(n, e): &(Vector3<Real>, Vector1<Real>)| top(n) + e.x)
        .entropy(|(_, e): &(Vector3<Real>, Vector1<Real>)| e.x.ln())
        .build()
        .expect("a problem is a system");
    let start = (Vector3::new(FRAC_1_SQRT_2, 0.5, 0.5), Vector1::new(0.8));
    let strides = vec![(vector![-0.2, 0.1, -0.6], 8.0)];
    let (name, manifold) = ("spin in a bath", "S² × R₊");
    geodesic(study, &Problem { name, manifold, metric, system, start, time: 2.0, strides });

    let energy = |(r, p): &(Matrix3<Real>, Vector3<Real>)| {
        p.x.powi(2) * 0.5
            + p.y.powi(2) * 0.25
            + p.z.powi(2) * (1.0 / 6.0)
            + r.m33 * 0.7
            + r.m31 * 0.2
    };
    let start = (attitude(), vector![0.4, -0.6, 0.8]);
    let system = System::on(Product(Rotations, Euclidean::<3>))
        .bracket(Symplectic)
        .energy(energy)
        .build()
        .expect("a problem is a system");
    let strides = vec![(vector![-0.9, 0.8, 1.0, 0.6, 1.4, 0.9], 1.0)];
    let (name, manifold) = ("heavy body", "SO(3) × R³");
    geodesic(study, &Problem { name, manifold, metric, system, start, time: 2.0, strides });

    let full = |(r, _): &(Matrix3<Real>, Vector3<Real>)| {
        let mut g = nalgebra::Matrix6::<Real>::identity();
        let lean = Vector6::new(r.m13, r.m23, r.m33, Real::from(0.5), r.m31, Real::from(0.0));
        g += lean * lean.transpose() * Real::from(0.3);
        g
    };
    let system = System::on(Product(Rotations, Euclidean::<3>))
        .metric(Metric::field(full))
        .energy(energy)
        .entropy(|(r, p): &(Matrix3<Real>, Vector3<Real>)| r.m12 - p.norm_squared() * 0.3)
        .build()
        .expect("a problem is a system");
    let away = vector![0.2, -0.3, 1.5, -1.3, -0.9, 0.3];
    let strides = vec![(away, 4.0), (away, 2.0)];
    let (name, metric) = ("relaxation", "full closure");
    let problem = Problem { name, manifold, metric, system, start, time: 1.0, strides };
    with(study, &problem, &[BY_THE_CHART]);
}
