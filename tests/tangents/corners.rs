//! Tangents across corners of the law: against differences of whole runs, against a closed form, and transposed.

use std::fmt;

use metriplectic::integrators::tangent::SmoothFlow;
use metriplectic::integrators::{
    Element, ExplicitRungeKutta, OpenState, Schedule, StepSequence, Tableau, TangentError,
    TangentRun, Unlinearised, Vector as _,
};
use metriplectic::lattices::{Onsager, SiteState};
use metriplectic::prelude::*;
use nalgebra::{DMatrix, DVector, Matrix3, SVector, Vector1, Vector2, Vector3, vector};

use crate::off;

/// Kutta's method of order 3 (1901).
const KUTTA: ExplicitRungeKutta = ExplicitRungeKutta::new(&THREE);
const THREE: Tableau = Tableau::new(
    "Kutta3",
    3,
    &[&[(0, 0.5)], &[(0, -1.0), (1, 2.0)]],
    &[(0, 1.0 / 6.0), (1, 2.0 / 3.0), (2, 1.0 / 6.0)],
);

/// The derivatives of the end of a run along its start, its clock and its parameters, by differences of whole runs. All times of a run
/// move with its clock, and corners stay.
fn differences<S, B, E, M, const P: usize>(
    systems: &Systems<B, P>,
    theta: SVector<f64, P>,
    method: &M,
    (x0, schedule): (&Element<S>, &impl Fn(f64) -> Schedule),
) -> DMatrix<f64>
where
    S: SmoothFlow,
    B: Fn(&SVector<f64, P>) -> Result<S, E>,
    E: fmt::Debug,
    M: Clone + Stepper<S>,
{
    let flow = systems.build(&theta).expect("a system");
    let taken = StepSequence::default();
    let first = method.clone().run(&flow, x0.clone(), schedule(0.0).noting(&taken));
    let first = first.expect("it runs");
    let (reached, span) = (first.last().point.clone(), first.last().time);
    let end = |flow: &S, x: Element<S>, late: f64| {
        let schedule = schedule(late);
        let schedule = if late == 0.0 { schedule.taking(&taken) } else { schedule };
        method.clone().run(flow, x, schedule).expect("it runs").last().point.clone()
    };
    let (sizes, clock) = (flow.sizes(x0), flow.clock().expect("a clock"));
    let largest = (0..sizes.len()).fold(0.0, |most, i| f64::max(most, sizes.get(i)));
    let between = |x: &Element<S>| {
        DVector::from_vec(flow.between(&reached, x).expect("it is near").to_list())
    };
    let quotient = |at: &dyn Fn(f64) -> Element<S>, e: f64| {
        let slope = |e: f64| (between(&at(e)) - between(&at(-e))) / (2.0 * e);
        (slope(e) * 4.0 - slope(2.0 * e)) / 3.0
    };
    let columns = (0..=clock).map(|k| {
        let at = |e: f64| {
            let late = if k == clock { e } else { 0.0 };
            let d = sizes.with(|i| if i == k { e } else { 0.0 });
            end(&flow, flow.moved(x0, &d), late)
        };
        quotient(&at, 1e-4 * if k == clock { span } else { largest })
    });
    let along = (0..P).map(|k| {
        let at = |e: f64| {
            let mut theta = theta;
            theta[k] += e;
            end(&systems.build(&theta).expect("a system"), x0.clone(), 0.0)
        };
        quotient(&at, 1e-4 * theta[k].abs())
    });
    DMatrix::from_columns(&columns.chain(along).collect::<Vec<_>>())
}

/// The columns of a tangent that have differences: those of the point, of the clock and of the parameters.
fn kept<F: SmoothFlow>(flow: &F, run: &TangentRun<F>) -> DMatrix<f64> {
    let (n, found) = (flow.directions(), run.last().matrix());
    let clock = flow.clock().expect("a clock");
    let kept: Vec<usize> = (0..=clock).chain(n..found.ncols()).collect();
    found.select_columns(&kept).rows(0, n).into_owned()
}

/// What a comparison may be off by: derivatives along the point and the parameters, and along the clock of the start. The column of the
/// clock is that of the motion near a corner, and differs from that of the steps by their error.
#[derive(Clone, Copy)]
struct Allowed {
    point: f64,
    clock: f64,
}

