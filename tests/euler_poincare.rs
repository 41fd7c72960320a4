//! Forced Euler-Poincaré systems from reduced Lagrangians: the relaxed rigid body computed in two
//! ways, and Lagrangians that are not quadratic on so(3), se(3), so(4) and an algebra of one's own.

mod models;

use metriplectic::manifolds::Riemannian;
use metriplectic::prelude::*;
use metriplectic_studies::Order;
use models::{State6, UNSTABLE, alignment, gamma_squared, half_square, kinetic, relaxing_body};

const INERTIA: Vector3<f64> = Vector3::new(10.0, 5.0, 1.0);

/// The relaxed rigid body of §3, from its Lagrangian and its force.
fn forced_body() -> impl Metriplectic<Manifold = LieDual<3>, Metric = Canonical> {
    let so3 = LieDual::so3();
    let friction = CasimirDissipation::new(so3.algebra(), Matrix3::identity()).expect("a form");
    System::on(so3)
        .lagrangian(|xi: &Vector3<Real>| {
            xi.component_mul(xi).component_mul(&INERTIA.cast()).sum() * 0.5
        })
        .dissipation(friction)
        .entropy(half_square)
        .build()
        .expect("the relaxed rigid body is a system")
}

#[test]
fn a_step_of_the_relaxed_rigid_body_is_the_same_from_its_lagrangian_and_from_the_metric() {
    for start in [UNSTABLE, vector![1.0, 0.3, 0.8], vector![-0.2, 0.9, -0.4]] {
        for h in [0.01, 0.1, 0.5] {
            let forced = WeylMidpoint.run(&forced_body(), start, Span::steps(h, 1)).unwrap();
            let metric = WeylMidpoint.run(&relaxing_body(), start, Span::steps(h, 1)).unwrap();
            let off = (forced.last().point - metric.last().point).amax();
            assert!(off <= 8.0 * f64::EPSILON * start.norm(), "h = {h}: {off:.1e}");
        }
    }
}

#[test]
fn the_relaxed_rigid_body_of_a_lagrangian_relaxes_and_keeps_both_laws() {
    let run = WeylMidpoint.run(&forced_body(), UNSTABLE, Span::steps(0.1, 1000)).unwrap();
    let certificate = run.certificate();
    assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
    assert!((run.last().entropy - 1.0000055).abs() < 1e-5);
}

/// `I₁ξ₁²/2 + … + (|ξ|²)²/4`.
fn quartic<const N: usize>(inertia: SVector<f64, N>) -> impl Fn(&SVector<Real, N>) -> Real + Copy {
    move |xi| {
        let square = xi.norm_squared();
        xi.component_mul(xi).component_mul(&inertia.cast()).sum() * 0.5 + square * square * 0.25
    }
}

/// A run of a nonquadratic Lagrangian with a Casimir for an entropy, which keeps the energy and
/// gains entropy; and the certificate.
fn relaxes<const N: usize>(
    space: LieDual<N>,
    form: SMatrix<f64, N, N>,
    casimir: impl Fn(&SVector<Real, N>) -> Real,
    start: SVector<f64, N>,
) -> Certificate
where
    Canonical: Riemannian<LieDual<N>>,
{
    let friction = CasimirDissipation::new(space.algebra(), form).expect("a sound model");
    let inertia = SVector::from_fn(|i, _| 1.0 + 0.7 * i as f64);
    let system = System::on(space)
        .lagrangian(quartic(inertia))
        .dissipation(friction)
        .entropy(casimir)
        .build()
        .expect("a sound model");
    system.verify(&start, 0.1).expect("a sound model");
    let run = WeylMidpoint.run(&system, start, Span::steps(0.05, 150)).expect("a sound model");
    let certificate = run.certificate();
    assert!(certificate.keeps_energy(), "{certificate}");
    // Newton's method has the right Jacobian.
    assert!(certificate.worst_iterations <= 6 && certificate.effort.splits == 0, "{certificate}");
    certificate.clone()
}

