//! What the other tests would not notice: bounds that are too loose by orders of magnitude, checks that are
//! left out, and figures that are counted wrongly. Each test here fails for a small change of the code that
//! all others let through.

mod models;

use metriplectic::fields::{Column, Square, Vector};
use metriplectic::integrators::{Equation, Residual, ResumeError, RunError, StepError, StepStart};
use metriplectic::manifolds::{MetricError, PointError};
use metriplectic::prelude::*;
use models::{BEFORE_THE_CUSP, cusp, half_square, spring, spring_with};

/// Function pointers, so that one compiled system serves all choices of the fields.
type Field2 = fn(&Vector2<Real>) -> Real;
type Field3 = fn(&Vector3<Real>) -> Real;

fn body(
    energy: Field3,
    entropy: Field3,
    friction: Field3,
    law: SecondLaw,
) -> impl Metriplectic<Manifold = LieDual<3>, Metric = Canonical> {
    System::on(LieDual::so3())
        .energy(energy)
        .entropy(entropy)
        .dissipation(MetricDissipation::scaled(friction))
        .second_law(law)
        .build()
        .expect("the parts make a system")
}

fn kinetic(p: &Vector3<Real>) -> Real {
    (p.x.powi(2) * 0.1 + p.y.powi(2) * 0.2 + p.z.powi(2)) * 0.5
}

/// The relaxing rigid body.
fn relaxing() -> impl Metriplectic<Manifold = LieDual<3>, Metric = Canonical> {
    body(kinetic, half_square, |_| 1.0.into(), SecondLaw::Exact)
}

fn line(energy: Field2) -> impl Metriplectic<Manifold = Euclidean<2>, Metric = Canonical> {
    System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(energy)
        .build()
        .expect("the parts make a system")
}

const START: Vector3<f64> = Vector3::new(0.6, 0.5, 0.4);

#[test]
fn no_step_is_accepted_whose_error_is_above_the_one_allowed() {
    let system = relaxing();
    let tolerance = 1e-3_f64;
    let error = |h: f64| {
        let end = |span| WeylMidpoint.run(&system, START, span).unwrap().last().point;
        let off = end(Span::steps(h, 1)) - end(Span::steps(h / 400.0, 400));
        off.norm() / tolerance.powf(1.5)
    };
    // A first step of twice the error allowed.
    let mut h = 0.05_f64;
    for _ in 0..6 {
        h *= (2.0 / error(h)).cbrt();
    }
    assert!((error(h) - 2.0).abs() < 1e-3);
    let span = Span::until(10.0).tolerance(tolerance).scale([1.0; 3]).first_step(h);
    let mut steps = WeylMidpoint.steps(&system, START, span).unwrap();
    let taken = steps.advance().unwrap().time;
    // The estimate is off by the order of h, a tenth here.
    assert!(taken < h && error(taken) < 1.1, "h = {taken}: {} of {h}", error(taken));
    assert_eq!(steps.certificate().rejected, 1);
}

#[test]
fn a_certificate_says_broken_from_a_few_hundred_roundings_on() {
    let free = System::on(LieDual::so3())
        .energy(kinetic as Field3)
        .casimir(half_square as Field3)
        .build()
        .unwrap();
    let run = WeylMidpoint.run(&free, START, Span::steps(0.1, 10)).unwrap();
    for (roundings, kept) in [(10.0, true), (300.0, false)] {
        let mut certificate = run.certificate().clone();
        let invariant = &mut certificate.invariants[0];
        invariant.max_error = roundings * f64::EPSILON * invariant.scale;
        certificate.max_energy_error = roundings * f64::EPSILON * certificate.energy_scale;
        assert_eq!((certificate.keeps_energy(), certificate.keeps_invariants()), (kept, kept));
        let broken = certificate.to_string().matches("BROKEN").count();
        assert_eq!(broken, if kept { 0 } else { 2 }, "{certificate}");
    }
}

