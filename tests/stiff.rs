//! Steps that are long for the friction, and energies with too few digits: right, an error that names the
//! cause, or a certificate that says it.
//!
//! Two bodies of temperatures `T₁`, `T₂` exchange heat: `H = e(T₁) + e(T₂)` with `e = T + ½T²`,
//! `S = s(T₁) + s(T₂)` with `s = ln T + T`, so that `s' = e'/T`, and `K = κ b bᵀ` with `b = (1/w₁, −1/w₂)`:
//! `e₁' = κ (1/T₁ − 1/T₂)`.

use metriplectic::integrators::{Effort, Schedule, StepError};
use metriplectic::prelude::*;

/// A cold and a hot body.
const START: [f64; 2] = [0.01, 3.0];

fn energy(t: Real) -> Real {
    t + t * t * 0.5
}

fn entropy(t: Real) -> Real {
    t.ln() + t
}

fn conduction(w: &Vector2<Real>, kappa: f64) -> Matrix2<Real> {
    let b = Vector2::new(w.x.recip(), -w.y.recip());
    b * b.transpose() * Real::from(kappa)
}

/// Where a run of the two temperatures ended, and what its certificate says.
type Outcome = Result<(Vec<[f64; 2]>, Certificate), StepError>;

fn outcome<M: Manifold>(
    run: Result<Trajectory<M>, RunError<M>>,
    temperatures: fn(&M::Point<f64>) -> [f64; 2],
) -> Outcome {
    match run {
        Ok(run) => {
            let states = run.iter().map(|state| temperatures(&state.point)).collect();
            Ok((states, run.certificate().clone()))
        }
        Err(RunError::Step { cause, .. }) => Err(cause),
        Err(error) => panic!("{error}"),
    }
}

/// The temperatures as two numbers.
fn flat(kappa: f64, [cold, hot]: [f64; 2], course: Schedule) -> Outcome {
    type X = Vector2<Real>;
    let system = System::on(Euclidean::<2>)
        .energy(|x: &X| energy(x.x) + energy(x.y))
        .entropy(|x: &X| entropy(x.x) + entropy(x.y))
        .dissipation(FieldDissipation(move |_: &X, w: &Vector2<Real>| conduction(w, kappa)))
        .build()
        .expect("the parts make a system");
    outcome(WeylMidpoint.run(&system, vector![cold, hot], course), |x| [x.x, x.y])
}

/// The temperatures as two points of the half line, where zero is infinitely far.
fn positive(kappa: f64, [cold, hot]: [f64; 2], course: Schedule) -> Outcome {
    type X = (Vector1<Real>, Vector1<Real>);
    let system = System::on(Product(HalfLine, HalfLine))
        .energy(|x: &X| energy(x.0.x) + energy(x.1.x))
        .entropy(|x: &X| entropy(x.0.x) + entropy(x.1.x))
        .dissipation(FieldDissipation(move |_: &X, w: &Vector2<Real>| conduction(w, kappa)))
        .build()
        .expect("the parts make a system");
    let start = (vector![cold], vector![hot]);
    outcome(WeylMidpoint.run(&system, start, course), |x| [x.0.x, x.1.x])
}

/// A run of the pair for a conductance from two temperatures.
type Pair = fn(f64, [f64; 2], Schedule) -> Outcome;

const SPACES: [(&str, Pair); 2] = [("R × R", flat), ("R₊ × R₊", positive)];

