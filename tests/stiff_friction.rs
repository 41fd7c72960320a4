//! Friction that is much faster than a step: Radau's methods damp it with both laws, and every other method is right,
//! names the cause in an error, or says in its certificate that friction is not damped.

use metriplectic::dynamics::system::Point;
use metriplectic::integrators::Schedule;
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee, scientific};

mod models;
#[path = "models/stages.rs"]
mod stages;

use models::gas;
use stages::*;

fn off<M: Manifold>(x: &M::Point<f64>, exact: &[f64]) -> f64 {
    M::entries(x).iter().zip(exact).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// The run of a Radau method, which keeps both laws and damps.
fn damped<Y: Metriplectic>(
    name: &str,
    method: Stages,
    system: &Y,
    x0: &Point<Y>,
    span: impl Into<Schedule>,
) -> Trajectory<Y::Manifold> {
    let run = method.run(system, x0.clone(), span).expect(name);
    let c = run.certificate();
    assert!(c.keeps_energy() && c.keeps_entropy() && !c.is_stiff(), "{name}, {method:?}: {c}");
    assert!(!c.to_string().contains("not damped"), "{name}, {method:?}: {c}");
    run
}

/// Whether a run is wrong without a word: an `Ok` that is off, and a certificate that does not say so.
fn is_silent<M: Manifold>(
    run: Result<Trajectory<M>, RunError<M>>,
    is_right: impl Fn(&M::Point<f64>) -> bool,
) -> bool {
    run.is_ok_and(|run| {
        let says = run.certificate().to_string().contains("friction not damped");
        !says && !is_right(&run.last().point)
    })
}

/// Gas containers whose wall leaks heat so fast that their temperatures are one, from a start 10⁻² off that.
#[test]
fn gas_containers_with_a_wall_that_leaks_fast() {
    let start = vector![1.0, 2.0, 2.01, 1.99];
    for (alpha, bounds) in [(1e4, [3e-5, 1e-6, 4e-8, 1e-9]), (1e6, [3e-5, 1e-6, 4e-8, 1e-9])] {
        let system = gas(alpha);
        let fine = Span::until(2.0).tolerance(1e-11).at_most(2);
        let exact = damped("gas", Radau4, &system, &start, fine).last().point;
        if alpha < 1e5 {
            // Another method agrees.
            let explicit =
                DormandPrince8.run(&system, start, Span::until(2.0).tolerance(1e-11)).unwrap();
            assert!((explicit.last().point - exact).norm() < 1e-10);
        }
        let errors = [40, 80, 160, 320].map(|n| {
            let run =
                damped("gas", Radau3, &system, &start, Span::steps(2.0 / f64::from(n), n as usize));
            (run.last().point - exact).norm()
        });
        println!("α = {alpha:e}: {errors:?}");
        for ((error, bound), n) in errors.iter().zip(bounds).zip([40, 80, 160, 320]) {
            let problem = format!("gas containers, α = {alpha:e}, T = 2, {n} steps");
            Claim::new(Guarantee::StiffFriction, problem, "Radau3")
                .against("Radau4, tolerance 1e-11")
                .record(scientific(*error), scientific(bound));
        }
        assert!(errors.iter().zip(bounds).all(|(error, bound)| *error <= bound), "{errors:?}");
        // The temperatures of a Gauss method stay apart.
        let run = Gauss3.run(&system, start, Span::steps(0.05, 40)).unwrap();
        assert!((run.last().point - exact).norm() > 10.0 * errors[0]);
        assert!(run.certificate().is_stiff(), "{}", run.certificate());
        // Near the slow motion, and far from it.
        for start in [start, vector![1.0, 2.0, 1.5, 2.5]] {
            for h in [10.0 / alpha, 1e-3, 1e-2] {
                let fine = Span::until(20.0 * h).tolerance(1e-10).at_most(2);
                let exact = damped("gas", Radau4, &system, &start, fine).last().point;
                for method in RADAU {
                    let end =
                        damped("gas", method, &system, &start, Span::steps(h, 20)).last().point;
                    assert!((end - exact).norm() <= 1e-3, "α = {alpha:e}, h = {h:e}, {method:?}");
                }
            }
            // Steps longer than the motion of the wall damp it too: all energy becomes heat.
            for h in [10.0, 100.0, 1000.0] {
                for method in RADAU {
                    let end =
                        damped("gas", method, &system, &start, Span::steps(h, 60)).last().point;
                    let rest = vector![1.0, 0.0, 3.0, 3.0];
                    assert!((end - rest).norm() <= 1e-3, "α = {alpha:e}, h = {h}, {method:?}");
                }
            }
        }
    }
}

/// The entropy is a logarithm of `U₁U₂`, which is defined where both energies are negative too.
#[test]
fn a_step_that_is_longer_than_the_motion_keeps_its_temperatures_positive() {
    let system = gas(1e4);
    for method in RADAU {
        let run =
            damped("gas", method, &system, &vector![1.0, 2.0, 2.01, 1.99], Span::steps(1.0, 60));
        assert!(run.iter().all(|state| state.point.z > 0.0 && state.point.w > 0.0), "{method:?}");
    }
}

/// The deviation `y` of a stiff component that is left after one step, with `S = −λy²/2` and the energy elsewhere.
#[test]
fn one_step_damps_a_stiff_component() {
    let lambda = 1e3;
    let system = System::on(Euclidean::<2>)
        .energy(|x: &Vector2<Real>| x.y)
        .entropy(move |x: &Vector2<Real>| x.x * x.x * (-0.5 * lambda) + x.y)
        .dissipation(FieldDissipation(|_: &Vector2<Real>, w: &Vector2<Real>| {
            // The covector of the energy annihilates the velocity along the other axis.
            let b = Vector2::new(w.y, -w.x);
            b * b.transpose()
        }))
        .build()
        .unwrap();
    let start = vector![1e-3, 1.0];
    let left = |method: Stages| {
        let run = method.run(&system, start, Span::steps(1.0, 1)).unwrap();
        assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
        (run.last().point.x / start.x).abs()
    };
    let (radau, gauss) = (RADAU.map(left), GAUSS.map(left));
    println!("{radau:?}, {gauss:?}");
    let methods = GAUSS.iter().zip(gauss).chain(RADAU.iter().zip(radau));
    for (index, (method, left)) in methods.enumerate() {
        let bound = if index < GAUSS.len() { "0.9 to 1: not damped" } else { "0.01" };
        let problem = "a deviation after one step of h|K'| = 1000";
        Claim::new(Guarantee::StiffFriction, problem, format!("{method:?}"))
            .against("the deviation before the step")
            .record(format!("{left:.4}"), bound);
    }
    assert!(radau.iter().all(|left| *left <= 0.01), "{radau:?}");
    // With an exact balance of the entropy nothing is damped.
    assert!(gauss.iter().all(|left| (0.9..1.0).contains(left)), "{gauss:?}");
}

fn energy(t: Real) -> Real {
    t + t * t * 0.5
}

fn entropy(t: Real) -> Real {
    t.ln() + t
}

fn conduction(w: &Vector2<Real>) -> Matrix2<Real> {
    let b = Vector2::new(w.x.recip(), -w.y.recip());
    b * b.transpose() * Real::from(1e6)
}

type Two = Vector2<Real>;

/// Two temperatures that exchange heat with `K = 10⁶ b bᵀ`, as numbers.
fn two_temperatures() -> impl Metriplectic<Manifold = Euclidean<2>, Metric = Canonical> {
    System::on(Euclidean::<2>)
        .energy(|x: &Two| energy(x.x) + energy(x.y))
        .entropy(|x: &Two| entropy(x.x) + entropy(x.y))
        .dissipation(FieldDissipation(|_: &Two, w: &Two| conduction(w)))
        .build()
        .expect("it is a system")
}

/// The temperature at which two bodies come to rest: `2(T + T²/2)` is the energy.
fn at_rest(start: [f64; 2]) -> f64 {
    let total: f64 = start.iter().map(|t| t + 0.5 * t * t).sum();
    (1.0 + total).sqrt() - 1.0
}

/// From a temperature of 0.01 the first step is up to 10¹³ times as long as the fast time.
#[test]
fn two_temperatures_come_together() {
    type P = (Vector1<Real>, Vector1<Real>);
    let flat = two_temperatures();
    let positive = System::on(Product(HalfLine, HalfLine))
        .energy(|x: &P| energy(x.0.x) + energy(x.1.x))
        .entropy(|x: &P| entropy(x.0.x) + entropy(x.1.x))
        .dissipation(FieldDissipation(|_: &P, w: &Two| conduction(w)))
        .build()
        .unwrap();
    for (cold, hot, finest) in [(1.0, 3.0, -5), (0.01, 3.0, -4)] {
        let rest = at_rest([cold, hot]);
        let near = |t: [f64; 2]| t.iter().all(|t| (t - rest).abs() <= 1e-3);
        let (x, p) = (vector![cold, hot], (vector![cold], vector![hot]));
        for exponent in finest..=3 {
            let span = Span::steps(10_f64.powi(exponent), 20);
            for method in RADAU {
                let run = damped("R × R", method, &flat, &x, span);
                assert!(near(run.last().point.into()), "h = 1e{exponent}: {}", run.last().point);
                let run = damped("R₊ × R₊", method, &positive, &p, span);
                let (a, b) = &run.last().point;
                assert!(near([a.x, b.x]), "h = 1e{exponent}: {a}, {b}");
            }
            for method in [Gauss2, Gauss3] {
                let silent = is_silent(method.run(&flat, x, span), |x| near((*x).into()));
                assert!(!silent, "{method:?}, {cold}, h = 1e{exponent}");
                let silent = is_silent(method.run(&positive, p, span), |(a, b)| near([a.x, b.x]));
                assert!(!silent, "{method:?}, R₊ × R₊, {cold}, h = 1e{exponent}");
            }
            let silent = is_silent(WeylMidpoint.run(&flat, x, span), |x| near((*x).into()));
            assert!(!silent, "midpoint, h = 1e{exponent}");
        }
    }
}

/// Outputs and events inside a step that is taken in parts, and a run that is resumed after it.
#[test]
fn stiff_steps_have_outputs_and_events() {
    let (system, start, h) = (two_temperatures(), vector![0.01, 3.0], 1.0);
    let rest = at_rest([0.01, 3.0]);
    let schedule = || {
        let near = |x: &Vector2<f64>| x.x - 0.9 * x.y;
        Span::steps(h, 4).output_every(h / 8.0).event("near", near)
    };
    let run = damped("outputs", Radau3, &system, &start, schedule());
    let states: Vec<_> = run.iter().collect();
    assert_eq!(states.len(), 33);
    let energy = run.certificate().initial_energy;
    for pair in states.windows(2) {
        // Values of both laws have a few roundings.
        let risen = pair[1].entropy - pair[0].entropy;
        assert!(risen >= -4.0 * f64::EPSILON * pair[0].entropy.abs(), "t = {}", pair[1].time);
        let off = (pair[1].energy - energy).abs();
        assert!(off <= 8.0 * f64::EPSILON * energy, "t = {}: {off:e}", pair[1].time);
        // The transient is over after 10⁻⁵.
        let off = pair[1].point.add_scalar(-rest).norm();
        assert!(off <= 1e-2, "t = {}: {off:e}", pair[1].time);
    }
    let [event] = run.events() else { panic!("{} events", run.events().len()) };
    let ratio = event.state.point.x / event.state.point.y;
    assert!((ratio - 0.9).abs() <= 1e-9 && event.state.time < 0.125 * h, "{event:?}");
    // Adaptive steps know when it is.
    let time = |run: Trajectory<Euclidean<2>>| run.events()[0].state.time;
    let span = || Span::until(1e-3).tolerance(1e-8).at_most(2);
    let near = |x: &Vector2<f64>| x.x - 0.9 * x.y;
    let radau = time(damped("event", Radau3, &system, &start, span().event("near", near)));
    let explicit = time(DormandPrince8.run(&system, start, span().event("near", near)).unwrap());
    assert!((radau / explicit - 1.0).abs() <= 1e-5, "{radau:e}, {explicit:e}");
    for put_down in 1..4 {
        let mut steps = Radau3.steps(&system, start, schedule()).unwrap();
        let mut seen = vec![(0.0, start)];
        for _ in 0..put_down {
            steps.advance().unwrap();
            seen.extend(steps.outputs().map(|state| (state.time, state.point)));
        }
        let resumed = Radau3.resume(&system, &steps.checkpoint()).unwrap();
        let resumed = resumed.watching(schedule()).unwrap();
        seen.extend(resumed.map(|state| state.unwrap()).map(|state| (state.time, state.point)));
        let whole: Vec<_> = states.iter().map(|state| (state.time, state.point)).collect();
        assert_eq!(seen, whole, "{put_down}");
    }
}

/// An overdamped oscillator with its internal energy: `x' = p`, `p' = −x − γp`, `e' = γp²`. A kick of the momentum `p`
/// moves it by `p/γ`, and the slow decay is `e^{−t/γ}`.
#[test]
fn an_overdamped_oscillator_decays_slowly() {
    for gamma in [1e7, 1e8] {
        let canonical = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let system = System::on(Euclidean::<3>)
            .bracket(Poisson::constant(canonical).unwrap())
            .energy(|x: &Vector3<Real>| (x.x * x.x + x.y * x.y) * 0.5 + x.z)
            .entropy(|x: &Vector3<Real>| x.z)
            .dissipation(FieldDissipation(move |_: &Vector3<Real>, w: &Vector3<Real>| {
                let b = Vector3::new(Real::from(0.0), w.z, -w.y);
                b * b.transpose() * (w.z.recip() * gamma)
            }))
            .build()
            .unwrap();
        // On the slow manifold, and off it.
        for momentum in [-1.0 / gamma, 0.5] {
            for h in [10.0 / gamma, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3, 0.1 * gamma] {
                let (start, time) = (vector![1.0, momentum, 1.0], 20.0 * h);
                let x = (1.0 + momentum.max(0.0) / gamma) * (-time / gamma).exp();
                let heat = 0.5 * (1.0 - x * x) + 0.5 * momentum * momentum;
                let exact = [x, -x / gamma, 1.0 + heat];
                for method in [Radau2, Radau3, Radau4] {
                    let run = damped("oscillator", method, &system, &start, Span::steps(h, 20));
                    let off = off::<Euclidean<3>>(&run.last().point, &exact);
                    assert!(off <= 1e-3, "γ = {gamma:e}, p = {momentum:e}, h = {h:e}: {off:e}");
                }
                let right = |x: &Vector3<f64>| off::<Euclidean<3>>(x, &exact) <= 1e-3;
                for silent in [
                    is_silent(Gauss3.run(&system, start, Span::steps(h, 20)), right),
                    is_silent(WeylMidpoint.run(&system, start, Span::steps(h, 20)), right),
                ] {
                    assert!(!silent, "γ = {gamma:e}, p = {momentum:e}, h = {h:e}");
                }
            }
        }
    }
}

/// Two bodies of constant heat capacity that exchange heat at the rate 10⁸, `H = T₁ + 2T₂`.
#[test]
fn heat_is_exchanged_in_steps_of_any_size() {
    type X = Vector2<Real>;
    let system = System::on(Euclidean::<2>)
        .energy(|x: &X| x.x + x.y * 2.0)
        .entropy(|x: &X| x.x.ln() + x.y.ln() * 2.0)
        .dissipation(FieldDissipation(|x: &X, w: &X| {
            let b = Vector2::new(w.y, -w.x);
            b * b.transpose() * (x.x * x.y * 1e8)
        }))
        .build()
        .unwrap();
    let starts = [vector![300.0, 360.0], vector![1.0, 509.5]];
    for (start, exponent) in starts.into_iter().flat_map(|x| (-3..=3).map(move |k| (x, k))) {
        let span = Span::steps(10_f64.powi(exponent), 10);
        let near = |x: &Vector2<f64>| x.iter().all(|t| (t - 340.0).abs() <= 0.34);
        for method in RADAU {
            let run = damped("heat exchange", method, &system, &start, span);
            assert!(near(&run.last().point), "{method:?}, h = 1e{exponent}: {}", run.last().point);
        }
        for method in [Gauss1, Gauss2] {
            assert!(!is_silent(method.run(&system, start, span), near), "{method:?}, 1e{exponent}");
        }
    }
}

/// A damped oscillator whose entries, times and energies are so many times those of the one without units.
fn oscillator(units: [f64; 3], time: f64) -> impl Metriplectic<Manifold = Euclidean<3>> {
    let [a, b, c] = units;
    let (rate, zero) = (a * b / time, 0.0);
    let canonical = Matrix3::new(zero, rate, zero, -rate, zero, zero, zero, zero, zero);
    let metric = Matrix3::from_diagonal(&vector![a.powi(-2), b.powi(-2), c.powi(-2)]);
    System::on(Euclidean::<3>)
        .metric(Metric::constant(metric).expect("it is positive"))
        .bracket(Poisson::constant(canonical).expect("it is skew"))
        .energy(move |x: &Vector3<Real>| {
            ((x.x / a).powi(2) + (x.y / b).powi(2)) * 0.5 + (x.z / c).exp()
        })
        .entropy(move |x: &Vector3<Real>| x.z / c)
        .dissipation(FieldDissipation(move |_: &Vector3<Real>, w: &Vector3<Real>| {
            let force = Vector3::new(Real::from(0.0), w.z * (b * c), -w.y * (b * c));
            force * force.transpose() * ((w.z * c).recip() * (100.0 / time))
        }))
        .build()
        .expect("it is a system")
}

/// Steps are the same numbers in other units, up to the order of the pivots of a stiff step.
#[test]
fn units_change_nothing() {
    use metriplectic::integrators::laws::{UnitRun, Units, scaling};
    let plain = oscillator([1.0; 3], 1.0);
    let start = vector![1.0, 0.5, 0.0];
    let (a, b, c, time) = (2_f64.powi(-30), 2_f64.powi(-80), 2_f64.powi(-70), 2_f64.powi(-43));
    let scaled = oscillator([a, b, c], time);
    let units = Units { entries: vec![a, b, c], time, energy: 1.0, entropy: 1.0 };
    for method in [Gauss2, Radau3] {
        let large = UnitRun { system: &plain, x0: start, course: Span::steps(0.1, 40).into() };
        let small = UnitRun {
            system: &scaled,
            x0: vector![a, 0.5 * b, 0.0],
            course: Span::steps(0.1 * time, 40).into(),
        };
        scaling(&method, &large, &small, &units, 1e-14).unwrap();
    }
}

/// A constant in the energy takes digits from its values, and none from the temperatures.
#[test]
fn a_constant_in_the_energy_moves_no_heat() {
    for constant in [0.0, 1e6, 1e10] {
        let system = System::on(Euclidean::<2>)
            .energy(move |t: &Vector2<Real>| t.x + t.y * 2.0 + constant)
            .entropy(|t: &Vector2<Real>| t.x.ln() + t.y.ln() * 2.0)
            .dissipation(FieldDissipation(|t: &Vector2<Real>, w: &Vector2<Real>| {
                let b = vector![w.y, -w.x];
                b * b.transpose() * (t.x * t.y / 6.0)
            }))
            .build()
            .unwrap();
        for h in [1e-3, 1e-7] {
            let steps = 20_000;
            let exact = 300.0 + 40.0 * (1.0 - (-h * f64::from(steps)).exp());
            let run = damped(
                "two temperatures",
                Radau2,
                &system,
                &vector![300.0, 360.0],
                Span::steps(h, steps as usize),
            );
            let error = (run.last().point.x - exact).abs();
            assert!(error < 1e-11, "constant {constant:e}, h = {h:e}: {error:e}");
        }
    }
}

/// A gas below a piston with friction: the energy that an unresolved transient loses warms the gas and leaves the
/// piston where the motion has it, in every unit of its height. The velocity decays like `exp(−γt)`, so the height
/// changes by `v₀/γ` and then slowly with the pressure.
#[test]
fn heat_moves_no_length() {
    for unit in [1e-3, 1.0, 1e3] {
        for friction in [1e4, 1e6] {
            let system = System::on(Euclidean::<3>)
                .bracket(
                    Nambu::default().times(move |x: &Vector3<Real>| x.z * (-1.0 / (1.5 * unit))),
                )
                .energy(move |x: &Vector3<Real>| x.x * unit + x.y.powi(2) * 0.5 + x.z)
                .entropy(|x: &Vector3<Real>| x.x.ln() + x.z.ln() * 1.5)
                .dissipation(FieldDissipation(move |x: &Vector3<Real>, w: &Vector3<Real>| {
                    let b = Vector3::new(Real::from(0.0), w.z, -w.y);
                    b * b.transpose() * (x.z * friction / 1.5)
                }))
                .build()
                .unwrap();
            let start = vector![1.0 / unit, 0.1, 1.5];
            let run = damped("piston", Radau3, &system, &start, Span::steps(1.0, 1));
            let moved = (run.last().point.x * unit - 1.0).abs();
            assert!(moved < 0.3 / friction, "{unit:e}, {friction:e}: {moved:e}");
        }
    }
}

type State6 = SVector<f64, 6>;
type Real6 = SVector<Real, 6>;

/// Heat capacities, temperatures at the start and conductances of a row of six bodies.
const CAPACITIES: [f64; 6] = [1.0, 2.0, 1.5, 3.0, 0.7, 2.2];
const WARM: [f64; 6] = [300.0, 340.0, 280.0, 390.0, 310.0, 260.0];
const CONDUCTANCES: [f64; 5] = [1e5, 1e-5, 1e2, 1e-2, 1e-5];

/// `K = Σ r_i b_i b_iᵀ` with the rate `r_i` of each bond.
fn conducted(w: &Real6, rate: impl Fn(usize) -> Real) -> SMatrix<Real, 6, 6> {
    let mut k = SMatrix::<Real, 6, 6>::zeros();
    for i in 0..5 {
        let mut b = Real6::zeros();
        (b[i], b[i + 1]) = (w[i + 1], -w[i]);
        k += b * b.transpose() * rate(i);
    }
    k
}

/// The exact temperatures: `C_i T_i' = Σ κ_ij (T_j − T_i)` is linear.
fn conducted_until(t: f64) -> State6 {
    let root = State6::from_fn(|i, _| CAPACITIES[i].sqrt());
    let mut rates = SMatrix::<f64, 6, 6>::zeros();
    for (i, kappa) in CONDUCTANCES.into_iter().enumerate() {
        let mut b = State6::zeros();
        (b[i], b[i + 1]) = (root[i].recip(), -root[i + 1].recip());
        rates += b * b.transpose() * kappa;
    }
    let modes = rates.symmetric_eigen();
    let start: State6 = modes.eigenvectors.transpose() * root.component_mul(&State6::from(WARM));
    let end: State6 = start.zip_map(&modes.eigenvalues, |u, rate| u * (-rate * t).exp());
    let end: State6 = modes.eigenvectors * end;
    end.component_div(&root)
}

#[test]
fn heat_of_a_transient_that_no_step_resolves_is_named() {
    let by_entropies = System::on(Euclidean::<6>)
        .energy(|s: &Real6| {
            (0..6).map(|i| (s[i] / CAPACITIES[i]).exp() * CAPACITIES[i]).sum::<Real>()
        })
        .entropy(|s: &Real6| s.sum())
        .dissipation(FieldDissipation(|_: &Real6, w: &Real6| {
            conducted(w, |i| (w[i] * w[i + 1]).recip() * CONDUCTANCES[i])
        }))
        .build()
        .expect("six bodies are a system");
    let by_energies = System::on(Euclidean::<6>)
        .energy(|e: &Real6| e.sum())
        .entropy(|e: &Real6| {
            (0..6).map(|i| (e[i] / CAPACITIES[i]).ln() * CAPACITIES[i]).sum::<Real>()
        })
        .dissipation(FieldDissipation(|e: &Real6, w: &Real6| {
            conducted(w, |i| {
                e[i] * e[i + 1] * (CONDUCTANCES[i] / (CAPACITIES[i] * CAPACITIES[i + 1]))
            })
        }))
        .build()
        .expect("six bodies are a system");
    let entropies = State6::from_fn(|i, _| CAPACITIES[i] * WARM[i].ln());
    let energies = State6::from_fn(|i, _| CAPACITIES[i] * WARM[i]);
    // The course, its end, and the largest error in kelvins of the entropies and of the energies as variables.
    let courses: [(Schedule, f64, [f64; 2]); 4] = [
        (Span::steps(1e-2, 20).into(), 0.2, [0.5, 1e-7]),
        (Span::steps(0.1, 20).into(), 2.0, [3.0, 1e-9]),
        (Span::steps(1.0, 20).into(), 20.0, [4.0, 2e-6]),
        (Span::until(2.0).tolerance(1e-6).into(), 2.0, [2e-5, 2e-8]),
    ];
    for (index, (schedule, t, bounds)) in courses.into_iter().enumerate() {
        let exact = conducted_until(t);
        for method in RADAU {
            let start = [entropies, energies];
            let runs = [
                damped("entropies", method, &by_entropies, &start[0], schedule.clone()),
                damped("energies", method, &by_energies, &start[1], schedule.clone()),
            ];
            let ends = [
                runs[0].last().point.zip_map(&CAPACITIES.into(), |s, c| (s / c).exp()),
                runs[1].last().point.zip_map(&CAPACITIES.into(), |e, c| e / c),
            ];
            let off = ends.map(|end| (end - exact).amax());
            println!("{method:?}, course {index}: {off:?} K");
            let c = runs[0].certificate();
            assert!(off[0] < bounds[0] && off[1] < bounds[1], "{method:?}, {index}: {off:?}");
            // A known deficiency: heat of a transient that no step resolves is shared by the metric. One run of the longest
            // steps is solved in parts, which resolve it.
            let is_right = index == 3 || (index == 2 && method == Radau4);
            assert_eq!(off[0] < 0.1, is_right, "{method:?}, {index}: {off:?}");
            assert_eq!(c.is_resolved(), is_right, "{method:?}, {index}: {c}");
            assert_eq!(c.to_string().contains("not resolved"), !is_right, "{c}");
        }
    }
}
