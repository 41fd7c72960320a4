//! Self-adjoint implicit steps.

use metriplectic::prelude::*;
use nalgebra::{DMatrix, vector};

use crate::{compared, differences, off};

const START: Vector3<f64> = Vector3::new(0.4, -1.0, 0.3);

/// The directions on a sphere, and fields whose differentials are not linear.
macro_rules! sphere {
    () => {
        System::on(Sphere::<2>::round())
            .energy(|n: &Vector3<Real>| n.x * n.x * 0.5 + n.y * n.y + n.z.powi(3) * 0.4)
            .entropy(|n: &Vector3<Real>| n.z + n.x * n.y * 0.3)
    };
}

fn accept(name: &str, [error, law]: [f64; 2], bars: [f64; 2]) {
    println!("{name}: T {error:.1e}, law {law:.1e}");
    assert!(error < bars[0] && law < bars[1], "{name}: {error:e} {law:e}");
}

#[test]
fn tangents_of_schemes_are_those_of_differences() {
    let quartic = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| {
            p.x * p.x * 0.5 + p.y.powi(4) * 0.3 + p.z * p.z * 1.5 + (p.x * p.z).sin() * 0.2
        })
        .entropy(|p: &Vector3<Real>| (p.norm_squared() * 0.5).exp())
        .build()
        .unwrap()
        .erased();
    // The law has the round-off of the two paths, which Newton's method leaves.
    let bars = [1e-9, 1e-11];
    let weyl = Scheme::new(WeylMidpoint);
    accept("so(3)*", compared(&quartic, weyl, &START, &Span::steps(0.2, 50), 2e-3), bars);
    let mean = weyl.gradient(MeanValue);
    accept("mean value", compared(&quartic, mean, &START, &Span::steps(0.2, 20), 2e-3), bars);
    let itoh = weyl.gradient(SymmetricItohAbe);
    accept("Itoh and Abe", compared(&quartic, itoh, &START, &Span::steps(0.2, 20), 2e-3), bars);

    let (round, n0, span) =
        (sphere!().build().unwrap().erased(), vector![0.36, 0.48, 0.8], Span::steps(0.1, 20));
    accept("S², Weyl", compared(&round, weyl, &n0, &span, 2e-3), bars);
    accept("S², projection", compared(&round, Scheme::new(Projection), &n0, &span, 2e-3), bars);
    let metric = Metric::field(|n: &Vector3<Real>| {
        let entries = Vector3::new(n.x * n.x + 1.0, n.y * n.z * 0.2 + 1.5, (n.x * 0.5).exp());
        Matrix3::from_diagonal(&entries)
    });
    let bent = sphere!().metric(metric).build().unwrap();
    accept("S², closure", compared(&bent, Scheme::new(ChartMidpoint), &n0, &span, 2e-3), bars);
    accept("geodesics", compared(&bent, weyl, &n0, &Span::steps(0.1, 3), 2e-3), bars);

    let turn = System::on(Rotations)
        .bracket(Nambu::default())
        .energy(|r: &Matrix3<Real>| r[(0, 0)] * 1.3 + r[(1, 2)] * 0.7 + r[(2, 1)] * r[(2, 1)])
        .entropy(|r: &Matrix3<Real>| r[(2, 2)] + r[(0, 1)] * 0.4)
        .build()
        .unwrap();
    let r0 = Matrix3::new(0.36, 0.48, -0.8, -0.8, 0.6, 0.0, 0.48, 0.64, 0.6);
    accept("SO(3), Weyl", compared(&turn, weyl, &r0, &span, 2e-3), bars);
    accept("SO(3), Cayley", compared(&turn, Scheme::new(Cayley), &r0, &span, 2e-3), bars);
}

/// The frame of a sphere turns where its last entry changes its sign, in the middle of these steps or at their ends.
#[test]
fn frames_of_a_sphere_turn_at_its_equator() {
    let round = sphere!().build().unwrap().erased();
    for z in [0.0, -0.0, 1e-17, -1e-9] {
        let n0 = vector![0.6, 0.8, z];
        let found = compared(&round, Scheme::new(WeylMidpoint), &n0, &Span::steps(0.1, 20), 2e-3);
        accept("equator", found, [1e-9, 1e-12]);
        let spin = System::on(Sphere::<2>::round())
            .bracket(AreaForm)
            .energy(|n: &Vector3<Real>| n.z + n.x * 0.0)
            .build()
            .unwrap();
        let found = compared(&spin, Scheme::new(WeylMidpoint), &n0, &Span::steps(0.3, 40), 2e-3);
        accept("along the equator", found, [1e-9, 1e-12]);
    }
}

