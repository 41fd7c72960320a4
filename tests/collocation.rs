//! Methods with stages: their orders on every kind of space with both laws, what they share with the scheme of the
//! paper, their way back, and what every method of a run has.
//!
//! References are ends of the explicit method of order 8 at a tolerance of 10⁻¹⁴.

use metriplectic::dynamics::system::Point;
use metriplectic::integrators::{Components, StageMemory, StepEnds, StepStart, laws};
use metriplectic::manifolds::Riemannian;
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee, Order, scientific};

mod models;
#[path = "models/stages.rs"]
mod stages;

use models::{Globe, distance, gas, half_square, relaxing_body, slope, top};
use stages::*;

const GAS: Vector4<f64> = Vector4::new(1.0, 2.0, 2.0, 2.0);

/// The error of steps below which round-off may count.
const ROUND_OFF: f64 = 2e-13;

/// A run on which both laws and the further invariants are kept to round-off.
fn kept<Y: Metriplectic>(
    name: &str,
    method: Stages,
    system: &Y,
    x0: &Point<Y>,
    span: impl Into<metriplectic::integrators::Schedule>,
) -> Trajectory<Y::Manifold> {
    let run = method.run(system, x0.clone(), span).expect(name);
    let c = run.certificate();
    let all = c.keeps_energy() && c.keeps_entropy() && c.keeps_invariants();
    assert!(all && c.max_manifold_defect < 1e-14, "{name}, {method:?}: {c}");
    assert!(c.stages.is_some_and(|stages| stages.defect < 1e-14), "{name}, {method:?}: {c}");
    run
}

/// The least error of outputs from which their order is fitted: less accurate states are compared with it.
const INSIDE: f64 = 10.0 * ROUND_OFF;

/// The orders of all methods at the end of a run and in the middle of its last step, with so many steps at the coarsest:
/// for Gauss 1 to 4, and for Radau 2 to 4.
fn orders<Y: Metriplectic>(
    name: &str,
    system: &Y,
    x0: &Point<Y>,
    time: f64,
    (of_gauss, of_radau): ([usize; 4], [usize; 3]),
) {
    let exact = |time: f64| {
        let fine = Span::until(time).tolerance(1e-14).at_most(2);
        DormandPrince8.run(system, x0.clone(), fine).expect(name).last().point.clone()
    };
    let end = exact(time);
    let methods = GAUSS.into_iter().zip(of_gauss).chain(RADAU.into_iter().zip(of_radau));
    for (method, coarsest) in methods {
        let counts = [4, 5, 6, 8, 10].map(|k| k * coarsest / 4);
        let steps = counts.map(|n| time / n as f64);
        let mut per_step = 0.0;
        let errors = counts.map(|n| {
            let h = time / n as f64;
            let middle = time - 0.5 * h;
            let span = Span::steps(h, n).output_at([middle, time]);
            let run = kept(name, method, system, x0, span);
            per_step = run.certificate().effort.iterations as f64 / n as f64;
            assert_eq!(run.certificate().effort.splits, 0, "{name}, {method:?}");
            let [.., inside, last] = run.states() else { panic!("{name}: two outputs") };
            let off = distance::<Y::Manifold>;
            [off(&last.point, &end), off(&inside.point, &exact(middle))]
        });
        let order = f64::from(Stepper::<Y>::order(&method));
        let [ends, insides] = [0, 1].map(|which| errors.map(|both| both[which]));
        for (place, errors, floor) in [("end", ends, ROUND_OFF), ("inside", insides, INSIDE)] {
            let above = steps.iter().zip(&errors).filter(|(_, error)| **error > floor);
            let (fine, small): (Vec<f64>, Vec<f64>) = above.unzip();
            if place == "inside" && small.len() < 3 {
                continue;
            }
            let fitted = slope(&steps, &errors, floor);
            println!(
                "{name}, {method:?}, {place}: {fitted:.2}, {errors:?}, {per_step:.1} residuals"
            );
            // Where production nearly vanishes in a step, as on gases whose heat turns round, a cubic has its entropy.
            let least = match place {
                "inside" if ["gas", "SO(3)"].contains(&name) => 2.8_f64.min(order - 0.4),
                "inside" => order - 0.4,
                _ => order - 0.3,
            };
            let shown = Order::fit(&fine, &small)
                .map_or_else(|_| format!("{fitted:.2}"), |order| order.to_string());
            Claim::new(Guarantee::Order, format!("{name}, {place}"), format!("{method:?}"))
                .against("DormandPrince8, tolerance 1e-14")
                .record(shown, format!("≥ {least:.1}"));
            assert!(fitted >= least, "{name}, {method:?}, {place}: {fitted:.2} from {errors:?}");
        }
    }
}

