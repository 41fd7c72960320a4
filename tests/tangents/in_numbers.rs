//! Tangents of systems in plain numbers: against those of the same systems in types, and against differences of runs.

use metriplectic::dynamics::bracket::Zero;
use metriplectic::dynamics::{InNumbers, Point};
use metriplectic::equations::{
    Apart, Covectors, Differences, ENERGY, ENTROPY, Equations, Part, SecondLaw, Sizes,
};
use metriplectic::integrators::{Entries, FromEquations, LinearisedAlong, Schedule};
use metriplectic::prelude::*;
use nalgebra::{DMatrix, DVector, matrix, vector};

use crate::off;

/// Compares the tangent of a run in types with that in plain numbers: the same steps, and the same derivatives up to round-off.
fn agrees<Y, M>(name: &str, system: &Y, method: M, x0: &Point<Y>, schedule: &Schedule) -> f64
where
    Y: Differentiable,
    M: Copy + Stepper<Y> + LinearisedAlong<Y>,
    M: for<'a> Stepper<FromEquations<InNumbers<'a, Y>>>,
{
    let numbers = FromEquations(InNumbers(system));
    let start = Entries::from(Y::Manifold::entries(x0));
    let run = method.tangent(system, x0.clone(), schedule.clone()).expect("a tangent");
    let again = method.tangent(&numbers, start.clone(), schedule.clone()).expect("a tangent");
    assert_eq!(run.states().len(), again.states().len(), "{name}");
    let error = off(&again.last().matrix(), &run.last().matrix());
    let [law, entropy] = [again.sensitivity().energy, again.sensitivity().entropy.unwrap_or(0.0)];
    println!("{name}: {error:.1e}, laws {law:.1e} and {entropy:.1e}");
    assert!(law < 1e-12 && entropy < 1e-11, "{name}: {law:e} {entropy:e}");
    // The costate goes back through the same steps.
    let row = |k: usize, n: usize| DVector::from_fn(n, |i, _| (1.0 + i as f64 + k as f64).sin());
    let back = method.adjoint(&numbers, start, schedule.clone()).expect("an adjoint");
    let n = again.last().matrix().nrows();
    let rows: Vec<_> = (0..back.states().len()).map(|k| row(k, n)).collect();
    let forward = again.states().iter().zip(&rows).map(|(state, row)| state.derivative_of(row));
    let forward = forward.fold(DVector::zeros(n), |sum: DVector<f64>, row| sum + row);
    let found = back.pull_back(&rows).expect("a gradient").along_start();
    let transposed = (found - &forward).amax() / forward.amax();
    assert!(transposed < 1e-9, "{name}: {transposed:e}");
    error
}

#[test]
fn tangents_in_numbers_are_those_in_types() {
    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y.powi(4) * 0.3 + p.z * p.z * 1.5)
        .entropy(|p: &Vector3<Real>| (p.norm_squared() * 0.5).exp())
        .build()
        .unwrap();
    let pushed = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y * 0.25 + p.z * p.z * 0.2)
        .force(|xi: &Vector3<Real>| Vector3::new(-xi.y, xi.x, 0.0.into()) * (xi.x * 0.8))
        .build()
        .unwrap();
    let casimir = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x / 6.0 + p.y.powi(4) * 0.3 + p.z * p.z * 0.5)
        .casimir(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()
        .unwrap();
    let nambu = System::on(Euclidean::<3>)
        .bracket(Nambu::default())
        .energy(|x: &Vector3<Real>| x.x.cos() + x.y * x.y + x.z * x.z * 0.5)
        .entropy(|x: &Vector3<Real>| (x.x * x.x + x.y * x.y * 2.0 + x.z * x.z) * 0.5)
        .build()
        .unwrap();
    let pendulum = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 - x.x.cos())
        .build()
        .unwrap();
    // The states come to rest, where entropy is a function of energy, and the projection onto both loses digits.
    const NEAR_REST: f64 = 1e-9;
    let (x, y) = (vector![0.4, -1.0, 0.3], vector![0.5, 0.7, -0.2]);
    let (short, long) = (Span::steps(0.1, 8).into(), Span::steps(0.1, 40).into());
    let followed = Span::until(4.0).tolerance(1e-7).output_every(0.9);
    let is_near = |error: f64| assert!(error < NEAR_REST, "{error:e}");
    is_near(agrees("a body", &body, DormandPrince8, &x, &long));
    is_near(agrees("a force", &pushed, DormandPrince8, &x, &long));
    is_near(agrees("a Casimir", &casimir, DormandPrince8, &x, &long));
    // It reaches a state where energy and entropy depend on each other.
    is_near(agrees("Nambu", &nambu, DormandPrince8, &y, &short));
    is_near(agrees("a pendulum", &pendulum, DormandPrince8, &vector![2.0, 0.0], &long));
    is_near(agrees("a body, 5", &body, DormandPrince5, &x, &long));
    is_near(agrees("a body, stabilised", &body, RungeKuttaChebyshev, &x, &long));
    is_near(agrees("Nambu, Weyl", &nambu, WeylMidpoint, &y, &short));
    is_near(agrees("a body, Gauss", &body, Gauss::<2>, &x, &long));
    is_near(agrees("a body, Radau", &body, Radau::<2>, &x, &long));
    // Other steps follow the same tolerance.
    let error = agrees("a body, followed", &body, DormandPrince8, &x, &followed);
    assert!(error < 1e-6, "{error:e}");
}

