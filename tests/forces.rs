//! Forced Euler-Poincaré systems `μ' = ad*_ξ(μ + 𝓕(ξ))` with a force of any kind: the energy is conserved
//! whatever it is, and the second law holds where the force has the sign for it.

mod models;

use metriplectic::dynamics::{laws, system::BuildError};
use metriplectic::prelude::*;
use metriplectic_studies::Order;
use models::{half_square, kinetic};
use proptest::prelude::*;

const INERTIA: Vector3<f64> = Vector3::new(1.0, 2.0, 3.0);
const START: Vector3<f64> = Vector3::new(0.9, 0.4, -0.7);

/// A vortex about the third axis, and a torque that is constant in space of velocities: of no form, and of no
/// sign.
fn vortex(xi: &Vector3<Real>) -> Vector3<Real> {
    let swirl = xi.norm_squared() * 0.8;
    Vector3::new(-xi.y * swirl + 0.3, xi.x * swirl, xi.z.sin())
}

/// The same behind the second door.
#[derive(Clone, Copy)]
struct Vortex;

impl Force<3> for Vortex {
    fn at<D: Scalar>(&self, xi: &Vector3<D>) -> Vector3<D> {
        let swirl = xi.dot(xi) * 0.8;
        Vector3::new(-xi.y * swirl + 0.3, xi.x * swirl, xi.z.sin())
    }
}

fn vortex_by_hand(xi: &Vector3<f64>) -> Vector3<f64> {
    let swirl = 0.8 * xi.norm_squared();
    vector![0.3 - xi.y * swirl, xi.x * swirl, xi.z.sin()]
}

/// A feedback torque that saturates, `k/√(1 + |k|²)` with `k = ξ × Iξ`: `C' = |k|²/√(1 + |k|²) ≥ 0`.
fn saturated(xi: &Vector3<Real>) -> Vector3<Real> {
    let k = xi.cross(&xi.component_mul(&INERTIA.cast()));
    k * (k.norm_squared() + 1.0).sqrt().recip()
}

/// `μ' = ad*_ξ(μ + 𝓕(ξ))` on so(3) by the classical Runge-Kutta method.
fn reference(
    velocity: impl Fn(&Vector3<f64>) -> Vector3<f64>,
    mut mu: Vector3<f64>,
    time: f64,
) -> Vector3<f64> {
    let rate = |mu: Vector3<f64>| {
        let xi = velocity(&mu);
        (mu + vortex_by_hand(&xi)).cross(&xi)
    };
    let steps = 2000;
    let h = time / f64::from(steps);
    for _ in 0..steps {
        let a = rate(mu);
        let b = rate(mu + a * (h / 2.0));
        let c = rate(mu + b * (h / 2.0));
        let d = rate(mu + c * h);
        mu += (a + (b + c) * 2.0 + d) * (h / 6.0);
    }
    mu
}

/// The order fitted to the errors at the end of runs over `time`.
fn fitted<Y>(system: &Y, time: f64, steps: [u32; 4], exact: Vector3<f64>) -> Order
where
    Y: Metriplectic<Manifold = LieDual<3>, Metric = Canonical>,
{
    let sizes = steps.map(|n| time / f64::from(n));
    let errors: Vec<f64> = sizes
        .iter()
        .zip(steps)
        .map(|(&h, n)| {
            let run = WeylMidpoint.run(system, START, Span::steps(h, n as usize));
            let run = run.expect("the steps are solved");
            assert!(run.certificate().keeps_energy(), "{}", run.certificate());
            (run.last().point - exact).norm()
        })
        .collect();
    println!("{errors:?}");
    Order::fit(&sizes, &errors).expect("the errors follow a power law")
}

#[test]
fn a_force_of_no_form_is_integrated_to_second_order() {
    let exact = reference(|mu| mu.component_div(&INERTIA), START, 5.0);
    let free = System::on(LieDual::so3()).energy(kinetic(INERTIA)).build().unwrap();
    let unforced = WeylMidpoint.run(&free, START, Span::steps(0.01, 500)).unwrap().last().point;
    assert!((unforced - exact).norm() > 0.1, "the force plays no part");
    for body in [true, false] {
        let builder = System::on(LieDual::so3()).energy(kinetic(INERTIA));
        let order = if body {
            fitted(&builder.force(vortex).build().unwrap(), 5.0, [100, 200, 400, 800], exact)
        } else {
            fitted(&builder.force(Vortex).build().unwrap(), 5.0, [100, 200, 400, 800], exact)
        };
        assert!(order.agrees(2.0, 0.02), "{order}");
    }
}