fn order_of<Y: Metriplectic>(_: &Y, method: Stages) -> u32 {
    Stepper::<Y>::order(&method)
}

fn spin() -> impl Metriplectic<Manifold = Sphere<2>, Metric = Canonical> {
    System::on(Sphere::<2>::round()).bracket(AreaForm).energy(top).build().expect("it is a system")
}

/// A direction that precesses and warms its surroundings.
fn warm_spin(
    kappa: f64,
) -> impl Metriplectic<Manifold = Product<Sphere<2>, Euclidean<1>>, Metric = Canonical> {
    type Warm = (Vector3<Real>, Vector1<Real>);
    System::on(Product(Sphere::<2>::round(), Euclidean::<1>))
        .bracket((AreaForm, Zero))
        .dissipation(Scaled(move |_: &Warm| Real::from(kappa), MetricDissipation))
        .energy(|(x, s): &Warm| x.z + x.x * x.x * 0.3 + s.x.exp() * 0.2)
        .entropy(|(_, s): &Warm| s.x)
        .build()
        .expect("it is a system")
}

const WARM: (Vector3<f64>, Vector1<f64>) = (Vector3::new(0.6, 0.0, 0.8), Vector1::new(0.0));

fn rotations() -> impl Metriplectic<Manifold = Rotations, Metric = Canonical> {
    System::on(Rotations::bi_invariant())
        .bracket(Nambu::default())
        .energy(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5)
        .entropy(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25)
        .build()
        .expect("it is a system")
}

fn turned() -> Matrix3<f64> {
    Rotations::bi_invariant().from_quaternion([0.8, 0.3, -0.4, 0.33]).expect("it is one")
}

#[test]
fn orders_on_lie_algebra_duals() {
    orders(
        "so(3)*",
        &relaxing_body(),
        &vector![0.3, -0.9, 0.2],
        30.0,
        ([64, 48, 32, 20], [48, 32, 20]),
    );
    let body = System::on(LieDual::se3())
        .energy(models::heavy)
        .entropy(models::alignment)
        .casimir(models::gamma_squared)
        .build()
        .expect("it is a system");
    orders("se(3)*", &body, &SVector::from(models::HEAVY), 4.0, ([32, 32, 16, 12], [32, 16, 12]));
}

#[test]
fn orders_on_spheres_and_products_with_them() {
    orders(
        "S²",
        &spin(),
        &Vector3::repeat(3_f64.sqrt().recip()),
        20.0,
        ([64, 64, 36, 36], [64, 36, 36]),
    );
    orders("S² × R", &warm_spin(1.0), &WARM, 6.0, ([64, 48, 40, 30], [48, 48, 28]));
    orders("SO(3)", &rotations(), &turned(), 0.4, ([32, 32, 16, 16], [32, 16, 16]));
}

