//! Instructions of a step against the number of variables, beside the same step by hand with both laws: `just peers`.
//!
//! A ring of `n/3` oscillators with heat, `H = Σ ½p² + ½q² + ⅛(q_{i+1} − q_i)⁴ + exp(s)` and `S = Σ s`, with the canonical bracket and the
//! friction `K dS = |dH|² dS − dH (dH·dS)`. From nine variables on the fields of the library are recorded. By hand, derivatives are
//! written in plain numbers, stages of implicit methods are found by iteration from their extrapolation, and each end is moved onto
//! the energy and onto the entropy of its production by Newton's method. A count is the difference of two runs in callgrind.

use std::hint::black_box;

use metriplectic::dynamics::bracket::Bracket;
use metriplectic::integrators::{Element, Flow, StepStart};
use metriplectic::prelude::*;
use metriplectic_studies::Table;

#[path = "callgrind.rs"]
mod callgrind;

const STEP_SIZE: f64 = 0.001;
const RUNS: [usize; 2] = [20, 60];
const SIZES: [usize; 7] = [3, 6, 12, 24, 48, 96, 192];
const METHODS: [&str; 3] = ["DormandPrince8", "WeylMidpoint", "Gauss::<3>"];

type State<const N: usize> = [f64; N];

fn start<const N: usize>() -> State<N> {
    let wave = |i: usize| {
        if i < 2 * N / 3 { 0.5 * (1.0 + i as f64).sin() } else { 0.1 * (i as f64).cos() }
    };
    std::array::from_fn(wave)
}

/// The energy of the ring, for fields that are recorded and for closures.
fn energy<D: Scalar, const N: usize>(x: &SVector<D, N>) -> D {
    let sites = N / 3;
    (0..sites).fold(D::zero(), |sum, i| {
        let (q, p, s) = (x[i], x[sites + i], x[2 * sites + i]);
        let bond = (x[(i + 1) % sites] - q).powi(2);
        sum + p * p * 0.5 + q * q * 0.5 + bond * bond * 0.125 + s.exp()
    })
}

fn entropy<D: Scalar, const N: usize>(x: &SVector<D, N>) -> D {
    (2 * N / 3..N).fold(D::zero(), |sum, i| sum + x[i])
}

fn bracket<const N: usize>() -> impl Bracket<Euclidean<N>, Canonical> {
    let sites = N / 3;
    let pair = |i: usize, j: usize| f64::from(u8::from(i < sites && j == sites + i));
    Poisson::constant(SMatrix::<f64, N, N>::from_fn(|i, j| pair(i, j) - pair(j, i)))
        .expect("it is skew")
}

/// Steps by the library.
fn ours<const N: usize>(method: &str, steps: usize) -> State<N> {
    let (space, x) = (Euclidean::<N>, SVector::from(start::<N>()));
    let parts = System::on(space).bracket(bracket::<N>());
    let energy = field!(|x: &SVector<Real, N>| energy(x));
    let entropy = field!(|x: &SVector<Real, N>| entropy(x));
    let system = parts
        .energy(energy.recorded(&space, &x).expect("it does not branch"))
        .entropy(entropy.recorded(&space, &x).expect("it does not branch"))
        .build()
        .expect("it is a system");
    match method {
        "DormandPrince8" => steps_of(&DormandPrince8, &system, x, steps),
        "WeylMidpoint" => steps_of(&Scheme::new(WeylMidpoint), &system, x, steps),
        _ => steps_of(&Gauss::<3>, &system, x, steps),
    }
    .into()
}

/// Steps without the checks of a run, which would take more than all steps.
fn steps_of<F: Flow, M: Stepper<F>>(
    method: &M,
    flow: &F,
    mut x: Element<F>,
    steps: usize,
) -> Element<F> {
    flow.room(&mut || {
        let (mut memory, mut values) = (Default::default(), flow.laws(&x));
        for _ in 0..steps {
            let reference = values.clone();
            let start = StepStart { flow, x: &x, time: 0.0, values, reference, allowed: None };
            let taken = method.step(&start, STEP_SIZE, &mut memory).expect("a step is taken");
            (x, values) = (taken.x, taken.values);
        }
    });
    x
}

