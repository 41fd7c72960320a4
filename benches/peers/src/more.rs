//! Two more problems, for the figure of work against precision: a Hamiltonian one in six dimensions with two Casimirs,
//! and friction with heat.

use std::cell::Cell;

use metriplectic::prelude::*;

use crate::ours::{How, Ours, Ran, ran};
use crate::{Number, Problem, cross, norm};

/// A heavy top on se(3)*, `x = (M, Γ)`: `M' = M × Ω + Γ × χ`, `Γ' = Γ × Ω` with `Ω = M/I` and
/// `H = ½ M·Ω + Γ·χ`.
#[derive(Clone, Copy, Debug)]
pub struct HeavyTop;

const MOMENTS: [f64; 3] = [1.0, 1.5, 2.0];
const CENTRE: [f64; 3] = [0.2, 0.0, 0.7];

impl Problem<6> for HeavyTop {
    fn name(&self) -> String {
        "heavy top, se(3)*".into()
    }

    fn start(&self) -> [f64; 6] {
        [0.4, -0.7, 0.9, 0.3, 0.5, 0.8]
    }

    fn velocity<T: Number>(&self, &[a, b, c, d, e, f]: &[T; 6]) -> [T; 6] {
        let (momentum, gravity) = ([a, b, c], [d, e, f]);
        let omega = std::array::from_fn(|i| momentum[i] / T::from(MOMENTS[i]));
        let [turn, pull] = [cross(&momentum, &omega), cross(&gravity, &CENTRE.map(T::from))];
        let [p, q, r] = cross(&gravity, &omega);
        [turn[0] + pull[0], turn[1] + pull[1], turn[2] + pull[2], p, q, r]
    }

    fn energy(&self, x: &[f64; 6]) -> f64 {
        (0..3).map(|i| 0.5 * x[i] * x[i] / MOMENTS[i] + x[i + 3] * CENTRE[i]).sum()
    }

    fn gradient(&self, x: &[f64; 6]) -> [f64; 6] {
        std::array::from_fn(|i| if i < 3 { x[i] / MOMENTS[i] } else { CENTRE[i - 3] })
    }

    fn entropy(&self, _: &[f64; 6]) -> Option<f64> {
        None
    }

    fn entropy_scale(&self, _: &[f64; 6]) -> f64 {
        0.0
    }
}

impl Ours<6> for HeavyTop {
    fn run(&self, how: How) -> Result<Ran<6>, String> {
        let calls = Cell::new(0);
        let [a, b, c] = MOMENTS.map(|moment| 0.5 / moment);
        let energy = |x: &SVector<Real, 6>| -> Real {
            calls.set(calls.get() + 1);
            x[0] * x[0] * a
                + x[1] * x[1] * b
                + x[2] * x[2] * c
                + x[3] * CENTRE[0]
                + x[5] * CENTRE[2]
        };
        let top = System::on(LieDual::se3()).energy(energy).build();
        ran(&top.map_err(|error| error.to_string())?, Problem::start(self).into(), how, &calls)
    }
}

/// An oscillator whose friction warms a bath, `x = (q, p, U)`: `q' = p`, `p' = −q − q³ − γp`, `U' = γp²`, with
/// `H = ½p² + ½q² + ¼q⁴ + U` and `S = ln U`.
#[derive(Clone, Copy, Debug)]
pub struct WarmOscillator;

pub(crate) const FRICTION: f64 = 0.05;

impl Problem<3> for WarmOscillator {
    fn name(&self) -> String {
        "oscillator with friction and heat".into()
    }

    fn start(&self) -> [f64; 3] {
        [1.0, 0.5, 2.0]
    }

    fn velocity<T: Number>(&self, &[q, p, _]: &[T; 3]) -> [T; 3] {
        let friction = T::from(FRICTION) * p;
        [p, -q - q * q * q - friction, friction * p]
    }

    fn energy(&self, &[q, p, bath]: &[f64; 3]) -> f64 {
        0.5 * (p * p + q * q) + 0.25 * q * q * q * q + bath
    }

    fn gradient(&self, &[q, p, _]: &[f64; 3]) -> [f64; 3] {
        [q + q * q * q, p, 1.0]
    }

    fn entropy(&self, &[_, _, bath]: &[f64; 3]) -> Option<f64> {
        Some(bath.ln())
    }

    fn entropy_scale(&self, x: &[f64; 3]) -> f64 {
        norm(x) / x[2]
    }
}

impl Ours<3> for WarmOscillator {
    fn run(&self, how: How) -> Result<Ran<3>, String> {
        let calls = Cell::new(0);
        let energy = |x: &Vector3<Real>| {
            calls.set(calls.get() + 1);
            let square = x.x * x.x;
            (x.y * x.y + square) * 0.5 + square * square * 0.25 + x.z
        };
        // K = γU b bᵀ with b = (0, w_U, −w_p), which annihilates w.
        let friction = |x: &Vector3<Real>, w: &Vector3<Real>| {
            let (o, rate) = (Real::from(0.0), x.z * FRICTION);
            let [one, both, two] = [w.z * w.z * rate, -w.y * w.z * rate, w.y * w.y * rate];
            Matrix3::new(o, o, o, o, one, both, o, both, two)
        };
        let system = System::on(Euclidean::<3>)
            .bracket(
                Poisson::constant(Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
                    .map_err(|error| error.to_string())?,
            )
            .dissipation(FieldDissipation(friction))
            .energy(energy)
            .entropy(|x: &Vector3<Real>| x.z.ln())
            .build();
        ran(&system.map_err(|error| error.to_string())?, Problem::start(self).into(), how, &calls)
    }
}
