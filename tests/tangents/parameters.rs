//! Derivatives along parameters of systems of any kind: against differences of whole runs in the same steps, and against a family.

use std::fmt;

use metriplectic::equations::{Equations, Sizes};
use metriplectic::integrators::tangent::SmoothFlow;
use metriplectic::integrators::{
    Element, Entries, FromEquations, OpenState, Schedule, SystemAt, TangentError, Unlinearised,
    Vector as _,
};
use metriplectic::lattices::{Onsager, SiteState};
use metriplectic::prelude::*;
use nalgebra::{DMatrix, DVector, SVector, Vector1, Vector2, Vector3, vector};

use crate::off;

/// The differences of the ends of runs along parameters, one column each.
fn differences<S: SmoothFlow, const P: usize>(
    flow: &S,
    end: &Element<S>,
    theta: &SVector<f64, P>,
    step: f64,
    last: impl Fn(&SVector<f64, P>) -> Element<S>,
) -> DMatrix<f64> {
    let columns = (0..P).map(|k| {
        let at = |e: f64| {
            let mut theta = *theta;
            theta[k] += e;
            DVector::from_vec(flow.between(end, &last(&theta)).expect("it is near").to_list())
        };
        let slope = |e: f64| (at(e) - at(-e)) / (2.0 * e);
        let e = step * theta[k].abs();
        (slope(e) * 4.0 - slope(2.0 * e)) / 3.0
    });
    DMatrix::from_columns(&columns.collect::<Vec<_>>())
}

/// Compares the derivatives along parameters with differences of whole runs of fixed steps, and the transposed steps with the tangent.
fn compared<S, B, E, M, const P: usize>(
    name: &str,
    systems: &Systems<B, P>,
    theta: SVector<f64, P>,
    method: M,
    (start, span): (impl Fn(&S) -> Element<S>, Span),
) where
    S: SmoothFlow,
    B: Fn(&SVector<f64, P>) -> Result<S, E>,
    E: fmt::Debug,
    M: Clone + Stepper<S>,
{
    let system = systems.at(theta).expect("a system");
    let build = |theta: &SVector<f64, P>| systems.build(theta).expect("a system");
    compared_by_hand(name, (system, systems.names()), (theta, build), method, (start, span));
}

