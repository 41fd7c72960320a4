//! Two bodies exchange heat, with a conductivity that depends on their temperatures: the kinetic drift counts.

use std::ops::Range;

use metriplectic::dynamics::noise::{NoiseTerm, NoiseTerms};
use metriplectic::dynamics::{Contact, Dissipation};
use metriplectic::fields::Vector;
use metriplectic::manifolds::{MetricAt, MetricError, Riemannian};
use metriplectic::prelude::*;
use nalgebra::{DMatrix, DVector};

use crate::operator::{
    Basis, Outcome, assert_orders, coefficients, mean, operator, order, outcomes, step,
};
use crate::refusals::fault;

const CAPACITIES: [f64; 2] = [3.0, 5.0];
const K_B: f64 = 0.1;
/// Where the first energy is: six deviations around its mean.
const ENDS: [f64; 2] = [0.04, 0.9];

/// The polynomials of Chebyshev in the first energy; the sum of both is 1.
struct Interval {
    nodes: Vec<Vector2<f64>>,
    projection: DMatrix<f64>,
}

impl Interval {
    fn new(n: usize) -> Self {
        let node = |k: usize| {
            let z = (std::f64::consts::PI * (k as f64 + 0.5) / n as f64).cos();
            let u = ENDS[0] + (ENDS[1] - ENDS[0]) * 0.5 * (z + 1.0);
            vector![u, 1.0 - u]
        };
        let nodes: Vec<_> = (0..n).map(node).collect();
        let mut interval = Self { nodes, projection: DMatrix::zeros(n, n) };
        let values = DMatrix::from_fn(n, n, |i, k| interval.at(&interval.nodes[i])[k]);
        interval.projection = values.try_inverse().expect("the functions are independent");
        interval
    }
}

impl Basis<Vector2<f64>> for Interval {
    fn nodes(&self) -> &[Vector2<f64>] {
        &self.nodes
    }

    fn at(&self, u: &Vector2<f64>) -> DVector<f64> {
        let z = 2.0 * (u.x - ENDS[0]) / (ENDS[1] - ENDS[0]) - 1.0;
        let angle = z.clamp(-1.0, 1.0).acos();
        DVector::from_fn(self.nodes.len(), |k, _| (k as f64 * angle).cos())
    }

    fn projection(&self) -> &DMatrix<f64> {
        &self.projection
    }
}

type Energies = Vector2<Real>;

fn conduction(u: &Energies, w: &Energies) -> [Contact<Energies>; 1] {
    let [t1, t2] = [u.x / CAPACITIES[0], u.y / CAPACITIES[1]];
    [Contact { rate: t1 * t2 * (u.x * 0.8 + 1.0), along: vector![w.y, -w.x] }]
}

/// A dissipation whose kinetic drift is said to vanish, which is not true.
struct WithoutDrift<K>(K);

impl<M: Manifold, G: Riemannian<M>, K: Dissipation<M, G>> Dissipation<M, G> for WithoutDrift<K> {
    fn apply<D: Scalar>(
        &self,
        g: &MetricAt<'_, M, G, D>,
        w: &Vector<M, D>,
        alpha: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        self.0.apply(g, w, alpha)
    }
}

impl<M: Manifold, G: Riemannian<M>, K: NoiseTerms<M, G>> NoiseTerms<M, G> for WithoutDrift<K> {
    fn count(&self) -> usize {
        self.0.count()
    }

    fn each(
        &self,
        g: &MetricAt<'_, M, G, Real>,
        w: &Vector<M, Real>,
        terms: Range<usize>,
        visit: &mut dyn FnMut(usize, NoiseTerm<Vector<M, Real>>),
    ) -> Result<(), MetricError> {
        self.0.each(g, w, terms, visit)
    }

    fn is_closed(&self) -> bool {
        true
    }
}

macro_rules! bodies {
    ($dissipation:expr) => {
        System::on(Euclidean::<2>)
            .energy(|u: &Energies| u.x + u.y)
            .entropy(|u: &Energies| u.x.ln() * CAPACITIES[0] + u.y.ln() * CAPACITIES[1])
            .dissipation($dissipation)
            .noise(Boltzmann(K_B))
            .build()
            .unwrap()
    };
}

/// The errors of the mean, and of the variance relative to it, of the law that is sampled.
fn errors(
    sizes: &[f64],
    step: impl Fn(f64, &Vector2<f64>, &Outcome) -> Vector2<f64>,
) -> [Vec<(f64, f64)>; 2] {
    // exp(S/k_B) on the line is the law Beta(C₁/k_B + 1, C₂/k_B + 1).
    let [a, b] = CAPACITIES.map(|c| c / K_B + 1.0);
    let exact = [a / (a + b), a * b / ((a + b).powi(2) * (a + b + 1.0))];
    let interval = Interval::new(48);
    let mut errors = [Vec::new(), Vec::new()];
    for &h in sizes {
        let matrix = operator(&interval, &outcomes(1), |u, outcome| step(h, u, outcome));
        let moment = |k: i32| mean(&interval, &matrix, &coefficients(&interval, |u| u.x.powi(k)));
        let (first, second) = (moment(1), moment(2));
        errors[0].push((h, first - exact[0]));
        errors[1].push((h, (second - first * first) / exact[1] - 1.0));
    }
    errors
}

#[test]
fn orders_where_the_conductivity_depends_on_the_state() {
    let bodies = bodies!(OnsagerDissipation(conduction));
    let two = errors(&[1.0, 0.5, 0.25], |h, u, outcome| {
        step(&bodies, &NinomiyaVictoir(DormandPrince5).numbers(outcome.clone()), u, h)
    });
    let [mean, variance] = two.each_ref().map(|errors| order(&errors[1..]));
    let problem = "heat exchange, conductance of the state: law's mean and variance";
    assert_orders(problem, "NinomiyaVictoir(DormandPrince5)", &[mean, variance], 2);
    let one = errors(&[0.25, 0.125, 0.0625], |h, u, outcome| {
        step(&bodies, &RandomFlow(DormandPrince5).numbers(outcome.clone()), u, h)
    });
    let [mean, variance] = one.each_ref().map(|errors| order(errors));
    assert_orders(problem, "RandomFlow(DormandPrince5)", &[mean, variance], 1);
}

#[test]
fn without_the_kinetic_drift_the_law_is_wrong_at_every_step_size() {
    let bodies = bodies!(WithoutDrift(OnsagerDissipation(conduction)));
    let [mean, _] = errors(&[0.5, 0.25], |h, u, outcome| {
        step(&bodies, &NinomiyaVictoir(DormandPrince5).numbers(outcome.clone()), u, h)
    });
    assert!(order(&mean).abs() < 0.3 && mean[1].1.abs() > 1e-3, "{mean:?}");
    // A run says so.
    let run =
        RandomFlow(DormandPrince5).seed(1).run(&bodies, vector![0.4, 0.6], Span::steps(0.1, 1));
    let error = fault(run);
    assert!(matches!(error, NoiseError::DriftNotZero { .. }), "{error}");
}
