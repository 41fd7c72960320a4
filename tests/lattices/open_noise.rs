//! Thermal noise of lattices in baths: exact heat and work on each path, the laws of rest, and the same bits on all threads.

use metriplectic::dynamics::noise::Uniform;
use metriplectic::integrators::FlowError;
use metriplectic::lattices::OpenLattice;
use metriplectic::lattices::model::Model;
use metriplectic::prelude::*;

type Mass = Euclidean<2>;
type Rod = Euclidean<1>;

/// The temperature of the water, and that of the oven at the first mass.
const TEMPERATURES: [f64; 2] = [0.8, 1.3];

/// Masses on springs, to their places and to their neighbours, with their noise, in water.
fn masses(
    sites: usize,
    anharmonic: f64,
) -> Noisy<OpenLattice<impl Model<Manifold = Mass>>, Uniform> {
    Lattice::on(Graph::chain(sites), Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| (x.x * x.x + x.y * x.y) * 0.5)
        .bond_energy(move |(x, y): &(Vector2<Real>, Vector2<Real>)| {
            let r = y.x - x.x;
            r * r * 0.5 + r.powi(4) * anharmonic
        })
        .build()
        .expect("it is a lattice")
        .with_noise(Boltzmann(1.0))
        .bath("water", TEMPERATURES[0], 0..sites, |_, _: &SiteState<'_, Mass>| {
            [Onsager { rate: 0.7, b: vector![0.0, 1.0] }]
        })
}

/// Bodies with the energy `u` and the entropy `C ln u` that conduct in proportion to both, in a room that each of them touches.
fn bodies(sites: usize, k_b: f64) -> Noisy<OpenLattice<impl Model<Manifold = Rod>>, Uniform> {
    Lattice::on(Graph::ring(sites), Euclidean::<1>)
        .energy(|u: &Vector1<Real>| u.x)
        .entropy(|u: &Vector1<Real>| u.x.ln())
        .bond_onsager(|bond| {
            let [u, v] = bond.x.map(|u| u.x);
            [Onsager { rate: u * v, b: [vector![bond.w[1].x], vector![-bond.w[0].x]] }]
        })
        .build()
        .expect("it is a lattice")
        .opened()
        .bath("room", TEMPERATURES[0], 0..sites, |_, at: &SiteState<'_, Rod>| {
            [Onsager { rate: 2.0 * at.x.x, b: vector![1.0] }]
        })
        .with_noise(Boltzmann(k_b))
}

