//! Lattices with ports and baths at sites: both laws, closed forms, bits, and errors.

#[path = "lattices/open_implicit.rs"]
mod implicit;
#[path = "lattices/open_noise.rs"]
mod noise;
#[path = "lattices/open_ports.rs"]
mod ports;
#[path = "models/tables.rs"]
mod tables;

use metriplectic::lattices::OpenLattice;
use metriplectic::lattices::model::Model;
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee};

type Rod = Euclidean<1>;
type Mass = Euclidean<2>;

fn claim(problem: &str, method: &str) -> Claim {
    Claim::new(Guarantee::ManySites, problem, method)
}

/// Heat in a rod: the energy `u` and the entropy `ln u` of each site, and the flux `v − u` in a bond.
fn rod(sites: usize) -> Lattice<impl Model<Manifold = Rod>> {
    Lattice::on(Graph::chain(sites), Euclidean::<1>)
        .energy(|u: &Vector1<Real>| u.x)
        .entropy(|u: &Vector1<Real>| u.x.ln())
        .bond_onsager(|bond| {
            let [u, v] = bond.x;
            [Onsager { rate: u.x * v.x, b: [vector![1.0], vector![-1.0]] }]
        })
        .build()
        .expect("it is a lattice")
}

/// A bath that gives the heat `2 (T − u)` to a site.
fn contact(_: f64, at: &SiteState<'_, Rod>) -> [Onsager<Vector1<f64>>; 1] {
    [Onsager { rate: 2.0 * at.x.x, b: vector![1.0] }]
}

fn between_baths(sites: usize) -> OpenLattice<impl Model<Manifold = Rod>> {
    rod(sites).opened().bath("hot", 2.0, [0], contact).bath("cold", 1.0, [sites - 1], contact)
}

#[test]
fn heat_flows_from_one_end_of_a_rod_to_the_other() {
    let n = 12;
    let rod = between_baths(n);
    let start = || rod.start(rod.lattice().points(|_| vector![1.5]));
    // Thermal resistances: n − 1 bonds and two contacts of 1/2.
    let flux = 1.0 / (n as f64 - 1.0 + 1.0);
    macro_rules! steady {
        ($($method:expr, $tolerance:expr);*) => {$(
            let span = Span::until(1000.0).tolerance($tolerance).output_at([900.0]);
            let run = $method.run(&rod, start(), span).unwrap();
            println!("{}", run.certificate());
            assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
            let [a, b] = [&run.states()[1].point, &run.last().point];
            for (i, u) in b.x.iter().enumerate() {
                let exact = 2.0 - flux * (0.5 + i as f64);
                assert!((u.x - exact).abs() < 1e-6, "site {i}: {} {exact}", u.x);
            }
            let grown = |entry: fn(&OpenState<Points<Rod>>) -> f64| entry(b) - entry(a);
            let hot = grown(|s| s.ledger.heat("hot").unwrap());
            let cold = grown(|s| s.ledger.heat("cold").unwrap());
            let entropy = grown(|s| {
                s.ledger.bath_entropy("hot").unwrap() + s.ledger.bath_entropy("cold").unwrap()
            });
            assert!((hot - 100.0 * flux).abs() < 1e-5 && (cold + hot).abs() < 1e-5);
            assert!((entropy - 100.0 * flux * (1.0 - 0.5)).abs() < 1e-5);
            // The sum of all heat is what the rod has gained.
            let gained: f64 = b.x.iter().map(|u| u.x - 1.5).sum();
            let heat = b.ledger.heat("hot").unwrap() + b.ledger.heat("cold").unwrap();
            assert!((gained - heat).abs() < 1e-12, "{gained} {heat}");
        )*};
    }
    steady!(DormandPrince5, 1e-7; RungeKuttaChebyshev, 1e-7);
}

