//! Further invariants: Casimirs, momenta, symmetries, and what is refused.

mod models;

use metriplectic::dynamics::BuildError;
use metriplectic::prelude::*;
use metriplectic_studies::problems::flow;
use metriplectic_studies::{Claim, Guarantee, Order, scientific};
use models::{
    HEAVY, PENDULUM, State6, State10, alignment, angular_momentum, boxed, gamma_squared,
    heat_exchange, heavy, kinetic, pair, pendulum_bracket, pendulum_energy,
};

/// Orders on four step sizes, with certificates that must keep everything.
fn order<Y: Metriplectic>(
    system: &Y,
    start: &<Y::Manifold as metriplectic::fields::Space>::Point<f64>,
    time: f64,
    coarsest: u32,
) -> Order
where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    let exact = Y::Manifold::entries(&flow(system, start, time).expect("an exact flow"));
    let (steps, errors): (Vec<f64>, Vec<f64>) = [1, 2, 4, 8]
        .map(|k| k * coarsest)
        .iter()
        .map(|&n| {
            let h = time / f64::from(n);
            let run = WeylMidpoint.run(system, start.clone(), Span::steps(h, n as usize));
            let run = run.expect("it runs");
            let certificate = run.certificate();
            assert!(certificate.keeps_energy() && certificate.keeps_invariants(), "{certificate}");
            assert!(certificate.keeps_entropy(), "{certificate}");
            let end = Y::Manifold::entries(&run.last().point);
            let off = end.iter().zip(&exact).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            (h, off.sqrt())
        })
        .unzip();
    let order = Order::fit(&steps, &errors).expect("an order");
    println!("errors {errors:?}, order {order}");
    order
}

#[test]
fn a_further_casimir_of_the_heavy_top_is_kept_at_second_order() {
    // M·Γ is the entropy, |Γ|² a Casimir that friction leaves alone.
    let system = System::on(LieDual::se3())
        .energy(heavy)
        .entropy(alignment)
        .casimir(gamma_squared)
        .dissipation(MetricDissipation::scaled(|_: &State6| Real::from(0.3)))
        .build()
        .unwrap();
    let start = SVector::from(HEAVY);
    assert!(order(&system, &start, 2.0, 20).agrees(2.0, 0.05));
    let run = WeylMidpoint.run(&system, start, Span::steps(0.05, 20_000).at_most(2)).unwrap();
    println!("{}", run.certificate());
    let off = run.certificate().invariants[0].max_error;
    Claim::new(
        Guarantee::Invariants,
        "|Γ|² of the heavy top with friction, se(3)*",
        "WeylMidpoint",
    )
    .against("its value at the start, 20 000 steps")
    .record(scientific(off), "round-off of its terms");
    assert!(run.certificate().keeps_invariants() && run.certificate().keeps_entropy());
    assert!(run.certificate().entropy_gained > 0.1 && run.certificate().keeps_energy());
    // Without it friction changes |Γ|².
    let forgetful = System::on(LieDual::se3()).energy(heavy).entropy(alignment).build().unwrap();
    let run = WeylMidpoint.run(&forgetful, start, Span::steps(0.05, 20)).unwrap();
    let change = run.last().point.fixed_rows::<3>(3).norm_squared() - 0.98;
    assert!(change.abs() > 1e-3, "{change}");
}

#[test]
fn casimirs_of_a_hamiltonian_system_are_kept_on_a_curved_space_too() {
    // A metric that varies has curved paths, on which the midpoint rule keeps no quadratic function.
    let metric = |x: &State6| {
        let wave = SVector::<Real, 6>::from_fn(|i, _| (x[(i + 1) % 6] * 0.7).sin());
        SMatrix::<Real, 6, 6>::identity() + wave * wave.transpose() * Real::from(0.5)
    };
    let top = || System::on(LieDual::se3()).metric(Metric::field(metric)).energy(heavy);
    let (start, span) = (SVector::from(HEAVY), Span::steps(0.1, 20));
    let kept = top().casimir(gamma_squared).casimir(alignment).build().unwrap();
    let run = WeylMidpoint.run(&kept, start, span).unwrap();
    println!("{}", run.certificate());
    assert!(run.certificate().keeps_invariants() && run.certificate().keeps_energy());
    let run = WeylMidpoint.run(&top().build().unwrap(), start, span).unwrap();
    let change = run.last().point.fixed_rows::<3>(3).norm_squared() - 0.98;
    assert!(change.abs() > 1e-6, "{change}");
}

