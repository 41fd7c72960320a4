//! Events at which the state jumps, by the saltation matrix.

use metriplectic::dynamics::Parametrised as _;
use metriplectic::fitting::Loss;
use metriplectic::integrators::{LinearisedAlong, Schedule, TangentError, TangentRun};
use metriplectic::prelude::*;
use nalgebra::{DVector, Vector1, vector};

use crate::adjoint::{transposed, whole};
use crate::{differences, off};

/// The state of a ball and its restitution, with derivatives.
type Wide = (Vector2<Real>, Vector1<Real>);

const START: Vector2<f64> = Vector2::new(0.7, 0.2);
const RESTITUTION: f64 = 0.9;

/// A ball over a floor that rises, is curved in phase space, and pushes the ball harder as time goes on.
fn floor(e: f64, span: impl Into<Schedule>) -> Schedule {
    let schedule: Schedule = span.into();
    schedule
        .event_in_time("floor", |t, x: &Vector2<f64>| x.x + 0.1 * x.y * x.y - 0.02 * t)
        .falling()
        .jump(move |t, x: &Vector2<f64>| vector![x.x, -e * x.y + 0.01 * t])
        .differentiable(
            |t, (x, _): &Wide| x.x + x.y * x.y * 0.1 - t * 0.02,
            |t, (x, e): &Wide| (vector![x.x, -e.x * x.y + t * 0.01], *e),
        )
        .into()
}

/// A family on a line by its energy. A pointer to a function, so that methods and tangents are compiled once for all of them.
macro_rules! on_a_line {
    ($parameter:literal, $energy:expr) => {{
        let energy: fn(&Vector2<Real>, &Vector1<Real>) -> Real = $energy;
        Family::on(Euclidean::<2>)
            .parameters([$parameter])
            .bracket(Symplectic)
            .energy(energy)
            .build()
            .unwrap()
    }};
}

macro_rules! ball {
    () => {
        on_a_line!("restitution", |x, _| x.y * x.y * 0.5 + x.x + (x.x * 2.0).cos() * 0.1)
    };
}

/// Three impacts, against differences of runs that find their own times of impact.
#[test]
fn tangents_across_jumps_are_those_of_differences() {
    let ball = ball!();
    let system = ball.at_parameters(vector![RESTITUTION]);
    let check = |name: &str,
                 run: TangentRun<_>,
                 end: &dyn Fn(&Vector2<f64>, f64) -> Vector2<f64>| {
        assert_eq!((run.events().len(), run.states().len()), (3, 4), "{name}");
        assert!(run.last().point == end(&START, RESTITUTION), "{name}: other bits");
        let along_start =
            differences::<Euclidean<2>, Euclidean<2>>(&START, 1e-2, |x| end(x, RESTITUTION));
        let along = differences::<Euclidean<1>, Euclidean<2>>(&vector![RESTITUTION], 1e-2, |e| {
            end(&START, e.x)
        });
        let errors = [
            off(&run.last().along_start(), &along_start),
            off(&run.last().along_parameters(), &along),
        ];
        println!(
            "{name}: {:.1e} {:.1e} of {:.1}, {}",
            errors[0],
            errors[1],
            along_start.amax(),
            run.sensitivity()
        );
        assert!(errors.iter().all(|error| *error < 1e-9), "{name}: {errors:?}");
        // At the end of a jump the derivative is that of the state from which the run goes on.
        let after = run.events()[2].after.as_ref().unwrap();
        assert!(after.point == run.events()[2].event.jump.as_ref().unwrap().after.point);
        assert!(after.along("restitution").unwrap().amax() > 0.1);
    };
    macro_rules! checked {
        ($name:literal, $method:expr, $tolerance:expr) => {
            let span = || floor_outputs(RESTITUTION, Span::until(7.0).tolerance($tolerance));
            let run = $method.tangent(&system, START, span()).unwrap();
            check($name, run, &|x, e| {
                let schedule = floor_outputs(e, Span::until(7.0).tolerance($tolerance));
                $method.run(&ball.at_parameters(vector![e]), *x, schedule).unwrap().last().point
            });
        };
    }
    checked!("order 8", DormandPrince8, 1e-12);
    checked!("Gauss", Gauss::<2>, 1e-9);
}

