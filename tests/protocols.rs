//! Energies that depend on time, ports and baths of systems whose size is known at run time: lattices, and systems of one's own. Masses
//! on springs are built as a lattice and as a system in plain numbers, and two of them as a typed system, which run alike.

#[path = "protocols/masses.rs"]
mod masses;

use masses::{Chain, ONE, World, X, chain, on_lattice, surrounded, typed};
use metriplectic::dynamics::SecondLaw;
use metriplectic::equations::{
    Apart, Covectors, Differences, ENERGY, ENTROPY, Equations, FrictionTerms, Part, Sizes, Terms,
};
use metriplectic::integrators::open::Ledger;
use metriplectic::integrators::{
    FromEquations, ItohAbe, MeanValue, NoImplicitSteps, OpenEquations, OpenSpace, Schedule,
    StateSpace,
};
use metriplectic::prelude::*;

/// A start without symmetry.
const GENERIC: [[f64; 3]; 2] = [[0.3, 0.5, 0.06], [-0.4, -0.55, 0.27]];
/// All masses at rest, at the temperature of the air.
const REST: [[f64; 3]; 2] = [[0.0; 3]; 2];

/// A run that is compared.
#[derive(Clone)]
struct Case {
    world: World,
    start: [[f64; 3]; 2],
    schedule: Schedule,
    /// What the numbers of masses in plain numbers may differ by from those of the typed system, and those of a lattice by an explicit
    /// method, which moves a state onto its laws along another direction.
    allowed: [f64; 2],
}

