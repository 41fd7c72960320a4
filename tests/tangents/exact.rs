//! Exact derivatives along parameters of systems in plain numbers: against those of the same families in types, against differences of
//! runs, and refused where the answers of the model are wrong.

use metriplectic::dynamics::{InNumbers, Point};
use metriplectic::equations::{
    Covectors, ENERGY, Equations, Jet, Kind, MetricError, Model, Part, Paths, Sizes,
};
use metriplectic::integrators::{
    Entries, ExplicitRungeKutta, FromEquations, LinearisedAlong, RunError, Schedule, SystemAt,
    Tableau, TangentError,
};
use metriplectic::manifolds::in_numbers::point;
use metriplectic::prelude::*;
use nalgebra::{DMatrix, DVector, SVector, vector};

/// What is wrong with the answers along parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wrong {
    Nothing,
    /// The derivative of the value of a law along the first parameter.
    Value,
    /// That of its differential.
    Differential,
    /// That of this part.
    Part(Part),
    /// It is not a number.
    Lost,
}

/// A member of a family in plain numbers, which answers along parameters by the wide system.
struct Member<D> {
    typed: D,
    /// The number of parameters that it knows.
    known: usize,
    wrong: Wrong,
}

impl<D: Differentiable> Member<D> {
    fn of(typed: D) -> Self {
        let known = typed.parameters().len();
        Self { typed, known, wrong: Wrong::Nothing }
    }

    fn numbers(&self) -> InNumbers<'_, D> {
        InNumbers(&self.typed)
    }

    /// The wide system, and the state in it.
    fn wide(&self, x: &[f64]) -> (InNumbers<'_, D::Wide>, Vec<f64>) {
        let x = self.typed.widened(&point::<D::Manifold>(x));
        (InNumbers(self.typed.wide()), <D::Wide as Metriplectic>::Manifold::entries(&x))
    }
}

/// A covector with zeros along the parameters.
fn padded(w: &[f64], len: usize) -> Vec<f64> {
    let mut w = w.to_vec();
    w.resize(len, 0.0);
    w
}

impl<D: Differentiable> Equations for Member<D> {
    fn sizes(&self) -> Sizes {
        self.numbers().sizes()
    }

    fn values(&self, t: f64, x: &[f64], values: &mut [f64]) {
        self.numbers().values(t, x, values);
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.numbers().differentials(t, x, values, w);
    }

    fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        self.numbers().velocity(t, x, v)
    }

    fn second_law(&self) -> SecondLaw {
        self.numbers().second_law()
    }

    fn kind(&self, invariant: usize) -> Kind {
        self.numbers().kind(invariant)
    }

    fn is_vector_space(&self) -> bool {
        true
    }

    fn model(&self) -> Option<&dyn Model> {
        Some(self)
    }
}

impl<D: Differentiable> Model for Member<D> {
    fn is_zero(&self, part: Part) -> bool {
        self.numbers().is_zero(part)
    }

    fn is_poisson(&self) -> bool {
        self.numbers().is_poisson()
    }

    fn adapts(&self) -> bool {
        self.numbers().adapts()
    }

    fn annihilates_entropy(&self) -> bool {
        self.numbers().annihilates_entropy()
    }

    fn has_constant_entropy(&self) -> bool {
        self.numbers().has_constant_entropy()
    }

    fn has_canonical_metric(&self) -> bool {
        true
    }

    fn value(&self, law: usize, t: f64, x: &[f64]) -> f64 {
        self.numbers().value(law, t, x)
    }

    fn along(&self, law: usize, t: f64, x: &[f64], along: [&[f64]; 2]) -> [f64; 4] {
        self.numbers().along(law, t, x, along)
    }

    fn jet(&self, law: usize, t: f64, x: &[f64], df: &mut [f64]) -> f64 {
        self.numbers().jet(law, t, x, df)
    }

    fn hessian(&self, law: usize, t: f64, x: &[f64], df: &mut [f64], hf: &mut [f64]) -> f64 {
        self.numbers().hessian(law, t, x, df, hf)
    }

    fn differential_at(&self, law: usize, t: f64, x: &[f64], q: &[f64], df: &mut [f64]) {
        self.numbers().differential_at(law, t, x, q, df);
    }