/// A law and its gradient.
type Law<const N: usize> = (f64, State<N>);

#[inline(always)]
fn laws<const N: usize>(x: &State<N>) -> [Law<N>; 2] {
    let sites = N / 3;
    let (mut energy, mut dh, mut entropy, mut ds) = (0.0, [0.0; N], 0.0, [0.0; N]);
    for i in 0..sites {
        let j = if i + 1 == sites { 0 } else { i + 1 };
        let (q, p, s) = (x[i], x[sites + i], x[2 * sites + i]);
        let (r, heat) = (x[j] - q, s.exp());
        let force = 0.5 * r * r * r;
        energy += p * p * 0.5 + q * q * 0.5 + r * r * (r * r) * 0.125 + heat;
        entropy += s;
        dh[i] += q - force;
        dh[j] += force;
        (dh[sites + i], dh[2 * sites + i], ds[2 * sites + i]) = (p, heat, 1.0);
    }
    [(energy, dh), (entropy, ds)]
}

fn dot<const N: usize>(a: &State<N>, b: &State<N>) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The velocity, and the production of entropy.
#[inline(always)]
fn velocity<const N: usize>(x: &State<N>) -> (State<N>, f64) {
    let sites = N / 3;
    let [(_, dh), (_, ds)] = laws(x);
    let (size, heat) = (dot(&dh, &dh), dot(&dh, &ds));
    let v = std::array::from_fn(|i| {
        let turned = if i < sites {
            dh[sites + i]
        } else if i < 2 * sites {
            -dh[i - sites]
        } else {
            size
        };
        turned - dh[i] * heat
    });
    (v, size * sites as f64 - heat * heat)
}

/// Moves a state along both gradients to the energy and the entropy given, by Newton's method.
fn projected<const N: usize>(mut x: State<N>, goals: [f64; 2]) -> State<N> {
    for _ in 0..5 {
        let [(h, a), (s, b)] = laws(&x);
        let [r, q] = [goals[0] - h, goals[1] - s];
        if r.abs() <= 4.0 * f64::EPSILON * h.abs() && q.abs() <= 4.0 * f64::EPSILON * N as f64 {
            break;
        }
        let (aa, ab, bb) = (dot(&a, &a), dot(&a, &b), dot(&b, &b));
        let det = aa * bb - ab * ab;
        let (u, v) = ((r * bb - q * ab) / det, (q * aa - r * ab) / det);
        x = std::array::from_fn(|i| x[i] + u * a[i] + v * b[i]);
    }
    x
}

/// `x + h Σ_j w_j k_j`.
#[inline(always)]
fn stage<const N: usize>(x: &State<N>, h: f64, weights: &[f64], k: &[State<N>]) -> State<N> {
    let mut y = *x;
    for (w, k) in weights.iter().zip(k).filter(|(w, _)| **w != 0.0) {
        for i in 0..N {
            y[i] += h * w * k[i];
        }
    }
    y
}

/// An explicit or implicit Runge-Kutta method; the stages of an implicit one are found by iteration.
struct ByHand<const M: usize> {
    rows: [[f64; M]; M],
    ends: [f64; M],
    /// The stages of the next step as combinations of those of this one; `None` for an explicit method.
    ahead: Option<[[f64; M]; M]>,
}

impl<const M: usize> ByHand<M> {
    fn run<const N: usize>(&self, steps: usize) -> State<N> {
        let (mut x, mut k) = (start::<N>(), [velocity(&start::<N>()).0; M]);
        let [(energy, _), (mut entropy, _)] = laws(&x);
        for _ in 0..steps {
            let production = match &self.ahead {
                None => self.explicit(&x, &mut k),
                Some(ahead) => self.implicit(ahead, &x, &mut k),
            };
            entropy += STEP_SIZE * production;
            x = black_box(projected(stage(&x, STEP_SIZE, &self.ends, &k), [energy, entropy]));
        }
        x
    }

    fn explicit<const N: usize>(&self, x: &State<N>, k: &mut [State<N>; M]) -> f64 {
        (0..M).map(|i| self.next(i, x, k).1).sum()
    }

