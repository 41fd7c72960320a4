//! Orders of convergence: fitted, on nonlinear problems, against closed forms or another method.

mod models;

use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee, Order, scientific};
use models::{TUMBLING, UNSTABLE, free_body, half_square, kinetic, relaxing_body, top};

/// The order fitted to the errors of runs over `time` with the given numbers of steps.
fn fitted(time: f64, steps: [u32; 5], error: impl Fn(Span) -> f64) -> Order {
    let sizes = steps.map(|n| time / f64::from(n));
    let errors: Vec<f64> =
        sizes.iter().zip(steps).map(|(&h, n)| error(Span::steps(h, n as usize))).collect();
    let order = Order::fit(&sizes, &errors).expect("the errors follow a power law");
    println!(
        "order {order} from {}",
        errors.iter().map(|&e| scientific(e)).collect::<Vec<_>>().join(", ")
    );
    order
}

fn order_claim(problem: &str, method: &str) -> Claim {
    Claim::new(Guarantee::Order, problem, method)
}

/// The relaxing body with two equal moments of inertia in closed form: with `2H = p⊥²/I + p₃²/I₃`,
/// `k = 4Hκ(I₃ − I)/(I I₃)` and `C = (2HI₃ − p₃(0)²)/p₃(0)²`,
/// `p₃ = √(2HI₃/(1 + Ce^{−kt}))`, and the phase is an elementary integral.
fn symmetric_body(start: Vector3<f64>, t: f64) -> Vector3<f64> {
    let (across, along, kappa) = (1.0, 2.0, 0.5);
    let twice_h = start.xy().norm_squared() / across + start.z.powi(2) / along;
    let k = 2.0 * twice_h * kappa * (along - across) / (along * across);
    let c = (twice_h * along - start.z.powi(2)) / start.z.powi(2);
    let y = |t: f64| (1.0 + c * (-k * t).exp()).sqrt();
    let primitive = |t: f64| ((y(t) + 1.0) / (y(t) - 1.0)).ln() / k;
    let p3 = (twice_h * along).sqrt() / y(t);
    let radius = (across * (twice_h - p3.powi(2) / along)).sqrt();
    let turn = (1.0 / across - 1.0 / along) * (twice_h * along).sqrt();
    let phase = start.y.atan2(start.x) + turn * (primitive(t) - primitive(0.0));
    vector![radius * phase.cos(), radius * phase.sin(), p3]
}

#[test]
fn the_closed_form_of_the_symmetric_body_has_its_published_digits() {
    let start = vector![0.8, 0.0, 0.3];
    let published = [
        (5.0, [0.306_632_521_122_178, 0.631_568_390_269_131_1, 0.619_835_244_888_697_2]),
        (20.0, [-0.072344140851074, 0.070246458506156, 1.161_750_197_204_083]),
    ];
    for (t, digits) in published {
        // The digits end at 10⁻¹⁵; the phase, of size 10, is rounded by a few ε.
        let off = (symmetric_body(start, t) - Vector3::from(digits)).norm();
        assert!(off < 1e-14, "t = {t}: {off:.1e}");
    }
}

#[test]
fn the_symmetric_relaxing_body_is_integrated_to_second_order() {
    // The metric c·1 scales K by c⁻²: κ = ½ for c = √2.
    let metric = Metric::constant(Matrix3::from_diagonal_element(2.0_f64.sqrt())).unwrap();
    let body = System::on(LieDual::so3())
        .metric(metric)
        .energy(kinetic(vector![1.0, 1.0, 2.0]))
        .entropy(half_square)
        .build()
        .unwrap();
    let start = vector![0.8, 0.0, 0.3];
    let order = fitted(5.0, [25, 50, 100, 200, 400], |span| {
        let run = WeylMidpoint.run(&body, start, span).unwrap();
        (run.last().point - symmetric_body(start, 5.0)).norm()
    });
    order_claim("relaxing body with two equal moments, so(3)*", "WeylMidpoint")
        .against("its closed form")
        .record(&order, "2 ± 0.05");
    assert!(order.agrees(2.0, 0.05), "{order}");
}