fn cases() -> Vec<Case> {
    let steps = || Span::steps(0.1, 8).into();
    let plain = Case { world: ONE, start: GENERIC, schedule: steps(), allowed: [1e-11, 1e-6] };
    let energy = surrounded(chain(2, ONE), ONE);
    let energy = energy.energy_at(&energy.start(ONE.start(&GENERIC)));
    let mut cases = vec![
        plain.clone(),
        Case { start: REST, ..plain.clone() },
        // The energy of the start counts as zero.
        Case { world: World { zero: 0.5 * energy, ..ONE }, ..plain.clone() },
    ];
    // Numbers of the size of molecules, of stars, and of nothing that there is.
    for units in [[4e-21, 1.4e-23, 1e-9], [1e30, 1e27, 1e9], [1e-30, 1e-32, 1e-10]] {
        // A number relative to terms that cancel.
        cases.push(Case { world: World { units, ..ONE }, ..plain.clone() });
    }
    cases
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// A number of a state.
type NumberOf<'a, M> = &'a dyn Fn(&OpenState<<M as StateSpace>::Element>) -> f64;

/// Asserts `H − H₀ = W + Q` on every state of a run by the values of the system, and that the entropy of the system and its baths never
/// falls.
fn keeps_both_laws<M: StateSpace>(
    name: &str,
    world: &World,
    run: &Trajectory<OpenSpace<M>>,
    [energy, entropy]: [NumberOf<'_, M>; 2],
) {
    let certificate = run.certificate();
    assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{name}: {certificate}");
    let first = energy(&run.states()[0].point);
    let mut before = f64::NEG_INFINITY;
    for state in run.states() {
        let (state, ledger, [unit, of_entropy, _]) =
            (&state.point, &state.point.ledger, world.units);
        let heats = ["air", "oven"].map(|bath| ledger.heat(bath).expect("a bath"));
        let flowed =
            ledger.parameter_work() + ledger.work("motor").expect("a port") + heats[0] + heats[1];
        let off = (energy(state) - first - flowed) / unit;
        assert!(off.abs() < 1e-13, "{name}: {off:.1e}");
        let now = (entropy(state) + ledger.entropy_of_baths()) / of_entropy;
        assert!(now >= before - 1e-14, "{name}: from {before} to {now}");
        before = now;
    }
}

/// Compares two masses that are built in three ways, by each method.
macro_rules! compare {
    ($case:expr, $is_explicit:expr; $($method:expr),+) => {$(
        let (name, Case { world, start, schedule, allowed }) = (stringify!($method), $case.clone());
        let start = world.start(&start);
        let failed = |error: &dyn std::fmt::Display| -> ! { panic!("{name} in {world:?}: {error}") };
        let system = typed!(world);
        let x = X::from_column_slice(&start);
        let run = $method.run(&system, system.start(x), schedule.clone()).unwrap_or_else(|e| failed(&e));
        let end = &run.last().point;
        let reference = world.numbers(end.x.as_slice(), &end.ledger);

        let lattice = on_lattice(2, world);
        let points = lattice.lattice().points(|i| Vector3::from_column_slice(&start[3 * i..][..3]));
        let run = $method.run(&lattice, lattice.start(points), schedule.clone()).unwrap_or_else(|e| failed(&e));
        keeps_both_laws(name, &world, &run, [&|x| lattice.energy_at(x), &|x| lattice.entropy_at(x)]);
        let end = &run.last().point;
        let entries: Vec<f64> = end.x.iter().flat_map(|x| [x.x, x.y, x.z]).collect();
        let sites = distance(&reference, &world.numbers(&entries, &end.ledger));

        let own = surrounded(Differences(chain(2, world)), world);
        let run = $method.run(&own, own.start(start), schedule).unwrap_or_else(|e| failed(&e));
        keeps_both_laws(name, &world, &run, [&|x| own.energy_at(x), &|x| own.entropy_at(x)]);
        let end = &run.last().point;
        let own = distance(&reference, &world.numbers(&end.x, &end.ledger));

        println!("{name}: {sites:.1e} {own:.1e}");
        let of_sites = if $is_explicit { allowed[1] } else { allowed[0] };
        assert!(own < allowed[0], "{name} in {world:?}: {own:.1e}");
        assert!(sites < of_sites, "{name} in {world:?}: {sites:.1e}");
    )+};
}

#[test]
fn two_masses_run_alike_however_they_are_built() {
    for case in cases() {
        compare!(case, false;
            WeylMidpoint,
            Scheme::new(WeylMidpoint).gradient(MeanValue),
            Scheme::new(WeylMidpoint).gradient(ItohAbe),
            Gauss::<1>,
            Gauss::<2>,
            Gauss::<3>
        );
        compare!(case, true; DormandPrince5, DormandPrince8);
        // Of order 2, and so far apart at steps of this size.
        let case = Case { allowed: [1e-11, 5e-3], ..case };
        compare!(case, true; RungeKuttaChebyshev);
    }
}

#[test]
fn steps_that_follow_a_tolerance_come_to_the_same_state() {
    for start in [GENERIC, REST] {
        let schedule = |tolerance: f64| Span::until(1.0).tolerance(tolerance).into();
        let case = |tolerance: f64, off: f64| Case {
            world: ONE,
            start,
            schedule: schedule(tolerance),
            allowed: [off; 2],
        };
        compare!(case(1e-3, 1e-4), false; WeylMidpoint);
        compare!(case(1e-5, 1e-6), false; Gauss::<2>);
        compare!(case(1e-7, 1e-6), true; DormandPrince5);
        compare!(case(1e-9, 1e-8), true; DormandPrince8);
        compare!(case(1e-4, 1e-4), true; RungeKuttaChebyshev);
    }
}

/// Masses without heat in traps that move, in air that may stop them within a small part of a step, in plain numbers.
#[derive(Clone, Copy)]
struct Traps(usize);

impl Equations for Traps {
    fn sizes(&self) -> Sizes {
        Sizes { entries: 2 * self.0, directions: 2 * self.0, laws: 2 }
    }

    fn values(&self, t: f64, x: &[f64], values: &mut [f64]) {
        let (q, p) = x.split_at(self.0);
        let trap: f64 = q.iter().map(|q| 0.5 * (q - t.sin()).powi(2)).sum();
        values[ENERGY] = trap + p.iter().map(|p| 0.5 * p * p).sum::<f64>();
        values[ENTROPY] = 0.0;
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.values(t, x, values);
        w.fill(0.0);
        (0..self.0).for_each(|i| w[i] = x[i] - t.sin());
        w[self.0..2 * self.0].copy_from_slice(&x[self.0..]);
    }

    fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        v[..self.0].copy_from_slice(&x[self.0..]);
        (0..self.0).for_each(|i| v[self.0 + i] = t.sin() - x[i]);
        Some(0.0)
    }

    fn energy_depends_on_time(&self) -> bool {
        true
    }

    fn power(&self, t: f64, x: &[f64]) -> f64 {
        -x[..self.0].iter().map(|q| (q - t.sin()) * t.cos()).sum::<f64>()
    }

    fn is_vector_space(&self) -> bool {
        true
    }
}

impl Apart for Traps {
    fn is_zero(&self, part: Part) -> bool {
        part != Part::Reversible
    }

    fn apply(&self, _: Part, _: f64, _: &[f64], _: Covectors<'_>, alpha: &[f64], v: &mut [f64]) {
        let (of_q, of_p) = alpha.split_at(self.0);
        v[..self.0].copy_from_slice(of_p);
        (0..self.0).for_each(|i| v[self.0 + i] = -of_q[i]);
    }
}

fn traps(count: usize, friction: f64) -> OpenEquations<Differences<Traps>> {
    FromEquations(Differences(Traps(count))).opened().bath("air", 0.7, move |_, contact| {
        (count..2 * count).for_each(|p| contact(friction, &[(p, 1.0)]));
    })
}

#[test]
fn radau_damps_masses_that_follow_moving_traps() {
    // Where friction is stiff the energy has lost digits of the slow motion.
    for (friction, allowed) in [(0.3, 1e-12), (1e3, 1e-7)] {
        let system = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy_in_time(|t: Real, x: &Vector2<Real>| {
                x.y * x.y * 0.5 + (x.x - t.sin()).powi(2) * 0.5
            })
            .bath(
                "air",
                Bath::at(0.7).friction(move |_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                    [Contact { rate: friction.into(), along: vector![0.0.into(), 1.0.into()] }]
                }),
            )
            .build()
            .unwrap();
        let lattice = Lattice::on(Graph::from_bonds(2, []), Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.y * x.y * 0.5)
            .build()
            .unwrap()
            .opened()
            .energy_in_time(|t, _, x: &Vector2<Real>| (x.x - t.sin()).powi(2) * 0.5)
            .bath("air", 0.7, 0..2, move |_, _: &SiteState<'_, Euclidean<2>>| {
                [Onsager { rate: friction, b: vector![0.0, 1.0] }]
            });
        let own = traps(2, friction);
        macro_rules! compare {
            ($($method:expr),+) => {$(
                let span = || Span::steps(0.1, 40);
                let typed = $method.run(&system, system.start(vector![0.4, -0.3]), span()).expect("typed");
                let points = lattice.lattice().points(|_| vector![0.4, -0.3]);
                let sites = $method.run(&lattice, lattice.start(points), span()).expect("sites");
                let plain = $method.run(&own, own.start([0.4, 0.4, -0.3, -0.3]), span()).expect("own");
                for certificate in [sites.certificate(), plain.certificate()] {
                    assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
                }
                let ledger = |l: &Ledger| {
                    [l.parameter_work(), l.heat("air").unwrap(), l.bath_entropy("air").unwrap()]
                };
                let [a, b, c] = [&typed.last().point.x, &sites.last().point.x[1],
                    &vector![plain.last().point.x[0], plain.last().point.x[2]]];
                let reference = [a.as_slice(), &ledger(&typed.last().point.ledger).map(|w| 2.0 * w)].concat();
                for (way, x, l) in [("sites", b, &sites.last().point.ledger), ("own", c, &plain.last().point.ledger)] {
                    let off = distance(&reference, &[x.as_slice(), &ledger(l)].concat());
                    println!("{} at {friction}, {way}: {off:.1e}", stringify!($method));
                    assert!(off < allowed, "{} at {friction}, {way}: {off:.1e}", stringify!($method));
                }
            )+};
        }
        compare!(Radau::<2>, Radau::<3>, Gauss::<2>, WeylMidpoint);
    }
}

