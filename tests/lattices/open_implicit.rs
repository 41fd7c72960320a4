//! Implicit steps of lattices with ports and baths: both laws on every step, orders, units, stiff friction, and the same chain as a
//! typed system.

use std::f64::consts::LN_2;

use metriplectic::integrators::open::Ledger;
use metriplectic::integrators::{
    ItohAbe, MeanValue, NoImplicitSteps, NotDamped, Schedule, SymmetricItohAbe,
};
use metriplectic::lattices::model::Model;
use metriplectic::lattices::{OpenLattice, OpenSites};
use metriplectic::prelude::*;
use metriplectic_studies::scientific;
use nalgebra::{SMatrix, SVector};

use super::claim;

/// A site: place, momentum and entropy.
type Site = Euclidean<3>;
type State = OpenState<Points<Site>>;
type Chain<P> = OpenLattice<P>;

/// The units of energy, entropy and length; that of time is 1.
#[derive(Clone, Copy)]
struct Units {
    energy: f64,
    entropy: f64,
    length: f64,
}

const ONE: Units = Units { energy: 1.0, entropy: 1.0, length: 1.0 };

/// The options of a chain.
#[derive(Clone, Copy)]
struct Options {
    units: Units,
    /// The energy of a site that counts as zero.
    zero: f64,
    /// The friction of the air, and that in a bond.
    friction: [f64; 2],
    /// The amplitude of the motor, and the temperature of the oven less that of the air.
    drive: [f64; 2],
}

const PLAIN: Options = Options { units: ONE, zero: 0.0, friction: [0.08, 0.2], drive: [0.4, 0.6] };

/// Masses on springs that harden, with heat: friction and conduction in the bonds, a motor at the first mass, air around all of them
/// whose temperature swings with the motor, and an oven at the last one.
fn chain(
    sites: usize,
    Options { units, zero, friction: [air, inside], drive: [torque, hotter] }: Options,
) -> Chain<impl Model<Manifold = Site>> {
    let Units { energy: e, entropy: k, length: l } = units;
    let momentum = e / l;
    let canonical = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    Lattice::on(Graph::chain(sites), Euclidean::<3>)
        .bracket(Poisson::constant(canonical).expect("a skew matrix"))
        .energy(move |x: &Vector3<Real>| {
            let (q, p, s) = (x.x / l, x.y / momentum, x.z / k);
            (p * p * 0.5 + q.powi(4) * 0.25 + s.exp() - zero) * e
        })
        .bond_energy(move |(x, y): &(Vector3<Real>, Vector3<Real>)| {
            let r = (y.x - x.x) / l;
            (r * r * 0.5 + r.powi(4) * 0.25) * e
        })
        .entropy(|x: &Vector3<Real>| x.z)
        .bond_onsager(move |bond| {
            let [u, v] = bond.w;
            let slip = 0.5 * (v.y - u.y);
            [
                Onsager {
                    rate: inside * e / (l * l) * u.z * v.z / (u.z + v.z),
                    b: [vector![0.0, -1.0, -slip / u.z], vector![0.0, 1.0, -slip / v.z]],
                },
                Onsager {
                    rate: 0.1 * k * u.z * v.z,
                    b: [vector![0.0, 0.0, 1.0 / u.z], vector![0.0, 0.0, -1.0 / v.z]],
                },
            ]
        })
        .build()
        .expect("it is a lattice")
        .opened()
        .work("motor", [0], move |t, _, x: &Vector3<f64>| {
            vector![0.0, torque * momentum * (1.3 * t).sin() * (1.0 + 0.1 * x.x / l), 0.0]
        })
        .bath(
            "air",
            move |t: Real| (t.sin() * (0.25 * torque) + 1.0) * (e / k),
            0..sites,
            move |_, _: &SiteState<'_, Site>| {
                [Onsager { rate: air * e / (l * l), b: vector![0.0, 1.0, 0.0] }]
            },
        )
        .bath("oven", (1.0 + hotter) * (e / k), [sites - 1], move |_, at: &SiteState<'_, Site>| {
            let rate = 0.3 * k * k / e * (at.w.z * (k / e)).recip();
            [Onsager { rate, b: vector![0.0, 0.0, 1.0] }]
        })
}