/// Friction is kept off a further invariant in the metric of the system, which is not the canonical one: by differences of steps, against
/// the exact derivatives of the same steps in types and against differences of runs.
#[test]
fn explicit_tangents_know_the_metric_in_which_friction_keeps_an_invariant() {
    let g = matrix![
        2.0, 0.4, 0.0, 0.1;
        0.4, 1.0, 0.2, 0.0;
        0.0, 0.2, 0.5, 0.1;
        0.1, 0.0, 0.1, 1.5
    ];
    let system = System::on(Euclidean::<4>)
        .metric(Metric::constant(g).unwrap())
        .bracket(Zero)
        .energy(|x: &Vector4<Real>| x.x * x.x * 0.5 + x.y.powi(4) * 0.3 + x.z * x.w + x.w)
        .entropy(|x: &Vector4<Real>| x.z - x.x * x.y * 0.3 + x.w * x.w * 0.2)
        .casimir(|x: &Vector4<Real>| x.x + x.y * x.y * 0.5 + x.z * 0.3)
        .build()
        .unwrap();
    let numbers = FromEquations(InNumbers(&system));
    let (x, span) = (vector![0.4, -1.0, 0.3, 0.7], Span::steps(0.02, 10));
    macro_rules! compare {
        ($($method:expr),+) => {$({
            let run = $method.tangent(&system, x, span).unwrap();
            let start = Entries::from(x.as_slice());
            let again = $method.tangent(&numbers, start.clone(), span).unwrap();
            let (exact, found) = (run.last().matrix(), again.last().matrix());
            let (error, moved) = (off(&found, &exact), (&exact - DMatrix::identity(4, 4)).amax());
            let column = |k: usize| {
                let at = |e: f64| {
                    let mut start = start.clone();
                    start[k] += e;
                    let end = $method.run(&numbers, start, span).unwrap().last().point.clone();
                    DVector::from_column_slice(&end)
                };
                (at(1e-5) - at(-1e-5)) / 2e-5
            };
            let runs = DMatrix::from_columns(&[0, 1, 2, 3].map(column));
            let of_runs = off(&found, &runs);
            println!("{}: {error:.1e}, of runs {of_runs:.1e}", stringify!($method));
            assert!(moved > 0.05, "{exact}");
            assert!(error < 1e-9 && of_runs < 1e-8, "{error:e} {of_runs:e}\n{found}\n{exact}");
        })+};
    }
    compare!(DormandPrince8, DormandPrince5, RungeKuttaChebyshev);
}

/// A row of `n` masses between springs, whose friction heats one bath: `q_i' = p_i`, `p_i' = −∂V − γ p_i`, `u' = γ Σ p_i²`, with `S = ln u`. Its
/// friction `K` depends on the temperature `1/∂_uS`.
#[derive(Clone)]
struct Warm {
    count: usize,
    friction: f64,
    /// Of an entry of the state.
    unit: f64,
}

impl Warm {
    fn stretch(&self, x: &[f64], i: usize) -> f64 {
        let at = |i: usize| if i == 0 || i > self.count { 0.0 } else { x[i - 1] };
        (at(i + 1) - at(i)) / self.unit
    }

