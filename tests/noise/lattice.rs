//! Rings of bodies that exchange heat: the law of Dirichlet, of three by operators and of a hundred by one path.

use metriplectic::dynamics::noise::Uniform;
use metriplectic::integrators::Noisy;
use metriplectic::lattices::Model;
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee};
use nalgebra::{DMatrix, DVector, Vector1, Vector2, vector};

use crate::operator::{
    Basis, Outcome, assert_orders, coefficients, mean, operator, order, outcomes, step,
};
use crate::refusals::fault;
use crate::tables;

const CAPACITY: f64 = 1.0;

type Body = Vector1<Real>;

/// A ring of bodies with the energy 1 in the mean and the entropy `C ln u`, whose bonds conduct in proportion to both.
fn ring(sites: usize, k_b: f64) -> Noisy<Lattice<impl Model<Manifold = Euclidean<1>>>, Uniform> {
    Lattice::on(Graph::ring(sites), Euclidean::<1>)
        .energy(|u: &Body| u.x)
        .entropy(|u: &Body| u.x.ln() * CAPACITY)
        .bond_onsager(|bond| {
            let [u, v] = bond.x.map(|u| u.x);
            [Onsager { rate: u * v, b: [vector![bond.w[1].x], vector![-bond.w[0].x]] }]
        })
        .build()
        .expect("a lattice")
        .with_noise(Boltzmann(k_b))
}

/// The variance of an energy in units of its mean, of `n` bodies: `exp(S/k_B)` on the simplex is the law of Dirichlet with
/// `a = C/k_B + 1`.
fn variance_of_the_law(n: usize, k_b: f64) -> f64 {
    let (n, a) = (n as f64, CAPACITY / k_b + 1.0);
    (n - 1.0) / (a * n + 1.0)
}

/// Polynomials of Chebyshev in two of three energies that add up to 3.
struct Square {
    nodes: Vec<Vector2<f64>>,
    projection: DMatrix<f64>,
}

/// How many polynomials there are in each energy, and how far both go from 1.
const DEGREES: usize = 9;
const REACH: f64 = 0.45;

impl Square {
    fn new() -> Self {
        let node = |k: usize| {
            1.0 + REACH * (std::f64::consts::PI * (k as f64 + 0.5) / DEGREES as f64).cos()
        };
        let n = DEGREES * DEGREES;
        let nodes = (0..n).map(|k| vector![node(k % DEGREES), node(k / DEGREES)]).collect();
        let mut square = Self { nodes, projection: DMatrix::zeros(n, n) };
        let values = DMatrix::from_fn(n, n, |i, k| square.at(&square.nodes[i])[k]);
        square.projection = values.try_inverse().expect("the functions are independent");
        square
    }
}

impl Basis<Vector2<f64>> for Square {
    fn nodes(&self) -> &[Vector2<f64>] {
        &self.nodes
    }

    fn at(&self, u: &Vector2<f64>) -> DVector<f64> {
        // By recursion, which holds beyond the ends too.
        let polynomials = |z: f64| {
            let mut values = [1.0; DEGREES];
            values[1] = z;
            for k in 2..DEGREES {
                values[k] = 2.0 * z * values[k - 1] - values[k - 2];
            }
            values
        };
        let [a, b] = [u.x, u.y].map(|u| polynomials((u - 1.0) / REACH));
        DVector::from_fn(self.nodes.len(), |k, _| a[k % DEGREES] * b[k / DEGREES])
    }

    fn projection(&self) -> &DMatrix<f64> {
        &self.projection
    }
}

/// A step of a size from two energies.
type Step<'a> = dyn Fn(f64, &Vector2<f64>, &Outcome) -> Vector2<f64> + 'a;