#[test]
fn the_free_body_is_integrated_to_second_order() {
    // Jacobi's elliptic solution at t = 10.
    let exact = vector![0.979_621_777_929_109_3, -0.501_362_831_518_296_1, 0.720_400_224_444_001_3];
    let order = fitted(10.0, [100, 200, 400, 800, 1600], |span| {
        let run = WeylMidpoint.run(&free_body(), TUMBLING, span).unwrap();
        (run.last().point - exact).norm()
    });
    order_claim("free rigid body, so(3)*", "WeylMidpoint")
        .against("Jacobi's elliptic functions")
        .record(&order, "2 ± 0.05");
    assert!(order.agrees(2.0, 0.05), "{order}");
}

#[test]
fn the_relaxing_body_is_integrated_to_second_order() {
    let exact = vector![-0.0066814549293953, -0.999_983_850_617_850_8, 0.00175940805437915];
    let order = fitted(10.0, [50, 100, 200, 400, 800], |span| {
        let run = WeylMidpoint.run(&relaxing_body(), UNSTABLE, span).unwrap();
        (run.last().point - exact).norm()
    });
    order_claim("relaxing rigid body, so(3)*", "WeylMidpoint")
        .against("extrapolation to 20 digits")
        .record(&order, "2 ± 0.05");
    assert!(order.agrees(2.0, 0.05), "{order}");
}

/// A classical Runge-Kutta flow of order 4 with steps so small that its error is round-off.
fn runge_kutta<const N: usize>(
    field: impl Fn(&SVector<f64, N>) -> SVector<f64, N>,
    start: SVector<f64, N>,
    time: f64,
) -> SVector<f64, N> {
    let steps = 20_000;
    let h = time / f64::from(steps);
    (0..steps).fold(start, |x, _| {
        let a = field(&x);
        let b = field(&(x + a * (0.5 * h)));
        let c = field(&(x + b * (0.5 * h)));
        let d = field(&(x + c * h));
        x + (a + (b + c) * 2.0 + d) * (h / 6.0)
    })
}

/// A nonlinear problem on so(3)*: `H = ½Σp_i²/I_i + p₁³/6 + sin(p₂)/4`, `S = |p|⁴/4`, with
/// gradients by hand: `p' = p × ∇H + |∇H|²∇S − (∇H·∇S)∇H`.
fn by_hand(p: &Vector3<f64>) -> Vector3<f64> {
    let w = vector![p.x + 0.5 * p.x * p.x, p.y / 2.0 + 0.25 * p.y.cos(), p.z / 3.0];
    let s = p * p.norm_squared();
    p.cross(&w) + s * w.norm_squared() - w * w.dot(&s)
}

fn quartic(p: &Vector3<Real>) -> Real {
    p.norm_squared().powi(2) * 0.25
}

fn bumpy(p: &Vector3<Real>) -> Real {
    kinetic(vector![1.0, 2.0, 3.0])(p) + p.x.powi(3) * (1.0 / 6.0) + p.y.sin() * 0.25
}

#[test]
fn a_nonlinear_energy_and_entropy_are_integrated_to_the_order_of_the_retraction() {
    let system = System::on(LieDual::so3()).energy(bumpy).entropy(quartic).build().unwrap();
    let start = vector![0.4, 0.3, -0.5];
    let exact = runge_kutta(by_hand, start, 4.0);
    let order = fitted(4.0, [40, 80, 160, 320, 640], |span| {
        let run = WeylMidpoint.run(&system, start, span).unwrap();
        assert!(run.certificate().keeps_energy());
        (run.last().point - exact).norm()
    });
    order_claim("nonlinear energy and entropy, so(3)*", "WeylMidpoint")
        .against("a Runge-Kutta flow with gradients by hand")
        .record(&order, "2 ± 0.05");
    assert!(order.agrees(2.0, 0.05), "{order}");
    let order = fitted(4.0, [640, 1280, 2560, 5120, 10240], |span| {
        let run = Exponential.run(&system, start, span).unwrap();
        assert!(run.certificate().keeps_energy());
        (run.last().point - exact).norm()
    });
    order_claim("nonlinear energy and entropy, so(3)*", "Exponential")
        .against("a Runge-Kutta flow with gradients by hand")
        .record(&order, "1 ± 0.05");
    assert!(order.agrees(1.0, 0.05), "{order}");
}