/// The law that a run of masses in plain numbers is refused for, or that ends it.
fn law_of(open: &OpenEquations<impl Equations>, start: &[f64]) -> ModelError {
    match DormandPrince5.run(open, open.start(start.to_vec()), Span::steps(0.05, 20)) {
        Err(RunError::Model(law)) => law,
        Err(RunError::Step { cause: StepError::Model { law, .. }, .. }) => *law,
        other => panic!("{:?}", other.map(|run| run.certificate().to_string())),
    }
}

#[test]
fn surroundings_of_ones_own_that_break_a_law_are_refused() {
    let (start, open) = (ONE.start(&GENERIC), || FromEquations(chain(2, ONE)).opened());
    let law = law_of(&open(), &start[..5]);
    let length = metriplectic::manifolds::PointError::Length { found: 5, expected: 6 };
    assert_eq!(law, ModelError::Start(length));
    let law = law_of(&open().work("motor", |_, _, v| v[1] = f64::NAN), &start);
    assert!(matches!(law, ModelError::ExchangeNotFinite { .. }), "{law}");
    let law =
        law_of(&open().work("late", |t, _, v| v[1] = if t > 0.5 { f64::NAN } else { 0.0 }), &start);
    assert!(matches!(law, ModelError::ExchangeNotFinite { time, .. } if time > 0.5), "{law}");
    let law = law_of(&open().work("heater", |_, _, v| v[2] = 0.1), &start);
    assert!(matches!(law, ModelError::WorkCarriesEntropy { .. }), "{law}");
    let law = law_of(&open().bath("cold", -1.0, |_, contact| contact(0.1, &[(1, 1.0)])), &start);
    assert!(matches!(law, ModelError::BathNotPositive { .. }), "{law}");
    let law = law_of(&open().bath("wrong", 1.0, |_, contact| contact(-0.1, &[(1, 1.0)])), &start);
    assert!(matches!(law, ModelError::FrictionNotPositive { .. }), "{law}");
    let law = law_of(&open().bath("beyond", 1.0, |_, contact| contact(0.1, &[(6, 1.0)])), &start);
    assert!(matches!(law, ModelError::ContactOutside { direction: 6, directions: 6, .. }), "{law}");
    let panics = open().work("motor", |t, _, _| assert!(t < 0.3, "it is late"));
    let run = DormandPrince5.run(&panics, panics.start(start.clone()), Span::steps(0.05, 20));
    assert!(run.is_err_and(|error| error.to_string().contains("it is late")));
    let unknown = open();
    let run = Gauss::<2>.run(&unknown, unknown.start(start), Span::steps(0.05, 2));
    let Err(RunError::Method(error)) = run else { panic!("it has a step") };
    assert_eq!(error.downcast_ref(), Some(&NoImplicitSteps::Model));
}

