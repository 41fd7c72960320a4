//! Lattices: both laws, orders, closed forms, and the same bits on every number of threads.

#[path = "lattices/at_rest.rs"]
mod at_rest;
#[path = "models/chain.rs"]
mod chain;
#[path = "models/digits.rs"]
mod digits;
#[path = "lattices/gathered.rs"]
mod gathered;
#[path = "lattices/implicit.rs"]
mod implicit;
#[path = "lattices/limiting_sites.rs"]
mod limiting_sites;
#[path = "models/lattices.rs"]
mod models;
#[path = "lattices/recorded.rs"]
mod recorded;
#[path = "lattices/simulations.rs"]
mod simulations;
#[path = "models/tables.rs"]
mod tables;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use chain::{chain, waves};
use digits::refuses_changed_digits;
use metriplectic::integrators::{Flow, Vector};
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee, Order, scientific};
use models::{conduction, embedded_atoms, gas, helix, toda, warm_neighbours};

/// The velocity of the chain of `models/chain.rs`, with derivatives by hand.
fn velocity_by_hand(bonds: &[[usize; 2]], x: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut w: Vec<_> = x.iter().map(|x| vector![0.0, x.y, (0.5 * x.z).exp()]).collect();
    for &[i, j] in bonds {
        let (r, heat) = (x[j].x - x[i].x, x[i].z + x[j].z);
        let force = r + 0.25 * r * r + r * r * r - 0.025 * heat;
        w[i] += vector![-force, 0.0, -0.025 * r];
        w[j] += vector![force, 0.0, -0.025 * r];
    }
    let mut v: Vec<_> = w.iter().map(|w| vector![w.y, -w.x, 0.0]).collect();
    for &[i, j] in bonds {
        let [u, t] = [w[i], w[j]];
        // Friction f slip, whose heat f slip² is shared; conduction 0.1 (T − U).
        let (slip, flux) = (0.5 * (t.y - u.y), 0.1 * (t.z - u.z));
        let f = 0.2 * u.z * t.z / (u.z + t.z) * -slip * (u.z.recip() + t.z.recip());
        v[i] += vector![0.0, -f, (-slip * f + flux) / u.z];
        v[j] += vector![0.0, f, (-slip * f - flux) / t.z];
    }
    v
}

#[test]
fn the_velocity_is_the_sum_of_local_terms_on_every_graph() {
    // A ring whose bonds come in an arbitrary order and direction, over three chunks.
    let n = 2500;
    let shuffled = (0..n).map(|k| {
        let i = k * 1009 % n;
        let [i, j] = [i, (i + 1 + i % 3 * 600) % n];
        if k % 2 == 0 { [i, j] } else { [j, i] }
    });
    let graphs: [(usize, Vec<[usize; 2]>); 2] =
        [(n, shuffled.collect()), (40, (0..40).map(|i| [i, (i + 1) % 40]).collect())];
    for (n, bonds) in graphs {
        let lattice = chain(Graph::from_bonds(n, bonds.iter().copied()));
        let x = lattice.points(waves);
        let v = lattice.rates(&x, &lattice.sizes(&x).zero()).unwrap();
        let by_hand = velocity_by_hand(&bonds, &x);
        let largest = by_hand.iter().map(|v| v.amax()).fold(0.0, f64::max);
        let off = (0..3 * n).map(|k| (v.get(k) - by_hand[k / 3][k % 3]).abs()).fold(0.0, f64::max);
        // Some roundings in sums of a dozen terms.
        assert!(off < 32.0 * f64::EPSILON * largest, "{off:.1e} of {largest:.1}");
    }
}

#[test]
fn both_laws_hold_on_every_step() {
    let lattice = chain(Graph::ring(400));
    let start = lattice.points(waves);
    let energy = lattice.laws(&start).energy;
    let check = |method: &str, certificate: &Certificate| {
        println!("{certificate}\n");
        let falls = certificate.entropy_falls;
        lattice_claim("chain with friction and conduction, 400 sites: H and S", method)
            .against("H at the start, relative; S of every step")
            .record(
                format!("{}; {falls} falls", scientific(certificate.max_energy_error / energy)),
                "4.2 ε; 0 falls",
            );
        // All terms of this energy are positive but for the stress, which is below a fiftieth of them.
        assert!(certificate.max_energy_error <= 4.0 * f64::EPSILON * 1.05 * energy);
        assert!(certificate.keeps_entropy() && certificate.entropy_gained > 1.0);
        assert!(certificate.invariants[0].max_error < 1e-13);
        assert!(certificate.projected_steps.targeted == certificate.steps);
    };
    let fixed = Span::steps(0.05, 200).every(200);
    let five = DormandPrince5.run(&lattice, start.clone(), fixed).unwrap();
    check("DormandPrince5", five.certificate());
    let span = Span::until(10.0).tolerance(1e-9).at_most(2);
    let eight = DormandPrince8.run(&lattice, start, span).unwrap();
    check("DormandPrince8", eight.certificate());
    // Two methods come to one end.
    let off = distance(&five.last().point, &eight.last().point);
    assert!(off < 1e-6, "{off:.1e}");
}

