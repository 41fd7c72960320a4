//! Ports of lattices carry no entropy in an implicit step, and a state at rest books what flows through it. Each cure was removed once,
//! and these tests failed:
//!
//! | what was changed | tests that failed |
//! |---|---|
//! | a port keeps the entropy that a discrete gradient says it carries | `two_pendulums_are_the_open_system_that_they_are`, `a_motor_that_pushes_pistons_on_a_gas_carries_no_entropy` |

use metriplectic::integrators::{ItohAbe, MeanValue, SymmetricItohAbe};
use metriplectic::lattices::OpenLattice;
use metriplectic::lattices::model::Model;
use metriplectic::prelude::*;
use nalgebra::{Matrix6, Vector6};

/// `Π` of `(q, p, u)`.
const CANONICAL: Matrix3<f64> = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0);

/// The states of a chain of weights with heat: `(q, p, u)` at each site.
type Weights = Euclidean<3>;
type Open = OpenState<Points<Weights>>;

/// Two pendulums on a spring that hardens, with friction that heats them, conduction between them, a motor on the first one, air around the
/// last one and an oven at both.
fn pendulums() -> OpenLattice<impl Model<Manifold = Weights>> {
    Lattice::on(Graph::chain(2), Euclidean::<3>)
        .bracket(Poisson::constant(CANONICAL).expect("a skew matrix"))
        .energy(|x: &Vector3<Real>| x.y * x.y * 0.5 - x.x.cos() + x.z)
        .bond_energy(|(x, y): &(Vector3<Real>, Vector3<Real>)| {
            let r = y.x - x.x;
            r * r * 0.5 + r * r * r * r * 0.25
        })
        .entropy(|x: &Vector3<Real>| x.z.ln())
        .site_onsager(|at| {
            [Onsager { rate: 0.15 * at.x.z, b: vector![0.0, 1.0, -at.w.y / at.w.z] }]
        })
        .bond_onsager(|bond| {
            let [a, b] = bond.x.map(|x| x.z);
            let [v, w] = bond.w.map(|w| w.z.recip());
            [Onsager { rate: 0.2 * a * b, b: [vector![0.0, 0.0, v], vector![0.0, 0.0, -w]] }]
        })
        .build()
        .expect("the parts make a lattice")
        .opened()
        .work("motor", [0], |t, _, _: &Vector3<f64>| vector![0.0, 0.4 * (1.3 * t).sin(), 0.0])
        .bath(
            "air",
            |t: Real| t.sin() * 0.1 + 0.7,
            [1],
            |_, _: &SiteState<'_, Weights>| [Onsager { rate: 0.08, b: vector![0.0, 1.0, 0.0] }],
        )
        .bath("oven", 0.7, [0, 1], |t, at: &SiteState<'_, Weights>| {
            let rate = 0.3 * (1.0 + 0.2 * t.cos()) * at.x.z;
            [Onsager { rate, b: vector![0.0, 0.0, 1.0] }]
        })
}

/// A state in which nothing vanishes.
fn generic(i: usize) -> Vector3<f64> {
    let phase = i as f64;
    vector![0.4 * (phase + 0.3).sin(), 0.5 * (2.0 * phase + 1.0).cos(), 1.0 + 0.3 * phase.sin()]
}

