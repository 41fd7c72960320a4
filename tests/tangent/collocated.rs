//! Methods with stages: Gauss and Radau, by the implicit function theorem at the root of a step.

use metriplectic::dynamics::{Parametrised as _, Point};
use metriplectic::integrators::{LinearisedAlong, TangentError, TangentRun};
use metriplectic::prelude::*;
use nalgebra::{DMatrix, vector};

use crate::{body, compared, differences, off};

const START: Vector3<f64> = Vector3::new(0.4, -1.0, 0.3);
const THETA: Vector4<f64> = Vector4::new(3.0, 2.0, 1.0, 0.4);

/// Compares the tangent with differences, and asks for both of its laws.
fn accept<D, M>(name: &str, (system, method): (&D, M), x0: &Point<D>, bars: [f64; 2])
where
    D: Differentiable,
    M: Copy + Stepper<D> + LinearisedAlong<D>,
{
    let span = Span::steps(0.2, 10);
    let [error, law] = compared(system, method, x0, &span, 2e-3);
    let run = method.tangent(system, x0.clone(), span).expect("a run with its tangent");
    let entropy = run.sensitivity().entropy.expect("an entropy with a tangent");
    println!("{name}: T {error:.1e}, laws {law:.1e} {entropy:.1e}");
    assert!(error < bars[0], "{name}: {error:e}");
    assert!(law < bars[1] && entropy < bars[1], "{name}: {law:e} {entropy:e}");
}

const BARS: [f64; 2] = [1e-9, 1e-13];

/// The columns of the start and of the parameters, of both kinds of methods.
#[test]
fn tangents_of_stages_are_those_of_differences() {
    let family = body();
    let system = family.at_parameters(THETA);
    let span = Span::steps(0.2, 10);
    macro_rules! accepted {
        ($name:literal, $method:expr) => {
            accept($name, (&system, $method), &START, BARS);
            let differences = differences::<Euclidean<4>, LieDual<3>>(&THETA, 2e-3, |t| {
                $method.run(&family.at_parameters(*t), START, span).unwrap().last().point
            });
            let run = $method.tangent(&system, START, span).unwrap();
            let along = off(&run.last().along_parameters(), &differences);
            println!("{}: θ {along:.1e}", $name);
            assert!(along < 1e-9, "{along:e}");
            let watched = Span::steps(0.5, 6).output_every(0.7);
            crate::adjoint::transposed(($name, 1e-13), (&system, $method), &START, &watched);
        };
    }
    accepted!("Gauss", Gauss::<2>);
    accepted!("Radau", Radau::<2>);
}

/// Spaces whose charts move with the middle of a step; the frame of a sphere turns at its equator.
#[test]
fn tangents_of_stages_on_curved_spaces() {
    let sphere = System::on(Sphere::<2>::round())
        .energy(|n: &Vector3<Real>| n.x * n.x * 0.5 + n.y * n.y + n.z.powi(3) * 0.4)
        .entropy(|n: &Vector3<Real>| n.z + n.x * n.y * 0.3)
        .build()
        .unwrap();
    for z in [0.8, 0.0, -0.0, -1e-9] {
        let x0 = vector![0.36, 0.48, z].normalize();
        accept("S², Gauss", (&sphere, Gauss::<2>), &x0, BARS);
        accept("S², Radau", (&sphere, Radau::<2>), &x0, BARS);
    }
    let turn = System::on(Rotations)
        .bracket(Nambu::default())
        .energy(|r: &Matrix3<Real>| r[(0, 0)] * 1.3 + r[(1, 2)] * 0.7 + r[(2, 1)] * r[(2, 1)])
        .entropy(|r: &Matrix3<Real>| r[(2, 2)] + r[(0, 1)] * 0.4)
        .build()
        .unwrap();
    let r0 = Matrix3::new(0.36, 0.48, -0.8, -0.8, 0.6, 0.0, 0.48, 0.64, 0.6);
    accept("SO(3), Gauss", (&turn, Gauss::<2>), &r0, BARS);
    let spin = System::on(Product(Sphere::<2>::round(), HalfLine))
        .bracket((AreaForm, Zero))
        .energy(|(n, e): &(Vector3<Real>, Vector1<Real>)| n.z + n.x * n.x * 0.4 + e.x)
        .entropy(|(_, e): &(Vector3<Real>, Vector1<Real>)| e.x.ln())
        .build()
        .unwrap();
    let x0 = (vector![0.36, 0.48, 0.8], vector![1.3]);
    accept("S² × R₊, Gauss", (&spin, Gauss::<2>), &x0, BARS);
}

