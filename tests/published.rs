//! Problems that papers publish with parameters and figures, to the digits of independent references.
//!
//! References without a source were computed by `SciPy`'s DOP853, and by its Radau or LSODA; the digits given are those on
//! which two methods agree.

#[path = "models/stages.rs"]
mod stages;

use metriplectic::models::{ThermoelasticDoublePendulum, TwoGasContainers};
use metriplectic::prelude::*;
use metriplectic_studies::problems::flow;
use metriplectic_studies::{Claim, Guarantee, Order, scientific};
use stages::{GAUSS, Gauss3, RADAU};

type Point<Y> = <<Y as Metriplectic>::Manifold as metriplectic::fields::Space>::Point<f64>;

/// The tolerance of the runs that references are compared with: below the last digits of all references.
const TOLERANCE: f64 = 1e-15;

/// The states at these times, by a method of order 8.
fn by_order_8<Y: Metriplectic, const N: usize>(
    system: &Y,
    start: &Point<Y>,
    times: [f64; N],
) -> [State<Y::Manifold>; N] {
    let span = Span::until(times[N - 1]).tolerance(TOLERANCE).output_at(times);
    let run = DormandPrince8.run(system, start.clone(), span).expect("the run is taken");
    let certificate = run.certificate();
    assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
    times.map(|t| {
        let found = run.iter().find(|state| state.time.to_bits() == t.to_bits());
        found.expect("there is an output").clone()
    })
}

/// Records the errors of states whose entries are up to `size`, which are bounded by `most`.
#[track_caller]
fn agrees(problem: &str, source: &str, [error, size]: [f64; 2], most: f64) {
    // A reference that is met to the last bit has 16 digits.
    let digits = -(error / size).max(1e-16).log10();
    Claim::new(Guarantee::Accuracy, problem, format!("DormandPrince8, tolerance {TOLERANCE:e}"))
        .against(source)
        .record(format!("{}, {} digits", scientific(error), digits.floor()), scientific(most));
    assert!(error < most, "{problem}: {error:.1e}");
}

/// The order of an implicit method, fitted to its errors over `time`, recorded and asserted.
#[track_caller]
fn has_order<Y: Metriplectic, M: Method<Y> + Clone>(
    problem: &str,
    (name, method, order): (&str, M, f64),
    (system, start): (&Y, &Point<Y>),
    (time, steps): (f64, [usize; 4]),
    error: impl Fn(&Point<Y>) -> f64,
) {
    let sizes = steps.map(|n| time / n as f64);
    let errors = steps.map(|n| {
        let run = method.clone().run(system, start.clone(), Span::steps(time / n as f64, n));
        error(&run.expect("the run is taken").last().point)
    });
    let fitted = Order::fit(&sizes, &errors).expect("the errors follow a power law");
    println!("{problem}: order {fitted} from {:?}", errors.map(scientific));
    let band = if order > 2.0 { 0.3 } else { 0.05 };
    Claim::new(Guarantee::Order, problem, name)
        .against(format!("the reference at t = {time}"))
        .record(&fitted, format!("{order} ± {band}"));
    assert!(fitted.agrees(order, band), "{problem}: {fitted}");
}

/// The midpoint rule, which has order 2.
fn midpoint() -> (&'static str, Scheme<WeylMidpoint>, f64) {
    ("WeylMidpoint", Scheme::new(WeylMidpoint), 2.0)
}

/// Gruber, Gunzburger, Ju and Wang (2023), arXiv:2204.08049: `(q, p, S₁, S₂)` with
/// `H = p²/2 + (e^{S₁}/q)^{2/3} + (e^{S₂}/(2 − q))^{2/3}` and heat conduction `α = 8`.
const CONTAINERS: TwoGasContainers =
    TwoGasContainers { mass: 1.0, length: 2.0, gas: 1.0, temperature: 2.0 / 3.0, conductance: 8.0 };