/// The same with outputs before, between and after the impacts.
fn floor_outputs(e: f64, span: impl Into<Schedule>) -> Schedule {
    floor(e, span).output_at([0.5, 2.0, 7.0])
}

/// Refuses an impact that only touches, and derivatives of another map.
#[test]
fn grazing_and_other_jumps_are_refused() {
    fn refused<D, M>(system: &D, method: M, schedule: Schedule) -> TangentError<D::Manifold>
    where
        D: Differentiable<Manifold = Euclidean<2>>,
        M: Stepper<D> + LinearisedAlong<D>,
    {
        method.tangent(system, START, schedule).map(drop).unwrap_err()
    }
    let ball = ball!();
    let system = ball.at_parameters(vector![RESTITUTION]);
    let span = || Span::until(3.0).tolerance(1e-10);
    // The energy does not change along the motion; a function of the event that is nearly it touches zero.
    let grazing = span()
        .event("floor", |x: &Vector2<f64>| x.x)
        .falling()
        .jump(|_, x: &Vector2<f64>| vector![x.x, -x.y])
        .differentiable(
            |_, (x, _): &Wide| x.y * x.y * 0.5 + x.x + (x.x * 2.0).cos() * 0.1,
            |_, (x, e): &Wide| (vector![x.x, -x.y], *e),
        );
    let error = refused(&system, DormandPrince8, grazing.into());
    assert!(matches!(error, TangentError::Grazing { .. }), "{error}");
    let other = span()
        .event("floor", |x: &Vector2<f64>| x.x)
        .falling()
        .jump(|_, x: &Vector2<f64>| vector![x.x, -x.y])
        .differentiable(|_, (x, _): &Wide| x.x, |_, (x, e): &Wide| (vector![x.x, -e.x * x.y], *e));
    let error = refused(&system, DormandPrince8, other.into());
    assert!(matches!(error, TangentError::OtherJump { off, .. } if off > 0.01), "{error}");
    // Points of the state alone are not those of a family.
    let narrow = span()
        .event("floor", |x: &Vector2<f64>| x.x)
        .falling()
        .jump(|_, x: &Vector2<f64>| vector![x.x, -x.y])
        .differentiable(|_, x: &Vector2<Real>| x.x, |_, x: &Vector2<Real>| vector![x.x, -x.y]);
    let error = refused(&system, DormandPrince8, narrow.into());
    assert!(matches!(error, TangentError::Broken { what: "jumps without derivatives" }), "{error}");
}

/// Another map is refused in each entry, also beside one that is 10¹¹ times as large.
#[test]
fn another_jump_is_refused_beside_a_large_entry() {
    const WALL: f64 = 1e11;
    let particle = on_a_line!("restitution", |x, _| x.y * x.y * 0.5);
    let system = particle.at_parameters(vector![RESTITUTION]);
    let bounced = |other: f64| {
        let span = Span::until(3.0)
            .tolerance(1e-10)
            .event("wall", |x: &Vector2<f64>| x.x - WALL)
            .rising()
            .jump(|_, x: &Vector2<f64>| vector![x.x, -RESTITUTION * x.y])
            .differentiable(
                |_, (x, _): &Wide| x.x - WALL,
                move |_, (x, e): &Wide| (vector![x.x, -e.x * x.y * other], *e),
            );
        let start = vector![WALL - 0.5, 1.0];
        let [order_8, gauss] = [
            DormandPrince8.tangent(&system, start, span.clone()).map(drop),
            Gauss::<2>.tangent(&system, start, span).map(drop),
        ];
        [order_8, gauss]
    };
    for run in bounced(1.0) {
        run.unwrap();
    }
    for run in bounced(0.9) {
        let error = run.unwrap_err();
        assert!(matches!(error, TangentError::OtherJump { off, .. } if off > 0.01), "{error}");
    }
}

