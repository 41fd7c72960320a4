//! Casimirs whose differentials become dependent on the way of a run: the energy and the entropy keep their
//! laws, the run goes on, and the certificate shows what the Casimir has changed by.

mod models;

use metriplectic::fields::Space;
use metriplectic::integrators::{Schedule, StepError};
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee, scientific};
use models::{BEFORE_THE_CUSP, cusp};

type State6 = SVector<Real, 6>;
type State10 = SVector<Real, 10>;
/// Function pointers, so that one compiled system serves all choices of entropy and Casimir.
type Field6 = fn(&State6) -> Real;
type Field10 = fn(&State10) -> Real;

/// A run must end with the energy at round-off, no fall of the entropy and the Casimir within `bound`.
fn certified<Y: Metriplectic>(
    name: &str,
    system: &Y,
    start: &<Y::Manifold as Space>::Point<f64>,
    course: impl Into<Schedule>,
    bound: f64,
) where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    let course = course.into();
    let mut steps = WeylMidpoint.steps(system, start.clone(), course).expect("a model");
    while steps.ending().is_none() {
        if let Err(error) = steps.advance() {
            panic!("{name}: {error}\n{}", steps.certificate());
        }
    }
    let certificate = steps.certificate();
    let change = certificate.invariants[0].max_error;
    println!("{name}: {certificate}");
    let (falls, steps) = (certificate.entropy_falls, certificate.steps);
    Claim::new(Guarantee::DependentCasimirs, format!("{name}, {steps} steps"), "WeylMidpoint")
        .against("C at the start; S of every step")
        .record(format!("{}; {falls} falls", scientific(change)), format!("{bound:.1e}; 0 falls"));
    assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{name}: {certificate}");
    assert!(change <= bound, "{name}: C changed by {change:.1e} > {bound:.1e}");
    assert_eq!(certificate.effort.splits, 0, "{name}: {certificate}");
    assert!(certificate.keeps_invariants(), "{name}: {certificate}");
}

/// `H = Σ x_k²/(2 I_k)` on so(4)*.
fn energy6(x: &State6) -> Real {
    let inertia = [1.0, 1.3, 1.7, 2.2, 2.8, 3.5];
    (0..6).map(|k| x[k] * x[k] * (0.5 / inertia[k])).sum()
}

/// `J·N`, which is at most `|x|²/2`, with equality on the singular orbits `J = N`.
fn alignment(x: &State6) -> Real {
    x[0] * x[3] + x[1] * x[4] + x[2] * x[5]
}

fn square(x: &State6) -> Real {
    x.norm_squared()
}

fn on_so4(
    entropy: Field6,
    casimir: Field6,
) -> impl Metriplectic<Manifold = LieDual<6>, Metric = Canonical> {
    System::on(LieDual::so4())
        .energy(energy6 as Field6)
        .entropy(entropy)
        .casimir(casimir)
        .build()
        .expect("it is a system")
}

const START: [f64; 6] = [0.3, -0.2, 0.9, 0.1, 0.8, 0.4];
/// On a singular orbit: `J = N`.
const SINGULAR: [f64; 6] = [0.3, -0.2, 0.9, 0.3, -0.2, 0.9];

/// The flow tends to `J = N`, where `dS` and `dC` are parallel, and goes on there.
#[test]
fn a_run_goes_through_dependence_at_every_step_size() {
    let system = on_so4(alignment, square);
    let start = START.into();
    // All fields are quadratic, so what fades out is round-off too.
    for per_unit in [5_u16, 10, 20, 40] {
        let h = f64::from(per_unit).recip();
        let span = Span::steps(h, 300 * usize::from(per_unit));
        certified(&format!("so(4)*, h = {h}"), &system, &start, span, 1e-12);
    }
    certified("so(4)*, adaptive", &system, &start, Span::until(300.0), 1e-12);
}

#[test]
fn a_long_run_stays_at_round_off_where_casimirs_are_dependent() {
    let system = on_so4(alignment, square);
    certified("so(4)*, t = 10⁴", &system, &START.into(), Span::steps(0.1, 100_000), 1e-12);
    // On the singular orbit nothing is dissipated: the entropy is constant, and the Casimir with it.
    certified("J = N, t = 5000", &system, &SINGULAR.into(), Span::steps(0.05, 100_000), 1e-12);
}

#[test]
fn other_casimirs_of_so4_become_dependent_without_an_error() {
    let cases: [(&str, Field6, Field6); 4] = [
        ("exchanged, least |x|²", |x| -square(x), alignment),
        ("exchanged, largest |x|²", square, alignment),
        ("quartic S", |x| alignment(x) + alignment(x).powi(2) * 0.3, square),
        ("quartic C", alignment, |x| square(x) + alignment(x).powi(2) * 0.3),
    ];
    for (name, entropy, casimir) in cases {
        let system = on_so4(entropy, casimir);
        for per_unit in [5_u16, 10, 20] {
            let h = f64::from(per_unit).recip();
            let span = Span::steps(h, 200 * usize::from(per_unit));
            certified(&format!("{name}, h = {h}"), &system, &START.into(), span, 1e-4 * h * h);
            certified(&format!("{name}, J = N"), &system, &SINGULAR.into(), span, 1e-4 * h * h);
        }
        certified(name, &system, &START.into(), Span::until(100.0).tolerance(1e-4), 1e-10);
    }
}