#[test]
fn gas_containers_of_the_learning_literature() {
    let gas = CONTAINERS.system().expect("the containers are a system");
    let start = vector![0.9, -0.4, 2.4, 2.0];
    assert!((gas.energy_at(&start) - 8.953_560_999_182_892).abs() < 1e-14);
    let [early, late] = by_order_8(&gas, &start, [8.0, 32.0]);
    let reference = [0.98124602254157, -0.08052345768301, 2.25535400537030, 2.23944457420009];
    let early_error = (early.point - Vector4::from(reference)).amax();
    let late_error = (late.point.xy() - vector![1.00007965014505, -0.00038766112526]).amax();
    println!("order 8: {early_error:.1e} at t = 8, {late_error:.1e} at t = 32");
    let energies = [0, 1].map(|i| {
        let volume = [early.point.x, 2.0 - early.point.x][i];
        (early.point[2 + i].exp() / volume).powf(2.0 / 3.0)
    });
    let heat_error = (Vector2::from(energies) - vector![4.5548414057293, 4.3954775798350]).amax();
    let entropy_error = (early.entropy - 4.49479857957039).abs();
    let at_rest = (late.entropy - 4.496712416726).abs();
    println!("U {heat_error:.1e} and S {entropy_error:.1e} at t = 8, S {at_rest:.1e} at t = 32");
    // The references have 14 decimals, U has 13, and the last S has 12.
    let source = "SciPy; the model of Gruber et al., arXiv:2204.08049";
    for (what, error, most) in [
        ("(q, p, S₁, S₂), t = 8", [early_error, 2.26], 1e-13),
        ("(U₁, U₂), t = 8", [heat_error, 4.55], 2e-13),
        ("S, t = 8", [entropy_error, 4.49], 1e-13),
        ("(q, p), t = 32", [late_error, 1.0], 1e-13),
        ("S, t = 32", [at_rest, 4.5], 1e-12),
    ] {
        agrees(&format!("gas containers in entropies: {what}"), source, error, most);
    }
    let course = (8.0, [400, 800, 1600, 3200]);
    has_order("gas containers in entropies", midpoint(), (&gas, &start), course, |x| {
        (x - Vector4::from(reference)).amax()
    });
}

/// The Kovalevskaya top in (l, n), with its start.
fn kovalevskaya() -> (impl Metriplectic<Manifold = LieDual<6>, Metric = Canonical>, Vector6<f64>) {
    let top = System::on(LieDual::se3())
        .energy(|x: &Vector6<Real>| (x[0] * x[0] + x[1] * x[1]) * 0.5 + x[2] * x[2] + x[3])
        .casimir(|x: &Vector6<Real>| x[0] * x[3] + x[1] * x[4] + x[2] * x[5])
        .casimir(|x: &Vector6<Real>| x[3] * x[3] + x[4] * x[4] + x[5] * x[5])
        .momentum(|x: &Vector6<Real>| {
            (x[0] * x[0] - x[1] * x[1] - x[3] * 2.0).powi(2) + (x[0] * x[1] - x[4]).powi(2) * 4.0
        })
        .build()
        .expect("the top is a system");
    (top, vector![2.0, 0.0, 0.2, 0.8, 0.6, 0.0])
}

/// Andrews and Farrell (2024), arXiv:2407.11904, §5.
#[test]
fn the_kovalevskaya_top_is_where_it_should_be() {
    let (top, start) = kovalevskaya();
    // (l, n) by a Taylor series of order 26 in extended precision, by two step sizes that agree to these digits.
    let references = [
        (
            10.0,
            [
                1.479_146_708_388_79,
                -0.879_179_487_552_915,
                0.736_972_821_283_854,
                0.816_455_282_553_317,
                0.036_770_543_324_829_7,
                0.576_236_669_029_644,
            ],
        ),
        (
            100.0,
            [
                -0.004_684_270_202_564_6,
                -1.943_255_179_394_643,
                1.291_684_080_316_359,
                -0.716_579_080_658_437_5,
                -0.644_744_933_112_094_6,
                0.266_117_253_084_029,
            ],
        ),
        (
            300.0,
            [
                2.012_273_013_664_366,
                -0.617_855_309_989_339,
                0.249_282_212_193_07,
                0.562_364_445_882_182,
                -0.814_828_918_743_442,
                -0.140_712_697_319_819,
            ],
        ),
    ];
    let states = by_order_8(&top, &start, references.map(|(t, _)| t));
    for (state, (t, reference)) in states.iter().zip(references) {
        let error = (state.point - Vector6::from(reference)).amax();
        println!("order 8 at t = {t}: {error:.1e}");
        // The motion amplifies round-off.
        let most = [1e-13, 1e-12, 1e-12][usize::from(t > 10.0) + usize::from(t > 100.0)];
        let source = "Taylor series; the model of Andrews and Farrell, arXiv:2407.11904";
        let size = Vector6::from(reference).amax();
        agrees(&format!("Kovalevskaya top, t = {t}"), source, [error, size], most);
    }
    let course = (10.0, [400, 800, 1600, 3200]);
    has_order("Kovalevskaya top", midpoint(), (&top, &start), course, |x| {
        (x - Vector6::from(references[0].1)).amax()
    });
}