/// A state without symmetry.
fn generic(units: Units) -> impl Fn(usize) -> Vector3<f64> {
    let Units { energy, entropy, length } = units;
    move |i: usize| {
        let phase = i as f64;
        vector![
            0.5 * length * (1.7 * phase + 0.3).sin(),
            0.6 * energy / length * (2.3 * phase + 0.5).cos(),
            0.3 * entropy * (phase + 0.2).sin()
        ]
    }
}

/// The numbers of a state in the units: the entries of the sites, and those of the ledger.
fn numbers(state: &State, Units { energy, entropy, length }: Units) -> Vec<f64> {
    let sites = state.x.iter();
    let mut numbers: Vec<f64> =
        sites.flat_map(|x| [x.x / length, x.y / (energy / length), x.z / entropy]).collect();
    numbers.push(state.ledger.work("motor").expect("a column of the ledger") / energy);
    for bath in ["air", "oven"] {
        numbers.push(state.ledger.heat(bath).expect("a column of the ledger") / energy);
        numbers.push(state.ledger.bath_entropy(bath).expect("a column of the ledger") / entropy);
    }
    numbers
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Asserts the balance `H − H₀ = W + Q` and the entropy of the chain with its baths on every recorded state, by the closures of the
/// chain and the entries of the ledger, in the units of the chain; returns the last state, and the largest error of the balance,
/// relative to its terms.
fn keeps_both_laws<P: Model<Manifold = Site>>(
    name: &str,
    chain: &Chain<P>,
    units: Units,
    run: &Trajectory<OpenSites<Site>>,
) -> (State, f64) {
    let certificate = run.certificate();
    assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{name}: {certificate}");
    let first = &run.states()[0].point;
    let (mut before, start) = (f64::NEG_INFINITY, chain.energy_at(first));
    let largest = |number: &dyn Fn(&State) -> f64| {
        run.states().iter().map(|s| number(&s.point).abs()).fold(0.0, f64::max)
    };
    let ledger = |s: &State, name: &str| s.ledger.heat(name).expect("a column of the ledger");
    let heats = largest(&|s| ledger(s, "air").abs() + ledger(s, "oven").abs());
    let work = largest(&|s| s.ledger.work("motor").expect("a column of the ledger"));
    let sites = first.x.len() as f64;
    // A site has the terms of its motion and of its heat, of some units.
    let size = largest(&|s| chain.energy_at(s)) + 4.0 * sites * units.energy + heats + work;
    let of_entropy = units.entropy * sites + largest(&|s| s.ledger.entropy_of_baths());
    let mut worst = 0.0_f64;
    for state in run.states() {
        let (state, time) = (&state.point, state.time);
        let flowed = state.ledger.work("motor").expect("a column of the ledger")
            + ledger(state, "air")
            + ledger(state, "oven");
        let off = chain.energy_at(state) - start - flowed;
        assert!(off.abs() <= 2e-14 * size, "{name} at {time}: {off:.1e} of {size:.1e}");
        worst = worst.max(off.abs() / size);
        let entropy = chain.entropy_at(state) + state.ledger.entropy_of_baths();
        assert!(entropy >= before - 1e-14 * of_entropy, "{name} at {time}: {before} to {entropy}");
        before = entropy;
    }
    (run.last().point.clone(), worst)
}

/// Runs each method, and passes its name, the order of the state and a run of it.
macro_rules! each_method {
    ($chain:expr, |$name:ident, $order:ident, $run:ident| $body:expr) => {
        each_method!(@ $chain, $name, $order, $run, $body,
            WeylMidpoint, 2.0;
            Scheme::new(ChartMidpoint).gradient(MeanValue), 2.0;
            Scheme::new(WeylMidpoint).gradient(SymmetricItohAbe), 2.0;
            Scheme::new(WeylMidpoint).gradient(ItohAbe), 1.0;
            Gauss::<1>, 2.0;
            Gauss::<2>, 4.0;
            Gauss::<3>, 6.0
        );
    };
    (@ $chain:expr, $name:ident, $order:ident, $run:ident, $body:expr, $($method:expr, $of:expr);*) => {$(
        {
            let $name = stringify!($method);
            let $order: f64 = $of;
            let $run = |start: Points<Site>, schedule: Schedule| {
                $method.run($chain, $chain.start(start), schedule).unwrap_or_else(|error| {
                    panic!("{}: {error}", stringify!($method))
                })
            };
            $body
        }
    )*};
}

/// The slope of `ln error` over `ln h`.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let logs = points.iter().map(|(h, e)| (h.ln(), e.ln()));
    let [sx, sy, sxx, sxy] = logs
        .fold([0.0; 4], |[sx, sy, sxx, sxy], (x, y)| [sx + x, sy + y, sxx + x * x, sxy + x * y]);
    (n * sxy - sx * sy) / (n * sxx - sx * sx)
}

