//! A skew tensor that is not Poisson, that of a nonholonomic system: the Chaplygin sleigh.

use metriplectic::prelude::*;
use metriplectic_studies::Order;

/// Mass, moment of inertia about the centre of mass, and the distance of the centre of mass from the blade.
const MASS: f64 = 1.3;
const INERTIA: f64 = 0.9;
const AHEAD: f64 = 0.6;
/// The moment of inertia about the blade.
const ABOUT_BLADE: f64 = INERTIA + MASS * AHEAD * AHEAD;

type State5 = SVector<f64, 5>;

/// `(x, y, θ, p_v, p_ω)` with `{x, p_v} = cos θ`, `{y, p_v} = sin θ`, `{θ, p_ω} = 1` and
/// `{p_v, p_ω} = m a p_ω/J` (Chaplygin 1911; Bloch 2003, §1.7).
fn bracket(x: &SVector<Real, 5>) -> SMatrix<Real, 5, 5> {
    let gyration = x[4] * (MASS * AHEAD / ABOUT_BLADE);
    let mut pi = SMatrix::zeros();
    let entries =
        [(0, 3, x[2].cos()), (1, 3, x[2].sin()), (2, 4, Real::from(1.0)), (3, 4, gyration)];
    for (i, j, value) in entries {
        (pi[(i, j)], pi[(j, i)]) = (value, -value);
    }
    pi
}

fn energy(x: &SVector<Real, 5>) -> Real {
    (x[3] * x[3] / MASS + x[4] * x[4] / ABOUT_BLADE) * 0.5
}

fn sleigh() -> impl Metriplectic<Manifold = Euclidean<5>, Metric = Canonical> {
    System::on(Euclidean::<5>)
        .bracket(AlmostPoisson::field(bracket))
        .energy(energy)
        .build()
        .expect("the sleigh is a system")
}

/// The state at time `t` of the sleigh with the speed `V` at late times: `v = V tanh kτ`,
/// `ω = V √(m/J) sech kτ` and `θ = (V√(m/J)/k) gd(kτ)` with `k = m a V/J`, `τ = t − 3`, so that it comes in
/// backwards and turns round. The position is the integral of `v (cos θ, sin θ)` by Simpson's rule.
fn exact(t: f64) -> State5 {
    let (v_late, turned) = (1.2, 3.0);
    let k = MASS * AHEAD * v_late / ABOUT_BLADE;
    let omega_most = v_late * (MASS / ABOUT_BLADE).sqrt();
    let angle = |t: f64| 2.0 * omega_most / k * (0.5 * k * (t - turned)).tanh().atan();
    let speed = |t: f64| v_late * (k * (t - turned)).tanh();
    let along = |t: f64| vector![angle(t).cos(), angle(t).sin()] * speed(t);
    let panels = 2000;
    let h = t / f64::from(panels);
    let place: Vector2<f64> = (0..panels)
        .map(|i| {
            let a = h * f64::from(i);
            (along(a) + along(a + 0.5 * h) * 4.0 + along(a + h)) * (h / 6.0)
        })
        .sum();
    let omega = omega_most / (k * (t - turned)).cosh();
    vector![place.x, place.y, angle(t), MASS * speed(t), ABOUT_BLADE * omega]
}

#[test]
fn the_velocity_of_the_sleigh_is_that_of_its_equations() {
    // x' = v cos θ, y' = v sin θ, θ' = ω, m v' = m a ω², J ω' = −m a v ω.
    let x: State5 = vector![0.3, -0.2, 0.7, 0.5, -1.1];
    let rate = sleigh().velocity(&metriplectic::fields::ChartPoint::centre(&x)).unwrap();
    let (v, omega) = (x[3] / MASS, x[4] / ABOUT_BLADE);
    let (sin, cos) = 0.7_f64.sin_cos();
    let turn = MASS * AHEAD * omega;
    let printed: State5 = vector![v * cos, v * sin, omega, turn * omega, -turn * v];
    assert!((rate - printed).norm() <= 4.0 * f64::EPSILON, "{rate} {printed}");
    // Its closed form satisfies them: difference quotients of sixth order.
    let slope = |t: f64| {
        let d = 0.02;
        let ends = |k: f64| exact(t + k * d) - exact(t - k * d);
        (ends(1.0) * 45.0 - ends(2.0) * 9.0 + ends(3.0)) / (60.0 * d)
    };
    for t in [1.0, 2.5, 4.0] {
        let rate: State5 =
            sleigh().velocity(&metriplectic::fields::ChartPoint::centre(&exact(t))).unwrap();
        assert!((slope(t) - rate).norm() < 1e-8, "{}", slope(t) - rate);
    }
}