/// The columns of parameters, by a factor that no projection sees.
#[test]
fn parameters_are_columns() {
    let h = |p: &Vector3<Real>, t: &Vector4<Real>| {
        (p.x * p.x / t.x + p.y * p.y / t.y + p.z * p.z / t.z) * 0.5 + (p.x * p.z * t.w).sin() * 0.1
    };
    let s = |p: &Vector3<Real>, t: &Vector4<Real>| (p.norm_squared() * 0.5).exp() * t.w;
    let family = Family::on(LieDual::so3())
        .parameters(["I1", "I2", "I3", "friction"])
        .energy(h)
        .entropy(s)
        .build()
        .unwrap();
    let theta = vector![10.0, 5.0, 1.0, 0.7];
    let weyl = Scheme::new(WeylMidpoint);
    let span = Span::steps(0.1, 100);
    let end = |t: &Vector4<f64>| weyl.run(&family.at(*t), START, span).unwrap().last().point;
    let run = weyl.tangent(&family.at(theta), START, span).unwrap();
    let differences = differences::<Euclidean<4>, LieDual<3>>(&theta, 2e-3, end);
    let error = off(&run.last().along_parameters(), &differences);
    accept("parameters", [error, run.sensitivity().energy], [1e-9, 1e-13]);
    assert_eq!(run.last().along("I3").unwrap(), run.last().along_parameters().column(2));

    // The family at θ is the closure that captures θ, bit for bit.
    let captured = System::on(LieDual::so3())
        .energy(move |p: &Vector3<Real>| h(p, &theta.cast()))
        .entropy(move |p: &Vector3<Real>| s(p, &theta.cast()))
        .build()
        .unwrap()
        .erased();
    let plain = weyl.run(&captured, START, span).unwrap();
    assert!(plain.last().point == run.last().point);

    // In a product with the canonical metric the dissipation moves the parameters: another equation.
    let naive = System::on(Product(LieDual::so3(), Euclidean::<4>))
        .bracket((LiePoisson, Zero))
        .energy(move |(p, t): &(Vector3<Real>, Vector4<Real>)| h(p, t))
        .entropy(move |(p, t): &(Vector3<Real>, Vector4<Real>)| s(p, t))
        .build()
        .unwrap();
    let moved = weyl.run(&naive, (START, theta), span).unwrap().last().point.1 - theta;
    println!("a canonical factor moves by {:.2}", moved.amax());
    assert!(moved.amax() > 1.0);
    let report = naive.report(&(START, theta));
    assert_eq!(report.moved_by_friction, [3, 4, 5, 6]);
    assert!(report.to_string().contains("belongs into a `Family`"));
    let frozen = family.at(theta);
    assert!(frozen.wide().report(&(START, theta)).moved_by_friction.is_empty());
    assert!(frozen.report(&START).moved_by_friction.is_empty());
}

/// A molecule in SI units: powers of two change no bit, and others round-off alone.
#[test]
fn units_scale_the_tangent() {
    let run = |i: f64, p: f64| {
        let inertia = vector![3.0, 2.0, 1.0] * i;
        let body = System::on(LieDual::so3())
            .energy(move |x: &Vector3<Real>| {
                x.component_mul(x).component_div(&inertia.cast()).sum() * 0.5
            })
            .entropy(move |x: &Vector3<Real>| x.norm_squared() * (0.05 * i / p))
            .build()
            .unwrap()
            .erased();
        let span = Span::steps(0.1 * i / p, 50);
        Scheme::new(WeylMidpoint).tangent(&body, START * p, span).unwrap().last().along_start()
    };
    let one = run(1.0, 1.0);
    let error = off(&run(1e-47, 1e-34), &one);
    println!("a molecule: {error:.1e}");
    assert!(error < 1e-12);
    assert_eq!(run(2_f64.powi(-156), 2_f64.powi(-113)), one);
}

/// The tangent of the midpoint rule has its order.
#[test]
fn the_order_is_that_of_the_method() {
    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.05 + p.y * p.y * 0.1 + p.z * p.z * 0.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()
        .unwrap()
        .erased();
    let at = |n: usize| {
        let span = Span::steps(4.0 / n as f64, n);
        Scheme::new(WeylMidpoint).tangent(&body, START, span).unwrap().last().along_start()
    };
    let tangents: Vec<DMatrix<f64>> = [10, 20, 40, 80, 160].map(at).to_vec();
    let changes: Vec<f64> = tangents.windows(2).map(|w| (&w[1] - &w[0]).amax()).collect();
    let slopes: Vec<f64> = changes.windows(2).map(|w| (w[0] / w[1]).log2()).collect();
    println!("slopes {slopes:.3?}");
    assert!(slopes[1..].iter().all(|slope| (slope - 2.0).abs() < 0.02));
}

/// Stiff friction: the tangent is that of the map, which multiplies a fast deviation by −1, and it says so.
#[test]
fn stiff_friction_is_warned_about() {
    let heat = System::on(Euclidean::<2>)
        .dissipation(FieldDissipation(|_: &Vector2<Real>, w: &Vector2<Real>| {
            let b = Vector2::new(w.y, -w.x);
            b * b.transpose() * Real::from(1e7)
        }))
        .energy(|e: &Vector2<Real>| e.x + e.y)
        .entropy(|e: &Vector2<Real>| e.x.ln() + e.y.ln())
        .build()
        .unwrap();
    let (x0, span) = (vector![1.0, 1.2], Span::steps(0.1, 5));
    let run = Scheme::new(WeylMidpoint).tangent(&heat, x0, span).unwrap();
    let found = compared(&heat, Scheme::new(WeylMidpoint), &x0, &span, 1e-3);
    accept("stiff heat", found, [1e-8, 1e-8]);
    let swapped = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, 1.0, 0.0]);
    assert!((run.last().along_start() - swapped).amax() < 1e-5);
    assert!(run.sensitivity().undamped);
    assert!(run.sensitivity().to_string().contains("do not damp"));
}

/// Near a state at rest, where the correction of Gonzalez is 0/0.
#[test]
fn tangents_near_rest() {
    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x / 6.0 + p.y * p.y / 4.0 + p.z.powi(4) * 0.5)
        .entropy(|p: &Vector3<Real>| (p.norm_squared() * 0.5).exp())
        .build()
        .unwrap()
        .erased();
    for beside in [0.0, 1e-14, 1e-10, 1e-6, 1e-3] {
        let x0 = vector![1.0, beside, beside];
        let found = compared(&body, Scheme::new(WeylMidpoint), &x0, &Span::steps(0.1, 20), 2e-3);
        accept("rest", found, [1e-9, 1e-12]);
    }
}
