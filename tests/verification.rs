//! What verification finds, at every scale, and what it leaves alone.

mod models;
#[path = "models/stages.rs"]
mod stages;

use std::cell::Cell;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use metriplectic::dynamics::Report;
use metriplectic::integrators::{Flow as _, Recheck, RunError, Schedule};
use metriplectic::prelude::*;
use models::{half_square, kinetic};

/// The verdict as a sentence; empty for a model that is accepted.
fn sentence(report: &Report) -> String {
    report.verdict.as_ref().map_or_else(ToString::to_string, |()| String::new())
}

/// The residual of a law.
fn residual(report: &Report, law: &str) -> f64 {
    let found = report.laws.iter().find(|residual| residual.law == law);
    found.unwrap_or_else(|| panic!("no law {law} in {report}")).size
}

#[track_caller]
fn refused(report: &Report, parts: &[&str]) {
    let text = sentence(report);
    for part in parts {
        assert!(text.contains(part), "\"{part}\" is missing in: {report}");
    }
}

#[track_caller]
fn accepted(report: &Report) {
    assert!(report.verdict.is_ok() && report.judged == 17, "{report}");
}

/// A potential in a box, so that one compiled system serves all.
type Potential = Box<dyn Fn(Real) -> Real>;

/// An oscillator with the potential `v`, on the phase plane.
fn oscillator(v: Potential) -> impl Metriplectic<Manifold = Euclidean<2>> {
    System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(move |x: &Vector2<Real>| x.y * x.y * 0.5 + v(x.x))
        .build()
        .expect("an oscillator is a system")
}

#[test]
fn a_lost_derivative_of_the_energy_is_refused_with_its_numbers() {
    // A spring constant from the real part, and a potential of real parts alone.
    let spring = oscillator(Box::new(|q| q * q * 0.5 * (1.0 + 0.1 * q.re.powi(2))));
    let report = spring.report(&vector![1.0, 0.0]);
    refused(&report, &["energy", "direction 0", "1.1", "1.2", "Real::from"]);
    let potential = oscillator(Box::new(|q| Real::from(1.0 - q.re.cos())));
    for q in [1e-3, 0.5, 2.0, 100.0] {
        refused(&potential.report(&vector![q, 0.3]), &["energy", "direction 0"]);
    }
    // Beside a momentum that is large, and on a coordinate that is far off its zero by rounding only.
    refused(&potential.report(&vector![0.5, 1e4]), &["energy", "direction 0"]);
    refused(&potential.report(&vector![std::f64::consts::PI.sin(), 1.0]), &["energy"]);
    // A detour through f64 in a part of a sum, in fine waves, and a part in a thousand.
    for small in [1e-1, 1e-3] {
        let waves =
            oscillator(Box::new(move |q| (q * 10.0).cos() + Real::from(small * q.re.sin())));
        refused(&waves.report(&vector![0.7, 0.4]), &["energy", "direction 0"]);
    }
}

#[test]
fn a_lost_derivative_of_every_part_of_a_model_is_refused() {
    let start = vector![0.9, 0.3, 0.2];
    let body = || System::on(LieDual::so3()).energy(kinetic(vector![1.0, 2.0, 3.0]));
    let lossy = |p: &Vector3<Real>| p.norm_squared() * p.norm_squared().re * 0.5;
    refused(&body().entropy(lossy).build().unwrap().report(&start), &["the entropy", "direction"]);
    refused(&body().casimir(lossy).build().unwrap().report(&start), &["the invariant"]);
    let metric =
        |p: &Vector3<Real>| Matrix3::from_diagonal_element(Real::from(1.0 + p.x.re.powi(2)));
    let system = body().metric(Metric::field(metric)).entropy(half_square).build().unwrap();
    refused(&system.report(&start), &["the metric", "direction 0"]);
    // With the derivative lost, this tensor is a constant, which has the Jacobi identity.
    let bracket =
        |p: &Vector3<Real>| Vector3::new(-p.y.re, p.z.re * 0.0, 1.0).cross_matrix().cast::<Real>();
    let system = System::on(Euclidean::<3>)
        .bracket(Poisson::field(bracket))
        .energy(kinetic(vector![1.0, 2.0, 3.0]))
        .build()
        .unwrap();
    refused(&system.report(&start), &["the bracket", "direction 1"]);
    let scaled = MetricDissipation::scaled(|p: &Vector3<Real>| Real::from(p.z.re.exp()));
    let system = body().entropy(half_square).dissipation(scaled).build().unwrap();
    refused(&system.report(&start), &["the dissipation", "direction 2"]);

    // A damped oscillator, K = γ(q) b bᵀ / w_s.
    let friction = |lossy: fn(&Vector3<Real>, &Vector3<Real>) -> Real| {
        let k = move |x: &Vector3<Real>, w: &Vector3<Real>| {
            let b = Vector3::new(Real::from(0.0), w.z, -w.y);
            b * b.transpose() * (lossy(x, w) * 0.1)
        };
        let system = System::on(Euclidean::<3>)
            .bracket(
                Poisson::constant(matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0]).unwrap(),
            )
            .energy(|x: &Vector3<Real>| (x.x * x.x + x.y * x.y) * 0.5 + x.z.exp())
            .entropy(|x: &Vector3<Real>| x.z)
            .dissipation(FieldDissipation(k))
            .build()
            .unwrap();
        system.report(&vector![1.0, 0.5, 0.1])
    };
    accepted(&friction(|x, w| w.z.recip() * (x.x * x.x + 1.0)));
    refused(
        &friction(|x, w| w.z.recip() * (x.x.re.powi(2) + 1.0)),
        &["dissipation", "direction 0"],
    );
    refused(&friction(|_, w| w.z.re.recip().into()), &["as a function of w", "direction 2"]);
}