/// The numbers of an open state, without the net sum.
fn numbers(state: &Open) -> Vec<f64> {
    let ledger = &state.ledger;
    let mut numbers: Vec<f64> = state.x.iter().flat_map(|x| x.iter().copied()).collect();
    numbers.push(ledger.work("motor").expect("a column of the ledger"));
    for bath in ["air", "oven"] {
        numbers.push(ledger.heat(bath).expect("a column of the ledger"));
        numbers.push(ledger.bath_entropy(bath).expect("a column of the ledger"));
    }
    numbers
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Calls a macro for each implicit method that takes a lattice with an entropy and several baths.
macro_rules! each_method {
    ($body:ident) => {
        $body!(WeylMidpoint);
        $body!(Scheme::new(Exponential).gradient(MeanValue));
        $body!(Scheme::new(ChartMidpoint).gradient(ItohAbe));
        $body!(Scheme::new(WeylMidpoint).gradient(SymmetricItohAbe));
        $body!(Gauss::<1>);
        $body!(Gauss::<2>);
        $body!(Gauss::<3>);
    };
}

#[test]
fn two_pendulums_are_the_open_system_that_they_are() {
    type Pair = (Vector3<Real>, Vector3<Real>);
    let lattice = pendulums();
    let bracket = || Poisson::constant(CANONICAL).unwrap();
    let oven = |site: usize| {
        move |t: Real, (x, y): &Pair, _: &Vector6<Real>| {
            let u = if site == 0 { x.z } else { y.z };
            let mut along = Vector6::<Real>::zeros();
            along[3 * site + 2] = 1.0.into();
            Contact { rate: u * (t.cos() * 0.2 + 1.0) * 0.3, along }
        }
    };
    let [first, second] = [oven(0), oven(1)];
    let system = System::on(Product(Euclidean::<3>, Euclidean::<3>))
        .bracket((bracket(), bracket()))
        .energy(|(x, y): &Pair| {
            let r = y.x - x.x;
            let site = |x: &Vector3<Real>| x.y * x.y * 0.5 - x.x.cos() + x.z;
            site(x) + site(y) + r * r * 0.5 + r * r * r * r * 0.25
        })
        .entropy(|(x, y): &Pair| x.z.ln() + y.z.ln())
        .dissipation(FieldDissipation(|(x, y): &Pair, w: &Vector6<Real>| {
            let mut k = Matrix6::<Real>::zeros();
            for (first, u) in [(0, x.z), (3, y.z)] {
                let mut b = Vector6::<Real>::zeros();
                b[first + 1] = 1.0.into();
                b[first + 2] = -w[first + 1] / w[first + 2];
                k += b * b.transpose() * (u * 0.15);
            }
            let mut b = Vector6::<Real>::zeros();
            (b[2], b[5]) = (w[2].recip(), -w[5].recip());
            k + b * b.transpose() * (x.z * y.z * 0.2)
        }))
        .work("motor", |t: Real, _: &Pair| {
            let mut force = Vector6::<Real>::zeros();
            force[1] = (t * 1.3).sin() * 0.4;
            force
        })
        .bath(
            "air",
            Bath::in_time(|t: Real| t.sin() * 0.1 + 0.7).friction(
                |_: Real, _: &Pair, _: &Vector6<Real>| {
                    let mut along = Vector6::<Real>::zeros();
                    along[4] = 1.0.into();
                    [Contact { rate: 0.08.into(), along }]
                },
            ),
        )
        .bath(
            "oven",
            Bath::at(0.7).friction(move |t: Real, x: &Pair, w: &Vector6<Real>| {
                [first(t, x, w), second(t, x, w)]
            }),
        )
        .build()
        .unwrap();
    macro_rules! agrees {
        ($method:expr) => {
            let span = Span::steps(0.05, 60);
            let here = lattice.start(lattice.lattice().points(generic));
            let here = $method.run(&lattice, here, span).unwrap();
            let typed = system.start((generic(0), generic(1)));
            let typed = $method.run(&system, typed, span).unwrap();
            assert_eq!(here.states().len(), typed.states().len());
            let mut most = 0.0;
            for (a, b) in here.states().iter().zip(typed.states()) {
                let OpenState { x: (x, y), ledger, .. } = &b.point;
                let mut b: Vec<f64> = x.iter().chain(y.iter()).copied().collect();
                b.push(ledger.work("motor").unwrap());
                for bath in ["air", "oven"] {
                    b.push(ledger.heat(bath).unwrap());
                    b.push(ledger.bath_entropy(bath).unwrap());
                }
                most = f64::max(most, distance(&numbers(&a.point), &b));
            }
            println!("{}: {most:.1e}", stringify!($method));
            assert!(most < 1e-10, "{}: {most:e}", stringify!($method));
        };
    }
    each_method!(agrees);
}

#[test]
fn heat_that_flows_through_a_rod_at_rest_is_booked() {
    // Between ovens at 2 and 1 with contacts of the resistance 1/2: the flux is 1/4.
    let contact = |_: f64, at: &SiteState<'_, Euclidean<1>>| {
        [Onsager { rate: 2.0 * at.x.x, b: vector![1.0] }]
    };
    let rod = Lattice::on(Graph::chain(4), Euclidean::<1>)
        .energy(|u: &Vector1<Real>| u.x)
        .entropy(|u: &Vector1<Real>| u.x.ln())
        .bond_onsager(|bond| {
            let [u, v] = bond.x;
            [Onsager { rate: u.x * v.x, b: [vector![1.0], vector![-1.0]] }]
        })
        .build()
        .unwrap()
        .opened()
        .bath("hot", 2.0, [0], contact)
        .bath("cold", 1.0, [3], contact);
    macro_rules! flows {
        ($method:expr) => {
            let start = rod.start(rod.lattice().points(|i| vector![1.875 - 0.25 * i as f64]));
            let run = $method.run(&rod, start, Span::steps(0.5, 40)).unwrap();
            let state = &run.last().point;
            let off =
                state.x.iter().enumerate().map(|(i, u)| (u.x - 1.875 + 0.25 * i as f64).abs());
            let off = off.fold(0.0, f64::max);
            let [hot, cold] = ["hot", "cold"].map(|bath| state.ledger.heat(bath).unwrap());
            let gained = run.certificate().entropy_gained;
            println!("{}: {off:.1e} {hot} {cold} {gained}", stringify!($method));
            assert!(off < 1e-14 && (hot - 5.0).abs() < 1e-13 && (cold + 5.0).abs() < 1e-13);
            assert!((gained - 2.5).abs() < 1e-13);
            assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
        };
    }
    each_method!(flows);
}