/// Costates across impacts, against tangents, by each method, in steps of one size and in such that follow a tolerance. A step between two
/// impacts, and one that is taken again, have their parts.
#[test]
fn adjoints_across_jumps_are_transposed_tangents() {
    let ball = ball!();
    let system = ball.at_parameters(vector![RESTITUTION]);
    macro_rules! checked {
        ($($name:literal: $method:expr, $fixed:expr, $tolerance:expr);+) => {$(
            // From rest too.
            for start in [START, vector![0.7, 0.0]] {
                let of = (&system, $method);
                let fixed = floor(RESTITUTION, $fixed);
                transposed(($name, 1e-13), of, &start, &fixed);
                transposed(($name, 1e-13), of, &start, &fixed.output_at([0.5, 1.7, 2.0]));
                let frozen = floor(RESTITUTION, Span::until(2.0).tolerance($tolerance));
                transposed(($name, 1e-13), of, &start, &frozen);
            }
        )+};
    }
    checked!(
        "order 5": DormandPrince5, Span::steps(0.25, 20), 1e-8;
        "order 8": DormandPrince8, Span::steps(0.25, 20), 1e-8;
        "Chebyshev": RungeKuttaChebyshev, Span::steps(0.02, 100), 1e-5;
        "Gauss": Gauss::<2>, Span::steps(0.1, 20), 1e-7;
        "Radau": Radau::<2>, Span::steps(0.04, 50), 1e-6;
        "midpoint": Scheme::new(WeylMidpoint), Span::steps(0.02, 100), 1e-5;
        "mean value": Scheme::new(WeylMidpoint).gradient(MeanValue), Span::steps(0.02, 100), 1e-5;
        "Itoh-Abe": Scheme::new(ChartMidpoint).gradient(SymmetricItohAbe), Span::steps(0.02, 100), 1e-5
    );
}