fn distance(x: &[Vector3<f64>], y: &[Vector3<f64>]) -> f64 {
    x.iter().zip(y).map(|(x, y)| (x - y).amax()).fold(0.0, f64::max)
}

#[test]
fn the_bits_do_not_depend_on_the_number_of_threads() {
    // Bonds within chunks and across them, in three directions.
    let lattice = chain(Graph::cubic([20, 20, 10], Boundary::Periodic));
    let start = lattice.points(waves);
    let ends = [1, 2, 3, 4, 5, 6, 7].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let span = Span::until(0.6).tolerance(1e-6).at_most(2);
            let run = DormandPrince5.run(&lattice, start.clone(), span).unwrap();
            assert!(run.certificate().steps > 3);
            (run.last().clone(), run.certificate().clone())
        })
    });
    assert!(ends.iter().all(|end| *end == ends[0]));
    Claim::new(Guarantee::Reproducibility, "chain on a cubic grid of 4000 sites", "DormandPrince5")
        .against("1 to 7 threads")
        .record("the same bits", "the same bits");
}

#[track_caller]
fn lattice_claim(problem: &str, method: &str) -> Claim {
    Claim::new(Guarantee::ManySites, problem, method)
}

/// The fitted order of runs of so many steps over the same time.
fn order(steps: &[usize], errors: &[f64]) -> f64 {
    let sizes: Vec<f64> = steps.iter().map(|&n| (n as f64).recip()).collect();
    Order::fit(&sizes, errors).expect("errors above round-off").slope
}

#[test]
fn a_soliton_moves_at_the_order_of_the_method() {
    let lattice = toda::lattice(64);
    let start = lattice.points(|i| toda::at(i, 0.0));
    let error = |eight: bool, steps: usize| {
        let span = Span::steps(8.0 / steps as f64, steps).every(steps);
        let run = if eight {
            DormandPrince8.run(&lattice, start.clone(), span).unwrap()
        } else {
            DormandPrince5.run(&lattice, start.clone(), span).unwrap()
        };
        // The terms of this energy, eᵣ and r and 1, are up to four times as large as it is.
        let certificate = run.certificate();
        assert!(certificate.max_energy_error <= 4.0 * f64::EPSILON * certificate.initial_energy);
        let off = |(i, x): (usize, &Vector2<f64>)| (x - toda::at(i, 8.0)).amax();
        run.last().point.iter().enumerate().map(off).fold(0.0, f64::max)
    };
    for (eight, least, steps) in [(false, 4.8, [40, 57, 80, 113]), (true, 7.65, [20, 25, 32, 40])] {
        let errors = steps.map(|steps| error(eight, steps));
        let slope = order(&steps, &errors);
        println!("order {slope:.2}: {errors:?}");
        let method = if eight { "DormandPrince8" } else { "DormandPrince5" };
        lattice_claim("soliton on a chain of Toda, 64 sites: order", method)
            .against("its closed form")
            .record(format!("{slope:.2}"), format!("≥ {least}"));
        assert!(slope > least && slope < least + 1.5, "{slope}: {errors:?}");
    }
}