#[test]
fn the_sleigh_follows_its_closed_form_to_second_order_and_keeps_its_energy() {
    let (system, time) = (sleigh(), 8.0);
    let steps = [200_u32, 400, 800, 1600];
    let sizes = steps.map(|n| time / f64::from(n));
    let [all, momenta] = [0, 3].map(|from| {
        let errors: Vec<f64> = sizes
            .iter()
            .zip(steps)
            .map(|(&h, n)| {
                let run =
                    WeylMidpoint.run(&system, exact(0.0), Span::steps(h, n as usize)).unwrap();
                let certificate = run.certificate();
                assert!(certificate.keeps_energy(), "{certificate}");
                (run.last().point - exact(time)).rows_range(from..).norm()
            })
            .collect();
        println!("{errors:?}");
        Order::fit(&sizes, &errors).unwrap()
    });
    assert!(all.agrees(2.0, 0.01) && momenta.agrees(2.0, 0.01), "{all}, {momenta}");
}

#[test]
fn a_long_run_of_the_sleigh_keeps_its_energy() {
    // The sleigh stops turning; a start with both signs of ω has the same energy at every step.
    let start: State5 = vector![0.0, 0.0, 0.0, -1e-3, 1.5];
    let run = WeylMidpoint.run(&sleigh(), start, Span::steps(0.1, 100_000).at_most(10)).unwrap();
    assert!(run.certificate().keeps_energy(), "{}", run.certificate());
}

#[test]
fn the_jacobi_identity_is_reported_and_not_asked_for() {
    let report = sleigh().report(&exact(0.0));
    assert_eq!(report.verdict, Ok(()));
    let defect = report.laws.iter().find(|law| law.law == "Jacobi identity").unwrap();
    assert!(defect.size > 0.1 && defect.holds() && defect.allowed == f64::INFINITY, "{report}");
    let line = report.to_string();
    let line = line.lines().find(|line| line.contains("Jacobi")).unwrap();
    assert!(line.contains("not asked for") && !line.contains("ok"), "{line}");

    // As a Poisson tensor it is refused, with a word on what to ask for.
    let poisson = System::on(Euclidean::<5>).bracket(Poisson::field(bracket)).energy(energy);
    let error = poisson.build().unwrap().verify(&exact(0.0), 0.1).unwrap_err();
    assert!(matches!(error, ModelError::NoJacobiIdentity { .. }), "{error}");
    assert!(error.to_string().contains("AlmostPoisson"), "{error}");

    // Skewness is asked for all the same.
    let leaky = |x: &SVector<Real, 5>| bracket(x) + SMatrix::<Real, 5, 5>::identity();
    let leaky = System::on(Euclidean::<5>).bracket(AlmostPoisson::field(leaky)).energy(energy);
    let error = leaky.build().unwrap().verify(&exact(0.0), 0.1).unwrap_err();
    assert!(matches!(error, ModelError::BracketNotSkew { .. }), "{error}");
}

/// Friction that heats a bath: a tensor that is not Poisson with both laws.
#[test]
fn a_sleigh_with_friction_and_a_bath_keeps_both_laws() {
    let space = Product(Euclidean::<5>, Euclidean::<1>);
    // The runner brakes: −γ v along the blade, and all of it heats the bath of temperature 1.
    let friction = |_: &(SVector<Real, 5>, Vector1<Real>), w: &Vector6<Real>| {
        let mut b = Vector6::<Real>::zeros();
        (b[3], b[5]) = (w[5], -w[3]);
        b * b.transpose() * (w[5].recip() * 0.2)
    };
    let system = System::on(space)
        .bracket((AlmostPoisson::field(bracket), Zero))
        .energy(|x: &(SVector<Real, 5>, Vector1<Real>)| energy(&x.0) + x.1.x)
        .entropy(|x: &(SVector<Real, 5>, Vector1<Real>)| x.1.x)
        .dissipation(FieldDissipation(friction))
        .build()
        .unwrap();
    let start = (exact(0.0), vector![0.0]);
    let run = WeylMidpoint.run(&system, start, Span::steps(0.05, 1000)).unwrap();
    let certificate = run.certificate();
    assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
    assert!(certificate.entropy_gained > 0.1, "{certificate}");
    assert!(system.report(&start).to_string().contains("not asked for"));
}
