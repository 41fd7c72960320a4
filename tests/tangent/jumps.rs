//! Events at which the state jumps, by the saltation matrix.

use metriplectic::dynamics::Parametrised as _;
use metriplectic::integrators::{LinearisedAlong, Schedule, TangentError, TangentRun};
use metriplectic::prelude::*;
use nalgebra::{Vector1, vector};

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

macro_rules! ball {
    () => {
        Family::on(Euclidean::<2>)
            .parameters(["restitution"])
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>, _: &Vector1<Real>| {
                x.y * x.y * 0.5 + x.x + (x.x * 2.0).cos() * 0.1
            })
            .build()
            .unwrap()
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
    let particle = Family::on(Euclidean::<2>)
        .parameters(["restitution"])
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>, _: &Vector1<Real>| x.y * x.y * 0.5)
        .build()
        .unwrap();
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
