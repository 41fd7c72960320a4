//! A ring of a hundred bodies that exchange heat: the law of Dirichlet, by one path.

use metriplectic::prelude::*;
use nalgebra::{Vector1, vector};

const CAPACITY: f64 = 1.0;
const K_B: f64 = 0.25;

type Body = Vector1<Real>;

/// A ring of bodies with the energy 1 in the mean and the entropy `C ln u`, whose bonds conduct in proportion to both.
macro_rules! ring {
    ($sites:expr) => {
        Lattice::on(Graph::ring($sites), Euclidean::<1>)
            .energy(|u: &Body| u.x)
            .entropy(|u: &Body| u.x.ln() * CAPACITY)
            .bond_onsager(|bond| {
                let [u, v] = bond.x.map(|u| u.x);
                [Onsager { rate: u * v, b: [vector![bond.w[1].x], vector![-bond.w[0].x]] }]
            })
            .build()
            .unwrap()
            .with_noise(Boltzmann(K_B))
    };
}

#[test]
fn a_hundred_bodies_have_the_variance_of_their_law() {
    let sites = 100;
    let ring = ring!(sites);
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
    // exp(S/k_B) on the simplex is the law of Dirichlet with a = C/k_B + 1.
    let a = CAPACITY / K_B + 1.0;
    let n = sites as f64;
    let exact = (n - 1.0) / (a * n + 1.0);
    // Without the kinetic drift it would be larger by a quarter: each body has two bonds, and a is 4 and not 5.
    assert!((variance / exact - 1.0).abs() < 0.05, "{variance} {exact}");
}

#[test]
fn threads_do_not_change_a_bit() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let ring = ring!(5000);
            let start = ring.flow().points(|site| vector![1.0 + 0.3 * (site as f64).sin()]);
            let run = RandomFlow(DormandPrince5).seed(1).run(&ring, start, Span::steps(0.01, 3));
            run.unwrap().last().point.clone()
        })
    };
    assert_eq!(run(1), run(3));
    assert_eq!(run(1), run(7));
}
