//! Tangents by differences of steps: of open, noisy and open noisy systems, of lattices, and of systems in plain numbers on curved
//! spaces; against differences of whole runs in the same steps, and against exact ones.

use metriplectic::dynamics::InNumbers;
use metriplectic::equations::{Equations, Sizes};
use metriplectic::integrators::tangent::{HasFlow, SmoothFlow};
use metriplectic::integrators::{
    Differentiated, Element, Entries, FromEquations, OpenState, Schedule, TangentError,
    Unlinearised, Vector as _,
};
use metriplectic::lattices::{Onsager, Points, SiteState};
use metriplectic::prelude::*;
use nalgebra::{DMatrix, DVector, SVector, Vector1, vector};

use crate::off;

/// A loss of the states of a run: a row for each of them.
fn row(k: usize, n: usize) -> DVector<f64> {
    DVector::from_fn(n, |i, _| (1.0 + i as f64 + k as f64).sin())
}

/// Compares the tangent of a run of fixed steps with differences of whole runs along each direction of the point, and the
/// transposed steps with the tangent. The error is relative to the largest entry.
fn compared<F, M>(name: &str, flow: &F, method: M, x0: &Element<F>, span: Span)
where
    F: Differentiated<M> + HasFlow<Flow = F> + SmoothFlow,
    M: Clone + Stepper<F>,
{
    let run = method.clone().tangent(flow, x0.clone(), span).expect("a tangent");
    let plain = method.clone().run(flow, x0.clone(), span).expect("it runs");
    assert!(plain.last().point == run.last().point, "{name}: the tangent changed the run");
    let (end, sizes) = (&run.last().point, flow.sizes(x0));
    let n = sizes.len();
    let columns = (0..n).map(|k| {
        let slope = |e: f64| {
            let at = |e: f64| {
                let d = sizes.with(|i| if i == k { e } else { 0.0 });
                let run = method.clone().run(flow, flow.moved(x0, &d), span).expect("it runs");
                let d = flow.between(end, &run.last().point).expect("it is near");
                DVector::from_vec(d.to_list())
            };
            (at(e) - at(-e)) / (2.0 * e)
        };
        (slope(1e-5) * 4.0 - slope(2e-5)) / 3.0
    });
    let differences = DMatrix::from_columns(&columns.collect::<Vec<_>>());
    let found = run.last().matrix();
    let error = off(&found.columns(0, n).into_owned(), &differences);
    let back = method.adjoint(flow, x0.clone(), span).expect("an adjoint");
    let all = found.nrows();
    let rows: Vec<_> = (0..back.states().len()).map(|k| row(k, all)).collect();
    let forward = run.states().iter().zip(&rows).map(|(state, row)| state.derivative_of(row));
    let forward = forward.fold(DVector::zeros(all), |sum: DVector<f64>, row| sum + row);
    let gradient = back.pull_back(&rows).expect("a gradient").along_start();
    let transposed = (gradient - &forward).amax() / forward.amax();
    println!("{name}: {error:.1e}, transposed {transposed:.1e}, {}", run.sensitivity());
    // Some ten digits of each step; where energy and entropy are nearly dependent, their projection bends over a hundredth of a size.
    assert!(error < 1e-7, "{name}: {error:e}\n{found:.9}\n{differences:.9}");
    assert!(transposed < 1e-7, "{name}: {transposed:e}");
    assert!(run.sensitivity().energy < 1e-8, "{name}: {}", run.sensitivity());
}

macro_rules! open_body {
    () => {
        System::on(LieDual::so3())
            .energy_in_time(|t: Real, p: &Vector3<Real>| {
                p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5 + p.x * t.sin()
            })
            .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
            .work("torque", |t: Real, p: &Vector3<Real>| {
                p.cross(&vector![Real::from(0.0), t.sin() * 0.5, Real::from(0.0)])
            })
            .bath("air", Bath::at(1.0).isotropic(0.1))
    };
}

const START: Vector3<f64> = Vector3::new(0.4, -1.0, 0.3);