/// `q ↦ Q(t) q`, `p ↦ Q(t) p` for both masses.
fn turned(t: Real, x: &State10) -> State10 {
    let (sine, cosine) = (t.sin(), t.cos());
    State10::from_fn(|i, _| match i {
        8 | 9 => x[i],
        i if i % 2 == 0 => x[i] * cosine - x[i + 1] * sine,
        i => x[i] * cosine + x[i - 1] * sine,
    })
}

#[test]
fn the_angular_momentum_of_a_pendulum_is_kept_at_second_order() {
    let system = System::on(Euclidean::<10>)
        .bracket(Poisson::constant(pendulum_bracket()).unwrap())
        .energy(pendulum_energy)
        .entropy(boxed(|x: &State10| x[8] + x[9]))
        .dissipation(FieldDissipation(heat_exchange))
        .symmetry(turned, angular_momentum)
        .build()
        .unwrap();
    let start = SVector::from(PENDULUM);
    let report = system.report(&start);
    println!("{report}");
    for law in ["⟨dJ, Π dH⟩ = 0", "K dL = 0", "H∘Φ = H", "Φ is Poisson", "Π dJ = Φ'"] {
        assert!(
            report.laws.iter().any(|residual| residual.law == law && residual.holds()),
            "{law}"
        );
    }
    assert!(order(&system, &start, 2.0, 40).agrees(2.0, 0.05));
    // T = 40.
    let run = WeylMidpoint.run(&system, start, Span::steps(0.05, 800)).unwrap();
    let certificate = run.certificate();
    println!("{certificate}");
    assert!(certificate.max_relative_energy_error() <= 5e-14 / 4.4, "{certificate}");
    Claim::new(
        Guarantee::Invariants,
        "angular momentum of the thermoelastic pendulum",
        "WeylMidpoint",
    )
    .against("its value at the start, T = 40")
    .record(scientific(certificate.invariants[0].max_error), "5e-14");
    assert!(certificate.invariants[0].max_error <= 5e-14 && certificate.keeps_entropy());
    assert!((certificate.initial_energy - 4.435_059_592_089_027).abs() < 1e-14);
    // S(40) from the data of the model, off by the error of second order.
    assert!((run.last().entropy - 2.826_653_749_911_492).abs() < 2e-3, "{}", run.last().entropy);
}

/// A state of a free rigid body in space, on `T*SO(3)`, left-trivialised.
type Frame = (Matrix3<Real>, Vector3<Real>);

#[test]
fn spatial_momenta_of_a_free_body_are_kept_and_reduction_commutes() {
    let energy = kinetic(vector![1.0, 2.0, 3.0]);
    let momentum = |i: usize| move |(r, p): &Frame| (r * p)[i];
    let turn = |axis: Vector3<f64>| {
        move |t: Real, (r, p): &Frame| {
            let angle = Vector3::from_fn(|i, _| t * axis[i]);
            (metriplectic::manifolds::rotations::exp(&angle) * r, *p)
        }
    };
    let body = System::on(Product(Rotations::bi_invariant(), Euclidean::<3>))
        .bracket(Symplectic)
        .energy({
            let energy = energy.clone();
            move |(_, p): &Frame| energy(p)
        })
        .symmetry(turn(Vector3::x()), momentum(0))
        .symmetry(turn(Vector3::y()), momentum(1))
        .symmetry(turn(Vector3::z()), momentum(2))
        .build()
        .unwrap();
    let p0 = vector![1.0, 0.3, 0.8];
    let start = (metriplectic::manifolds::rotations::exp(&vector![0.3, -0.2, 0.5]), p0);
    let reduced = System::on(LieDual::so3()).energy(energy).build().unwrap();
    let errors = [50, 100, 200, 400].map(|n| {
        let span = Span::steps(5.0 / f64::from(n), n as usize);
        let run = WeylMidpoint.run(&body, start, span).unwrap();
        let certificate = run.certificate();
        assert!(certificate.keeps_energy() && certificate.keeps_invariants(), "{certificate}");
        let projected = WeylMidpoint.run(&reduced, p0, span).unwrap();
        let pairs = run.iter().zip(&projected);
        pairs.map(|(a, b)| (a.point.1 - b.point).norm()).fold(0.0, f64::max)
    });
    let order = Order::fit(&[0.1, 0.05, 0.025, 0.0125], &errors).unwrap();
    println!("reduction commutes up to {errors:?}, order {order}");
    // Both have order 2; so has their difference, unless it is round-off.
    assert!(order.agrees(2.0, 0.05) || errors[0] < 1e-12, "{order}");
}