/// The sign of `⟨dH, dS⟩` is that of the temperature, and it changes as this spin turns.
#[test]
fn orders_through_infinite_temperatures() {
    let spin = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.z + p.x * p.x * 0.5)
        .entropy(half_square)
        .dissipation(MetricDissipation::scaled(|_: &Vector3<Real>| Real::from(0.05)))
        .build()
        .expect("it is a system");
    let x0 = vector![0.3, 0.2, -0.05];
    let run = kept("spin", Radau3, &spin, &x0, Span::until(6.0).tolerance(1e-6));
    let inverse_temperatures = run.iter().map(|state| state.point.z + state.point.x.powi(2));
    let signs = inverse_temperatures.map(|beta| beta > 0.0).collect::<Vec<_>>();
    assert!(signs.windows(2).filter(|pair| pair[0] != pair[1]).count() >= 2, "{signs:?}");
    // Where a step goes from one side far to the other, it is taken in parts, which are no less accurate.
    let fine = Span::until(6.0).tolerance(1e-14).at_most(2);
    let exact = DormandPrince8.run(&spin, x0, fine).expect("it runs").last().point;
    for (method, coarsest) in RADAU.into_iter().zip([64, 72, 32]) {
        let counts = [4, 5, 6, 8, 10].map(|k| k * coarsest / 4);
        let errors = counts.map(|n| {
            let run = kept("spin", method, &spin, &x0, Span::steps(6.0 / n as f64, n));
            (run.last().point - exact).norm()
        });
        let fitted = slope(&counts.map(|n| 6.0 / n as f64), &errors, ROUND_OFF);
        println!("spin, {method:?}: {fitted:.2} from {errors:?}");
        let order = f64::from(order_of(&spin, method));
        assert!(fitted >= order - 0.3, "{method:?}: {fitted:.2} from {errors:?}");
    }
}

/// A pendulum beside a bath that it does not heat.
#[test]
fn orders_without_friction_where_the_entropy_is_constant() {
    let pendulum = System::on(Euclidean::<3>)
        .bracket(
            Poisson::constant(Matrix3::new(0., 1., 0., -1., 0., 0., 0., 0., 0.)).expect("skew"),
        )
        .energy(|x: &Vector3<Real>| x.y * x.y * 0.5 - x.x.cos() + x.z.exp())
        .entropy(|x: &Vector3<Real>| x.z)
        .dissipation(MetricDissipation::scaled(|_: &Vector3<Real>| Real::from(0.0)))
        .build()
        .expect("it is a system");
    let x0 = vector![2.0, 0.25, 0.125];
    orders("pendulum", &pendulum, &x0, 4.0, ([48, 32, 20, 16], [32, 20, 16]));
    for method in RADAU {
        let run = kept("pendulum", method, &pendulum, &x0, Span::until(4.0).tolerance(1e-5));
        let off = run.iter().map(|state| (state.entropy - 0.125).abs()).fold(0.0, f64::max);
        assert!(off <= f64::EPSILON, "{method:?}: {off:e}");
    }
}

#[test]
fn orders_on_gas_containers_and_with_a_listed_momentum() {
    orders("gas", &gas(0.5), &GAS, 2.0, ([64, 48, 24, 20], [48, 24, 36]));
    let pendulum = System::on(Euclidean::<10>)
        .bracket(Poisson::constant(models::pendulum_bracket()).expect("it is skew"))
        .energy(models::pendulum_energy)
        .entropy(|x: &models::State10| x[8] + x[9])
        .dissipation(FieldDissipation(models::heat_exchange))
        .momentum(models::angular_momentum)
        .build()
        .expect("it is a system");
    orders(
        "double pendulum",
        &pendulum,
        &SVector::from(models::PENDULUM),
        2.0,
        ([32, 24, 16, 12], [24, 16, 12]),
    );
}

/// A chart with a metric of its own.
fn bent() -> impl Metriplectic<Manifold = Chart<3>, Metric: Riemannian<Chart<3>>> {
    let metric = |x: &Vector3<Real>| {
        let [a, b] = [x.x * 0.3, x.y * 0.2];
        let (o, one) = (Real::from(0.0), Real::from(1.0));
        Matrix3::new(a * a + 1.0, a * b, o, a * b, b * b + 1.5, o, o, o, one + x.z * x.z * 0.1)
    };
    System::on(Chart::<3>::new(|x| x.norm() < 4.0))
        .metric(Metric::field(metric))
        .bracket(Nambu::default())
        .energy(|x: &Vector3<Real>| x.x * x.x * 0.5 + x.y * x.y + x.z * x.z * 1.5 + x.x * x.y * 0.3)
        .entropy(|x: &Vector3<Real>| x.norm_squared() * 0.5 + x.z * 0.2)
        .build()
        .expect("it is a system")
}

