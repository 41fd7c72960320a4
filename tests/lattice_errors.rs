//! Lattices that are refused, with the site or the bond.

use metriplectic::integrators::FlowError;
use metriplectic::lattices::{Place, Tried};
use metriplectic::prelude::*;

type Pair = (Vector2<Real>, Vector2<Real>);
type Term = Onsager<[Vector2<f64>; 2]>;

/// `(p, e)` at each site: momenta with friction, and internal energies that take up its heat.
fn friction(u: &Vector2<f64>, v: &Vector2<f64>) -> [Term; 1] {
    // w = (p, 1).
    let slip = v.x - u.x;
    [Onsager { rate: 0.1, b: [vector![-1.0, -0.5 * slip], vector![1.0, -0.5 * slip]] }]
}

fn energy(x: &Vector2<Real>) -> Real {
    x.x * x.x * 0.5 + x.y
}

fn entropy(x: &Vector2<Real>) -> Real {
    x.y.ln()
}

/// What a builder says of this graph and this friction.
fn refused(
    graph: Graph,
    terms: fn(&Vector2<f64>, &Vector2<f64>) -> [Term; 1],
    start: impl FnMut(usize) -> Vector2<f64>,
) -> LatticeError {
    let lattice = Lattice::on(graph, Euclidean::<2>)
        .energy(energy)
        .entropy(entropy)
        .bond_onsager(move |bond| terms(bond.w[0], bond.w[1]))
        .conserved(|x: &Vector2<Real>| x.x)
        .build();
    let lattice = match lattice {
        Ok(lattice) => lattice,
        Err(error) => return error,
    };
    let start = lattice.points(start);
    match DormandPrince5.run(&lattice, start, Span::steps(0.1, 2)) {
        Err(RunError::Flow(error)) => own(&error),
        other => panic!("not refused: {other:?}"),
    }
}

fn own(error: &FlowError) -> LatticeError {
    println!("{error}");
    error.downcast_ref::<LatticeError>().expect("the error of a lattice").clone()
}

fn warm(i: usize) -> Vector2<f64> {
    vector![(i as f64).sin(), 1.0]
}

#[test]
fn a_graph_that_does_not_fit_is_refused() {
    let of = |graph| refused(graph, friction, warm);
    assert_eq!(of(Graph::chain(0)), LatticeError::NoSites);
    let bonds = [[0, 1], [1, 4], [9, 9]];
    let nowhere = LatticeError::BondToNowhere { bond: 1, site: 4, sites: 4 };
    assert_eq!(of(Graph::from_bonds(4, bonds)), nowhere);
    let itself = LatticeError::BondToItself { bond: 2, site: 2 };
    assert_eq!(of(Graph::from_bonds(4, [[0, 1], [1, 3], [2, 2]])), itself);
    assert_eq!(of(Graph::ring(1)), LatticeError::BondToItself { bond: 0, site: 0 });
    let large = Graph::cubic([1 << 40, 1 << 40, 1], Boundary::Open);
    assert!(matches!(of(large), LatticeError::TooManySites { .. }));
    // The sites can be numbered, and the bonds would take 98 GB.
    for boundary in [Boundary::Open, Boundary::Periodic] {
        let error = Graph::cubic([1600; 3], boundary).checked().unwrap_err();
        println!("{error}");
        assert!(
            matches!(error, LatticeError::TooManyBonds { bonds, .. } if bonds > 12_000_000_000)
        );
    }
}

#[test]
fn parts_that_make_no_lattice_are_refused() {
    let base = || Lattice::on(Graph::chain(4), Euclidean::<2>).energy(energy);
    assert_eq!(base().build().err(), Some(LatticeError::NothingMoves));
    let no_friction = base().bracket(Symplectic).entropy(entropy).build();
    assert_eq!(no_friction.err(), Some(LatticeError::EntropyWithoutFriction));
    let on_bonds = base().bond_entropy(|(x, y): &Pair| x.x * y.x).build();
    assert_eq!(on_bonds.err(), Some(LatticeError::EntropyOnBonds));
    let data = base().bracket(Symplectic).bond_data(vec![1.0; 4]).build();
    assert_eq!(data.err(), Some(LatticeError::Data { of: "bonds", found: 4, expected: 3 }));
    // The entropy must be a Casimir.
    let moved = base()
        .bracket(Symplectic)
        .entropy(|x: &Vector2<Real>| x.y)
        .site_onsager(|_| [Onsager { rate: 0.0, b: vector![0.0, 0.0] }])
        .build()
        .unwrap();
    let error = moved.verify(&moved.points(warm)).unwrap_err();
    println!("{error}");
    assert!(matches!(error, LatticeError::Broken { law: "Π dS = 0", place: Place::Site(0), .. }));
}