/// Kicks of points on curved spaces, and impacts that heat a stiff system.
#[test]
fn adjoints_across_jumps_on_curved_spaces_and_in_stiff_systems() {
    let top = System::on(Sphere::<2>::round())
        .bracket(AreaForm)
        .energy(|n: &Vector3<Real>| n.x * n.x * 0.5 + n.y * n.y + n.z * 0.4)
        .build()
        .unwrap();
    let kicked: Schedule = Span::steps(0.02, 60)
        .event("node", |n: &Vector3<f64>| n.x + 0.1 * n.y)
        .falling()
        .jump(|_, n: &Vector3<f64>| vector![n.y, n.z, n.x])
        .differentiable(
            |_, n: &Vector3<Real>| n.x + n.y * 0.1,
            |_, n: &Vector3<Real>| vector![n.y, n.z, n.x],
        )
        .into();
    let n0 = vector![0.36, 0.48, 0.8];
    transposed(("S², midpoint", 1e-13), (&top, Scheme::new(WeylMidpoint)), &n0, &kicked);
    transposed(("S², order 8", 1e-13), (&top, DormandPrince8), &n0, &kicked);
    transposed(("S², Gauss", 1e-13), (&top, Gauss::<2>), &n0, &kicked);
    let turn = System::on(Rotations)
        .bracket(Nambu::default())
        .energy(|r: &Matrix3<Real>| r[(0, 0)] * 1.3 + r[(1, 2)] * 0.7 + r[(2, 1)] * r[(2, 1)])
        .entropy(|r: &Matrix3<Real>| r[(2, 2)] + r[(0, 1)] * 0.4)
        .build()
        .unwrap();
    let turned: Schedule = Span::steps(0.02, 60)
        .event("node", |r: &Matrix3<f64>| r[(0, 0)] - 0.3)
        .jump(|_, r: &Matrix3<f64>| r.transpose())
        .may_lower_entropy()
        .differentiable(
            |_, r: &Matrix3<Real>| r[(0, 0)] - 0.3,
            |_, r: &Matrix3<Real>| r.transpose(),
        )
        .into();
    let r0 = Matrix3::new(0.36, 0.48, -0.8, -0.8, 0.6, 0.0, 0.48, 0.64, 0.6);
    transposed(("SO(3), order 5", 1e-13), (&turn, DormandPrince5), &r0, &turned);

    // A ball sinks in a stiff gas, and is lifted from the floor by a share of the parameter.
    let bracket = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let drag = |_: &Vector3<Real>, w: &Vector3<Real>| {
        let b = Vector3::new(0.0.into(), w.z, -w.y);
        b * b.transpose() * Real::from(3000.0)
    };
    let gas = Family::on(Euclidean::<3>)
        .parameters(["lift"])
        .bracket(Poisson::constant(bracket).unwrap())
        .dissipation(FieldDissipation(drag))
        .energy(|x: &Vector3<Real>, _: &Vector1<Real>| x.y * x.y * 0.5 + x.x * 50.0 + x.z)
        .entropy(|x: &Vector3<Real>, _: &Vector1<Real>| x.z)
        .build()
        .unwrap();
    type Warm = (Vector3<Real>, Vector1<Real>);
    let lift = 1e-3;
    let system = gas.at_parameters(vector![lift]);
    let lifted: Schedule = Span::steps(0.02, 10)
        .event("floor", |x: &Vector3<f64>| x.x)
        .falling()
        .jump(move |_, x: &Vector3<f64>| vector![x.x + lift, x.y, x.z])
        .differentiable(
            |_, (x, _): &Warm| x.x,
            |_, (x, l): &Warm| (vector![x.x + l.x, x.y, x.z], *l),
        )
        .into();
    let x0 = vector![1.55e-3, -50.0 / 3000.0, 1.0];
    transposed(("stiff, Radau", 1e-12), (&system, Radau::<2>), &x0, &lifted);
    transposed(("stiff, Gauss", 1e-12), (&system, Gauss::<2>), &x0, &lifted);
    transposed(("stiff, midpoint", 1e-12), (&system, Scheme::new(WeylMidpoint)), &x0, &lifted);
}

/// An atom of 10⁻²⁶ kg that falls a micrometre, in SI units, against the closed form of its place after one bounce,
/// `x = e v (T − t) − g (T − t)²/2` with `v = √(2 g q)`, `t = v/g`.
#[test]
fn a_bounce_has_the_derivatives_of_its_closed_form() {
    const MASS: f64 = 1e-26;
    const G: f64 = 9.81;
    let atom = on_a_line!("restitution", |x, _| x.y * x.y * (0.5 / MASS) + x.x * (MASS * G));
    let (q, e) = (1e-6, 0.7);
    let v = f64::sqrt(2.0 * G * q);
    let (t, end) = (v / G, 1.5 * v / G);
    let system = atom.at_parameters(vector![e]);
    let along = |schedule: Span| {
        let bounce = schedule
            .event("floor", |x: &Vector2<f64>| x.x)
            .falling()
            .jump(move |_, x: &Vector2<f64>| vector![x.x, -e * x.y])
            .differentiable(
                |_, (x, _): &Wide| x.x,
                |_, (x, e): &Wide| (vector![x.x, -e.x * x.y], *e),
            );
        let run = DormandPrince8.adjoint(&system, vector![q, 0.0], bounce).unwrap();
        let found = run.gradient(
            |k, x: &Vector2<Real>| if k == run.states().len() - 1 { x.x } else { 0.0.into() },
        );
        whole(&found.unwrap())
    };
    let found = along(Span::steps(end / 8.0, 8));
    let left = end - t;
    // dv/dq = g/v and dt/dq = 1/v.
    let by_height = (e * G * left - e * v + G * left) / v;
    let exact = DVector::from_vec(vec![by_height, f64::NAN, v * left]);
    for k in [0, 2] {
        let error = (found[k] / exact[k] - 1.0).abs();
        println!("{k}: {error:.1e} of {:e}", exact[k]);
        assert!(error < 1e-12, "{k}: {} {}", found[k], exact[k]);
    }
}