#[test]
fn mistakes_in_the_list_are_refused_with_numbers() {
    let top = || System::on(LieDual::se3()).energy(heavy).entropy(alignment);
    let start = SVector::from(HEAVY);
    macro_rules! refused {
        ($system:expr) => {
            match WeylMidpoint.run(&$system.build().unwrap(), start, Span::steps(0.1, 1)) {
                Err(RunError::Model(error)) => {
                    println!("{error}");
                    error
                }
                other => panic!("{:?}", other.map(|run| run.certificate().clone())),
            }
        };
    }
    // Not a Casimir; it says what else it may be.
    let error = refused!(top().casimir(boxed(|x: &State6| x[0] + x[3])));
    assert!(matches!(error, ModelError::NotCasimir { size, .. } if size > 0.1));
    assert!(error.to_string().contains(".momentum(..)"));
    // Not conserved.
    let error = refused!(top().momentum(boxed(|x: &State6| x[2])));
    assert!(matches!(error, ModelError::NotMomentum { size, .. } if size > 1e-3));
    // A function of the entropy, and of the energy.
    let error = refused!(top().casimir(boxed(|x: &State6| alignment(x).powi(2))));
    assert!(
        matches!(error, ModelError::DependentInvariant { index: 0, fraction } if fraction < 1e-8)
    );
    let error = refused!(top().casimir(gamma_squared).momentum(boxed(|x: &State6| heavy(x) * 2.0)));
    assert!(
        matches!(error, ModelError::DependentInvariant { index: 1, fraction } if fraction < 1e-8)
    );
    // A dissipation of one's own that changes it.
    let friction = CasimirDissipation::new(LieDual::se3().algebra(), SMatrix::identity()).unwrap();
    let error = refused!(top().dissipation(friction).momentum(boxed(|x: &State6| heavy(x) + x[0])));
    assert!(matches!(error, ModelError::NotMomentum { .. }), "{error}");
    // A derivative that is not a number.
    let error = refused!(
        top().casimir(boxed(|x: &State6| gamma_squared(x) + (x[0] - HEAVY[0]).powi(2).sqrt()))
    );
    assert!(matches!(error, ModelError::DerivativeNotFinite { field: "invariant", .. }), "{error}");
    // Nothing is left to move.
    let crowd = System::on(Euclidean::<2>)
        .bracket(Poisson::constant(Matrix2::new(0.0, 1.0, -1.0, 0.0)).unwrap())
        .energy(boxed(|x: &Vector2<Real>| x.norm_squared()))
        .momentum(boxed(|x: &Vector2<Real>| x.x))
        .momentum(boxed(|x: &Vector2<Real>| x.y))
        .build();
    assert!(matches!(crowd, Err(BuildError::TooManyInvariants { count: 2, dimension: 2 })));
}

/// A rotation that is a millionth too fast for its angular momentum, in units of the points and of the bracket.
#[test]
fn the_rate_of_an_action_is_checked_in_every_unit() {
    let system = |rate: f64, strength: f64| {
        let turned = move |t: Real, x: &Vector4<Real>| {
            let (sin, cos) = (t * rate).sin_cos();
            let turn = |a: Real, b: Real| [a * cos - b * sin, a * sin + b * cos];
            let ([x0, x1], [x2, x3]) = (turn(x.x, x.y), turn(x.z, x.w));
            Vector4::new(x0, x1, x2, x3)
        };
        let paired = |i: usize, j: usize| f64::from(j == i + 2) - f64::from(i == j + 2);
        System::on(Euclidean::<4>)
            .bracket(Poisson::constant(Matrix4::from_fn(paired) * strength).unwrap())
            .energy(move |x: &Vector4<Real>| x.norm_squared() * (0.5 / strength))
            .symmetry(turned, move |x: &Vector4<Real>| (x.x * x.w - x.y * x.z) / strength)
            .build()
            .expect("the parts make a system")
    };
    let start = vector![0.4, -0.3, 0.2, 0.5];
    let units = [1e-9, 1.0, 1e11];
    for (size, strength) in units.iter().flat_map(|&size| units.map(|unit| (size, unit))) {
        let system = |rate| system(rate, strength);
        let run = |rate| WeylMidpoint.run(&system(rate), start * size, Span::steps(0.1, 1));
        assert!(run(1.0).is_ok(), "{size:e}, {strength:e}");
        let error = run(1.000_001).unwrap_err();
        assert!(
            matches!(error, RunError::Model(ModelError::ActionNotOfMomentum { .. })),
            "{error}"
        );
    }
}

