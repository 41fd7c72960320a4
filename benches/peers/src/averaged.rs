//! The scheme of Andrews and Farrell (2025, arXiv:2511.23266) with one stage, on Rⁿ.
//!
//! `x' − x = h (Π w_H + K w_S)` with the covectors `w_F = ∫₀¹ dF(x + τ(x' − x)) dτ`. The tensors are written with these
//! covectors, so that `Π w_S = 0` and `K w_H = 0`. Then `ΔH = 0` and `ΔS = h K(w_S, w_S)`. The order is 2.

use crate::more::WarmOscillator;
use crate::relaxation::Path;
use crate::{Gas, Problem, RelaxingBody, cross};

/// A problem with an entropy, whose velocity is written with covectors.
pub trait TwoLaws<const N: usize>: Problem<N> {
    /// `dS`, in two parts of which each is a differential.
    fn entropy_parts(&self, x: &[f64; N]) -> [[f64; N]; 2];

    /// `Π w_H + K w_S` at a mean point, for covectors `w_H` and the parts of `w_S`.
    fn with_covectors(&self, x: &[f64; N], h: &[f64; N], s: &[[f64; N]; 2]) -> [f64; N];

    /// `dS`.
    fn entropy_gradient(&self, x: &[f64; N]) -> [f64; N] {
        let [a, b] = self.entropy_parts(x);
        std::array::from_fn(|i| a[i] + b[i])
    }
}

impl TwoLaws<3> for RelaxingBody {
    fn entropy_parts(&self, p: &[f64; 3]) -> [[f64; 3]; 2] {
        [*p, [0.0; 3]]
    }

    /// `w_S × w_H + w_H × (w_S × w_H)`.
    fn with_covectors(&self, _: &[f64; 3], h: &[f64; 3], [s, _]: &[[f64; 3]; 2]) -> [f64; 3] {
        let gyration = cross(s, h);
        let friction = cross(h, &gyration);
        std::array::from_fn(|i| gyration[i] + friction[i])
    }
}

impl TwoLaws<4> for Gas {
    fn entropy_parts(&self, &[q, _, left, right]: &[f64; 4]) -> [[f64; 4]; 2] {
        [[1.0 / q, 0.0, 1.5 / left, 0.0], [-1.0 / (2.0 - q), 0.0, 0.0, 1.5 / right]]
    }

    /// The pressures are `(∂S_i/∂q)/(∂S_i/∂U_i)`, and heat flows with `b = (w₄, −w₃)`.
    fn with_covectors(&self, _: &[f64; 4], h: &[f64; 4], [a, b]: &[[f64; 4]; 2]) -> [f64; 4] {
        let pressures = [a[0] / a[2], b[0] / b[3]];
        let heat = self.alpha * (h[3] * a[2] - h[2] * b[3]);
        let force = -h[0] + pressures[0] * h[2] + pressures[1] * h[3];
        [h[1], force, -pressures[0] * h[1] + h[3] * heat, -pressures[1] * h[1] - h[2] * heat]
    }
}

impl TwoLaws<3> for WarmOscillator {
    fn entropy_parts(&self, &[_, _, bath]: &[f64; 3]) -> [[f64; 3]; 2] {
        [[0.0, 0.0, 1.0 / bath], [0.0; 3]]
    }

    /// `K = γU b bᵀ`, `b = (0, w_U, −w_p)`.
    fn with_covectors(&self, x: &[f64; 3], h: &[f64; 3], [s, _]: &[[f64; 3]; 2]) -> [f64; 3] {
        let rate = crate::more::FRICTION * x[2] * (h[2] * s[1] - h[1] * s[2]);
        [h[1], -h[0] + rate * h[2], -rate * h[1]]
    }
}

/// The nodes and weights of Gauss with five points on [0, 1]: exact for polynomials of degree 9.
const RULE: [[f64; 2]; 5] = [
    [0.046_910_077_030_668_0, 0.118_463_442_528_094_5],
    [0.230_765_344_947_158_4, 0.239_314_335_249_683_2],
    [0.5, 0.284_444_444_444_444_4],
    [0.769_234_655_052_841_6, 0.239_314_335_249_683_2],
    [0.953_089_922_969_332, 0.118_463_442_528_094_5],
];

/// A run in steps of one size. The equation of a step is solved by repetition, to round-off. Each point of a quadrature is
/// an evaluation. `None` if a step does not converge.
pub fn run<P: TwoLaws<N>, const N: usize>(problem: &P, h: f64, steps: usize) -> Option<Path<N>> {
    let mut x = problem.start();
    let mut path = Path { states: vec![x], evaluations: 0, plain: 0 };
    let mut d = problem.velocity(&x).map(|v| h * v);
    for _ in 0..steps {
        let mut repetitions = 0;
        loop {
            let next = change(problem, &x, &d, h);
            path.evaluations += RULE.len() as u64;
            let off = (0..N).map(|i| (next[i] - d[i]).abs()).fold(0.0, f64::max);
            let size = (0..N).map(|i| x[i].abs() + next[i].abs()).fold(0.0, f64::max);
            d = next;
            repetitions += 1;
            if off <= 0.5 * f64::EPSILON * size {
                break;
            }
            // The last digit may go back and forth.
            if repetitions > 40 && off <= 4.0 * f64::EPSILON * size {
                break;
            }
            if repetitions > 200 || !off.is_finite() {
                return None;
            }
        }
        x = std::array::from_fn(|i| x[i] + d[i]);
        path.states.push(x);
    }
    Some(path)
}

/// `h (Π w_H + K w_S)` for the step from `x` to `x + d`.
fn change<P: TwoLaws<N>, const N: usize>(
    problem: &P,
    x: &[f64; N],
    d: &[f64; N],
    h: f64,
) -> [f64; N] {
    let (mut energy, mut entropy) = ([0.0; N], [[0.0; N]; 2]);
    for [node, weight] in RULE {
        let at = std::array::from_fn(|i| x[i] + node * d[i]);
        let (dh, ds) = (problem.gradient(&at), problem.entropy_parts(&at));
        for i in 0..N {
            energy[i] += weight * dh[i];
            entropy[0][i] += weight * ds[0][i];
            entropy[1][i] += weight * ds[1][i];
        }
    }
    let middle = std::array::from_fn(|i| x[i] + 0.5 * d[i]);
    problem.with_covectors(&middle, &energy, &entropy).map(|v| h * v)
}