#[test]
fn friction_that_breaks_a_law_is_refused_with_its_bond() {
    let n = 3000;
    let error = refused(
        Graph::ring(n),
        |_, _| [Onsager { rate: 0.1, b: [vector![-1.0, 0.0], vector![1.0, 0.0]] }],
        warm,
    );
    assert!(
        matches!(error, LatticeError::Broken { place: Place::Bond { .. }, size, .. } if size > 0.01)
    );
    let error =
        refused(Graph::ring(n), |u, v| friction(u, v).map(|t| Onsager { rate: -0.1, ..t }), warm);
    assert!(matches!(error, LatticeError::NegativeRate { place: Place::Bond { bond: 0, .. }, .. }));
    // Friction against the frame of the sites does not conserve their momentum.
    let error = refused(
        Graph::ring(n),
        |u, v| [Onsager { rate: 0.1, b: [vector![1.0, -u.x], vector![0.5, -0.5 * v.x]] }],
        warm,
    );
    assert!(
        matches!(error, LatticeError::NotConserved { index: 0, size } if size > 1e-4),
        "{error}"
    );
}

#[test]
fn friction_is_tried_in_every_bond_and_at_every_site() {
    let n = 5000;
    let graph = || Graph::from_bonds(n, (0..n).map(|i| [i, (i + 1) % n]));
    let one_of = |number: usize| (0..n).map(|i| i == number).collect::<Vec<_>>();
    for odd in [1234, 4321] {
        let on_bonds = |wrong: fn(Term) -> Term| {
            let lattice = Lattice::on(graph(), Euclidean::<2>)
                .bond_data(one_of(odd))
                .energy(energy)
                .entropy(entropy)
                .bond_onsager(move |bond| {
                    let term = |t| if *bond.data { wrong(t) } else { t };
                    friction(bond.w[0], bond.w[1]).map(term)
                })
                .build()
                .unwrap();
            let error = lattice.verify(&lattice.points(warm)).unwrap_err();
            println!("{error}");
            error
        };
        let (place, tried) = (Place::Bond { bond: odd, sites: [odd, odd + 1] }, Tried::Start);
        let [left, right] = [odd, odd + 1].map(warm);
        let entries = vec![left.x, left.y, right.x, right.y];
        assert_eq!(
            on_bonds(|t| Onsager { rate: -0.1, ..t }),
            LatticeError::NegativeRate { place, tried, entries, rate: -0.1 }
        );
        let error = on_bonds(|t| Onsager { b: [t.b[0], t.b[1] * 1.001], ..t });
        assert!(matches!(error, LatticeError::Broken { place: at, .. } if at == place), "{error}");
        let at_sites = |wrong: fn(&mut Onsager<Vector2<f64>>)| {
            let lattice = Lattice::on(graph(), Euclidean::<2>)
                .site_data(one_of(odd))
                .energy_with(|x: &Vector2<Real>, _: &bool| energy(x))
                .entropy_with(|x: &Vector2<Real>, _: &bool| entropy(x))
                .site_onsager(move |site| {
                    let mut term = Onsager { rate: 0.1, b: vector![1.0, -site.w.x] };
                    if *site.data {
                        wrong(&mut term);
                    }
                    [term]
                })
                .build()
                .unwrap();
            let error = lattice.verify(&lattice.points(warm)).unwrap_err();
            println!("{error}");
            error
        };
        let place = Place::Site(odd);
        let entries = vec![left.x, left.y];
        let negative = LatticeError::NegativeRate { place, tried, entries, rate: -1e-30 };
        assert_eq!(at_sites(|term| term.rate = -1e-30), negative);
        let error = at_sites(|term| term.b.x *= 1.001);
        assert!(matches!(error, LatticeError::Broken { place: at, .. } if at == place), "{error}");
    }
}