/// The same, with the runs of systems that are built by hand.
pub(crate) fn compared_by_hand<S, R, M, const P: usize>(
    name: &str,
    (system, names): (SystemAt<'_, S>, &[&str; P]),
    (theta, build): (SVector<f64, P>, impl Fn(&SVector<f64, P>) -> R),
    method: M,
    (start, span): (impl Fn(&R) -> Element<R>, Span),
) where
    S: SmoothFlow,
    R: SmoothFlow<Space = S::Space>,
    M: Clone + Stepper<S> + Stepper<R>,
{
    let flow: &S = &system;
    let by_hand = build(&theta);
    let x0 = start(&by_hand);
    let run = method.clone().tangent(&system, x0.clone(), span).expect("a tangent");
    let plain = method.clone().run(&by_hand, x0.clone(), span).expect("it runs");
    let same = method.clone().run(&system, x0.clone(), span).expect("it runs");
    assert!(plain.states() == same.states(), "{name}: it is not the system by hand");
    assert!(plain.last().point == run.last().point, "{name}: the tangent changed the run");
    assert!(same.certificate().keeps_energy(), "{name}: {}", same.certificate());
    let last = |theta: &SVector<f64, P>| {
        let system = build(theta);
        let run = method.clone().run(&system, start(&system), span).expect("it runs");
        run.last().point.clone()
    };
    let expected = differences(flow, &run.last().point, &theta, 2e-5, last);
    let found = run.last().along_parameters();
    let error = off(&found, &expected);
    for (k, name) in names.iter().enumerate() {
        assert_eq!(run.last().along(name), Some(found.column(k).into_owned()));
    }
    // The costate goes back through the same steps.
    let back = method.adjoint(&system, x0, span).expect("an adjoint");
    let n = found.nrows();
    let row = DVector::from_fn(n, |i, _| (1.0 + i as f64).sin());
    let mut rows = vec![DVector::zeros(n); back.states().len()];
    rows[back.states().len() - 1] = row.clone();
    let gradient = back.pull_back(&rows).expect("a gradient");
    let forward = run.last().derivative_of(&row);
    let transposed = (gradient.along_parameters() - forward.rows(forward.len() - P, P)).amax();
    println!("{name}: {error:.1e}, transposed {transposed:.1e}, {}", run.sensitivity());
    assert!(expected.amax() > 1e-3, "{name}: nothing depends on the parameters");
    assert!(error < 1e-7, "{name}: {error:e}\n{found:.9}\n{expected:.9}");
    assert!(transposed < 1e-7 * forward.amax(), "{name}: {transposed:e}");
    assert!(run.sensitivity().energy < 1e-8, "{name}: {}", run.sensitivity());
}

/// A body with the moments of inertia in its energy, a torque of some strength, and air of some temperature and friction.
macro_rules! open_body {
    ($t:expr) => {{
        let [inertia, torque, temperature, friction]: [f64; 4] = (*$t).into();
        System::on(LieDual::so3())
            .energy_in_time(move |t: Real, p: &Vector3<Real>| {
                p.x * p.x * inertia + p.y * p.y + p.z * p.z * 1.5 + p.x * t.sin()
            })
            .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
            .work("torque", move |t: Real, p: &Vector3<Real>| {
                p.cross(&vector![Real::from(0.0), t.sin() * torque, Real::from(0.0)])
            })
            .bath("air", Bath::at(temperature).isotropic(friction))
    }};
}
pub(crate) use open_body;

pub(crate) const START: Vector3<f64> = Vector3::new(0.4, -1.0, 0.3);
pub(crate) const BODY: [&str; 4] = ["inertia", "torque", "temperature", "friction"];
pub(crate) const THETA: Vector4<f64> = Vector4::new(0.5, 0.4, 1.2, 0.1);

#[test]
fn states_and_ledgers_of_open_systems_have_derivatives_along_parameters() {
    let body = Systems::new(BODY, |t: &Vector4<f64>| open_body!(t).build());
    macro_rules! all {
        ($($method:expr),+) => {$(
            let span = Span::steps(0.1, 20);
            compared(stringify!($method), &body, THETA, $method, (|s| s.start(START), span));
        )+};
    }
    all!(
        WeylMidpoint,
        Scheme::new(WeylMidpoint).gradient(ItohAbe),
        Gauss::<2>,
        DormandPrince5,
        DormandPrince8
    );
    // The work, the heat and the entropy of the bath by their names.
    let system = body.at(THETA).unwrap();
    let run = DormandPrince8.tangent(&system, system.start(START), Span::steps(0.1, 20)).unwrap();
    let matrix = run.last().along_parameters();
    let ledger = matrix.rows(matrix.nrows() - 4, 4).into_owned();
    let booked = [
        run.last().parameter_work_along(),
        run.last().work_along("torque").unwrap(),
        run.last().heat_along("air").unwrap(),
        run.last().bath_entropy_along("air").unwrap(),
    ];
    for (k, row) in booked.iter().enumerate() {
        assert_eq!(row.rows(row.len() - 4, 4).into_owned(), ledger.row(k).transpose(), "{k}");
        assert!(row.rows(row.len() - 4, 4).iter().all(|slope| slope.abs() > 1e-4), "{k}: {row}");
    }
}

#[test]
fn noise_has_derivatives_along_parameters() {
    let noisy = Systems::new(["inertia", "friction"], |t: &Vector2<f64>| {
        let (inertia, friction) = (t.x, t.y);
        System::on(LieDual::so3())
            .energy(move |p: &Vector3<Real>| p.x * p.x * inertia + p.y * p.y + p.z * p.z * 1.5)
            .entropy(move |p: &Vector3<Real>| p.norm_squared() * friction)
            .noise(Boltzmann(0.1))
            .build()
    });
    let span = Span::steps(0.02, 30);
    let theta = vector![0.5, 0.4];
    compared("noise", &noisy, theta, RandomFlow(WeylMidpoint).seed(1), (|_| START, span));
    let sampler = NinomiyaVictoir(WeylMidpoint).seed(2);
    compared("noise of order 2", &noisy, theta, sampler, (|_| START, span));
    let body = Systems::new(BODY, |t: &Vector4<f64>| open_body!(t).noise(Boltzmann(0.1)).build());
    let method = RandomFlow(DormandPrince5).seed(3);
    compared("open noise", &body, THETA, method, (|s| s.flow().start(START), span));
}

#[test]
fn lattices_have_derivatives_along_parameters() {
    let rod = |conduction: f64| {
        Lattice::on(Graph::chain(4), Euclidean::<1>)
            .energy(|u: &Vector1<Real>| u.x)
            .entropy(|u: &Vector1<Real>| u.x.ln())
            .bond_onsager(move |bond| {
                let [u, v] = bond.x.map(|u| u.x);
                [Onsager { rate: conduction * u * v, b: [vector![1.0], vector![-1.0]] }]
            })
            .build()
    };
    let rods = Systems::new(["conduction"], |t: &Vector1<f64>| rod(t.x));
    let warm = |site: usize| vector![1.0 + 0.2 * site as f64];
    let (theta, span) = (vector![0.3], Span::steps(0.1, 10));
    compared("lattice, 8", &rods, theta, DormandPrince8, (|rod| rod.points(warm), span));
    compared("lattice, Gauss", &rods, theta, Gauss::<2>, (|rod| rod.points(warm), span));
    let open = Systems::new(["conduction", "temperature"], |t: &Vector2<f64>| {
        let temperature = t.y;
        Ok::<_, LatticeError>(rod(t.x)?.opened().bath(
            "hot",
            temperature,
            [0],
            move |_, at: &SiteState<'_, Euclidean<1>>| {
                [Onsager { rate: temperature * at.x.x, b: vector![1.0] }]
            },
        ))
    });
    let (theta, span) = (vector![0.3, 2.0], Span::steps(0.05, 10));
    let start = |rod: &_| started(rod, warm);
    compared("open lattice, 8", &open, theta, DormandPrince8, (start, span));
    compared("open lattice, Weyl", &open, theta, WeylMidpoint, (start, span));
    let noisy = Systems::new(["conduction"], |t: &Vector1<f64>| {
        rod(t.x).map(|rod| rod.with_noise(Boltzmann(0.01)))
    });
    let (theta, method) = (vector![0.3], RandomFlow(DormandPrince5).seed(3));
    let span = Span::steps(0.02, 20);
    compared("noisy lattice", &noisy, theta, method, (|rod| rod.flow().points(warm), span));
}

