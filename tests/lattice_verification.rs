//! Lattices of each kind that are verified, with a report of every law and the place where it is worst.

use metriplectic::dynamics::noise::Uniform;
use metriplectic::integrators::{NoiseError, Noisy, NoisyError, StateSpace};
use metriplectic::lattices::{LatticeLaw, LatticeReport, Model, Place, Sites, Tried};
use metriplectic::prelude::*;

type Masses = Product<Euclidean<2>, Euclidean<1>>;
type Mass = (Vector2<f64>, Vector1<f64>);
type Dual = (Vector2<Real>, Vector1<Real>);
type Term = Onsager<[Vector3<f64>; 2]>;
type Covector = Vector3<f64>;
type Rod = Euclidean<1>;
type Flux = Onsager<[Vector1<f64>; 2]>;

const SITES: usize = 10;

fn energy((x, e): &Dual) -> Real {
    x.y * x.y * 0.5 + e.x
}

fn entropy((_, e): &Dual) -> Real {
    e.x.ln()
}

/// Friction between two masses with the energies `w = (·, p, 1)`, which heats both.
fn friction(rate: f64, u: &Covector, v: &Covector) -> [Term; 1] {
    let slip = 0.5 * (v.y - u.y);
    [Onsager { rate, b: [vector![0.0, -1.0, -slip], vector![0.0, 1.0, -slip]] }]
}

fn rubbing([u, v]: [&Covector; 2], _: [&Mass; 2]) -> [Term; 1] {
    friction(0.1, u, v)
}

/// What is to be wrong with a chain, or nothing.
#[derive(Clone, Copy)]
struct Chain {
    energy: fn(&Dual) -> Real,
    entropy: fn(&Dual) -> Real,
    friction: fn([&Covector; 2], [&Mass; 2]) -> [Term; 1],
}

const SOUND: Chain = Chain { energy, entropy, friction: rubbing };

impl Chain {
    /// A chain of masses `(q, p)` with springs, and with internal energies that take up the heat of their friction.
    fn built(self) -> Lattice<impl Model<Manifold = Masses>> {
        Lattice::on(Graph::chain(SITES), Product(Euclidean::<2>, Euclidean::<1>))
            .bracket((Symplectic, Zero))
            .energy(self.energy)
            .bond_energy(|(x, y): &(Dual, Dual)| (y.0.x - x.0.x).powi(2) * 0.5)
            .entropy(self.entropy)
            .bond_onsager(move |bond| (self.friction)(bond.w, bond.x))
            .conserved(|(x, _): &Dual| x.y)
            .build()
            .expect("a lattice")
    }
}

/// Masses of which the right half goes twice as fast as the left half, at `q = at` and a little more.
fn start(at: f64) -> Points<Masses> {
    let fast = |site| if site < SITES / 2 { 1.0 } else { 2.0 };
    let points = (0..SITES).map(|i| (vector![at + 1e-4 * i as f64, fast(i)], vector![1.0]));
    points.collect::<Vec<_>>().into()
}

/// The bond between both halves.
const MIDDLE: Place = Place::Bond { bond: SITES / 2 - 1, sites: [SITES / 2 - 1, SITES / 2] };

const LAWS: [&str; 8] = [
    "ρ ≥ 0",
    "b·(dH_i, dH_j) = 0",
    "Π = −Πᵀ",
    "Π dS = 0",
    "⟨dH, u⟩ = ΔH",
    "⟨dS, u⟩ = ΔS",
    "⟨dL, u⟩ = ΔL",
    "⟨dL, x'⟩ = 0",
];

fn names(report: &LatticeReport) -> Vec<&'static str> {
    report.laws.iter().map(|law| law.law).collect()
}

fn law<'a>(report: &'a LatticeReport, name: &str) -> &'a LatticeLaw {
    report.laws.iter().find(|law| law.law == name).expect("the law is listed")
}

fn short() -> Span {
    Span::steps(1e-6, 3)
}

/// The error of each of the verbs and of a run, all of them the same, and the report, which lists what that of a sound
/// lattice lists.
fn refused(chain: Chain) -> (LatticeError, LatticeReport) {
    let (lattice, x) = (chain.built(), start(1.0));
    let error = lattice.verify(&x).expect_err("it breaks a law");
    let report = lattice.report(&x);
    println!("{report}\n");
    assert_eq!(report.verdict, Err(error.clone()));
    assert_eq!(names(&report), LAWS);
    assert!(report.to_string().ends_with(&format!("verdict: {error}")));
    assert_eq!(own(DormandPrince5.run(&lattice, x.clone(), short())), error);
    assert_eq!(lattice.verified(&x).err(), Some(error.clone()));
    (error, report)
}