/// Bodies with the capacities `c` in J/K and energies in J as variables, which exchange heat.
fn bodies(
    capacities: Vec<f64>,
    conductance: f64,
) -> Result<Lattice<impl metriplectic::lattices::Model<Manifold = Euclidean<1>>>, LatticeError> {
    let n = capacities.len();
    let bonds = (0..n).map(|i| [i, (i + 1) % n]).chain((0..n).map(|i| [i, (7 * i + 11) % n]));
    let bonds: Vec<_> = bonds.filter(|[i, j]| i != j).collect();
    let data = bonds.iter().map(|bond| bond.map(|site| capacities[site])).collect();
    let graph = Graph::from_bonds(n, bonds).checked()?;
    Lattice::on(graph, Euclidean::<1>)
        .site_data(capacities)
        .bond_data(data)
        .energy_with(|e: &Vector1<Real>, _: &f64| e.x)
        .entropy_with(|e: &Vector1<Real>, c: &f64| (e.x / *c).ln() * *c)
        .bond_onsager(move |bond| {
            let ([x, y], [c, d]) = (bond.x, bond.data);
            let rate = conductance * (x.x / c) * (y.x / d);
            [Onsager { rate, b: [vector![1.0], vector![-1.0]] }]
        })
        .build()
}

#[test]
fn a_small_body_beside_large_ones_is_verified_at_energies_of_its_own() {
    // From 0.1 to 1000 J/K, at 250 to 350 K.
    let capacity = |i: usize| 0.1 * 1e4_f64.powf((i * 23 % 60) as f64 / 59.0);
    let capacities: Vec<f64> = (0..60).map(capacity).collect();
    let lattice = bodies(capacities.clone(), 0.5).unwrap();
    let kelvin = |i: usize| 300.0 + 50.0 * (i as f64).sin();
    let start = lattice.points(|i| vector![capacities[i] * kelvin(i)]);
    assert_eq!(lattice.verify(&start), Ok(()));
    let run = RungeKuttaChebyshev.run(&lattice, start.clone(), Span::until(10.0).at_most(2));
    let run = run.unwrap();
    assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
    // A rate that is negative beside the start says so.
    let lattice = Lattice::on(Graph::chain(60), Euclidean::<1>)
        .energy(|e: &Vector1<Real>| e.x)
        .entropy(|e: &Vector1<Real>| e.x.ln())
        .bond_onsager(|bond| {
            let rate = if (bond.x[0].x - 300.0).abs() < 1e-9 { 1.0 } else { -1.0 };
            [Onsager { rate, b: [vector![1.0], vector![-1.0]] }]
        })
        .build()
        .unwrap();
    let error = lattice.verify(&lattice.points(|_| vector![300.0])).unwrap_err();
    println!("{error}");
    let tried = Tried::Near { fraction: 1e-2 };
    let place = Place::Bond { bond: 0, sites: [0, 1] };
    let found = matches!(
        &error,
        LatticeError::NegativeRate { place: at, tried: how, entries, rate: -1.0 }
            if *at == place && *how == tried && entries.len() == 2 && (entries[0] - 300.0).abs() > 0.0
    );
    assert!(found, "{error}");
}

#[test]
fn a_start_without_a_value_names_its_site() {
    let n = 100_000;
    let place = Place::Site(70_001);
    let with = |x: Vector2<f64>| move |i: usize| if i == 70_001 { x } else { warm(i) };
    let error = refused(Graph::ring(n), friction, with(vector![f64::NAN, 1.0]));
    assert!(matches!(error, LatticeError::Start { place: at, .. } if at == place));
    // The logarithm of a negative energy.
    let error = refused(Graph::ring(n), friction, with(vector![0.0, -1.0]));
    assert_eq!(error, LatticeError::NotFinite { what: "entropy", place });
    let error = refused(
        Graph::ring(n),
        |u, v| {
            // An infinite rate where the velocities agree.
            friction(u, v).map(|t| Onsager { rate: 1.0 / (u.x - v.x).abs(), ..t })
        },
        |i| vector![(i / 2) as f64, 1.0],
    );
    let bond = Place::Bond { bond: 0, sites: [0, 1] };
    assert_eq!(error, LatticeError::NotFinite { what: "friction", place: bond });
    let lattice = Lattice::on(Graph::ring(4), Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.x * x.x + Real::from(x.y.re * x.y.re))
        .build()
        .unwrap();
    let error = lattice.verify(&lattice.points(warm)).unwrap_err();
    assert!(
        matches!(error, LatticeError::WrongDerivative { place: Place::Site(0), .. }),
        "{error}"
    );
    let few: Points<Euclidean<2>> = vec![vector![0.0, 1.0]; 3].into();
    assert_eq!(lattice.verify(&few), Err(LatticeError::Points { found: 3, expected: 4 }));
}