    fn independence(&self, t: f64, x: &[f64], fractions: &mut [f64]) {
        self.numbers().independence(t, x, fractions);
    }

    fn metric(&self, x: &[f64], q: &[f64], g: &mut [f64]) {
        self.numbers().metric(x, q, g);
    }

    fn check_metric(&self, x: &[f64], geodesics: bool) -> Result<(), MetricError> {
        self.numbers().check_metric(x, geodesics)
    }

    fn metric_slopes(&self, x: &[f64], slopes: &mut [f64]) -> bool {
        self.numbers().metric_slopes(x, slopes)
    }

    fn flat(&self, x: &[f64], d: &[f64], w: &mut [f64]) -> Result<(), MetricError> {
        self.numbers().flat(x, d, w)
    }

    fn tensor(
        &self,
        part: Part,
        t: f64,
        x: &[f64],
        w: Covectors<'_>,
        tensor: &mut [f64],
    ) -> Result<(), MetricError> {
        self.numbers().tensor(part, t, x, w, tensor)
    }

    fn apply(
        &self,
        part: Part,
        t: f64,
        place: (&[f64], &[f64]),
        w: Covectors<'_>,
        alpha: &[f64],
        v: &mut [f64],
    ) -> Result<(), MetricError> {
        self.numbers().apply(part, t, place, w, alpha, v)
    }

    fn linearise(
        &self,
        part: Part,
        t: f64,
        x: &[f64],
        w: Covectors<'_>,
        alpha: &[f64],
        jet: &mut Jet<'_>,
    ) -> Result<(), MetricError> {
        self.numbers().linearise(part, t, x, w, alpha, jet)
    }

    fn bracket_slope(
        &self,
        t: f64,
        x: &[f64],
        along: [&[f64]; 2],
        entropy: &[f64],
        slope: &mut [f64],
    ) -> Result<(), MetricError> {
        self.numbers().bracket_slope(t, x, along, entropy, slope)
    }

    fn bracket_slope_of(
        &self,
        t: f64,
        x: &[f64],
        along: [&[f64]; 2],
        entropy: &[f64],
        alpha: &[f64],
        slope: &mut [f64],
    ) -> Result<(), MetricError> {
        self.numbers().bracket_slope_of(t, x, along, entropy, alpha, slope)
    }

    fn parameters(&self) -> usize {
        self.known
    }

    fn law_along_parameter(
        &self,
        law: usize,
        parameter: usize,
        t: f64,
        x: &[f64],
        df: &mut [f64],
    ) -> f64 {
        let n = df.len();
        let (wide, x) = self.wide(x);
        let axis = |i: usize| padded(&[vec![0.0; i], vec![1.0]].concat(), x.len());
        let theta = axis(n + parameter);
        let mut slope = 0.0;
        for (i, df) in df.iter_mut().enumerate() {
            let [_, _, first, mixed] = wide.along(law, t, &x, [&axis(i), &theta]);
            (slope, *df) = (first, mixed);
        }
        match self.wrong {
            Wrong::Value if parameter == 0 => slope * 1.001,
            Wrong::Lost => f64::NAN,
            Wrong::Differential if parameter == 0 && law == ENERGY => {
                df[0] *= 1.001;
                slope
            }
            _ => slope,
        }
    }

    fn part_along_parameter(
        &self,
        (part, parameter): (Part, usize),
        t: f64,
        x: &[f64],
        w: Covectors<'_>,
        alpha: &[f64],
        v: &mut [f64],
    ) -> Result<(), MetricError> {
        let n = v.len();
        let (wide, x) = self.wide(x);
        let all = x.len();
        let [energy, entropy, alpha] = [w.energy, w.entropy, alpha].map(|w| padded(w, all));
        let [mut along_x, mut along_w, mut tensor] = [0; 3].map(|_| vec![0.0; all * all]);
        let mut value = vec![0.0; all];
        let mut jet = Jet {
            value: &mut value,
            along_x: &mut along_x,
            along_w: &mut along_w,
            tensor: &mut tensor,
        };
        let w = Covectors { energy: &energy, entropy: &entropy };
        wide.linearise(part, t, &x, w, &alpha, &mut jet)?;
        let factor = if self.wrong == Wrong::Part(part) { 1.001 } else { 1.0 };
        (0..n).for_each(|i| v[i] = along_x[i * all + n + parameter] * factor);
        Ok(())
    }