#[test]
fn sites_and_ledger_have_the_order_of_each_method() {
    let chain = &chain(4, PLAIN);
    let start = || chain.lattice().points(generic(ONE));
    let tight = Span::until(2.0).tolerance(1e-13).at_most(2);
    let exact = DormandPrince8.run(chain, chain.start(start()), tight).unwrap();
    let exact = numbers(&exact.last().point, ONE);
    each_method!(chain, |name, order, run| {
        let counts = match order {
            1.0 => [40, 80, 160, 320],
            2.0 => [20, 40, 80, 160],
            4.0 => [10, 20, 40, 80],
            _ => [5, 10, 20, 40],
        };
        let errors = counts.map(|count| {
            let h = 2.0 / count as f64;
            let run = run(start(), Span::steps(h, count).into());
            let (last, _) = keeps_both_laws(name, chain, ONE, &run);
            let found = numbers(&last, ONE);
            let sites = exact.len() - 5;
            (
                h,
                distance(&found[..sites], &exact[..sites]),
                distance(&found[sites..], &exact[sites..]),
            )
        });
        let of_sites = slope(&errors.map(|(h, of_sites, _)| (h, of_sites)));
        let of_ledger = slope(&errors.map(|(h, _, of_ledger)| (h, of_ledger)));
        println!("{name}: {of_sites:.2} {of_ledger:.2} from {errors:?}");
        assert!((of_sites - order).abs() < 0.25, "{name}: {of_sites} from {errors:?}");
        assert!(of_ledger > order - 0.25, "{name}: {of_ledger} from {errors:?}");
    });
}

#[test]
fn both_laws_hold_from_every_start_and_in_every_unit() {
    let span = || Span::steps(0.1, 60).into();
    // The energy of the start counts as zero.
    let starts = generic(ONE);
    let plain = chain(5, PLAIN);
    let energy = plain.energy_at(&plain.start(plain.lattice().points(&starts)));
    let at_zero = &chain(5, Options { zero: energy / 5.0, ..PLAIN });
    let start = at_zero.lattice().points(&starts);
    let zero = at_zero.energy_at(&at_zero.start(start.clone()));
    assert!(zero.abs() < 1e-14, "{zero}");
    let mut ends = Vec::new();
    each_method!(at_zero, |name, _order, run| {
        let run = run(start.clone(), span());
        let (last, off) = keeps_both_laws(name, at_zero, ONE, &run);
        ends.push(numbers(&last, ONE));
        claim("chain with two baths and a motor, from the zero of its energy", name)
            .against("H − H₀ − W − Q of its closures, relative; S + ΣS_b of every step")
            .record(format!("{}; 0 falls", scientific(off)), "2e-14; 0 falls");
    });
    // Numbers of the size of molecules, and of stars.
    let sizes: [[f64; 3]; 3] = [[1e-30, 1e-32, 1e-10], [1e30, 1e27, 1e9], [4e-21, 1.4e-23, 1e-9]];
    for [energy, entropy, length] in sizes {
        let units = Units { energy, entropy, length };
        let chain = &chain(5, Options { units, ..PLAIN });
        let start = chain.lattice().points(generic(units));
        let mut ends = ends.iter();
        each_method!(chain, |name, order, run| {
            let run = run(start.clone(), span());
            let last = numbers(&keeps_both_laws(name, chain, units, &run).0, units);
            // A discrete gradient has the metric of the entries, so the error of a step depends on their units.
            let off = distance(&last, ends.next().unwrap());
            let allowed = if order > 5.0 {
                1e-6
            } else if order > 3.0 {
                1e-4
            } else {
                5e-2
            };
            println!("{name} in units of {energy:.0e} J: {off:.1e}");
            assert!(off < allowed, "{name} in units of {energy:.0e} J: {off:.1e}");
        });
    }
}