    fn tension(&self, x: &[f64], i: usize) -> f64 {
        let stretch = self.stretch(x, i);
        (stretch + 0.3 * stretch.powi(3)) * self.unit
    }
}

impl Equations for Warm {
    fn sizes(&self) -> Sizes {
        let n = 2 * self.count + 1;
        Sizes { entries: n, directions: n, laws: 2 }
    }

    fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
        let n = self.count;
        let springs = (0..=n).map(|i| self.stretch(x, i));
        let springs = springs.map(|s| 0.5 * s * s + 0.075 * s.powi(4)).sum::<f64>();
        let moving: f64 = x[n..2 * n].iter().map(|p| 0.5 * p * p).sum();
        values[ENERGY] = springs * self.unit.powi(2) + moving + x[2 * n] * self.unit.powi(2);
        values[ENTROPY] = x[2 * n].ln();
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        let n = self.count;
        self.values(t, x, values);
        w.fill(0.0);
        for i in 0..n {
            w[i] = self.tension(x, i) - self.tension(x, i + 1);
            w[n + i] = x[n + i];
        }
        w[2 * n] = self.unit.powi(2);
        w[4 * n + 1] = x[2 * n].recip();
    }

    fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        let n = self.count;
        let [mut w, mut values] = [vec![0.0; 4 * n + 2], vec![0.0; 2]];
        self.differentials(t, x, &mut values, &mut w);
        for i in 0..n {
            v[i] = x[n + i];
            v[n + i] = -w[i] - self.friction * x[n + i];
        }
        let heat: f64 = x[n..2 * n].iter().map(|p| self.friction * p * p).sum();
        v[2 * n] = heat / self.unit.powi(2);
        Some(v[2 * n] / x[2 * n])
    }

    fn second_law(&self) -> SecondLaw {
        SecondLaw::Exact
    }

    fn is_vector_space(&self) -> bool {
        true
    }
}

impl Apart for Warm {
    fn is_zero(&self, part: Part) -> bool {
        part == Part::Gyroscopic
    }

    fn apply(&self, part: Part, _: f64, _: &[f64], w: Covectors<'_>, alpha: &[f64], v: &mut [f64]) {
        let n = self.count;
        v.fill(0.0);
        if part == Part::Reversible {
            v[..n].copy_from_slice(&alpha[n..2 * n]);
            (0..n).for_each(|i| v[n + i] = -alpha[i]);
            return;
        }
        // K = γ T Σ b_i b_iᵀ with ⟨w, b_i⟩ = 0, and the temperature T = ∂_uH/∂_uS.
        let temperature = w.energy[2 * n] / w.entropy[2 * n];
        for i in 0..n {
            let b = w.energy[n + i] / w.energy[2 * n];
            let along = self.friction * temperature * (b * alpha[2 * n] - alpha[n + i]);
            v[n + i] -= along;
            v[2 * n] += b * along;
        }
    }
}

impl Warm {
    fn start(&self) -> Vec<f64> {
        let n = 2 * self.count + 1;
        let entry = |i: usize| match i {
            _ if i + 1 == n => 2.0,
            _ => (1.7 * i as f64 + 0.4).sin() * self.unit,
        };
        (0..n).map(entry).collect()
    }
}

/// The derivatives of the end of runs in the same steps, column by column.
fn by_differences<S: Equations, M: Copy + Stepper<FromEquations<S>>>(
    system: &FromEquations<S>,
    method: M,
    x0: &[f64],
    span: Span,
) -> DMatrix<f64> {
    let end = |k: usize, step: f64| {
        let mut x = x0.to_vec();
        x[k] += step;
        let run = method.run(system, x.into(), span).expect("it runs");
        DVector::from_column_slice(&run.last().point)
    };
    let columns = (0..x0.len()).map(|k| {
        let step = 1e-4 * x0[k].abs();
        let slope = |h: f64| (end(k, h) - end(k, -h)) / (2.0 * h);
        (slope(0.5 * step) * 4.0 - slope(step)) / 3.0
    });
    DMatrix::from_columns(&columns.collect::<Vec<_>>())
}