#[test]
fn an_energy_that_depends_on_time_says_so_and_has_its_power() {
    let start = ONE.start(&GENERIC);
    let plain = chain(2, ONE);
    // A closed run would ask for it at the time 0.
    for says in [true, false] {
        let closed = FromEquations(Chain { says, ..plain });
        let run = DormandPrince5.run(&closed, start.clone().into(), Span::steps(0.05, 2));
        assert!(matches!(run, Err(RunError::Model(ModelError::EnergyInTime))), "{run:?}");
        assert_eq!(closed.verified(&start).err(), Some(ModelError::EnergyInTime));
    }
    let lost = |chain: Chain| law_of(&surrounded(chain, ONE), &start);
    assert_eq!(lost(Chain { says: false, ..plain }), ModelError::EnergyInTime);
    let law = lost(Chain { factor: 1.02, ..plain });
    assert!(matches!(law, ModelError::LostTimeDerivative { .. }), "{law}");
    let law = lost(Chain { factor: f64::NAN, ..plain });
    assert!(matches!(law, ModelError::DerivativeNotFinite { .. }), "{law}");
    metriplectic::equations::laws::equations(&plain, 0.4, &start, &start).unwrap();
    let off = Chain { factor: 1.02, ..plain };
    assert!(metriplectic::equations::laws::equations(&off, 0.4, &start, &start).is_err());

    // A field of a lattice that loses the derivative of the time, and one that jumps inside a step.
    let spins = |field: fn(Real) -> Real| {
        Lattice::on(Graph::ring(4), Sphere::<2>::round())
            .bracket(AreaForm)
            .bond_energy(|(a, b): &(Vector3<Real>, Vector3<Real>)| -a.dot(b))
            .build()
            .unwrap()
            .opened()
            .energy_in_time(move |t, site, n: &Vector3<Real>| n.z * field(t) * (1.0 + site as f64))
    };
    let run = |field: fn(Real) -> Real, span: Schedule| {
        let ring = spins(field);
        let start = ring.start(ring.lattice().points(|_| vector![0.6, 0.0, 0.8]));
        DormandPrince8.run(&ring, start, span)
    };
    let steps = || Span::steps(0.1, 10).into();
    let lost = run(|t| Real::from(t.re.sin()), steps());
    assert!(
        matches!(lost, Err(RunError::Model(ModelError::LostTimeDerivative { .. }))),
        "{lost:?}"
    );
    let switch: fn(Real) -> Real = |t| Real::from(if t.re < 0.55 { 0.0 } else { 1.0 });
    let jumps = run(switch, steps());
    let is_jump = |error: &RunError<_>| {
        matches!(error, RunError::Step { cause: StepError::ProtocolJumps { .. }, .. })
    };
    assert!(jumps.as_ref().err().is_some_and(is_jump), "{jumps:?}");
    // A corner is work at a state that stands still.
    let cornered = run(switch, Span::until(1.0).tolerance(1e-9).corners([0.55])).unwrap();
    let ledger = &cornered.last().point.ledger;
    assert!(cornered.certificate().keeps_energy(), "{}", cornered.certificate());
    assert!((ledger.parameter_work() - 0.8 * 10.0).abs() < 1e-12, "{}", ledger.parameter_work());
}

