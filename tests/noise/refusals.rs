//! What has no noise, and which methods cannot sample it: a typed error with a remedy.

use metriplectic::dynamics::noise::{NoiseTerms, Uniform};
use metriplectic::integrators::{Noisy, RunError, StateSpace};
use metriplectic::prelude::*;
use nalgebra::vector;

use crate::body::{INERTIA, body};

const START: Vector3<f64> = vector![0.9, 0.5, 0.3];

/// The fault of the noise in an error of a run.
pub(crate) fn fault<M: StateSpace, T>(run: Result<T, RunError<M>>) -> NoiseError {
    match run.err().expect("the run is refused") {
        RunError::Flow(error) => *error.downcast_ref().expect("it is a fault of noise"),
        RunError::Method(error) => *error.downcast_ref().expect("it is a fault of noise"),
        RunError::Step { cause: StepError::Method { error, .. }, .. } => {
            *error.downcast_ref().expect("it is a fault of noise")
        }
        other => panic!("another error: {other}"),
    }
}

#[test]
fn constants_and_steps() {
    let span = Span::steps(0.05, 10);
    let method = NinomiyaVictoir(DormandPrince5).seed(1);
    for k_b in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = fault(method.run(&body(k_b), START, span));
        assert!(matches!(error, NoiseError::BoltzmannNotPositive { .. }), "{error}");
    }
    let body = body(0.3);
    let until = Span::until(1.0).tolerance(1e-5);
    assert_eq!(fault(method.run(&body, START, until)), NoiseError::NeedsFixedSteps);
}

#[test]
fn methods() {
    const EULER: Tableau = Tableau::new("Euler", 1, &[], &[(0, 1.0)]);
    let (body, span) = (body(0.3), Span::steps(0.05, 10));
    let euler = ExplicitRungeKutta::new(&EULER);
    let error = fault(NinomiyaVictoir(euler).seed(1).run(&body, START, span));
    assert_eq!(error, NoiseError::OrderTooLow { order: 1 });
    assert!(RandomFlow(euler).seed(1).run(&body, START, span).is_ok());
    let error = fault(NinomiyaVictoir(Radau::<2>).seed(1).run(&body, START, span));
    assert_eq!(error, NoiseError::NoiseWithRadau);
}

/// `{x, y} = y`, with a third variable that no bracket moves: the algebra of the affine group.
macro_rules! affine {
    ($noise:expr) => {
        System::on(Euclidean::<3>)
            .bracket(Poisson::field(|x: &Vector3<Real>| {
                let mut pi = Matrix3::<Real>::zeros();
                (pi[(0, 1)], pi[(1, 0)]) = (x.y, -x.y);
                pi
            }))
            .energy(|x: &Vector3<Real>| (x.x * x.x + x.y * x.y) * 0.5 + x.z)
            .entropy(|x: &Vector3<Real>| x.z)
            .noise($noise)
            .build()
            .unwrap()
    };
}

#[test]
fn a_bracket_that_changes_the_volume() {
    let (start, span) = (vector![0.7, 1.2, 0.3], Span::steps(0.01, 5));
    let method = RandomFlow(DormandPrince5).seed(1);
    let error = fault(method.run(&affine!(Boltzmann(0.1)), start, span));
    // div(Π dH) = −H_x.
    assert!(
        matches!(error, NoiseError::NotUnimodular { divergence, .. } if (divergence + 0.7).abs() < 1e-12),
        "{error}"
    );
    let with_measure = affine!(Boltzmann(0.1).measure(|x: &Vector3<Real>| -x.y.ln()));
    assert!(method.run(&with_measure, start, span).is_ok());
    // It vanishes where x = 0, and not around.
    let error = fault(method.run(&affine!(Boltzmann(0.1)), vector![0.0, 1.2, 0.3], span));
    assert!(matches!(error, NoiseError::NotUnimodular { .. }), "{error}");
    let disc = System::on(Euclidean::<2>)
        .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
        .entropy(|x: &Vector2<Real>| x.x * 0.2)
        .noise(Boltzmann(0.1).measure(|x: &Vector2<Real>| Real::from((x.x.re + 2.0).ln())))
        .build()
        .unwrap();
    let error = fault(method.run(&disc, vector![0.7, 0.2], span));
    assert!(matches!(error, NoiseError::LostDerivative { what: "ln μ", .. }), "{error}");
}