/// Kutta's method of order 3 (1901).
const KUTTA: Tableau = Tableau::new(
    "Kutta3",
    3,
    &[&[(0, 0.5)], &[(0, -1.0), (1, 2.0)]],
    &[(0, 1.0 / 6.0), (1, 2.0 / 3.0), (2, 1.0 / 6.0)],
);

#[test]
fn every_method_keeps_the_four_invariants_of_the_kovalevskaya_top() {
    fn kept<M: Method<Y>, Y: Metriplectic>(name: &str, method: M, (top, start): (&Y, Point<Y>)) {
        let run = method.run(top, start, Span::steps(0.1, 3000).at_most(2));
        let run = run.unwrap_or_else(|error| panic!("{name}: {error}"));
        let certificate = run.certificate();
        let worst = certificate.invariants.iter().map(|law| law.max_error);
        let worst = worst.fold(certificate.max_energy_error, f64::max);
        println!("{name}: {worst:.1e}");
        Claim::new(Guarantee::Invariants, "all four of the Kovalevskaya top", name)
            .against("their values at the start, T = 300, h = 0.1")
            .record(scientific(worst), "1e-13");
        assert_eq!(certificate.invariants.len(), 3, "{name}");
        assert!(worst <= 1e-13, "{name}: {worst:.1e}");
    }
    let (top, start) = kovalevskaya();
    let weyl = Scheme::new(WeylMidpoint);
    kept("WeylMidpoint", weyl, (&top, start));
    kept("ChartMidpoint", Scheme::new(ChartMidpoint), (&top, start));
    kept("Exponential", Scheme::new(Exponential), (&top, start));
    kept("WeylMidpoint, MeanValue", weyl.gradient(MeanValue), (&top, start));
    kept("WeylMidpoint, ItohAbe", weyl.gradient(ItohAbe), (&top, start));
    kept("WeylMidpoint, SymmetricItohAbe", weyl.gradient(SymmetricItohAbe), (&top, start));
    for method in GAUSS.into_iter().chain(RADAU) {
        kept(&format!("{method:?}"), method, (&top, start));
    }
    kept("DormandPrince5", DormandPrince5, (&top, start));
    kept("DormandPrince8", DormandPrince8, (&top, start));
    kept("ExplicitRungeKutta, Kutta3", ExplicitRungeKutta::new(&KUTTA), (&top, start));
    kept("RungeKuttaChebyshev", RungeKuttaChebyshev, (&top, start));
}