#[test]
fn open_systems_have_tangents_of_their_points_and_of_their_ledgers() {
    let open = open_body!().build().unwrap();
    let start = open.start(START);
    macro_rules! all {
        ($($method:expr),+) => {$(
            compared(stringify!($method), &open, $method, &start, Span::steps(0.1, 20));
        )+};
    }
    all!(
        WeylMidpoint,
        Scheme::new(WeylMidpoint).gradient(ItohAbe),
        Gauss::<2>,
        DormandPrince5,
        DormandPrince8,
        RungeKuttaChebyshev
    );
    // An oscillator with the mass and the spring 1 in air at a temperature: it has no entropy of its own.
    let oscillator = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| (x.x * x.x + x.y * x.y) * 0.5)
        .bath(
            "air",
            Bath::at(2.0).friction(|_, _: &Vector2<Real>, _: &Vector2<Real>| {
                [Contact { rate: Real::from(0.3), along: Vector2::<Real>::y() }]
            }),
        )
        .build()
        .unwrap();
    let start = oscillator.start(vector![1.0, 0.2]);
    compared("Radau", &oscillator, Radau::<2>, &start, Span::steps(0.1, 20));
    // By hand: x' = (p, −q − γp) and Q' = −γp², with q'' + γq' + q = 0.
    let run = DormandPrince8.tangent(&oscillator, start, Span::steps(0.05, 40)).unwrap();
    let (gamma, t) = (0.3, 2.0_f64);
    let (decay, omega) = ((-0.5 * gamma * t).exp(), (1.0 - 0.25 * gamma * gamma).sqrt());
    let (sin, cos) = (omega * t).sin_cos();
    let along_q = decay * (cos + 0.5 * gamma / omega * sin);
    let along_p = decay * sin / omega;
    let found = run.last().matrix();
    let error = (found[(0, 0)] - along_q).abs().max((found[(0, 1)] - along_p).abs());
    println!("by hand: {error:.1e}");
    assert!(error < 1e-9, "{error:e}");
    // The heat is the change of the energy.
    let heat = run.last().heat_along("air").unwrap();
    let end = run.last().point.x;
    for (k, start) in [1.0, 0.2].into_iter().enumerate() {
        let energy = end.x * found[(0, k)] + end.y * found[(1, k)] - start;
        assert!((heat[k] - energy).abs() < 1e-9, "{k}: {} and {energy}", heat[k]);
    }
    let entropy = run.last().bath_entropy_along("air").unwrap();
    // But along what was booked before, which the start is free to choose.
    let off_heat = (entropy * 2.0 + &heat).rows(0, 3).amax();
    assert!(off_heat < 1e-14, "{off_heat:e}");
    assert!(run.last().work_along("air").is_none());
}

#[test]
fn paths_with_noise_have_the_tangents_of_their_own_random_numbers() {
    let system = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .noise(Boltzmann(0.1))
        .build()
        .unwrap();
    let open = open_body!().noise(Boltzmann(0.1)).build().unwrap();
    let start = open.flow().start(START);
    for seed in [1, 2] {
        let span = Span::steps(0.02, 30);
        compared("noise, Weyl", &system, RandomFlow(WeylMidpoint).seed(seed), &START, span);
        let sampler = NinomiyaVictoir(WeylMidpoint).seed(seed);
        compared("noise of order 2", &system, sampler, &START, span);
        compared("open noise, 5", &open, RandomFlow(DormandPrince5).seed(seed), &start, span);
    }
}