const BENT: Vector3<f64> = Vector3::new(0.5, -0.6, 0.4);

#[test]
fn orders_with_a_metric_of_its_own_and_on_a_manifold_of_a_user() {
    orders("chart", &bent(), &BENT, 4.0, ([48, 32, 16, 12], [32, 16, 16]));
    let globe = System::on(Globe)
        .metric(Metric::field(|_: &Vector3<Real>| Matrix3::identity()))
        .bracket(AreaForm)
        .energy(|x: &Vector3<Real>| x.z + x.x * x.x * 0.3 + x.y * x.x * 0.2)
        .build()
        .expect("it is a system");
    let start = Globe::point(vector![0.6, 0.0, 0.8]);
    orders("globe", &globe, &start, 12.0, ([64, 40, 24, 16], [40, 24, 16]));
}

/// How far the method of one stage is from a midpoint scheme after 100 steps.
fn apart<Y: Metriplectic, R: Retraction<Y::Manifold, Y::Metric>>(
    retraction: R,
    system: &Y,
    x0: &Point<Y>,
    h: f64,
) -> f64 {
    let span = Span::steps(h, 100).every(100);
    let scheme = Scheme::new(retraction).run(system, x0.clone(), span).expect("it runs");
    let stage = Gauss1.run(system, x0.clone(), span).expect("it runs");
    distance::<Y::Manifold>(&scheme.last().point, &stage.last().point)
}

#[test]
fn one_stage_is_the_scheme_of_the_paper() {
    let weyl = [
        apart(WeylMidpoint, &relaxing_body(), &vector![0.3, -0.9, 0.2], 0.1),
        apart(WeylMidpoint, &spin(), &Vector3::repeat(3_f64.sqrt().recip()), 0.1),
        apart(WeylMidpoint, &rotations(), &turned(), 0.002),
        apart(WeylMidpoint, &gas(0.5), &GAS, 0.02),
    ];
    let chart = apart(ChartMidpoint, &bent(), &BENT, 0.02);
    println!("{weyl:?}, {chart:.1e}");
    assert!(weyl.iter().all(|off| *off < 1e-13) && chart < 1e-13, "{weyl:?}, {chart:e}");
    // The scheme with the geodesics of that metric is another one.
    assert!(apart(WeylMidpoint, &bent(), &BENT, 0.02) > 1e-8);
}

/// The distance from the start after steps of `h` and of `−h`.
fn way_back<Y: Metriplectic>(method: impl Stepper<Y>, system: &Y, x: &Point<Y>, h: f64) -> f64 {
    let step = |x: &Point<Y>, h| {
        let (start, mut memory) = (StepStart::first(system, x), Default::default());
        method.step(&start, h, &mut memory).expect("it is taken").x
    };
    distance::<Y::Manifold>(x, &step(&step(x, h), -h))
}

#[test]
fn gauss_steps_lead_back() {
    for method in GAUSS {
        let back = [
            way_back(method, &spin(), &Vector3::repeat(3_f64.sqrt().recip()), 0.2),
            way_back(method, &rotations(), &turned(), 0.02),
            way_back(method, &gas(0.5), &GAS, 0.05),
            way_back(method, &warm_spin(0.1), &WARM, 0.1),
        ];
        println!("{method:?}: {back:?}");
        let worst = back.into_iter().fold(0.0, f64::max);
        Claim::new(
            Guarantee::Symmetry,
            "a step of h and one of −h: S², SO(3), S² × R, gas",
            format!("{method:?}"),
        )
        .against("the start")
        .record(scientific(worst), "1e-14");
        assert!(back.iter().all(|off| *off <= 1e-14), "{method:?}: {back:?}");
    }
    // Radau's nodes are not symmetric.
    assert!(way_back(Radau2, &gas(0.5), &GAS, 0.05) > 1e-8);
}