#[test]
fn a_chain_at_rest_stays_there_and_a_motor_starts_it() {
    // Air and oven have the temperature of all sites.
    let rest = &chain(5, Options { drive: [0.0, 0.0], ..PLAIN });
    let start = || rest.lattice().points(|_| vector![0.0, 0.0, 0.0]);
    each_method!(rest, |name, _order, run| {
        let run = run(start(), Span::steps(0.1, 40).into());
        let (last, _) = keeps_both_laws(name, rest, ONE, &run);
        let moved = distance(&numbers(&last, ONE), &[0.0; 20]);
        assert!(moved < 1e-15, "{name}: {moved:.1e}");
    });
    // A motor and a bath start it from rest.
    let driven = &chain(5, PLAIN);
    let tight = Span::until(4.0).tolerance(1e-12).at_most(2);
    let exact = DormandPrince8.run(driven, driven.start(start()), tight).unwrap();
    let exact = numbers(&exact.last().point, ONE);
    each_method!(driven, |name, order, run| {
        let run = run(start(), Span::steps(0.05, 80).into());
        let (last, _) = keeps_both_laws(name, driven, ONE, &run);
        let off = distance(&numbers(&last, ONE), &exact);
        let allowed = if order > 3.0 {
            1e-5
        } else if order > 1.5 {
            2e-3
        } else {
            3e-2
        };
        assert!(off < allowed, "{name}: {off:.1e}");
    });
}

#[test]
fn stiff_friction_keeps_both_laws() {
    // Air that stops a mass within a millionth of a step.
    let stiff = &chain(4, Options { friction: [1e6, 0.2], ..PLAIN });
    let start = || stiff.lattice().points(generic(ONE));
    each_method!(stiff, |name, _order, run| {
        let run = run(start(), Span::steps(0.1, 20).into());
        keeps_both_laws(name, stiff, ONE, &run);
    });
    // Friction in the bonds that is as fast.
    let inside = &chain(4, Options { friction: [0.08, 1e5], ..PLAIN });
    let run = Gauss::<2>.run(inside, inside.start(start()), Span::steps(0.05, 20)).unwrap();
    keeps_both_laws("Gauss", inside, ONE, &run);
    let run = WeylMidpoint.run(inside, inside.start(start()), Span::steps(0.05, 20)).unwrap();
    keeps_both_laws("the midpoint scheme", inside, ONE, &run);
}

#[test]
fn a_tolerance_outputs_and_checkpoints_of_implicit_steps() {
    let chain = &chain(4, PLAIN);
    let start = || chain.start(chain.lattice().points(generic(ONE)));
    let tight = Span::until(3.0).tolerance(1e-12).at_most(2);
    let exact = DormandPrince8.run(chain, start(), tight).unwrap();
    macro_rules! check {
        ($method:expr, $tolerance:expr) => {
            let span = || Span::until(3.0).tolerance($tolerance).output_every(0.3);
            let whole = $method.run(chain, start(), span()).unwrap();
            let name = stringify!($method);
            let (last, _) = keeps_both_laws(name, chain, ONE, &whole);
            assert!(whole.states().windows(2).all(|s| s[0].entropy <= s[1].entropy), "{name}");
            let off = distance(&numbers(&last, ONE), &numbers(&exact.last().point, ONE));
            println!("{name}: {off:.1e} with {} steps", whole.certificate().steps);
            assert!(off < 100.0 * $tolerance, "{name}: {off:.1e}");
            let mut steps = $method.steps(chain, start(), span()).unwrap();
            for _ in 0..5 {
                steps.advance().unwrap();
            }
            let checkpoint = metriplectic_studies::checkpoints::reread(&steps.checkpoint());
            let resumed = $method.resume(chain, &checkpoint).unwrap().run().unwrap();
            assert_eq!(resumed.last(), whole.last());
            assert_eq!(resumed.certificate(), whole.certificate());
        };
    }
    check!(WeylMidpoint, 1e-4);
    check!(Gauss::<2>, 1e-6);
    check!(Gauss::<3>, 1e-7);
}