#[test]
fn lattices_have_tangents() {
    let ring = || {
        Lattice::on(Graph::ring(4), LieDual::so3())
            .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
            .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
            .bond_onsager(|bond| {
                let [u, v] = bond.w;
                [Onsager { rate: 0.1, b: [u.cross(v), v.cross(u)] }]
            })
            .build()
            .unwrap()
    };
    let lattice = ring();
    let start = lattice.points(|site| vector![0.4 + 0.1 * site as f64, -1.0, 0.3]);
    let span = Span::steps(0.1, 5);
    compared("lattice, 8", &lattice, DormandPrince8, &start, span);
    compared("lattice, Chebyshev", &lattice, RungeKuttaChebyshev, &start, span);
    compared("lattice, Gauss", &lattice, Gauss::<2>, &start, span);
    let open = ring()
        .opened()
        .work("torque", [0], |t, _, p: &Vector3<f64>| p.cross(&vector![0.0, 0.5 * t.sin(), 0.0]))
        .bath("air", 1.0, [1], |_, _: &SiteState<'_, LieDual<3>>| {
            [Onsager { rate: 0.1, b: vector![0.0, 1.0, 0.0] }]
        });
    let start = open.start(start);
    compared("open lattice, 8", &open, DormandPrince8, &start, span);
    compared("open lattice, Weyl", &open, WeylMidpoint, &start, span);
    compared("open lattice, Gauss", &open, Gauss::<2>, &start, span);
    let conducting = Lattice::on(Graph::ring(4), Euclidean::<1>)
        .energy(|u: &Vector1<Real>| u.x)
        .entropy(|u: &Vector1<Real>| u.x.ln())
        .bond_onsager(|bond| {
            let [u, v] = bond.x.map(|u| u.x);
            [Onsager { rate: 0.1 * u * v, b: [vector![bond.w[1].x], vector![-bond.w[0].x]] }]
        })
        .build()
        .unwrap()
        .with_noise(Boltzmann(0.01));
    let start = conducting.flow().points(|site| vector![1.0 + 0.1 * site as f64]);
    let noise = RandomFlow(DormandPrince5).seed(3);
    compared("noisy lattice", &conducting, noise, &start, Span::steps(0.02, 20));
}

/// Many stages, whose number is that of the step beside which others are taken.
#[test]
fn stiff_lattices_have_tangents_of_the_stages_that_they_took() {
    let rod = Lattice::on(Graph::chain(12), Euclidean::<1>)
        .energy(|u: &Vector1<Real>| u.x)
        .entropy(|u: &Vector1<Real>| u.x.ln())
        .bond_onsager(|_| [Onsager { rate: 200.0, b: [vector![1.0], vector![-1.0]] }])
        .build()
        .unwrap();
    let start = rod.points(|site| vector![1.0 + 0.1 * site as f64]);
    compared("stiff", &rod, RungeKuttaChebyshev, &start, Span::steps(0.05, 30));
}

/// A sphere beside a number of any size: the frames of the chart have the sizes of the space.
#[test]
fn losses_on_products_have_derivatives_in_any_unit() {
    for unit in [1.0, 1e4, 1e11] {
        let warm = System::on(Product(Sphere::<2>::round(), Euclidean::<1>))
            .energy(move |(n, u): &(Vector3<Real>, Vector1<Real>)| n.x * n.x * 0.5 + u.x / unit)
            .entropy(move |(_, u): &(Vector3<Real>, Vector1<Real>)| u.x / unit)
            .build()
            .unwrap();
        let numbers = FromEquations(InNumbers(&warm));
        let start = Entries::from([0.36, 0.48, 0.8, unit]);
        let run = DormandPrince8.adjoint(&numbers, start, Span::steps(0.1, 2)).unwrap();
        let last = run.states().len() - 1;
        let zero = Real::from(0.0);
        let loss = run.gradient(|k, x| if k == last { x[3] / unit } else { zero }).unwrap();
        let along = loss.along_start()[2] * unit;
        println!("{unit:e}: {along}");
        assert!((along - 1.0).abs() < 1e-6, "{unit:e}: {along}");
    }
}

/// A sphere in plain numbers, against the derivatives of the same run in types.
#[test]
fn derivatives_by_differences_have_ten_digits() {
    let sphere = System::on(Sphere::<2>::round())
        .energy(|n: &Vector3<Real>| n.x * n.x * 0.5 + n.y * n.y + n.z.powi(3) * 0.4)
        .entropy(|n: &Vector3<Real>| n.z + n.x * n.y * 0.3)
        .build()
        .unwrap();
    let numbers = FromEquations(InNumbers(&sphere));
    for n in [vector![0.36, 0.48, 0.8], vector![0.6, 0.8, -0.0], vector![0.48, 0.6, -0.64]] {
        let start = Entries::from([n.x, n.y, n.z]);
        for schedule in [
            Schedule::from(Span::steps(0.1, 20)),
            Span::until(2.0).tolerance(1e-7).output_every(0.3),
        ] {
            let exact = DormandPrince8.tangent(&sphere, n, schedule.clone()).unwrap();
            let run = DormandPrince8.tangent(&numbers, start.clone(), schedule).unwrap();
            assert_eq!(exact.states().len(), run.states().len());
            let pairs = exact.states().iter().zip(run.states());
            let errors = pairs.map(|(exact, found)| off(&found.matrix(), &exact.matrix()));
            let error = errors.fold(0.0, f64::max);
            println!("{n:?}: {error:.1e}");
            assert!(error < 1e-9, "{error:e}");
        }
    }
}