/// Parameters of a metric, with which the geometry of a step changes.
#[test]
fn parameters_of_a_metric_are_columns_of_stages() {
    let family = |bend: f64| {
        Family::on(Euclidean::<2>)
            .parameters(["a", "b", "c"])
            .field_metric(|q: &Vector2<Real>, t: &Vector3<Real>| {
                let corner = q.x * q.y * 0.1;
                Matrix2::new(q.x * q.x * t.x + 1.0, corner, corner, (q.y * t.y).exp())
            })
            .energy(|q: &Vector2<Real>, t: &Vector3<Real>| q.x * q.x * 0.5 + q.y.powi(4) * t.z)
            .entropy(move |q: &Vector2<Real>, _: &Vector3<Real>| {
                q.x * 0.4 + q.y * 0.7 * (1.0 - bend) + q.x * q.y * bend
            })
            .build()
            .unwrap()
    };
    let (theta, x0, span) = (vector![0.5, 0.4, 0.3], vector![0.7, -0.5], Span::steps(0.2, 10));
    let plane = family(0.0);
    let system = plane.at_parameters(theta);
    accept("metric, Gauss", (&system, Gauss::<2>), &x0, BARS);
    accept("metric, Radau", (&system, Radau::<2>), &x0, BARS);
    let found = Radau::<2>.tangent(&system, x0, span).unwrap();
    let differences = differences::<Euclidean<3>, Euclidean<2>>(&theta, 2e-3, |t| {
        Radau::<2>.run(&plane.at_parameters(*t), x0, span).unwrap().last().point
    });
    let along = off(&found.last().along_parameters(), &differences);
    assert!(along < 1e-9, "{along:e}");

    // Where the temperature changes its sign a step that damps ends on a kink of its own equation.
    let kink = family(1.0);
    match Radau::<2>.tangent(&kink.at_parameters(theta), x0, span) {
        Err(TangentError::NotLinearised { time, cause }) => {
            println!("refused at t = {time}: {cause}");
        }
        other => panic!("a tangent on a kink: {:?}", other.map(|run| run.last().along_start())),
    }
}

/// The tangent has the order of the method: 4 and 3 with two stages.
#[test]
fn tangents_of_stages_have_the_order_of_the_method() {
    let system = body().at_parameters(THETA);
    let slopes = |tangent: &dyn Fn(Span) -> DMatrix<f64>| -> Vec<f64> {
        let at = |n: usize| tangent(Span::steps(2.0 / n as f64, n));
        let tangents = [5, 10, 20, 40].map(at);
        let changes: Vec<f64> = tangents.windows(2).map(|w| (&w[1] - &w[0]).amax()).collect();
        changes.windows(2).map(|w| (w[0] / w[1]).log2()).collect()
    };
    let along = |run: TangentRun<_>| -> DMatrix<f64> { run.last().matrix() };
    let gauss = slopes(&|span| along(Gauss::<2>.tangent(&system, START, span).unwrap()));
    let radau = slopes(&|span| along(Radau::<2>.tangent(&system, START, span).unwrap()));
    println!("slopes {gauss:.2?} {radau:.2?}");
    assert!(gauss.iter().all(|slope| (slope - 4.0).abs() < 0.1), "{gauss:?}");
    assert!(radau.iter().all(|slope| (slope - 3.0).abs() < 0.15), "{radau:?}");
}