    fn generator(&self, k: usize, x: &[f64], moved: &mut [f64], at_zero: &mut [f64]) -> bool {
        self.numbers().generator(k, x, moved, at_zero)
    }

    fn action(&self, k: usize, x: &[f64], time: f64, y: &mut [f64], tangent: &mut [f64]) {
        self.numbers().action(k, x, time, y, tangent);
    }

    fn paths(&self) -> Option<&dyn Paths> {
        None
    }
}

/// The stiffness, the capacity of the baths, the friction, the size of the bracket, and a load on the first mass.
const NAMES: [&str; 5] = ["stiffness", "capacity", "friction", "bracket", "load"];
const THETA: SVector<f64, 5> = SVector::<f64, 5>::new(1.3, 2.0, 0.2, 1.1, 0.3);

/// A row of masses between springs that harden, whose friction heats baths, with entries of a size `unit`: the positions of the
/// masses, their momenta, and the heats of the baths.
macro_rules! row {
    ($n:literal, $unit:expr) => {{
        type State = SVector<Real, $n>;
        type Theta = SVector<Real, 5>;
        let (unit, baths) = ($unit, if $n % 2 == 0 { 2 } else { 1 });
        let m = ($n - baths) / 2;
        Family::on(Euclidean::<$n>)
            .parameters(NAMES)
            .field_bracket(move |_: &State, t: &Theta| {
                let mut form = nalgebra::SMatrix::<Real, $n, $n>::zeros();
                for i in 0..m {
                    form[(i, m + i)] = t[3];
                    form[(m + i, i)] = -t[3];
                }
                form
            })
            .energy(move |x: &State, t: &Theta| {
                let at = |i: usize| if i == 0 || i > m { 0.0.into() } else { x[i - 1] / unit };
                let springs = (0..=m).map(|i| at(i + 1) - at(i));
                let springs = springs.map(|d| d * d * t[0] * 0.5 + d.powi(4) * 0.1);
                let moving = (m..2 * m).map(|i| (x[i] / unit).powi(2) * 0.5);
                let heats = (2 * m..$n).map(|i| x[i] / unit);
                let all = springs.chain(moving).chain(heats);
                let load = x[0] / unit * t[4];
                (all.fold(Real::from(0.0), |sum, term| sum + term) - load) * (unit * unit)
            })
            .entropy(move |x: &State, t: &Theta| {
                let all = (2 * m..$n).map(|i| (x[i] / unit).ln() * t[1]);
                all.fold(Real::from(0.0), |sum, term| sum + term)
            })
            .field_dissipation(move |x: &State, w: &State, t: &Theta| {
                let mut k = nalgebra::SMatrix::<Real, $n, $n>::zeros();
                for i in 0..m {
                    let (p, u) = (m + i, 2 * m + i % baths);
                    let rate = t[2] * x[u] * ((x[i] / unit).powi(2) * 0.3 + 1.0) * unit;
                    let b = [w[u] / unit, -w[p] / unit];
                    for (r, along) in [(p, b[0]), (u, b[1])] {
                        for (c, other) in [(p, b[0]), (u, b[1])] {
                            k[(r, c)] += rate * along * other;
                        }
                    }
                }
                k
            })
            .build()
            .expect("a family")
    }};
}

/// A generic state of the row.
fn generic<const N: usize>(unit: f64) -> SVector<f64, N> {
    let baths = if N.is_multiple_of(2) { 2 } else { 1 };
    SVector::from_fn(|i, _| {
        let x =
            if i < N - baths { 0.5 * (1.1 + 1.7 * i as f64).sin() } else { 1.5 + 0.1 * i as f64 };
        x * unit
    })
}

/// The row at rest, in its unloaded middle.
fn resting<const N: usize>(unit: f64) -> SVector<f64, N> {
    let baths = if N.is_multiple_of(2) { 2 } else { 1 };
    SVector::from_fn(|i, _| if i < N - baths { 0.0 } else { 1.5 * unit })
}