/// Rows and columns in units of the state.
fn scaled(t: &DMatrix<f64>, [x0, end]: [&[f64]; 2]) -> DMatrix<f64> {
    DMatrix::from_fn(t.nrows(), t.ncols(), |i, j| {
        t[(i, j)] * x0[j].abs() / end[i].abs().max(x0[i].abs())
    })
}

/// Compares the tangent of a system of one's own with differences of runs in the same steps, in units of the state.
fn is_that_of_differences<S, M>(
    name: &str,
    system: &FromEquations<S>,
    method: M,
    x0: &[f64],
    span: Span,
) where
    S: Equations,
    M: Copy + Stepper<FromEquations<S>>,
{
    let run = method.tangent(system, x0.into(), span).expect("a tangent");
    let plain = method.run(system, x0.into(), span).expect("it runs");
    assert!(plain.last().point == run.last().point, "{name}: the tangent changed the run");
    let end: &[f64] = &run.last().point;
    let [found, differences] = [run.last().matrix(), by_differences(system, method, x0, span)]
        .map(|t| scaled(&t, [x0, end]));
    let error = off(&found, &differences);
    println!("{name}: {error:.1e}, {}", run.sensitivity());
    // Differences of the motion have two thirds of the digits, 4e-11, in some hundred stages.
    assert!(error < 2e-8, "{name}: {error:e}");
    // That of implicit steps has the digits of the differences.
    assert!(run.sensitivity().energy < 1e-8, "{name}: {}", run.sensitivity());
}

#[test]
fn systems_of_ones_own_have_the_tangents_of_differences_of_runs() {
    for (count, unit) in [(1, 1.0), (3, 1.0), (3, 1e-20), (3, 1e11), (5, 1.0)] {
        let warm = Warm { count, friction: 0.3, unit };
        let (x0, span) = (warm.start(), Span::steps(0.1, if count == 5 { 2 } else { 4 }));
        let whole = FromEquations(warm.clone());
        let apart = FromEquations(Differences(warm));
        let name = |kind: &str| format!("{count} masses of {unit:e}, {kind}");
        is_that_of_differences(&name("5"), &whole, DormandPrince5, &x0, span);
        is_that_of_differences(&name("8"), &whole, DormandPrince8, &x0, span);
        is_that_of_differences(&name("stabilised"), &whole, RungeKuttaChebyshev, &x0, span);
        is_that_of_differences(&name("5, apart"), &apart, DormandPrince5, &x0, span);
        is_that_of_differences(&name("8, apart"), &apart, DormandPrince8, &x0, span);
        is_that_of_differences(&name("Weyl"), &apart, WeylMidpoint, &x0, span);
        is_that_of_differences(&name("Gauss"), &apart, Gauss::<2>, &x0, span);
        is_that_of_differences(&name("Radau"), &apart, Radau::<2>, &x0, span);
        // By steps beside them, because it is not symmetric.
        let explicit = Scheme::new(WeylMidpoint).gradient(ItohAbe);
        is_that_of_differences(&name("Itoh-Abe"), &apart, explicit, &x0, span);
    }
}

/// A pendulum that has turned many times.
struct Turned;

impl Equations for Turned {
    fn sizes(&self) -> Sizes {
        Sizes { entries: 2, directions: 2, laws: 2 }
    }

    fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
        values.copy_from_slice(&[0.5 * x[1] * x[1] - x[0].cos(), 0.0]);
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.values(t, x, values);
        w.copy_from_slice(&[x[0].sin(), x[1], 0.0, 0.0]);
    }

    fn velocity(&self, _: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        v.copy_from_slice(&[x[1], -x[0].sin()]);
        Some(0.0)
    }

    fn is_vector_space(&self) -> bool {
        true
    }
}

#[test]
fn an_angle_that_has_turned_many_times_has_derivatives() {
    let system = FromEquations(Turned);
    let span = Span::steps(0.1, 12);
    let matrix = |q: f64| {
        let run = DormandPrince8.tangent(&system, [q, 0.3].into(), span).expect("a tangent");
        run.last().matrix()
    };
    let expected = matrix(0.7);
    for turns in [10.0, 1e3, 1e5] {
        let error = off(&matrix(0.7 + turns * std::f64::consts::TAU), &expected);
        println!("{turns} turns: {error:.1e}");
        // The angle itself loses as many digits.
        assert!(error < 1e-9 * turns, "{turns}: {error:e}");
    }
}