#[test]
fn a_damped_helix_turns_and_warms_as_in_closed_form_in_every_unit() {
    let n = 40;
    // In units of its own; and in joules and joules per kelvin, with an exchange of k_B · 1 K.
    let boltzmann = 1.380_649e-23;
    let runs = [[1.0, 1.0], [boltzmann, boltzmann]].map(|[joule, boltzmann]| {
        let lattice = helix::lattice(n, [joule, boltzmann]);
        let at = |i: usize, t: f64| {
            let (n, s) = helix::at(n, i, t * joule);
            (n, s * boltzmann)
        };
        let end = 6.0 / joule;
        let span = Span::until(end).tolerance(1e-13).at_most(2);
        let run = DormandPrince8.run(&lattice, lattice.points(|i| at(i, 0.0)), span).unwrap();
        println!("{}", run.certificate());
        assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
        assert!(run.certificate().max_manifold_defect < 1e-15);
        let off = |(i, x): (usize, &helix::Spin)| {
            let exact = at(i, end);
            (x.0 - exact.0).amax().max((x.1 - exact.1).amax() / boltzmann)
        };
        let off = run.last().point.iter().enumerate().map(off).fold(0.0, f64::max);
        (off, run.certificate().steps)
    });
    println!("{runs:?}");
    lattice_claim("helix of spins that warms its bath, in two systems of units", "DormandPrince8")
        .against("its closed form, T = 6")
        .record(runs.map(|(off, _)| scientific(off)).join(", "), "1e-12");
    assert!(runs.iter().all(|(off, _)| *off < 1e-12), "{runs:?}");
    assert_eq!(runs[0].1, runs[1].1, "the steps have no unit");
}

#[test]
fn heat_spreads_as_the_discrete_kernel_says_in_every_unit() {
    // A ring in units of its own; and copper: cells of 1 mm and 1 cm², c in J/K and κ in W/K, at 300 K.
    let density = 8960.0;
    let copper = [385.0 * density * 1e-3 * 1e-4, 401.0 * 1e-4 / 1e-3, 300.0];
    let errors = [[1.0, 1.0, 1.0], copper].map(|[c, kappa, theta]| {
        let n = 40;
        let lattice = conduction::lattice(n, [c, kappa], Arc::default());
        let end = 2.0 * c / kappa;
        let start = lattice.points(|i| conduction::at([n, i], 2.0, [c, kappa, theta], 0.0));
        let span = Span::until(end).tolerance(1e-15).at_most(2);
        let run = DormandPrince8.run(&lattice, start, span).unwrap();
        println!("{}", run.certificate());
        assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
        let off = |(i, x): (usize, &Vector1<f64>)| {
            (x / conduction::at([n, i], 2.0, [c, kappa, theta], end).x).x - 1.0
        };
        let off = run.last().point.iter().enumerate().map(|ix| off(ix).abs()).fold(0.0, f64::max);
        (off, run.certificate().steps)
    });
    println!("{errors:?}");
    lattice_claim("conduction on a ring, in two systems of units", "DormandPrince8")
        .against("the discrete kernel")
        .record(errors.map(|(off, _)| scientific(off)).join(", "), "1e-13");
    assert!(errors.iter().all(|(off, _)| *off < 1e-13), "{errors:?}");
    assert_eq!(errors[0].1, errors[1].1, "the steps have no unit");
}

#[test]
fn the_error_is_proportional_to_the_tolerance() {
    let n = 40;
    let lattice = helix::lattice(n, [1.0, 1.0]);
    let start = lattice.points(|i| helix::at(n, i, 0.0));
    let error = |eight: bool, tolerance: f64| {
        let span = Span::until(20.0).tolerance(tolerance).at_most(2);
        let run = if eight {
            DormandPrince8.run(&lattice, start.clone(), span).unwrap()
        } else {
            DormandPrince5.run(&lattice, start.clone(), span).unwrap()
        };
        let off = |(i, x): (usize, &helix::Spin)| (x.0 - helix::at(n, i, 20.0).0).amax();
        run.last().point.iter().enumerate().map(off).fold(0.0, f64::max)
    };
    for eight in [false, true] {
        let errors = [1e-7, 1e-8, 1e-9, 1e-10].map(|tolerance| error(eight, tolerance));
        println!("{errors:?}");
        // Proportional within a factor of three per decade.
        assert!(errors.windows(2).all(|e| (3.0..34.0).contains(&(e[0] / e[1]))), "{errors:?}");
    }
}