#[test]
fn lost_derivatives_are_found_on_curved_spaces_and_products() {
    let energy = |x: &Vector3<Real>| x.z + Real::from(x.x.re.powi(2));
    let spin = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(energy).build().unwrap();
    refused(&spin.report(&vector![0.6, 0.0, 0.8]), &["the energy", "direction"]);
    let frame = System::on(Rotations::bi_invariant())
        .energy(|r: &Matrix3<Real>| r.m11 + Real::from(r.m23.re))
        .entropy(|r: &Matrix3<Real>| r.m12)
        .build()
        .unwrap();
    refused(&frame.report(&Matrix3::identity()), &["the energy", "direction"]);
    let warm = System::on(Product(Sphere::<2>::round(), HalfLine))
        .energy(|(n, e): &(Vector3<Real>, Vector1<Real>)| n.z + e.x)
        .entropy(|(_, e): &(Vector3<Real>, Vector1<Real>)| e.x.re.ln().into())
        .build()
        .unwrap();
    refused(
        &warm.report(&(vector![0.0, 0.6, 0.8], vector![1e-6])),
        &["the entropy", "direction 2"],
    );
    // A reduced Lagrangian: h is not the Legendre transform of the values of l.
    let body = System::on(LieDual::so3())
        .lagrangian(|xi: &Vector3<Real>| {
            xi.norm_squared() * 0.5 + xi.x * xi.x * xi.x.re.powi(2) * 0.1
        })
        .build()
        .unwrap();
    refused(&body.report(&vector![0.9, 0.3, 0.2]), &["the energy", "direction"]);
}

/// Models whose difference quotients are bad, and whose derivatives are right.
#[test]
fn right_derivatives_are_not_refused_where_quotients_are_bad() {
    // Cancellation inside: the values of 1 − cos q near zero are multiples of ε.
    let pendulum = oscillator(Box::new(|q| -q.cos() + 1.0));
    for k in 0..60 {
        let q = 1.3_f64.powi(-k) * 3.0;
        for p in [0.0, q, 1.0] {
            accepted(&pendulum.report(&vector![q, p]));
        }
    }
    // A large constant, short waves, coordinates far from where they count, a wall.
    for (name, v) in [
        ("offset", (|q: Real| q * q + 1e10) as fn(Real) -> Real),
        ("small beside an offset", |q: Real| q.cos() * 1e-9 + 1.0),
        ("waves", |q: Real| (q * 300.0).sin()),
        ("far away", |q: Real| (q - 1.0).powi(2) * 1e12),
        ("wall", |q: Real| q.powi(-12)),
        ("branch", |q: Real| if q.re > 1.0 { (q - 1.0).powi(3) } else { q * 0.0 }),
        ("logarithm", |q: Real| q.ln()),
        ("root near its end", |q: Real| (q - 0.999_999).sqrt()),
        ("steep", |q: Real| (q * 50.0).exp()),
    ] {
        let report = oscillator(Box::new(v)).report(&vector![1.0, 0.3]);
        assert!(report.verdict.is_ok(), "{name}: {report}");
    }
    // Two particles a length apart, a million lengths from the origin.
    let pair = System::on(Euclidean::<4>)
        .bracket(Symplectic)
        .energy(|x: &Vector4<Real>| {
            (x.z * x.z + x.w * x.w) * 0.5 + (x.y - x.x).powi(-12) - (x.y - x.x).powi(-6)
        })
        .build()
        .unwrap();
    for far in [1e3, 1e6] {
        let report = pair.report(&vector![far, far + 1.1, 0.2, -0.1]);
        assert!(report.verdict.is_ok(), "{report}");
    }
    // A branch of class C¹ at its seam, and entries between 10⁻¹² and 10¹².
    let seam = oscillator(Box::new(|q| if q.re > 0.0 { q * q } else { q * q * 2.0 }));
    accepted(&seam.report(&vector![0.0, 1.0]));
    let gas = System::on(Euclidean::<3>)
        .energy(|x: &Vector3<Real>| x.x + x.y + x.z)
        .entropy(|x: &Vector3<Real>| x.x.ln() + x.y.ln() + x.z.ln())
        .build()
        .unwrap();
    accepted(&gas.report(&vector![1e-12, 1.0, 1e12]));
}

#[test]
fn a_small_positive_entry_beside_a_large_one_is_judged_at_every_point() {
    let gas = System::on(Euclidean::<2>)
        .energy(|x: &Vector2<Real>| x.x + x.y)
        .entropy(|x: &Vector2<Real>| x.x.ln() + x.y.ln())
        .build()
        .unwrap();
    for small in [1e-3, 1e-7, 1e-12] {
        accepted(&gas.report(&vector![small, 100.0]));
    }
}

#[test]
fn an_entropy_of_twelve_positive_variables_is_judged() {
    // S = Σ e_i ln x_i from x = e: all temperatures are one at the start, where Π dS = 0, and nowhere else.
    let start = SVector::<f64, 12>::from_fn(|i, _| 10.0_f64.powf((i % 6) as f64 - 3.0));
    let mut pi = SMatrix::<f64, 12, 12>::zeros();
    for i in 0..12 {
        (pi[(i, (i + 1) % 12)], pi[((i + 1) % 12, i)]) = (1.0, -1.0);
    }
    let system = System::on(Euclidean::<12>)
        .bracket(Poisson::constant(pi).unwrap())
        .energy(|x: &SVector<Real, 12>| x.sum())
        .entropy(move |x: &SVector<Real, 12>| (0..12).map(|i| x[i].ln() * start[i]).sum())
        .build()
        .unwrap();
    let report = system.report(&start);
    assert_eq!(report.judged, 17);
    refused(&report, &["not a Casimir"]);
}

#[test]
fn an_entry_that_is_zero_at_the_start_is_sampled_away_from_zero() {
    // Π dS = (0, 0, y) is seen only off the plane y = 0; a cosine of a right angle is 6·10⁻¹⁷.
    let model = |size: f64| {
        System::on(Euclidean::<3>)
            .bracket(Poisson::constant(Vector3::x().cross_matrix()).unwrap())
            .energy(move |x: &Vector3<Real>| x.norm_squared() * size.powi(-2))
            .entropy(move |x: &Vector3<Real>| x.x + x.y * x.y * size.recip())
            .build()
            .unwrap()
    };
    for size in [1e-9, 1.0, 1e11] {
        for nothing in [0.0, std::f64::consts::FRAC_PI_2.cos()] {
            let start = vector![1.0, nothing, 0.0] * size;
            refused(&model(size).report(&start), &["not a Casimir"]);
        }
    }
}

#[test]
fn a_model_with_values_at_few_points_is_not_judged_by_them() {
    // Defined where x₀ is what it is at the start, and nowhere near.
    let thin = |x: &Vector3<Real>| {
        if (x.x.re - 0.3).abs() < 1e-14 { x.norm_squared() } else { Real::from(f64::NAN) }
    };
    let system = System::on(Euclidean::<3>).energy(thin).entropy(|x: &Vector3<Real>| x.y).build();
    let report = system.unwrap().report(&vector![0.3, 0.2, 0.1]);
    assert!(report.judged < 12 && report.passed_over > 16, "{report}");
    assert!(report.verdict.is_err(), "{report}");
}

