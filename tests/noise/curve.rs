//! A further invariant beside the energy: the noise fields are projected off its differential, and move along a curve.

use metriplectic::prelude::*;
use nalgebra::{DMatrix, DVector, vector};

use crate::operator::{Basis, Outcome, coefficients, mean, operator, order, outcomes, step};

/// The curve `H = E`, `L = l` with `H − L = 0.3 x² + 0.6 y²`, in an angle that has the volume of both laws.
struct Curve {
    nodes: Vec<Vector3<f64>>,
    projection: DMatrix<f64>,
}

const MODES: usize = 14;
const LEVEL: f64 = 0.5;

fn at(angle: f64) -> Vector3<f64> {
    let (x, y) = (angle.cos() / 0.3_f64.sqrt(), angle.sin() / 0.6_f64.sqrt());
    vector![x, y, LEVEL - 0.2 * x * x]
}

impl Curve {
    fn new() -> Self {
        let n = 2 * MODES + 1;
        let angle = |k: usize| std::f64::consts::TAU * (k as f64 + 0.3) / n as f64;
        let nodes: Vec<_> = (0..n).map(|k| at(angle(k))).collect();
        let mut curve = Self { nodes, projection: DMatrix::zeros(n, n) };
        let values = DMatrix::from_fn(n, n, |i, k| curve.at(&curve.nodes[i])[k]);
        curve.projection = values.try_inverse().expect("the functions are independent");
        curve
    }
}

impl Basis<Vector3<f64>> for Curve {
    fn nodes(&self) -> &[Vector3<f64>] {
        &self.nodes
    }

    fn at(&self, x: &Vector3<f64>) -> DVector<f64> {
        let angle = (x.y * 0.6_f64.sqrt()).atan2(x.x * 0.3_f64.sqrt());
        DVector::from_fn(self.nodes.len(), |k, _| {
            let m = k.div_ceil(2) as f64;
            if k % 2 == 1 { (m * angle).sin() } else { (m * angle).cos() }
        })
    }

    fn projection(&self) -> &DMatrix<f64> {
        &self.projection
    }
}

/// A step of a size from a point.
type Step<'a> = dyn Fn(f64, &Vector3<f64>, &Outcome) -> Vector3<f64> + 'a;

fn entropy(x: &Vector3<f64>) -> f64 {
    0.4 * x.x + 0.3 * x.y * x.y + 0.2 * x.z
}

#[test]
fn orders_with_a_further_casimir() {
    let k_b = 0.6;
    let system = System::on(Euclidean::<3>)
        .bracket(Zero)
        .energy(|x: &Vector3<Real>| x.x * x.x * 0.5 + x.y * x.y * 0.6 + x.z)
        .entropy(|x: &Vector3<Real>| x.x * 0.4 + x.y * x.y * 0.3 + x.z * 0.2)
        .casimir(|x: &Vector3<Real>| x.z + x.x * x.x * 0.2)
        .dissipation(MetricDissipation::scaled(0.1))
        .noise(Boltzmann(k_b))
        .build()
        .unwrap();
    let curve = Curve::new();
    let exact = {
        let n = 400;
        let points: Vec<_> =
            (0..n).map(|k| at(std::f64::consts::TAU * f64::from(k) / f64::from(n))).collect();
        let weight = |x: &Vector3<f64>| (entropy(x) / k_b).exp();
        points.iter().map(|x| weight(x) * entropy(x)).sum::<f64>()
            / points.iter().map(weight).sum::<f64>()
    };
    let errors = |sizes: [f64; 3], step: &Step<'_>| {
        sizes.map(|h| {
            let matrix = operator(&curve, &outcomes(3), |x, outcome| step(h, x, outcome));
            (h, mean(&curve, &matrix, &coefficients(&curve, entropy)) - exact)
        })
    };
    let two = errors([0.2, 0.1, 0.05], &|h, x, outcome| {
        step(&system, &NinomiyaVictoir(DormandPrince5).numbers(outcome.clone()), x, h)
    });
    assert!((order(&two) - 2.0).abs() < 0.1, "{two:?}");
    let one = errors([0.1, 0.05, 0.025], &|h, x, outcome| {
        step(&system, &RandomFlow(DormandPrince5).numbers(outcome.clone()), x, h)
    });
    assert!((order(&one) - 1.0).abs() < 0.1, "{one:?}");
}