#[test]
fn a_site_that_leaves_its_domain_is_named() {
    // Sites fall into a well of infinite depth; one of them is faster.
    let lattice = Lattice::on(Graph::chain(2000), Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 + x.x.ln())
        .build()
        .unwrap();
    let start = lattice.points(|i| vector![1.0, if i == 1234 { -3.0 } else { 0.0 }]);
    let fixed = DormandPrince5.run(&lattice, start.clone(), Span::steps(0.1, 9));
    let Err(RunError::Step { cause, .. }) = fixed else { panic!("the step is taken") };
    println!("{cause}");
    assert!(matches!(cause, StepError::SiteOutOfDomain { site: 1234, .. }), "{cause}");
}

/// What is said of masses `(q, p, u)` on springs whose entropy gathers this.
fn refused_gather(
    phi: fn(&(Vector3<Real>, Vector3<Real>)) -> Real,
    embed: fn(&Vector3<Real>, Real) -> Real,
) -> Option<LatticeError> {
    let canonical = matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0];
    let lattice = Lattice::on(Graph::ring(3000), Euclidean::<3>)
        .bracket(Poisson::constant(canonical).expect("a skew matrix"))
        .energy(|x: &Vector3<Real>| (x.x * x.x + x.y * x.y) * 0.5 + x.z)
        .entropy(|x: &Vector3<Real>| x.z.ln())
        .gather_entropy(phi, embed)
        .site_onsager(|site| [Onsager { rate: 0.1, b: vector![0.0, 1.0, -site.w.y] }])
        .build()
        .expect("the parts make a lattice");
    let start = lattice.points(|i| vector![(i as f64).sin(), (i as f64).cos(), 2.0]);
    let error = lattice.verify(&start).err();
    println!("{error:?}");
    error
}

#[test]
fn an_entropy_that_gathers_what_the_bracket_moves_is_refused_with_its_site() {
    let warmth: fn(&(Vector3<Real>, Vector3<Real>)) -> Real = |(x, y)| x.z + y.z;
    assert_eq!(refused_gather(warmth, |x, sum| (x.z * sum).ln()), None);
    // Values that are no numbers, with the bond and the site: all internal energies are 2.
    let not_finite = |place| Some(LatticeError::NotFinite { what: "entropy", place });
    let bond = Place::Bond { bond: 0, sites: [0, 1] };
    assert_eq!(refused_gather(|(x, _)| (x.z - 2.0).ln(), |_, sum| sum), not_finite(bond));
    let site = Place::Site(0);
    assert_eq!(refused_gather(warmth, |_, sum| (-sum + 8.0).ln()), not_finite(site));
    // A density of positions.
    let error = refused_gather(|(x, y)| (x.x - y.x).powi(2), |x, sum| x.z.ln() * sum).unwrap();
    let LatticeError::Broken { law: "Π dS = 0", place: Place::Site(0), size, remedy, .. } = error
    else {
        panic!("another error: {error}")
    };
    assert!(size > 1e-3 && remedy.contains("gather such a density in the energy"), "{remedy}");
    // Positions in `g`.
    let error = refused_gather(warmth, |x, sum| x.x * sum * 1e-3).unwrap();
    assert!(matches!(error, LatticeError::Broken { law: "Π dS = 0", .. }), "{error}");
    // Derivatives that closures lose, with the bond and the site.
    let error = refused_gather(|(x, y)| x.z + Real::from(y.z.re), |_, sum| sum.ln()).unwrap();
    assert!(
        matches!(error, LatticeError::WrongDerivative { place: Place::Bond { .. }, .. }),
        "{error}"
    );
    let error = refused_gather(warmth, |x, sum| x.z.ln() * Real::from(sum.re)).unwrap();
    let place = Place::Site(0);
    assert!(
        matches!(error, LatticeError::WrongDerivative { place: at, .. } if at == place),
        "{error}"
    );
}