#[test]
fn a_constant_friction_is_accepted_if_the_energy_is_linear() {
    // Three temperatures: ν annihilates dH = (1, 1, 1), of which every discrete gradient is dH.
    let pairs = [(0, 1), (1, 2)];
    let friction = move |x: &Vector3<Real>, _: &Vector3<Real>| {
        let mut k = Matrix3::<Real>::zeros();
        for (i, j) in pairs {
            let mut nu = Vector3::<Real>::zeros();
            (nu[i], nu[j]) = (1.0.into(), (-1.0).into());
            k += nu * nu.transpose() * (x[i] * x[j]);
        }
        k
    };
    let energy = |x: &Vector3<Real>| x.x + x.y + x.z;
    let entropy = |x: &Vector3<Real>| x.x.ln() + x.y.ln() + x.z.ln();
    let linear = System::on(Euclidean::<3>)
        .energy(energy)
        .entropy(entropy)
        .dissipation(FieldDissipation(friction))
        .build()
        .unwrap();
    for start in [vector![300.0, 280.0, 1.0], vector![1e-9, 3e-9, 2e-9]] {
        accepted(&linear.report(&start));
        let run = WeylMidpoint.run(&linear, start, Span::steps(0.1, 100)).unwrap();
        assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
    }
    // The same covectors from dH(x) of an energy that is not linear are not those of a step.
    let curved = System::on(Euclidean::<3>)
        .energy(|x: &Vector3<Real>| x.x * x.x + x.y * x.y + x.z)
        .entropy(entropy)
        .dissipation(FieldDissipation(|x: &Vector3<Real>, _: &Vector3<Real>| {
            let nu = Vector3::new(x.y, -x.x, 0.0.into());
            nu * nu.transpose()
        }))
        .build()
        .unwrap();
    refused(&curved.report(&vector![1.0, 2.0, 3.0]), &["discrete gradient", "build K from w"]);
}

#[test]
fn a_tensor_that_is_not_poisson_is_refused_however_small_it_is() {
    // hat(v) is Poisson only if v · curl v = 0, and here it is 1.
    for size in [1e-30, 1e-10, 1.0, 1e10] {
        let tensor = move |x: &Vector3<Real>| {
            Vector3::new(-x.y, x.z * 0.0, Real::from(1.0)).cross_matrix() * Real::from(size)
        };
        let system = System::on(Euclidean::<3>)
            .bracket(Poisson::field(tensor))
            .energy(kinetic(vector![1.0, 2.0, 3.0]))
            .build()
            .unwrap();
        refused(&system.report(&vector![0.9, 0.3, 0.2]), &["Jacobi"]);
    }
}

/// A system on R⁴ with the energy `x₀ + x₁ + x₂ + x₃` and a friction of one's own.
fn with_friction(k: Matrix4<f64>) -> impl Metriplectic<Manifold = Euclidean<4>> {
    System::on(Euclidean::<4>)
        .energy(|x: &Vector4<Real>| x.sum())
        .entropy(|x: &Vector4<Real>| x.iter().map(|x| x.ln()).sum())
        .dissipation(FieldDissipation(move |_: &Vector4<Real>, _: &Vector4<Real>| k.cast()))
        .build()
        .expect("a system")
}

/// `u` and `v` annihilate (1, 1, 1, 1).
const U: Vector4<f64> = Vector4::new(1.0, -1.0, 0.0, 0.0);
const V: Vector4<f64> = Vector4::new(0.0, 0.0, 1.0, -1.0);
const FOUR: Vector4<f64> = Vector4::new(1.0, 2.0, 3.0, 4.0);

#[test]
fn an_indefinite_friction_is_refused() {
    // The eigenvalue −0.01 has a direction that no sampled covector has.
    let third = Vector4::new(1.0, 1.0, -1.0, -1.0);
    for weak in [1.0, 1e-6] {
        let k = U * U.transpose() + (V * V.transpose() - third * third.transpose() * 0.005) * weak;
        let report = with_friction(k).report(&FOUR);
        refused(&report, &["destroys entropy"]);
        let k = U * U.transpose() + V * V.transpose() * weak;
        accepted(&with_friction(k).report(&FOUR));
    }
    for weak in [1.0, 1e-12, 1e-30] {
        let k = V * V.transpose() * (-0.01 * weak) + U * U.transpose();
        refused(&with_friction(k).report(&FOUR), &["destroys entropy"]);
    }
}

#[test]
fn a_stiff_channel_does_not_hide_another() {
    // K dH = (0, 0, 1, 0) beside entries of 10¹².
    let stiff = U * U.transpose() * 1e12;
    let leak = Vector4::new(0.0, 0.0, 1.0, 0.0);
    let k = stiff + leak * leak.transpose();
    refused(&with_friction(k).report(&FOUR), &["does not keep the energy"]);
    let k = stiff + V * V.transpose();
    accepted(&with_friction(k).report(&FOUR));
    // An asymmetry in the weak channel.
    let mut k = stiff + V * V.transpose();
    k[(2, 3)] -= 0.1;
    refused(&with_friction(k).report(&FOUR), &["not symmetric"]);
    // Π dS ≠ 0 and K dL ≠ 0 beside it.
    let mut pi = SMatrix::<f64, 4, 4>::zeros();
    (pi[(0, 1)], pi[(1, 0)], pi[(1, 2)], pi[(2, 1)]) = (1e12, -1e12, 1.0, -1.0);
    let system = System::on(Euclidean::<4>)
        .bracket(Poisson::constant(pi).unwrap())
        .energy(|x: &Vector4<Real>| x.norm_squared() * 0.5)
        .entropy(|x: &Vector4<Real>| x.w + x.z * 1e-3)
        .build()
        .unwrap();
    refused(&system.report(&FOUR), &["not a Casimir"]);
    let k = stiff + V * V.transpose();
    let system = System::on(Euclidean::<4>)
        .energy(|x: &Vector4<Real>| x.sum())
        .entropy(|x: &Vector4<Real>| x.iter().map(|x| x.ln()).sum())
        .dissipation(FieldDissipation(move |_: &Vector4<Real>, _: &Vector4<Real>| k.cast()))
        .momentum(|x: &Vector4<Real>| x.x + x.y + x.z * 2.0)
        .build()
        .unwrap();
    refused(&system.report(&FOUR), &["changes an invariant"]);
}