/// The temperatures at the time `t` for `κ = 1`, by the classical Runge-Kutta method in `e₁`, whose steps
/// are 1 % of the time `T₁² (1 + T₁)` in which the colder body warms.
fn exact([cold, hot]: [f64; 2], t: f64) -> [f64; 2] {
    let e = |t: f64| t + 0.5 * t * t;
    let temperature = |e: f64| 2.0 * e / (1.0 + (1.0 + 2.0 * e).sqrt());
    let total = e(cold) + e(hot);
    let rate = |e1: f64| temperature(e1).recip() - temperature(total - e1).recip();
    let (mut time, mut e1) = (0.0, e(cold));
    while time < t {
        let cold = temperature(e1);
        let h = (0.01 * cold * cold * (1.0 + cold)).min(t - time);
        let a = rate(e1);
        let b = rate(e1 + 0.5 * h * a);
        let c = rate(e1 + 0.5 * h * b);
        e1 += h / 6.0 * (a + 2.0 * (b + c) + rate(e1 + h * c));
        time += h;
    }
    [temperature(e1), temperature(total - e1)]
}

/// On how many steps the hotter body became the colder one.
fn exchanges(states: &[[f64; 2]]) -> usize {
    states.windows(2).filter(|pair| (pair[0][0] < pair[0][1]) != (pair[1][0] < pair[1][1])).count()
}

#[test]
fn stiff_friction_is_damped_or_named() {
    const KAPPA: f64 = 1e6;
    for (name, run) in SPACES {
        for exponent in -8..=3 {
            let h = 10.0_f64.powi(exponent);
            match run(KAPPA, START, Span::steps(h, 20).into()) {
                Ok((states, certificate)) => {
                    let (end, exact) = (states[20], exact(START, 20.0 * h * KAPPA));
                    let error = (end[0] - exact[0]).abs().max((end[1] - exact[1]).abs());
                    println!(
                        "{name:<8} h = 1e{exponent}: {end:.4?} off by {error:.1e}, h|K'| = {:.1e}, {} \
                         exchanges, {} retries, {:.1e}",
                        certificate.friction,
                        exchanges(&states),
                        certificate.effort.splits,
                        certificate.max_energy_error,
                    );
                    assert!(certificate.keeps_energy() && certificate.keeps_entropy());
                    let text = certificate.to_string();
                    let says = text.contains("friction not damped: h|K'| = ");
                    assert_eq!(says, certificate.is_stiff(), "{text}");
                    // What the midpoint rule is off by with h|K'| up to 10: 2 % of the temperatures.
                    assert!(says || error < 0.02 * end[0], "{name}, h = {h:e}: off by {error:e}");
                }
                Err(cause) => {
                    println!("{name:<8} h = 1e{exponent}: {cause}");
                    let StepError::StiffFriction { stiffness, .. } = cause else {
                        panic!("{name}, h = {h:e}: {cause}")
                    };
                    // The rate of the cold body, κ/(T₁² (1 + T₁)).
                    let rate = h * KAPPA / (START[0].powi(2) * (1.0 + START[0]));
                    assert!((0.5 * rate..4.0 * rate).contains(&stiffness), "{cause}");
                    let text = cause.to_string();
                    assert!(text.contains("because the friction is stiff: h|K'| = "), "{text}");
                    assert!(text.contains("take `Radau`, which damps it in steps of this size"));
                }
            }
        }
    }
}

#[test]
fn a_method_that_damps_is_not_told_to_take_itself() {
    let error = |damps| {
        let (time, h, stiffness, residual, tried) = (0.0, 1.0, 1e6, 1.0, Effort::default());
        StepError::StiffFriction { time, h, stiffness, residual, tried, damps }.to_string()
    };
    assert!(
        error(false).contains("; take `Radau`, which damps it in steps of this size, or steps")
    );
    assert!(error(true).contains("; take steps below 1.0e-5") && !error(true).contains("Radau"));
}

#[test]
fn long_steps_exchange_hot_and_cold_and_do_not_find_the_rest() {
    // The midpoint rule multiplies the difference of the temperatures by almost −1 in each step: after 20
    // of them, each 10⁵ times as long as the exact solution takes to T₁ = T₂ = 1.9172, it is still there.
    let (states, certificate) =
        flat(1e6, START, Span::steps(0.1, 20).into()).expect("it is solved");
    assert!(certificate.is_stiff() && certificate.keeps_entropy(), "{certificate}");
    assert_eq!(exchanges(&states), 20);
    let end = states[20];
    assert!((end[0] - 0.0101).abs() < 1e-4 && (end[1] - 3.0).abs() < 1e-4, "{end:?}");
}