#[test]
fn midpoint_steps_lead_back() {
    let weyl = || Scheme::new(WeylMidpoint);
    let back = [
        way_back(weyl(), &spin(), &Vector3::repeat(3_f64.sqrt().recip()), 0.2),
        way_back(weyl(), &rotations(), &turned(), 0.02),
        way_back(weyl(), &gas(0.5), &GAS, 0.05),
        way_back(weyl(), &warm_spin(0.1), &WARM, 0.1),
    ];
    println!("WeylMidpoint: {back:?}");
    let worst = back.into_iter().fold(0.0, f64::max);
    let problem = "a step of h and one of −h: S², SO(3), S² × R, gas";
    Claim::new(Guarantee::Symmetry, problem, "WeylMidpoint")
        .against("the start")
        .record(scientific(worst), "1e-14");
    assert!(worst <= 1e-14, "{back:?}");
}

#[test]
fn weak_friction_keeps_both_laws() {
    for exponent in [2, 5, 8, 11, 13] {
        let kappa = 10_f64.powi(-exponent);
        let run = kept("S² × R", Gauss3, &warm_spin(kappa), &WARM, Span::steps(0.2, 2000));
        let gained = run.certificate().entropy_gained;
        Claim::new(
            Guarantee::Entropy,
            format!("spin with friction κ = 1e-{exponent}, S² × R"),
            "Gauss3",
        )
        .against("S of 2000 steps of 0.2")
        .record(format!("{} falls", run.certificate().entropy_falls), "0 falls");
        assert!(gained > 0.0, "κ = {kappa:e}: {gained:e}");
    }
    let run = kept("S² × R", Gauss3, &warm_spin(0.0), &WARM, Span::steps(0.2, 2000));
    assert!(run.certificate().entropy_gained.abs() <= 2e-15, "{}", run.certificate());
}

/// The errors of energy and entropy of a run without friction, relative to their scales.
fn drift(steps: usize) -> [f64; 2] {
    let span = Span::steps(0.2, steps).at_most(1000);
    let run = kept("S² × R", Gauss2, &warm_spin(0.0), &WARM, span);
    let c = run.certificate();
    println!("{steps} steps: {c}");
    let of_entropy = run.iter().map(|state| state.entropy.abs()).fold(0.0, f64::max);
    [c.max_energy_error / c.energy_scale, of_entropy]
}

#[test]
fn nothing_drifts_in_many_steps() {
    let [energy, entropy] = drift(50_000);
    let claim = |guarantee| {
        Claim::new(guarantee, "spin without friction, S² × R, 50 000 steps of 0.2", "Gauss2")
    };
    claim(Guarantee::Energy)
        .against("H at the start, relative to its terms")
        .record(scientific(energy), "2e-15");
    claim(Guarantee::Entropy).against("S at the start").record(scientific(entropy), "2e-15");
    assert!(energy <= 2e-15 && entropy <= 2e-15, "{energy:e}, {entropy:e}");
}

#[test]
#[ignore = "slow study: a million steps"]
fn nothing_drifts_in_a_million_steps() {
    let [energy, entropy] = drift(1_000_000);
    assert!(energy <= 2e-15 && entropy <= 2e-15, "{energy:e}, {entropy:e}");
}

/// At errors of 10⁻⁸ three stages cost at most 5.5 residuals.
#[test]
fn a_step_costs_few_residuals() {
    let cost = |run: Result<Certificate, ()>| {
        let c = run.expect("it runs");
        c.effort.iterations as f64 / c.steps as f64
    };
    let body = Gauss3.run(&relaxing_body(), vector![0.3, -0.9, 0.2], Span::steps(0.75, 40));
    let gas = Gauss3.run(&gas(0.5), GAS, Span::steps(2.0 / 50.0, 50));
    let group = Gauss3.run(&rotations(), turned(), Span::steps(0.4 / 32.0, 32));
    let costs = [
        cost(body.map(|run| run.certificate().clone()).map_err(|_| ())),
        cost(gas.map(|run| run.certificate().clone()).map_err(|_| ())),
        cost(group.map(|run| run.certificate().clone()).map_err(|_| ())),
    ];
    println!("{costs:.2?}");
    assert!(costs.iter().all(|cost| *cost <= 5.5), "{costs:?}");
}