#[test]
fn a_fall_of_the_entropy_by_a_few_hundred_roundings_is_counted() {
    // S = −p₁ is no Casimir; it falls by h (p × ω)₁ = 0.16 h in each step, with ω₂ = p₂/5, ω₃ = p₃.
    let system = body(kinetic, |p| -p.x, |_| 0.0.into(), SecondLaw::Published);
    let run = WeylMidpoint.run(&system, START, Span::steps(1e-12, 50)).unwrap();
    let falls = run.states().windows(2).map(|pair| pair[0].entropy - pair[1].entropy);
    for fall in falls {
        // The bound is 4ε (|S| + |p₁|) = 5ε.
        assert!((200.0..2000.0).contains(&(fall / f64::EPSILON)), "{fall:e}");
    }
    assert_eq!(run.certificate().entropy_falls, 50, "{}", run.certificate());
}

#[test]
fn the_entropy_that_is_kept_is_resumed() {
    // Without friction S is constant. Where it is off by more than four roundings, the next step corrects it.
    let system = body(kinetic, |p| p.norm_squared().powi(2), |_| 0.0.into(), SecondLaw::Exact);
    let mut steps = WeylMidpoint.steps(&system, START, 1.0).unwrap();
    let (start, mut resumed) = (steps.state().entropy, 0);
    for _ in 0..50 {
        let off = (steps.state().entropy - start).abs() > 4.0 * f64::EPSILON * start;
        let checkpoint = off.then(|| steps.checkpoint());
        let next = steps.advance().unwrap();
        if let Some(checkpoint) = checkpoint {
            let mut again = WeylMidpoint.resume(&system, &checkpoint).unwrap();
            assert_eq!(again.advance().unwrap(), next);
            resumed += 1;
        }
    }
    assert!(resumed > 5, "{resumed}");
}

#[test]
fn a_model_that_differs_in_the_seventh_digit_is_another_one() {
    let system = relaxing();
    let checkpoint = WeylMidpoint.steps(&system, START, 0.1).unwrap().checkpoint();
    assert!(WeylMidpoint.resume(&system, &checkpoint).is_ok());
    let others: [(Field3, Field3, Field3, &str); 3] = [
        (|p| kinetic(p) * (1.0 + 1e-7), half_square, |_| 1.0.into(), "energy"),
        (kinetic, |p| half_square(p) * (1.0 + 1e-7), |_| 1.0.into(), "entropy"),
        (kinetic, half_square, |_| (1.0 + 1e-7).into(), "velocity"),
    ];
    for (energy, entropy, friction, name) in others {
        let other = body(energy, entropy, friction, SecondLaw::Exact);
        match WeylMidpoint.resume(&other, &checkpoint).err() {
            Some(ResumeError::AnotherSystem { field, .. }) => assert_eq!(field, name),
            error => panic!("{name}: {error:?}"),
        }
    }
}

#[test]
fn a_metric_is_symmetric_and_a_start_on_its_manifold_to_ten_digits() {
    let metric = |off: f64| Metric::constant(Matrix2::new(2.0, 0.5 + off, 0.5, 3.0));
    assert!(metric(1e-15).is_ok());
    for off in [1e-12, 1e-9, 1e-6] {
        assert!(matches!(metric(off), Err(MetricError::NotSymmetric { .. })), "{off:e}");
    }
    let sphere = Sphere::<2>::round();
    let start = |off: f64| sphere.check(&vector![0.6, 0.0, 0.8 + off]);
    assert!(start(1e-11).is_ok());
    for off in [1e-9, 1e-6, 1e-4] {
        assert!(matches!(start(off), Err(PointError::OffManifold { .. })), "{off:e}");
    }
    let rotation = |off: f64| {
        let mut r = Matrix3::identity();
        r[(0, 0)] += off;
        Rotations::bi_invariant().check(&r)
    };
    assert!(rotation(1e-11).is_ok() && rotation(1e-6).is_err());
}