#[test]
fn casimirs_become_dependent_under_a_metric_that_varies_too() {
    let metric = |x: &State6| {
        let wave = State6::from_fn(|i, _| (x[(i + 1) % 6] * 0.7).sin());
        SMatrix::<Real, 6, 6>::identity() + wave * wave.transpose() * Real::from(0.5)
    };
    let system = System::on(LieDual::so4())
        .metric(Metric::field(metric))
        .energy(energy6 as Field6)
        .entropy(alignment as Field6)
        .casimir(square as Field6)
        .build()
        .unwrap();
    for per_unit in [5_u16, 10, 20] {
        let h = f64::from(per_unit).recip();
        let span = Span::steps(h, 100 * usize::from(per_unit));
        certified(&format!("metric, h = {h}"), &system, &START.into(), span, 1e-4 * h * h);
    }
    certified("metric, adaptive", &system, &START.into(), Span::until(60.0), 1e-10);
}

/// `so(5)*` in the basis of the elementary rotations of R⁵.
fn so5() -> LieDual<10> {
    let basis = planes().map(|(i, j)| {
        let mut generator = SMatrix::<f64, 5, 5>::zeros();
        (generator[(j, i)], generator[(i, j)]) = (1.0, -1.0);
        generator
    });
    LieDual::of(LieAlgebra::of_matrices(&basis).expect("an algebra"))
}

/// The coordinate planes of R⁵.
fn planes() -> [(usize, usize); 10] {
    let mut planes = (0..5).flat_map(|i| (i + 1..5).map(move |j| (i, j)));
    [(); 10].map(|()| planes.next().expect("ten planes"))
}

/// `tr X⁴ = |X²|²` of the skew matrix `X` with the entries `x`, beside `|x|²` the other Casimir of so(5)*. The sums are written
/// out, because steps near a dependent Casimir ask for them some ten million times.
fn quartic(x: &State10) -> Real {
    // The place of the plane (i, j) with i < j.
    let place = |i: usize, j: usize| i * (9 - i) / 2 + j - i - 1;
    let entry = |i, j| if i < j { -x[place(i, j)] } else { x[place(j, i)] };
    let mut sum = Real::from(0.0);
    for i in 0..5 {
        for j in 0..=i {
            let mut square = Real::from(0.0);
            for k in (0..5).filter(|&k| k != i && k != j) {
                square += entry(i, k) * entry(k, j);
            }
            sum += square * square * if i == j { 1.0 } else { 2.0 };
        }
    }
    sum
}

fn square10(x: &State10) -> Real {
    x.norm_squared()
}

fn energy10(x: &State10) -> Real {
    (0..10).map(|k| x[k] * x[k] * (0.5 / (1.0 + 0.3 * k as f64))).sum()
}

/// The eigenvalues `±iλ₁, ±iλ₂` of `X` become equal, or one of them zero.
#[test]
fn a_quartic_casimir_of_so5_becomes_dependent_without_an_error() {
    let start = start10();
    let (u, v) = ([0.3, -0.2, 0.9, 0.1, 0.8], [0.4, -0.5, 0.2, 0.6, -0.1]);
    let plane = SVector::from(planes().map(|(i, j)| u[i] * v[j] - u[j] * v[i]));
    let cases: [(&str, Field10, Field10, SVector<f64, 10>); 5] = [
        ("S = tr X⁴", quartic, square10, start),
        ("S = −tr X⁴", |x| -quartic(x), square10, start),
        ("S = |x|²", square10, quartic, start),
        ("S = −|x|²", |x| -square10(x), quartic, start),
        ("S = tr X⁴, λ₂ = 0", quartic, square10, plane),
    ];
    for (name, entropy, casimir, start) in cases {
        let system = on_so5(entropy, casimir);
        for per_unit in [5_u16, 10, 20] {
            let h = f64::from(per_unit).recip();
            let span = Span::steps(h, 100 * usize::from(per_unit));
            certified(&format!("{name}, h = {h}"), &system, &start, span, 1e-4 * h * h);
        }
        certified(name, &system, &start, Span::until(50.0).tolerance(1e-4), 1e-8);
    }
}

/// A start on so(5)*.
fn start10() -> SVector<f64, 10> {
    SVector::from([0.3, -0.2, 0.9, 0.1, 0.8, 0.4, -0.5, 0.2, 0.6, -0.1]) * 0.7
}