/// Compares the tangent of a run with differences of whole runs, in units of each row and column, and the transposed steps with the
/// tangent.
fn compared<S, B, E, M, const P: usize>(
    name: &str,
    (systems, theta): (&Systems<B, P>, SVector<f64, P>),
    method: M,
    (x0, schedule, units): (&Element<S>, &impl Fn(f64) -> Schedule, &[f64]),
    allowed: Allowed,
) where
    S: SmoothFlow,
    B: Fn(&SVector<f64, P>) -> Result<S, E>,
    E: fmt::Debug,
    M: Clone + Stepper<S>,
{
    let system = systems.at(theta).expect("a system");
    let flow: &S = &system;
    let run = method.clone().tangent(&system, x0.clone(), schedule(0.0)).expect("a tangent");
    let plain = method.clone().run(flow, x0.clone(), schedule(0.0)).expect("it runs");
    assert!(plain.last().point == run.last().point, "{name}: the tangent changed the run");
    let (n, clock) = (flow.directions(), flow.clock().expect("a clock"));
    let scaled = |matrix: DMatrix<f64>| {
        let column = |j: usize| units.get(j).filter(|_| j <= clock).copied().unwrap_or(1.0);
        DMatrix::from_fn(n, matrix.ncols(), |i, j| matrix[(i, j)] * column(j) / units[i])
    };
    let expected = scaled(differences(systems, theta, &method, (x0, schedule)));
    let found = scaled(kept(flow, &run));
    for j in 0..found.ncols() {
        let (a, b) = (found.column(j), expected.column(j));
        let error = (a - b).amax() / b.amax();
        let allowed = if j == clock { allowed.clock } else { allowed.point };
        assert!(error < allowed, "{name}, column {j}: {error:.1e}\n{found:.8}\n{expected:.8}");
    }
    // In steps that are taken again.
    let back = method.adjoint_within(3, &system, x0.clone(), schedule(0.0)).expect("an adjoint");
    assert_eq!(back.states().len(), run.states().len(), "{name}");
    let row = |k: usize| DVector::from_fn(n, |i, _| ((1 + i + k) as f64).sin() / units[i]);
    let rows: Vec<_> = (0..back.states().len()).map(row).collect();
    let forward = run.states().iter().zip(&rows).map(|(state, row)| state.derivative_of(row));
    let forward = forward.fold(DVector::zeros(n + P), |sum: DVector<f64>, row| sum + row);
    let gradient = back.pull_back(&rows).expect("a gradient");
    let along = [gradient.along_start(), gradient.along_parameters()];
    let gradient = DVector::from_iterator(n + P, along.iter().flat_map(DVector::iter).copied());
    let of_unit = |row: &DVector<f64>| {
        DVector::from_fn(n + P, |j, _| row[j] * units.get(j).copied().unwrap_or(1.0))
    };
    let transposed = off(
        &DMatrix::from_columns(&[of_unit(&gradient)]),
        &DMatrix::from_columns(&[of_unit(&forward)]),
    );
    println!("{name}: {:.1e}, transposed {transposed:.1e}", off(&found, &expected));
    // Differences of steps have some ten digits.
    assert!(transposed < 2e-8, "{name}: {transposed:e}");
    assert!(run.sensitivity().energy < 1e-8, "{name}: {}", run.sensitivity());
}

/// In units of length `l` and of time `s`: a spring that stiffens at half a unit of time, a push that changes its sign there, and air that
/// thickens and warms at 0.8.
macro_rules! driven {
    ($l:expr, $s:expr) => {{
        let (l, s): (f64, f64) = ($l, $s);
        Systems::new(["stiffer", "push", "friction"], move |t: &Vector3<f64>| {
            let [stiffer, push, friction]: [f64; 3] = (*t).into();
            let energy = l * l / s;
            System::on(Euclidean::<2>)
                .bracket(Symplectic)
                .energy_in_time(move |t: Real, x: &Vector2<Real>| {
                    let (t, x) = (t / s, x / Real::from(l));
                    let k = if t.re < 0.5 { 1.0 } else { stiffer };
                    let wave = x.x.cos() * (t + stiffer).sin() * 0.2;
                    ((x.x * x.x * k + x.y * x.y) * 0.5 - wave) * energy
                })
                .work("push", move |t: Real, x: &Vector2<Real>| {
                    let sign = if t.re / s < 0.5 { 1.0 } else { -1.0 };
                    let wave = (t / s * 2.0 + x.x / l).sin();
                    vector![Real::from(0.0), wave * (push * sign * l / s)]
                })
                .bath(
                    "air",
                    Bath::in_time(move |t: Real| {
                        let t = t / s;
                        (if t.re < 0.8 { Real::from(0.7) } else { t + 0.5 }) * energy
                    })
                    .friction(
                        move |t: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                            let rate = if t.re / s < 0.8 { friction } else { 2.0 * friction };
                            [Contact { rate: Real::from(rate), along: Vector2::<Real>::y() }]
                        },
                    ),
                )
                .build()
        })
    }};
}