/// Two bodies that exchange heat by a tensor which annihilates `dH` and not the discrete gradient of a step:
/// they are the same at the start and around it, where the energy is linear, and differ by `O(h²)` beyond
/// `x = 0.7`.
fn leaking() -> impl Metriplectic<Manifold = Euclidean<2>, Metric = Canonical> {
    let beyond = |x: Real| if x.re > 0.7 { x - 0.7 } else { Real::from(0.0) };
    System::on(Euclidean::<2>)
        .energy(move |x: &Vector2<Real>| x.x + x.y + beyond(x.x).powi(3) * 300.0)
        .entropy(|x: &Vector2<Real>| x.x.ln() + x.y.ln())
        .dissipation(FieldDissipation(move |x: &Vector2<Real>, _: &Vector2<Real>| {
            let b = Vector2::new(Real::from(1.0), -beyond(x.x).powi(2) * 900.0 - 1.0);
            b * b.transpose()
        }))
        .build()
        .expect("the parts make a system")
}

const COLD: Vector2<f64> = Vector2::new(0.6, 1.4);

#[test]
fn a_step_that_breaks_the_first_law_is_taken_in_halves() {
    let system = leaking();
    let start = WeylMidpoint.run(&system, COLD, Span::steps(1e-4, 1500)).unwrap().last().point;
    let steps = |h: f64, count: usize| {
        let (mut x, mut splits, mut memory) = (start, 0, Default::default());
        for _ in 0..count {
            let from = StepStart::first(&system, &x);
            let taken = Scheme::new(WeylMidpoint).step(&from, h, &mut memory).ok()?;
            (x, splits) = (taken.x, splits + taken.effort.splits);
        }
        Some((x, splits))
    };
    // A part that is off by less than a millionth is taken, and errors are of third order.
    let halved = (0..60).filter(|k| {
        let h = 1e-3 * 1.1_f64.powi(*k);
        let Some((end, 1)) = steps(h, 1) else { return false };
        let (same, splits) = steps(0.5 * h, 2).expect("the halves are taken");
        assert!(splits == 0 && end == same, "h = {h}: {end} {same}");
        true
    });
    assert!(halved.count() > 0);
}

#[test]
fn no_run_goes_on_whose_energy_is_off_by_a_millionth() {
    let system = leaking();
    for h in [1e-2, 2e-2, 5e-2] {
        let error = WeylMidpoint.run(&system, COLD, Span::steps(h, 500)).unwrap_err();
        {
            let RunError::Step { cause, trajectory } = &error else { panic!("another: {error}") };
            assert!(matches!(cause, StepError::FirstLawBroken { .. }), "{cause}");
            let certificate = trajectory.certificate();
            assert!(certificate.max_energy_error <= 1e-6 * 8.0, "{error}");
        }
    }
}

#[test]
fn a_momentum_fades_out_on_a_circular_orbit() {
    let spring = spring();
    // At radius 1 the force is 2 = v²: dJ is parallel to dH, and the momentum needs no projection.
    let start = vector![1.0, 0.0, 0.0, 2.0_f64.sqrt()];
    let run = WeylMidpoint.run(&spring, start, Span::steps(0.01, 500)).unwrap();
    let certificate = run.certificate();
    assert!(certificate.keeps_energy(), "{certificate}");
    // Of the order of h³ times the fraction 10⁻⁶ at which it fades out, in each of 500 steps.
    assert!(certificate.invariants[0].max_error < 1e-9, "{certificate}");
}

#[test]
fn each_part_of_a_step_conserves_the_momentum_of_its_start() {
    let spring = spring_with(|r| (r * 10.0).exp() * 1e-2);
    let soon = Scheme::new(WeylMidpoint).newton(Newton { iterations: 3, ..Newton::default() });
    let run = soon.run(&spring, vector![1.0, 0.0, 0.3, 0.8], Span::steps(0.2, 40)).unwrap();
    let certificate = run.certificate();
    assert!(certificate.effort.splits > 5, "{certificate}");
    assert!(certificate.keeps_energy() && certificate.keeps_invariants(), "{certificate}");
}

#[test]
fn each_part_of_a_step_aims_at_the_energy_of_its_start() {
    // A steep wall, and a solver that gives up soon.
    let system = line(|x| x.y.powi(2) * 0.5 + (x.x * 10.0).exp());
    let scheme = Scheme::new(WeylMidpoint).newton(Newton { iterations: 3, ..Newton::default() });
    // Only the parts near the wall are short: a step of twice the size is split once more.
    for (h, splits) in [(0.05, 6), (0.1, 7), (0.2, 8)] {
        let run = scheme.run(&system, vector![1.0, 0.5], Span::steps(h, 1)).unwrap();
        let certificate = run.certificate();
        assert_eq!(certificate.effort.splits, splits, "h = {h}");
        // What is more than four roundings is corrected in the next part; 5.2 without that, and none with it.
        let error = certificate.max_relative_energy_error();
        assert!(error <= 4.0 * f64::EPSILON, "h = {h}: {} ε", error / f64::EPSILON);
    }
}