#[test]
fn a_symmetry_is_judged_in_the_units_of_its_energy_and_of_its_parameter() {
    // Two masses on a line, with lengths of ℓ: a translation by t is a length too.
    for length in [1e-9, 1.0, 1e11] {
        let pair = |tilt: f64| {
            System::on(Euclidean::<4>)
                .bracket(Symplectic)
                .energy(move |x: &Vector4<Real>| {
                    let q = (x.y - x.x) * length.recip();
                    // Without a value far away, where lengths of one are.
                    let wall = (-(x.x * (0.02 / length)).powi(2) + 1.0).sqrt() * tilt;
                    ((x.z * x.z + x.w * x.w) * length.powi(-2) + q * q + wall) * 1e-12
                })
                .symmetry(
                    |t: Real, x: &Vector4<Real>| Vector4::new(x.x + t, x.y + t, x.z, x.w),
                    |x: &Vector4<Real>| x.z + x.w,
                )
                .build()
                .unwrap()
        };
        let start = vector![1.0, 2.5, 0.3, -0.2] * length;
        accepted(&pair(0.0).report(&start));
        refused(&pair(1.0).report(&start), &[]);
        let report = pair(1.0).report(&start);
        assert!(residual(&report, "H∘Φ = H") > 1e-6, "{report}");
    }
}

#[test]
fn an_asymmetric_metric_is_refused_beside_a_large_entry() {
    let with = |g: Matrix3<f64>| {
        System::on(Euclidean::<3>)
            .metric(Metric::field(move |_: &Vector3<Real>| g.cast::<Real>()))
            .energy(|x: &Vector3<Real>| x.x)
            .entropy(|x: &Vector3<Real>| x.y)
            .build()
            .unwrap()
            .report(&vector![0.1, 0.2, 0.3])
    };
    let asymmetric = Matrix3::new(1e16, 0.0, 0.0, 0.0, 1.0, 0.3, 0.0, 0.1, 1.0);
    refused(&with(asymmetric), &["(2, 1)"]);
    assert!(Metric::constant(asymmetric).is_err());
    accepted(&with(Matrix3::new(1e16, 0.0, 0.0, 0.0, 1.0, 0.3, 0.0, 0.3, 1.0)));
}

/// The report of a damped oscillator with lengths `a`, momenta `b`, energies `c` and entropies `d` as its
/// units; times are then `a b / c`.
fn scaled_report(factor: f64, [a, b, c, d]: [f64; 4]) -> Report {
    let time = a * b / c;
    let energy = move |x: &Vector3<Real>| {
        let (q, p, s) = (x.x / a, x.y / b, x.z / d);
        (p * p * 0.5 - q.cos() + s.exp()) * c
    };
    // b bᵀ/w_s, and with a factor other than 1 it does not annihilate w.
    let friction = move |_: &Vector3<Real>, w: &Vector3<Real>| {
        let (wp, ws) = (w.y, w.z);
        let v = Vector3::new(Real::from(0.0), ws, -wp * factor);
        v * v.transpose() * (ws.recip() * (0.1 * b * b / (c * time)))
    };
    let pi = matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0];
    let metric = Matrix3::from_diagonal(&vector![a.powi(-2), b.powi(-2), d.powi(-2)]);
    System::on(Euclidean::<3>)
        .metric(Metric::constant(metric).expect("positive"))
        .bracket(Poisson::constant(pi).expect("skew"))
        .energy(energy)
        .entropy(|x: &Vector3<Real>| x.z)
        .dissipation(FieldDissipation(friction))
        .build()
        .expect("a system")
        .report(&vector![0.7 * a, 0.3 * b, 0.2 * d])
}

/// A rigid body with the dissipation of its metric, the Casimir as entropy, and units of angular momentum,
/// energy and entropy.
fn scaled_body(tilt: f64, [a, c, d]: [f64; 3]) -> Report {
    let energy = move |p: &Vector3<Real>| kinetic(vector![1.0, 2.0, 3.0])(&(p / Real::from(a))) * c;
    let entropy = move |p: &Vector3<Real>| (p.norm_squared() * (0.5 / a) + p.x * tilt) * (d / a);
    System::on(LieDual::so3())
        .energy(energy)
        .entropy(entropy)
        .build()
        .expect("a system")
        .report(&(vector![0.9, 0.3, 0.2] * a))
}

/// Two temperatures that exchange heat, each with a unit of its own for its energy.
fn scaled_heat(weight: f64, [a, b]: [f64; 2]) -> Report {
    let energy = move |x: &Vector2<Real>| x.x / a + x.y / b * weight;
    let entropy = move |x: &Vector2<Real>| (x.x / a).ln() + (x.y / b).ln() * 2.0;
    let nu = vector![a, -b];
    let friction = move |x: &Vector2<Real>, _: &Vector2<Real>| {
        (nu * nu.transpose()).cast::<Real>() * (x.x / a * x.y / b)
    };
    System::on(Euclidean::<2>)
        .energy(energy)
        .entropy(entropy)
        .dissipation(FieldDissipation(friction))
        .build()
        .expect("a system")
        .report(&vector![3.0 * a, 0.7 * b])
}

/// A tensor that varies, with a unit for each entry; `sign = −1` breaks the Jacobi identity.
fn scaled_tensor(sign: f64, [a, b, c]: [f64; 3]) -> Report {
    let tensor = move |x: &Vector3<Real>| {
        let (x, y, z) = (x.x / a, x.y / b, x.z / c);
        let pi = Vector3::new(x, y * sign + z * (1.0 - sign), z).cross_matrix();
        let scale = Matrix3::from_diagonal(&vector![a, b, c]).cast::<Real>();
        scale * pi * scale
    };
    let energy = move |x: &Vector3<Real>| x.x / a + (x.y / b).powi(2) + (x.z / c).exp();
    System::on(Euclidean::<3>)
        .bracket(Poisson::field(tensor))
        .energy(energy)
        .build()
        .expect("a system")
        .report(&vector![0.9 * a, 0.3 * b, 0.2 * c])
}