    /// Computes a stage, and returns its change and its part of the production.
    #[inline(always)]
    fn next<const N: usize>(&self, i: usize, x: &State<N>, k: &mut [State<N>; M]) -> (f64, f64) {
        let (v, production) = velocity(&stage(x, STEP_SIZE, &self.rows[i], &*k));
        let change = v.iter().zip(&k[i]).map(|(v, k)| (v - k).abs()).fold(0.0, f64::max);
        k[i] = v;
        (change, self.ends[i] * production)
    }

    fn implicit<const N: usize>(
        &self,
        ahead: &[[f64; M]; M],
        x: &State<N>,
        k: &mut [State<N>; M],
    ) -> f64 {
        let before = *k;
        for (k, row) in k.iter_mut().zip(ahead) {
            *k = stage(&[0.0; N], 1.0, row, &before);
        }
        let mut production = f64::NAN;
        for _ in 0..50 {
            let stages = (0..M).map(|i| self.next(i, x, k));
            let (change, sum) = stages.fold((0.0f64, 0.0), |(a, b), (c, d)| (a.max(c), b + d));
            production = sum;
            if STEP_SIZE * change <= 1e-15 {
                break;
            }
        }
        production
    }
}

fn by_hand<const N: usize>(method: &str, steps: usize) -> State<N> {
    match method {
        "DormandPrince8" => {
            let (mut rows, mut ends) = ([[0.0; 12]; 12], [0.0; 12]);
            for (row, of) in rows[1..].iter_mut().zip(ROWS) {
                of.iter().for_each(|&(j, w)| row[j] = w);
            }
            ENDS.iter().for_each(|&(j, w)| ends[j] = w);
            ByHand { rows, ends, ahead: None }.run(steps)
        }
        "WeylMidpoint" => ByHand { rows: [[0.5]], ends: [1.0], ahead: Some([[1.0]]) }.run(steps),
        _ => gauss().run(steps),
    }
}

/// The method of Gauss with three stages.
fn gauss() -> ByHand<3> {
    let r = 15.0f64.sqrt();
    let rows = [
        [5.0 / 36.0, 2.0 / 9.0 - r / 15.0, 5.0 / 36.0 - r / 30.0],
        [5.0 / 36.0 + r / 24.0, 2.0 / 9.0, 5.0 / 36.0 - r / 24.0],
        [5.0 / 36.0 + r / 30.0, 2.0 / 9.0 + r / 15.0, 5.0 / 36.0],
    ];
    let nodes = [0.5 - r / 10.0, 0.5, 0.5 + r / 10.0];
    // Lagrange's polynomials of the nodes, one step ahead.
    let ahead = nodes.map(|c| {
        std::array::from_fn(|j| {
            let others = (0..3).filter(|m| *m != j);
            others.map(|m| (1.0 + c - nodes[m]) / (nodes[j] - nodes[m])).product()
        })
    });
    ByHand { rows, ends: [5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0], ahead: Some(ahead) }
}

/// A row of a tableau: the numbers of stages and their weights.
type Row = &'static [(usize, f64)];

/// The tableau of DOP853 (Hairer, Nørsett, Wanner 1993, §II.5), from the second stage on.
const ROWS: [Row; 11] = [
    &[(0, 0.05260015195876773)],
    &[(0, 0.0197250569845379), (1, 0.0591751709536137)],
    &[(0, 0.02958758547680685), (2, 0.08876275643042054)],
    &[(0, 0.2413651341592667), (2, -0.8845494793282861), (3, 0.924834003261792)],
    &[(0, 0.037037037037037035), (3, 0.17082860872947386), (4, 0.12546768756682242)],
    &[(0, 0.037109375), (3, 0.17025221101954405), (4, 0.06021653898045596), (5, -0.017578125)],
    &[
        (0, 0.03709200011850479),
        (3, 0.17038392571223998),
        (4, 0.10726203044637328),
        (5, -0.015319437748624402),
        (6, 0.008273789163814023),
    ],
    &[
        (0, 0.6241109587160757),
        (3, -3.3608926294469414),
        (4, -0.868219346841726),
        (5, 27.59209969944671),
        (6, 20.154067550477894),
        (7, -43.48988418106996),
    ],
    &[
        (0, 0.47766253643826434),
        (3, -2.4881146199716677),
        (4, -0.590290826836843),
        (5, 21.230051448181193),
        (6, 15.279233632882423),
        (7, -33.28821096898486),
        (8, -0.020331201708508627),
    ],
    &[
        (0, -0.9371424300859873),
        (3, 5.186372428844064),
        (4, 1.0914373489967295),
        (5, -8.149787010746927),
        (6, -18.52006565999696),
        (7, 22.739487099350505),
        (8, 2.4936055526796523),
        (9, -3.0467644718982196),
    ],
    &[
        (0, 2.273310147516538),
        (3, -10.53449546673725),
        (4, -2.0008720582248625),
        (5, -17.9589318631188),
        (6, 27.94888452941996),
        (7, -2.8589982771350235),
        (8, -8.87285693353063),
        (9, 12.360567175794303),
        (10, 0.6433927460157636),
    ],
];

