//! The exact scheme on R³ by hand, for any two fields with derivatives on paper: the denominator that knows
//! nothing of the fields.

use metriplectic::prelude::*;

use crate::Step;
use crate::stable_gradient::Displacements;

/// A function of three variables with its gradient.
pub(crate) trait Field: Copy {
    fn value(&self, x: &Vector3<f64>) -> f64;
    fn gradient(&self, x: &Vector3<f64>) -> Vector3<f64>;
}

/// The scheme on so(3)*: Gonzalez' gradients of both fields, `Π̃ = P ẑ Pᵀ` with `P` off `w_S`, and `K` that
/// annihilates `w_H`. The inverse of the Jacobian is kept from the first step, by differences, and corrected by
/// Broyden's formula.
#[derive(Clone)]
pub(crate) struct Generic<H, S> {
    energy: H,
    entropy: S,
    displacements: Displacements<3>,
    inverse: Option<Matrix3<f64>>,
    iterations: usize,
}

impl<H: Field, S: Field> Generic<H, S> {
    pub(crate) const fn new(energy: H, entropy: S) -> Self {
        Self { energy, entropy, displacements: Displacements::new(), inverse: None, iterations: 0 }
    }
}

/// Where a step starts.
struct Start {
    x: Vector3<f64>,
    h: f64,
    energy: f64,
    entropy: f64,
}

/// Gonzalez' discrete gradient on the straight step `d` through `z`, with the change of the field.
fn gonzalez(f: &impl Field, z: &Vector3<f64>, d: &Vector3<f64>, change: f64) -> Vector3<f64> {
    let df = f.gradient(z);
    df + d * ((change - df.dot(d)) / d.norm_squared())
}

impl<H: Field, S: Field> Generic<H, S> {
    fn residual(&self, start: &Start, d: &Vector3<f64>) -> Vector3<f64> {
        let (z, end) = (start.x + d * 0.5, start.x + d);
        let w = gonzalez(&self.energy, &z, d, self.energy.value(&end) - start.energy);
        let s = gonzalez(&self.entropy, &z, d, self.entropy.value(&end) - start.entropy);
        let fraction = s.norm_squared().recip();
        let turn = z.cross(&(w - s * (s.dot(&w) * fraction)));
        let reversible = turn - s * (s.dot(&turn) * fraction);
        d - (reversible + s * w.norm_squared() - w * w.dot(&s)) * start.h
    }

    /// The inverse of the Jacobian by central differences, once in a run.
    #[cold]
    fn differences(&self, start: &Start, d: &Vector3<f64>) -> Matrix3<f64> {
        let step = 1e-4 * d.norm();
        let column = |k| {
            let e = Vector3::ith(k, step);
            (self.residual(start, &(d + e)) - self.residual(start, &(d - e))) / (2.0 * step)
        };
        let jacobian = Matrix3::from_columns(&[column(0), column(1), column(2)]);
        jacobian.try_inverse().unwrap_or_else(Matrix3::identity)
    }
}

impl<H: Field, S: Field> Step for Generic<H, S> {
    type Point = Vector3<f64>;

    fn step(&mut self, x: &Vector3<f64>, h: f64) -> Vector3<f64> {
        let start =
            Start { x: *x, h, energy: self.energy.value(x), entropy: self.entropy.value(x) };
        let mut d = self.displacements.extrapolate().unwrap_or_else(|| {
            let (w, s) = (self.energy.gradient(x), self.entropy.gradient(x));
            (x.cross(&w) + s * w.norm_squared() - w * w.dot(&s)) * h
        });
        let mut inverse = self.inverse.unwrap_or_else(|| self.differences(&start, &d));
        // The rounding of the terms of the residual, as in the step with derivatives on paper.
        let floor = f64::EPSILON * (4.0 * h * x.norm_squared() + d.norm());
        let mut residual = self.residual(&start, &d);
        // A residual that no longer falls near its rounding is solved.
        let (mut size, mut contraction) = (residual.norm(), 0.0);
        let mut first = true;
        for _ in 0..30 {
            if size <= 0.1 * floor || contraction > 0.5 && size <= 10.0 * floor {
                break;
            }
            let correction = inverse * residual;
            d -= correction;
            self.iterations += 1;
            if size <= floor || !first && contraction * size <= 0.01 * floor {
                break;
            }
            first = false;
            residual = self.residual(&start, &d);
            (contraction, size) = (residual.norm() / size, residual.norm());
            if size > 1e3 * floor {
                // Broyden's update with y = J(−δ), from J⁻¹y = J⁻¹r' − δ.
                let (taken, predicted) = (-correction, inverse * residual - correction);
                let along = taken.dot(&predicted);
                inverse += (taken - predicted) * ((taken.transpose() * inverse) / along);
            }
        }
        self.inverse = Some(inverse);
        self.displacements.note(d);
        x + d
    }

    fn iterations(&self) -> usize {
        self.iterations
    }

    fn entries(x: &Vector3<f64>) -> Vec<f64> {
        x.as_slice().to_vec()
    }
}