const THETA: Vector3<f64> = Vector3::new(2.5, 0.4, 0.3);

/// Steps across one corner and across two, steps that end at corners, and steps that follow a tolerance; a run that begins at a corner and
/// ends at one.
#[test]
fn tangents_of_every_method_cross_corners() {
    for (l, s, is_dimensionless) in [(1.0, 1.0, true), (1e-9, 1e-11, false), (1e11, 1e9, false)] {
        let driven = driven!(l, s);
        let units = [l, l, s, l * l / s, l * l / s, l * l / s, 1.0];
        let x0 = driven.build(&THETA).unwrap().start(vector![l, 0.3 * l]);
        let corners = [0.5 * s, 0.8 * s];
        macro_rules! all {
            ($($method:expr => $order:expr),+ $(,)?) => {$(
                for (h, n) in [(0.7, 2), (0.1, 12)] {
                    let name = format!("{} by {h} in {l:e}", stringify!($method));
                    let span = |late: f64| {
                        Span::steps(h * s, n).starting_at(late).corners(corners)
                    };
                    let clock = 2.0 * f64::powi(h, $order) + 1e-8;
                    let of = (&x0, &span, &units[..]);
                    let allowed = Allowed { point: 1e-8, clock };
                    compared(&name, (&driven, THETA), $method, of, allowed);
                }
            )+};
        }
        all!(WeylMidpoint => 2, DormandPrince8 => 8);
        if is_dimensionless {
            all!(
                Scheme::new(ChartMidpoint).gradient(ItohAbe) => 1,
                Gauss::<3> => 6,
                Radau::<2> => 3,
                DormandPrince5 => 5,
                RungeKuttaChebyshev => 2,
                KUTTA => 3,
            );
        }
        macro_rules! to_a_tolerance {
            ($($method:expr => $tolerance:expr, $clock:expr);+ $(;)?) => {$(
                let name = format!("{} to a tolerance in {l:e}", stringify!($method));
                let span = |late: f64| {
                    let span = Span::until(1.2 * s + late).starting_at(late);
                    span.tolerance($tolerance).corners(corners)
                };
                // Runs from other times choose their own steps.
                let allowed = Allowed { point: 1e-8, clock: $clock };
                compared(&name, (&driven, THETA), $method, (&x0, &span, &units[..]), allowed);
            )+};
        }
        to_a_tolerance!(DormandPrince8 => 1e-11, 1e-7);
        if is_dimensionless {
            to_a_tolerance!(
                DormandPrince5 => 1e-8, 1e-4;
                Gauss::<3> => 1e-8, 1e-4;
                WeylMidpoint => 1e-4, 0.2;
                Radau::<2> => 1e-5, 0.2;
            );
        }
    }
}

/// `q'' = −k q − γ q' + f` with `k`, `f`, `γ` constant between times: a product of exponentials, the columns of `(q, p, 1)`.
struct Linear {
    /// The times at which the law changes, those of the start and of the end among them.
    times: Vec<f64>,
    /// `k`, `f` and `γ` between them.
    laws: Vec<[f64; 3]>,
}

impl Linear {
    fn generator([k, f, friction]: [f64; 3]) -> Matrix3<f64> {
        Matrix3::new(0.0, 1.0, 0.0, -k, -friction, f, 0.0, 0.0, 0.0)
    }

    /// The map from the start to the time of this number.
    fn map(&self, number: usize) -> Matrix3<f64> {
        (0..number).fold(Matrix3::identity(), |map, k| {
            (Self::generator(self.laws[k]) * (self.times[k + 1] - self.times[k])).exp() * map
        })
    }

    /// The derivative of the state at the time of this number, which moves with the start if it is the end, along `q₀`, `p₀` and the
    /// time of the start.
    fn columns(&self, x0: Vector3<f64>, number: usize) -> DMatrix<f64> {
        let map = self.map(number);
        let mut late = -map * Self::generator(self.laws[0]) * x0;
        if number + 1 == self.times.len() {
            late += Self::generator(self.laws[number - 1]) * map * x0;
        }
        DMatrix::from_fn(2, 3, |i, j| if j < 2 { map[(i, j)] } else { late[i] })
    }
}