#[test]
fn steps_on_another_branch_and_states_without_a_size_are_refused() {
    let oscillator = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy_in_time(|_, x: &Vector2<Real>| (x.x * x.x + x.y * x.y) * 0.5)
        .build()
        .unwrap();
    let start = oscillator.start(vector![0.0, 0.0]);
    let error = WeylMidpoint.tangent(&oscillator, start, Span::steps(0.1, 3)).unwrap_err();
    assert!(
        matches!(error, TangentError::NotLinearised { cause: Unlinearised::NoSize, .. }),
        "{error}"
    );
}

/// A particle that is pushed, `p' = sin t`, far from the time zero: the clock of its start, by hand.
#[test]
fn the_clock_has_digits_at_any_time_and_in_steps_of_any_size() {
    let pushed = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5)
        .work("push", |t: Real, _: &Vector2<Real>| vector![Real::from(0.0), t.sin()])
        .build()
        .unwrap();
    for (start, h, count) in [(0.0, 1e-3, 500), (1e3, 1e-3, 500), (1e6, 1e-3, 200), (0.0, 0.1, 20)]
    {
        let span = Span::steps(h, count).starting_at(start);
        let x0 = pushed.start(vector![1.0, 0.7]);
        let run = DormandPrince8.tangent(&pushed, x0, span).unwrap();
        let (found, end) = (run.last().matrix(), run.last().time);
        let exact = end.sin() - f64::sin(start);
        let off = (found[(1, 2)] - exact).abs() / exact.abs();
        println!("from {start:e} by {h:e}: {off:.1e}");
        assert!((found[(2, 2)] - 1.0).abs() < 1e-15);
        // Times of 1e6 have ten digits.
        assert!(off < if start > 1e5 { 1e-6 } else { 1e-9 }, "{off:e}");
    }
    // An output just after a step.
    let x0 = pushed.start(vector![1.0, 0.7]);
    let outputs = Span::steps(0.1, 3).output_at([0.1, 0.1 + 1e-9, 0.3]);
    let run = DormandPrince8.tangent(&pushed, x0, outputs).unwrap();
    let [early, late] = [1, 2].map(|k| run.states()[k].matrix());
    assert!((early - late).amax() < 1e-8);
}