/// `l = ½ξ·Iξ + ¼|ξ|⁴`, whose energy is not quadratic.
fn quartic(xi: &Vector3<Real>) -> Real {
    let square = xi.norm_squared();
    xi.component_mul(xi).component_mul(&INERTIA.cast()).sum() * 0.5 + square * square * 0.25
}

#[test]
fn the_force_on_a_lagrangian_that_is_not_quadratic_is_integrated_to_second_order() {
    let system = System::on(LieDual::so3()).lagrangian(quartic).force(vortex).build().unwrap();
    let legendre = Legendre::<_, 3>::of(quartic);
    let exact = reference(|mu| legendre.velocity(mu).unwrap(), START, 4.0);
    let order = fitted(&system, 4.0, [40, 80, 160, 320], exact);
    assert!(order.agrees(2.0, 0.02), "{order}");
}

#[test]
fn a_casimir_changes_by_its_formula_in_each_step() {
    // `ΔC = h ⟨𝓕(ξ), [ξ, z]⟩` at the midpoint `z`, for `C = |μ|²/2` and a quadratic energy.
    let system = System::on(LieDual::so3())
        .energy(kinetic(INERTIA))
        .force(vortex)
        .entropy(half_square)
        .second_law(SecondLaw::Published)
        .build()
        .unwrap();
    let h = 0.05;
    let run = WeylMidpoint.run(&system, START, Span::steps(h, 400)).unwrap();
    let (mut most, mut least) = (0.0_f64, 0.0_f64);
    for pair in run.states().windows(2) {
        let z = (pair[0].point + pair[1].point) * 0.5;
        let xi = z.component_div(&INERTIA);
        let expected = h * vortex_by_hand(&xi).dot(&xi.cross(&z));
        let found = pair[1].entropy - pair[0].entropy;
        // The rounding of C, and that of the equation of the step.
        assert!((found - expected).abs() <= 8.0 * f64::EPSILON, "{found:e} {expected:e}");
        (most, least) = (most.max(found), least.min(found));
    }
    assert!(most > 1e-3 && least < -1e-3, "{least} {most}");
    let certificate = run.certificate();
    assert!(certificate.keeps_energy() && !certificate.keeps_entropy(), "{certificate}");
    assert!(certificate.to_string().contains("second law: not promised"), "{certificate}");
}

#[test]
fn a_force_of_the_right_sign_has_the_second_law_exactly() {
    for (h, rests) in [(0.01, false), (0.1, true), (1.0, false)] {
        let system = System::on(LieDual::so3())
            .energy(kinetic(INERTIA))
            .entropy(half_square)
            .force(saturated)
            .build()
            .unwrap();
        let run = WeylMidpoint.run(&system, START, Span::steps(h, 2000)).unwrap();
        let certificate = run.certificate();
        assert_eq!(certificate.second_law, SecondLaw::Exact);
        assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
        // At rest on the axis of largest inertia, with C = H I₃; and not by the friction of the metric.
        let most = certificate.initial_energy * INERTIA.z;
        if rests {
            assert!((run.last().entropy - most).abs() < 1e-8, "{certificate}");
        }
        for pair in run.states().windows(2).take(20) {
            let z = (pair[0].point + pair[1].point) * 0.5;
            let xi = z.component_div(&INERTIA);
            let k = xi.cross(&z).norm_squared();
            let expected = h * k / (1.0 + k).sqrt();
            let found = pair[1].entropy - pair[0].entropy;
            assert!((found - expected).abs() <= 16.0 * f64::EPSILON, "{found:e} {expected:e}");
        }
    }
}