#[test]
fn orders_of_a_ring_of_three_bodies() {
    let (k_b, square) = (0.02, Square::new());
    let ring = ring(3, k_b);
    let errors = |sizes: [f64; 3], step: &Step<'_>| {
        sizes.map(|h| {
            let matrix = operator(&square, &outcomes(3), |u, outcome| step(h, u, outcome));
            let f = coefficients(&square, |u| (u.x - 1.0).powi(2));
            (h, mean(&square, &matrix, &f) / variance_of_the_law(3, k_b) - 1.0)
        })
    };
    let points = |u: &Vector2<f64>| {
        let all = [u.x, u.y, 3.0 - u.x - u.y];
        ring.flow().points(|site| vector![all[site]])
    };
    // Each deviation relaxes at the rate 3.
    let method = RandomFlow(DormandPrince5).seed(1);
    let fast = method.run(&ring, points(&vector![1.0, 1.0]), Span::steps(0.5, 20));
    let error = fault(fast);
    assert!(
        matches!(error, NoiseError::FrictionUnresolved { rate, .. } if (rate - 1.5).abs() < 0.3),
        "{error}"
    );
    let one = errors([0.1, 0.05, 0.025], &|h, u, outcome| {
        let end = step(&ring, &RandomFlow(DormandPrince5).numbers(outcome.clone()), &points(u), h);
        vector![end[0].x, end[1].x]
    });
    let problem = "ring of three bodies: variance of the law";
    assert_orders(problem, "RandomFlow(DormandPrince5)", &[order(&one)], 1);
    let two = errors([0.2, 0.1, 0.05], &|h, u, outcome| {
        let method = NinomiyaVictoir(DormandPrince5).numbers(outcome.clone());
        let end = step(&ring, &method, &points(u), h);
        vector![end[0].x, end[1].x]
    });
    assert_orders(problem, "NinomiyaVictoir(DormandPrince5)", &[order(&two)], 2);
}

#[test]
fn a_hundred_bodies_have_the_variance_of_their_law() {
    let sites = 100;
    let k_b = 0.25;
    let ring = ring(sites, k_b);
    let start = ring.flow().points(|site| vector![1.0 + 0.3 * (site as f64).sin()]);
    let span = Span::steps(0.015, 4000);
    let run = RandomFlow(DormandPrince5).seed(11).run(&ring, start, span).unwrap();
    assert!(run.certificate().keeps_energy() && !run.certificate().keeps_entropy());
    let mean = run.certificate().initial_energy / sites as f64;
    let squares = run.states().iter().skip(300).map(|state| {
        state.point.iter().map(|u| (u.x / mean - 1.0).powi(2)).sum::<f64>() / sites as f64
    });
    let count = (run.states().len() - 300) as f64;
    let variance = squares.sum::<f64>() / count;
    let exact = variance_of_the_law(sites, k_b);
    // Without the kinetic drift it would be larger by a quarter: each body has two bonds, and a is 4 and not 5.
    let off = variance / exact - 1.0;
    assert!(off.abs() < 0.05, "{variance} {exact}");
    Claim::new(
        Guarantee::Noise,
        "ring of a hundred bodies: variance of one path",
        "RandomFlow(DormandPrince5)",
    )
    .against("Dirichlet's law")
    .record(format!("{:+.1} %", 100.0 * off), "5 %");
}