#[test]
fn two_masses_take_the_steps_of_the_system_that_they_are() {
    let lattice = &chain(2, PLAIN);
    type X = SVector<Real, 6>;
    let mut bracket = SMatrix::<f64, 6, 6>::zeros();
    for i in [0, 3] {
        bracket[(i, i + 1)] = 1.0;
        bracket[(i + 1, i)] = -1.0;
    }
    let system = System::on(Euclidean::<6>)
        .bracket(Poisson::constant(bracket).unwrap())
        .energy(|x: &X| {
            let site = |i: usize| x[i + 1].powi(2) * 0.5 + x[i].powi(4) * 0.25 + x[i + 2].exp();
            let r = x[3] - x[0];
            site(0) + site(3) + r * r * 0.5 + r.powi(4) * 0.25
        })
        .entropy(|x: &X| x[2] + x[5])
        .dissipation(FieldDissipation(|_: &X, w: &X| {
            let slip = (w[4] - w[1]) * 0.5;
            let mut b = X::repeat(0.0.into());
            (b[1], b[2], b[4], b[5]) = ((-1.0).into(), -slip / w[2], 1.0.into(), -slip / w[5]);
            let friction = b * b.transpose() * (w[2] * w[5] / (w[2] + w[5]) * 0.2);
            let mut c = X::repeat(0.0.into());
            (c[2], c[5]) = (w[2].recip(), -w[5].recip());
            friction + c * c.transpose() * (w[2] * w[5] * 0.1)
        }))
        .work("motor", |t: Real, x: &X| {
            let mut v = X::repeat(0.0.into());
            v[1] = (t * 1.3).sin() * 0.4 * (x[0] * 0.1 + 1.0);
            v
        })
        .bath(
            "air",
            Bath::in_time(|t: Real| t.sin() * 0.1 + 1.0).friction(|_: Real, _: &X, _: &X| {
                [1, 4].map(|i| Contact { rate: 0.08.into(), along: X::ith(i, 1.0.into()) })
            }),
        )
        .bath(
            "oven",
            Bath::at(1.6).friction(|_: Real, _: &X, w: &X| {
                [Contact { rate: w[5].recip() * 0.3, along: X::ith(5, 1.0.into()) }]
            }),
        )
        .build()
        .unwrap();
    let points = lattice.lattice().points(generic(ONE));
    let x = SVector::<f64, 6>::from_fn(|i, _| points[i / 3][i % 3]);
    macro_rules! compare {
        ($($method:expr),*) => {$(
            let span = Span::steps(0.05, 40);
            let typed = $method.run(&system, system.start(x), span).unwrap();
            let run = $method.run(lattice, lattice.start(points.clone()), span).unwrap();
            let (a, b) = (&run.last().point, &typed.last().point);
            let sites = a.x.iter().flat_map(|x| x.iter().copied().collect::<Vec<_>>());
            let mut off = sites.zip(b.x.iter()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let entries = |ledger: &Ledger| {
                let of_bath = |name| [ledger.heat(name).unwrap(), ledger.bath_entropy(name).unwrap()];
                [[ledger.work("motor").unwrap(), 0.0], of_bath("air"), of_bath("oven")].concat()
            };
            off = off.max(distance(&entries(&a.ledger), &entries(&b.ledger)));
            println!("{}: {off:.1e}", stringify!($method));
            assert!(off < 1e-10, "{}: {off:.1e}", stringify!($method));
        )*};
    }
    compare!(
        WeylMidpoint,
        Scheme::new(WeylMidpoint).gradient(ItohAbe),
        Gauss::<2>,
        Gauss::<3>,
        DormandPrince8
    );
}

/// Masses on springs in air that stops them at once, without an entropy of their own.
fn damped(sites: usize, friction: f64) -> OpenLattice<impl Model<Manifold = Euclidean<2>>> {
    Lattice::on(Graph::chain(sites), Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 + x.x * x.x * 0.5)
        .bond_energy(|(x, y): &(Vector2<Real>, Vector2<Real>)| (y.x - x.x).powi(2) * 0.5)
        .build()
        .expect("it is a lattice")
        .opened()
        .work("motor", [0], |t, _, _: &Vector2<f64>| vector![0.0, (1.3 * t).sin()])
        .bath("air", LN_2, 0..sites, move |_, _: &SiteState<'_, Euclidean<2>>| {
            [Onsager { rate: friction, b: vector![0.0, 1.0] }]
        })
}