#[test]
fn a_model_in_other_units_gets_the_same_verdict_with_the_same_residuals() {
    #[track_caller]
    fn same(name: &str, scaled: &Report, plain: &Report) {
        let laws = |report: &Report| -> Vec<_> {
            let residuals = report.laws.iter().map(|law| (law.law, law.size.to_bits()));
            residuals.collect()
        };
        assert_eq!(laws(scaled), laws(plain), "{name}: {scaled} and {plain}");
        assert_eq!(
            (scaled.judged, scaled.passed_over),
            (plain.judged, plain.passed_over),
            "{name}"
        );
        // The same error, about another point.
        let before = |text: String| text.split(" at [").next().map(ToOwned::to_owned);
        assert_eq!(before(sentence(scaled)), before(sentence(plain)), "{name}");
    }
    let two = |exponents: [i32; 4]| exponents.map(|k| 2.0_f64.powi(k));
    // Uniform, SI-like, mixed, and far apart.
    for exponents in [[40; 4], [-30, -80, -68, -76], [3, -37, 11, 90], [-100, 60, -25, 40]] {
        let units @ [a, b, c, d] = two(exponents);
        for factor in [1.0, 1.001] {
            let plain = scaled_report(factor, [1.0; 4]);
            assert_eq!(plain.verdict.is_ok(), factor < 1.0005, "{plain}");
            same("oscillator", &scaled_report(factor, units), &plain);
        }
        for tilt in [0.0, 0.01] {
            let plain = scaled_body(tilt, [1.0; 3]);
            assert_eq!(plain.verdict.is_ok(), tilt < 0.005, "{plain}");
            same("body", &scaled_body(tilt, [a, c, d]), &plain);
        }
        for weight in [1.0, 1.001] {
            let plain = scaled_heat(weight, [1.0; 2]);
            assert_eq!(plain.verdict.is_ok(), weight < 1.0005, "{plain}");
            same("heat", &scaled_heat(weight, [a, b]), &plain);
        }
        for sign in [1.0, -1.0] {
            let plain = scaled_tensor(sign, [1.0; 3]);
            assert_eq!(plain.verdict.is_ok(), sign > 0.0, "{plain}");
            same("tensor", &scaled_tensor(sign, [a, b, d]), &plain);
        }
    }
}

/// `f`, which counts its calls.
fn counted<P>(calls: &Cell<usize>, f: impl Fn(&P) -> Real) -> impl Fn(&P) -> Real {
    move |x| {
        calls.set(calls.get() + 1);
        f(x)
    }
}

/// Calls of the energy by verification, by that of a start alone, and by a hundred steps.
fn calls<Y: Metriplectic>(
    calls: &Cell<usize>,
    system: &Y,
    start: &<Y::Manifold as metriplectic::fields::Space>::Point<f64>,
) -> [usize; 3]
where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    let since = |f: &dyn Fn()| {
        let before = calls.get();
        f();
        calls.get() - before
    };
    let verified = system.verified(start).expect("a sound model");
    let run = |count: usize| {
        let run = WeylMidpoint.run(&verified, start.clone(), Span::steps(0.05, count));
        assert!(run.expect("it runs").certificate().keeps_energy());
    };
    let whole = since(&|| assert!(system.report(start).verdict.is_ok()));
    let alone = since(&|| assert!(verified.check_start(start).is_ok()));
    [whole, alone, since(&|| run(101)) - since(&|| run(1))]
}

#[test]
fn verification_costs_less_than_a_hundred_steps_and_a_verified_system_less_than_five() {
    let count = Cell::new(0);
    let body = System::on(LieDual::so3())
        .energy(counted(&count, kinetic(vector![1.0, 2.0, 3.0])))
        .entropy(half_square)
        .build()
        .unwrap();
    let small = calls(&count, &body, &vector![0.9, 0.3, 0.2]);
    let ring = |x: &SVector<Real, 12>| {
        let springs = (0..6).map(|i| (x[(i + 1) % 6] - x[i]).powi(4) * 0.125);
        x.norm_squared() * 0.5 + springs.sum::<Real>()
    };
    let oscillators = System::on(Euclidean::<12>)
        .bracket(Symplectic)
        .energy(counted(&count, ring))
        .build()
        .unwrap();
    let start = SVector::<f64, 12>::from_fn(|i, _| (1.0 + i as f64).sin());
    let large = calls(&count, &oscillators, &start);
    println!("calls of the energy: {small:?}, {large:?}");
    for [whole, alone, steps] in [small, large] {
        assert!(whole < steps && 20 * alone < steps, "{whole}, {alone}, {steps}");
    }
}

#[test]
fn a_verified_system_runs_as_the_system_does_and_judges_its_start() {
    let body = models::relaxing_body();
    let verified = body.verified(&models::UNSTABLE).unwrap();
    let span = Span::steps(0.1, 50);
    let start = vector![0.3, 0.5, 0.2];
    let run = WeylMidpoint.run(&body, start, span).unwrap();
    let cheap = WeylMidpoint.run(&verified, start, span).unwrap();
    assert_eq!(cheap.states(), run.states());
    // The start and the end; the certificate says that the model was verified before.
    assert_eq!((cheap.certificate().checked_states, run.certificate().checked_states), (2, 10));
    assert!(cheap.certificate().verified_before && !run.certificate().verified_before);
    let text = cheap.certificate().to_string();
    assert!(text.contains("verified before the run; its laws were checked at 2 states"), "{text}");
    let error = WeylMidpoint.run(&verified, vector![0.1, f64::NAN, 0.0], span).unwrap_err();
    assert!(error.to_string().contains("entry 1"), "{error}");
    // A law that breaks elsewhere than around the point of verification, and at the start of the run.
    let bent = System::on(Euclidean::<3>)
        .bracket(Poisson::constant(Vector3::z().cross_matrix()).unwrap())
        .energy(|x: &Vector3<Real>| x.norm_squared())
        .entropy(|x: &Vector3<Real>| if x.x.re > 2.0 { x.z + (x.x - 2.0).powi(3) } else { x.z })
        .build()
        .unwrap();
    let verified = bent.verified(&vector![1.0, 1.0, 1.0]).unwrap();
    let error = WeylMidpoint.run(&verified, vector![3.0, 1.0, 1.0], span).unwrap_err();
    assert!(matches!(error, RunError::Model(ModelError::EntropyNotCasimir { .. })), "{error}");
    // A model that is not sound has no certificate.
    assert!(bent.verified(&vector![2.1, 1.0, 1.0]).is_err());
}

