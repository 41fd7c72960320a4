//! Relaxation Runge-Kutta methods: each step of Dormand and Prince's method of order 5 is scaled until a law holds.
//!
//! With one factor, `x' = x + γd` with `H(x') = H(x)` and the time `γh` (Ketcheson 2019). With two directions,
//! `x' = x + γ₁d₁ + γ₂d₂` with `H(x') = H(x)` and `S(x') − S(x) = h Σ_k γ_k Σ_i b_{ki} σ(y_i)`, where `σ` is the production
//! at a stage (Biswas and Ketcheson 2023). The second direction is the solution of order 2 of the first two stages.

use crate::averaged::TwoLaws;

/// Which laws the factors are solved for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Relaxed {
    /// None: the method itself.
    Nothing,
    /// The energy.
    Energy,
    /// The energy and the balance of the entropy.
    Both,
}

/// A run: the states after all accepted steps, the right-hand sides evaluated, and the steps without a solution for
/// the factors, which were taken as they are.
#[derive(Clone, Debug)]
pub struct Path<const N: usize> {
    /// The states, the start first.
    pub states: Vec<[f64; N]>,
    /// The right-hand sides.
    pub evaluations: u64,
    /// The steps that are not relaxed.
    pub plain: usize,
}

const STAGES: usize = 6;
const NODES: [[f64; 5]; STAGES] = [
    [0.0; 5],
    [0.2, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
];
const WEIGHTS: [f64; STAGES] =
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0];
/// Those of order 2, from the nodes 0 and 1/5.
const SECOND: [f64; STAGES] = [-1.5, 2.5, 0.0, 0.0, 0.0, 0.0];
/// Those of the solution of order 5 less those of order 4; the last belongs to the velocity at the end.
const DIFFERENCE: [f64; 7] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339_200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    (0..N).map(|i| a[i] * b[i]).sum()
}

fn combined<const N: usize>(weights: &[f64], k: &[[f64; N]]) -> [f64; N] {
    std::array::from_fn(|i| weights.iter().zip(k).map(|(b, k)| b * k[i]).sum())
}

fn moved<const N: usize>(x: &[f64; N], factors: [f64; 2], d: &[[f64; N]; 2]) -> [f64; N] {
    std::array::from_fn(|i| x[i] + factors[0] * d[0][i] + factors[1] * d[1][i])
}

/// A run from the start to `time`, with both tolerances alike.
pub fn run<P: TwoLaws<N>, const N: usize>(
    problem: &P,
    time: f64,
    tolerance: f64,
    relaxed: Relaxed,
) -> Path<N> {
    let (mut x, mut t, mut h) = (problem.start(), 0.0, 1e-3_f64);
    let energy = problem.energy(&x);
    let mut path = Path { states: vec![x], evaluations: 1, plain: 0 };
    let mut first = problem.velocity(&x);
    while time - t > 1e-12 * time {
        let whole = h.min(time - t);
        let mut y = [x; STAGES];
        let mut k = [first; STAGES];
        for i in 1..STAGES {
            let sum = combined(&NODES[i][..i.min(5)], &k);
            y[i] = std::array::from_fn(|j| x[j] + whole * sum[j]);
            k[i] = problem.velocity(&y[i]);
        }
        let d = [&WEIGHTS, &SECOND].map(|b| combined(b, &k).map(|v| whole * v));
        let end = moved(&x, [1.0, 0.0], &d);
        let last = problem.velocity(&end);
        path.evaluations += 6;
        let off = combined(&DIFFERENCE, &[k[0], k[1], k[2], k[3], k[4], k[5], last]);
        let scaled = |i: usize| whole * off[i] / (tolerance * (1.0 + x[i].abs().max(end[i].abs())));
        let error = ((0..N).map(|i| scaled(i).powi(2)).sum::<f64>() / N as f64).sqrt();
        h = whole * (0.9 * error.max(1e-10).powf(-0.2)).clamp(0.2, 5.0);
        if error > 1.0 || !error.is_finite() {
            continue;
        }
        // The last step to the end of the run is projected in nothing but its length, as the others.
        let factors = match relaxed {
            Relaxed::Nothing => Some([1.0, 0.0]),
            Relaxed::Energy => energy_factor(problem, &x, &d, energy),
            Relaxed::Both => {
                let production = [&WEIGHTS, &SECOND].map(|b| {
                    let sigma = |i: usize| dot(&problem.entropy_gradient(&y[i]), &k[i]);
                    whole * (0..STAGES).map(|i| b[i] * sigma(i)).sum::<f64>()
                });
                both_factors(problem, &x, &d, energy, production)
            }
        };
        path.plain += usize::from(factors.is_none());
        let factors = factors.unwrap_or([1.0, 0.0]);
        x = moved(&x, factors, &d);
        t += whole * (factors[0] + factors[1]);
        first = if relaxed == Relaxed::Nothing { last } else { problem.velocity(&x) };
        path.evaluations += u64::from(relaxed != Relaxed::Nothing);
        path.states.push(x);
    }
    path
}

/// How far a factor may be from that of the method.
const FARTHEST: f64 = 0.5;

/// Whether both are numbers near those of the method.
fn is_near([first, second]: [f64; 2]) -> bool {
    (first - 1.0).abs() < FARTHEST && second.abs() < FARTHEST
}

/// `γ` with `H(x + γd) = H₀`, near 1, by Newton's method.
fn energy_factor<P: TwoLaws<N>, const N: usize>(
    problem: &P,
    x: &[f64; N],
    d: &[[f64; N]; 2],
    energy: f64,
) -> Option<[f64; 2]> {
    let mut factors = [1.0, 0.0];
    for _ in 0..20 {
        let end = moved(x, factors, d);
        let off = problem.energy(&end) - energy;
        if off.abs() <= 4.0 * f64::EPSILON * energy.abs() {
            return Some(factors);
        }
        factors[0] -= off / dot(&problem.gradient(&end), &d[0]);
        if !is_near(factors) {
            return None;
        }
    }
    None
}

/// `γ₁` near 1 and `γ₂` near 0 for both laws, by Newton's method.
fn both_factors<P: TwoLaws<N>, const N: usize>(
    problem: &P,
    x: &[f64; N],
    d: &[[f64; N]; 2],
    energy: f64,
    production: [f64; 2],
) -> Option<[f64; 2]> {
    let before = problem.entropy(x)?;
    let mut factors = [1.0, 0.0];
    for _ in 0..20 {
        let end = moved(x, factors, d);
        let produced = factors[0] * production[0] + factors[1] * production[1];
        let off = [problem.energy(&end) - energy, problem.entropy(&end)? - before - produced];
        let round_off = 4.0 * f64::EPSILON;
        if off[0].abs() <= round_off * energy.abs()
            && off[1].abs() <= round_off * before.abs().max(1.0)
        {
            return Some(factors);
        }
        let (dh, ds) = (problem.gradient(&end), problem.entropy_gradient(&end));
        let [a, b] = d.map(|d| dot(&dh, &d));
        let [c, e] = [0, 1].map(|k| dot(&ds, &d[k]) - production[k]);
        let determinant = a * e - b * c;
        factors[0] -= (off[0] * e - off[1] * b) / determinant;
        factors[1] -= (off[1] * a - off[0] * c) / determinant;
        if !is_near(factors) {
            return None;
        }
    }
    None
}