#[test]
fn steps_that_follow_the_motion_reach_the_rest_of_a_stiff_pair() {
    // e(T) = ½ e(0.01) + ½ e(3) at rest.
    let rest = (1.0 + 7.510_05_f64).sqrt() - 1.0;
    for (name, run) in SPACES {
        let span = Span::until(1.0).tolerance(1e-4).until_rest(1e-9);
        let (states, certificate) = run(1e6, START, span.into()).expect("it is solved");
        let end = states[states.len() - 1];
        println!("{name}: {end:?} after {} steps\n{certificate}", certificate.steps);
        // It ends at 10⁻⁹ of the speed of the start, which is 10⁸, on the half line 10¹⁰ relative to T. At the
        // rate 2κ/(T² (1 + T)) = 2·10⁵ these are distances of 5·10⁻⁷ and of 5·10⁻⁵ T.
        assert!(end.iter().all(|t| (t - rest).abs() < 1e-4), "{end:?}");
        assert!(certificate.steps < 1000 && certificate.keeps_energy(), "{certificate}");
        assert!(certificate.keeps_entropy() && !certificate.is_stiff(), "{certificate}");
    }
}

#[test]
fn long_steps_keep_the_energy_to_its_round_off_or_say_that_they_do_not() {
    let mut worst = 0.0_f64;
    for (name, run) in SPACES {
        for start in [START, [0.5, 3.0], [1.0, 2.0]] {
            // |H| + Σ|∂_iH x_i| at the start; H' = 1 + T.
            let terms = start.map(|t| t + 0.5 * t * t + (1.0 + t) * t);
            let bound = 50.0 * f64::EPSILON * (terms[0] + terms[1]);
            for h in [1e3, 3e3] {
                match run(1.0, start, Span::steps(h, 300).into()) {
                    Ok((_, certificate)) => {
                        let error = certificate.max_energy_error;
                        println!("{name:<8} {start:?}, h = {h:e}: {error:.1e} of {bound:.1e}");
                        assert!(error <= bound, "{certificate}");
                        worst = worst.max(error / bound);
                    }
                    Err(cause) => {
                        println!("{name:<8} {start:?}, h = {h:e}: {cause}");
                        assert!(matches!(cause, StepError::StiffFriction { .. }), "{cause}");
                    }
                }
            }
            // At h κ = 10⁹ the solution has too few digits: an energy off by more is BROKEN.
            if let Ok((_, certificate)) = run(1e6, start, Span::steps(1e3, 300).into()) {
                let error = certificate.max_energy_error;
                println!("{name:<8} {start:?}, κ = 10⁶:\n{certificate}");
                let broken = certificate.to_string().contains("first law:   BROKEN");
                assert_eq!(broken, error > bound, "{certificate}");
                assert!(certificate.is_stiff() && broken != certificate.keeps_energy());
            }
        }
    }
    assert!(worst > 0.0);
}

/// `GM` of the earth and its radius, in m³/s² and m.
const EARTH: [f64; 2] = [3.986_004_418e14, 6.371e6];

/// A body of unit mass above the ground, `x` its height and its velocity, from an energy of both.
fn thrown(energy: fn(Real, Real) -> Real, start: [f64; 2], course: Schedule) -> Fall {
    let system = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(move |x: &Vector2<Real>| energy(x.x, x.y))
        .build()
        .expect("the parts make a system");
    WeylMidpoint.run(&system, start.into(), course)
}

type Fall = Result<Trajectory<Euclidean<2>>, RunError<Euclidean<2>>>;