/// A momentum that is small beside the distance over which it moves, and an angle that has turned many times.
#[test]
fn entries_whose_size_is_no_scale_have_digits() {
    let free = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy_in_time(|_, x: &Vector2<Real>| x.y * x.y * 0.5)
        .build()
        .unwrap();
    for p in [1e-2, 1e-4, 1e-8, 1e-12] {
        for name in ["8", "Weyl"] {
            let (x0, span) = (free.start(vector![1.0, p]), Span::steps(0.1, 20));
            let run = if name == "8" {
                DormandPrince8.tangent(&free, x0, span).unwrap()
            } else {
                WeylMidpoint.tangent(&free, x0, span).unwrap()
            };
            let off = (run.last().matrix()[(0, 1)] - 2.0).abs();
            println!("p = {p:e} by {name}: {off:.1e}");
            // One that is a hundredth of the other bounds the displacement.
            assert!(off < 2e-8, "{p:e}: {off:e}");
        }
    }
    let pendulum = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy_in_time(|_, x: &Vector2<Real>| x.y * x.y * 0.5 - x.x.cos())
        .build()
        .unwrap();
    let exact = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 - x.x.cos())
        .build()
        .unwrap();
    for turns in [0.0, 10.0, 1e3, 1.3e5] {
        let q = 0.3 + turns * std::f64::consts::TAU;
        let (x0, span) = (vector![q, 0.4], Span::steps(0.1, 20));
        let found = DormandPrince8.tangent(&pendulum, pendulum.start(x0), span).unwrap();
        let expected = DormandPrince8.tangent(&exact, x0, span).unwrap().last().matrix();
        let error = off(&found.last().matrix().view((0, 0), (2, 2)).into_owned(), &expected);
        println!("{turns} turns: {error:.1e}");
        // The angle itself loses as many digits.
        assert!(error < 1e-9_f64.max(2e-11 * q), "{turns} turns: {error:e}");
    }
    // A planet that stays in its plane: place and momentum across it are zero.
    let potential = |x: &SVector<Real, 6>| {
        let [place, momentum] =
            [x.fixed_rows::<3>(0).norm_squared(), x.fixed_rows::<3>(3).norm_squared()];
        momentum * 0.5 - place.powf(-0.5)
    };
    let exact = System::on(Euclidean::<6>).bracket(Symplectic).energy(potential).build().unwrap();
    let planet = System::on(Euclidean::<6>)
        .bracket(Symplectic)
        .energy_in_time(move |_, x: &SVector<Real, 6>| potential(x))
        .build()
        .unwrap();
    let (x0, span) = (SVector::from([1.0, 0.0, 0.0, 0.0, 1.1, 0.0]), Span::steps(0.1, 20));
    let expected = DormandPrince8.tangent(&exact, x0, span).unwrap().last().matrix();
    let found = DormandPrince8.tangent(&planet, planet.start(x0), span).unwrap().last().matrix();
    let error = off(&found.view((0, 0), (6, 6)).into_owned(), &expected);
    println!("a planet: {error:.1e}");
    assert!(error < 1e-9, "{error:e}");
    // The heat of a body that cools by six orders of magnitude.
    let cooling = System::on(Euclidean::<1>)
        .energy(|u: &Vector1<Real>| u.x)
        .entropy(|u: &Vector1<Real>| u.x.ln())
        .bath(
            "air",
            Bath::at(1.0).friction(|_: Real, u: &Vector1<Real>, _: &Vector1<Real>| {
                [Contact { rate: u.x, along: vector![1.0.into()] }]
            }),
        )
        .build()
        .unwrap();
    // u' = (1 − u/…): the rate of the bath is u (T/u − 1)/T, so u(t) = 1 + (u₀ − 1) e^{−t}.
    let start = cooling.start(vector![1e6]);
    let run = DormandPrince8.tangent(&cooling, start, Span::until(20.0).tolerance(1e-10)).unwrap();
    let found = run.last().matrix()[(0, 0)];
    let exact = (run.last().point.x.x - 1.0) / (1e6 - 1.0);
    println!("u = {}, off by {:.1e}", run.last().point.x.x, found / exact - 1.0);
    assert!((found / exact - 1.0).abs() < 1e-6, "{found} {exact}");
}

/// An explicit step that has left an open system at rest says so, though its clock has moved.
#[test]
fn steps_from_rest_of_open_systems_are_marked() {
    let sprung = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| ((x.x - 1.0) * (x.x - 1.0) + x.y * x.y) * 0.5)
        .bath(
            "air",
            Bath::at(2.0).friction(|_, _: &Vector2<Real>, _: &Vector2<Real>| {
                [Contact { rate: Real::from(0.3), along: Vector2::<Real>::y() }]
            }),
        )
        .build()
        .unwrap();
    let run = |place: f64, is_at_rest: bool| {
        let start = sprung.start(vector![place, 0.0]);
        let run = DormandPrince8.tangent(&sprung, start, Span::steps(0.1, 3)).unwrap();
        assert_eq!(run.sensitivity().at_rest, is_at_rest, "{place}");
        run.last().matrix().view((0, 0), (2, 2)).into_owned()
    };
    // The motion is linear, so its derivatives do not depend on the start.
    let error = off(&run(1.0, true), &run(1.5, false));
    assert!(error < 1e-9, "{error:e}");
}