/// Near a state at rest the correction of the covectors is 0/0.
#[test]
fn tangents_of_stages_near_rest() {
    let system = body().at_parameters(THETA);
    for beside in [0.0, 1e-14, 1e-10, 1e-7, 1e-6, 1e-5, 1e-3] {
        let x0 = vector![1.0, beside, beside];
        let [error, law] = compared(&system, Gauss::<2>, &x0, &Span::steps(0.2, 10), 2e-3);
        println!("beside {beside:e}: T {error:.1e}, law {law:.1e}");
        assert!(error < 1e-9 && law < 1e-12, "{error:e} {law:e}");
    }
}

/// A step that damps is not linear near rest: its derivative depends on the direction in which the state lies, and is compared with
/// differences that are much shorter than the way to the state at rest.
#[test]
fn a_step_that_damps_has_a_tangent_near_rest_and_says_that_it_has_none_at_rest() {
    let system = body().at_parameters(THETA);
    let span = Span::steps(0.2, 1);
    for beside in [1e-1, 1e-2, 1e-3, 1e-4] {
        for k in 0..12 {
            let angle = std::f64::consts::TAU * (f64::from(k) + 0.3) / 12.0;
            let x0 = vector![1.0, beside * angle.cos(), beside * angle.sin()];
            let [error, law] = compared(&system, Radau::<2>, &x0, &span, 0.01 * beside);
            // Some roundings of the state over the length of the differences.
            let round_off = 20.0 * f64::EPSILON / (0.01 * beside);
            println!("beside {beside:e}, {angle:.1}: T {error:.1e}, law {law:.1e}");
            assert!(error < 1e-9_f64.max(round_off), "beside {beside:e}, {angle:.1}: {error:e}");
            assert!(law < 1e-13, "{law:e}");
        }
        let x0 = vector![1.0, beside, 0.4 * beside];
        let run = Radau::<2>.tangent(&system, x0, span).unwrap();
        assert!(!run.sensitivity().at_rest);
    }
    // At rest each slope differs from that by the local error, 2e-7 here.
    let x0 = vector![1.0, 0.0, 0.0];
    let run = Radau::<2>.tangent(&system, x0, span).unwrap();
    assert!(run.sensitivity().at_rest && run.sensitivity().to_string().contains("at rest"));
    let slope = |direction: Vector3<f64>| {
        let at = |s: f64| Radau::<2>.run(&system, x0 + direction * s, span).unwrap().last().point;
        let slope = (at(1e-4) - at(-1e-4)) / 2e-4;
        let along =
            run.last().along_start() * DMatrix::from_column_slice(3, 1, direction.as_slice());
        (slope - Vector3::from_column_slice(along.as_slice())).amax()
    };
    let off = [Vector3::y(), Vector3::z()].map(slope);
    println!("at rest: off by {:.1e} and {:.1e}", off[0], off[1]);
    assert!(off.iter().all(|off| (1e-8..1e-6).contains(off)), "{off:?}");
    let run = Gauss::<2>.tangent(&system, x0, span).unwrap();
    assert!(!run.sensitivity().at_rest);
}

/// Stiff friction that is damped: all entries of the tangent are those of the motion, where the midpoint rule has another map.
#[test]
fn damped_friction_has_the_tangent_of_the_motion() {
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
    let run = Radau::<2>.tangent(&heat, x0, span).unwrap();
    let half = DMatrix::from_element(2, 2, 0.5);
    let off = (run.last().along_start() - half).amax();
    // The law has the round-off ε|A| of terms of 10⁷.
    println!("0.5 to {off:.1e}, law {:.1e}", run.sensitivity().energy);
    assert!(off < 1e-6 && run.sensitivity().energy < 100.0 * f64::EPSILON * 1e7);
    assert!(!run.sensitivity().undamped);
}