#[test]
fn the_second_law_of_a_force_holds_for_an_energy_that_is_not_quadratic() {
    // C' = |ξ × μ(ξ)|² with the momentum of the velocity.
    let force = |xi: &Vector3<Real>| {
        let mu = xi.component_mul(&INERTIA.cast()) + xi * xi.norm_squared();
        xi.cross(&mu) * Real::from(0.3)
    };
    let system = System::on(LieDual::so3())
        .lagrangian(quartic)
        .force(force)
        .entropy(|mu: &Vector3<Real>| (mu.norm_squared() * 0.5).exp())
        .build()
        .unwrap();
    // From beside the unstable axis to rest.
    for start in [START, vector![1e-4, 1.0, 1e-4]] {
        let run = WeylMidpoint.run(&system, start, Span::steps(0.1, 1500)).unwrap();
        let certificate = run.certificate();
        println!("{certificate}");
        assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
        assert!(certificate.entropy_gained > 0.1, "{certificate}");
    }
}

#[test]
fn a_force_under_which_the_entropy_falls_is_refused_unless_the_second_law_is_not_promised() {
    let body = || System::on(LieDual::so3()).energy(kinetic(INERTIA)).entropy(half_square);
    let start = vector![0.9, 0.4, 0.7];
    let verdict = body().force(vortex).build().unwrap().verify(&start, 0.1);
    assert!(
        matches!(&verdict, Err(ModelError::ForceDestroysEntropy { size, .. }) if *size > 1e-3),
        "{verdict:?}"
    );
    let message = verdict.unwrap_err().to_string();
    assert!(message.contains("SecondLaw::Published"), "{message}");
    let against = |xi: &Vector3<Real>| -saturated(xi);
    let refused = body().force(against).build().unwrap().verify(&START, 0.1);
    assert!(matches!(refused, Err(ModelError::ForceDestroysEntropy { .. })), "{refused:?}");
    let published = body().force(vortex).second_law(SecondLaw::Published).build().unwrap();
    published.verify(&START, 0.1).unwrap();

    // Samples near the start are no proof: the run checks the states on its way.
    let run =
        WeylMidpoint.run(&body().force(vortex).build().unwrap(), START, Span::steps(0.05, 400));
    let Err(RunError::Step { cause: StepError::Model { law, time }, .. }) = run else {
        panic!("not refused")
    };
    assert!(matches!(*law, ModelError::ForceDestroysEntropy { .. }) && time > 1.0, "{law}");

    let report = body().force(saturated).build().unwrap().report(&START).to_string();
    assert!(report.contains("⟨dS, force⟩ ≥ 0") && report.contains("⟨dH, force⟩ = 0"), "{report}");
    assert!(!report.contains("K dH"), "{report}");
}

#[test]
fn a_force_that_produces_no_entropy_at_points_and_destroys_it_on_steps_is_refused() {
    // 𝓕 ⟂ ξ × μ(ξ), so C' = 0. On a step ξ is a discrete gradient, not the velocity of the momentum z.
    let force = |xi: &Vector3<Real>| {
        let mu = xi.component_mul(&INERTIA.cast()) + xi * xi.norm_squared();
        let turned = xi.cross(&mu);
        Vector3::new(turned.y, -turned.x, 0.0.into())
    };
    let body = System::on(LieDual::so3()).lagrangian(quartic).force(force).entropy(half_square);
    let verdict = body.clone().build().unwrap().verify(&START, 0.1);
    assert!(matches!(verdict, Err(ModelError::ForceDestroysEntropy { .. })), "{verdict:?}");
    let published = body.second_law(SecondLaw::Published).build().unwrap();
    let run = WeylMidpoint.run(&published, START, Span::steps(0.1, 500)).unwrap();
    let certificate = run.certificate();
    println!("{certificate}");
    assert!(certificate.entropy_falls > 10, "{certificate}");
    assert!(certificate.min_entropy_increment < -1e-9, "{certificate}");
}

/// Friction and a force in one system, in both orders of the builder.
#[test]
fn a_force_replaces_the_friction_of_the_metric_and_joins_a_given_one() {
    let body = || System::on(LieDual::so3()).energy(kinetic(INERTIA));
    let form = CasimirDissipation::new(LieDual::so3().algebra(), Matrix3::identity()).unwrap();
    let span = Span::steps(0.1, 20);
    let at_the_end = |trajectory: Trajectory<LieDual<3>>| trajectory.last().point;

    let before = body().force(saturated).entropy(half_square).build().unwrap();
    let after = body().entropy(half_square).force(saturated).build().unwrap();
    let before = at_the_end(WeylMidpoint.run(&before, START, span).unwrap());
    let after = at_the_end(WeylMidpoint.run(&after, START, span).unwrap());
    assert_eq!(before, after);

    let both =
        body().force(saturated).dissipation(form.clone()).entropy(half_square).build().unwrap();
    let first = body().dissipation(form).force(saturated).entropy(half_square).build().unwrap();
    let both = WeylMidpoint.run(&both, START, span).unwrap();
    assert!(both.certificate().keeps_energy() && both.certificate().keeps_entropy());
    let first = at_the_end(WeylMidpoint.run(&first, START, span).unwrap());
    assert_eq!(at_the_end(both), first);
    assert!((first - before).norm() > 1e-2);
}