/// Two spins with an isotropic coupling and an anisotropy: `J_z` is conserved, and not listed.
fn two_spins() -> impl Metriplectic<Manifold = Product<Sphere<2>, Sphere<2>>, Metric = Canonical> {
    type Spins = (Vector3<Real>, Vector3<Real>);
    System::on(Product(Sphere::<2>::round(), Sphere::<2>::round()))
        .bracket((AreaForm, AreaForm))
        .energy(|(a, b): &Spins| a.dot(b) + a.z * a.z * 0.4 - b.z * b.z * 0.3 + a.z * 0.5)
        .build()
        .expect("it is a system")
}

const SPINS: (Vector3<f64>, Vector3<f64>) =
    (Vector3::new(0.6, 0.0, 0.8), Vector3::new(0.0, 0.28, -0.96));

/// The largest error of `J_z` in the first and the second half of a run of steps of 0.2.
fn momentum(method: Stages, steps: usize) -> [f64; 2] {
    let span = Span::steps(0.2, steps).every(20);
    worst_momentum(&kept("two spins", method, &two_spins(), &SPINS, span))
}

fn worst_momentum(run: &Trajectory<Product<Sphere<2>, Sphere<2>>>) -> [f64; 2] {
    let errors: Vec<f64> =
        run.iter().map(|state| (state.point.0.z + state.point.1.z + 0.16).abs()).collect();
    let worst = |errors: &[f64]| errors.iter().copied().fold(0.0, f64::max);
    let (first, second) = errors.split_at(errors.len() / 2);
    [worst(first), worst(second)]
}

#[test]
fn a_momentum_that_is_not_listed_stays_bounded() {
    let [first, second] = momentum(Gauss2, 20_000);
    println!("{first:.1e}, {second:.1e}");
    assert!(second <= 1e-5 && second <= 1.2 * first, "{first:e}, {second:e}");
    // Methods that are not reversible do not bound it.
    let [first, second] = momentum(Radau2, 20_000);
    println!("{first:.1e}, {second:.1e}");
    assert!(second > 1.5 * first, "{first:e}, {second:e}");
    let span = Span::steps(0.2, 20_000).every(20);
    let [first, second] = worst_momentum(&DormandPrince5.run(&two_spins(), SPINS, span).unwrap());
    println!("{first:.1e}, {second:.1e}");
    assert!(second > 1.5 * first, "{first:e}, {second:e}");
}

#[test]
#[ignore = "slow study: a hundred thousand steps"]
fn a_momentum_that_is_not_listed_stays_bounded_for_long() {
    let [first, second] = momentum(Gauss2, 100_000);
    println!("{first:.1e}, {second:.1e}");
    assert!(second <= 1e-5 && second <= 1.1 * first, "{first:e}, {second:e}");
}

#[test]
fn they_keep_the_laws_of_a_method() {
    for (method, h) in [(Gauss2, 0.3), (Gauss3, 0.8), (Radau2, 0.2), (Radau3, 0.5)] {
        laws::method(method, &relaxing_body(), &vector![0.3, -0.9, 0.2], h).expect("they hold");
    }
    laws::method(Gauss2, &warm_spin(0.3), &WARM, 0.1).expect("they hold");
}

