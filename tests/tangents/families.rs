//! Families with surroundings: against systems by hand, differences of their runs, and a closed form.

use metriplectic::prelude::*;
use nalgebra::{Vector1, Vector2, Vector3, Vector4, vector};

use crate::parameters::{BODY, START, THETA, compared_by_hand, open_body};

/// The torque of the body by hand.
fn torque(t: Real, p: &Vector3<Real>, theta: &Vector4<Real>) -> Vector3<Real> {
    p.cross(&vector![Real::from(0.0), t.sin() * theta[1], Real::from(0.0)])
}

/// Its energy.
fn energy(t: Real, p: &Vector3<Real>, theta: &Vector4<Real>) -> Real {
    p.x * p.x * theta[0] + p.y * p.y + p.z * p.z * 1.5 + p.x * t.sin()
}

fn entropy(p: &Vector3<Real>, _: &Vector4<Real>) -> Real {
    p.norm_squared() * 0.5
}

#[test]
fn families_with_surroundings_are_the_systems_by_hand_with_derivatives() {
    let family = || Family::on(LieDual::so3()).parameters(BODY);
    let air = |theta: &Vector4<f64>| Bath::at(theta[2]).isotropic(theta[3]);
    let body = family()
        .energy_in_time(energy)
        .entropy(entropy)
        .work("torque", torque)
        .bath("air", air)
        .build()
        .unwrap();
    let by_hand = |t: &Vector4<f64>| open_body!(t).build().unwrap();
    macro_rules! all {
        ($($method:expr),+) => {$(
            let member = (body.at(THETA), body.names());
            let span = Span::steps(0.1, 20);
            compared_by_hand(stringify!($method), member, (THETA, by_hand), $method, (|s| s.start(START), span));
        )+};
    }
    all!(WeylMidpoint, Gauss::<2>, DormandPrince8);
    let run =
        DormandPrince8.run(&body.at(THETA), by_hand(&THETA).start(START), Span::steps(0.1, 200));
    assert!(run.unwrap().certificate().keeps_entropy());

    // With noise, and the parts in another order.
    let noisy = family()
        .noise(Boltzmann(0.1))
        .work("torque", torque)
        .entropy(entropy)
        .bath("air", air)
        .energy_in_time(energy)
        .build()
        .unwrap();
    let by_hand = |t: &Vector4<f64>| open_body!(t).noise(Boltzmann(0.1)).build().unwrap();
    let (method, span) = (RandomFlow(DormandPrince5).seed(3), Span::steps(0.02, 30));
    // The start of an open system with these parts.
    let start = |_: &_| body.at(THETA).start(START);
    compared_by_hand(
        "noise",
        (noisy.at(THETA), noisy.names()),
        (THETA, by_hand),
        method,
        (start, span),
    );
}

/// Noise without surroundings, and a bath without parameters.
#[test]
fn a_family_has_the_noise_of_its_friction() {
    let family = || {
        Family::on(LieDual::so3())
            .parameters(["inertia", "friction"])
            .energy(|p: &Vector3<Real>, t: &Vector2<Real>| {
                p.x * p.x * t.x + p.y * p.y + p.z * p.z * 1.5
            })
            .entropy(|p: &Vector3<Real>, t: &Vector2<Real>| p.norm_squared() * t.y)
    };
    let by_hand = |t: &Vector2<f64>| {
        let (inertia, friction) = (t.x, t.y);
        System::on(LieDual::so3())
            .energy(move |p: &Vector3<Real>| p.x * p.x * inertia + p.y * p.y + p.z * p.z * 1.5)
            .entropy(move |p: &Vector3<Real>| p.norm_squared() * friction)
    };
    let theta = vector![0.5, 0.4];
    let noisy = family().noise(Boltzmann(0.1)).build().unwrap();
    let member = (noisy.at(theta), noisy.names());
    let built = |t: &Vector2<f64>| by_hand(t).noise(Boltzmann(0.1)).build().unwrap();
    let (method, span) = (NinomiyaVictoir(WeylMidpoint).seed(2), Span::steps(0.02, 30));
    compared_by_hand("noise of order 2", member, (theta, built), method, (|_| START, span));

    let bath = Bath::at(1.2).isotropic(0.1);
    let open = family().bath("air", bath.clone()).build().unwrap();
    let member = (open.at(theta), open.names());
    let built = |t: &Vector2<f64>| by_hand(t).bath("air", bath.clone()).build().unwrap();
    let start = |s: &OpenSystem<_, _, _>| s.start(START);
    compared_by_hand(
        "a bath",
        member,
        (theta, built),
        DormandPrince8,
        (start, Span::steps(0.1, 20)),
    );

    // A family of nothing that moves is still refused, with noise too.
    let still = Family::on(Euclidean::<2>)
        .parameters(["a"])
        .energy(|x: &Vector2<Real>, _: &Vector1<Real>| x.x)
        .noise(Boltzmann(0.1));
    assert!(still.build().is_err());
}

/// An oscillator of the stiffness `k` under the force `F sin t`:
/// `∂x/∂F = (sin t − sin(ωt)/ω)/(k − 1)`, and its work is what its energy has gained.
#[test]
fn the_work_of_a_port_has_the_derivative_of_its_closed_form() {
    let pushed = Family::on(Euclidean::<2>)
        .parameters(["push"])
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>, _: &Vector1<Real>| (x.x * x.x * 2.25 + x.y * x.y) * 0.5)
        .work("push", |t: Real, _: &Vector2<Real>, f: &Vector1<Real>| {
            vector![Real::from(0.0), t.sin() * f.x]
        })
        .build()
        .unwrap();
    let (force, t, omega, k) = (0.4, 6.0_f64, 1.5, 2.25);
    let system = pushed.at(vector![force]);
    let start = system.start(vector![1.0, 0.0]);
    let run = DormandPrince8.tangent(&system, start, Span::until(t).tolerance(1e-12)).unwrap();
    let slope =
        vector![t.sin() - (omega * t).sin() / omega, t.cos() - (omega * t).cos()] / (k - 1.0);
    let free = vector![(omega * t).cos(), -omega * (omega * t).sin()];
    let x = free + slope * force;
    let last = run.last();
    let (found, work) = (last.along("push").unwrap(), last.work_along("push").unwrap());
    assert!((last.point.x - x).norm() < 1e-10, "{}", last.point.x - x);
    assert!((found.rows(0, 2) - slope).norm() < 1e-9, "{found} {slope}");
    let gained = k * x.x * slope.x + x.y * slope.y;
    assert!((work[work.len() - 1] - gained).abs() < 1e-9, "{} {gained}", work[work.len() - 1]);
}
