//! Steps in parts, and the parts of a family.

use metriplectic::integrators::{LinearisedAlong, TangentError};
use metriplectic::prelude::*;
use nalgebra::vector;

use crate::{compared, differences, off};

/// Finds a step that is taken in parts, and compares its tangent with differences.
fn in_parts<D, M>(
    name: &str,
    system: &D,
    method: M,
    x0: &metriplectic::dynamics::Point<D>,
    sizes: &[f64],
) where
    D: Differentiable,
    M: Copy + Stepper<D> + LinearisedAlong<D>,
{
    let split = |h: &&f64| {
        let run = method.run(system, x0.clone(), Span::steps(**h, 2));
        run.is_ok_and(|run| run.certificate().effort.splits > 0)
    };
    let h = sizes.iter().find(split).expect("a step is taken in parts");
    let [error, law] = compared(system, method, x0, &Span::steps(*h, 2), 1e-4);
    println!("{name}, h = {h} in parts: T {error:.1e}, law {law:.1e}");
    assert!(error < 1e-7 && law < 1e-9, "{name}: {error:e} {law:e}");
}

#[test]
fn parts_of_a_step_are_chained() {
    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| {
            p.x * p.x * 0.5 + p.y.powi(4) * 0.3 + p.z * p.z * 1.5 + (p.x * p.z).sin() * 0.2
        })
        .entropy(|p: &Vector3<Real>| (p.norm_squared() * 0.5).exp())
        .build()
        .unwrap();
    let x0 = vector![0.4, -1.0, 0.3];
    let sizes = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 12.0];
    in_parts("order 5", &body, DormandPrince5, &x0, &sizes);
    in_parts("Weyl", &body, Scheme::new(WeylMidpoint), &x0, &sizes);
    // The parts of a step that damps grow from a first one, and are not followed: an error says so.
    for h in [12.0, 16.0, 32.0] {
        let run = Radau::<2>.run(&body, x0, Span::steps(h, 2)).unwrap();
        assert!(run.certificate().effort.splits > 0, "h = {h} in one part");
        match Radau::<2>.tangent(&body, x0, Span::steps(h, 2)) {
            Err(TangentError::NotLinearised { cause, .. }) => println!("Radau, h = {h}: {cause}"),
            other => panic!("h = {h}: {:?}", other.map(|run| run.last().along_start())),
        }
    }
}

/// The motion of the end of a step in parts as its size grows, with which an event moves along it.
#[test]
fn the_end_of_a_step_in_parts_moves_with_its_size() {
    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| {
            p.x * p.x * 0.5 + p.y.powi(4) * 0.3 + p.z * p.z * 1.5 + (p.x * p.z).sin() * 0.2
        })
        .entropy(|p: &Vector3<Real>| (p.norm_squared() * 0.5).exp())
        .build()
        .unwrap();
    let x0 = vector![0.4, -1.0, 0.3];
    let step = |h: f64| DormandPrince5.run(&body, x0, Span::steps(h, 1)).unwrap();
    let is_in_parts = |h: f64| step(h).certificate().effort.splits > 0;
    let h = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0]
        .into_iter()
        .find(|h| is_in_parts(*h) && is_in_parts(0.9 * h))
        .expect("a step is taken in parts");
    let level = step(0.9 * h).last().point.y;
    let span = Span::steps(h, 1).event("y", move |p: &Vector3<f64>| p.y - level);
    let run = DormandPrince5.tangent(&body, x0, span).unwrap();
    let event = run.events().last().unwrap();
    let time = event.event.state.time;
    assert!(is_in_parts(time), "h = {h}, event at {time}");
    let found: Vector3<f64> = event.velocity.fixed_rows::<3>(0).into_owned();
    let (e, at) = (1e-3 * time, |h: f64| step(h).last().point);
    let slope = |e: f64| (at(time + e) - at(time - e)) / (2.0 * e);
    let velocity = (4.0 * slope(0.5 * e) - slope(e)) / 3.0;
    let error = (found - velocity).amax() / velocity.amax();
    println!("h = {h}, event at {time:.2} in parts: velocity {error:.1e}");
    assert!(error < 1e-7, "{found:?} {velocity:?}");
}