/// `H = ½v² − GM/(R + z) + GM/R`, a difference of numbers of 10⁸, whose last digit is 10⁻⁸.
fn cancels(z: Real, v: Real) -> Real {
    let [gm, radius] = EARTH;
    v * v * 0.5 - (z + radius).recip() * gm + gm / radius
}

/// The same without cancellation, `H = ½v² + GM z/(R (R + z))`.
fn has_digits(z: Real, v: Real) -> Real {
    let [gm, radius] = EARTH;
    v * v * 0.5 + z / (z + radius) * (gm / radius)
}

/// A throw to its highest point `z = 0`, where `H₀ = 0` and all terms of the energy vanish.
fn throw() -> [f64; 2] {
    let (z, zero) = (-0.05, 0.0.into());
    [z, (-2.0 * has_digits(Real::from(z), zero).re).sqrt()]
}

#[test]
fn an_energy_without_digits_ends_the_run_with_the_first_law_broken() {
    // In the last one each try of a step is refused, down to the least step size.
    let cases: [(&str, [f64; 2], Schedule); 3] = [
        ("fixed", throw(), Span::steps(1e-3, 200).into()),
        ("adaptive", throw(), Span::until(0.2).tolerance(1e-5).into()),
        ("from rest", [1e-5, 0.0], Span::until(0.2).into()),
    ];
    for (name, start, course) in cases {
        let stopped = thrown(cancels, start, course.clone()).expect_err("the energy has no digits");
        println!("{name}: {stopped}");
        let RunError::Step { cause, trajectory } = &stopped else { panic!("{stopped}") };
        let StepError::FirstLawBroken { time, change, size, .. } = *cause else {
            panic!("{name}: {cause}")
        };
        assert!(change.abs() > 1e-6 * size && size > 0.0, "{cause}");
        assert!(stopped.to_string().contains("the first law is broken in the step of size"));
        // The trajectory up to there is in the error. Its certificate is that of the steps that were taken,
        // from rest only those that change no digit of the energy.
        let certificate = trajectory.certificate();
        println!("{certificate}");
        assert!(certificate.steps > 0 && trajectory.iter().count() == certificate.steps + 1);
        assert_eq!(trajectory.last().time.to_bits(), time.to_bits());
        assert_eq!(certificate.keeps_energy(), name == "from rest", "{certificate}");
        // The remedy: the same energy in terms that do not cancel.
        let run = thrown(has_digits, start, course).expect("it is solved");
        assert!(run.certificate().keeps_energy(), "{}", run.certificate());
    }
}

#[test]
fn an_energy_with_few_digits_is_broken_in_the_certificate() {
    // From a height of a metre the terms of the energy are 10⁹ times their last digit.
    let run = thrown(cancels, [1.0, 0.0], Span::steps(1e-3, 200).into()).expect("it is solved");
    let certificate = run.certificate();
    println!("{certificate}");
    assert!(!certificate.keeps_energy(), "{certificate}");
    assert!(certificate.to_string().contains("first law:   BROKEN: |H − H₀| = "), "{certificate}");
}

#[test]
fn a_step_to_the_edge_of_a_logarithm_does_not_excuse_its_energy() {
    // q' = 1 for H = p + ln(1 − q), which ends at q = 1: one rounding from there |∂_qH q| is 10¹⁶.
    let energy = |q: Real, p: Real| p + (-q + 1.0).ln();
    for h in [0.1, 0.125, 0.15, 0.2, 0.25, 0.3] {
        let stopped = thrown(energy, [0.0, 1.0], Span::steps(h, 40).into())
            .map(|run| run.certificate().clone());
        let RunError::Step { cause, trajectory } = stopped.expect_err("the domain ends") else {
            panic!("the model is verified")
        };
        println!("h = {h}: {cause}");
        let named =
            matches!(cause, StepError::OutOfDomain { .. } | StepError::FirstLawBroken { .. });
        assert!(named, "{cause}");
        assert!(trajectory.certificate().max_energy_error < 1e-6, "{}", trajectory.certificate());
    }
}