#[test]
fn radau_gives_what_it_damps_to_the_only_bath_or_refuses() {
    for friction in [0.3, 1e5] {
        let chain = damped(6, friction);
        let start = || chain.start(chain.lattice().points(|i| vector![(i as f64).sin(), 0.8]));
        let tight = Span::until(2.0).tolerance(1e-9).at_most(2);
        let run = Radau::<3>.run(&chain, start(), Span::steps(0.1, 20)).unwrap();
        let certificate = run.certificate();
        assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
        let zero = chain.energy_at(&run.states()[0].point);
        for pair in run.states().windows(2) {
            let [a, b] = [&pair[0].point, &pair[1].point];
            let flowed = b.ledger.work("motor").unwrap() + b.ledger.heat("air").unwrap();
            let off = chain.energy_at(b) - zero - flowed;
            assert!(off.abs() < 1e-14, "{off:.1e}");
            let entropy =
                |s: &OpenState<Points<Euclidean<2>>>| s.ledger.bath_entropy("air").unwrap();
            assert!(entropy(b) >= entropy(a));
        }
        if friction < 1.0 {
            let exact = DormandPrince8.run(&chain, start(), tight).unwrap();
            let pairs = run.last().point.x.iter().zip(exact.last().point.x.iter());
            let off = pairs.map(|(a, b)| (a - b).amax()).fold(0.0, f64::max);
            println!("Radau: {off:.1e}");
            assert!(off < 1e-5, "{off:.1e}");
        }
    }
    // Nothing says which of two baths, or the entropy of the sites, takes what it damps.
    let refused = |error: Option<RunError<_>>| match error {
        Some(RunError::Method(error)) => error.downcast_ref::<NotDamped>().is_some(),
        other => panic!("{other:?}"),
    };
    let two = damped(3, 1.0).bath("wall", 1.0, [0], |_, _: &SiteState<'_, Euclidean<2>>| {
        [Onsager { rate: 1.0, b: vector![0.0, 1.0] }]
    });
    let start = two.start(two.lattice().points(|_| vector![0.0, 0.5]));
    assert!(refused(Radau::<2>.run(&two, start, Span::steps(0.1, 2)).err()));
    let refused = |error: Option<RunError<_>>| match error {
        Some(RunError::Method(error)) => error.downcast_ref::<NotDamped>().is_some(),
        other => panic!("{other:?}"),
    };
    let warm = chain(3, PLAIN);
    let start = warm.start(warm.lattice().points(generic(ONE)));
    assert!(refused(Radau::<2>.run(&warm, start, Span::steps(0.1, 2)).err()));
}

#[test]
fn an_open_lattice_without_implicit_steps_is_refused() {
    let long = chain(400, PLAIN);
    let start = long.start(long.lattice().points(generic(ONE)));
    let Err(RunError::Method(error)) = Gauss::<2>.run(&long, start, Span::steps(0.1, 1)) else {
        panic!("it has a step")
    };
    assert_eq!(error.downcast_ref(), Some(&NoImplicitSteps::Variables { variables: 1200 }));
}

/// A bath that is below zero inside a step, and one whose temperature is known from a time on.
#[test]
fn temperatures_are_asked_for_where_the_force_acts() {
    let bath = |temperature: fn(Real) -> Real| {
        Lattice::on(Graph::chain(3), Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| (x.x * x.x + x.y * x.y) * 0.5)
            .build()
            .expect("it is a lattice")
            .opened()
            .bath("air", temperature, [1], |_, _: &SiteState<'_, Euclidean<2>>| {
                [Onsager { rate: 0.3, b: vector![0.0, 1.0] }]
            })
    };
    let start = |site: usize| vector![1.0 + site as f64, 0.5];
    let cold = bath(|t| Real::from(if (t.re - 0.05).abs() < 0.049 { -1.0 } else { 1.0 }));
    let x0 = cold.start(cold.lattice().points(start));
    let error = WeylMidpoint.run(&cold, x0, Span::steps(0.1, 1)).expect_err("it is below zero");
    assert!(matches!(error, RunError::Step { .. }), "{error}");
    let late = bath(|t| {
        assert!(t.re >= 5.0, "before the table");
        t * 0.2
    });
    let x0 = late.start(late.lattice().points(start));
    let run = Radau::<2>.run(&late, x0, Span::steps(0.1, 20).starting_at(5.0)).expect("it runs");
    let certificate = run.certificate();
    assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
}
