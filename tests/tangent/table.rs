//! Rows of the table of tangents that no other file has: stabilised steps, and what holds without friction.

use metriplectic::dynamics::Parametrised as _;
use metriplectic::prelude::*;
use nalgebra::DMatrix;

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