type State = Vector3<Real>;
/// Function pointers, so that one compiled system serves all models.
type Field = fn(&State) -> Real;
type Friction = fn(&State, &State) -> Matrix3<Real>;

/// Friction `γ b bᵀ/w_s` with `b = (0, w_s, −w_p)`.
fn drag(gamma: Real, w: &State) -> Matrix3<Real> {
    let b = Vector3::new(Real::from(0.0), w.z, -w.y);
    b * b.transpose() * (gamma / w.z)
}

fn damped(_: &State, w: &State) -> Matrix3<Real> {
    drag(Real::from(0.05), w)
}

/// The part of `q` beyond 3/2, to the power of four.
fn beyond(q: Real) -> Real {
    if q.re > 1.5 { (q - 1.5).powi(4) } else { Real::from(0.0) }
}

/// `H = (q² + p²)/2 + e^s` with friction.
fn oscillator_with(
    energy: Field,
    entropy: Field,
    friction: Friction,
) -> impl Metriplectic<Manifold = Euclidean<3>, Metric = Canonical> {
    System::on(Euclidean::<3>)
        .bracket(
            Poisson::constant(matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0])
                .expect("it is skew"),
        )
        .energy(energy)
        .entropy(entropy)
        .dissipation(FieldDissipation(friction))
        .build()
        .expect("an oscillator is a system")
}

fn warm(x: &State) -> Real {
    (x.x * x.x + x.y * x.y) * 0.5 + x.z.exp()
}

const THROUGH: Vector3<f64> = Vector3::new(1.0, 2.0, 0.0);
const AT_REST: Vector3<f64> = Vector3::new(1.2, 0.0, 0.0);

/// The law that ends a run, with its time, and the trajectory up to there; `None` for a run that ends well.
fn broken_law<Y, M>(
    system: &Y,
    method: M,
    start: Vector3<f64>,
    span: Schedule,
) -> Option<(f64, ModelError)>
where
    Y: Metriplectic<Manifold = Euclidean<3>>,
    M: Method<Y>,
{
    match method.run(system, start, span) {
        Ok(run) => {
            let checked = run.certificate().checked_states;
            assert!(checked > 2 && run.certificate().to_string().contains("were checked at"));
            None
        }
        Err(RunError::Step { cause: StepError::Model { time, law }, trajectory }) => {
            let last = trajectory.last();
            assert!(last.time <= time && !trajectory.ending().is_rest(), "{law}");
            assert_eq!(trajectory.ending(), Ending::Stopped, "{law}");
            Some((time, *law))
        }
        Err(error) => panic!("{error}"),
    }
}

/// The laws that end runs of every method, in steps of one size and of a tolerance; from rest without those of Gauss.
fn laws_of_all<Y>(system: &Y, start: Vector3<f64>) -> Vec<Option<(f64, ModelError)>>
where
    Y: Metriplectic<Manifold = Euclidean<3>, Metric = Canonical>,
{
    let mut found = Vec::new();
    for adaptive in [false, true] {
        let span = |tolerance: f64| -> Schedule {
            if adaptive {
                Span::until(10.0).tolerance(tolerance).into()
            } else {
                Span::steps(0.05, 200).into()
            }
        };
        // At the tolerance of the others those of order 2 would take most of the time.
        let (of_order_two, of_others) = (span(1e-4), span(1e-6));
        found.push(broken_law(system, Scheme::new(WeylMidpoint), start, of_order_two.clone()));
        for method in stages::GAUSS.into_iter().chain(stages::RADAU) {
            let is_of_order_two = method == stages::Gauss1;
            let span = if is_of_order_two { &of_order_two } else { &of_others };
            found.push(broken_law(system, method, start, span.clone()));
        }
        found.push(broken_law(system, DormandPrince5, start, of_others.clone()));
        found.push(broken_law(system, DormandPrince8, start, of_others));
        found.push(broken_law(system, RungeKuttaChebyshev, start, of_order_two));
    }
    found
}

#[test]
fn a_law_that_breaks_away_from_the_start_ends_the_run_of_every_method() {
    type Is = fn(&ModelError) -> bool;
    let models: [(&str, Field, Field, Friction, Is); 4] = [
        (
            "S",
            warm,
            |x| x.z + beyond(x.x),
            damped,
            |law| matches!(law, ModelError::EntropyNotCasimir { .. }),
        ),
        (
            "K dH",
            warm,
            |x| x.z,
            |x, w| {
                let mut k = drag(Real::from(0.05), w);
                k[(2, 2)] += beyond(x.x);
                k
            },
            |law| matches!(law, ModelError::EnergyNotKept { .. }),
        ),
        (
            "K < 0",
            warm,
            |x| x.z,
            |x, w| {
                let growth = if x.x.re < -0.5 { (x.x + 0.5).powi(2) } else { Real::from(0.0) };
                drag(Real::from(0.05) - growth, w)
            },
            |law| matches!(law, ModelError::DissipationNotPositive { .. }),
        ),
        (
            "dH",
            |x| warm(x) + Real::from(beyond(x.x).re),
            |x| x.z,
            damped,
            |law| matches!(law, ModelError::WrongDerivative { .. }),
        ),
    ];
    for (name, energy, entropy, friction, is) in models {
        let system = oscillator_with(energy, entropy, friction);
        for start in [THROUGH, AT_REST] {
            if start == AT_REST && name != "K < 0" {
                // It does not come to where the law is broken.
                continue;
            }
            let all = laws_of_all(&system, start);
            for (index, found) in all.into_iter().enumerate() {
                let (time, law) =
                    found.unwrap_or_else(|| panic!("{name}, run {index} from {start:?} ends well"));
                println!("{name}, run {index}: {law} at {time}");
                assert!(is(&law), "{name}, run {index}: {law}");
                assert!(time > 0.0 && time < 10.0, "{name}, run {index}: {time}");
            }
        }
    }
    // The model that keeps its laws everywhere.
    let sound = oscillator_with(warm, |x| x.z, damped);
    for start in [THROUGH, AT_REST] {
        assert!(laws_of_all(&sound, start).iter().all(Option::is_none));
    }
}