/// The end of a run at an event moves with the time of the event.
#[test]
fn a_run_that_stops_has_the_gradient_of_its_end() {
    let ball = ball!();
    let system = ball.at_parameters(vector![RESTITUTION]);
    let stopped = |span: Schedule| {
        floor(RESTITUTION, span).event("falls", |x: &Vector2<f64>| x.y + 0.3 * x.x).falling().stop()
    };
    macro_rules! checked {
        ($($method:expr),+) => {$(
            for span in [Span::steps(0.02, 100).into(), Span::until(2.0).tolerance(1e-6).largest_step(0.05).output_at([0.4])] {
                let schedule = stopped(span).differentiable(|_, (x, _): &Wide| x.y + x.x * 0.3);
                let tangent = $method.tangent(&system, START, schedule.clone()).unwrap();
                let run = $method.adjoint(&system, START, schedule).unwrap();
                assert!(run.ending().is_event() && run.last().point == tangent.last().point);
                let (event, dg) = (tangent.events().last().unwrap(), DVector::from_vec(vec![0.3, 1.0]));
                let mut rows = vec![DVector::zeros(2); run.states().len()];
                let row = vector![0.7, -0.2];
                *rows.last_mut().unwrap() = DVector::from_column_slice(row.as_slice());
                let found = whole(&run.pull_back(&rows).unwrap());
                let expected = event.state_by(&dg).unwrap().tr_mul(rows.last().unwrap());
                assert!((&found - &expected).amax() < 1e-13 * expected.amax(), "{found} {expected}");
                let end = run.gradient_of_end().unwrap();
                let expected = event.time_by(&dg).unwrap();
                assert!((whole(&end) - &expected).amax() < 1e-13 * expected.amax());
                assert_eq!(end.value.to_bits(), event.event.time().to_bits());
            }
        )+};
    }
    checked!(DormandPrince8, Gauss::<2>, Scheme::new(WeylMidpoint));

    // Without derivatives of its function a loss at the end has no gradient, and one before it has.
    let schedule = stopped(Span::steps(0.02, 100).into());
    let run = DormandPrince8.adjoint(&system, START, schedule).unwrap();
    let place = |at: usize| {
        run.gradient(move |k, x: &Vector2<Real>| if k == at { x.x } else { 0.0.into() })
    };
    let last = run.states().len() - 1;
    let what = "a stop without derivatives";
    assert!(matches!(place(last), Err(TangentError::Broken { what: found }) if found == what));
    assert!(
        matches!(run.gradient_of_end(), Err(TangentError::Broken { what: found }) if found == what)
    );
    assert!(place(last - 1).is_ok());
    // Another function, and one that only touches.
    let refused = |g: fn(Real, &Wide) -> Real| {
        let schedule = stopped(Span::steps(0.02, 100).into()).differentiable(g);
        DormandPrince8.adjoint(&system, START, schedule).map(drop).unwrap_err()
    };
    let error = refused(|_, (x, _)| x.y + x.x * 0.2);
    assert!(matches!(error, TangentError::OtherFunction { off, .. } if off > 0.01), "{error}");
    let error = refused(|_, (x, _)| x.y * x.y * 0.5 + x.x + (x.x * 2.0).cos() * 0.1);
    assert!(matches!(error, TangentError::Grazing { .. }), "{error}");
}