#[test]
fn a_pulse_leaves_the_sites_alone_that_it_has_not_reached() {
    // One site is pushed in a chain at rest, where every force vanishes to the last bit.
    let (n, steps) = (4000, 20);
    let lattice = chain(Graph::ring(n));
    let push = |i: usize| vector![0.0, if i == 2000 { 1.0 } else { 0.0 }, 0.0];
    let start = lattice.points(push);
    let run = DormandPrince5.run(&lattice, start.clone(), Span::steps(0.1, steps)).unwrap();
    assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
    assert!(run.certificate().max_energy_error <= 4.0 * f64::EPSILON * 2.0 * n as f64);
    let end = &run.last().point;
    // Forces reach the next site, and friction the one behind it, in each of six stages.
    let reach = 2 * 6 * steps + 2;
    let is_near = |i: usize| i.abs_diff(2000) <= reach;
    assert!((0..n).all(|i| is_near(i) || end[i] == start[i]));
    assert!((0..n).filter(|&i| end[i] != start[i]).count() > 100);
}

#[test]
fn runs_have_outputs_events_rest_and_checkpoints() {
    let n = 40;
    let lattice = helix::lattice(n, [1.0, 1.0]);
    let start = lattice.points(|i| helix::at(n, i, 0.0));
    let height = |x: &Points<_>| -> f64 {
        let x: &[helix::Spin] = x;
        x.iter().map(|spin| spin.0.z).sum::<f64>() / x.len() as f64
    };
    // The mean height is cos θ(t), and an output has the error of the tolerance.
    let span = || Span::until(4.0).tolerance(1e-10);
    let watched =
        span().output_at([0.3, 1.7, 3.1]).event("0.45", move |x: &Points<_>| height(x) - 0.45);
    let run = DormandPrince8.run(&lattice, start.clone(), watched).unwrap();
    let (event, states) = (&run.events()[0].state, run.states());
    for state in states.iter().chain([event]) {
        let exact = helix::at(n, 0, state.time).0.z;
        assert!((height(&state.point) - exact).abs() < 1e-8, "t = {}", state.time);
        let energy = (state.energy - states[0].energy).abs();
        assert!(energy <= 4.0 * f64::EPSILON * 2.0 * n as f64, "{energy:.1e}");
    }
    assert!((height(&event.point) - 0.45).abs() < 1e-9);
    assert!(states.windows(2).all(|s| s[0].entropy <= s[1].entropy));
    // Put down and taken up again.
    let whole = DormandPrince8.run(&lattice, start.clone(), span().at_most(2)).unwrap();
    let mut steps = DormandPrince8.steps(&lattice, start.clone(), span()).unwrap();
    while steps.state().time < 2.0 {
        steps.advance().unwrap();
    }
    let checkpoint = metriplectic_studies::checkpoints::reread(&steps.checkpoint());
    let resumed = DormandPrince8.resume(&lattice, &checkpoint).unwrap().run().unwrap();
    assert_eq!(resumed.last(), whole.last());
    assert_eq!(resumed.certificate(), whole.certificate());
    tables::are_those_of_the_run(&lattice, || {
        Ok(DormandPrince8.run(&lattice, start.clone(), span().at_most(9))?)
    });
    // A jump by half a turn about the axis, which is a symmetry: the closed form goes on, turned.
    type Ring = Points<Product<Sphere<2>, Euclidean<1>>>;
    let turned = |x: &helix::Spin| (vector![-x.0.x, -x.0.y, x.0.z], x.1);
    let turns = span().event("0.45", move |x: &Ring| height(x) - 0.45).jump(move |_, x: &Ring| {
        let mut after = x.clone();
        after.iter_mut().for_each(|x| *x = turned(x));
        after
    });
    let run = DormandPrince8.run(&lattice, start.clone(), turns).unwrap();
    assert_eq!(run.certificate().jumps[0].count, 1);
    for (site, x) in run.last().point.iter().enumerate() {
        let exact = turned(&helix::at(n, site, run.last().time));
        assert!((x.0 - exact.0).norm() < 1e-8 && (x.1 - exact.1).norm() < 1e-8, "site {site}");
    }
    // All spins are up in the end.
    let span = Span::until(1e3).tolerance(1e-8).until_rest(1e-6).at_most(2);
    let rest = DormandPrince5.run(&lattice, start, span).unwrap();
    println!("{} {:?}", rest.certificate(), rest.ending());
    assert!(rest.ending().is_rest() && height(&rest.last().point) > 1.0 - 1e-9);
}

