//! Rows of the table of tangents that no other file has: stabilised steps, and what holds without friction.

use metriplectic::dynamics::Parametrised as _;
use metriplectic::prelude::*;
use nalgebra::{DMatrix, Matrix3, Rotation3, vector};

use crate::{body, compared, differences, off};

const START: Vector3<f64> = Vector3::new(0.4, -1.0, 0.3);
const THETA: Vector4<f64> = Vector4::new(3.0, 2.0, 1.0, 0.4);

/// Steps with so many stages as friction asks for: the tangent has those of the step that was taken.
#[test]
fn stabilised_steps_have_tangents() {
    let family = body();
    let system = family.at_parameters(THETA);
    for (h, n) in [(0.1, 40), (0.4, 10)] {
        let span = Span::steps(h, n);
        let [error, law] = compared(&system, RungeKuttaChebyshev, &START, &span, 1e-3);
        let run = RungeKuttaChebyshev.tangent(&system, START, span).unwrap();
        let differences = differences::<Euclidean<4>, LieDual<3>>(&THETA, 1e-3, |t| {
            let system = family.at_parameters(*t);
            RungeKuttaChebyshev.run(&system, START, span).unwrap().last().point
        });
        let along = off(&run.last().along_parameters(), &differences);
        println!("h = {h}: x₀ {error:.1e}, θ {along:.1e}, law {law:.1e}, {}", run.sensitivity());
        assert!(error < 1e-9 && along < 1e-9 && law < 1e-12, "{error:e} {along:e} {law:e}");
        assert!(run.sensitivity().entropy.unwrap() < 1e-12);
    }
    crate::adjoint::transposed(
        ("Chebyshev", 1e-12),
        (&system, RungeKuttaChebyshev),
        &START,
        &Span::steps(0.5, 8).into(),
    );
}

/// The second law of the tangent of a scheme, `dS(x') T' − dS(x) T = δ(h ⟨w_S, K̃ w_S⟩)`.
#[test]
fn schemes_have_the_second_law_of_tangents() {
    let family = body();
    let system = family.at_parameters(THETA);
    let run = Scheme::new(WeylMidpoint).tangent(&system, START, Span::steps(0.1, 64)).unwrap();
    println!("{}", run.sensitivity());
    assert!(run.sensitivity().entropy.unwrap() < 1e-12);
}

/// Without friction the tangent keeps `dC` and `dH`, and is a Poisson map to the order of the method and no better
/// (Ge and Marsden 1988).
#[test]
fn tangents_without_friction_are_poisson_to_their_order() {
    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x / 6.0 + p.y.powi(4) * 0.3 + p.z * p.z * 0.5)
        .casimir(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()
        .unwrap();
    let weyl = Scheme::new(WeylMidpoint);
    let run = weyl.tangent(&body, START, Span::steps(0.1, 40)).unwrap();
    let (energy, casimir) = (run.sensitivity().energy, run.sensitivity().invariants);
    assert!(energy < 1e-13 && casimir < 1e-13, "{energy:e} {casimir:e}");
    let tensor = |p: &Vector3<f64>| -> Matrix3<f64> { p.cross_matrix() };
    let off: Vec<f64> = [0.2, 0.1, 0.05, 0.025]
        .into_iter()
        .map(|h| {
            let run = weyl.tangent(&body, START, Span::steps(h, 1)).unwrap();
            let j: DMatrix<f64> = run.last().along_start();
            let pushed = &j * tensor(&START) * j.transpose();
            (pushed - tensor(&run.last().point)).norm()
        })
        .collect();
    let slopes: Vec<f64> = off.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect();
    println!("Poisson {off:?}, slopes {slopes:.2?}");
    assert!(slopes.iter().all(|slope| (slope - 3.0).abs() < 0.1), "{slopes:?}");
}

/// An event at the time of an output: both have the derivatives of that state.
#[test]
fn events_at_outputs_have_one_tangent() {
    let system = body().at_parameters(Vector4::new(3.0, 2.0, 1.0, 0.05));
    let event = |span: Span| span.event("x", |p: &Vector3<f64>| p.x);
    let span = Span::steps(0.25, 40);
    let time = DormandPrince8.tangent(&system, START, event(span)).unwrap().events()[0].state.time;
    for time in [time.next_down(), time, time.next_up()] {
        let run = DormandPrince8.tangent(&system, START, event(span).output_at([time])).unwrap();
        let (state, event) = (&run.states()[1], &run.events()[0]);
        let apart = off(&event.state.matrix(), &state.matrix());
        assert!(apart < 1e-12, "{apart:e}");
    }
}

/// Near a state at rest the entropy depends on the other laws, and its round-off moves the end of a step by more than that of the
/// entries.
#[test]
fn explicit_steps_have_tangents_near_rest() {
    let system = body().at_parameters(THETA);
    macro_rules! accepted {
        ($name:literal, $method:expr, $order:literal) => {
            for beside in [1e-14, 1e-12, 1e-10, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3] {
                let x0 = vector![1.0, beside, beside];
                for span in [Span::steps(0.2, 10), Span::steps(0.02, 10)] {
                    let run = $method.tangent(&system, x0, span).unwrap();
                    let exact = Gauss::<3>.tangent(&system, x0, span).unwrap();
                    let error = off(&run.last().along_start(), &exact.last().along_start());
                    println!("{}, beside {beside:e}: {error:.1e} off the motion", $name);
                    assert!(error < $order, "{}, beside {beside:e}: {error:e}", $name);
                    assert!(run.sensitivity().energy < 1e-13 && !run.sensitivity().at_rest);
                }
            }
            for beside in [0.3, 1e-1, 1e-2, 1e-3] {
                let (x0, e) = (vector![1.0, beside, beside], 0.01 * beside);
                let [error, law] = compared(&system, $method, &x0, &Span::steps(0.2, 5), e);
                println!("{}, beside {beside:e}: T {error:.1e}, law {law:.1e}", $name);
                // The entropy moves an end by its round-off over the way to the state at rest.
                let round_off = 20.0 * f64::EPSILON / (beside * e);
                assert!(error < 1e-9_f64.max(round_off), "{}, {beside:e}: {error:e}", $name);
            }
            let at_rest = $method.tangent(&system, Vector3::x(), Span::steps(0.2, 10)).unwrap();
            assert!(at_rest.sensitivity().at_rest);
        };
    }
    accepted!("order 5", DormandPrince5, 2e-9);
    accepted!("order 8", DormandPrince8, 1e-10);
    accepted!("Chebyshev", RungeKuttaChebyshev, 1e-3);
    let scheme = Scheme::new(WeylMidpoint);
    let run = scheme.tangent(&system, Vector3::x(), Span::steps(0.2, 10)).unwrap();
    assert!(!run.sensitivity().at_rest);
}