#[test]
fn an_action_that_is_no_symmetry_is_refused() {
    let system = |action: fn(Real, &State10) -> State10, energy: fn(&State10) -> Real| {
        let system = System::on(Euclidean::<10>)
            .bracket(Poisson::constant(pendulum_bracket()).unwrap())
            .energy(energy)
            .entropy(boxed(|x: &State10| x[8] + x[9]))
            .dissipation(FieldDissipation(heat_exchange))
            .symmetry(action, angular_momentum)
            .build()
            .unwrap();
        WeylMidpoint.run(&system, SVector::from(PENDULUM), Span::steps(0.05, 1)).map(|_| ())
    };
    assert!(system(turned, pendulum_energy).is_ok());
    let error = system(|t, x| turned(-t, x), pendulum_energy).unwrap_err();
    assert!(matches!(error, RunError::Model(ModelError::ActionNotOfMomentum { .. })), "{error}");
    let error = system(|t, x| x * (t + 1.0), pendulum_energy).unwrap_err();
    assert!(matches!(error, RunError::Model(ModelError::EnergyNotSymmetric { .. })), "{error}");
    let scaled = |t: Real, x: &State10| {
        let mut x = turned(t, x);
        x[8] += t;
        x[9] += t;
        x
    };
    let error = system(scaled, pendulum_energy).unwrap_err();
    assert!(matches!(error, RunError::Model(ModelError::EnergyNotSymmetric { .. })), "{error}");
    // A map that stretches q alone is no Poisson map, though it keeps an energy without q.
    let stretched =
        |t: Real, x: &State10| State10::from_fn(|i, _| if i < 4 { x[i] * (t + 1.0) } else { x[i] });
    let kinetic: fn(&State10) -> Real =
        |x| (pair(x, 4).norm_squared() + pair(x, 6).norm_squared()) * 0.5 + x[8].exp() + x[9].exp();
    let error = system(stretched, kinetic).unwrap_err();
    assert!(matches!(error, RunError::Model(ModelError::ActionNotPoisson { .. })), "{error}");
}

/// A metriplectic system on S⁴ with two Casimirs: the entropy, and one that is listed too.
fn on_the_four_sphere() -> impl Metriplectic<Manifold = Sphere<4>, Metric = Canonical> {
    let tilt = |x: &Vector5<Real>| x[4] + x[0] * x[1] * 0.3;
    System::on(Sphere::<4>)
        .bracket(Nambu::default().and(tilt))
        .energy(boxed(|x: &Vector5<Real>| {
            x[0].powi(2) + x[1].powi(2) * 2.0 + x[2] * x[3] + x[4].powi(3)
        }))
        .entropy(boxed(|x: &Vector5<Real>| x[0] + x[2].powi(2) - x[3] * x[1]))
        .casimir(tilt)
        .build()
        .expect("it is a system")
}

const ON_S4: [f64; 5] = [0.6, -0.4, 0.5, 0.4, 0.264_575_131_106_459];

#[test]
fn the_velocity_of_a_bracket_with_two_casimirs_is_the_cross_product_of_the_space_around() {
    use metriplectic::dynamics::velocity::{differentials, reversible};
    use metriplectic::fields::{ChartPoint, Space};
    let system = on_the_four_sphere();
    let x = SVector::from(ON_S4);
    let z = ChartPoint::<Sphere<4>>::centre(&x);
    let w = differentials(&system, &z);
    let v = Sphere::<4>::embed(&z, &reversible(&system, &system.metric_at(&z), &w).unwrap());
    // By hand: gradients in R⁵, and det[x, ∇S, ∇C, ∇H, e_i].
    let ds = vector![1.0, -x[3], 2.0 * x[2], -x[1], 0.0];
    let dc = vector![0.3 * x[1], 0.3 * x[0], 0.0, 0.0, 1.0];
    let dh = vector![2.0 * x[0], 4.0 * x[1], x[3], x[2], 3.0 * x[4] * x[4]];
    let around = Vector5::from_fn(|i, _| {
        let e = Vector5::from_fn(|j, _| if i == j { 1.0 } else { 0.0 });
        Matrix5::from_columns(&[x, ds, dc, dh, e]).determinant()
    });
    assert!((v - around).norm() < 1e-14 && v.norm() > 0.1, "{v} {around}");
}

#[test]
fn several_casimirs_on_a_sphere_are_kept_with_both_laws_at_second_order() {
    let system = on_the_four_sphere();
    assert!(order(&system, &SVector::from(ON_S4), 1.0, 10).agrees(2.0, 0.05));
    let run = WeylMidpoint.run(&system, SVector::from(ON_S4), Span::steps(0.05, 2000)).unwrap();
    println!("{}", run.certificate());
    let certificate = run.certificate();
    assert!(certificate.keeps_invariants() && certificate.keeps_entropy());
    assert!(certificate.keeps_energy() && certificate.entropy_gained > 0.01);
}