#[test]
fn a_lost_derivative_is_found_at_the_end_of_a_run() {
    let system = oscillator_with(|x| warm(x) + Real::from(beyond(x.x).re), |x| x.z, damped);
    // It ends at q = 1.9, in steps of one size.
    for (index, found) in [
        broken_law(&system, Scheme::new(WeylMidpoint), THROUGH, Span::steps(0.05, 12).into()),
        broken_law(&system, stages::Gauss2, THROUGH, Span::steps(0.05, 12).into()),
        broken_law(&system, stages::Radau3, THROUGH, Span::steps(0.05, 12).into()),
        broken_law(&system, DormandPrince5, THROUGH, Span::steps(0.05, 12).into()),
        broken_law(&system, DormandPrince8, THROUGH, Span::steps(0.05, 12).into()),
        broken_law(&system, RungeKuttaChebyshev, THROUGH, Span::steps(0.05, 12).into()),
    ]
    .into_iter()
    .enumerate()
    {
        let (_, law) = found.unwrap_or_else(|| panic!("run {index} ends well"));
        assert!(matches!(law, ModelError::WrongDerivative { field: "energy", .. }), "{law}");
    }
}

#[test]
fn a_lost_derivative_is_found_in_runs_of_a_verified_system() {
    let lost = |weight: f64| {
        System::on(Euclidean::<3>)
            .bracket(
                Poisson::constant(matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0])
                    .expect("it is skew"),
            )
            .energy(move |x: &State| warm(x) + Real::from(beyond(x.x).re * weight))
            .entropy(|x: &State| x.z)
            .dissipation(FieldDissipation(damped))
            .build()
            .expect("an oscillator is a system")
    };
    let short = Span::steps(0.05, 12);
    for weight in [1.0, 0.1, 0.0] {
        let system = lost(weight);
        let verified = system.verified(&THROUGH).expect("it is right around its start");
        let runs = [
            WeylMidpoint.run(&verified, THROUGH, short),
            DormandPrince5.run(&verified, THROUGH, short),
            // It passes q = 3/2 in steps of which none is checked, and ends where the derivative is right.
            WeylMidpoint.run(&verified, THROUGH, Span::steps(0.01, 600).at_most(2)),
        ];
        for (index, run) in runs.into_iter().enumerate() {
            match run {
                Err(RunError::Step { cause: StepError::Model { time, law }, .. }) => {
                    println!("weight {weight}, run {index}: {law} at {time}");
                    let is = matches!(*law, ModelError::WrongDerivative { field: "energy", .. });
                    assert!(is && weight > 0.0, "{law}");
                }
                Ok(_) => assert!(weight == 0.0, "weight {weight}, run {index} ends well"),
                Err(error) => panic!("{error}"),
            }
        }
    }
}

/// The steps from one check to the next; the test of the costs counts the states that are checked.
const EVERY: usize = 149;

/// A first look at derivatives costs a few evaluations, also of models whose differences are bad.
#[test]
fn checks_on_the_way_cost_a_hundredth_of_a_long_run() {
    let calls = Cell::new(0);
    let body = System::on(LieDual::so3())
        .energy(counted(&calls, kinetic(vector![1.0, 2.0, 3.0])))
        .entropy(half_square)
        .build()
        .unwrap();
    let unchecked = |states: usize| {
        let before = calls.get();
        for step in 0..states {
            assert!(body.check_state(&models::UNSTABLE).is_ok());
            assert!(body.look_at_derivatives(&models::UNSTABLE, step).is_ok());
        }
        calls.get() - before
    };
    let of_a_check = unchecked(100) as f64 / 100.0;
    let start = vector![0.3, 0.5, 0.2];
    let mut costs = Vec::new();
    let mut cost = |name: &str, run: &dyn Fn(usize) -> usize| {
        let since = |count: usize| {
            let before = calls.get();
            let checked = run(count);
            (calls.get() - before, checked)
        };
        let (short, few) = since(1000);
        let (long, many) = since(1000 + 100 * EVERY);
        let fraction = of_a_check * (many - few) as f64 / (long - short) as f64;
        println!("{name}: {of_a_check} calls at each of {} states, {fraction:.4}", many - few);
        assert_eq!(many - few, 100, "{name}");
        costs.push((name.to_owned(), fraction));
    };
    let span = |count: usize| Span::steps(0.01, count).at_most(2);
    cost("midpoint", &|count| {
        let run = WeylMidpoint.run(&body, start, span(count)).unwrap();
        run.certificate().checked_states
    });
    cost("order 5", &|count| {
        let run = DormandPrince5.run(&body, start, span(count)).unwrap();
        run.certificate().checked_states
    });
    cost("order 8", &|count| {
        let run = DormandPrince8.run(&body, start, span(count)).unwrap();
        run.certificate().checked_states
    });
    cost("Chebyshev", &|count| {
        let run = RungeKuttaChebyshev.run(&body, start, span(count)).unwrap();
        run.certificate().checked_states
    });
    cost("Gauss", &|count| {
        let run = Gauss::<2>.run(&body, start, span(count)).unwrap();
        run.certificate().checked_states
    });
    for (name, fraction) in costs {
        assert!(fraction < 0.01, "{name}: {fraction}");
    }
}

#[test]
fn checks_on_the_way_cost_a_hundredth_of_a_long_run_of_a_lattice() {
    let calls = AtomicUsize::new(0);
    let bond = |(x, y): &(Vector2<Real>, Vector2<Real>)| {
        calls.fetch_add(1, Relaxed);
        (y.x - x.x).powi(2) * 0.5
    };
    let lattice = Lattice::on(Graph::ring(64), Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5)
        .bond_energy(bond)
        .build()
        .unwrap();
    let start = lattice.points(|site| vector![(site as f64).sin(), 0.0]);
    let since = |f: &dyn Fn() -> usize| {
        let before = calls.load(Relaxed);
        let checked = f();
        (calls.load(Relaxed) - before, checked)
    };
    let (all, _) = since(&|| {
        for step in 0..64 {
            lattice.reexamine(&start, Recheck::OnTheWay { step }).unwrap();
        }
        0
    });
    // No state is checked between these steps.
    let run = |count| {
        let run = DormandPrince5.run(&lattice, start.clone(), Span::steps(0.05, count)).unwrap();
        run.certificate().checked_states
    };
    let [(short, few), (long, many)] = [60, 80].map(|count| since(&|| run(count)));
    assert_eq!(few, many);
    let (of_a_check, of_a_step) = (all as f64 / 64.0, (long - short) as f64 / 20.0);
    let fraction = of_a_check / (EVERY as f64 * of_a_step);
    println!("{of_a_check} calls of a check, {of_a_step} of a step, {fraction:.4}");
    assert!(fraction > 0.0 && fraction < 0.01, "{fraction}");
}