/// The largest difference of a column, relative to its largest entry. A column of zeros is one of round-off.
fn off(found: &DMatrix<f64>, expected: &DMatrix<f64>) -> f64 {
    let columns = found.column_iter().zip(expected.column_iter());
    let largest = expected.amax();
    let relative = columns.map(|(found, expected)| {
        let size = expected.amax().max(1e-6 * largest);
        if size > 0.0 { (found - expected).amax() / size } else { found.amax() }
    });
    relative.fold(0.0, f64::max)
}

/// How the compared numbers may differ.
#[derive(Clone, Copy)]
struct Bounds {
    typed: f64,
    transposed: f64,
}

/// Compares the derivatives of a run in plain numbers with those in types, and the transposed steps with the tangent.
fn agrees<D, M, const P: usize>(
    name: &str,
    (family, names): (impl Fn(&SVector<f64, P>) -> D, &'static [&'static str; P]),
    theta: SVector<f64, P>,
    method: M,
    (x, schedule): (&Point<D>, Schedule),
    bounds: Bounds,
) -> DMatrix<f64>
where
    D: Differentiable,
    M: Copy + Stepper<D> + LinearisedAlong<D> + Stepper<FromEquations<Member<D>>>,
{
    let typed = method.tangent(&family(&theta), x.clone(), schedule.clone());
    let typed = typed.unwrap_or_else(|error| panic!("{name}, in types: {error}"));
    let build = |values: &[f64]| {
        let member = Member::of(family(&SVector::from_column_slice(values)));
        Ok::<_, ModelError>(FromEquations(member))
    };
    let system = SystemAt::listed(names, theta.as_slice(), build).expect("a system");
    let start = Entries::from(D::Manifold::entries(x));
    let run = method.tangent(&system, start.clone(), schedule.clone());
    let run = run.unwrap_or_else(|error| panic!("{name}: {error}"));
    let [found, expected] = [run.last().matrix(), typed.last().matrix()];
    let n = start.len();
    let error = off(&found.rows(0, n).into_owned(), &expected.rows(0, n).into_owned());
    // The costate goes back through the same steps.
    let back = method.adjoint(&system, start, schedule).expect("an adjoint");
    let all = found.nrows();
    let row = DVector::from_fn(all, |i, _| if i < n { (1.0 + i as f64).sin() } else { 0.0 });
    let mut rows = vec![DVector::zeros(all); back.states().len()];
    rows[back.states().len() - 1] = row.clone();
    let gradient = back.pull_back(&rows).expect("a gradient");
    let forward = found.tr_mul(&row);
    let terms = found.abs().tr_mul(&row.abs());
    let pulled = gradient
        .along_start()
        .iter()
        .chain(gradient.along_parameters().iter())
        .copied()
        .collect::<Vec<_>>();
    let transposed = (0..all).fold(0.0_f64, |worst, j| {
        let off = (pulled[j] - forward[j]).abs();
        worst.max(if off == 0.0 { 0.0 } else { off / terms[j].max(1e-6 * terms.max()) })
    });
    println!("{name}: {error:.1e}, transposed {transposed:.1e}, {}", run.sensitivity());
    assert!(error < bounds.typed, "{name}: {error:e}\n{found:.9}\n{expected:.9}");
    assert!(transposed < bounds.transposed, "{name}: {transposed:e}");
    let laws = run.sensitivity();
    assert!(laws.energy < 1e-12 && laws.invariants < 1e-12, "{name}: {laws}");
    assert!(laws.entropy.is_none_or(|entropy| entropy < 1e-11), "{name}: {laws}");
    found.rows(0, n).into_owned()
}

/// Kutta's method of order 3.
const KUTTA: Tableau = Tableau::new(
    "Kutta",
    3,
    &[&[(0, 0.5)], &[(0, -1.0), (1, 2.0)]],
    &[(0, 1.0 / 6.0), (1, 2.0 / 3.0), (2, 1.0 / 6.0)],
);

