//! The problems that the solvers are compared on, as one would write them for any of them: the
//! right-hand side by hand, in plain arrays.

use std::ops::{Add, Div, Mul, Neg, Sub};

pub mod averaged;
pub mod exact;
pub mod more;
pub mod ours;
pub mod relaxation;
#[cfg(feature = "solvers")]
pub mod rivals;

/// A number that a right-hand side is evaluated with: `f64`, or twice as long for the reference.
pub trait Number:
    Copy
    + From<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
}

impl Number for f64 {}

/// An initial value problem with an energy and, perhaps, an entropy.
pub trait Problem<const N: usize>: Clone {
    /// What it is.
    fn name(&self) -> String;

    /// Where it starts.
    fn start(&self) -> [f64; N];

    /// The right-hand side of `x' = f(x)`.
    fn velocity<T: Number>(&self, x: &[T; N]) -> [T; N];

    /// `H`.
    fn energy(&self, x: &[f64; N]) -> f64;

    /// `dH`.
    fn gradient(&self, x: &[f64; N]) -> [f64; N];

    /// `S`; `None` for a Hamiltonian system.
    fn entropy(&self, x: &[f64; N]) -> Option<f64>;

    /// `|dS||x|`, which bounds the round-off of `S`.
    fn entropy_scale(&self, x: &[f64; N]) -> f64;

    /// Whether the state is a unit vector.
    fn on_sphere(&self) -> bool {
        false
    }
}

/// `|x|`.
#[must_use]
pub fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// A rigid body with friction that keeps its energy (Bloch, Farré Puiggalí, Martín de Diego 2024, §5):
/// `p' = p × ω + ω × (p × ω)`, with `ωᵢ = pᵢ/Iᵢ` and `S = |p|²/2`.
#[derive(Clone, Copy, Debug)]
pub struct RelaxingBody;

const INERTIA: [f64; 3] = [10.0, 5.0, 1.0];

fn cross<T: Number>(a: &[T; 3], b: &[T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

impl Problem<3> for RelaxingBody {
    fn name(&self) -> String {
        "relaxing rigid body, so(3)*".into()
    }

    fn start(&self) -> [f64; 3] {
        [0.001, -1.0, 0.001]
    }

    fn velocity<T: Number>(&self, p: &[T; 3]) -> [T; 3] {
        let omega = std::array::from_fn(|i| p[i] / T::from(INERTIA[i]));
        // (ω·ω) p − (ω·p) ω = ω × (p × ω)
        let gyration = cross(p, &omega);
        let friction = cross(&omega, &gyration);
        std::array::from_fn(|i| gyration[i] + friction[i])
    }

    fn energy(&self, p: &[f64; 3]) -> f64 {
        (0..3).map(|i| p[i] * p[i] / INERTIA[i]).sum::<f64>() * 0.5
    }

    fn gradient(&self, p: &[f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| p[i] / INERTIA[i])
    }

    fn entropy(&self, p: &[f64; 3]) -> Option<f64> {
        Some(0.5 * (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]))
    }

    fn entropy_scale(&self, p: &[f64; 3]) -> f64 {
        norm(p).powi(2)
    }
}

/// The spinning top (Celledoni, Eidnes, Owren, Ringholm 2019, example 1): `x' = x × dH` on the unit
/// sphere, `H = ½ Σ Dᵢ(xᵢ² + ⅔xᵢ³)`.
#[derive(Clone, Copy, Debug)]
pub struct SpinningTop;

/// Its `D`.
pub const WEIGHTS: [f64; 3] = [1.0, 0.5, 0.25];

impl Problem<3> for SpinningTop {
    fn name(&self) -> String {
        "spinning top, S²".into()
    }

    fn start(&self) -> [f64; 3] {
        [3.0_f64.sqrt().recip(); 3]
    }

    fn velocity<T: Number>(&self, x: &[T; 3]) -> [T; 3] {
        let slope = std::array::from_fn(|i| T::from(WEIGHTS[i]) * x[i] * (T::from(1.0) + x[i]));
        cross(x, &slope)
    }

    fn energy(&self, x: &[f64; 3]) -> f64 {
        let term = |i: usize| WEIGHTS[i] * (x[i] * x[i] + 2.0 / 3.0 * x[i].powi(3));
        (0..3).map(term).sum::<f64>() * 0.5
    }

    fn gradient(&self, x: &[f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| WEIGHTS[i] * x[i] * (1.0 + x[i]))
    }

    fn entropy(&self, _: &[f64; 3]) -> Option<f64> {
        None
    }

    fn entropy_scale(&self, _: &[f64; 3]) -> f64 {
        0.0
    }

    fn on_sphere(&self) -> bool {
        true
    }
}

/// Two gas containers with a moving wall between them (Shang and Öttinger 2020), `x = (q, p, U₁, U₂)`;
/// heat leaks through the wall at the rate `alpha`.
#[derive(Clone, Copy, Debug)]
pub struct Gas {
    /// `α`.
    pub alpha: f64,
}

impl Problem<4> for Gas {
    fn name(&self) -> String {
        format!("gas containers, α = {}", self.alpha)
    }

    fn start(&self) -> [f64; 4] {
        [1.0, 2.0, 2.0, 2.0]
    }

    fn velocity<T: Number>(&self, &[q, p, left, right]: &[T; 4]) -> [T; 4] {
        let fraction = T::from(2.0) / T::from(3.0);
        let pressures = [fraction * left / q, fraction * right / (T::from(2.0) - q)];
        let leak = T::from(self.alpha) / fraction * (T::from(1.0) / left - T::from(1.0) / right);
        [p, pressures[0] - pressures[1], -pressures[0] * p + leak, pressures[1] * p - leak]
    }

    fn energy(&self, &[_, p, left, right]: &[f64; 4]) -> f64 {
        0.5 * p * p + left + right
    }

    fn gradient(&self, &[_, p, _, _]: &[f64; 4]) -> [f64; 4] {
        [0.0, p, 1.0, 1.0]
    }

    fn entropy(&self, &[q, _, left, right]: &[f64; 4]) -> Option<f64> {
        Some((q * (2.0 - q)).ln() + 1.5 * (left * right).ln())
    }

    fn entropy_scale(&self, x: &[f64; 4]) -> f64 {
        let &[q, _, left, right] = x;
        norm(&[1.0 / q - 1.0 / (2.0 - q), 1.5 / left, 1.5 / right]) * norm(x)
    }
}
