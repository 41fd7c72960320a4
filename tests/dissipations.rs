//! Flows with dissipations of one's own against closed forms and data computed by other methods.

use metriplectic::prelude::*;

/// The errors of runs with `n` and `2n` steps at `time`, and that energy was kept.
fn errors<
    Y: Metriplectic<Manifold = M>,
    M: Manifold<Point<f64> = SVector<f64, N>>,
    const N: usize,
>(
    system: &Y,
    start: SVector<f64, N>,
    (time, exact): (f64, SVector<f64, N>),
    n: u32,
) -> (f64, f64)
where
    WeylMidpoint: Retraction<M, Y::Metric>,
{
    let error = |n: u32| {
        let span = Span::steps(time / f64::from(n), n as usize);
        let run = WeylMidpoint.run(system, start, span).expect("the run is finished");
        assert!(run.certificate().keeps_energy(), "{}", run.certificate());
        (run.last().point - exact).norm()
    };
    (error(n), error(2 * n))
}

/// Both errors are small, and the scheme has the order 2.
#[track_caller]
fn second_order((coarse, fine): (f64, f64), allowed: f64) {
    println!("{coarse:.2e}, {fine:.2e}");
    assert!(coarse <= allowed, "{coarse:.2e}");
    assert!((coarse / fine - 4.0).abs() < 0.15, "ratio {}", coarse / fine);
}

/// A symmetric body `I = (1, 1, 2)` that relaxes half as fast, in closed form.
#[test]
fn a_scaled_dissipation_relaxes_a_symmetric_body_on_time() {
    let energy = |p: &Vector3<Real>| (p.x * p.x + p.y * p.y + p.z * p.z * 0.5) * 0.5;
    let entropy = |p: &Vector3<Real>| p.norm_squared() * 0.5;
    let start = vector![0.8, 0.0, 0.3];
    let exact = [
        vector![0.306_632_521_122_178, 0.631_568_390_269_131_1, 0.619_835_244_888_697_2],
        vector![-0.072_344_140_851_074, 0.070_246_458_506_156, 1.161_750_197_204_083],
    ];
    let system = System::on(LieDual::so3())
        .energy(energy)
        .dissipation(MetricDissipation::scaled(|_: &Vector3<Real>| Real::from(0.5)))
        .entropy(entropy)
        .build()
        .unwrap();
    second_order(errors(&system, start, (5.0, exact[0]), 50), 1e-4);
    second_order(errors(&system, start, (20.0, exact[1]), 400), 1e-4);
    // The form of the algebra with half the identity, and half of R³ as a cometric by its root.
    let so3 = LieDual::so3();
    let half = CasimirDissipation::new(so3.algebra(), Matrix3::identity() * 0.5).unwrap();
    let system = System::on(so3).energy(energy).dissipation(half).entropy(entropy).build().unwrap();
    second_order(errors(&system, start, (5.0, exact[0]), 50), 1e-4);
    let cometric = |_: &Vector3<Real>| (Matrix3::<f64>::identity() * 0.5_f64.sqrt()).cast::<Real>();
    let system = System::on(LieDual::so3())
        .energy(energy)
        .dissipation(CometricDissipation(cometric))
        .entropy(entropy)
        .build()
        .unwrap();
    second_order(errors(&system, start, (5.0, exact[0]), 50), 1e-4);
}

/// A damped oscillator that warms a bath (Öttinger 2018), `x = (q, p, s)`, in closed form.
#[test]
fn a_closure_of_the_annihilated_covector_damps_an_oscillator_as_its_closed_form() {
    const GAMMA: f64 = 0.01;
    let friction = FieldDissipation(|_: &Vector3<Real>, w: &Vector3<Real>| {
        let b = Vector3::new(Real::from(0.0), w.z, -w.y);
        b * b.transpose() * (w.z.recip() * GAMMA)
    });
    let system = System::on(Euclidean::<3>)
        .bracket(Poisson::constant(matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0]).unwrap())
        .energy(|x: &Vector3<Real>| (x.x * x.x + x.y * x.y) * 0.5 + x.z)
        .entropy(|x: &Vector3<Real>| x.z)
        .dissipation(friction)
        .build()
        .unwrap();
    let omega = (1.0 - GAMMA * GAMMA / 4.0).sqrt();
    let time = 10.0_f64;
    let (sine, cosine) = (omega * time).sin_cos();
    let decay = 2.0 * (-GAMMA * time / 2.0).exp();
    let q = decay * (cosine + GAMMA * sine / (2.0 * omega));
    let p = -decay * sine / omega;
    let exact = vector![q, p, 2.0 - (q * q + p * p) / 2.0];
    second_order(errors(&system, vector![2.0, 0.0, 0.0], (time, exact), 200), 5e-3);
}