/// Steps that follow a tolerance, outputs between them, and a run that is resumed.
#[test]
fn adaptive_runs_have_what_every_run_has() {
    let exact = DormandPrince8.run(&gas(0.5), GAS, Span::until(5.0).tolerance(1e-14)).unwrap();
    for method in [Gauss2, Gauss4, Radau3] {
        let errors = [4, 6, 8].map(|k| {
            let span = Span::until(5.0).tolerance(10_f64.powi(-k));
            let run = kept("gas", method, &gas(0.5), &GAS, span);
            (run.last().point - exact.last().point).norm()
        });
        println!("{method:?}: {errors:?}");
        let ratios = errors.windows(2).map(|pair| format!("{:.0}", pair[0] / pair[1]));
        Claim::new(
            Guarantee::Tolerance,
            "gas containers: errors over two decades",
            format!("{method:?}"),
        )
        .against("DormandPrince8, tolerance 1e-14")
        .record(ratios.collect::<Vec<_>>().join(", "), "12 to 600 for 100");
        // Two decades of the tolerance are two decades of the error, but for a factor.
        for pair in errors.windows(2) {
            assert!((12.0..600.0).contains(&(pair[0] / pair[1])), "{method:?}: {errors:?}");
        }
        let times: Vec<f64> = (1..=99).map(|k| f64::from(k) * 0.05).collect();
        let span = Span::until(5.0).tolerance(1e-6).output_at(times);
        let dense = kept("gas", method, &gas(0.5), &GAS, span);
        let states: Vec<_> = dense.iter().collect();
        let energy = dense.certificate().initial_energy;
        for pair in states.windows(2) {
            assert!(pair[1].entropy >= pair[0].entropy - 4e-15, "{method:?}, t = {}", pair[1].time);
            assert!((pair[1].energy - energy).abs() <= 2e-14, "{method:?}, t = {}", pair[1].time);
        }
    }
    let system = gas(0.5);
    let span = Span::until(5.0).tolerance(1e-6);
    let whole = Radau3.run(&system, GAS, span).unwrap();
    let mut steps = Radau3.steps(&system, GAS, span).unwrap();
    for _ in 0..10 {
        steps.advance().unwrap();
    }
    let resumed = Radau3.resume(&system, &steps.checkpoint()).unwrap().run().unwrap();
    assert_eq!(resumed.last(), whole.last());
    assert_eq!(resumed.certificate(), whole.certificate());
}

/// The same motion in a chart of the sphere and in the space around it.
#[test]
fn a_tolerance_asks_for_as_many_steps_on_a_sphere_as_around_it() {
    let around = System::on(LieDual::so3())
        .energy(top)
        .casimir(half_square)
        .build()
        .expect("the square of the momentum is a Casimir");
    let x0 = Vector3::repeat(3_f64.sqrt().recip());
    for method in [Gauss2, Gauss3] {
        let span = Span::until(40.0).tolerance(1e-6);
        let [on, off] = [
            kept("S²", method, &spin(), &x0, span).certificate().steps,
            kept("so(3)*", method, &around, &x0, span).certificate().steps,
        ];
        println!("{method:?}: {on} steps on the sphere, {off} around it");
        assert!((0.7..1.4).contains(&(on as f64 / off as f64)), "{method:?}: {on}, {off}");
    }
}

/// The defect of the polynomial of `s` stages at an end is `O(h^s)` in a chart that is curved too.
#[test]
fn the_estimated_error_has_its_order_on_a_sphere() {
    let (system, x) = (spin(), vector![0.48, 0.36, -0.8]);
    for (method, stages) in [(Gauss2, 2), (Gauss3, 3), (Gauss4, 4), (Radau3, 3), (Radau4, 4)] {
        let sizes = [0.1, 0.07, 0.05, 0.035];
        let errors = sizes.map(|h| {
            let (start, mut memory) = (StepStart::first(&system, &x), StageMemory::default());
            let taken = method.step(&start, h, &mut memory).expect("it is taken");
            let values = [&start.values, &taken.values];
            let step = StepEnds {
                flow: &system,
                x: &x,
                end: &taken.x,
                h,
                values,
                reference: &start.values,
            };
            let norm = |v: &Components<Vector2<f64>>| v.0.norm();
            Stepper::<_>::error(&method, &step, &memory, norm).expect("it has an estimate")
        });
        let order = Order::fit(&sizes, &errors).expect("four errors");
        println!("{method:?}: {order} from {errors:?}");
        assert!(order.agrees(f64::from(stages + 1), 0.3), "{method:?}: {order} from {errors:?}");
    }
}