#[test]
fn a_driven_oscillator_has_the_derivatives_of_its_closed_form() {
    let times = [0.3, 0.7, 0.75];
    let system = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy_in_time(move |t: Real, x: &Vector2<Real>| {
            // The law of the time of a corner is that before it, or that behind it.
            let k = if t.re <= times[0] { 1.0 } else { 4.0 };
            (x.x * x.x * k + x.y * x.y) * 0.5
        })
        .work("push", move |t: Real, _: &Vector2<Real>| {
            vector![0.0.into(), if t.re < times[1] { Real::from(0.5) } else { Real::from(-0.3) }]
        })
        .bath(
            "air",
            Bath::at(0.7).friction(move |t: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                let rate = if t.re < times[2] { 0.2 } else { 0.9 };
                [Contact { rate: Real::from(rate), along: Vector2::<Real>::y() }]
            }),
        )
        .build()
        .unwrap();
    let linear = Linear {
        times: vec![0.0, times[0], times[1], times[2], 1.0],
        laws: vec![[1.0, 0.5, 0.2], [4.0, 0.5, 0.2], [4.0, -0.3, 0.2], [4.0, -0.3, 0.9]],
    };
    // At rest, and in motion.
    for start in [[1.0, 0.3], [0.0, 0.0]] {
        let x0 = Vector3::new(start[0], start[1], 1.0);
        let (map, expected) = (linear.map(4), linear.columns(x0, 4));
        // The work of the jump at 0.3 is 3 q²/2, and no other is done by the time.
        let (at_jump, slopes) = (linear.map(1) * x0, linear.columns(x0, 1));
        let of_work = DVector::from_fn(3, |j, _| 3.0 * at_jump.x * slopes[(0, j)]);
        let check = |name: &str, schedule: Schedule, allowed: f64| {
            let x = system.start(vector![start[0], start[1]]);
            let run = DormandPrince8.tangent(&system, x, schedule).expect("a tangent");
            let last = run.last();
            let end = map * x0;
            let error = (last.point.x - vector![end.x, end.y]).amax();
            let of_point = off(&last.matrix().view((0, 0), (2, 3)).into_owned(), &expected);
            let work = (last.parameter_work_along().rows(0, 3) - &of_work).amax();
            println!("{name} from {start:?}: {error:.1e}, {of_point:.1e}, {work:.1e}");
            assert!(error.max(of_point).max(work) < allowed, "{name}");
            // The heat leaves at 0.7, and all energy is accounted for: dH T = dW + dQ.
            let (heat, entropy) = (last.heat_along("air"), last.bath_entropy_along("air"));
            let (heat, entropy) = (heat.unwrap(), entropy.unwrap());
            let off_heat = (entropy * 0.7 + &heat).rows(0, 3).amax();
            assert!(off_heat < 1e-9, "{name}: {off_heat:e}");
            assert!(run.sensitivity().energy < 1e-9, "{name}: {}", run.sensitivity());
        };
        let mut corners = times.to_vec();
        for (h, count) in [(0.1, 10), (0.05, 20), (0.04, 25)] {
            let span = Span::steps(h, count).corners(corners.clone());
            check(&format!("by {h}"), span, 1e-9);
        }
        check("to 1e-12", Span::until(1.0).tolerance(1e-12).corners(corners.clone()), 1e-9);
        // The start and the end are corners too.
        corners.extend([0.0, 1.0]);
        check("by 0.1 with its ends", Span::steps(0.1, 10).corners(corners.clone()), 1e-9);
        check("to 1e-12 with its ends", Span::until(1.0).tolerance(1e-12).corners(corners), 1e-9);
    }
}