#[test]
fn one_site_is_the_system_that_it_is() {
    // An oscillator with a motor and a bath, as a lattice of one site and as a system.
    let lattice = Lattice::on(Graph::from_bonds(1, []), Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 - x.x.cos())
        .build()
        .unwrap()
        .opened()
        .work("motor", [0], |t, _, _: &Vector2<f64>| vector![0.0, (1.3 * t).sin() * 0.4])
        .bath(
            "air",
            |t: Real| t.sin() * 0.1 + 0.7,
            [0],
            |_, _: &SiteState<'_, Mass>| [Onsager { rate: 0.08, b: vector![0.0, 1.0] }],
        );
    let system = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 - x.x.cos())
        .work("motor", |t: Real, _: &Vector2<Real>| vector![0.0.into(), (t * 1.3).sin() * 0.4])
        .bath(
            "air",
            Bath::in_time(|t: Real| t.sin() * 0.1 + 0.7).friction(
                |_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                    [Contact { rate: 0.08.into(), along: vector![0.0.into(), 1.0.into()] }]
                },
            ),
        )
        .build()
        .unwrap();
    let span = Span::steps(0.05, 400);
    let start = lattice.start(lattice.lattice().points(|_| vector![0.5, 0.0]));
    let a = DormandPrince8.run(&lattice, start, span).unwrap();
    let b = DormandPrince8.run(&system, system.start(vector![0.5, 0.0]), span).unwrap();
    assert!(a.certificate().keeps_energy() && a.certificate().keeps_entropy());
    let [a, b] = [&a.last().point.ledger, &b.last().point.ledger].map(|ledger| {
        [
            ledger.work("motor").unwrap(),
            ledger.heat("air").unwrap(),
            ledger.bath_entropy("air").unwrap(),
        ]
    });
    println!("{a:?} {b:?}");
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() < 1e-11, "{a} {b}");
    }
}

#[test]
fn a_piston_sends_sound_into_a_chain_and_books_its_work() {
    // A piston that pushes the first mass; sites that the sound has not reached keep their bits.
    let n = 2000;
    let chain = Lattice::on(Graph::chain(n), Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5)
        .bond_energy(|(x, y): &(Vector2<Real>, Vector2<Real>)| {
            let r = y.x - x.x;
            r * r * 0.5 + r * r * r * 0.1
        })
        .build()
        .unwrap()
        .opened()
        .work("piston", [0], |t, _, _: &Vector2<f64>| vector![0.0, (-(t - 3.0).powi(2)).exp()]);
    let start = chain.start(chain.lattice().points(|_| vector![0.0, 0.0]));
    let run = DormandPrince5.run(&chain, start, Span::until(30.0).tolerance(1e-7)).unwrap();
    println!("{}", run.certificate());
    assert!(run.certificate().keeps_energy());
    let state = &run.last().point;
    let (work, energy) = (state.ledger.work("piston").unwrap(), chain.energy_at(state));
    assert!(work > 0.1 && (energy - work).abs() < 1e-13, "{energy} {work}");
    // Momentum that the piston has given: √π (1 − erfc(3)/2).
    let given = std::f64::consts::PI.sqrt() * (1.0 - 0.5 * 2.209_049_7e-5);
    let momentum: f64 = state.x.iter().map(|x| x.y).sum();
    assert!((momentum - given).abs() < 1e-5, "{momentum}");
    assert!(state.x[1500..].iter().all(|x| x.norm() == 0.0));
}