#[test]
fn stiff_conduction_takes_stages_in_proportion_to_the_root_of_its_stiffness() {
    let (n, parameters) = (1000, [1.0, 1000.0, 1.0]);
    let count = Arc::<AtomicUsize>::default();
    let lattice = conduction::lattice(n, [1.0, 1000.0], count.clone());
    let at = |i, t| conduction::at([n, i], 2.0, parameters, t);
    let start = lattice.points(|i| at(i, 0.0));
    let run = |tolerance: f64| {
        count.store(0, Ordering::Relaxed);
        let span = Span::until(2.0).tolerance(tolerance).at_most(2);
        let run = RungeKuttaChebyshev.run(&lattice, start.clone(), span).unwrap();
        println!("{}", run.certificate());
        let certificate = run.certificate();
        assert!(certificate.max_energy_error <= 4.0 * f64::EPSILON * certificate.initial_energy);
        assert_eq!(certificate.entropy_falls, 0);
        let off = |(i, x): (usize, &Vector1<f64>)| (x - at(i, 2.0)).amax();
        let error = run.last().point.iter().enumerate().map(off).fold(0.0, f64::max);
        let velocities = count.load(Ordering::Relaxed) / n;
        println!("{tolerance:.0e}: {velocities} velocities, error {error:.1e}");
        (error, velocities)
    };
    let runs = [1e-3, 1e-4, 1e-5].map(run);
    println!("{runs:?}");
    // The error is proportional to the tolerance, and the stages to the root of the number of steps.
    for pair in runs.windows(2) {
        let [(e0, v0), (e1, v1)] = pair else { unreachable!("windows of two") };
        assert!((3.0..30.0).contains(&(e0 / e1)), "{runs:?}");
        assert!(*v1 as f64 <= 2.0 * *v0 as f64, "{runs:?}");
    }
    // An explicit step is stable up to 3.3 / (4κ/c): 2400 steps to t = 2, seven velocities each.
    assert!(runs[1].0 < 7e-6 && runs[1].1 < 700, "{runs:?}");
}

#[test]
fn sound_in_a_gas_is_damped_as_the_linearised_lattice_says_in_every_unit() {
    // Three waves on a ring, for two periods: in units of one, and in air at 300 K in cells of 1 mm with microseconds.
    let (n, waves) = (60, 3.0);
    let lambda = gas::eigenvalue(n, waves);
    assert!(lambda.re < -0.02 && lambda.im > 0.3, "{lambda}");
    let end = 2.0 * std::f64::consts::TAU / lambda.im;
    let errors = [[1.0, 1.0, 1.0], [1e-3, 1.0e-4, 3.4e-7]].map(|units| {
        let [metre, joule, boltzmann] = units;
        let lattice = gas::lattice(n, units);
        let units = vector![metre, joule / metre, boltzmann];
        [1e-3, 1e-4].map(|amplitude: f64| {
            let at = |i: usize, t: f64| gas::at([n, i], waves, amplitude, t);
            let start = lattice.points(|i| at(i, 0.0).component_mul(&units));
            let span = Span::steps(end / 60.0, 60).every(60);
            let run = DormandPrince8.run(&lattice, start, span).unwrap();
            let certificate = run.certificate();
            assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
            assert!(certificate.keeps_invariants());
            let off = |(i, x): (usize, &Vector3<f64>)| {
                (x.component_div(&units) - at(i, end)).amax() / amplitude
            };
            run.last().point.iter().enumerate().map(off).fold(0.0, f64::max)
        })
    });
    println!("λ = {lambda}: {errors:?}");
    for [large, small] in errors {
        // What is left is the nonlinear part of the motion, in proportion to the amplitude A. Round-off of the laws moves
        // the energy of the wave, about nA²/2, by εH: a fraction of 1e-7 of the smaller one.
        assert!(small < 1e-4 && (9.0..11.0).contains(&(large / small)), "{errors:?}");
    }
}

#[test]
#[ignore = "slow study: 10⁵ steps of 1000 sites"]
fn both_laws_hold_over_many_steps() {
    let lattice = chain(Graph::ring(1000));
    let start = lattice.points(waves);
    let energy = lattice.laws(&start).energy;
    let steps = 100_000;
    let run = DormandPrince5.run(&lattice, start, Span::steps(0.05, steps).every(steps)).unwrap();
    let certificate = run.certificate();
    println!("{certificate}\n{certificate:?}");
    assert!(certificate.max_energy_error <= 4.0 * f64::EPSILON * energy);
    // Σ|p| is at most the square root of 2NH.
    let momenta = (2000.0 * energy).sqrt();
    assert!(certificate.invariants[0].max_error <= 4.0 * f64::EPSILON * momenta);
    assert_eq!(certificate.entropy_falls, 0);
}