#[test]
fn a_second_law_needs_an_entropy_beside_a_force() {
    let body = || System::on(LieDual::so3()).energy(kinetic(INERTIA)).force(vortex);
    for second_law in [SecondLaw::Exact, SecondLaw::Published] {
        let error = body().second_law(second_law).build().unwrap_err();
        assert_eq!(error, BuildError::SecondLawWithoutEntropy);
    }
    let error = body().entropy(half_square).second_law(SecondLaw::NoEntropy).build().unwrap_err();
    assert_eq!(error, BuildError::SecondLawWithoutEntropy);
}

/// Kirchhoff's body in a fluid on se(3)*, `(M, P)`, with a lift that turns it towards its momentum.
fn swimmer(x: &Vector6<Real>) -> Real {
    let weights = [1.0, 0.6, 0.4, 0.5, 0.8, 1.1];
    (0..6).map(|i| x[i] * x[i] * (0.5 * weights[i])).sum()
}

/// `k/√(1 + |k|²)` with `k = Ω × P`, where `P` is the momentum of the translation `V`.
fn lift(xi: &Vector6<Real>) -> Vector6<Real> {
    let (omega, velocity) = (xi.fixed_rows::<3>(0), xi.fixed_rows::<3>(3));
    let p = velocity.component_div(&vector![0.5, 0.8, 1.1].cast());
    let k = omega.cross(&p);
    let k = k * (k.norm_squared() + 1.0).sqrt().recip();
    vector![k.x, k.y, k.z, 0.0.into(), 0.0.into(), 0.0.into()]
}

const SWIMMING: [f64; 6] = [0.7, -0.4, 0.9, 0.3, 1.0, -0.6];

#[test]
fn a_body_in_a_fluid_keeps_both_laws_and_its_other_casimir_on_se3() {
    // A Casimir that is not quadratic has a discrete gradient that feels the torque: it is projected out.
    let casimir = |x: &Vector6<Real>| (3..6).map(|i| x[i] * x[i]).sum::<Real>().powi(2);
    let system = System::on(LieDual::se3())
        .energy(swimmer)
        .force(lift)
        .entropy(|x: &Vector6<Real>| (0..3).map(|i| x[i] * x[i + 3]).sum::<Real>())
        .casimir(casimir)
        .build()
        .unwrap();
    let start = Vector6::from(SWIMMING);
    let mut errors = Vec::new();
    let finest = WeylMidpoint.run(&system, start, Span::steps(0.001, 2000)).unwrap().last().point;
    for steps in [20, 40, 80, 160] {
        let h = 2.0 / f64::from(steps);
        let run = WeylMidpoint.run(&system, start, Span::steps(h, steps as usize)).unwrap();
        errors.push((run.last().point - finest).norm());
        let certificate = run.certificate();
        assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
        assert!(certificate.keeps_invariants(), "{certificate}");
        assert!(
            certificate.entropy_gained > 0.1 && certificate.effort.splits == 0,
            "{certificate}"
        );
    }
    let order = Order::fit(&[0.1, 0.05, 0.025, 0.0125], &errors).unwrap();
    assert!(order.agrees(2.0, 0.05), "{order} {errors:?}");

    // The angular momentum alone is not conserved, and |M|² is listed in vain.
    let listed = System::on(LieDual::se3())
        .energy(swimmer)
        .force(|xi: &Vector6<Real>| {
            vector![0.1.into(), xi[0], 0.0.into(), xi[4], 0.0.into(), xi[1]]
        })
        .casimir(casimir)
        .build()
        .unwrap();
    let verdict = listed.verify(&start, 0.1);
    assert!(matches!(verdict, Err(ModelError::ForceChangesInvariant { .. })), "{verdict:?}");
}

