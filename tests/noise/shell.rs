//! Spherical harmonics on an ellipsoid.

use nalgebra::{DMatrix, DVector, Vector3};

use crate::operator::Basis;

/// Real spherical harmonics up to a degree of `n`, where `p_i = a_i n_i`.
pub(crate) struct Shell {
    degree: usize,
    axes: Vector3<f64>,
    nodes: Vec<Vector3<f64>>,
    weights: Vec<f64>,
    projection: DMatrix<f64>,
}

impl Shell {
    pub(crate) fn new(degree: usize, axes: Vector3<f64>) -> Self {
        let rows = degree + 2;
        let columns = 2 * degree + 3;
        let mut shell = Self {
            degree,
            axes,
            nodes: Vec::new(),
            weights: Vec::new(),
            projection: DMatrix::zeros(0, 0),
        };
        for (z, weight) in gauss_legendre(rows) {
            for k in 0..columns {
                let phi = std::f64::consts::TAU * (k as f64 + 0.5) / columns as f64;
                let r = (1.0 - z * z).sqrt();
                shell
                    .nodes
                    .push(Vector3::new(r * phi.cos(), r * phi.sin(), z).component_mul(&axes));
                shell.weights.push(weight / (2.0 * columns as f64));
            }
        }
        let functions = (degree + 1).pow(2);
        let mut projection = DMatrix::zeros(functions, shell.nodes.len());
        for (i, x) in shell.nodes.iter().enumerate() {
            projection.set_column(i, &(shell.at(x) * shell.weights[i]));
        }
        shell.projection = projection;
        shell
    }

    /// The mean of a function with a density over the sphere of directions.
    pub(crate) fn mean(
        &self,
        density: impl Fn(&Vector3<f64>) -> f64,
        f: impl Fn(&Vector3<f64>) -> f64,
    ) -> f64 {
        let sum = |g: &dyn Fn(&Vector3<f64>) -> f64| -> f64 {
            self.nodes.iter().zip(&self.weights).map(|(x, w)| w * g(x)).sum()
        };
        sum(&|x| density(x) * f(x)) / sum(&|x| density(x))
    }
}

impl Basis<Vector3<f64>> for Shell {
    fn nodes(&self) -> &[Vector3<f64>] {
        &self.nodes
    }

    /// Normalised over the mean of the sphere, by recursion.
    fn at(&self, x: &Vector3<f64>) -> DVector<f64> {
        let n = x.component_div(&self.axes).normalize();
        let (l_max, z) = (self.degree, n.z);
        let mut values = DVector::zeros((l_max + 1).pow(2));
        // The parts of (n_x + i n_y)^m, which hold the sine of the polar angle.
        let (mut cos, mut sin) = (1.0, 0.0);
        let mut diagonal = 1.0;
        for m in 0..=l_max {
            let (mut before, mut here) = (0.0, diagonal);
            for l in m..=l_max {
                let root = if m == 0 { 1.0 } else { 2.0_f64.sqrt() };
                values[l * l + l + m] = root * here * cos;
                if m > 0 {
                    values[l * l + l - m] = root * here * sin;
                }
                let [a, b] = [l + 1, l].map(|l| {
                    let (l, m) = (l as f64, m as f64);
                    ((l * l - m * m) / (4.0 * l * l - 1.0)).sqrt()
                });
                (before, here) = (here, (z * here - b * before) / a);
            }
            (cos, sin) = (cos * n.x - sin * n.y, cos * n.y + sin * n.x);
            let m = (m + 1) as f64;
            diagonal *= ((2.0 * m + 1.0) / (2.0 * m)).sqrt();
        }
        values
    }

    fn projection(&self) -> &DMatrix<f64> {
        &self.projection
    }
}

/// The nodes and weights of Gauss and Legendre, by Newton's method.
pub(crate) fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let node = |i: usize| {
        let mut z = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..50 {
            let (mut p, mut before) = (1.0, 0.0);
            for l in 0..n {
                let l = l as f64;
                (before, p) = (p, ((2.0 * l + 1.0) * z * p - l * before) / (l + 1.0));
            }
            slope = n as f64 * (z * p - before) / (z * z - 1.0);
            z -= p / slope;
        }
        (z, 2.0 / ((1.0 - z * z) * slope * slope))
    };
    (0..n).map(node).collect()
}

#[test]
fn harmonics_are_orthonormal() {
    let shell = Shell::new(8, Vector3::new(1.7, 1.0, 0.6));
    let gram = &shell.projection
        * DMatrix::from_fn(shell.nodes.len(), 81, |i, k| shell.at(&shell.nodes[i])[k]);
    assert!((gram - DMatrix::identity(81, 81)).amax() < 1e-13);
}
