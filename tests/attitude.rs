//! Attitudes along runs on so(3)*: their order against another method, and the momentum in space. A long one is in
//! `conservation.rs`.

mod models;

use metriplectic::manifolds::{PointError, rotations};
use metriplectic::prelude::*;
use metriplectic_studies::{Order, scientific};
use models::{TUMBLING, UNSTABLE, free_body, half_square, kinetic, relaxing_body};

const INERTIA: Vector3<f64> = Vector3::new(1.0, 2.0, 3.0);

/// Neither quadratic nor symmetric: its discrete gradient is not `dH` at the midpoint.
fn quartic(p: &Vector3<Real>) -> Real {
    kinetic(INERTIA)(p) + p.norm_squared().powi(2) * 0.1 + p.x.powi(3) * p.y * 0.2
}

fn quartic_by_hand(p: &Vector3<f64>) -> Vector3<f64> {
    let cubic = vector![0.6 * p.x.powi(2) * p.y, 0.2 * p.x.powi(3), 0.0];
    p.component_div(&INERTIA) + p * (0.4 * p.norm_squared()) + cubic
}

/// `(p, R)` at the time `t`, by the classical Runge-Kutta method with velocities by hand:
/// `p' = p × Ω + friction Ω × (p × Ω)`, `R' = R Ω̂` in the space of all matrices.
fn reference(
    velocity: impl Fn(&Vector3<f64>) -> Vector3<f64>,
    friction: f64,
    start: Vector3<f64>,
    t: f64,
) -> (Vector3<f64>, Matrix3<f64>) {
    let rate = |p: &Vector3<f64>, r: &Matrix3<f64>| {
        let omega = velocity(p);
        let turn = p.cross(&omega);
        (turn + omega.cross(&turn) * friction, r * omega.cross_matrix())
    };
    let count = 4000;
    let h = t / f64::from(count);
    let (mut p, mut r) = (start, Matrix3::identity());
    for _ in 0..count {
        let a = rate(&p, &r);
        let b = rate(&(p + a.0 * (h / 2.0)), &(r + a.1 * (h / 2.0)));
        let c = rate(&(p + b.0 * (h / 2.0)), &(r + b.1 * (h / 2.0)));
        let d = rate(&(p + c.0 * h), &(r + c.1 * h));
        p += (a.0 + (b.0 + c.0) * 2.0 + d.0) * (h / 6.0);
        r += (a.1 + (b.1 + c.1) * 2.0 + d.1) * (h / 6.0);
    }
    (p, r)
}

/// The order of the attitude at `t = 4`.
fn fitted<Y>(system: &Y, start: Vector3<f64>, exact: &Matrix3<f64>) -> Order
where
    Y: Metriplectic<Manifold = LieDual<3>>,
    WeylMidpoint: Retraction<LieDual<3>, Y::Metric>,
{
    let counts = [50, 100, 200, 400, 800];
    let sizes = counts.map(|count| 4.0 / f64::from(count));
    let errors = counts.map(|count| {
        let span = Span::steps(4.0 / f64::from(count), count as usize);
        let run = WeylMidpoint.run(system, start, span).expect("a sound model");
        let attitudes = Attitude::along(system, &run, Matrix3::identity()).expect("every step");
        (attitudes[count as usize] - exact).norm()
    });
    let order = Order::fit(&sizes, &errors).expect("the errors follow a power law");
    println!("order {order} from {}", errors.map(scientific).join(", "));
    order
}

#[test]
fn the_attitude_of_a_free_body_is_of_second_order() {
    let (_, exact) = reference(|p| p.component_div(&INERTIA), 0.0, TUMBLING, 4.0);
    let order = fitted(&free_body(), TUMBLING, &exact);
    assert!(order.agrees(2.0, 0.05), "{order}");
}

#[test]
fn the_attitude_of_a_relaxing_body_is_of_second_order() {
    let inertia = vector![10.0, 5.0, 1.0];
    for start in [vector![1.0, 0.3, 0.8], UNSTABLE] {
        let (_, exact) = reference(|p| p.component_div(&inertia), 1.0, start, 4.0);
        let order = fitted(&relaxing_body(), start, &exact);
        assert!(order.agrees(2.0, 0.05), "{order}");
    }
}

#[test]
fn the_attitude_is_of_second_order_for_an_energy_that_is_not_quadratic() {
    let body = System::on(LieDual::so3()).energy(quartic).entropy(half_square).build().unwrap();
    let (_, exact) = reference(quartic_by_hand, 1.0, TUMBLING, 4.0);
    let order = fitted(&body, TUMBLING, &exact);
    assert!(order.agrees(2.0, 0.05), "{order}");
}