macro_rules! every_method {
    ($name:expr, $family:expr, $theta:expr, $x:expr, $span:expr, $bounds:expr, [$($method:expr),+ $(,)?]) => {$(
        let name = format!("{}, {}", $name, stringify!($method));
        agrees(&name, $family, $theta, $method, (&$x, $span.into()), $bounds);
    )+};
}

const EXACT: Bounds = Bounds { typed: 1e-12, transposed: 1e-13 };

/// The row with more methods than entries of types, which are compiled anew for each number of entries.
#[test]
fn derivatives_of_three_entries_along_parameters_are_exact() {
    for (unit, is_followed) in [(1e-9, false), (1e11, false), (1.0, true)] {
        let row = row!(3, unit);
        let family = |t: &SVector<f64, 5>| row.at(*t);
        let (x, rest) = (generic::<3>(unit), resting::<3>(unit));
        wrong_answers_are_refused(&family, [&x, &rest]);
        start_alone_is_exact(&family, &x);
        macro_rules! everywhere {
            ($($method:expr),+ $(,)?) => {$(
                let name = format!("3 entries of {unit:e}, {}", stringify!($method));
                let span = Span::steps(0.1, 2);
                agrees(&name, (family, &NAMES), THETA, $method, (&x, span.into()), EXACT);
                // Steps that follow a tolerance differ in their sizes by round-off.
                if is_followed {
                    let followed = Span::until(0.25).tolerance(1e-3).output_every(0.1).into();
                    let near = Bounds { typed: 1e-6, transposed: 1e-12 };
                    agrees(&name, (family, &NAMES), THETA, $method, (&x, followed), near);
                }
                // At rest, where the load has the value zero, nothing else moves it.
                let theta = SVector::from([1.3, 2.0, 0.2, 1.1, 0.0]);
                agrees(&name, (family, &NAMES), theta, $method, (&rest, span.into()), EXACT);
            )+};
        }
        everywhere!(
            DormandPrince5,
            DormandPrince8,
            RungeKuttaChebyshev,
            ExplicitRungeKutta::new(&KUTTA),
            WeylMidpoint,
            Radau::<2>,
            Gauss::<2>,
            Gauss::<3>,
            Radau::<3>,
            Scheme::new(WeylMidpoint).gradient(SymmetricItohAbe),
            Scheme::new(WeylMidpoint).gradient(MeanValue),
            Scheme::new(ChartMidpoint),
            Gauss::<1>,
        );
        let theta = SVector::from([1.3, 2.0, 0.2, 1.1, 0.0]);
        let span = Span::steps(0.1, 3).into();
        let found = agrees("loaded", (family, &NAMES), theta, Gauss::<2>, (&rest, span), EXACT);
        // The load β pushes the mass for a time of 0.3.
        assert!(found[(1, 3 + 4)] > 0.2 * unit, "{found}");
        against_runs(&family, &x);
    }
}

#[test]
fn derivatives_of_many_entries_along_parameters_are_exact() {
    let row = row!(11, 1e11);
    let family = |t: &SVector<f64, 5>| row.at(*t);
    every_method!(
        "11 entries of 1e11",
        (family, &NAMES),
        THETA,
        generic::<11>(1e11),
        Span::steps(0.1, 1),
        EXACT,
        [WeylMidpoint, Gauss::<2>, DormandPrince8,]
    );
    let row = row!(24, 1e-9);
    let family = |t: &SVector<f64, 5>| row.at(*t);
    let (x, span) = (generic::<24>(1e-9), Span::steps(0.1, 1));
    every_method!("24 entries", (family, &NAMES), THETA, x, span, EXACT, [WeylMidpoint,]);
}

