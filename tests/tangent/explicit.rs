//! Explicit steps with their projection, outputs and events.

use metriplectic::dynamics::Parametrised as _;
use metriplectic::integrators::{LinearisedAlong, TangentError};
use metriplectic::prelude::*;
use nalgebra::{DMatrix, vector};

use crate::{body, compared, differences, off};

const START: Vector3<f64> = Vector3::new(0.4, -1.0, 0.3);
const THETA: Vector4<f64> = Vector4::new(3.0, 2.0, 1.0, 0.05);

#[test]
fn explicit_tangents_are_those_of_differences() {
    let family = body();
    let system = family.at_parameters(THETA);
    for (h, n, bars) in [(0.25, 80, [1e-9; 2]), (1.0, 20, [1e-10; 2])] {
        let span = Span::steps(h, n);
        let run = DormandPrince8.tangent(&system, START, span).unwrap();
        let [error, law] = compared(&system, DormandPrince8, &START, &span, 2e-3);
        let differences = differences::<Euclidean<4>, LieDual<3>>(&THETA, 2e-3, |t| {
            DormandPrince8.run(&family.at_parameters(*t), START, span).unwrap().last().point
        });
        let along = off(&run.last().along_parameters(), &differences);
        let entropy = run.sensitivity().entropy.unwrap();
        println!("h = {h}: x₀ {error:.1e}, θ {along:.1e}, laws {law:.1e} {entropy:.1e}");
        assert!(error < bars[0] && along < bars[1], "{error:e} {along:e}");
        assert!(law < 1e-13 && entropy < 1e-13, "{law:e} {entropy:e}");
    }
    let [error, law] = compared(&system, DormandPrince5, &START, &Span::steps(0.2, 100), 2e-3);
    println!("order 5: {error:.1e}, law {law:.1e}");
    assert!(error < 1e-9 && law < 1e-13);
}

fn accept<D, M>(name: &str, system: &D, method: M, x0: &metriplectic::dynamics::Point<D>)
where
    D: Differentiable,
    M: Copy + Stepper<D> + LinearisedAlong<D>,
{
    let [error, law] = compared(system, method, x0, &Span::steps(0.1, 20), 2e-3);
    println!("{name}: T {error:.1e}, law {law:.1e}");
    assert!(error < 1e-9 && law < 1e-12, "{name}: {error:e} {law:e}");
}

#[test]
fn explicit_tangents_on_curved_spaces() {
    let sphere = System::on(Sphere::<2>::round())
        .energy(|n: &Vector3<Real>| n.x * n.x * 0.5 + n.y * n.y + n.z.powi(3) * 0.4)
        .entropy(|n: &Vector3<Real>| n.z + n.x * n.y * 0.3)
        .build()
        .unwrap();
    accept("S², order 8", &sphere, DormandPrince8, &vector![0.36, 0.48, 0.8]);
    accept("S², order 5", &sphere, DormandPrince5, &vector![0.36, 0.48, 0.8]);
    accept("S², equator", &sphere, DormandPrince8, &vector![0.6, 0.8, -0.0]);
    let turn = System::on(Rotations)
        .bracket(Nambu::default())
        .energy(|r: &Matrix3<Real>| r[(0, 0)] * 1.3 + r[(1, 2)] * 0.7 + r[(2, 1)] * r[(2, 1)])
        .entropy(|r: &Matrix3<Real>| r[(2, 2)] + r[(0, 1)] * 0.4)
        .build()
        .unwrap();
    let r0 = Matrix3::new(0.36, 0.48, -0.8, -0.8, 0.6, 0.0, 0.48, 0.64, 0.6);
    accept("SO(3), order 5", &turn, DormandPrince5, &r0);
    let spin = System::on(Product(Sphere::<2>::round(), HalfLine))
        .bracket((AreaForm, Zero))
        .energy(|(n, e): &(Vector3<Real>, Vector1<Real>)| n.z + n.x * n.x * 0.4 + e.x)
        .entropy(|(_, e): &(Vector3<Real>, Vector1<Real>)| e.x.ln())
        .build()
        .unwrap();
    accept("S² × R₊", &spin, DormandPrince5, &(vector![0.36, 0.48, 0.8], vector![1.3]));
}