/// Compares the tangent across the impacts of a ball with differences of runs that find their own times of impact, along each
/// direction of the point and along the clock.
fn bounces<F>(name: &str, flow: &F, x0: &Element<F>, floor: impl Fn(Until) -> Schedule)
where
    F: Differentiated<DormandPrince8> + HasFlow<Flow = F> + SmoothFlow,
    DormandPrince8: Stepper<F>,
{
    // A clock is moved with all times of the run.
    let schedule = |late: f64| floor(Span::until(2.0 + late).starting_at(late).tolerance(1e-11));
    let run = DormandPrince8.tangent(flow, x0.clone(), schedule(0.0)).expect("a tangent");
    let plain = DormandPrince8.run(flow, x0.clone(), schedule(0.0)).expect("it runs");
    assert!(plain.last().point == run.last().point && run.events().len() == 1, "{name}");
    let (end, sizes) = (&run.last().point, flow.sizes(x0));
    let columns = sizes.len() + usize::from(flow.clock().is_some());
    let differences = (0..columns).map(|k| {
        let at = |e: f64| {
            let late = if flow.clock() == Some(k) { e } else { 0.0 };
            let d = sizes.with(|i| if i == k { e } else { 0.0 });
            let run = DormandPrince8.run(flow, flow.moved(x0, &d), schedule(late));
            let end_of_run = &run.expect("it runs").last().point.clone();
            DVector::from_vec(flow.between(end, end_of_run).expect("it is near").to_list())
        };
        let slope = |e: f64| (at(e) - at(-e)) / (2.0 * e);
        (slope(5e-4) * 4.0 - slope(1e-3)) / 3.0
    });
    let differences = DMatrix::from_columns(&differences.collect::<Vec<_>>());
    let found = run.last().matrix().columns(0, columns).into_owned();
    let error = off(&found, &differences);
    println!("{name}: {error:.1e}, {}", run.sensitivity());
    // Runs to 1e-11, and their differences over 1e-3.
    assert!(error < 1e-7, "{name}: {error:e}\n{found:.9}\n{differences:.9}");
    // The costate of each entry of the end, a ledger too, and of a state before the impact, in steps that are taken again.
    let back =
        DormandPrince8.adjoint_within(3, flow, x0.clone(), schedule(0.0)).expect("an adjoint");
    assert_eq!(back.states().len(), run.states().len(), "{name}");
    let (all, last) = (run.last().matrix().nrows(), run.states().len() - 1);
    let mut rows = vec![DVector::zeros(all); last + 1];
    (rows[1], rows[last]) = (row(1, all), row(last, all));
    let forward = [1, last].map(|k| run.states()[k].derivative_of(&rows[k]));
    let back = back.pull_back(&rows).expect("a gradient");
    let off = (&forward[0] + &forward[1]).rows(0, all) - back.along_start();
    // Differences of steps have some ten digits.
    let off = off.amax() / forward[1].amax();
    println!("{name}: transposed to {off:.1e}");
    assert!(off < 1e-8, "{name}: {off:e}");
}