/// Bodies with further invariants: Casimirs with and without friction.
#[test]
fn derivatives_of_projections_along_parameters_are_those_in_types() {
    const BODY: [&str; 3] = ["inertia", "friction", "size"];
    let theta = SVector::<f64, 3>::new(3.0, 0.2, 1.4);
    let turning = Family::on(LieDual::so3())
        .parameters(BODY)
        .energy(|p: &Vector3<Real>, t: &Vector3<Real>| {
            p.x * p.x / t.x * 0.5 + p.y.powi(4) * 0.3 + p.z * p.z * t.z * 0.5
        })
        .casimir(|p: &Vector3<Real>, t: &Vector3<Real>| p.norm_squared() * t.z * 0.5)
        .build()
        .unwrap();
    let damped = Family::on(LieDual::so3())
        .parameters(BODY)
        .energy(|p: &Vector3<Real>, t: &Vector3<Real>| {
            p.x * p.x / t.x * 0.5 + p.y.powi(4) * 0.3 + p.z * p.z * t.z * 0.5
        })
        .entropy(|p: &Vector3<Real>, t: &Vector3<Real>| (p.norm_squared() * 0.5 * t.y).exp())
        .build()
        .unwrap();
    // Friction that keeps a function of the state, off which it is projected.
    let kept = Family::on(Euclidean::<4>)
        .parameters(BODY)
        .bracket(Zero)
        .energy(|x: &Vector4<Real>, t: &Vector3<Real>| {
            x.x * x.x * t.x * 0.5 + x.y.powi(4) * 0.3 + x.z * x.w + x.w
        })
        .entropy(|x: &Vector4<Real>, t: &Vector3<Real>| x.z - x.x * x.y * t.y + x.w * x.w * 0.2)
        .casimir(|x: &Vector4<Real>, t: &Vector3<Real>| x.x + x.y * x.y * t.z * 0.5 + x.z * 0.3)
        .build()
        .unwrap();
    let x = vector![0.4, -1.0, 0.3];
    macro_rules! all {
        ($family:ident, $x:expr, $h:expr) => {
            every_method!(
                stringify!($family),
                (|t: &SVector<f64, 3>| $family.at(*t), &BODY),
                theta,
                $x,
                Span::steps($h, 4),
                EXACT,
                [WeylMidpoint, Gauss::<2>, Radau::<2>, DormandPrince5]
            );
        };
    }
    all!(turning, x, 0.1);
    all!(damped, x, 0.1);
    all!(kept, vector![0.4, -1.0, 0.3, 0.7], 0.02);
}

/// Compares with differences of order 4 of whole runs, by every method.
fn against_runs<D: Differentiable>(family: &impl Fn(&SVector<f64, 5>) -> D, x: &Point<D>) {
    let build = |values: &[f64]| {
        let member = Member::of(family(&SVector::from_column_slice(values)));
        Ok::<_, ModelError>(FromEquations(member))
    };
    let system = SystemAt::listed(&NAMES, THETA.as_slice(), build).expect("a member");
    let start = || Entries::from(D::Manifold::entries(x));
    let span = Span::steps(0.1, 2);
    macro_rules! compare {
        ($($method:expr),+ $(,)?) => {$({
            let run = $method.tangent(&system, start(), span).unwrap();
            let found = run.last().along_parameters();
            let column = |k: usize| {
                let at = |e: f64| {
                    let mut theta = THETA;
                    theta[k] += e * THETA[k];
                    let run = $method.run(&build(theta.as_slice()).unwrap(), start(), span).unwrap();
                    DVector::from_column_slice(&run.last().point)
                };
                let slope = |e: f64| (at(e) - at(-e)) / (2.0 * e * THETA[k]);
                (slope(1e-3) * 4.0 - slope(2e-3)) / 3.0
            };
            let expected = DMatrix::from_columns(&[0, 1, 2, 3, 4].map(column));
            let error = off(&found, &expected);
            println!("{}, runs: {error:.1e}", stringify!($method));
            // Of the fourth order in 10⁻³, with round-off of 10⁻¹³ divided by it.
            assert!(error < 1e-9, "{error:e}\n{found}\n{expected}");
        })+};
    }
    compare!(
        WeylMidpoint,
        Scheme::new(WeylMidpoint).gradient(MeanValue),
        Scheme::new(WeylMidpoint).gradient(SymmetricItohAbe),
        Gauss::<3>,
        Radau::<2>,
        DormandPrince5,
        DormandPrince8,
        RungeKuttaChebyshev,
        ExplicitRungeKutta::new(&KUTTA),
    );
}