/// The start of an open lattice.
fn started<P: metriplectic::lattices::model::Model<Manifold = Euclidean<1>>>(
    lattice: &OpenLattice<P>,
    at: impl Fn(usize) -> Vector1<f64>,
) -> Element<OpenLattice<P>> {
    lattice.start(lattice.lattice().points(at))
}

/// Parameters of any size: a mass on a spring in air, in units of a length.
#[test]
fn parameters_have_any_size() {
    for unit in [1.0, 1e-20, 1e11] {
        let damped = Systems::new(["stiffness", "friction", "push"], |t: &Vector3<f64>| {
            let [stiffness, friction, push]: [f64; 3] = (*t).into();
            System::on(Euclidean::<2>)
                .bracket(Symplectic)
                .energy(move |x: &Vector2<Real>| (x.x * x.x * stiffness + x.y * x.y) * 0.5)
                .work("push", move |t: Real, _: &Vector2<Real>| {
                    vector![Real::from(0.0), t.sin() * push]
                })
                .bath(
                    "air",
                    Bath::at(0.7).friction(move |_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                        [Contact { rate: friction.into(), along: vector![0.0.into(), 1.0.into()] }]
                    }),
                )
                .build()
        });
        let theta = vector![1.5, 0.2, 0.4 * unit];
        let system = damped.at(theta).unwrap();
        let start = |s: &_| at_rest(s, unit);
        let schedule = || Span::until(6.0).tolerance(1e-12);
        let run = DormandPrince8.tangent(&system, start(&*system), schedule()).unwrap();
        // By hand: x = x_h + x_p with x_p = a sin t + b cos t.
        let exact = |t: &Vector3<f64>, time: f64| {
            let [k, c, f]: [f64; 3] = (*t).into();
            let scale = f / ((k - 1.0).powi(2) + c * c);
            let (a, b) = ((k - 1.0) * scale, -c * scale);
            let (rate, fall) = ((k - 0.25 * c * c).sqrt(), 0.5 * c);
            let (x, v) = (unit - b, -a);
            let ((sine, cosine), decay) = ((rate * time).sin_cos(), (-fall * time).exp());
            decay * (x * cosine + (v + fall * x) / rate * sine) + a * time.sin() + b * time.cos()
        };
        let found = run.last().along_parameters();
        for k in 0..3 {
            let at = |e: f64| {
                let mut theta = theta;
                theta[k] *= 1.0 + e;
                exact(&theta, 6.0)
            };
            let slope = ((at(1e-3) - at(-1e-3)) * 8.0 - at(2e-3) + at(-2e-3)) / 12e-3;
            let off = (found[(0, k)] * theta[k] - slope).abs() / unit;
            println!("{unit:e}, {k}: {off:.1e}");
            assert!(off < 2e-9 && slope.abs() > 1e-4 * unit, "{off:e}");
        }
    }
}