/// In other axes the derivatives turn with the body, however near to rest it is. There the correction of a covector divides a defect
/// of third order in the displacement `d` by `|d|²`, and is left out where it is round-off: below `|d|² = 64 ε`.
#[test]
fn tangents_near_rest_turn_with_the_axes() {
    let turned = |r: Matrix3<f64>, cubic: f64| {
        Family::on(LieDual::so3())
            .parameters(["I1", "I2", "I3", "friction"])
            .energy(move |p: &Vector3<Real>, t: &Vector4<Real>| {
                let p = r.cast::<Real>() * p;
                let terms = p.y.powi(3) + p.y * p.z * p.z;
                (p.x * p.x / t.x + p.y * p.y / t.y + p.z * p.z / t.z) * 0.5 + t.y * terms * cubic
            })
            .entropy(|p: &Vector3<Real>, t: &Vector4<Real>| (p.norm_squared() * 0.5).exp() * t.w)
            .build()
            .unwrap()
            .at_parameters(THETA)
    };
    let r = Rotation3::from_euler_angles(0.3, -0.7, 1.1).into_inner();
    let whole = DMatrix::from_iterator(3, 3, r.iter().copied());
    macro_rules! rows {
        ($($name:literal: $method:expr),+) => {$(
            for cubic in [0.0, 0.15] {
                let (straight, turned) = (turned(Matrix3::identity(), cubic), turned(r, cubic));
                let mut worst = [0.0_f64; 2];
                for (h, k) in [0.1, 2.0, 20.0].into_iter().flat_map(|h| (2..16).map(move |k| (h, k))) {
                    let x = vector![1.4, 10_f64.powi(-k), -2.0 * 10_f64.powi(-k)];
                    let span = Span::steps(h, 1);
                    let a = $method.tangent(&straight, x, span).unwrap();
                    let b = $method.tangent(&turned, r.transpose() * x, span).unwrap();
                    let (a, b) = (a.last(), b.last());
                    let start = &whole * b.along_start() * whole.transpose() - a.along_start();
                    let parameters = &whole * b.along_parameters() - a.along_parameters();
                    worst[0] = worst[0].max(start.amax());
                    worst[1] = worst[1].max(parameters.amax());
                    let adjoint = ($name, 1e-12);
                    let (x, schedule) = (r.transpose() * x, span.into());
                    crate::adjoint::transposed(adjoint, (&turned, $method), &x, &schedule);
                }
                let bar = if cubic == 0.0 { 1e-9 } else { (64.0 * f64::EPSILON).sqrt() };
                println!("{}, cubic terms of {cubic}: {:.1e} {:.1e} apart", $name, worst[0], worst[1]);
                assert!(worst.iter().all(|off| *off < bar), "{}, {cubic}: {worst:?}", $name);
            }
        )+};
    }
    rows!("midpoint": Scheme::new(WeylMidpoint), "Gauss": Gauss::<2>);
}

/// A body that comes to rest passes all distances from it.
#[test]
fn runs_that_come_to_rest_have_tangents() {
    let system = body().at_parameters(THETA);
    macro_rules! accepted {
        ($name:literal, $method:expr, $tolerance:literal, $bar:literal, $projected:literal) => {
            for (end, steps) in [(100.0, 1000), (400.0, 4000)] {
                let span = Span::until(end).tolerance($tolerance);
                let run = $method.tangent(&system, START, span).unwrap();
                let exact = Gauss::<3>.tangent(&system, START, Span::steps(0.1, steps)).unwrap();
                let error = off(&run.last().along_start(), &exact.last().along_start());
                println!("{} to rest: {error:.1e}; {}", $name, run.sensitivity());
                assert!(error < $bar, "{}: {error:e}", $name);
                // A projection leaves the rounding of its step, a solve that of each step before, times its condition.
                let solved = 20.0 * f64::EPSILON * run.sensitivity().steps as f64;
                let laws = if $projected { 4.0 * f64::EPSILON } else { solved };
                assert!(run.sensitivity().energy < laws, "{}: {}", $name, run.sensitivity());
            }
        };
    }
    accepted!("order 5", DormandPrince5, 1e-8, 1e-8, true);
    accepted!("order 8", DormandPrince8, 1e-8, 1e-8, true);
    accepted!("Chebyshev", RungeKuttaChebyshev, 1e-4, 1e-6, true);
    accepted!("Gauss", Gauss::<2>, 1e-5, 1e-4, false);
    accepted!("Radau", Radau::<3>, 1e-5, 1e-4, false);
    accepted!("midpoint", Scheme::new(WeylMidpoint), 1e-4, 1e-2, false);
}