/// A model that does not say how it depends on parameters has exact derivatives along its start, and differences along the parameters.
fn start_alone_is_exact<D: Differentiable>(family: &impl Fn(&SVector<f64, 5>) -> D, x: &Point<D>) {
    let build = |known: usize| {
        move |values: &[f64]| {
            let typed = family(&SVector::from_column_slice(values));
            let member = Member { known, ..Member::of(typed) };
            Ok::<_, ModelError>(FromEquations(member))
        }
    };
    let start = || Entries::from(D::Manifold::entries(x));
    macro_rules! compare {
        ($($method:expr),+ $(,)?) => {$(
            // Another number of parameters is not that of the systems.
            for known in [0, 2] {
                let all = SystemAt::listed(&NAMES, THETA.as_slice(), build(5)).unwrap();
                let some = SystemAt::listed(&NAMES, THETA.as_slice(), build(known)).unwrap();
                let [exact, run] = [&all, &some]
                    .map(|system| $method.tangent(system, start(), Span::steps(0.1, 2)).unwrap());
                let of_start = off(&run.last().along_start(), &exact.last().along_start());
                let along = off(&run.last().along_parameters(), &exact.last().along_parameters());
                println!("{}: start {of_start:.1e}, parameters {along:.1e}", stringify!($method));
                assert!(of_start < 1e-12 && along < 1e-7, "{of_start:e} {along:e}");
                let rows = |n: usize| vec![DVector::zeros(3); n - 1];
                let [expected, found] = [&all, &some].map(|system| {
                    let back = $method.adjoint(system, start(), Span::steps(0.1, 2)).unwrap();
                    let mut rows = rows(back.states().len());
                    rows.push(DVector::from_vec(vec![0.3, -0.7, 0.2]));
                    back.pull_back(&rows).unwrap()
                });
                let error = (found.along_start() - expected.along_start()).amax();
                assert!(error < 1e-12 * expected.along_start().amax(), "{error:e}");
                let error = (found.along_parameters() - expected.along_parameters()).amax();
                assert!(error < 1e-7 * expected.along_parameters().amax(), "{error:e}");
            }
        )+};
    }
    compare!(WeylMidpoint, Gauss::<2>, Radau::<2>, DormandPrince8, RungeKuttaChebyshev);
}

/// Refuses answers that are wrong in a thousandth of one derivative.
fn wrong_answers_are_refused<D: Differentiable>(
    family: &impl Fn(&SVector<f64, 5>) -> D,
    states: [&Point<D>; 2],
) {
    let refused = |wrong: Wrong, (x, theta): (&Point<D>, [f64; 5])| {
        let build = |values: &[f64]| {
            let member = Member::of(family(&SVector::from_column_slice(values)));
            Ok::<_, ModelError>(FromEquations(Member { wrong, ..member }))
        };
        let system = SystemAt::listed(&NAMES, &theta, build).expect("a member");
        let start = || Entries::from(D::Manifold::entries(x));
        let tangent = DormandPrince8.tangent(&system, start(), Span::steps(0.1, 2)).map(drop);
        let adjoint = Gauss::<2>.adjoint(&system, start(), Span::steps(0.1, 2)).map(drop);
        [tangent.err(), adjoint.err()].map(|error| match error {
            Some(TangentError::Run(RunError::Model(error))) => Some(error),
            None => None,
            other => panic!("{wrong:?}: {other:?}"),
        })
    };
    // Without a load the state at rest stays there.
    let [moving, rest] = states;
    for x in [(moving, THETA.into()), (rest, [1.3, 2.0, 0.2, 1.1, 0.0])] {
        assert_eq!(refused(Wrong::Nothing, x), [None, None]);
        let cases = [
            (Wrong::Value, "energy", 0),
            (Wrong::Differential, "energy", 0),
            (Wrong::Part(Part::Reversible), "bracket", 3),
            (Wrong::Part(Part::Irreversible), "dissipation", 2),
        ];
        for (wrong, expected, k) in cases {
            for error in refused(wrong, x) {
                println!("{error:?}");
                let Some(ModelError::WrongAlongParameter { field, parameter, .. }) = error else {
                    panic!("{wrong:?}: {error:?}")
                };
                assert_eq!((field, parameter), (expected, k));
            }
        }
        for error in refused(Wrong::Lost, x) {
            assert!(matches!(error, Some(ModelError::DerivativeNotFinite { .. })), "{error:?}");
        }
    }
}
