//! Energy shells that are curves: one of a further invariant, off whose differential the noise fields are projected, and one
//! on a sphere.

use metriplectic::prelude::*;
use nalgebra::{DMatrix, DVector, vector};

use crate::operator::{
    Basis, Outcome, assert_orders, coefficients, mean, operator, order, outcomes, step,
};

/// Trigonometric polynomials in an angle on a closed curve.
struct Curve {
    angle: fn(&Vector3<f64>) -> f64,
    nodes: Vec<Vector3<f64>>,
    projection: DMatrix<f64>,
}

const MODES: usize = 14;

impl Curve {
    fn new(at: fn(f64) -> Vector3<f64>, angle: fn(&Vector3<f64>) -> f64) -> Self {
        let n = 2 * MODES + 1;
        let node = |k: usize| at(std::f64::consts::TAU * (k as f64 + 0.3) / n as f64);
        let nodes = (0..n).map(node).collect();
        let mut curve = Self { angle, nodes, projection: DMatrix::zeros(n, n) };
        let values = DMatrix::from_fn(n, n, |i, k| curve.at(&curve.nodes[i])[k]);
        curve.projection = values.try_inverse().expect("the functions are independent");
        curve
    }

    /// The errors of the mean of a function under the law that is sampled.
    fn errors(
        &self,
        (f, exact): (&Function, f64),
        sizes: [f64; 3],
        step: &Step<'_>,
    ) -> [(f64, f64); 3] {
        sizes.map(|h| {
            let matrix = operator(self, &outcomes(3), |x, outcome| step(h, x, outcome));
            (h, mean(self, &matrix, &coefficients(self, f)) - exact)
        })
    }
}

impl Basis<Vector3<f64>> for Curve {
    fn nodes(&self) -> &[Vector3<f64>] {
        &self.nodes
    }

    fn at(&self, x: &Vector3<f64>) -> DVector<f64> {
        let angle = (self.angle)(x);
        DVector::from_fn(self.nodes.len(), |k, _| {
            let m = k.div_ceil(2) as f64;
            if k % 2 == 1 { (m * angle).sin() } else { (m * angle).cos() }
        })
    }

    fn projection(&self) -> &DMatrix<f64> {
        &self.projection
    }
}

/// A function of the state.
type Function = fn(&Vector3<f64>) -> f64;

/// A step of a size from a point.
type Step<'a> = dyn Fn(f64, &Vector3<f64>, &Outcome) -> Vector3<f64> + 'a;

/// The mean of a function of the state over all angles with a density.
fn exact(at: fn(f64) -> Vector3<f64>, density: impl Fn(&Vector3<f64>) -> f64, f: &Function) -> f64 {
    let n = 400;
    let points = (0..n).map(|k| at(std::f64::consts::TAU * f64::from(k) / f64::from(n)));
    let (above, below) = points.fold((0.0, 0.0), |(above, below), x| {
        let weight = density(&x);
        (above + weight * f(&x), below + weight)
    });
    above / below
}

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
    // The curve `H = E`, `L = l` with `H − L = 0.3 x² + 0.6 y²`, in an angle that has the volume of both laws.
    fn at(angle: f64) -> Vector3<f64> {
        let (x, y) = (angle.cos() / 0.3_f64.sqrt(), angle.sin() / 0.6_f64.sqrt());
        vector![x, y, 0.5 - 0.2 * x * x]
    }
    let curve = Curve::new(at, |x| (x.y * 0.6_f64.sqrt()).atan2(x.x * 0.3_f64.sqrt()));
    let f: &Function = &(entropy as Function);
    let of = (f, exact(at, |x| (entropy(x) / k_b).exp(), f));
    let two = curve.errors(of, [0.2, 0.1, 0.05], &|h, x, outcome| {
        step(&system, &NinomiyaVictoir(DormandPrince5).numbers(outcome.clone()), x, h)
    });
    let problem = "curve of an energy and a Casimir: law of S";
    assert_orders(problem, "NinomiyaVictoir(DormandPrince5)", &[order(&two)], 2);
    let one = curve.errors(of, [0.1, 0.05, 0.025], &|h, x, outcome| {
        step(&system, &RandomFlow(DormandPrince5).numbers(outcome.clone()), x, h)
    });
    assert_orders(problem, "RandomFlow(DormandPrince5)", &[order(&one)], 1);
}

/// The energy on the sphere, of degree 3.
fn cubic(n: &Vector3<f64>) -> f64 {
    n.z + 0.5 * n.z.powi(3) + 0.3 * n.x * n.x
}

/// `∂H/∂z` at a fixed azimuth: `n_x² = (1 − z²) cos² φ`.
fn slope(n: &Vector3<f64>) -> f64 {
    1.0 + 1.5 * n.z * n.z - 0.6 * n.z * n.x * n.x / (1.0 - n.z * n.z)
}

#[test]
fn orders_on_a_sphere_with_an_energy_that_is_not_quadratic() {
    let k_b = 0.4;
    let with_measure = |strength: f64| {
        System::on(Sphere::<2>::round())
            .bracket(Zero)
            .energy(|n: &Vector3<Real>| n.z + n.z.powi(3) * 0.5 + n.x * n.x * 0.3)
            .entropy(|n: &Vector3<Real>| n.x * 0.5 + n.y * n.z * 0.3)
            .dissipation(MetricDissipation::scaled(0.3))
            .noise(Boltzmann(k_b).measure(move |n: &Vector3<Real>| n.x * strength))
            .build()
            .unwrap()
    };
    // The area is dz dφ, so the law on the curve H = 0.2 is μ exp(S/k_B) / |∂H/∂z| dφ.
    fn at(angle: f64) -> Vector3<f64> {
        let mut z = 0.1_f64;
        for _ in 0..30 {
            let r = (1.0 - z * z).sqrt();
            let n = vector![r * angle.cos(), r * angle.sin(), z];
            z -= (cubic(&n) - 0.2) / slope(&n);
        }
        let r = (1.0 - z * z).sqrt();
        vector![r * angle.cos(), r * angle.sin(), z]
    }
    let curve = Curve::new(at, |n| n.y.atan2(n.x));
    let f: &Function = &((|n: &Vector3<f64>| 0.5 * n.x + 0.3 * n.y * n.z) as Function);
    let law = |strength: f64| exact(at, |n| (f(n) / k_b + strength * n.x).exp() / slope(n), f);
    let problem = "curve on S², energy of degree 3: law of S";
    let system = with_measure(0.0);
    let two = curve.errors((f, law(0.0)), [0.2, 0.1, 0.05], &|h, n, outcome| {
        step(&system, &NinomiyaVictoir(DormandPrince5).numbers(outcome.clone()), n, h)
    });
    assert_orders(problem, "NinomiyaVictoir(DormandPrince5)", &[order(&two)], 2);
    let one = curve.errors((f, law(0.0)), [0.1, 0.05, 0.025], &|h, n, outcome| {
        step(&system, &RandomFlow(DormandPrince5).numbers(outcome.clone()), n, h)
    });
    assert_orders(problem, "RandomFlow(DormandPrince5)", &[order(&one)], 1);
    let system = with_measure(0.3);
    let two = curve.errors((f, law(0.3)), [0.2, 0.1, 0.05], &|h, n, outcome| {
        step(&system, &NinomiyaVictoir(DormandPrince5).numbers(outcome.clone()), n, h)
    });
    let problem = "the same with the measure exp(0.3 n₁): law of S";
    assert_orders(problem, "NinomiyaVictoir(DormandPrince5)", &[order(&two)], 2);
}