/// A heavy top, `x = (M, Γ)` on se(3)*, with `H = ½Σ M_i²/I_i + M₁³/10 + Γ₃ + sin(Γ₁)/2` and the
/// Casimir `S = M·Γ + |Γ|⁴/4`, with gradients and brackets by hand:
/// `M' = M × ∂H/∂M + Γ × ∂H/∂Γ`, `Γ' = Γ × ∂H/∂M`, and `|dH|² dS − (dH·dS) dH`.
fn top_by_hand(x: &Vector6<f64>) -> Vector6<f64> {
    let (m, gamma) = (x.fixed_rows::<3>(0), x.fixed_rows::<3>(3));
    let omega = vector![m.x + 0.3 * m.x * m.x, m.y / 1.5, m.z / 2.0];
    let torque = vector![0.5 * gamma.x.cos(), 0.0, 1.0];
    let along_gamma = m + gamma * gamma.norm_squared();
    let join = |a: Vector3<f64>, b: Vector3<f64>| vector![a.x, a.y, a.z, b.x, b.y, b.z];
    let (w, s) = (join(omega, torque), join(gamma.into_owned(), along_gamma));
    let turn = join(m.cross(&omega) + gamma.cross(&torque), gamma.cross(&omega));
    turn + s * w.norm_squared() - w * w.dot(&s)
}

#[test]
fn a_heavy_top_is_integrated_to_the_order_of_the_retraction() {
    let system = System::on(LieDual::se3())
        .energy(|x: &Vector6<Real>| {
            let inertia = [1.0, 1.5, 2.0];
            let kinetic: Real = (0..3).map(|i| x[i].powi(2) * (0.5 / inertia[i])).sum();
            kinetic + x[0].powi(3) * 0.1 + x[5] + x[3].sin() * 0.5
        })
        .entropy(|x: &Vector6<Real>| {
            let gamma_squared: Real = (3..6).map(|i| x[i].powi(2)).sum();
            (0..3).map(|i| x[i] * x[i + 3]).sum::<Real>() + gamma_squared.powi(2) * 0.25
        })
        .build()
        .unwrap();
    let start = vector![0.3, -0.2, 0.5, 0.48, 0.0, 0.64];
    let exact = runge_kutta(top_by_hand, start, 1.0);
    assert!((exact - start).norm() > 0.5);
    let order = fitted(1.0, [40, 80, 160, 320, 640], |span| {
        let run = WeylMidpoint.run(&system, start, span).unwrap();
        assert!(run.certificate().keeps_energy());
        (run.last().point - exact).norm()
    });
    order_claim("heavy top with friction, se(3)*", "WeylMidpoint")
        .against("a Runge-Kutta flow with gradients by hand")
        .record(&order, "2 ± 0.05");
    assert!(order.agrees(2.0, 0.05), "{order}");
    let order = fitted(1.0, [640, 1280, 2560, 5120, 10240], |span| {
        let run = Exponential.run(&system, start, span).unwrap();
        assert!(run.certificate().keeps_energy());
        (run.last().point - exact).norm()
    });
    order_claim("heavy top with friction, se(3)*", "Exponential")
        .against("a Runge-Kutta flow with gradients by hand")
        .record(&order, "1 ± 0.05");
    assert!(order.agrees(1.0, 0.05), "{order}");
}

#[test]
fn the_spinning_top_is_integrated_to_the_order_of_the_retraction() {
    let system = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(top).build().unwrap();
    let start = Vector3::from_element(3.0_f64.sqrt().recip());
    let gradient = |x: &Vector3<f64>| {
        let weights = vector![1.0, 0.5, 0.25];
        x.cross(&weights.component_mul(&(x + x.component_mul(x))))
    };
    let exact = runge_kutta(gradient, start, 5.0);
    let order = fitted(5.0, [25, 50, 100, 200, 400], |span| {
        (WeylMidpoint.run(&system, start, span).unwrap().last().point - exact).norm()
    });
    order_claim("spinning top, S²", "WeylMidpoint")
        .against("a Runge-Kutta flow with gradients by hand")
        .record(&order, "2 ± 0.05");
    assert!(order.agrees(2.0, 0.05), "{order}");
    let order = fitted(5.0, [200, 400, 800, 1600, 3200], |span| {
        (Exponential.run(&system, start, span).unwrap().last().point - exact).norm()
    });
    order_claim("spinning top, S²", "Exponential")
        .against("a Runge-Kutta flow with gradients by hand")
        .record(&order, "1 ± 0.05");
    assert!(order.agrees(1.0, 0.05), "{order}");
}