#[test]
fn the_ledger_has_the_same_bits_on_every_number_of_threads() {
    let n = 3000;
    let rod = rod(n).opened().bath("room", |t: Real| t.sin() * 0.3 + 1.5, 0..n, contact);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let start = rod.start(rod.lattice().points(|i| vector![1.0 + 0.5 * (i as f64).sin()]));
            let run = RungeKuttaChebyshev.run(&rod, start, Span::until(1.0).tolerance(1e-5));
            let run = run.unwrap();
            assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
            let ledger = &run.last().point.ledger;
            [ledger.heat("room").unwrap(), ledger.bath_entropy("room").unwrap()].map(f64::to_bits)
        })
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn outputs_jumps_and_checkpoints_of_an_open_lattice() {
    let rod = between_baths(8);
    let start = || rod.start(rod.lattice().points(|_| vector![1.5]));
    // A switch: the first site is cooled by a quench when it is hot.
    type Hot = OpenState<Points<Rod>>;
    let schedule = || {
        Span::until(5.0)
            .tolerance(1e-6)
            .event("quench", |s: &Hot| s.x[0].x - 1.65)
            .rising()
            .jump(|_, s: &Hot| {
                let mut points = s.x.clone();
                points[0].x = 1.55;
                s.at(points)
            })
            .heat_at(0.5)
    };
    let whole = DormandPrince5.run(&rod, start(), schedule()).unwrap();
    let jumps = &whole.certificate().jumps[0];
    println!("{}", whole.certificate());
    assert!(jumps.count > 1 && (jumps.heat + 0.1 * jumps.count as f64).abs() < 1e-12);
    assert!(whole.certificate().keeps_energy() && whole.certificate().keeps_entropy());
    let ledger = &whole.last().point.ledger;
    assert!((ledger.event_heat() - jumps.heat).abs() < 1e-15);
    let mut steps = DormandPrince5.steps(&rod, start(), schedule()).unwrap();
    for _ in 0..20 {
        steps.advance().unwrap();
    }
    let checkpoint = metriplectic_studies::checkpoints::reread(&steps.checkpoint());
    let resumed = DormandPrince5.resume(&rod, &checkpoint).unwrap();
    let resumed = resumed.watching(schedule()).unwrap().run().unwrap();
    assert_eq!(resumed.last(), whole.last());
    assert_eq!(resumed.certificate(), whole.certificate());
    tables::are_those_of_the_run(&rod, || Ok(DormandPrince5.run(&rod, start(), schedule())?));
}

#[test]
fn surroundings_of_a_lattice_that_break_a_law_are_refused() {
    let span = Span::until(1.0).tolerance(1e-5);
    let run = |lattice: OpenLattice<_>| {
        let start = lattice.start(lattice.lattice().points(|_| vector![1.5]));
        match DormandPrince5.run(&lattice, start, span).unwrap_err() {
            RunError::Model(law) => law,
            RunError::Step { cause: StepError::Model { law, .. }, .. } => *law,
            other => panic!("{other}"),
        }
    };
    let open = || rod(5).opened();
    let law = run(open().work("heater", [2], |_, _, _: &Vector1<f64>| vector![0.1]));
    assert!(
        matches!(&law, ModelError::WorkCarriesEntropy { .. }) && law.to_string().contains("site 2"),
        "{law}"
    );
    // On the way.
    let later = |t: f64, _: usize, _: &Vector1<f64>| vector![if t > 0.5 { 0.1 } else { 0.0 }];
    assert!(
        matches!(run(open().work("heater", [2], later)), ModelError::WorkCarriesEntropy { time, .. } if time > 0.5)
    );
    let law = run(open().bath("cold", -1.0, [0], contact));
    assert!(matches!(law, ModelError::BathNotPositive { .. }), "{law}");
    let negative = |_: f64, _: &SiteState<'_, Rod>| [Onsager { rate: -1.0, b: vector![1.0] }];
    let law = run(open().bath("wrong", 1.0, [0], negative));
    assert!(matches!(law, ModelError::FrictionNotPositive { .. }), "{law}");
    let law = run(open().bath("beyond", 1.0, [5], contact));
    assert!(law.to_string().contains("site 5"), "{law}");
    let momenta = Lattice::on(Graph::ring(6), Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5)
        .bond_energy(|(x, y): &(Vector2<Real>, Vector2<Real>)| (y.x - x.x).powi(2) * 0.5)
        .conserved(|x: &Vector2<Real>| x.y)
        .build()
        .unwrap()
        .opened()
        .work("piston", [1], |_, _, _: &Vector2<f64>| vector![0.0, 1.0]);
    let start = momenta.start(momenta.lattice().points(|i| vector![0.1 * i as f64, 0.2]));
    let error = DormandPrince5.run(&momenta, start, span).unwrap_err();
    assert!(
        matches!(error, RunError::Model(ModelError::PortBreaksInvariant { index: 0, .. })),
        "{error}"
    );
}