/// A body that slows down by a millionth in each unit of time, and an oscillator that hardly feels its air: by hand.
#[test]
fn a_parameter_that_moves_little_has_as_many_digits() {
    for friction in [1e-2, 1e-4, 1e-6, 1e-8] {
        let damped = Systems::new(["friction"], |t: &Vector1<f64>| {
            let friction = t.x;
            System::on(Euclidean::<2>)
                .bracket(Symplectic)
                .energy(|x: &Vector2<Real>| (x.x * x.x + x.y * x.y) * 0.5)
                .bath(
                    "air",
                    Bath::at(0.7).friction(move |_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                        [Contact { rate: friction.into(), along: vector![0.0.into(), 1.0.into()] }]
                    }),
                )
                .build()
        });
        let system = damped.at(vector![friction]).unwrap();
        let start = system.start(vector![1.0, 0.0]);
        let schedule = Span::until(6.0).tolerance(1e-12);
        let run = DormandPrince8.tangent(&system, start, schedule).unwrap();
        let exact = |c: f64| {
            let (rate, fall) = ((1.0 - 0.25 * c * c).sqrt(), 0.5 * c);
            let (sine, cosine) = (rate * 6.0).sin_cos();
            (-fall * 6.0).exp() * (cosine + fall / rate * sine)
        };
        // The derivative of order 2 at an arm's length, where the function is smooth over 1.
        let at = |d: f64| exact(friction + d);
        let slope = ((at(1e-3) - at(-1e-3)) * 8.0 - at(2e-3) + at(-2e-3)) / 12e-3;
        let off = (run.last().along_parameters()[(0, 0)] / slope - 1.0).abs();
        println!("{friction:e}: {off:.1e}, {}", run.sensitivity());
        assert!(off < 1e-9 + 5e-14 / friction, "{friction:e}: {off:e}");
    }
}

/// A mass at a distance, at rest.
fn at_rest<Y, C, X>(system: &OpenSystem<Y, C, X>, place: f64) -> OpenState<Vector2<f64>>
where
    Y: Metriplectic<Manifold = Euclidean<2>>,
    C: metriplectic::integrators::open::Clock<Euclidean<2>, Y::Energy>,
    X: metriplectic::dynamics::exchange::Exchange<Euclidean<2>, Y::Metric>,
{
    system.start(vector![place, 0.0])
}

/// Against the exact derivatives of a family, and of a system of one's own.
#[test]
fn derivatives_along_parameters_are_those_of_a_family() {
    let family = Family::on(LieDual::so3())
        .parameters(["inertia", "friction"])
        .energy(|p: &Vector3<Real>, t: &Vector2<Real>| {
            p.x * p.x * t.x + p.y * p.y + p.z * p.z * 1.5
        })
        .entropy(|p: &Vector3<Real>, t: &Vector2<Real>| p.norm_squared() * t.y)
        .build()
        .unwrap();
    let bodies =
        Systems::new(["inertia", "friction"], |t: &Vector2<f64>| Ok::<_, Error>(family.at(*t)));
    let theta = vector![0.5, 0.3];
    let (exact, found) = (family.at(theta), bodies.at(theta).unwrap());
    macro_rules! agree {
        ($($method:expr, $schedule:expr);+) => {$({
            let schedule: Schedule = $schedule.into();
            let exact = $method.tangent(&exact, START, schedule.clone()).unwrap();
            let found = $method.tangent(&found, START, schedule).unwrap();
            assert_eq!(exact.states().len(), found.states().len());
            let pairs = exact.states().iter().zip(found.states());
            let errors = pairs.map(|(exact, found)| off(&found.matrix(), &exact.matrix()));
            let error = errors.fold(0.0, f64::max);
            println!("{}: {error:.1e}, {}", stringify!($method), found.sensitivity());
            assert!(error < 2e-9, "{error:e}");
        })+};
    }
    agree!(
        DormandPrince8, Span::steps(0.1, 20);
        DormandPrince8, Span::until(2.0).tolerance(1e-7).output_every(0.3);
        Gauss::<2>, Span::steps(0.1, 20);
        WeylMidpoint, Span::steps(0.1, 20)
    );
}