#[test]
fn tangents_of_every_kind_of_system_cross_jumps() {
    const RESTITUTION: f64 = 0.9;
    struct Ball;
    impl Equations for Ball {
        fn sizes(&self) -> Sizes {
            Sizes { entries: 2, directions: 2, laws: 2 }
        }

        fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
            values.copy_from_slice(&[0.5 * x[1] * x[1] + x[0], 0.0]);
        }

        fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
            self.values(t, x, values);
            w.copy_from_slice(&[1.0, x[1], 0.0, 0.0]);
        }

        fn velocity(&self, _: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
            v.copy_from_slice(&[x[1], -1.0]);
            Some(0.0)
        }

        fn is_vector_space(&self) -> bool {
            true
        }
    }
    bounces("own", &FromEquations(Ball), &[0.5, 0.1].into(), |span| {
        span.event("floor", |x: &Entries| x[0])
            .falling()
            .jump(|_, x: &Entries| Entries::from([x[0], -RESTITUTION * x[1]]))
            .differentiable(
                |_, x: &Vec<Real>| x[0],
                |_, x: &Vec<Real>| vec![x[0], -x[1] * RESTITUTION],
            )
            .into()
    });
    let pushed = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 + x.x)
        .work("wind", |t: Real, x: &Vector2<Real>| vector![Real::from(0.0), (t + x.x).sin() * 0.3])
        .build()
        .unwrap();
    // An energy that depends on time does work at the jump.
    let swinging = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy_in_time(|t: Real, x: &Vector2<Real>| x.y * x.y * 0.5 * (t.sin() * 0.3 + 1.0) + x.x)
        .build()
        .unwrap();
    bounces("in time", &swinging, &swinging.start(vector![0.5, 0.1]), |span| {
        span.event("floor", |state: &OpenState<Vector2<f64>>| state.x.x)
            .falling()
            .jump(|_, state: &OpenState<Vector2<f64>>| {
                state.at(vector![state.x.x, -RESTITUTION * state.x.y])
            })
            .differentiable(
                |_, x: &Vector2<Real>| x.x,
                |_, x: &Vector2<Real>| vector![x.x, -x.y * RESTITUTION],
            )
            .into()
    });
    // An impact just after the start has the velocity of the motion, p' = −1 + 0.3 sin(t + q).
    let early = Span::until(0.5).tolerance(1e-9);
    let early = early.event("floor", |state: &OpenState<Vector2<f64>>| state.x.x).falling();
    let run = DormandPrince8.tangent(&pushed, pushed.start(vector![1e-9, -1.0]), early).unwrap();
    let velocity = &run.events()[0].velocity;
    let off = (velocity[0] + 1.0).abs().max((velocity[1] + 1.0).abs());
    println!("early: {off:.1e}");
    assert!(off < 1e-8, "{velocity}");
    // The floor moves, and so does the ball after its impact: both by the clock.
    bounces("open", &pushed, &pushed.start(vector![0.5, 0.1]), |span| {
        span.event("floor", |state: &OpenState<Vector2<f64>>| state.x.x - 0.05 * state.time.sin())
            .falling()
            .jump(|t, state: &OpenState<Vector2<f64>>| {
                state.at(vector![state.x.x, -RESTITUTION * state.x.y + 0.1 * t.cos()])
            })
            .differentiable(
                |t, x: &Vector2<Real>| x.x - t.sin() * 0.05,
                |t, x: &Vector2<Real>| vector![x.x, t.cos() * 0.1 - x.y * RESTITUTION],
            )
            .into()
    });
}

#[test]
fn tangents_of_lattices_cross_jumps() {
    const RESTITUTION: f64 = 0.9;
    let balls = || {
        Lattice::on(Graph::ring(3), Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 + x.x)
            .bond_energy(|(a, b): &(Vector2<Real>, Vector2<Real>)| (a.x - b.x) * (a.x - b.x) * 0.05)
            .build()
            .unwrap()
    };
    type Balls = Vec<Vector2<Real>>;
    let map = |x: &Balls| {
        let first = vector![x[0].x, -x[0].y * RESTITUTION];
        std::iter::once(first).chain(x[1..].iter().copied()).collect::<Balls>()
    };
    let start = |site: usize| vector![0.5 + 1.5 * site as f64, 0.1];
    let ring = balls();
    bounces("lattice", &ring, &ring.points(start), |span| {
        span.event("floor", |x: &Points<Euclidean<2>>| x[0].x)
            .falling()
            .jump(|_, x: &Points<Euclidean<2>>| {
                let mut y = x.clone();
                y[0].y *= -RESTITUTION;
                y
            })
            .differentiable(|_, x: &Balls| x[0].x, move |_, x: &Balls| map(x))
            .into()
    });
    let open = balls()
        .opened()
        .work("wind", [0], |t, _, x: &Vector2<f64>| vector![0.0, 0.3 * (t + x.x).sin()]);
    let x0 = open.start(open.lattice().points(start));
    bounces("open lattice", &open, &x0, |span| {
        type State = OpenState<Points<Euclidean<2>>>;
        span.event("floor", |state: &State| state.x[0].x)
            .falling()
            .jump(|_, state: &State| {
                let mut y = state.x.clone();
                y[0].y *= -RESTITUTION;
                state.at(y)
            })
            .differentiable(|_, x: &Balls| x[0].x, move |_, x: &Balls| map(x))
            .into()
    });
}