#[test]
fn steps_resumed_runs_and_runs_with_outputs_check_their_model() {
    let system = oscillator_with(warm, |x| x.z + beyond(x.x), damped);
    let method = Scheme::new(WeylMidpoint);
    // One step at a time, without an end.
    let mut steps = method.steps(&system, THROUGH, 0.05).unwrap();
    let error = steps.by_ref().find_map(Result::err).expect("a law is broken");
    assert!(matches!(error, StepError::Model { .. }), "{error}");
    assert!(steps.state().point.x > 1.5 && steps.next().is_none());
    // Put down before the law breaks.
    let first = method.run(&system, THROUGH, Span::steps(0.05, 4)).unwrap();
    assert_eq!(first.certificate().checked_states, 5);
    let later = first.checkpoint().clone().with_steps(200).unwrap();
    let error = method.resume(&system, &later).unwrap().run().unwrap_err();
    assert!(error.to_string().contains("Casimir"), "{error}");
    // The state at which the run stopped is the last one, also among outputs.
    for span in [
        Span::steps(0.05, 200).output_every(0.5),
        Span::until(10.0).event("turn", |x: &Vector3<f64>| x.y).into(),
        Span::until(10.0).until_rest(1e-6).into(),
    ] {
        let error = method.run(&system, THROUGH, span).unwrap_err();
        let trajectory = error.trajectory().expect("it had started");
        assert!(trajectory.last().point.x > 1.5, "{error}");
        assert!(error.to_string().contains("Casimir"), "{error}");
    }
}

#[test]
fn a_model_that_keeps_its_laws_is_not_refused_at_an_equilibrium_or_at_the_edge_of_a_branch() {
    // dS = 4 (|p|² − 1) p cancels to round-off at |p| = 1, and S is a Casimir all the same.
    let body = System::on(LieDual::so3())
        .energy(kinetic(vector![1.0, 2.0, 3.0]))
        .entropy(|p: &Vector3<Real>| p.norm_squared().powi(2) - p.norm_squared() * 2.0)
        .build()
        .unwrap();
    for unit in [vector![0.6, 0.8, 0.0], vector![1.0, 1.0, 1.0] / 3.0_f64.sqrt()] {
        for size in [1.0, 1.0 + 1e-15, 1.0 - 3e-16, 1.0 + 1e-9] {
            let x = unit * size;
            assert!(body.check_state(&x).is_ok(), "{:?}", body.check_state(&x));
        }
    }
    // A rate that falls to zero, and to −10⁻¹⁷ by round-off; and a negative one.
    let rate = oscillator_with(warm, |x| x.z, |x, w| drag(x.x, w));
    assert!(rate.check_state(&vector![-1e-17, 2.0, 0.1]).is_ok());
    assert!(rate.check_state(&vector![0.0, 2.0, 0.1]).is_ok());
    assert!(rate.check_state(&vector![-1e-3, 2.0, 0.1]).is_err());
    // At rest, at tiny and at large states.
    let sound = oscillator_with(warm, |x| x.z, damped);
    for size in [0.0, 1e-300, 1e-170, 1e-30, 1e-9, 1.0, 1e9, 1e30] {
        for x in [vector![size, 0.0, 0.0], vector![0.0, size, 0.1], vector![size, -size, 0.3]] {
            assert!(sound.check_state(&x).is_ok(), "{:?}", sound.check_state(&x));
            assert!(sound.check_derivatives(&x).is_ok(), "{:?}", sound.check_derivatives(&x));
        }
    }
    // A kink of the energy, where no derivative agrees with the quotients.
    let kink =
        oscillator_with(|x| warm(x) + if x.x.re < 0.0 { -x.x } else { x.x }, |x| x.z, damped);
    assert!(kink.check_derivatives(&vector![0.0, 1.0, 0.0]).is_ok());
}

/// Friction `b bᵀ` with `b = dH × p + c p` loses its digits beside an equilibrium, where `dH × p` cancels.
#[test]
fn friction_that_hardly_acts_is_sound_beside_an_equilibrium_and_everywhere() {
    let body = |a: Vector3<f64>, wrong: f64| {
        System::on(LieDual::so3())
            .energy(kinetic(a))
            .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
            .dissipation(FieldDissipation(move |p: &Vector3<Real>, w: &Vector3<Real>| {
                let b = w.cross(p) + p * Real::from(wrong);
                b * b.transpose()
            }))
            .build()
            .unwrap()
    };
    let (inertia, axis) = (vector![1.0, 2.0, 3.0], Vector3::y());
    for unit in [1.0, 1e-20, 1e20] {
        for off in [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-15, 0.0] {
            let x = (axis + vector![0.8, 0.3, -0.6] * off) * unit;
            accepted(&body(inertia, 0.0).report(&x));
            refused(&body(inertia, 1e-3 * unit).report(&x), &["dissipation"]);
        }
        // Every state of a sphere is at rest.
        accepted(&body(vector![2.0, 2.0, 2.0], 0.0).report(&(vector![0.6, -0.3, 0.7] * unit)));
    }
    let (beside, still) = (axis + vector![0.8, 0.3, -0.6] * 1e-8, vector![0.6, -0.3, 0.7]);
    for (a, x) in [(inertia, beside), (vector![2.0, 2.0, 2.0], still)] {
        let system = body(a, 0.0);
        keeps_both_laws(Scheme::new(WeylMidpoint), &system, x);
        keeps_both_laws(Gauss::<2>, &system, x);
        keeps_both_laws(Radau::<2>, &system, x);
        keeps_both_laws(DormandPrince5, &system, x);
        keeps_both_laws(DormandPrince8, &system, x);
    }
}

fn keeps_both_laws<Y>(method: impl Method<Y>, system: &Y, x: Vector3<f64>)
where
    Y: Metriplectic<Manifold = LieDual<3>>,
{
    let run = method.run(system, x, Span::steps(0.1, 100)).expect("it is a sound model");
    let c = run.certificate();
    assert!(c.keeps_energy() && c.keeps_entropy(), "{c}");
}