#[test]
fn a_step_is_split_as_often_as_asked_for() {
    // A solver that gives up soon needs six splittings at h = 0.05, see above.
    let system = line(|x| x.y.powi(2) * 0.5 + (x.x * 10.0).exp());
    let soon = Scheme::new(WeylMidpoint).newton(Newton { iterations: 3, ..Newton::default() });
    for splits in [0, 1, 2, 10] {
        match (Scheme { splits, ..soon }).run(&system, vector![1.0, 0.5], Span::steps(0.05, 1)) {
            Ok(run) => assert!(splits == 10 && run.certificate().effort.splits > 2),
            Err(RunError::Step { cause: StepError::NotConverged { tried, .. }, .. }) => {
                assert!(splits < 10 && tried.splits == splits, "{tried}");
            }
            Err(other) => panic!("another error: {other}"),
        }
    }
}

#[test]
fn the_friction_of_a_certificate_is_that_of_the_steps_however_long_a_jacobian_is_kept() {
    let system = body(kinetic, half_square, |p| (p.x * 4.0).exp() * 0.01, SecondLaw::Exact);
    let start = vector![-0.6, -0.5, 0.3];
    let friction = |x: &Vector3<f64>, h: f64| {
        let run = WeylMidpoint.run(&system, *x, Span::steps(h, 1)).unwrap();
        run.certificate().friction
    };
    // It grows by a factor of four in the course of the run, and a Jacobian is kept for 100 steps.
    // At h = 0.05 these are a quarter of it.
    for (h, count, least) in [(0.01, 2000, 0.98), (0.05, 400, 0.85)] {
        let run = WeylMidpoint.run(&system, start, Span::steps(h, count)).unwrap();
        let states = run.states().iter().step_by(5);
        let largest = states.map(|state| friction(&state.point, h)).fold(0.0, f64::max);
        let certified = run.certificate().friction / largest;
        assert!((least..1.02).contains(&certified), "h = {h}: {certified}");
    }
    // That of another step size is none of this one.
    let span = Span::until(20.0).tolerance(1e-5);
    let mut steps = WeylMidpoint.steps(&system, start, span).unwrap();
    let mut largest = 0.0_f64;
    while steps.ending().is_none() {
        let before = (steps.state().point, steps.state().time);
        let h = steps.advance().unwrap().time - before.1;
        largest = largest.max(friction(&before.0, h));
    }
    let certified = steps.certificate().friction / largest;
    assert!((0.995..1.005).contains(&certified), "{certified}");
}

#[test]
fn a_jacobian_is_not_kept_for_steps_of_another_length() {
    // From the unstable axis the steps grow by orders of magnitude; 2.07 linear systems a step, and 2.27 with a
    // Jacobian that is kept all the same.
    let system = body(kinetic, half_square, |p| (p.x * 4.0).exp() * 0.01, SecondLaw::Exact);
    let run =
        WeylMidpoint.run(&system, vector![0.001, -1.0, 0.001], Span::steps(0.05, 400)).unwrap();
    assert!(run.certificate().effort.iterations <= 400 * 43 / 20, "{}", run.certificate());
}

#[test]
fn the_jacobian_of_a_step_has_its_digits_on_the_shortest_arcs() {
    let system = relaxing();
    let scheme = Scheme::new(WeylMidpoint);
    let equation = Residual::new(&system, &scheme, &START, 1.0);
    let jacobian = |length: f64| {
        let u: Vector<LieDual<3>> = vector![0.48, 0.6, -0.64] * length;
        equation.linearise(&u).unwrap().jacobian
    };
    // It is smooth in u: at 10⁻⁷ it is off by the order of 10⁻⁷ from its limit. At 10⁻¹⁷ the end is the start
    // itself, and a difference of rows would be all round-off, ε|dF|/|u| = 20.
    let limit = jacobian(1e-7);
    for length in [1e-8, 1e-9, 1e-17, 1e-18, 1e-20] {
        let off = (jacobian(length) - limit).max_abs();
        assert!(off < 1e-6, "{length:e}: {off:e}");
    }
}