#[test]
fn a_run_of_ones_own_that_is_put_down_goes_on_with_the_same_bits() {
    let open = surrounded(Differences(chain(2, ONE)), ONE);
    let start = || open.start(ONE.start(&GENERIC));
    macro_rules! check {
        ($($method:expr),+) => {$(
            let span = || Span::until(1.0).tolerance(1e-4).output_every(0.3);
            let whole = $method.run(&open, start(), span()).unwrap();
            let mut steps = $method.steps(&open, start(), span()).unwrap();
            for _ in 0..3 {
                steps.advance().unwrap();
            }
            let checkpoint = metriplectic_studies::checkpoints::reread(&steps.checkpoint());
            let resumed = $method.resume(&open, &checkpoint).unwrap().run().unwrap();
            assert_eq!(resumed.last(), whole.last());
            assert_eq!(resumed.certificate(), whole.certificate());
        )+};
    }
    check!(Gauss::<2>, DormandPrince8);
    let simulation = Simulation::new(DormandPrince8, surrounded(Differences(chain(2, ONE)), ONE));
    let span = || Span::steps(0.1, 5);
    let run = simulation.run(&ONE.start(&GENERIC), span()).unwrap();
    let typed = DormandPrince8.run(&open, start(), span()).unwrap();
    assert_eq!(run.last().point[..6], typed.last().point.x[..]);
    let x0 = start();
    let verified = open.verified(&x0).unwrap();
    let run = DormandPrince8.run(&verified, verified.start(ONE.start(&GENERIC)), span()).unwrap();
    assert!(run.certificate().verified_before && run.last().point == typed.last().point);
    assert!(verified.report(&verified.start(ONE.start(&GENERIC))).verdict.is_ok());
}

/// Compares the tangents of two masses in plain numbers with those of the typed system: of the state and the ledger, along the start,
/// the clock and the parameters, forwards and backwards.
#[test]
fn tangents_of_ones_own_in_surroundings_are_those_of_a_typed_system() {
    let world = |t: &Vector2<f64>| World { drive: t.x, air: t.y, ..ONE };
    let typed = Systems::new(["drive", "air"], |t: &Vector2<f64>| Ok::<_, Error>(typed!(world(t))));
    let own = Systems::new(["drive", "air"], |t: &Vector2<f64>| {
        Ok::<_, Error>(surrounded(Differences(chain(2, world(t))), world(t)))
    });
    let theta = vector![1.0, 0.08];
    let (a, own) = (typed.at(theta).unwrap(), own.at(theta).unwrap());
    let start = ONE.start(&GENERIC);
    macro_rules! compare {
        ($($method:expr),+) => {$({
            let (name, span) = (stringify!($method), Span::steps(0.1, 3));
            let typed = $method.tangent(&a, a.start(X::from_column_slice(&start)), span).unwrap();
            let run = $method.tangent(&own, own.start(start.clone()), span).unwrap();
            let plain = $method.run(&own, own.start(start.clone()), span).unwrap();
            assert!(plain.last().point == run.last().point, "{name}: the tangent changed the run");
            let (exact, found) = (typed.last().matrix(), run.last().matrix());
            // Six entries, the clock, six columns of the ledger, and the parameters.
            assert_eq!(found.shape(), (13, 15));
            let off = (&found - &exact).amax() / exact.amax();
            // Along the start without its parameters, too.
            let alone = $method.tangent(&*own, own.start(start.clone()), span).unwrap();
            let without = alone.last().matrix();
            let apart = (found.columns(0, 13) - &without).amax() / exact.amax();
            let heats = ["air", "oven"].map(|bath| {
                let [a, b] = [typed.last().heat_along(bath), run.last().heat_along(bath)];
                let (a, b) = (a.unwrap(), b.unwrap());
                assert!(a[14].abs() > 1e-5, "{name}: {a}");
                (a - b).amax()
            });
            let row = nalgebra::DVector::from_fn(13, |i, _| (1.0 + i as f64).sin());
            let back = $method.adjoint(&own, own.start(start.clone()), span).unwrap();
            let mut rows = vec![nalgebra::DVector::zeros(13); back.states().len()];
            rows[3] = row.clone();
            let gradient = back.pull_back(&rows).unwrap();
            let forward = run.last().derivative_of(&row);
            let transposed = (gradient.along_parameters() - forward.rows(13, 2)).amax()
                .max((gradient.along_start() - forward.rows(0, 13)).amax());
            println!("{name}: {off:.1e} {apart:.1e} {heats:?} {transposed:.1e}, {}", run.sensitivity());
            assert!(off < 1e-8 && apart < 1e-8, "{name}: {off:e} {apart:e}\n{found:.7}\n{exact:.7}");
            assert!(heats.iter().all(|off| *off < 1e-8), "{name}: {heats:?}");
            assert!(transposed < 1e-7, "{name}: {transposed:e}");
            assert!(run.sensitivity().energy < 1e-8, "{name}: {}", run.sensitivity());
        })+};
    }
    compare!(WeylMidpoint, Gauss::<2>, DormandPrince8);
}

/// An oscillator that rubs on a body, which conducts heat to another one: `H = ½q² + ½p² + Σ (u + ¼u²)`, `S = Σ ln u`.
#[derive(Clone, Copy)]
struct Rubbing {
    /// A factor of the rates of the terms that it lists, and a term that is left out of them.
    factor: f64,
    listed: usize,
}

const RUBBING: Rubbing = Rubbing { factor: 1.0, listed: 2 };

impl Equations for Rubbing {
    fn sizes(&self) -> Sizes {
        Sizes { entries: 4, directions: 4, laws: 2 }
    }

    fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
        let heat = |u: f64| u + 0.25 * u * u;
        values[ENERGY] = 0.5 * (x[0] * x[0] + x[1] * x[1]) + heat(x[2]) + heat(x[3]);
        values[ENTROPY] = x[2].ln() + x[3].ln();
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.values(t, x, values);
        let slopes = [x[0], x[1], 1.0 + 0.5 * x[2], 1.0 + 0.5 * x[3]];
        w[..4].copy_from_slice(&slopes);
        w[4..].copy_from_slice(&[0.0, 0.0, x[2].recip(), x[3].recip()]);
    }

    fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        let (mut values, mut w) = ([0.0; 2], [0.0; 8]);
        self.differentials(t, x, &mut values, &mut w);
        let w = Covectors { energy: &w[..4], entropy: &w[4..] };
        self.apply(Part::Irreversible, t, x, w, w.entropy, v);
        let production = v[2] * w.entropy[2] + v[3] * w.entropy[3];
        v[0] += w.energy[1];
        v[1] -= w.energy[0];
        Some(production)
    }

    fn second_law(&self) -> SecondLaw {
        SecondLaw::Exact
    }

    fn is_vector_space(&self) -> bool {
        true
    }
}

impl Rubbing {
    fn all_terms(x: &[f64], w: Covectors<'_>) -> [(f64, [(usize, f64); 2]); 2] {
        let w = w.energy;
        [(0.3 * x[2], [(1, w[2]), (2, -w[1])]), (0.2 * x[2] * x[3], [(2, w[3]), (3, -w[2])])]
    }
}

impl Apart for Rubbing {
    fn is_zero(&self, part: Part) -> bool {
        part == Part::Gyroscopic
    }

    fn apply(&self, part: Part, _: f64, x: &[f64], w: Covectors<'_>, alpha: &[f64], v: &mut [f64]) {
        v.fill(0.0);
        if part == Part::Reversible {
            (v[0], v[1]) = (alpha[1], -alpha[0]);
            return;
        }
        for (rate, b) in Self::all_terms(x, w) {
            let force: f64 = b.iter().map(|&(k, b)| b * alpha[k]).sum();
            b.iter().for_each(|&(k, b)| v[k] += rate * force * b);
        }
    }
}

impl FrictionTerms for Rubbing {
    fn term_count(&self) -> usize {
        2
    }

    fn terms(&self, _: f64, x: &[f64], w: Covectors<'_>, term: &mut Terms<'_>) {
        for (rate, b) in Self::all_terms(x, w).into_iter().take(self.listed) {
            term(self.factor * rate, &b);
        }
    }
}

#[test]
fn a_path_of_ones_own_is_that_of_a_typed_system() {
    let start = [0.7, -0.4, 0.9, 1.3];
    let tensor =
        matrix![0.0, 1.0, 0.0, 0.0; -1.0, 0.0, 0.0, 0.0; 0.0, 0.0, 0.0, 0.0; 0.0, 0.0, 0.0, 0.0];
    let heat = |u: Real| u + u * u * 0.25;
    let typed = System::on(Euclidean::<4>)
        .bracket(Poisson::constant(tensor).unwrap())
        .energy(move |x: &Vector4<Real>| (x.x * x.x + x.y * x.y) * 0.5 + heat(x.z) + heat(x.w))
        .entropy(|x: &Vector4<Real>| x.z.ln() + x.w.ln())
        .dissipation(OnsagerDissipation(|x: &Vector4<Real>, w: &Vector4<Real>| {
            let o = Real::from(0.0);
            [
                Contact { rate: x.z * 0.3, along: vector![o, w.z, -w.y, o] },
                Contact { rate: x.z * x.w * 0.2, along: vector![o, o, w.w, -w.z] },
            ]
        }))
        .noise(Boltzmann(0.05))
        .build()
        .unwrap();
    let own = FromEquations(Differences(RUBBING)).with_noise(Boltzmann(0.05));
    let span = || Span::steps(0.02, 50);
    macro_rules! compare {
        ($($method:expr),+) => {$(
            let name = stringify!($method);
            let reference = $method.run(&typed, Vector4::from(start), span()).unwrap();
            let run = $method.run(&own, start.into(), span()).unwrap();
            assert!(run.certificate().keeps_energy(), "{name}: {}", run.certificate());
            let off = distance(reference.last().point.as_slice(), &run.last().point);
            let moved = distance(&start, &run.last().point);
            println!("{name}: {off:.1e} of {moved:.1e}");
            // The kinetic drift is formed by differences.
            assert!(off < 1e-9 && moved > 0.1, "{name}: {off:.1e} of {moved:.1e}");
        )+};
    }
    compare!(
        RandomFlow(WeylMidpoint).seed(3),
        RandomFlow(Gauss::<2>).seed(3),
        RandomFlow(DormandPrince5).seed(3),
        RandomFlow(DormandPrince8).seed(3),
        RandomFlow(RungeKuttaChebyshev).seed(3),
        NinomiyaVictoir(DormandPrince5).seed(3)
    );
    own.verified(&start.into()).unwrap();
    // At rest all of its motion is friction, whose round-off is no change of the volume.
    let still = FromEquations(RUBBING).with_noise(Boltzmann(0.05));
    still.verify(&[0.0, 0.0, 0.9, 1.3].into(), 0.1).unwrap();
    // Terms of another friction, fewer terms than are said, and a system without an entropy.
    let refused = |system: Rubbing| {
        let noisy = FromEquations(system).with_noise(Boltzmann(0.05));
        match RandomFlow(DormandPrince5).seed(1).run(&noisy, start.into(), span()) {
            Err(RunError::Flow(error)) => *error.downcast_ref::<NoiseError>().expect("of noise"),
            other => panic!("{:?}", other.map(|run| run.certificate().to_string())),
        }
    };
    let off = refused(Rubbing { factor: 1.01, ..RUBBING });
    assert!(matches!(off, NoiseError::TermsOff { .. }), "{off}");
    let fewer = refused(Rubbing { listed: 1, ..RUBBING });
    assert_eq!(fewer, NoiseError::BadTerms { found: 1, expected: 2, directions: 4 });
}