/// Bodies that turn steadily about a principal axis: `Π dH` and the friction `b = w × s` are all round-off there, at the
/// start and at the end of the run. The friction produces nothing elsewhere either, so every fall of the entropy is
/// an error of the steps.
#[test]
fn an_equilibrium_of_skew_bodies_breaks_no_law_and_stops_no_run() {
    let a = matrix![2.0, 0.3, 0.5; 0.3, 1.5, 0.2; 0.5, 0.2, 1.0];
    let damped = Lattice::on(Graph::ring(8), LieDual::so3())
        .energy(move |p: &Vector3<Real>| p.dot(&(a.cast::<Real>() * p)) * 0.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .site_onsager(|site| [Onsager { rate: 0.1, b: site.w.cross(site.s) }])
        .build()
        .expect("the parts make a lattice");
    let axis = vector![0.8464152172256919, 0.38374909725133777, 0.36921255450968626];
    let near = axis + vector![1e-9, 0.0, 0.0];
    // Beside the middle axis, which is unstable: no state at rest.
    let middle = vector![-0.39720310702610026, 0.9167568447330642, -0.04226794771322489];
    let unstable = middle + vector![0.0, 0.0, 1e-9];
    let starts = [
        (axis, 1e-9),
        (near, 1e-9),
        (near, 1e-6),
        (unstable, 1e-9),
        (unstable, 1e-6),
        (vector![0.3, -0.8, 0.4], 1e-6),
    ];
    for (start, tolerance) in starts {
        let span = Span::until(200.0).tolerance(tolerance);
        let run = DormandPrince8.run(&damped, damped.points(|_| start), span);
        let run = run.unwrap_or_else(|error| panic!("{start:?}, {tolerance}: {error}"));
        // A period is 20, and 66 steps of order 8 in a period are many.
        let steps = run.certificate().steps;
        assert!(steps < 2000, "{start:?}, {tolerance}: {steps} steps");
        let left = run.states().iter().find(|state| (state.point[0] - middle).norm() > 0.1);
        println!("{start:?}, {tolerance}: left at {:?}", left.map(|state| state.time));
        assert!(start != unstable || left.is_some_and(|state| state.time > 1.0), "it stays");
    }
}

/// One bond of 64 whose friction is wrong once its sites are warm: production stays positive, so no step shows it.
#[test]
fn a_bond_that_breaks_a_law_away_from_the_start_ends_the_run_of_every_method() {
    let broken = |wrong: fn(Term) -> Term| {
        let lattice = Lattice::on(Graph::ring(64), Euclidean::<2>)
            .energy(energy)
            .entropy(entropy)
            .bond_data((0..64).map(|bond| bond == 17).collect::<Vec<bool>>())
            .bond_onsager(move |bond: &BondState<'_, Euclidean<2>, bool>| {
                let right = friction(bond.w[0], bond.w[1]);
                if *bond.data && bond.x[0].y > 1.02 { right.map(wrong) } else { right }
            })
            .conserved(|x: &Vector2<Real>| x.x)
            .build()
            .expect("the parts make a lattice");
        let start = lattice.points(warm);
        assert!(lattice.verify(&start).is_ok());
        let span = Span::until(5.0);
        [
            DormandPrince5.run(&lattice, start.clone(), span),
            DormandPrince8.run(&lattice, start.clone(), span),
            RungeKuttaChebyshev.run(&lattice, start, span),
        ]
        .map(|run| match run {
            Err(RunError::Step { cause: StepError::Flow { time, law }, trajectory }) => {
                assert!(time > 0.0 && trajectory.last().time <= time);
                own(&law)
            }
            other => panic!("not refused: {other:?}"),
        })
    };
    for error in broken(|term| Onsager { rate: -0.01, ..term }) {
        let found =
            matches!(error, LatticeError::NegativeRate { place: Place::Bond { bond: 17, .. }, .. });
        assert!(found, "{error}");
    }
    for error in broken(|term| Onsager { b: [term.b[0], term.b[1] * (1.0 + 1e-7)], ..term }) {
        let found =
            matches!(error, LatticeError::Broken { place: Place::Bond { bond: 17, .. }, .. });
        assert!(found, "{error}");
    }
}