/// Outputs before a corner, at it and behind it, in steps of one size and to a tolerance: each is the end of a run to its time.
#[test]
fn outputs_beside_corners_have_derivatives() {
    let driven = driven!(1.0, 1.0);
    let system = driven.at(THETA).unwrap();
    let x0 = system.start(vector![1.0, 0.3]);
    let corners = [0.5, 0.8];
    let outputs = [0.3, 0.5, 0.6, 0.8, 0.95, 1.1];
    for schedule in [
        Schedule::from(Span::steps(0.15, 8)),
        Span::steps(0.05, 24).into(),
        Span::steps(0.6, 2).into(),
        Span::until(1.2).tolerance(1e-11).into(),
    ] {
        let schedule = schedule.corners(corners);
        let asked = schedule.clone().output_at(outputs);
        let run = DormandPrince8.tangent(&system, x0.clone(), asked.clone()).unwrap();
        let plain = DormandPrince8.run(&*system, x0.clone(), asked.clone()).unwrap();
        let back = DormandPrince8.adjoint_within(2, &system, x0.clone(), asked).unwrap();
        let count = run.states().len();
        assert!(count == plain.states().len() && count == back.states().len());
        for (k, time) in outputs.into_iter().enumerate() {
            let to_it = Span::until(time).tolerance(1e-12).corners(corners);
            let whole = DormandPrince8.tangent(&system, x0.clone(), to_it).unwrap();
            let [state, whole] = [&run.states()[k + 1], whole.last()];
            assert!(state.time.to_bits() == time.to_bits());
            // A state at a corner has the law of its time.
            let error = off(&state.matrix(), &whole.matrix());
            let ledger = |x: &OpenState<Vector2<f64>>| x.ledger.parameter_work();
            let work = (ledger(&state.point) - ledger(&whole.point)).abs();
            let of_run = (ledger(&plain.states()[k + 1].point) - ledger(&whole.point)).abs();
            println!("at {time}: {error:.1e}, {work:.1e}, {of_run:.1e}");
            assert!(error < 1e-6 && work < 1e-6 && of_run < 1e-6, "at {time}");
            let mut rows = vec![DVector::zeros(state.matrix().nrows()); count];
            rows[k + 1][0] = 1.0;
            let gradient = back.pull_back(&rows).unwrap();
            let forward = state.derivative_of(&rows[k + 1]);
            let along = gradient.along_start();
            let transposed = (forward.rows(0, along.len()) - along).amax();
            assert!(transposed < 1e-8 * forward.amax(), "at {time}: {transposed:e}");
        }
    }
}

/// A ball that falls in a wind that turns at 0.4: it bounces before the corner or after it, in the step of the corner too, and the run
/// stops at a height. Differences are those of runs that find their own times.
#[test]
fn events_beside_corners_have_derivatives() {
    const RESTITUTION: f64 = 0.9;
    let falling = |turn: f64| {
        Systems::new(["gravity"], move |t: &Vector1<f64>| {
            let gravity = t.x;
            System::on(Euclidean::<2>)
                .bracket(Symplectic)
                .energy_in_time(move |t: Real, x: &Vector2<Real>| {
                    let heavier = if t.re < turn { gravity } else { gravity * 1.4 };
                    x.y * x.y * 0.5 + x.x * heavier
                })
                .work("wind", move |t: Real, x: &Vector2<Real>| {
                    let sign = if t.re < turn { 0.3 } else { -0.2 };
                    vector![Real::from(0.0), (t + x.x).sin() * sign]
                })
                .build()
        })
    };
    type Ball = (Vector2<Real>, Vec<Real>);
    let bounce = |schedule: Schedule| -> Schedule {
        schedule
            .event("floor", |s: &OpenState<Vector2<f64>>| s.x.x)
            .falling()
            .jump(|_, s: &OpenState<Vector2<f64>>| s.at(vector![s.x.x, -RESTITUTION * s.x.y]))
            .differentiable(
                |_, (x, _): &Ball| x.x,
                |_, (x, theta): &Ball| (vector![x.x, -x.y * RESTITUTION], theta.clone()),
            )
            .into()
    };
    let theta = vector![1.3];
    // The ball reaches the floor at 0.79 or so.
    for turn in [0.4, 0.77, 0.9] {
        let systems = falling(turn);
        let x0 = systems.build(&theta).unwrap().start(vector![0.5, 0.1]);
        let units = [1.0; 5];
        let of = |span: &dyn Fn(f64) -> Schedule, name: &str| {
            let span = |late: f64| bounce(span(late).corners([turn]));
            let name = format!("{name}, turned at {turn}");
            let allowed = Allowed { point: 1e-6, clock: 1e-6 };
            compared(&name, (&systems, theta), DormandPrince8, (&x0, &span, &units), allowed);
        };
        of(&|late| Span::steps(0.05, 24).starting_at(late).into(), "by 0.05");
        of(&|late| Span::steps(0.15, 8).starting_at(late).into(), "by 0.15");
        of(&|late| Span::until(1.2 + late).starting_at(late).tolerance(1e-11).into(), "to 1e-11");
    }
    // The time at which a run stops behind a corner.
    let systems = falling(0.4);
    let system = systems.at(theta).unwrap();
    let stop = |schedule: Schedule| -> Schedule {
        schedule
            .corners([0.4])
            .event("floor", |s: &OpenState<Vector2<f64>>| s.x.x)
            .stop()
            .differentiable(|_, (x, _): &Ball| x.x)
            .into()
    };
    for schedule in [Schedule::from(Span::steps(0.3, 8)), Span::until(2.0).tolerance(1e-11).into()]
    {
        let x0 = |q: f64| system.start(vector![q, 0.1]);
        let run = DormandPrince8.adjoint(&system, x0(0.5), stop(schedule.clone())).unwrap();
        let found = run.gradient_of_end().unwrap().along_start()[0];
        let end = |q: f64| {
            DormandPrince8.run(&*system, x0(q), stop(schedule.clone())).unwrap().last().time
        };
        let slope = |e: f64| (end(0.5 + e) - end(0.5 - e)) / (2.0 * e);
        let expected = (4.0 * slope(1e-4) - slope(2e-4)) / 3.0;
        println!("stops: {found} and {expected}");
        assert!((found - expected).abs() < 1e-6 * expected.abs());
    }
}