#[test]
fn a_nonquadratic_lagrangian_relaxes_on_so3_and_in_another_basis_of_it() {
    let form = Matrix3::from_diagonal(&vector![0.3, 0.1, 0.2]);
    let start = vector![0.4, 1.1, -0.6];
    let certificate = relaxes(LieDual::so3(), form, half_square, start);
    assert!(certificate.keeps_entropy() && certificate.entropy_gained > 1e-3, "{certificate}");

    // e₁, e₂ and e₁ + e₂ + 2e₃, with the Casimir |B⁻ᵀμ|²/2.
    let basis = matrix![1.0, 0.0, 1.0; 0.0, 1.0, 1.0; 0.0, 0.0, 2.0];
    let mixed = [0, 1, 2].map(|i| basis.column(i).into_owned().cross_matrix());
    let mine = LieDual::of(LieAlgebra::of_matrices(&mixed).unwrap());
    let inverse = basis.try_inverse().unwrap().transpose();
    let casimir = move |mu: &Vector3<Real>| (inverse.cast::<Real>() * mu).norm_squared() * 0.5;
    let certificate = relaxes(mine, form, casimir, start);
    assert!(certificate.keeps_entropy() && certificate.entropy_gained > 1e-3, "{certificate}");
}

#[test]
fn a_nonquadratic_lagrangian_relaxes_on_se3_and_so4() {
    let start = vector![0.4, 1.1, -0.6, 0.5, -0.3, 0.8];
    // Friction of the rotations alone, or of the translations alone.
    let form = |first: f64, last: f64| {
        Matrix6::from_fn(|i, j| match (i == j, i < 3) {
            (true, true) => first,
            (true, false) => last,
            _ => 0.0,
        })
    };
    let gamma_squared = |x: &Vector6<Real>| (3..6).map(|i| x[i] * x[i]).sum::<Real>() * 0.5;
    let certificate = relaxes(LieDual::se3(), form(0.0, 0.2), gamma_squared, start);
    assert!(certificate.keeps_entropy() && certificate.entropy_gained > 1e-3, "{certificate}");
    // [ξ, dC] is a translation for C = |Γ|²/2: friction of the rotations does not feel it.
    let certificate = relaxes(LieDual::se3(), form(0.2, 0.0), gamma_squared, start);
    assert!(certificate.entropy_gained.abs() < 1e-13, "{certificate}");

    let j_dot_n = |x: &Vector6<Real>| (0..3).map(|i| x[i] * x[i + 3]).sum::<Real>();
    let certificate = relaxes(LieDual::so4(), form(0.1, 0.2), j_dot_n, start);
    assert!(certificate.keeps_entropy() && certificate.entropy_gained > 1e-3, "{certificate}");
}

/// The forced Euler-Poincaré equations in velocities, `Hess l(ξ) ξ' = ad*_ξ (∂l/∂ξ + κ[ξ, ∂l/∂ξ])` on
/// so(3) with `C = |μ|²/2`, by the classical Runge-Kutta method with derivatives by hand.
fn in_velocities(
    inertia: Vector3<f64>,
    form: Matrix3<f64>,
    mut xi: Vector3<f64>,
    time: f64,
) -> Vector3<f64> {
    let momentum = |xi: &Vector3<f64>| inertia.component_mul(xi) + xi * xi.norm_squared();
    let rate = |xi: Vector3<f64>| {
        let hessian = Matrix3::from_diagonal(&inertia)
            + Matrix3::identity() * xi.norm_squared()
            + xi * xi.transpose() * 2.0;
        let mu = momentum(&xi);
        let force = form * xi.cross(&mu);
        hessian.lu().solve(&(mu + force).cross(&xi)).expect("a regular Hessian")
    };
    let steps = 4000;
    let h = time / f64::from(steps);
    for _ in 0..steps {
        let a = rate(xi);
        let b = rate(xi + a * (h / 2.0));
        let c = rate(xi + b * (h / 2.0));
        let d = rate(xi + c * h);
        xi += (a + (b + c) * 2.0 + d) * (h / 6.0);
    }
    momentum(&xi)
}

