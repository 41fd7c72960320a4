//! The cost of a step against the dimension: a ring of anharmonic oscillators on Rⁿ.

use metriplectic::dynamics::bracket::EvenDimension;
use metriplectic::nalgebra::Const;
use metriplectic::prelude::*;

use crate::Row;

const STEP_SIZE: f64 = 0.05;

/// `Σ ½p² + ½q² + ⅛(q_{i+1} − q_i)⁴` with the first half of `x` for `q`.
fn ring<const N: usize>(x: &SVector<Real, N>) -> Real {
    let n = N / 2;
    let mut energy = x.norm_squared() * 0.5;
    for i in 0..n {
        energy += (x[(i + 1) % n] - x[i]).powi(4) * 0.125;
    }
    energy
}

fn row<const N: usize>() -> Row
where
    Const<N>: EvenDimension,
{
    let system = System::on(Euclidean::<N>)
        .bracket(Symplectic)
        .energy(ring::<N>)
        .build()
        .expect("a ring of oscillators is a Hamiltonian system");
    let start = SVector::<f64, N>::from_fn(|i, _| (1.0 + i as f64).sin());
    Row::new(format!("step/ring/{N}"), system, start, STEP_SIZE)
}

pub(crate) fn rows() -> Vec<Row> {
    vec![
        row::<2>(),
        row::<4>(),
        row::<6>(),
        row::<8>(),
        row::<10>(),
        row::<12>(),
        row::<16>(),
        row::<32>(),
    ]
}