/// A mass that falls: `H = p²/2 + g q`.
#[derive(Debug)]
struct Ball {
    gravity: f64,
}

impl Equations for Ball {
    fn sizes(&self) -> Sizes {
        Sizes { entries: 2, directions: 2, laws: 2 }
    }

    fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
        values.copy_from_slice(&[0.5 * x[1] * x[1] + self.gravity * x[0], 0.0]);
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.values(t, x, values);
        w.copy_from_slice(&[self.gravity, x[1], 0.0, 0.0]);
    }

    fn velocity(&self, _: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        v.copy_from_slice(&[x[1], -self.gravity]);
        Some(0.0)
    }

    fn is_vector_space(&self) -> bool {
        true
    }
}

#[test]
fn jumps_depend_on_parameters() {
    let balls = Systems::new(["gravity", "restitution"], |t: &Vector2<f64>| {
        Ok::<_, Error>(FromEquations(Ball { gravity: t.x }))
    });
    let theta = vector![1.3, 0.9];
    let schedule = |restitution: f64| {
        Span::until(2.0)
            .tolerance(1e-12)
            .event("floor", |x: &Entries| x[0])
            .falling()
            .jump(move |_, x: &Entries| Entries::from([x[0], -restitution * x[1]]))
            .differentiable(
                |_, (x, _): &(Vec<Real>, Vec<Real>)| x[0],
                |_, (x, t): &(Vec<Real>, Vec<Real>)| (vec![x[0], -x[1] * t[1]], t.clone()),
            )
    };
    let system = balls.at(theta).unwrap();
    let run = DormandPrince8.tangent(&system, [0.5, 0.1].into(), schedule(theta.y)).unwrap();
    assert_eq!(run.events().len(), 1);
    let last = |t: &Vector2<f64>| {
        let ball = balls.build(t).unwrap();
        let run = DormandPrince8.run(&ball, [0.5, 0.1].into(), schedule(t.y)).unwrap();
        run.last().point.clone()
    };
    let expected = differences(&*system, &run.last().point, &theta, 5e-4, last);
    let error = off(&run.last().along_parameters(), &expected);
    println!("a ball: {error:.1e}, {}", run.sensitivity());
    assert!(error < 1e-8, "{error:e}");
}

#[test]
fn parameters_without_a_size_or_a_system_are_refused() {
    let body = Systems::new(BODY, |t: &Vector4<f64>| {
        let is_cold = t.z < 1.2 - 1e-9;
        if is_cold {
            Err("too cold".to_owned())
        } else {
            open_body!(t).build().map_err(|e| e.to_string())
        }
    });
    assert_eq!(body.at(vector![0.5, 0.4, 1.0, 0.1]).err().as_deref(), Some("too cold"));
    let cause = |theta| {
        let system = body.at(theta).unwrap();
        let start = system.start(START);
        match DormandPrince8.tangent(&system, start.clone(), Span::steps(0.1, 3)).unwrap_err() {
            TangentError::NotLinearised { cause, .. } => cause,
            error => panic!("{error}"),
        }
    };
    // One at the edge of what the closure accepts, and one that is zero.
    assert_eq!(cause(THETA), Unlinearised::NoSystem);
    let zero = cause(vector![0.5, 0.0, 1.3, 0.1]);
    assert_eq!(zero, Unlinearised::ZeroParameter { name: "torque" });
    assert!(zero.to_string().starts_with("the parameter torque is zero"));
}