/// An event that lies at a corner leaves it on one side or on the other.
#[test]
fn an_event_at_a_corner_has_no_derivative_if_it_moves() {
    let pushed = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5)
        .work("push", |t: Real, _: &Vector2<Real>| {
            vector![0.0.into(), if t.re < 0.5 { Real::from(0.0) } else { Real::from(1.0) }]
        })
        .build()
        .unwrap();
    let x0 = || pushed.start(vector![-0.5, 1.0]);
    for span in [Schedule::from(Span::steps(0.2, 5)), Span::until(1.0).tolerance(1e-9).into()] {
        let span = span.corners([0.5]);
        // The particle is at zero at the corner, up to its rounding.
        let kicked = span
            .event("zero", |s: &OpenState<Vector2<f64>>| s.x.x)
            .jump(|_, s: &OpenState<Vector2<f64>>| s.at(vector![s.x.x, s.x.y + 1.0]))
            .differentiable(
                |_, x: &Vector2<Real>| x.x,
                |_, x: &Vector2<Real>| vector![x.x, x.y + 1.0],
            );
        let error = DormandPrince8.tangent(&pushed, x0(), kicked.clone()).unwrap_err();
        assert!(matches!(error, TangentError::EventAtCorner { .. }), "{error}");
        assert!(error.to_string().contains("lies at a corner"), "{error}");
        let error = DormandPrince8.adjoint(&pushed, x0(), kicked).unwrap_err();
        assert!(matches!(error, TangentError::EventAtCorner { .. }), "{error}");
    }
}

/// A corner stays where it is named: a law that changes at a time which depends on a parameter is refused.
#[test]
fn a_corner_that_moves_with_a_parameter_is_refused() {
    for (what, in_energy, scale) in
        [("energy", true, 1.0), ("port", false, 1.0), ("small energy", true, 1e-6)]
    {
        let switched = Systems::new(["friction", "time"], move |t: &Vector2<f64>| {
            let (friction, time) = (t.x, t.y);
            System::on(Euclidean::<2>)
                .bracket(Symplectic)
                .energy_in_time(move |t: Real, x: &Vector2<Real>| {
                    let k = if in_energy && t.re >= time { 1.0 + scale } else { 1.0 };
                    (x.x * x.x * k + x.y * x.y) * 0.5
                })
                .work("push", move |t: Real, _: &Vector2<Real>| {
                    let on = !in_energy && t.re >= time;
                    vector![0.0.into(), if on { Real::from(scale) } else { 0.0.into() }]
                })
                .bath(
                    "air",
                    Bath::at(0.7).friction(move |_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                        [Contact { rate: Real::from(friction), along: Vector2::<Real>::y() }]
                    }),
                )
                .build()
        });
        let system = switched.at(vector![0.3, 0.5]).unwrap();
        let x0 = system.start(vector![1.0, 0.3]);
        for span in [Schedule::from(Span::steps(0.2, 5)), Span::until(1.0).tolerance(1e-9).into()] {
            let error = DormandPrince8.tangent(&system, x0.clone(), span.corners([0.5]));
            let error = error.unwrap_err();
            let cause = Unlinearised::MovingCorner { name: "time" };
            let is_named = matches!(&error, TangentError::NotLinearised { cause: found, .. } if *found == cause);
            assert!(is_named, "{what}: {error}");
            assert!(error.to_string().contains("names its own corner"), "{error}");
        }
    }
}