#[test]
fn heat_and_work_of_each_path_balance_on_every_step() {
    let masses = masses(6, 0.1)
        .work("motor", [5], |t, _, _: &Vector2<f64>| vector![0.0, (1.3 * t).sin()])
        .bath(
            "oven",
            |t: Real| t.sin() * 0.2 + TEMPERATURES[1],
            [0],
            |_, at: &SiteState<'_, Mass>| {
                [Onsager { rate: 0.3 / (1.0 + at.x.x * at.x.x), b: vector![0.0, 1.0] }]
            },
        );
    let lattice = masses.flow();
    let start = || lattice.start(lattice.lattice().points(|i| vector![(i as f64).sin(), 0.3]));
    let span = Span::steps(0.05, 200);
    macro_rules! balance {
        ($($method:expr),*) => {$(
            let run = $method.run(&masses, start(), span).unwrap();
            let (certificate, name) = (run.certificate(), stringify!($method));
            assert!(certificate.keeps_energy(), "{name}: {certificate}");
            let zero = lattice.energy_at(&run.states()[0].point);
            for pair in run.states().windows(2) {
                let [before, after] = [&pair[0].point, &pair[1].point];
                let ledger = &after.ledger;
                let heats = ["water", "oven"].map(|bath| ledger.heat(bath).unwrap());
                let work = ledger.work("motor").unwrap();
                let off = lattice.energy_at(after) - zero - work - heats[0] - heats[1];
                assert!(off.abs() < 1e-13, "{name}: {off:.1e}");
                // Noise moves heat both ways.
                let entropy = ledger.bath_entropy("water").unwrap();
                assert!((entropy + heats[0] / TEMPERATURES[0]).abs() < 1e-12, "{name}");
                assert!(after.x != before.x);
            }
            let last = &run.last().point.ledger;
            assert!(last.heat("oven").unwrap().abs() > 0.1 && last.work("motor").unwrap().abs() > 0.01);
        )*};
    }
    balance!(
        NinomiyaVictoir(DormandPrince5).seed(4),
        RandomFlow(DormandPrince8).seed(4),
        RandomFlow(WeylMidpoint).seed(4),
        NinomiyaVictoir(Gauss::<2>).seed(4)
    );
    // The numbers of a path are those of the step: every method follows it.
    let end = |run: Trajectory<OpenSites<Mass>>| run.last().point.clone();
    let one = end(RandomFlow(DormandPrince8).seed(4).run(&masses, start(), span).unwrap());
    let two = end(RandomFlow(Gauss::<3>).seed(4).run(&masses, start(), span).unwrap());
    let off = one.x.iter().zip(two.x.iter()).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max);
    assert!(off < 1e-7, "{off:.1e}");
    // A path that is put down goes on with the same bits.
    let method = NinomiyaVictoir(DormandPrince5).seed(4);
    let whole = method.run(&masses, start(), Span::steps(0.05, 20)).unwrap();
    let mut steps = method.steps(&masses, start(), Span::steps(0.05, 20)).unwrap();
    for _ in 0..7 {
        steps.advance().unwrap();
    }
    let resumed = method.resume(&masses, &steps.checkpoint()).unwrap().run().unwrap();
    assert_eq!(resumed.last(), whole.last());
    assert_eq!(resumed.certificate(), whole.certificate());
    // Verified once, with the law of its noise.
    assert!(masses.report(&start()).to_string().contains("keeps its laws"));
    let first = start();
    let masses = masses.verified(&first).unwrap();
    let run = method.run(&masses, first, span);
    assert!(run.unwrap().certificate().verified_before);
}

#[test]
fn springs_have_the_mean_energy_of_the_temperature() {
    // The energy is quadratic in 2n numbers: n k_B T in the mean, and k_B T/2 in each momentum.
    let n = 12;
    let masses = masses(n, 0.0);
    let lattice = masses.flow();
    let start = || lattice.start(lattice.lattice().points(|_| vector![0.0, 0.0]));
    let (mut energies, mut momenta) = (Vec::new(), Vec::new());
    for path in 0..100 {
        let method = NinomiyaVictoir(DormandPrince5).seed(2).path(path);
        let span = Span::steps(0.1, 250).output_at([10.0, 15.0, 20.0]);
        let run = method.run(&masses, start(), span).unwrap();
        assert!(run.certificate().keeps_energy(), "{}", run.certificate());
        for state in run.states().iter().filter(|state| state.time > 9.9) {
            energies.push(lattice.energy_at(&state.point) / n as f64);
            let squares = state.point.x.iter().map(|x| x.y * x.y).sum::<f64>();
            momenta.push(squares / n as f64);
        }
    }
    for (what, found) in [("energy", energies), ("square of a momentum", momenta)] {
        let found = Estimate::of(found);
        let off = (found.mean - TEMPERATURES[0]) / found.standard_error;
        println!("{what}: {found:?}, off by {off:.2} errors");
        assert!(off.abs() < 4.0, "{what}: {found:?}");
        assert!(found.standard_error < 0.02, "{what}: {found:?}");
    }
}

#[test]
fn bodies_in_a_room_have_the_law_of_gibbs() {
    // exp(S/k − H/kT) is a law of Gamma for each body: its mean is (C + k) T. Without the kinetic drift of the room it would be off by k T/2.
    let k_b = 0.05;
    let bodies = bodies(12, k_b);
    let lattice = bodies.flow();
    let start = lattice.start(lattice.lattice().points(|_| vector![0.8]));
    let run = NinomiyaVictoir(DormandPrince5)
        .seed(5)
        .run(&bodies, start, Span::steps(0.05, 10_000))
        .unwrap();
    assert!(run.certificate().keeps_energy(), "{}", run.certificate());
    let states = run.states().iter().skip(100).step_by(30);
    let means = states.map(|state| state.point.x.iter().map(|u| u.x).sum::<f64>() / 12.0);
    let found = Estimate::of(means);
    let exact = (1.0 + k_b) * TEMPERATURES[0];
    let off = (found.mean - exact) / found.standard_error;
    println!("{found:?} for {exact}, off by {off:.2} errors");
    assert!(off.abs() < 4.0, "{found:?} for {exact}");
    assert!(found.standard_error < 0.1 * k_b * TEMPERATURES[0], "{found:?}");
}