/// The error of a lattice that ended a run.
fn own<M: StateSpace>(run: Result<Trajectory<M>, RunError<M>>) -> LatticeError {
    match run {
        Err(RunError::Flow(error)) => {
            error.downcast_ref::<LatticeError>().expect("of a lattice").clone()
        }
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("the run is not refused"),
    }
}

/// The laws of a report that are broken, and a line of its text for each of them.
fn broken(report: &LatticeReport) -> Vec<&'static str> {
    let broken: Vec<_> = report.laws.iter().filter(|law| !law.holds).map(|law| law.law).collect();
    let text = report.to_string();
    let marked = text.lines().filter(|line| line.trim_start().starts_with("BROKEN"));
    assert_eq!(marked.count(), broken.len(), "{text}");
    broken
}

#[test]
fn a_lattice_is_verified_once_and_its_report_lists_every_law() {
    let (lattice, x) = (SOUND.built(), start(1.0));
    assert_eq!(lattice.verify(&x), Ok(()));
    let report = lattice.report(&x);
    println!("{report}");
    assert_eq!(report.verdict, Ok(()));
    assert_eq!(names(&report), LAWS);
    assert!(report.laws.iter().all(|law| law.holds && law.size <= law.allowed));
    // A quotient is not quite a derivative.
    assert!(law(&report, "⟨dS, u⟩ = ΔS").size > 1e-14);
    assert_eq!((report.size, report.tried), ([10, 9], [10, 9]));
    let before = DormandPrince5.run(&lattice, x.clone(), Span::steps(0.05, 40)).unwrap();
    assert!(!before.certificate().verified_before);
    let lattice = lattice.verified(&x).unwrap();
    let after = DormandPrince5.run(&lattice, x.clone(), Span::steps(0.05, 40)).unwrap();
    assert!(after.certificate().verified_before);
    assert_eq!(before.states(), after.states());
    assert_eq!(lattice.verify(&x), Ok(()));
    // The closures of a large lattice are tried at some of its sites.
    let large = Lattice::on(Graph::ring(3000), Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
        .build()
        .unwrap();
    let report = large.report(&large.points(|i| vector![(i as f64).sin(), 1.0]));
    assert_eq!((report.size, report.tried, report.verdict), ([3000; 2], [64; 2], Ok(())));
}

#[test]
fn a_law_that_is_broken_is_in_the_report_with_its_place() {
    // Friction that makes no heat: b·w = v − u.
    let push = |[u, v]: [&Covector; 2], _: [&Mass; 2]| {
        friction(0.1, u, v)
            .map(|Onsager { rate, b }| Onsager { rate, b: b.map(|b| vector![b.x, b.y, 0.0]) })
    };
    let (error, report) = refused(Chain { friction: push, ..SOUND });
    assert!(matches!(error, LatticeError::Broken { law: "b·(dH_i, dH_j) = 0", place: MIDDLE, .. }));
    assert_eq!(broken(&report), ["b·(dH_i, dH_j) = 0"]);
    let energy_of_friction = law(&report, "b·(dH_i, dH_j) = 0");
    // (2 − 1)/(2 + 1).
    assert!(energy_of_friction.place == MIDDLE && (energy_of_friction.size - 0.333).abs() < 0.03);
    // A rate that is negative where the slip is large.
    let negative = |[u, v]: [&Covector; 2], _: [&Mass; 2]| friction(0.5 - (v.y - u.y).abs(), u, v);
    let (error, report) = refused(Chain { friction: negative, ..SOUND });
    assert!(
        matches!(error, LatticeError::NegativeRate { place: MIDDLE, rate, .. } if rate.to_bits() == (-0.5_f64).to_bits())
    );
    assert_eq!(broken(&report), ["ρ ≥ 0"]);
    assert!(law(&report, "ρ ≥ 0").place == MIDDLE);
    assert!((law(&report, "ρ ≥ 0").size - 0.5).abs() < 0.05);
    // An entropy that the bracket changes.
    let moved = |(x, e): &Dual| e.x.ln() + x.x * 0.1;
    let (error, report) = refused(Chain { entropy: moved, ..SOUND });
    assert!(matches!(error, LatticeError::Broken { law: "Π dS = 0", place: Place::Site(0), .. }));
    assert_eq!(broken(&report), ["Π dS = 0"]);
    assert!((law(&report, "Π dS = 0").size - 1.0).abs() < 1e-12);
    // A derivative that is lost.
    let lost = |(x, e): &Dual| x.y * x.y * 0.5 + e.x + Real::from((x.x.re * 3.0).sin());
    let (error, report) = refused(Chain { energy: lost, ..SOUND });
    assert!(matches!(error, LatticeError::WrongDerivative { what: "energy", .. }));
    assert_eq!(broken(&report), ["⟨dH, u⟩ = ΔH"]);
    // Friction against the frame of the sites.
    let against = |[u, v]: [&Covector; 2], _: [&Mass; 2]| {
        [Onsager { rate: 0.1, b: [vector![0.0, 1.0, -u.y], vector![0.0, 0.5, -0.5 * v.y]] }]
    };
    let (error, report) = refused(Chain { friction: against, ..SOUND });
    let size = law(&report, "⟨dL, x'⟩ = 0").size;
    assert_eq!(error, LatticeError::NotConserved { index: 0, size });
    assert_eq!(broken(&report), ["⟨dL, x'⟩ = 0"]);
    assert_eq!(law(&report, "⟨dL, x'⟩ = 0").place, Place::Total);
}

#[test]
fn every_broken_law_is_in_the_report_of_one_lattice() {
    let push = |[u, v]: [&Covector; 2], _: [&Mass; 2]| {
        friction(-0.1, u, v)
            .map(|Onsager { rate, b }| Onsager { rate, b: b.map(|b| vector![b.x, b.y, 0.0]) })
    };
    let moved = |(x, e): &Dual| e.x.ln() + x.x * 0.1;
    let (error, report) = refused(Chain { entropy: moved, friction: push, ..SOUND });
    assert!(matches!(error, LatticeError::NegativeRate { .. }));
    assert_eq!(broken(&report), ["ρ ≥ 0", "b·(dH_i, dH_j) = 0", "Π dS = 0"]);
}

#[test]
fn a_start_of_a_verified_lattice_is_judged_alone() {
    let mut nan = start(1.0).to_vec();
    nan[3].0.x = f64::NAN;
    let lattice = SOUND.built().verified(&start(1.0)).unwrap();
    let run = |x: Points<Masses>| own(DormandPrince5.run(&lattice, x, short()));
    assert!(matches!(run(nan.into()), LatticeError::Start { place: Place::Site(3), .. }));
    let few = start(1.0)[1..].to_vec();
    assert_eq!(run(few.into()), LatticeError::Points { found: 9, expected: 10 });
    // An energy that is not finite.
    let mut cold = start(1.0).to_vec();
    cold[7].1.x = -1.0;
    assert!(matches!(run(cold.into()), LatticeError::NotFinite { place: Place::Site(7), .. }));
    // A spin that is too long.
    let spins = Lattice::on(Graph::ring(4), Sphere::<2>::round())
        .bracket(AreaForm)
        .energy(|n: &Vector3<Real>| n.z * n.x)
        .build()
        .unwrap();
    let long =
        |of: usize| spins.points(|i| vector![0.6, 0.0, 0.8] * if i == of { 1.1 } else { 1.0 });
    let (sound, long) = (long(4), long(2));
    let spins = spins.verified(&sound).unwrap();
    let error = own(DormandPrince5.run(&spins, long, short()));
    assert!(matches!(error, LatticeError::Start { place: Place::Site(2), .. }));
    // Laws that hold where q < 2.
    let bent = |(x, e): &Dual| {
        if x.x.re > 2.0 { e.x.ln() + x.x * (x.x - 2.0) } else { e.x.ln() }
    };
    let away = |w: [&Covector; 2], [x, y]: [&Mass; 2]| {
        let rate = if x.0.x.max(y.0.x) > 2.0 { -0.1 } else { 0.1 };
        friction(rate, w[0], w[1])
    };
    let pushed = |w: [&Covector; 2], [x, y]: [&Mass; 2]| {
        let heats = if x.0.x.max(y.0.x) > 2.0 { 0.0 } else { 1.0 };
        friction(0.1, w[0], w[1]).map(|Onsager { rate, b }| Onsager {
            rate,
            b: b.map(|b| vector![b.x, b.y, heats * b.z]),
        })
    };
    for chain in [
        Chain { entropy: bent, ..SOUND },
        Chain { friction: away, ..SOUND },
        Chain { friction: pushed, ..SOUND },
    ] {
        let [sound, edge, beyond] = [1.0, 1.998, 2.5].map(start);
        let lattice = chain.built();
        own(DormandPrince5.run(&lattice, edge.clone(), short()));
        let lattice = lattice.verified(&sound).unwrap();
        let run = DormandPrince5.run(&lattice, edge, short()).unwrap();
        assert!(run.certificate().verified_before);
        let error = own(DormandPrince5.run(&lattice, beyond.clone(), short()));
        println!("{error}");
        assert!(matches!(
            error,
            LatticeError::Broken { tried: Tried::Start, .. }
                | LatticeError::NegativeRate { tried: Tried::Start, .. }
        ));
    }
}

fn rod(friction: fn([&Vector1<f64>; 2]) -> [Flux; 1]) -> Lattice<impl Model<Manifold = Rod>> {
    Lattice::on(Graph::chain(5), Euclidean::<1>)
        .energy(|u: &Vector1<Real>| u.x)
        .entropy(|u: &Vector1<Real>| u.x.ln())
        .bond_onsager(move |bond| friction(bond.x))
        .build()
        .expect("a lattice")
}

fn conducting([u, v]: [&Vector1<f64>; 2]) -> [Flux; 1] {
    [Onsager { rate: u.x * v.x, b: [vector![1.0], vector![-1.0]] }]
}

/// Conducts up to the temperature 2, and not the right way beyond it.
fn conducting_below_two([u, v]: [&Vector1<f64>; 2]) -> [Flux; 1] {
    let sign = if u.x.max(v.x) > 2.0 { -1.0 } else { 1.0 };
    [Onsager { rate: sign * u.x * v.x, b: [vector![1.0], vector![-1.0]] }]
}

fn leaking([u, v]: [&Vector1<f64>; 2]) -> [Flux; 1] {
    [Onsager { rate: u.x * v.x, b: [vector![1.0], vector![-0.5]] }]
}

fn warm(at: f64) -> Points<Rod> {
    (0..5).map(|i| vector![at + 1e-4 * f64::from(i)]).collect::<Vec<_>>().into()
}

/// A bath that gives the heat `2 (T − u)` to a site.
fn contact(_: f64, at: &SiteState<'_, Rod>) -> [Onsager<Vector1<f64>>; 1] {
    [Onsager { rate: 2.0 * at.x.x, b: vector![1.0] }]
}

/// The velocity of a port that heats, or does nothing at zero.
fn heater(velocity: f64) -> impl Fn(f64, usize, &Vector1<f64>) -> Vector1<f64> + Send + Sync {
    move |_, _, _| vector![velocity]
}

/// The error of each of the verbs and of a run, all of them the same, and the report.
fn surroundings_refused<P: Model>(
    lattice: OpenLattice<P>,
    points: Points<P::Manifold>,
) -> (ModelError, LatticeReport) {
    let x = lattice.start(points);
    let error = lattice.verify(&x).expect_err("it breaks a law");
    let report = lattice.report(&x);
    println!("{report}\n");
    assert_eq!(report.verdict, Err(error.clone()));
    let of_run = match DormandPrince5.run(&lattice, x.clone(), short()) {
        Err(RunError::Model(law)) => law,
        other => panic!("{other:?}"),
    };
    assert_eq!(error, LatticeError::Surroundings(Box::new(of_run.clone())));
    assert_eq!(error.to_string(), of_run.to_string());
    assert_eq!(lattice.verified(&x).err(), Some(error));
    (of_run, report)
}

#[test]
fn an_open_lattice_is_verified_once_and_its_report_lists_its_surroundings() {
    let open =
        rod(conducting).opened().work("idle", [2], heater(0.0)).bath("hot", 2.0, [0], contact);
    let x = open.start(warm(1.5));
    assert_eq!(open.verify(&x), Ok(()));
    let report = open.report(&x);
    println!("{report}");
    assert_eq!(report.verdict, Ok(()));
    let closed = open.lattice().report(&x.x).laws;
    assert_eq!(report.laws[..closed.len()], closed);
    let surroundings: Vec<_> = report.laws[closed.len()..].iter().map(|law| law.law).collect();
    assert_eq!(surroundings, ["⟨dS, F⟩ = 0", "T ≥ 0", "ρ ≥ 0 of baths"]);
    assert_eq!(law(&report, "ρ ≥ 0 of baths").part.as_deref(), Some("hot"));
    assert!(report.laws.iter().all(|law| law.holds));
    let span = || Span::steps(0.05, 40);
    let before = DormandPrince5.run(&open, x.clone(), span()).unwrap();
    assert!(!before.certificate().verified_before);
    let open = open.verified(&x).unwrap();
    let after = DormandPrince5.run(&open, x.clone(), span()).unwrap();
    assert!(after.certificate().verified_before);
    assert_eq!(before.states(), after.states());
    // A further bath is not verified.
    let open = open.bath("cold", 1.0, [4], contact);
    let x = open.start(warm(1.5));
    let run = DormandPrince5.run(&open, x.clone(), span()).unwrap();
    assert!(!run.certificate().verified_before);
    // A lattice that was verified is so with surroundings too.
    let open = rod(conducting).verified(&warm(1.5)).unwrap().opened();
    let run = DormandPrince5.run(&open, open.start(warm(1.5)), span()).unwrap();
    assert!(run.certificate().verified_before);
}

#[test]
fn surroundings_that_break_a_law_are_in_the_report_with_their_site() {
    let open = || rod(conducting).opened().work("idle", [1], heater(0.0));
    let (error, report) = surroundings_refused(open().work("heater", [3], heater(0.1)), warm(1.5));
    assert!(matches!(error, ModelError::WorkCarriesEntropy { .. }));
    assert_eq!(broken(&report), ["⟨dS, F⟩ = 0"]);
    let carried = law(&report, "⟨dS, F⟩ = 0");
    assert_eq!((carried.place, carried.part.as_deref()), (Place::Site(3), Some("heater")));
    assert!(report.to_string().contains("site 3, heater"));
    let (error, report) = surroundings_refused(open().bath("cold", -1.0, [4], contact), warm(1.5));
    assert!(matches!(error, ModelError::BathNotPositive { .. }));
    assert_eq!(broken(&report), ["T ≥ 0"]);
    assert!((law(&report, "T ≥ 0").size - 1.0).abs() < 1e-15);
    let wrong =
        |_: f64, at: &SiteState<'_, Rod>| [Onsager { rate: 1.50025 - at.x.x, b: vector![1.0] }];
    let (error, report) = surroundings_refused(open().bath("wrong", 1.0, 0..5, wrong), warm(1.5));
    assert!(matches!(error, ModelError::FrictionNotPositive { .. }));
    assert_eq!(broken(&report), ["ρ ≥ 0 of baths"]);
    // The worst of two, and not the first one.
    let rates = law(&report, "ρ ≥ 0 of baths");
    assert!(rates.place == Place::Site(4) && (rates.size - 1.5e-4).abs() < 1e-12);
    // A push on one of the masses, whose momentum is to be kept.
    let push = |_: f64, _: usize, _: &Mass| vector![0.0, 1.0, 0.0];
    let (error, report) =
        surroundings_refused(SOUND.built().opened().work("push", [1], push), start(1.0));
    assert!(matches!(error, ModelError::PortBreaksInvariant { index: 0, .. }));
    assert_eq!(broken(&report), ["⟨dL, F⟩ = 0"]);
    // All laws of both.
    let open = rod(leaking).opened().work("heater", [2], heater(0.1));
    let x = open.start(warm(1.5));
    let report = open.report(&x);
    assert_eq!(broken(&report), ["b·(dH_i, dH_j) = 0", "⟨dS, F⟩ = 0"]);
    assert_eq!(report.verdict, open.lattice().verify(&x.x));
    assert_eq!(open.verify(&x), report.verdict);
}

#[test]
fn a_start_of_a_verified_open_lattice_is_judged_alone() {
    let open = || rod(conducting_below_two).opened().work("idle", [2], heater(0.0));
    let [sound, edge, beyond, cold] = [1.0, 1.999, 2.5, -1.0].map(|at| open().start(warm(at)));
    own(DormandPrince5.run(&open(), edge.clone(), short()));
    let open = open().verified(&sound).unwrap();
    assert!(DormandPrince5.run(&open, edge, short()).unwrap().certificate().verified_before);
    let run = |x| own(DormandPrince5.run(&open, x, short()));
    assert!(matches!(run(beyond), LatticeError::NegativeRate { tried: Tried::Start, .. }));
    assert!(matches!(run(cold), LatticeError::NotFinite { .. }));
    let few = open.start(warm(1.0)[1..].to_vec().into());
    assert_eq!(run(few.clone()), LatticeError::Points { found: 4, expected: 5 });
    assert_eq!(open.verify(&few), Err(LatticeError::Points { found: 4, expected: 5 }));
    let report = open.report(&few);
    assert!(report.laws.is_empty() && report.verdict == open.verify(&few));
}

/// The error of each of the verbs of a lattice with noise, all of them the same.
fn noise_refused<P: Model<Manifold = Rod>>(
    noisy: Noisy<Lattice<P>, Uniform>,
) -> NoisyError<LatticeError> {
    let x = warm(1.5);
    let error = noisy.verify(&x, 0.01).expect_err("it breaks a law");
    let report = noisy.report(&x);
    println!("{report}\n");
    match &error {
        NoisyError::Model(law) => {
            assert_eq!((&report.model.verdict, &report.noise), (&Err(law.clone()), &None));
            assert_eq!(own(path(&noisy, &x)), *law);
        }
        NoisyError::Noise(fault) => {
            assert_eq!(report.model.verdict, Ok(()));
            let Err(RunError::Flow(of_run)) = path(&noisy, &x) else { panic!("it is refused") };
            let of_run: &NoiseError = of_run.downcast_ref().expect("of noise");
            assert_eq!(format!("{of_run:?}"), format!("{fault:?}"));
            assert_eq!(format!("{:?}", report.noise), format!("{:?}", Some(Err::<(), _>(fault))));
        }
        _ => panic!("{error}"),
    }
    assert_eq!(noisy.verified(&x).err().map(|error| error.to_string()), Some(error.to_string()));
    error
}

fn path<P: Model<Manifold = Rod>>(
    noisy: &Noisy<Lattice<P>, Uniform>,
    x: &Points<Rod>,
) -> Result<Trajectory<Sites<Rod>>, RunError<Sites<Rod>>> {
    RandomFlow(DormandPrince5).seed(1).run(noisy, x.clone(), short())
}

#[test]
fn a_lattice_with_noise_is_verified_once_with_the_law_of_its_noise() {
    let (noisy, x) = (rod(conducting).with_noise(Boltzmann(0.01)), warm(1.5));
    assert_eq!(noisy.verify(&x, 0.01), Ok(()));
    let report = noisy.report(&x);
    assert_eq!(report.model, noisy.flow().report(&x));
    assert!(report.model.verdict == Ok(()) && report.noise == Some(Ok(())));
    assert!(report.to_string().ends_with("noise: its law is exp(S/k_B)"));
    let before = path(&noisy, &x).unwrap();
    assert!(!before.certificate().verified_before);
    let noisy = noisy.verified(&x).unwrap();
    let after = path(&noisy, &x).unwrap();
    assert!(after.certificate().verified_before);
    assert_eq!(before.states(), after.states());
    // A lattice that was verified before it had noise.
    let noisy = rod(conducting).verified(&x).unwrap().with_noise(Boltzmann(0.01));
    assert!(path(&noisy, &x).unwrap().certificate().verified_before);
    for k_b in [-1.0, 0.0, f64::NAN, f64::INFINITY] {
        let error = noise_refused(rod(conducting).with_noise(Boltzmann(k_b)));
        assert!(
            matches!(error, NoisyError::Noise(NoiseError::BoltzmannNotPositive { .. })),
            "{error}"
        );
    }
    let error = noise_refused(rod(leaking).with_noise(Boltzmann(0.01)));
    assert!(
        matches!(error, NoisyError::Model(LatticeError::Broken { place: Place::Bond { .. }, .. })),
        "{error}"
    );
}

#[test]
fn a_start_of_a_verified_lattice_with_noise_is_judged_alone() {
    let noisy = rod(conducting_below_two).with_noise(Boltzmann(1e-9));
    own(path(&noisy, &warm(1.999)));
    // States that are further away.
    assert_eq!(noisy.verify(&warm(1.8), 0.01), Ok(()));
    assert!(noisy.verify(&warm(1.8), 0.2).is_err());
    let noisy = noisy.verified(&warm(1.0)).unwrap();
    assert!(path(&noisy, &warm(1.999)).unwrap().certificate().verified_before);
    assert!(matches!(own(path(&noisy, &warm(2.5))), LatticeError::NegativeRate { .. }));
    assert!(matches!(own(path(&noisy, &warm(-1.0))), LatticeError::NotFinite { .. }));
}
