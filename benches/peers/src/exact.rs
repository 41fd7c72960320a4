//! The solution to twenty digits, by another method than any that is compared.

use twofloat::TwoFloat;

use crate::Problem;

/// Columns of the extrapolation.
const COLUMNS: usize = 10;

/// `x(time)` by the extrapolation of Gragg, Bulirsch and Stoer in double-double arithmetic, with
/// `steps` basic steps: `n = 2, 4, … 20` substeps of the midpoint rule, order 20.
pub fn flow<P: Problem<N>, const N: usize>(problem: &P, time: f64, steps: u32) -> [TwoFloat; N] {
    let h = TwoFloat::from(time) / TwoFloat::from(f64::from(steps));
    let start = problem.start().map(TwoFloat::from);
    (0..steps).fold(start, |x, _| step(problem, &x, h))
}

fn step<P: Problem<N>, const N: usize>(
    problem: &P,
    x: &[TwoFloat; N],
    h: TwoFloat,
) -> [TwoFloat; N] {
    let mut row: [[TwoFloat; N]; COLUMNS] = [*x; COLUMNS];
    for k in 0..COLUMNS {
        let mut value = midpoint(problem, x, h, 2 * (k as u32 + 1));
        // Aitken and Neville in h²: T_{k,j+1} = T_{k,j} + (T_{k,j} − T_{k−1,j})/((n_k/n_{k−j−1})² − 1).
        for j in 0..k {
            let ratio = TwoFloat::from((k + 1) as f64) / TwoFloat::from((k - j) as f64);
            let before = std::mem::replace(&mut row[j], value);
            let weight = TwoFloat::from(1.0) / (ratio * ratio - TwoFloat::from(1.0));
            value = std::array::from_fn(|i| value[i] + (value[i] - before[i]) * weight);
        }
        row[k] = value;
    }
    row[COLUMNS - 1]
}

/// `n` steps of the explicit midpoint rule, begun by Euler's.
fn midpoint<P: Problem<N>, const N: usize>(
    problem: &P,
    x: &[TwoFloat; N],
    h: TwoFloat,
    n: u32,
) -> [TwoFloat; N] {
    let part = h / TwoFloat::from(f64::from(n));
    let moved = |x: &[TwoFloat; N], v: &[TwoFloat; N], h: TwoFloat| -> [TwoFloat; N] {
        std::array::from_fn(|i| x[i] + v[i] * h)
    };
    let (mut last, mut now) = (*x, moved(x, &problem.velocity(x), part));
    for _ in 1..n {
        let next = moved(&last, &problem.velocity(&now), part * TwoFloat::from(2.0));
        (last, now) = (now, next);
    }
    now
}