/// Steps that follow a tolerance are frozen: the tangent converges with them.
#[test]
fn frozen_tangents_follow_the_tolerance() {
    let family = body();
    let system = family.at_parameters(THETA);
    let tangent =
        |span: Span| DormandPrince8.tangent(&system, START, span).unwrap().last().along_start();
    let reference = tangent(Span::steps(0.05, 400));
    let mut points = Vec::new();
    for tolerance in [1e-3_f64, 1e-5, 1e-7, 1e-9, 1e-11] {
        let run =
            DormandPrince8.tangent(&system, START, Span::until(20.0).tolerance(tolerance)).unwrap();
        let plain =
            DormandPrince8.run(&system, START, Span::until(20.0).tolerance(tolerance)).unwrap();
        assert!(plain.last().point == run.last().point);
        assert!(run.sensitivity().frozen);
        let error = off(&run.last().along_start(), &reference);
        println!("tolerance {tolerance:.0e}: {error:.1e}, laws {}", run.sensitivity());
        points.push((tolerance.ln(), error.ln()));
    }
    let n = points.len() as f64;
    let mean = |f: fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let slope = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>()
        / points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>();
    println!("slope {slope:.2}");
    assert!(slope >= 0.9);
}

#[test]
fn outputs_inside_steps_have_tangents() {
    let family = body();
    let system = family.at_parameters(THETA);
    let span = Span::steps(0.5, 4).output_at([0.2, 1.0, 1.7]);
    let run = DormandPrince8.tangent(&system, START, span).unwrap();
    let times: Vec<f64> = run.states().iter().map(|state| state.time).collect();
    assert_eq!(times, [0.0, 0.2, 1.0, 1.7, 2.0], "the end of the run is recorded too");
    // The same by a run whose last step ends there.
    let end = |x: &Vector3<f64>| {
        let first = DormandPrince8.run(&system, *x, Span::steps(0.5, 3)).unwrap();
        DormandPrince8.run(&system, first.last().point, Span::steps(0.2, 1)).unwrap().last().point
    };
    let differences = differences::<LieDual<3>, LieDual<3>>(&START, 2e-3, end);
    let error = off(&run.states()[3].along_start(), &differences);
    println!("output: {error:.1e}");
    assert!(error < 1e-9);
}

/// The time of an event, against differences of order 4 of the times of runs.
#[test]
fn times_of_events_have_derivatives() {
    let family = body();
    let times = |x: Vector3<f64>, t: Vector4<f64>| {
        let span = Span::until(20.0).tolerance(1e-11).event("x", |p: &Vector3<f64>| p.x);
        DormandPrince8.run(&family.at_parameters(t), x, span).unwrap().events()[0].state.time
    };
    let span = Span::until(20.0).tolerance(1e-11).event("x", |p: &Vector3<f64>| p.x).stop();
    let run = DormandPrince8.tangent(&family.at_parameters(THETA), START, span).unwrap();
    let event = &run.events()[0];
    assert_eq!(run.last().time.to_bits(), event.state.time.to_bits());
    let found = event.time_along(&|p: &Vector3<Real>| p.x).unwrap();
    let mut worst = 0.0_f64;
    for k in 0..7 {
        let at = |d: f64| {
            let (mut x, mut t) = (START, THETA);
            if k < 3 {
                x[k] += d;
            } else {
                t[k - 3] += d;
            }
            times(x, t)
        };
        let e = 1e-4;
        let slope = (8.0 * (at(e) - at(-e)) - (at(2.0 * e) - at(-2.0 * e))) / (12.0 * e);
        worst = worst.max((slope - found[k]).abs());
    }
    println!("event: {worst:.1e} of {:.1}", found.amax());
    assert!(worst < 1e-8 * found.amax());
    // On the event the function does not change.
    let state = event.state_along(&|p: &Vector3<Real>| p.x).unwrap();
    assert!(state.row(0).amax() < 1e-12 * state.amax());
    // The energy has no slope along the motion.
    let grazing = event
        .time_along(&|p: &Vector3<Real>| (p.x * p.x / 3.0 + p.y * p.y / 2.0 + p.z * p.z) * 0.5);
    assert!(matches!(grazing, Err(TangentError::Grazing { .. })));
    // A function with a slope of 2·10⁻⁶ of what is possible crosses, one of 5·10⁻⁷ does not.
    let [v, units]: [Vector3<f64>; 2] =
        [&event.velocity, &event.sizes].map(|v| v.fixed_rows::<3>(0).into_owned());
    let along = v.component_div(&units).normalize();
    let across = along.cross(&Vector3::x()).normalize();
    let crosses = |slope: f64| {
        let df = (across + along * slope).component_div(&units);
        event.time_along(&move |p: &Vector3<Real>| p.x * df.x + p.y * df.y + p.z * df.z).is_ok()
    };
    assert!(crosses(2e-6) && !crosses(5e-7));
}