/// A loss over runs whose jumps depend on a parameter, and one over runs that switch at a threshold.
#[test]
fn restitutions_and_thresholds_are_fitted() {
    let ball = ball!();
    let times = [0.6, 1.7, 2.5, 3.0];
    let schedule = |e: &Vector1<f64>| floor(e.x, Span::until(3.0).tolerance(1e-10));
    let truth = DormandPrince8.run(
        &ball.at_parameters(vector![RESTITUTION]),
        START,
        schedule(&vector![RESTITUTION]).output_at(times),
    );
    let heights: Vec<f64> = truth.unwrap().states()[1..].iter().map(|s| s.point.x).collect();
    let measured = heights.clone();
    let loss = Loss::of(&ball)
        .starts(&[START])
        .times(&times)
        .term(move |_, k, x: &Vector2<Real>| (x.x - measured[k]) * (x.x - measured[k]))
        .over_each(DormandPrince8, schedule);
    let at = vector![0.85];
    let (_, slope) = loss.gradient_at(&at).unwrap();
    let value = |d: f64| loss.value(&vector![at.x + d]).unwrap();
    // So near that no impact passes a time of a term.
    let d = 2e-4;
    let expected = (8.0 * (value(d) - value(-d)) - (value(2.0 * d) - value(-2.0 * d))) / (12.0 * d);
    assert!((slope.x / expected - 1.0).abs() < 1e-7, "{} {expected}", slope.x);
    let found = loss.minimise(at, 30).unwrap();
    assert!((found.parameters.x - RESTITUTION).abs() < 1e-6, "{found:?}");
    // The same by least squares, of heights with three digits.
    let rows: Vec<_> = heights.iter().map(|x| vector![(x * 1e3).round() / 1e3]).collect();
    let fit = Fit::of(&ball)
        .observe(|x: &Vector2<Real>| vector![x.x])
        .data(&times, &rows)
        .start_at(START)
        .run_each(DormandPrince8, schedule, at)
        .unwrap();
    let error = fit.estimates[0].standard_error;
    assert!((fit.parameters[0] - RESTITUTION).abs() < 4.0 * error && error < 1e-3, "{fit}");

    // A heater that is switched at a threshold θ: x' = y, and y jumps from 1 to −1/2.
    let heated = on_a_line!("threshold", |x, _| x.y * x.y * 0.5);
    let schedule = |t: &Vector1<f64>| -> Schedule {
        let threshold = t.x;
        Span::steps(0.25, 8)
            .event("switch", move |x: &Vector2<f64>| x.x - threshold)
            .rising()
            .jump(|_, x: &Vector2<f64>| vector![x.x, -0.5 * x.y])
            .differentiable(
                |_, (x, t): &Wide| x.x - t.x,
                |_, (x, t): &Wide| (vector![x.x, -x.y * 0.5], *t),
            )
            .into()
    };
    // x(T) = θ − (T − θ)/2.
    let (times, noise) = ([1.5, 1.75, 2.0], [1e-3, -1e-3, 0.5e-3]);
    let rows: Vec<_> =
        times.iter().zip(noise).map(|(t, n)| vector![1.1 - 0.5 * (t - 1.1) + n]).collect();
    let fit = Fit::of(&heated)
        .observe(|x: &Vector2<Real>| vector![x.x])
        .data(&times, &rows)
        .noise(1e-3)
        .start_at(vector![0.0, 1.0])
        .run_each(Gauss::<2>, schedule, vector![0.9])
        .unwrap();
    // Each row has the slope 3/2, so the mean of the noise is 3/2 of the error and the standard error is σ/(1.5 √3).
    let exact = [1.1 + 0.5e-3 / 3.0 / 1.5, 1e-3 / (1.5 * f64::sqrt(3.0))];
    assert!((fit.parameters[0] - exact[0]).abs() < 1e-10, "{fit}");
    assert!((fit.estimates[0].standard_error / exact[1] - 1.0).abs() < 1e-8, "{fit}");
}