/// Andrews and Farrell (2024): Kepler's problem, in `H`, the angular momentum and the Runge-Lenz vector. One component
/// of this vector is a function of the others, so it is conserved without being listed.
#[test]
fn kepler_keeps_its_ellipse() {
    let runge_lenz = |x: &Vector4<Real>| {
        let (r, l) = (x.xy().norm_squared().sqrt(), x.x * x.w - x.y * x.z);
        vector![x.w * l - x.x / r, -x.z * l - x.y / r]
    };
    let kepler = System::on(Euclidean::<4>)
        .bracket(Symplectic)
        .energy(|x: &Vector4<Real>| {
            (x.z.powi(2) + x.w.powi(2)) * 0.5 - x.xy().norm_squared().sqrt().recip()
        })
        .momentum(|x: &Vector4<Real>| x.x * x.w - x.y * x.z)
        .momentum(move |x: &Vector4<Real>| runge_lenz(x).y)
        .build()
        .expect("Kepler's problem is a system");
    let start = vector![0.4, 0.0, 0.0, 2.0];
    let reference =
        [-0.1041832044341881, -0.694741715567954, 1.2361777626870742, 0.5646232510858523];
    let [end] = by_order_8(&kepler, &start, [100.0]);
    let error = (end.point - Vector4::from(reference)).amax();
    let momentum = (end.point.x * end.point.w - end.point.y * end.point.z - 0.8).abs();
    println!("order 8: {error:.1e}, L {momentum:.1e}");
    let source = "SciPy; the problem of Andrews and Farrell, arXiv:2407.11904";
    agrees("Kepler's problem, t = 100", source, [error, 1.24], 1e-12);
    agrees("Kepler's problem: L, t = 100", "its value 0.8 at the start", [momentum, 0.8], 1e-15);
    let course = (100.0, [1200, 1600, 2000, 2600]);
    has_order("Kepler's problem", ("Gauss3", Gauss3, 6.0), (&kepler, &start), course, |x| {
        (x - Vector4::from(reference)).amax()
    });
    // Their h = 0.1: the phase is off, the ellipse is not.
    let run = WeylMidpoint.run(&kepler, start, Span::steps(0.1, 1000)).expect("1000 steps");
    let vector = |x: &Vector4<f64>| runge_lenz(&x.cast()).map(|c| c.re);
    let turned = run.iter().map(|state| (vector(&state.point) - vector(&start)).norm());
    let turned = turned.fold(0.0, f64::max);
    println!("h = 0.1: the Runge-Lenz vector is off by {turned:.1e}\n{}", run.certificate());
    Claim::new(Guarantee::Invariants, "Runge-Lenz vector of Kepler's problem", "WeylMidpoint")
        .against("its value at the start, T = 100, h = 0.1")
        .record(scientific(turned), "1e-12");
    assert!(run.certificate().keeps_energy() && turned < 1e-12, "{turned:.1e}");
}

/// Gruber, Gunzburger, Ju and Wang (2023): 250 masses and one entropy, of which each site has a share.
#[test]
fn the_thermoelastic_rod() {
    const MASSES: usize = 250;
    let canonical = matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0];
    let rod = Lattice::on(Graph::from_bonds(MASSES, []), Euclidean::<3>)
        .bracket(Poisson::constant(canonical).expect("it is skew"))
        .energy(|x: &Vector3<Real>| x.y.powi(2) * 0.5 + x.x.cos() + x.z)
        .entropy(|x: &Vector3<Real>| x.z)
        .site_onsager(|site| [Onsager { rate: 0.1, b: vector![0.0, -1.0, site.w.y] }])
        .build()
        .expect("the rod is a lattice");
    let start = rod.points(|i| {
        let x = i as f64 / (MASSES - 1) as f64;
        vector![(0.65 * x).exp(), (1.0 - 0.1 * x * x).recip(), 1.9 / MASSES as f64]
    });
    let references = [
        (8.0, [1.73114905294, 3.10385392000, 0.574655423218, 1.07008071085, 221.52983998683]),
        (48.0, [3.09510856972, 3.28859007363, 0.191064493102, 0.00792347682, 421.5128086722]),
    ];
    let span = Span::until(48.0).tolerance(TOLERANCE).output_at(references.map(|(t, _)| t));
    let run = DormandPrince8.run(&rod, start, span).expect("the run is taken");
    println!("{}", run.certificate());
    assert!((run.states()[0].energy - 175.199_275_838_788).abs() < 1e-11);
    assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
    for (t, reference) in references {
        let state = run.iter().find(|state| state.time.to_bits() == t.to_bits());
        let state = state.expect("there is an output");
        let (first, last) = (&state.point[0], &state.point[MASSES - 1]);
        let values = [first.x, last.x, first.y, last.y, state.entropy];
        let off = values.into_iter().zip(reference).map(|(value, exact)| (value - exact).abs());
        let off: Vec<f64> = off.collect();
        // The references have 10 to 12 significant digits, S has 10 decimals.
        let source = "SciPy; the model of Gruber et al., arXiv:2204.08049";
        let state = off[..4].iter().copied().fold(0.0, f64::max);
        agrees(
            &format!("thermoelastic rod, t = {t}: q and p"),
            source,
            [state, reference[1]],
            1e-11,
        );
        agrees(&format!("thermoelastic rod, t = {t}: S"), source, [off[4], reference[4]], 1e-10);
    }
}