/// `E_y T v = E_x v` up to the order of `|y − x||v|`, with the ambient vector `E_x v` of the components `v`.
fn transports<M: Manifold>(name: &str, manifold: &M, x: &[f64], u: &[f64], v: &[f64]) {
    let point = |x: &[f64]| manifold.from_entries(x).expect("a point");
    let vector = |v: &[f64]| Vector::<M>::from_index(|i| v[i]);
    let ambient = |x: &M::Point<f64>, v: &Vector<M>| {
        let ends = [1e-6, -1e-6].map(|t| M::entries(&M::chart(x, &(*v * t))));
        ends[0].iter().zip(&ends[1]).map(|(a, b)| (a - b) / 2e-6).collect::<Vec<_>>()
    };
    let x = point(x);
    let y = M::chart(&x, &(vector(u) * 1e-3));
    let v = vector(v);
    let mut moved = [v, v * 2.0];
    M::transport_all(&x, &y, &mut moved);
    for (moved, v) in [(moved[0], v), (moved[1], v * 2.0), (M::transport(&x, &y, &v), v)] {
        let pairs = ambient(&x, &v).into_iter().zip(ambient(&y, &moved));
        let off = pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        assert!(off < 5e-3 * v.magnitude() * vector(u).magnitude(), "{name}: {off:e}");
    }
}

#[test]
fn a_vector_transport_is_the_identity_up_to_the_length_of_the_step() {
    // Across the equator, where the frame of a sphere turns.
    transports("S²", &Sphere::<2>::round(), &[0.6, 0.8, 1e-5], &[1.0, -1.0], &[0.3, 0.7]);
    transports("S²", &Sphere::<2>::round(), &[0.6, 0.8, -1e-5], &[-0.8, 0.9], &[0.3, 0.7]);
    let far = [0.5, 0.5, 0.5, -0.5];
    transports("S³", &Sphere::<3>::round(), &far, &[1.0, 0.4, -1.0], &[0.3, 0.7, -0.2]);
    let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let u = [0.3, 1.0, 0.4];
    transports("SO(3)", &Rotations::bi_invariant(), &identity, &u, &[0.3, 0.7, -0.2]);
    let spin = Product(Sphere::<2>::round(), Euclidean::<1>);
    transports("S² × R", &spin, &[0.6, 0.8, 1e-5, 3.0], &[1.0, -1.0, 0.5], &[0.3, 0.7, 0.2]);
}

#[test]
fn an_invariant_that_is_not_conserved_where_it_depends_on_the_others_is_an_error() {
    let system = cusp();
    let mut errors = 0;
    for h in [0.1, 0.2, 0.25, 0.3, 0.4] {
        for quarters in 40..68_u8 {
            // A solver that takes nearly everything for a solution steps beyond it.
            let tolerance = 10_f64.powf(0.25 * f64::from(quarters));
            let newton = Newton { tolerance, ..Newton::default() };
            let scheme = Scheme::new(WeylMidpoint).newton(newton);
            let certificate = match scheme.run(&system, BEFORE_THE_CUSP, Span::steps(h, 10)) {
                Ok(run) => run.certificate().clone(),
                Err(RunError::Step { cause, trajectory }) => {
                    let StepError::DependentInvariants { index, fraction, .. } = cause else {
                        panic!("{cause}")
                    };
                    assert!(index == 0 && fraction < 1e-3, "{cause}");
                    errors += 1;
                    trajectory.certificate().clone()
                }
                Err(error) => panic!("{error}"),
            };
            assert!(!certificate.keeps_invariants(), "h = {h}, {tolerance:e}: {certificate}");
        }
    }
    // Most solutions are so far off that the differentials are independent there.
    assert!(errors >= 3, "{errors}");
}