#[test]
fn a_nonquadratic_lagrangian_follows_the_equations_in_velocities_to_second_order() {
    let (inertia, form) = (vector![1.0, 1.7, 2.4], Matrix3::from_diagonal(&vector![0.3, 0.1, 0.2]));
    let so3 = LieDual::so3();
    let system = System::on(so3.clone())
        .lagrangian(quartic(inertia))
        .dissipation(CasimirDissipation::new(so3.algebra(), form).unwrap())
        .entropy(half_square)
        .build()
        .unwrap();
    let xi = vector![0.7, 0.5, -0.4];
    let start = inertia.component_mul(&xi) + xi * xi.norm_squared();
    let exact = in_velocities(inertia, form, xi, 2.0);
    let error = |steps: u32| {
        let span = Span::steps(2.0 / f64::from(steps), steps as usize);
        (WeylMidpoint.run(&system, start, span).unwrap().last().point - exact).norm()
    };
    let (coarse, fine) = (error(40), error(80));
    println!("{coarse:.2e}, {fine:.2e}");
    assert!(coarse < 1e-2 && (coarse / fine - 4.0).abs() < 0.1, "{coarse:.2e}, {fine:.2e}");
}

/// A heavy top in `(M, Γ)`, with a form on rotations alone:
/// `M' = M × Ω + Γ × e₃ + κ Ω × (Γ × Ω)`, `Γ' = Γ × Ω`, `S = M·Γ`, `S' = κ |Ω × Γ|²`.
#[test]
fn a_heavy_top_rises_until_it_sleeps() {
    let spin = kinetic(vector![1.0, 1.2, 2.0]);
    let form = Matrix6::from_diagonal(&vector![0.1, 0.1, 0.1, 0.0, 0.0, 0.0]);
    let top = System::on(LieDual::se3())
        .energy(move |x: &State6| spin(&x.xyz()) + x[5])
        .entropy(alignment)
        .casimir(gamma_squared)
        .dissipation(CasimirDissipation::new(LieDual::se3().algebra(), form).unwrap())
        .build()
        .unwrap();
    let start = vector![0.0, 0.0, 4.0, -0.75_f64.sqrt(), 0.0, 0.5];
    let run = |span: Span| {
        let run = WeylMidpoint.run(&top, start, span).unwrap();
        let certificate = run.certificate();
        assert_eq!(certificate.second_law, SecondLaw::Exact);
        assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
        assert!(certificate.keeps_invariants(), "{certificate}");
        run.last().clone()
    };
    // Upright, with S = √(2I₃(H − 1)).
    let asleep = run(Span::steps(0.05, 1200));
    assert!((asleep.entropy - 14_f64.sqrt()).abs() < 1e-4, "{asleep:?}");
    assert!((asleep.point[5] - 1.0).abs() < 1e-4, "{asleep:?}");
    // The equations at t = 2, by a Runge-Kutta method in steps of 10⁻⁴.
    let exact = vector![
        0.031_072_503_009,
        0.086_520_251_061,
        3.926_321_234_872,
        0.652_240_426_612,
        -0.402_376_062_496,
        0.642_398_575_826
    ];
    let sizes = [100, 200, 400, 800].map(|n| 2.0 / f64::from(n));
    let errors =
        [100, 200, 400, 800].map(|n| (run(Span::steps(2.0 / n as f64, n)).point - exact).norm());
    let order = Order::fit(&sizes, &errors).expect("the errors follow a power law");
    assert!(order.agrees(2.0, 0.05), "{order}");
}

#[test]
fn a_degenerate_lagrangian_is_refused() {
    let system = System::on(LieDual::so3())
        .lagrangian(|xi: &Vector3<Real>| xi.x * xi.x + xi.y * xi.y)
        .entropy(half_square)
        .build()
        .unwrap();
    let error = system.verify(&vector![0.3, 0.2, 0.1], 0.1).unwrap_err();
    assert!(matches!(error, ModelError::ValueNotFinite { field: "energy", .. }), "{error}");
}