#[test]
fn threads_do_not_change_a_bit_of_a_path() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let bodies = bodies(3000, 0.02);
            let points = bodies.flow().lattice().points(|i| vector![1.0 + 0.3 * (i as f64).sin()]);
            let start = bodies.flow().start(points);
            let run = RandomFlow(DormandPrince5).seed(1).run(&bodies, start, Span::steps(0.01, 3));
            run.unwrap().last().point.clone()
        })
    };
    let one = run(1);
    assert!(one.ledger.heat("room").unwrap() != 0.0);
    assert_eq!(one, run(2));
}

#[test]
fn surroundings_without_a_law_of_noise_are_refused() {
    let refused = |error: FlowError| error.downcast_ref::<NoiseError>().cloned().unwrap();
    let span = Span::steps(0.01, 2);
    let canonical = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    // The friction of a bond whose energy other bonds share.
    let chain = |bonds: f64| {
        Lattice::on(Graph::chain(4), Euclidean::<3>)
            .bracket(Poisson::constant(canonical).unwrap())
            .energy(|x: &Vector3<Real>| x.y * x.y * 0.5 + x.z.exp())
            .bond_energy(move |(x, y): &(Vector3<Real>, Vector3<Real>)| {
                (y.x - x.x).powi(2) * (0.5 * bonds)
            })
            .entropy(|x: &Vector3<Real>| x.z)
            .bond_onsager(|bond| {
                let [u, v] = bond.w;
                [Onsager { rate: 0.1, b: [vector![0.0, 0.0, v.z], vector![0.0, 0.0, -u.z]] }]
            })
            .build()
            .unwrap()
            .opened()
            .with_noise(Boltzmann(0.01))
    };
    let chain = chain(1.0);
    let start = chain.flow().start(chain.flow().lattice().points(|i| vector![i as f64, 0.1, 0.0]));
    let found = RandomFlow(DormandPrince5).seed(1).run(&chain, start, span);
    let Err(RunError::Flow(error)) = found else { panic!("{found:?}") };
    assert_eq!(refused(error), NoiseError::BondsHaveEnergies);
    // A sum that the lattice keeps, and a bath does not know.
    let sums = Lattice::on(Graph::ring(4), Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5)
        .conserved(|x: &Vector2<Real>| x.y)
        .build()
        .unwrap()
        .opened()
        .bath("water", 1.0, [0], |_, _: &SiteState<'_, Mass>| {
            [Onsager { rate: 0.1, b: vector![1.0, 0.0] }]
        })
        .with_noise(Boltzmann(1.0));
    let start = sums.flow().start(sums.flow().lattice().points(|i| vector![i as f64, 0.1]));
    let found = RandomFlow(DormandPrince5).seed(1).run(&sums, start, span);
    let Err(RunError::Flow(error)) = found else { panic!("{found:?}") };
    assert_eq!(refused(error), NoiseError::InvariantsInABath);
    let masses = masses(3, 0.0);
    let start = || masses.flow().start(masses.flow().lattice().points(|_| vector![0.5, 0.0]));
    let of_method = |error: Option<RunError<_>>| match error {
        Some(RunError::Method(error)) => error.downcast_ref::<NoiseError>().cloned().unwrap(),
        other => panic!("{other:?}"),
    };
    let damped = RandomFlow(Radau::<2>).seed(1).run(&masses, start(), span);
    assert_eq!(of_method(damped.err()), NoiseError::NoiseWithRadau);
    let adaptive = Span::until(1.0).tolerance(1e-4);
    let adaptive = RandomFlow(DormandPrince5).seed(1).run(&masses, start(), adaptive);
    assert_eq!(of_method(adaptive.err()), NoiseError::NeedsFixedSteps);
}