/// What round-off makes of the momentum in space, a random walk: each step solves for `p` within some
/// `ε`, in a direction of its own.
fn walk(count: u32) -> f64 {
    8.0 * f64::EPSILON * f64::from(count).sqrt()
}

/// The largest `|R p − R₀ p₀|` of a run.
fn momentum_error<Y: Metriplectic<Manifold = LieDual<3>>>(system: &Y, h: f64, count: u32) -> f64
where
    WeylMidpoint: Retraction<LieDual<3>, Y::Metric>,
{
    let span = Span::steps(h, count as usize);
    let run = WeylMidpoint.run(system, TUMBLING, span).expect("a sound model");
    let r0 = rotations::exp(&vector![0.4, -1.0, 0.3]);
    let attitudes = Attitude::along(system, &run, r0).expect("every step");
    let off = run.iter().zip(attitudes).map(|(s, r)| (r * s.point - r0 * TUMBLING).norm());
    off.fold(0.0, f64::max)
}

#[test]
fn the_momentum_in_space_of_a_free_body_is_kept_to_round_off_at_every_step_size() {
    let quartic = System::on(LieDual::so3()).energy(quartic).build().unwrap();
    for (h, count) in [(0.01, 1000), (0.1, 1000), (0.5, 1000)] {
        let errors = [momentum_error(&free_body(), h, count), momentum_error(&quartic, h, count)];
        println!("h = {h}: {}", errors.map(scientific).join(", "));
        let allowed = walk(count);
        assert!(errors.iter().all(|e| *e <= allowed), "{errors:?}");
    }
}

#[test]
fn a_body_that_spins_about_a_principal_axis_turns_by_the_exact_angle() {
    let run = WeylMidpoint.run(&free_body(), vector![0.0, 0.0, 6.0], Span::steps(0.5, 100));
    let attitudes = Attitude::along(&free_body(), &run.unwrap(), Matrix3::identity()).unwrap();
    // The rounded angle of each step, and each product.
    let off = (attitudes[100] - rotations::exp(&vector![0.0, 0.0, 100.0])).norm();
    assert!(off <= 100.0 * 4.0 * f64::EPSILON, "{off:.1e}");
}

#[test]
fn a_body_at_rest_stays_where_it_is() {
    let run = WeylMidpoint.run(&free_body(), Vector3::zeros(), Span::steps(0.1, 3)).unwrap();
    let r0 = rotations::exp(&vector![0.4, -1.0, 0.3]);
    for r in Attitude::along(&free_body(), &run, r0).unwrap() {
        assert!((r - r0).amax() <= 4.0 * f64::EPSILON);
    }
}

#[test]
fn what_has_no_attitude_is_an_error_with_its_number() {
    let body = free_body();
    let sparse = WeylMidpoint.run(&body, TUMBLING, Span::steps(0.1, 10).every(5)).unwrap();
    let error = Attitude::along(&body, &sparse, Matrix3::identity()).unwrap_err();
    assert_eq!(error, AttitudeError::Skipped { from: 0, to: 5 });
    assert!(error.to_string().contains("every"), "{error}");

    let run = WeylMidpoint.run(&body, TUMBLING, Span::steps(0.1, 10)).unwrap();
    let refused = |r0| match Attitude::along(&body, &run, r0) {
        Err(AttitudeError::NotARotation(cause)) => cause,
        other => panic!("{other:?}"),
    };
    let defect = |r0| match refused(r0) {
        PointError::OffManifold { defect, .. } => defect,
        other => panic!("{other}"),
    };
    assert!((defect(Matrix3::identity() * 1.5) - 1.25).abs() < 1e-15);
    assert!((defect(-Matrix3::identity()) - 2.0).abs() < 1e-15);
    let nan = refused(Matrix3::identity() * f64::NAN);
    assert!(matches!(nan, PointError::NotFinite { index: 0, .. }), "{nan}");

    let scaled = System::on(LieDual::su2(2.0)).energy(half_square).build().unwrap();
    let run = WeylMidpoint.run(&scaled, TUMBLING, Span::steps(0.1, 1)).unwrap();
    let error = Attitude::along(&scaled, &run, Matrix3::identity()).unwrap_err();
    assert_eq!(error, AttitudeError::NotSo3);
}