const ENDS: Row = &[
    (0, 0.054293734116568765),
    (5, 4.450312892752409),
    (6, 1.8915178993145003),
    (7, -5.801203960010585),
    (8, 0.3111643669578199),
    (9, -0.1521609496625161),
    (10, 0.20136540080403034),
    (11, 0.04471061572777259),
];

fn end<const N: usize>(who: &str, method: &str, steps: usize) -> Vec<f64> {
    if who == "ours" { ours::<N>(method, steps) } else { by_hand::<N>(method, steps) }.to_vec()
}

/// The end of steps of a row, alone in its process when it is counted.
fn row(who: &str, method: &str, n: usize, steps: usize) -> Vec<f64> {
    let of = match n {
        3 => end::<3>,
        6 => end::<6>,
        12 => end::<12>,
        24 => end::<24>,
        48 => end::<48>,
        96 => end::<96>,
        _ => end::<192>,
    };
    of(who, method, steps)
}

/// The slope of `ln c` over `ln n`, by least squares.
fn exponent(points: &[(f64, f64)]) -> f64 {
    let logs = points.iter().map(|(n, c)| (n.ln(), c.ln()));
    let mean = |f: fn((f64, f64)) -> f64| logs.clone().map(f).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    logs.clone().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>()
        / logs.map(|p| (p.0 - x).powi(2)).sum::<f64>()
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    if let [_, flag, who, method, n, steps] = &arguments[..]
        && flag == "--row"
    {
        let [n, steps] = [n, steps].map(|text| text.parse().expect("a number"));
        black_box(row(who, method, n, steps));
        return;
    }
    if !callgrind::is_there() {
        println!("valgrind is not installed: the instructions of a step are not counted");
        return;
    }
    let mut table = Table::new(["method", "n", "library", "by hand", "ratio"]);
    for method in METHODS {
        let mut counts = [Vec::new(), Vec::new()];
        for n in SIZES {
            let [a, b] = ["ours", "hand"].map(|who| row(who, method, n, RUNS[1]));
            let off = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 1e-6, "{method}, n = {n}: the ends are {off:.1e} apart");
            let [ours, hand] = ["ours", "hand"].map(|who| {
                let [few, many] = RUNS.map(|steps| {
                    let arguments = ["--row", who, method, &n.to_string(), &steps.to_string()];
                    callgrind::collected(&arguments).expect("callgrind counts")
                });
                (many - few) / (RUNS[1] - RUNS[0]) as f64
            });
            let ratio = format!("{:.1}", ours / hand);
            table.row([
                method.to_owned(),
                n.to_string(),
                format!("{ours:.0}"),
                format!("{hand:.0}"),
                ratio,
            ]);
            if n >= 24 {
                [ours, hand]
                    .into_iter()
                    .zip(&mut counts)
                    .for_each(|(c, to)| to.push((n as f64, c)));
            }
        }
        let [ours, hand] = counts.map(|points| format!("n^{:.2}", exponent(&points)));
        table.row([method.to_owned(), "24 to 192".to_owned(), ours, hand, "–".to_owned()]);
    }
    println!("{table}");
}