#[test]
fn an_arbitrary_force_keeps_the_energy_on_se3() {
    let force = |xi: &Vector6<Real>| {
        Vector6::from_fn(|i, _| xi[(i + 2) % 6] * xi[i].sin() * 0.7 + xi[5 - i] * 0.4)
    };
    let system = System::on(LieDual::se3()).energy(swimmer).force(force).build().unwrap();
    let run = WeylMidpoint.run(&system, Vector6::from(SWIMMING), Span::steps(0.05, 4000)).unwrap();
    let certificate = run.certificate();
    assert!(certificate.keeps_energy(), "{certificate}");
    assert!(certificate.worst_iterations <= 6 && certificate.effort.splits == 0, "{certificate}");
    // Both Casimirs change: the force is no gradient in disguise.
    let square = |x: &Vector6<f64>| x.fixed_rows::<3>(3).norm_squared();
    assert!((square(&run.last().point) - square(&run.states()[0].point)).abs() > 0.05);
}

#[test]
fn a_momentum_that_a_force_conserves_is_kept() {
    // 𝓕 = (a Ω₁, a Ω₂, b) turns the momentum about the third axis only.
    let force = |xi: &Vector3<Real>| {
        let a = xi.norm_squared() * 0.5;
        Vector3::new(xi.x * a, xi.y * a, xi.z.cos() * 0.8)
    };
    let momentum = |p: &Vector3<Real>| p.z.powi(3) + p.z;
    let system = System::on(LieDual::so3())
        .energy(kinetic(vector![1.0, 1.0, 3.0]))
        .force(force)
        .momentum(momentum)
        .build()
        .unwrap();
    let run = WeylMidpoint.run(&system, START, Span::steps(0.1, 1000)).unwrap();
    let certificate = run.certificate();
    assert!(certificate.keeps_energy() && certificate.keeps_invariants(), "{certificate}");
}

/// A forced body beside a bath: the pair of brackets passes the force on.
#[test]
fn a_force_acts_on_a_factor_of_a_product() {
    let space = Product(LieDual::so3(), Euclidean::<1>);
    let system = System::on(space)
        .bracket((ForcedLiePoisson(vortex), Zero))
        .energy(|x: &(Vector3<Real>, Vector1<Real>)| kinetic(INERTIA)(&x.0) + x.1.x)
        .build()
        .unwrap();
    let run = WeylMidpoint.run(&system, (START, vector![0.5]), Span::steps(0.01, 500)).unwrap();
    assert!(run.certificate().keeps_energy());
    let body = System::on(LieDual::so3()).energy(kinetic(INERTIA)).force(vortex).build().unwrap();
    let alone = WeylMidpoint.run(&body, START, Span::steps(0.01, 500)).unwrap();
    let off = (run.last().point.0 - alone.last().point).norm();
    assert!(off <= 1e-12, "{off:.1e}");
}

#[test]
fn a_force_whose_derivative_is_no_number_is_refused() {
    let force = |xi: &Vector3<Real>| Vector3::new(xi.norm(), 0.0.into(), 0.0.into());
    let system = System::on(LieDual::so3()).energy(kinetic(INERTIA)).force(force).build().unwrap();
    let error = system.verify(&Vector3::zeros(), 0.1).unwrap_err();
    assert!(matches!(error, ModelError::DerivativeNotFinite { field: "force", .. }), "{error}");
    let force = |xi: &Vector3<Real>| Vector3::new((xi.x - 2.0).ln(), 0.0.into(), 0.0.into());
    let system = System::on(LieDual::so3()).energy(kinetic(INERTIA)).force(force).build().unwrap();
    let error = system.verify(&START, 0.1).unwrap_err();
    assert!(matches!(error, ModelError::ValueNotFinite { field: "force", .. }), "{error}");
}

proptest! {
    #[test]
    fn a_forced_bracket_keeps_the_laws(
        mu in prop::array::uniform3(-2.0..2.0), a in prop::array::uniform3(-2.0..2.0),
        b in prop::array::uniform3(-2.0..2.0),
    ) {
        let (mu, a, b) = (Vector3::from(mu), Vector3::from(a), Vector3::from(b));
        let body = System::on(LieDual::so3()).energy(kinetic(INERTIA));
        laws::bracket(&body.clone().force(vortex).build().unwrap(), &mu, &a, &b)?;
        laws::bracket(&body.force(Vortex).build().unwrap(), &mu, &a, &b)?;
    }
}