/// An oscillator whose position has the size `a` and whose momentum has the size `b`, with the period of the one in units of 1.
fn oscillator(
    a: f64,
    b: f64,
) -> impl Differentiable<Manifold = Euclidean<2>, Wide: Metriplectic<Manifold = Euclidean<2>>> {
    System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(move |x: &Vector2<Real>| {
            let (q, p) = (x.x / a, x.y / b);
            ((q * q + p * p) * 0.5 + q.powi(4) * 0.1) * (a * b)
        })
        .build()
        .expect("it is a system")
}

/// Times of events have derivatives, and are grazing or not, whatever the units of the entries.
#[test]
fn events_do_not_depend_on_units() {
    macro_rules! same {
        ($name:literal, $method:expr, $bar:expr) => {
            let [unit, large, small] = [[1.0, 1.0], [1e11, 1e-3], [1e-9, 1e5]].map(|[a, b]| {
                let span = Span::steps(0.1, 40);
                let span = span.event("p", move |x: &Vector2<f64>| x.y / b + 0.6).stop();
                let run = $method.tangent(&oscillator(a, b), vector![a, 0.0], span).unwrap();
                let event = &run.events()[0];
                // A slope of 2·10⁻⁶ of what is possible crosses, one of 5·10⁻⁷ does not.
                let [velocity, sizes]: [Vector2<f64>; 2] =
                    [&event.velocity, &event.sizes].map(|v| v.fixed_rows::<2>(0).into_owned());
                let along = velocity.component_div(&sizes).normalize();
                let crosses = |slope: f64| {
                    let df = (vector![-along.y, along.x] + along * slope).component_div(&sizes);
                    event.time_along(&move |x: &Vector2<Real>| x.x * df.x + x.y * df.y).is_ok()
                };
                assert!(crosses(2e-6) && !crosses(5e-7), "{}: units {a:e} and {b:e}", $name);
                let time = event.time_along(&|x: &Vector2<Real>| x.y / b).unwrap();
                vector![time[0] * a, time[1] * b]
            });
            let off = [large, small].map(|time| (time - unit).amax() / unit.amax());
            println!("{}: off by {:.1e} and {:.1e}", $name, off[0], off[1]);
            assert!(off.iter().all(|off| *off < $bar), "{}: {off:?}", $name);
        };
    }
    same!("order 8", DormandPrince8, 1e-11);
    same!("order 5", DormandPrince5, 1e-11);
    same!("midpoint", Scheme::new(WeylMidpoint).gradient(MeanValue), 1e-11);
    // Their corrections depend on the metric, which stays canonical: at the order of the step, 2·10⁻⁶ in units of one.
    same!("Gauss", Gauss::<2>, 1e-5);
    same!("Radau", Radau::<3>, 1e-4);
}

/// Jumps are refused: the tangent would be another one beyond them. Corners of a system without a clock only end steps.
#[test]
fn jumps_are_refused_and_corners_are_crossed() {
    let family = body();
    let system = family.at_parameters(THETA);
    let bounce =
        Span::steps(0.25, 40).event("x", |p: &Vector3<f64>| p.x).jump(|_, p: &Vector3<f64>| -p);
    let jumps = DormandPrince8.tangent(&system, START, bounce);
    assert!(matches!(jumps, Err(TangentError::Broken { what: "jumps without derivatives" })));
    let corners =
        DormandPrince8.tangent(&system, START, Span::steps(0.05, 200).corners([0.3, 0.32]));
    let whole = DormandPrince8.tangent(&system, START, Span::steps(0.05, 200));
    let error = off(&corners.unwrap().last().matrix(), &whole.unwrap().last().matrix());
    assert!(error < 1e-9, "{error:e}");
}

/// A run in two parts has the product of their tangents, and directions together are those one by one.
#[test]
fn tangents_of_runs_in_a_row_are_multiplied() {
    let family = body();
    let system = family.at_parameters(THETA);
    let tangent = |x: Vector3<f64>, n: usize| {
        DormandPrince8.tangent(&system, x, Span::steps(0.25, n)).unwrap().last().clone()
    };
    let (first, whole) = (tangent(START, 10), tangent(START, 30));
    let second = tangent(first.point, 20);
    let product: DMatrix<f64> = second.along_start() * first.along_start();
    let error = off(&product, &whole.along_start());
    println!("product: {error:.1e}");
    assert!(error < 1e-12);
}