#[test]
fn a_path_of_ones_own_in_baths_is_that_of_a_typed_system() {
    let start = [0.7, -0.4, 0.9, 1.3];
    let tensor =
        matrix![0.0, 1.0, 0.0, 0.0; -1.0, 0.0, 0.0, 0.0; 0.0, 0.0, 0.0, 0.0; 0.0, 0.0, 0.0, 0.0];
    let heat = |u: Real| u + u * u * 0.25;
    let push = |t: Real| (t * 1.7).sin() * 0.6;
    let typed = System::on(Euclidean::<4>)
        .bracket(Poisson::constant(tensor).unwrap())
        .energy(move |x: &Vector4<Real>| (x.x * x.x + x.y * x.y) * 0.5 + heat(x.z) + heat(x.w))
        .entropy(|x: &Vector4<Real>| x.z.ln() + x.w.ln())
        .dissipation(OnsagerDissipation(|x: &Vector4<Real>, w: &Vector4<Real>| {
            let o = Real::from(0.0);
            [
                Contact { rate: x.z * 0.3, along: vector![o, w.z, -w.y, o] },
                Contact { rate: x.z * x.w * 0.2, along: vector![o, o, w.w, -w.z] },
            ]
        }))
        .work("motor", move |t: Real, _: &Vector4<Real>| Vector4::ith(1, push(t)))
        .bath(
            "air",
            Bath::in_time(|t: Real| t * 0.2 + 0.8).friction(
                |_: Real, x: &Vector4<Real>, _: &Vector4<Real>| {
                    let (rate, o) = (x.y * x.y * 0.2 + 0.3, Real::from(0.0));
                    [
                        Contact { rate, along: vector![o, x.x * 0.1 + 1.0, o, o] },
                        Contact { rate: x.z * 0.2, along: vector![o, o, x.z, o] },
                    ]
                },
            ),
        )
        .bath(
            "oven",
            Bath::at(1.2).friction(|_: Real, _: &Vector4<Real>, w: &Vector4<Real>| {
                [Contact { rate: w.w * 0.1, along: Vector4::<Real>::w() }]
            }),
        )
        .noise(Boltzmann(0.05))
        .build()
        .unwrap();
    let open = || {
        FromEquations(Differences(RUBBING))
            .opened()
            .work("motor", move |t, _, v| v[1] = push(t.into()).re)
            .bath(
                "air",
                |t: Real| t * 0.2 + 0.8,
                |at, contact| {
                    contact(0.3 + 0.2 * at.x[1] * at.x[1], &[(1, 1.0 + 0.1 * at.x[0])]);
                    contact(0.2 * at.x[2], &[(2, at.x[2])]);
                },
            )
            .bath("oven", 1.2, |at, contact| contact(0.1 * at.w[3], &[(3, 1.0)]))
    };
    let own = open().with_noise(Boltzmann(0.05), &[2, 1]);
    let span = || Span::steps(0.02, 50);
    macro_rules! compare {
        ($($method:expr),+) => {$(
            let name = stringify!($method);
            let x0 = typed.flow().start(Vector4::from(start));
            let reference = $method.run(&typed, x0, span()).unwrap();
            let run = $method.run(&own, own.flow().start(start), span()).unwrap();
            assert!(run.certificate().keeps_energy(), "{name}: {}", run.certificate());
            let numbers = |x: &[f64], l: &Ledger| {
                let booked = [l.work("motor"), l.heat("air"), l.heat("oven"), l.bath_entropy("air")];
                [x, &booked.map(Option::unwrap)].concat()
            };
            let [a, b] = [&reference.last().point, &typed.flow().start(Vector4::from(start))]
                .map(|state| numbers(state.x.as_slice(), &state.ledger));
            let end = &run.last().point;
            let (off, moved) = (distance(&a, &numbers(&end.x, &end.ledger)), distance(&a, &b));
            println!("{name}: {off:.1e} of {moved:.1e}");
            // The kinetic drift is formed by differences.
            assert!(off < 1e-9 && moved > 0.1, "{name}: {off:.1e} of {moved:.1e}");
        )+};
    }
    compare!(
        RandomFlow(WeylMidpoint).seed(3),
        RandomFlow(Gauss::<2>).seed(3),
        RandomFlow(DormandPrince5).seed(3),
        NinomiyaVictoir(DormandPrince5).seed(3)
    );
    let refused = |contacts: &[usize]| {
        let noisy = open().with_noise(Boltzmann(0.05), contacts);
        let x0 = noisy.flow().start(start);
        match RandomFlow(DormandPrince5).seed(1).run(&noisy, x0, span()) {
            Err(RunError::Flow(error)) => *error.downcast_ref::<NoiseError>().expect("of noise"),
            other => panic!("{:?}", other.map(|run| run.certificate().to_string())),
        }
    };
    assert_eq!(refused(&[2]), NoiseError::OtherBaths { found: 2, expected: 1 });
    let other = NoiseError::OtherContacts { bath: 1, found: 1, expected: 2 };
    assert_eq!(refused(&[2, 2]), other);
    let x0 = own.flow().start(start);
    own.verified(&x0).unwrap();
}