/// One bond of 64 whose friction is wrong for a while: it is right at the start and at the end.
#[test]
fn a_bond_that_breaks_a_law_in_the_middle_of_a_run_ends_it_there() {
    let with = |window: [f64; 2], wrong: fn(Term) -> Term| {
        Lattice::on(Graph::ring(64), Euclidean::<2>)
            .energy(energy)
            .entropy(entropy)
            .bond_data((0..64).map(|bond| bond == 17).collect::<Vec<bool>>())
            .bond_onsager(move |bond: &BondState<'_, Euclidean<2>, bool>| {
                let right = friction(bond.w[0], bond.w[1]);
                let [after, before] = window;
                let odd = *bond.data && bond.x[0].y > after && bond.x[0].y < before;
                if odd { right.map(wrong) } else { right }
            })
            .conserved(|x: &Vector2<Real>| x.x)
            .build()
            .expect("the parts make a lattice")
    };
    let sound = with([0.0; 2], |term| term);
    let span = Span::steps(0.01, 400);
    let run = DormandPrince5.run(&sound, sound.points(warm), span).expect("a sound lattice");
    let warmth = |step: usize| run.states()[step].point[17].y;
    let window = [warmth(60), warmth(150)];
    assert!(window[0] > 1.0 && window[1] > window[0] && warmth(400) > window[1], "{window:?}");
    for wrong in [(|term| Onsager { rate: -0.001, ..term }) as fn(Term) -> Term, |term| Onsager {
        b: [term.b[0], term.b[1] * (1.0 + 1e-7)],
        ..term
    }] {
        let lattice = with(window, wrong);
        let start = lattice.points(warm);
        for run in [
            DormandPrince5.run(&lattice, start.clone(), span),
            DormandPrince8.run(&lattice, start.clone(), span),
            RungeKuttaChebyshev.run(&lattice, start.clone(), span),
        ] {
            let Err(RunError::Step { cause: StepError::Flow { time, law }, .. }) = run else {
                panic!("not refused: {run:?}");
            };
            let place = match own(&law) {
                LatticeError::NegativeRate { place, tried, entries, .. }
                | LatticeError::Broken { place, tried, entries, .. } => {
                    assert_eq!((tried, entries.len()), (Tried::Reached, 4));
                    assert!(entries[1] > window[0] && entries[1] < window[1], "{entries:?}");
                    place
                }
                other => panic!("{other}"),
            };
            assert_eq!(place, Place::Bond { bond: 17, sites: [17, 18] });
            assert!((time - 1.49).abs() < 1e-9, "{time}");
        }
    }
}

/// Derivatives are compared at other sites at each state: one of 200 that loses its derivative is found on the way.
#[test]
fn a_site_that_loses_a_derivative_on_the_way_ends_the_run_there() {
    for odd in [0, 71, 199] {
        let lattice = Lattice::on(Graph::ring(200), Euclidean::<2>)
            .site_data((0..200).map(|site| site == odd).collect::<Vec<bool>>())
            .energy_with(|x: &Vector2<Real>, odd: &bool| {
                let warm = if *odd && x.y.re > 1.03 { (x.y.re - 1.03) * 0.01 } else { 0.0 };
                energy(x) + Real::from(warm)
            })
            .entropy_with(|x: &Vector2<Real>, _: &bool| entropy(x))
            .bond_onsager(|bond| friction(bond.w[0], bond.w[1]))
            .conserved(|x: &Vector2<Real>| x.x)
            .build()
            .expect("the parts make a lattice");
        let span = Span::steps(0.001, 10_000).at_most(2);
        let run = DormandPrince5.run(&lattice, lattice.points(warm), span);
        let Err(RunError::Step { cause: StepError::Flow { time, law }, .. }) = run else {
            panic!("not refused: {run:?}");
        };
        let found = matches!(
            own(&law),
            LatticeError::WrongDerivative { what: "energy", place: Place::Site(site), .. }
                if site == odd
        );
        assert!(found && time < 9.5, "{law} at {time}");
    }
}

/// The function of a gathered density is compared with its values on the way, too.
#[test]
fn a_gathered_density_that_loses_a_derivative_on_the_way_ends_the_run() {
    let with = |lost: f64| {
        Lattice::on(Graph::ring(64), Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
            .gather(
                |(x, y): &(Vector2<Real>, Vector2<Real>)| (x.x - y.x).powi(2),
                move |_: &Vector2<Real>, density| {
                    let beyond = if density.re > 0.3 { density.re - 0.3 } else { 0.0 };
                    density.powi(2) * 0.1 + Real::from(beyond * lost)
                },
            )
            .build()
            .expect("the parts make a lattice")
    };
    let start = |i: usize| vector![0.0, 0.8 * (i as f64).sin()];
    let span = Span::steps(0.01, 150);
    let sound = with(0.0);
    assert!(DormandPrince5.run(&sound, sound.points(start), span).is_ok());
    let wrong = with(0.1);
    assert!(wrong.verify(&wrong.points(start)).is_ok(), "the start does not show it");
    let Err(RunError::Step { cause: StepError::Flow { law, .. }, .. }) =
        DormandPrince5.run(&wrong, wrong.points(start), span)
    else {
        panic!("not refused");
    };
    let found = own(&law);
    assert!(matches!(found, LatticeError::WrongDerivative { what: "energy", .. }), "{found}");
}