#[test]
fn a_path_of_a_ring_is_that_of_every_method() {
    let ring = ring(5, 0.01);
    let start = || ring.flow().points(|site| vector![1.0 + 0.3 * (site as f64).sin()]);
    assert_eq!(ring.flow().verify(&start()), Ok(()));
    let span = Span::steps(0.02, 50);
    let method = RandomFlow(DormandPrince5).seed(3);
    let run = || Ok(method.run(&ring, start(), span)?);
    let whole: Result<_, Error> = run();
    let whole = whole.unwrap();
    // With the numbers of a step frozen, the motion has the order of each method.
    let off = |run: Trajectory<_>| {
        let (a, b): (&Points<Euclidean<1>>, _) = (&run.last().point, &whole.last().point);
        a.iter().zip(b.iter()).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    let moved = off(method.run(&ring, start(), Span::steps(0.02, 1)).unwrap());
    let eight = off(RandomFlow(DormandPrince8).seed(3).run(&ring, start(), span).unwrap());
    let two = off(RandomFlow(RungeKuttaChebyshev).seed(3).run(&ring, start(), span).unwrap());
    println!("off by {eight:.1e} and {two:.1e} of {moved:.1e}");
    assert!(eight < 1e-7 * moved && two < 1e-2 * moved, "{eight:e} {two:e} {moved:e}");
    let midpoint = off(RandomFlow(WeylMidpoint).seed(3).run(&ring, start(), span).unwrap());
    let four = off(RandomFlow(Gauss::<2>).seed(3).run(&ring, start(), span).unwrap());
    println!("off by {midpoint:.1e} and {four:.1e} of {moved:.1e}");
    assert!(midpoint < 1e-2 * moved && four < 1e-5 * moved, "{midpoint:e} {four:e} {moved:e}");
    let refused = RandomFlow(Radau::<2>).seed(3).run(&ring, start(), span);
    assert_eq!(fault(refused), NoiseError::NoiseWithRadau);
    // Put down and taken up again.
    let mut steps = method.steps(&ring, start(), span).unwrap();
    for _ in 0..23 {
        steps.advance().unwrap();
    }
    let resumed = method.resume(&ring, &steps.checkpoint()).unwrap().run().unwrap();
    assert_eq!(resumed.last(), whole.last());
    assert_eq!(resumed.certificate(), whole.certificate());
    // States at the ends of steps.
    let recorded = method.run(&ring, start(), span.output_at([0.5])).unwrap();
    let is_there = |time: f64| (time - 0.5).abs() < 1e-12;
    let at = recorded.iter().find(|state| is_there(state.time)).unwrap();
    let same = whole.iter().find(|state| is_there(state.time)).unwrap();
    assert_eq!(at.point, same.point);
    tables::are_those_of_the_run(&ring, run);
}

#[test]
fn threads_do_not_change_a_bit() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let ring = ring(5000, 0.25);
            let start = ring.flow().points(|site| vector![1.0 + 0.3 * (site as f64).sin()]);
            let run = RandomFlow(DormandPrince5).seed(1).run(&ring, start, Span::steps(0.01, 3));
            run.unwrap().last().point.clone()
        })
    };
    assert_eq!(run(1), run(3));
    assert_eq!(run(1), run(7));
}

#[test]
fn a_lattice_at_rest_has_a_drift_and_a_divergence() {
    type Site = Vector2<Real>;
    // A momentum that gives its energy to the heat of its site, from rest.
    let rest = Lattice::on(Graph::ring(6), Euclidean::<2>)
        .energy(|x: &Site| x.x * x.x * 0.5 + x.y)
        .entropy(|x: &Site| x.y.ln())
        .site_onsager(|site| [Onsager { rate: site.x.y, b: vector![site.w.y, -site.w.x] }])
        .build()
        .expect("a lattice")
        .with_noise(Boltzmann(0.01));
    let at = |x: Vector2<f64>| move |_: usize| x;
    let span = Span::steps(0.01, 20);
    let method = RandomFlow(DormandPrince5).seed(1);
    let run = method.run(&rest, rest.flow().points(at(vector![0.0, 1.0])), span);
    let run = run.unwrap_or_else(|error| panic!("{error}"));
    assert!(run.certificate().keeps_energy() && run.last().point[0].x != 0.0);
    // {x, y} = y changes the volume at the rate −H_x, which is zero at the start.
    type Affine = Vector3<Real>;
    let affine = Lattice::on(Graph::ring(6), Euclidean::<3>)
        .bracket(Poisson::field(|x: &Affine| {
            let mut pi = Matrix3::<Real>::zeros();
            (pi[(0, 1)], pi[(1, 0)]) = (x.y, -x.y);
            pi
        }))
        .energy(|x: &Affine| (x.x * x.x + x.y * x.y) * 0.5 + x.z)
        .entropy(|x: &Affine| x.z)
        .site_onsager(|site| [Onsager { rate: 0.1, b: vector![0.0, site.w.z, -site.w.y] }])
        .build()
        .expect("a lattice")
        .with_noise(Boltzmann(0.1));
    let run = method.run(&affine, affine.flow().points(|_| vector![0.0, 1.2, 0.3]), span);
    let error = fault(run);
    assert!(matches!(error, NoiseError::NotUnimodular { .. }), "{error}");
}