/// The same rod with four masses, as one system: a lattice has no implicit method.
#[test]
fn a_short_rod_is_integrated_to_the_order_of_an_implicit_method() {
    type Rod = SVector<Real, 9>;
    let canonical = SMatrix::<f64, 9, 9>::from_fn(|i, j| {
        f64::from(u8::from(i < 4 && j == i + 4)) - f64::from(u8::from(j < 4 && i == j + 4))
    });
    let rod = System::on(Euclidean::<9>)
        .bracket(Poisson::constant(canonical).expect("it is skew"))
        .energy(|x: &Rod| (0..4).map(|i| x[4 + i].powi(2) * 0.5 + x[i].cos()).sum::<Real>() + x[8])
        .entropy(|x: &Rod| x[8])
        .dissipation(FieldDissipation(|_: &Rod, w: &Rod| {
            (4..8)
                .map(|i| Rod::ith(i, w[8]) - Rod::ith(8, w[i]))
                .map(|b| b * b.transpose() * Real::from(0.1))
                .sum()
        }))
        .build()
        .expect("the rod is a system");
    let start = SVector::<f64, 9>::from_fn(|i, _| {
        let x = (i % 4) as f64 / 3.0;
        [(0.65 * x).exp(), (1.0 - 0.1 * x * x).recip(), 1.9][i / 4]
    });
    let exact = flow(&rod, &start, 8.0).expect("it has a flow");
    let [end] = by_order_8(&rod, &start, [8.0]);
    let error = (end.point - exact).amax();
    println!("order 8: {error:.1e}");
    assert!(error < 1e-10, "{error:.1e}");
    let course = (8.0, [200, 300, 450, 700]);
    has_order("thermoelastic rod of four masses", midpoint(), (&rod, &start), course, |x| {
        (x - end.point).amax()
    });
}

/// Hernández, Badías, González, Chinesta and Cueto (2021), arXiv:2004.04653: the thermoelastic double pendulum
/// `(q₁, q₂, p₁, p₂, s₁, s₂)` with the energies of Romero (2009) that fit their data, over their 200 steps of 0.3.
#[test]
fn the_double_pendulum_of_the_learning_literature() {
    let pendulum = ThermoelasticDoublePendulum {
        masses: [1.0, 2.0],
        lengths: [2.0, 1.0],
        stiffness: [0.019, 0.188],
        coupling: 0.087,
        heat_capacity: 5.0,
        temperature: 300.0,
        conductance: 300.0,
    };
    let pendulum = pendulum.system().expect("the pendulum is a system");
    let start = SVector::from([4.5, 4.5, 2.0, 4.5, -0.5, 1.5, 1.4, -0.2, 0.0, 0.0]);
    // Heat is exchanged 120 times in a unit of time.
    let exact = (0..10).try_fold(start, |x, _| flow(&pendulum, &x, 0.6)).expect("it has a flow");
    let [early] = by_order_8(&pendulum, &start, [6.0]);
    let error = (early.point - exact).amax();
    let source = "a Runge-Kutta flow of order 4; the model of Hernández et al., arXiv:2004.04653";
    agrees(
        "double pendulum of the learning literature, t = 6",
        source,
        [error, exact.amax()],
        1e-10,
    );
    let span = Span::until(60.0).tolerance(1e-12).output_every(0.3);
    let run = DormandPrince8.run(&pendulum, start, span).expect("the run is taken");
    let c = run.certificate();
    println!("order 8: {error:.1e}\n{c}");
    Claim::new(
        Guarantee::Energy,
        "double pendulum of the learning literature, 200 outputs",
        "DormandPrince8",
    )
    .against("H at the start, relative; 1.55e-4 in the published set, arXiv:2004.04653")
    .record(scientific(c.max_relative_energy_error()), "1e-13");
    assert!(
        c.max_relative_energy_error() < 1e-13 && c.keeps_entropy() && c.keeps_invariants(),
        "{c}"
    );
    let course = (6.0, [100, 150, 220, 320]);
    let problem = "double pendulum of the learning literature";
    has_order(problem, midpoint(), (&pendulum, &start), course, |x| (x - early.point).amax());
}