#[test]
fn a_field_on_masses_with_noise_does_work() {
    // A mass in a field that swings, as a lattice of one site and as a typed system, with the same random numbers.
    let swing = |t: Real, q: Real| q * (t * 1.3).sin() * 0.8;
    let typed = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy_in_time(move |t: Real, x: &Vector2<Real>| {
            (x.x * x.x + x.y * x.y) * 0.5 + swing(t, x.x)
        })
        .bath(
            "air",
            Bath::at(0.7).friction(|_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                [Contact { rate: 0.3.into(), along: vector![0.0.into(), 1.0.into()] }]
            }),
        )
        .noise(Boltzmann(1.0))
        .build()
        .unwrap();
    let sites = |count: usize| {
        Lattice::on(Graph::from_bonds(count, []), Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| (x.x * x.x + x.y * x.y) * 0.5)
            .build()
            .unwrap()
            .with_noise(Boltzmann(1.0))
            .energy_in_time(move |t, _, x: &Vector2<Real>| swing(t, x.x))
            .bath("air", 0.7, 0..count, |_, _: &SiteState<'_, Euclidean<2>>| {
                [Onsager { rate: 0.3, b: vector![0.0, 1.0] }]
            })
    };
    let (one, many) = (sites(1), sites(5));
    let span = || Span::steps(0.05, 60);
    macro_rules! check {
        ($($method:expr),+) => {$(
            let name = stringify!($method);
            let reference = $method.run(&typed, typed.flow().start(vector![0.4, 0.2]), span()).unwrap();
            let start = one.flow().start(one.flow().lattice().points(|_| vector![0.4, 0.2]));
            let run = $method.run(&one, start, span()).unwrap();
            let [a, b] = [&reference.last().point.ledger, &run.last().point.ledger].map(|ledger| {
                [ledger.parameter_work(), ledger.heat("air").unwrap()]
            });
            let off = distance(&a, &b).max((reference.last().point.x - run.last().point.x[0]).amax());
            println!("{name}: {off:.1e}");
            assert!(off < 1e-9, "{name}: {off:.1e}");
            let lattice = many.flow();
            let start = lattice.start(lattice.lattice().points(|i| vector![0.1 * i as f64, 0.2]));
            let first = lattice.energy_at(&start);
            let run = $method.run(&many, start, span()).unwrap();
            assert!(run.certificate().keeps_energy(), "{name}: {}", run.certificate());
            for state in run.states() {
                let ledger = &state.point.ledger;
                let flowed = ledger.parameter_work() + ledger.heat("air").unwrap();
                let off = lattice.energy_at(&state.point) - first - flowed;
                assert!(off.abs() < 1e-13, "{name}: {off:.1e}");
            }
        )+};
    }
    check!(
        RandomFlow(WeylMidpoint).seed(5),
        RandomFlow(Gauss::<2>).seed(5),
        NinomiyaVictoir(WeylMidpoint).seed(5)
    );
}