/// Entropies, and their largest values on the orbits of a sphere.
fn largest_entropies(start: &SVector<f64, 10>) -> [(&'static str, Field10, f64); 2] {
    let square = start.norm_squared();
    [
        ("S = tr X⁴", quartic, 2.0 * square * square),
        ("S = −tr X⁴", |x| -quartic(x), -square * square),
    ]
}

fn on_so5(
    entropy: Field10,
    casimir: Field10,
) -> impl Metriplectic<Manifold = LieDual<10>, Metric = Canonical> {
    System::on(so5())
        .energy(energy10 as Field10)
        .entropy(entropy)
        .casimir(casimir)
        .build()
        .expect("it is a system")
}

/// `dS` becomes a multiple of `dC`, where the projection of the midpoint rule fades out. The Casimir stays at round-off,
/// and the entropy below its largest value on the orbit, at which order 8 ends: `tr X⁴/|x|⁴` is at most 1/2, with
/// equality where an eigenvalue is zero, and at least 1/4.
#[test]
fn a_casimir_of_so5_stays_where_the_entropy_depends_on_it() {
    let start = start10();
    for (name, entropy, largest) in largest_entropies(&start) {
        let system = on_so5(entropy, square10);
        for (h, count) in [(0.2, 500), (0.1, 3000), (0.05, 2000)] {
            let run = WeylMidpoint.run(&system, start, Span::steps(h, count)).unwrap();
            let (certificate, end) = (run.certificate(), run.last().entropy);
            println!("{name}, h = {h}: S − S_max = {:.1e}\n{certificate}", end - largest);
            let (change, falls) = (certificate.invariants[0].max_error, certificate.entropy_falls);
            let problem = format!("so(5)*, {name}, {count} steps of {h}");
            Claim::new(Guarantee::DependentCasimirs, problem, "WeylMidpoint")
                .against("C at the start; S of every step")
                .record(format!("{}; {falls} falls", scientific(change)), "round-off; 0 falls");
            assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
            assert!(certificate.keeps_invariants(), "{name}, h = {h}: {certificate}");
            // 50 ε of the terms of tr X⁴, which are five times as large as it.
            assert!(end - largest <= 250.0 * f64::EPSILON * largest.abs(), "{name}: {end}");
        }
    }
}

/// The other methods keep the energy and the Casimir there, or end in an error of the step: none goes on without them. The
/// entropy falls by its round-off at most, which the certificate counts.
#[test]
fn other_methods_keep_a_casimir_of_so5_or_end_in_an_error() {
    fn kept<Y: Metriplectic<Manifold = LieDual<10>>>(
        name: &str,
        method: impl Method<Y> + Copy + std::fmt::Debug,
        system: &Y,
        start: SVector<f64, 10>,
        largest: f64,
    ) {
        let spans: [Schedule; 2] =
            [Span::steps(0.1, 300).into(), Span::until(30.0).tolerance(1e-6).into()];
        for (index, span) in spans.into_iter().enumerate() {
            let (trajectory, cause) = match method.run(system, start, span) {
                Ok(run) => (run, None),
                Err(RunError::Step { cause, trajectory }) => (*trajectory, Some(cause)),
                Err(error) => panic!("{name}, {method:?}: {error}"),
            };
            let (c, end) = (trajectory.certificate(), trajectory.last());
            let ended = cause.map_or_else(|| "kept".into(), |cause| cause.to_string());
            println!(
                "{name}, {method:?}, {index}: {} steps to t = {:.1}, {} falls of {:.1e}, \
                 S − S_max = {:.1e}, C by {:.1e}: {ended}",
                c.steps,
                end.time,
                c.entropy_falls,
                c.min_entropy_increment,
                end.entropy - largest,
                c.invariants[0].max_error
            );
            assert!(c.keeps_energy() && c.keeps_invariants(), "{name}, {method:?}: {c}");
            let round_off = 250.0 * f64::EPSILON * largest.abs();
            assert!(end.entropy - largest <= round_off, "{name}, {method:?}: {}", end.entropy);
            assert!(c.min_entropy_increment >= -round_off, "{name}, {method:?}: {c}");
        }
    }
    let start = start10();
    for (name, entropy, largest) in largest_entropies(&start) {
        let system = on_so5(entropy, square10);
        kept(name, Gauss::<2>, &system, start, largest);
        kept(name, Radau::<3>, &system, start, largest);
        kept(name, DormandPrince5, &system, start, largest);
        kept(name, DormandPrince8, &system, start, largest);
    }
}

#[test]
fn a_run_that_dependence_ends_says_so() {
    let system = cusp();
    let ends: [Schedule; 3] =
        [Span::steps(0.1, 30).into(), Span::steps(0.01, 300).into(), Span::until(3.0).into()];
    for course in ends {
        match WeylMidpoint.run(&system, BEFORE_THE_CUSP, course) {
            Err(RunError::Step { cause, trajectory }) => {
                println!("{cause}\n{}", trajectory.certificate());
                assert!(
                    matches!(cause, StepError::DependentInvariants { index: 0, fraction, .. } if fraction < 1e-3),
                    "{cause}"
                );
            }
            Err(error) => panic!("{error}"),
            Ok(run) => panic!("{:?}\n{}", run.last().point, run.certificate()),
        }
    }
}