/// Open lattices, systems with noise, and closed systems, whose corners only end steps.
#[test]
fn tangents_of_every_kind_of_system_cross_corners() {
    let ring = Systems::new(["torque"], |t: &Vector1<f64>| {
        let torque = t.x;
        let ring = Lattice::on(Graph::ring(3), LieDual::so3())
            .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
            .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
            .bond_onsager(|bond| {
                let [u, v] = bond.w;
                [Onsager { rate: 0.1, b: [u.cross(v), v.cross(u)] }]
            })
            .build()?
            .opened()
            .work("torque", [0], move |t, _, p: &Vector3<f64>| {
                p.cross(&vector![0.0, if t < 0.5 { torque } else { -2.0 * torque }, 0.0])
            })
            .bath("air", 1.0, [1], |t, _: &SiteState<'_, LieDual<3>>| {
                [Onsager { rate: if t < 0.5 { 0.1 } else { 0.3 }, b: vector![0.0, 1.0, 0.0] }]
            });
        Ok::<_, Error>(ring)
    });
    let theta = vector![0.4];
    let lattice = ring.build(&theta).unwrap();
    let points = lattice.lattice().points(|site| vector![0.4 + 0.1 * site as f64, -1.0, 0.3]);
    let x0 = lattice.start(points);
    let units = [1.0; 14];
    let span = |late: f64| Span::steps(0.12, 8).starting_at(late).corners([0.5]);
    let allowed = Allowed { point: 1e-7, clock: 1e-6 };
    compared("lattice, 8", (&ring, theta), DormandPrince8, (&x0, &span, &units), allowed);
    let allowed = Allowed { point: 1e-7, clock: 0.1 };
    compared("lattice, Weyl", (&ring, theta), WeylMidpoint, (&x0, &span, &units), allowed);

    let body = Family::on(LieDual::so3())
        .parameters(["inertia", "friction"])
        .energy(|p: &Vector3<Real>, t: &Vector2<Real>| {
            p.x * p.x * t.x + p.y * p.y + p.z * p.z * 1.5
        })
        .entropy(|p: &Vector3<Real>, t: &Vector2<Real>| p.norm_squared() * t.y)
        .build()
        .unwrap();
    let system = body.at(vector![0.5, 0.2]);
    let start = vector![0.4, -1.0, 0.3];
    macro_rules! closed {
        ($($method:expr),+) => {$(
            for span in [Schedule::from(Span::steps(0.05, 40)), Span::until(2.0).tolerance(1e-6).into()] {
                let schedule = span.corners([0.32, 0.34, 1.0]).output_at([0.32, 0.4, 2.0]);
                let run = $method.tangent(&system, start, schedule.clone()).expect("a tangent");
                let plain = $method.run(&system, start, schedule.clone()).expect("it runs");
                assert!(plain.last().point == run.last().point);
                let back = $method.adjoint_within(3, &system, start, schedule.clone()).unwrap();
                let row = |k: usize| DVector::from_fn(3, |i, _| ((1 + i + k) as f64).sin());
                let rows: Vec<_> = (0..back.states().len()).map(row).collect();
                let forward = run.states().iter().zip(&rows).map(|(state, row)| state.derivative_of(row));
                let forward = forward.fold(DVector::zeros(5), |sum: DVector<f64>, row| sum + row);
                let gradient = back.pull_back(&rows).expect("a gradient");
                let along = [gradient.along_start(), gradient.along_parameters()];
                let gradient = DVector::from_iterator(5, along.iter().flat_map(DVector::iter).copied());
                let transposed = (gradient - &forward).amax() / forward.amax();
                // Whole steps to the same ends: the derivative of the motion does not see corners.
                let fine = $method.tangent(&system, start, Span::steps(0.002, 1000)).unwrap();
                let error = off(&run.last().matrix(), &fine.last().matrix());
                println!("{}: transposed {transposed:.1e}, {error:.1e}, {}", stringify!($method), run.sensitivity());
                assert!(transposed < 1e-13 && run.sensitivity().energy < 1e-12 && error < 5e-2);
            }
        )+};
    }
    closed!(
        WeylMidpoint,
        Gauss::<2>,
        Radau::<2>,
        DormandPrince5,
        DormandPrince8,
        RungeKuttaChebyshev,
        KUTTA
    );
}