#[test]
fn a_motor_that_pushes_pistons_on_a_gas_carries_no_entropy() {
    // Columns of gas under weights, `(q, p, u)` with the entropy `ln u + 0.4 ln q`: no friction and no bath, so it is constant.
    let pistons = Lattice::on(Graph::chain(2), Euclidean::<3>)
        .bracket(Poisson::field(|x: &Vector3<Real>| {
            let pressure = x.z / x.x * 0.4;
            let mut pi = Matrix3::<Real>::zeros();
            (pi[(0, 1)], pi[(1, 0)]) = (1.0.into(), (-1.0).into());
            (pi[(1, 2)], pi[(2, 1)]) = (pressure, -pressure);
            pi
        }))
        .energy(|x: &Vector3<Real>| x.y * x.y * 0.5 + x.x + x.z)
        .bond_energy(|(x, y): &(Vector3<Real>, Vector3<Real>)| (y.x - x.x).powi(2) * 0.5)
        .entropy(|x: &Vector3<Real>| x.z.ln() + x.x.ln() * 0.4)
        .site_onsager(|at| [Onsager { rate: 0.0, b: vector![0.0, at.w.z, -at.w.y] }])
        .build()
        .unwrap()
        .opened()
        .work("motor", [0], |t, _, _: &Vector3<f64>| vector![0.0, (3.0 * t).sin(), 0.0]);
    macro_rules! constant {
        ($method:expr) => {
            let points = pistons.lattice().points(|i| vector![1.0 + 0.2 * i as f64, 0.3, 1.0]);
            let start = pistons.start(points);
            let before = pistons.entropy_at(&start);
            let run = $method.run(&pistons, start, Span::steps(0.1, 50)).unwrap();
            let (certificate, state) = (run.certificate(), &run.last().point);
            let off = (pistons.entropy_at(state) - before).abs();
            println!("{}: {off:.1e}", stringify!($method));
            assert!(certificate.keeps_energy(), "{certificate}");
            assert!(off < 2e-14 && state.ledger.work("motor").unwrap().abs() > 1e-3, "{off:e}");
        };
    }
    each_method!(constant);
}