/// The derivatives along parameters, against differences.
fn along_parameters<Y, M, const P: usize>(
    name: &str,
    family: &Y,
    method: M,
    (x0, theta): (&metriplectic::dynamics::Point<Y::System>, SVector<f64, P>),
    span: Span,
) where
    Y: metriplectic::dynamics::Parametrised<P>,
    M: Copy + Stepper<Y::System> + LinearisedAlong<Y::System>,
    <Y::System as Metriplectic>::Manifold: Manifold,
{
    let run = method.tangent(&family.at_parameters(theta), x0.clone(), span);
    let run = run.expect("it has a tangent");
    let found =
        differences::<Euclidean<P>, <Y::System as Metriplectic>::Manifold>(&theta, 1e-3, |t| {
            let run = method.run(&family.at_parameters(*t), x0.clone(), span).expect("it runs");
            run.last().point.clone()
        });
    let error = off(&run.last().along_parameters(), &found);
    println!("{name}: θ {error:.1e}; {}", run.sensitivity());
    assert!(error < 1e-9, "{name}: {error:e}");
    assert!(run.sensitivity().energy < 1e-11 && run.sensitivity().invariants < 1e-11);
}

/// A dissipation by a closure with a parameter: a pendulum that warms its bearing.
#[test]
fn dissipations_have_parameters() {
    let family = Family::on(Euclidean::<3>)
        .parameters(["length", "friction", "capacity"])
        .bracket(Poisson::constant(Vector3::z().cross_matrix() * -1.0).unwrap())
        .energy(|x: &Vector3<Real>, t: &Vector3<Real>| x.y * x.y * 0.5 - (x.x * t.x).cos() + x.z)
        .entropy(|x: &Vector3<Real>, t: &Vector3<Real>| x.z.ln() * t.z)
        .field_dissipation(|x: &Vector3<Real>, w: &Vector3<Real>, t: &Vector3<Real>| {
            let b = Vector3::new(0.0.into(), w.z, -w.y);
            b * b.transpose() * (w.z.recip() * t.y * (x.x * x.x + 1.0))
        })
        .build()
        .unwrap();
    let at = (&vector![1.0, 0.3, 1.5], vector![1.2, 0.1, 2.0]);
    let span = Span::steps(0.2, 20);
    along_parameters("bearing, order 8", &family, DormandPrince8, at, span);
    along_parameters("bearing, Weyl", &family, Scheme::new(WeylMidpoint), at, span);
}

/// Further invariants and a dissipation without parameters: a heavy top, and the law of its Casimir.
#[test]
fn invariants_of_a_family_are_laws_of_its_tangent() {
    let family = Family::on(Product(LieDual::so3(), Euclidean::<3>))
        .parameters(["I1", "a", "b"])
        .bracket((LiePoisson, Poisson::constant(Vector3::z().cross_matrix()).unwrap()))
        .energy(|(p, q): &(Vector3<Real>, Vector3<Real>), t: &Vector3<Real>| {
            p.x * p.x / t.x * 0.5
                + p.y * p.y * 0.4
                + p.z * p.z * 0.7
                + q.x * q.x * t.y
                + q.y * q.y * 0.3
                + p.x * q.x * t.z
        })
        .casimir(|(p, _): &(Vector3<Real>, Vector3<Real>), t: &Vector3<Real>| {
            p.norm_squared() * t.x
        })
        .build()
        .unwrap();
    let at = (&(vector![0.4, -1.0, 0.3], vector![0.2, 0.5, 0.7]), vector![3.0, 0.4, 0.3]);
    along_parameters("Casimir, order 5", &family, DormandPrince5, at, Span::steps(0.1, 30));
    along_parameters("Casimir, Weyl", &family, Scheme::new(WeylMidpoint), at, Span::steps(0.1, 30));
}