/// Two gas containers with a wall that moves and conducts (Shang and Öttinger 2020), in energies,
/// `x = (q, p, U₁, U₂)`.
#[test]
fn two_gas_containers_exchange_energy_as_in_the_literature() {
    const ALPHA: f64 = 0.5;
    let wall = |x: &Vector4<Real>| {
        let (mut skew, third) = (Matrix4::<Real>::zeros(), 2.0 / 3.0);
        skew[(0, 1)] = 1.0.into();
        skew[(2, 1)] = -x[2] / x[0] * third;
        skew[(3, 1)] = x[3] / (-x[0] + 2.0) * third;
        skew - skew.transpose()
    };
    // α b bᵀ with b = (1, −1) on (U₁, U₂) where w = dH; in a step, b = (w₄, −w₃).
    let conduction = FieldDissipation(|_: &Vector4<Real>, w: &Vector4<Real>| {
        let b = Vector4::new(0.0.into(), 0.0.into(), w.w, -w.z);
        b * b.transpose() * Real::from(ALPHA)
    });
    let system = System::on(Euclidean::<4>)
        .bracket(Poisson::field(wall))
        .energy(|x: &Vector4<Real>| x.y * x.y * 0.5 + x.z + x.w)
        .entropy(|x: &Vector4<Real>| x.x.ln() + (-x.x + 2.0).ln() + (x.z * x.w).ln() * 1.5)
        .dissipation(conduction)
        .build()
        .unwrap();
    let start = vector![1.0, 2.0, 2.0, 2.0];
    let exact = vector![
        0.995_943_001_913_088_5,
        -1.924_764_006_791_638_6,
        2.257_266_242_112_464_2,
        1.890_375_516_967_234_2
    ];
    second_order(errors(&system, start, (1.0, exact), 100), 1e-3);
}

/// The thermoelastic double pendulum (Romero 2009), all constants 1: `x = (q₁, q₂, p₁, p₂, s₁, s₂)`.
#[test]
fn the_springs_of_a_thermoelastic_pendulum_exchange_heat_as_in_the_literature() {
    type State = SVector<Real, 10>;
    let energy = |x: &State| {
        let first = x[0] * x[0] + x[1] * x[1];
        let second = (x[2] - x[0]).powi(2) + (x[3] - x[1]).powi(2);
        // e = ½ ln²λ + ln λ + θ − 1 with θ = exp(s − ln λ).
        let spring = |square: Real, s: Real| {
            let log = square.ln() * 0.5;
            log * log * 0.5 + log + (s - log).exp() - 1.0
        };
        (4..8).map(|i| x[i] * x[i] * 0.5).sum::<Real>() + spring(first, x[8]) + spring(second, x[9])
    };
    // [[θ₂/θ₁, −1], [−1, θ₁/θ₂]] with θᵢ = ∂H/∂sᵢ, that is w.
    let conduction = FieldDissipation(|_: &State, w: &State| {
        let mut b = State::zeros();
        (b[8], b[9]) = (w[9], -w[8]);
        b * b.transpose() * (w[8] * w[9]).recip()
    });
    let canonical = SMatrix::<f64, 10, 10>::from_fn(|i, j| match (i, j) {
        (i, j) if i < 4 && j == i + 4 => 1.0,
        (i, j) if j < 4 && i == j + 4 => -1.0,
        _ => 0.0,
    });
    let system = System::on(Euclidean::<10>)
        .bracket(Poisson::constant(canonical).unwrap())
        .energy(energy)
        .entropy(|x: &State| x[8] + x[9])
        .dissipation(conduction)
        .build()
        .unwrap();
    let start =
        SVector::<f64, 10>::from_column_slice(&[1.0, 0.0, 2.2, 0.0, 0.0, 2.0, 1.0, 0.0, 1.0, 0.2]);
    assert!((system.energy_at(&start) - 4.435_059_592_089_027).abs() < 1e-14);
    let error = |n: u32| {
        let span = Span::steps(1.0 / f64::from(n), n as usize);
        let run = WeylMidpoint.run(&system, start, span).unwrap();
        let certificate = run.certificate();
        assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
        (run.last().entropy - 1.433_795_831_063_673).abs()
    };
    second_order((error(20), error(40)), 2e-4);
}