/// A path with noise has the tangent of its own random numbers on both sides of a corner.
#[test]
fn paths_with_noise_cross_corners() {
    let system = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
        .work("push", |t: Real, _: &Vector2<Real>| {
            vector![0.0.into(), if t.re < 0.25 { Real::from(0.5) } else { Real::from(-2.0) }]
        })
        .bath(
            "air",
            Bath::at(0.7).friction(|t: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                let rate = if t.re < 0.25 { 0.2 } else { 0.9 };
                [Contact { rate: Real::from(rate), along: Vector2::<Real>::y() }]
            }),
        )
        .noise(Boltzmann(1.0))
        .build()
        .unwrap();
    let method = RandomFlow(DormandPrince5).seed(3);
    for (h, count) in [(0.1, 5), (0.05, 10)] {
        let span = Span::steps(h, count).corners([0.25]);
        let x0 = |q: f64, p: f64| system.flow().start(vector![q, p]);
        let run = method.tangent(&system, x0(1.0, 0.3), span.clone()).unwrap();
        let end =
            |q: f64, p: f64| method.run(&system, x0(q, p), span.clone()).unwrap().last().point.x;
        assert!(run.last().point.x == end(1.0, 0.3));
        let found = run.last().matrix().view((0, 0), (2, 2)).into_owned();
        let e = 1e-4;
        let columns = [
            (end(1.0 + e, 0.3) - end(1.0 - e, 0.3)) / (2.0 * e),
            (end(1.0, 0.3 + e) - end(1.0, 0.3 - e)) / (2.0 * e),
        ];
        let expected = DMatrix::from_fn(2, 2, |i, j| columns[j][i]);
        println!("noise by {h}: {:.1e}", off(&found, &expected));
        assert!(off(&found, &expected) < 1e-7);
    }
}

/// A spring that stiffens and a push that turns at a switch are fitted from positions, and so is the time of the switch, over schedules that
/// name it. Both are differences of runs.
#[test]
fn fits_and_losses_cross_corners() {
    let spring = |t: &Vector3<f64>| {
        let [stiffness, push, time]: [f64; 3] = (*t).into();
        System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy_in_time(move |t: Real, x: &Vector2<Real>| {
                let stiffness = if t.re < time { 1.0 } else { stiffness };
                (x.y * x.y + x.x * x.x * stiffness) * 0.5
            })
            .work("push", move |t: Real, _: &Vector2<Real>| {
                vector![0.0.into(), Real::from(if t.re < time { push } else { -push })]
            })
            .build()
    };
    let (truth, guess) = (vector![4.0, 0.3, 0.5], vector![3.8, 0.28, 0.51]);
    let times = [0.4, 0.55, 0.8, 1.3, 2.0];
    for span in [Schedule::from(Span::steps(0.05, 40)), Span::until(2.0).tolerance(1e-10).into()] {
        let over = {
            let span = span.clone();
            move |t: &Vector3<f64>| span.clone().corners([t.z])
        };
        let system = spring(&truth).unwrap();
        let start = || system.start(vector![1.0, 0.0]);
        let run = DormandPrince8.run(&system, start(), over(&truth).output_at(times)).unwrap();
        let rows: Vec<Vector2<f64>> = run.states()[1..].iter().map(|s| s.point.x).collect();
        let fit = Fit::of_systems(["stiffness", "push", "time"], spring)
            .observe(|s: &OpenState<Vector2<f64>>| s.x)
            .data(&times, &rows)
            .noise(1e-3)
            .start_at(start())
            .run_each(DormandPrince8, over, guess)
            .expect("a fit");
        let found = Vector3::from_column_slice(&fit.parameters);
        println!("fit: {:.1e}", (found - truth).amax());
        assert!((found - truth).amax() < 1e-5, "{fit}");

        // The switch stays at its time.
        let named = |t: &Vector2<f64>| spring(&vector![t.x, t.y, 0.5]);
        let at_end = |s: &OpenState<Vector2<f64>>| s.x.x;
        let loss = metriplectic::fitting::Loss::of_systems(["stiffness", "push"], named)
            .starts(&[start()])
            .times(&[2.0])
            .term(|_, _, s| at_end(s))
            .over(DormandPrince8, span.clone().corners([0.5]));
        let (_, slope) = loss.gradient_at(&vector![4.0, 0.3]).expect("a gradient");
        let systems = Systems::new(["stiffness", "push"], named);
        let member = systems.at(vector![4.0, 0.3]).unwrap();
        let back = DormandPrince8.adjoint(&member, start(), span.corners([0.5])).unwrap();
        let last = back.states().len() - 1;
        let zero = Real::from(0.0);
        let gradient = back.gradient(|k, x: &Vector2<Real>| if k == last { x.x } else { zero });
        let along = gradient.expect("a gradient").along_parameters();
        let error = (Vector2::from_column_slice(along.as_slice()) - slope).amax();
        println!("loss: {error:.1e}");
        assert!(error < 1e-7 * slope.amax(), "{along} {slope}");
    }
}