#[test]
fn systems() {
    let span = Span::steps(0.01, 5);
    let method = RandomFlow(DormandPrince5).seed(1);
    let published = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.component_mul(p).component_div(&INERTIA.cast()).sum() * 0.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .second_law(SecondLaw::Published)
        .noise(Boltzmann(0.3))
        .build()
        .unwrap();
    assert_eq!(fault(method.run(&published, START, span)), NoiseError::NoiseAndPublished);
}

/// Two bodies that exchange heat at the rate 1, also where one of them has none left.
fn bodies(
    k_b: f64,
) -> Noisy<
    impl Metriplectic<
        Manifold = Euclidean<2>,
        Metric = Canonical,
        Dissipation = impl NoiseTerms<Euclidean<2>, Canonical>,
    >,
    Uniform,
> {
    System::on(Euclidean::<2>)
        .energy(|u: &Vector2<Real>| u.x + u.y)
        .entropy(|u: &Vector2<Real>| (u.x.ln() + u.y.ln()) * 0.01)
        .dissipation(OnsagerDissipation(|_: &Vector2<Real>, w: &Vector2<Real>| {
            [Contact { rate: 1.0.into(), along: vector![w.y, -w.x] }]
        }))
        .noise(Boltzmann(k_b))
        .build()
        .expect("a system")
}

#[test]
fn a_noise_field_that_does_not_vanish_at_the_edge() {
    let (bodies, start) = (bodies(1.0), vector![0.1, 1.0]);
    let run = RandomFlow(DormandPrince5).seed(1).run(&bodies, start, Span::steps(0.01, 100));
    let error = fault(run);
    assert!(matches!(error, NoiseError::Unresolved { reach, .. } if reach > 0.0), "{error}");
}

#[test]
fn friction_that_is_faster_than_a_step() {
    // Beside equal energies `K'` is 0.01 (1/u² + 1/v²) = 0.08 on the line of both.
    let (bodies, start) = (bodies(1e-6), vector![0.5, 0.5]);
    let by_random_flow = |h: f64, steps| {
        RandomFlow(DormandPrince5).seed(1).run(&bodies, start, Span::steps(h, steps))
    };
    let by_splitting = |h: f64, steps| {
        NinomiyaVictoir(DormandPrince5).seed(1).run(&bodies, start, Span::steps(h, steps))
    };
    let by_stages = |h: f64, steps| {
        NinomiyaVictoir(Gauss::<2>).seed(1).run(&bodies, start, Span::steps(h, steps))
    };
    for fast in [by_random_flow(20.0, 10), by_splitting(20.0, 10), by_stages(20.0, 10)] {
        let error = fault(fast);
        let NoiseError::FrictionUnresolved { rate, below, .. } = error else { panic!("{error}") };
        assert!((rate - 1.6).abs() < 0.1 && (below - 12.5).abs() < 1.0, "{error}");
    }
    // Few steps: the certificate says it.
    for fast in [by_random_flow(20.0, 2), by_splitting(20.0, 2), by_stages(20.0, 2)] {
        let fast = fast.unwrap();
        let certificate = fast.certificate();
        assert!(!certificate.is_resolved());
        assert!(certificate.to_string().contains("friction not resolved: h|K'| = 1.6e0"));
    }
    for slow in [by_random_flow(5.0, 50), by_splitting(5.0, 50), by_stages(5.0, 50)] {
        let slow = slow.unwrap();
        let certificate = slow.certificate();
        assert!((certificate.friction - 0.4).abs() < 0.05, "{certificate}");
        assert!(certificate.is_resolved() && !certificate.to_string().contains("not resolved"));
    }
}
