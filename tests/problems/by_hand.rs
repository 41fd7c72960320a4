//! The velocity of every problem by hand.

use metriplectic::fields::{ChartPoint, Dimension, Space};
use metriplectic::manifolds::Manifold;
use metriplectic::nalgebra::{DMatrix, DVector};
use metriplectic::prelude::*;
use metriplectic_studies::problems::{Problem, Study, each};
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

/// What `x' = Π dH + K dS` is made of at one point: `Π dH`, the cometric, `dH` and `dS`, all in the
/// entries of a velocity.
struct Parts {
    turn: DVector<f64>,
    cometric: DMatrix<f64>,
    dh: DVector<f64>,
    ds: DVector<f64>,
}

impl Parts {
    /// `Π dH + G*(dH,dH) ♯dS − G*(dH,dS) ♯dH`.
    fn velocity(&self) -> DVector<f64> {
        let Self { turn, cometric, dh, ds } = self;
        let (w, s) = (cometric * dh, cometric * ds);
        turn + &s * dh.dot(&w) - &w * dh.dot(&s)
    }
}

/// The inverse on the tangent space of the unit sphere at `x` of a form that has the inverse `a` on the
/// surrounding space: `A⁻¹ − A⁻¹x xᵀA⁻¹ / xᵀA⁻¹x`.
fn on_the_sphere(a: &DMatrix<f64>, x: &DVector<f64>) -> DMatrix<f64> {
    let normal = a * x;
    a - &normal * normal.transpose() / x.dot(&normal)
}

/// The vector with the components `det[r₁, …, r_{n−1}, e_i]`.
fn cross(rows: &[&DVector<f64>]) -> DVector<f64> {
    let n = rows.len() + 1;
    DVector::from_fn(n, |i, _| {
        DMatrix::from_fn(n, n, |row, j| match rows.get(row) {
            Some(r) => r[j],
            None => f64::from(u8::from(i == j)),
        })
        .determinant()
    })
}

/// The slopes of a function of rotations along `R ê_k`, from its derivatives along the entries of `R`.
fn on_rotations(r: &Matrix3<f64>, slope: &Matrix3<f64>) -> Vector3<f64> {
    let a = r.transpose() * slope;
    vector![a.m32 - a.m23, a.m13 - a.m31, a.m21 - a.m12]
}

/// One below the other.
fn join(a: &[f64], b: &[f64]) -> DVector<f64> {
    DVector::from_vec([a, b].concat())
}

/// The parts of a problem where the entries of the state are `x`, by hand.
fn by_hand(problem: &str, x: &[f64]) -> Parts {
    let (state, one) = (DVector::from_column_slice(x), DMatrix::identity(x.len(), x.len()));
    let nothing = || DVector::zeros(x.len());
    let top = |x: &[f64]| DVector::from_fn(3, |i, _| [1.0, 0.5, 0.25][i] * (x[i] + x[i] * x[i]));
    let hill = |x: &[f64]| DVector::from_vec(vec![0.3 * x[1], 0.3 * x[0], 1.0]);
    let bumpy = |x: &[f64]| {
        DVector::from_fn(x.len(), |i, _| {
            let k = i as f64;
            (1.0 + 0.6 * k) * x[i] + (0.9 - 0.3 * k) * x[i] * x[i]
        })
    };
    let slope = |x: &[f64]| {
        let at = |i: Option<usize>| i.and_then(|i| x.get(i)).copied().unwrap_or(0.0) / 3.0;
        DVector::from_fn(x.len(), |i, _| {
            at(i.checked_sub(1)) + at(Some(i + 1)) + if i + 1 == x.len() { 1.0 } else { 0.0 }
        })
    };
    let cube = |x: &[f64]| Matrix3::from_row_slice(&x[..9]);
    let round = || on_the_sphere(&one, &state);
    let dynamic = |a: &Matrix3<f64>| DMatrix::from_fn(3, 3, |i, j| a[(i, j)]);
    match problem {
        "rigid body on so(3)* (canonical)" => {
            let dh = DVector::from_vec(vec![0.1 * x[0], 0.2 * x[1], x[2]]);
            Parts { turn: cross(&[&state, &dh]), cometric: one, dh, ds: state }
        }
        "spinning top on S² (canonical)" => {
            let dh = top(x);
            Parts { turn: cross(&[&state, &dh]), cometric: round(), dh, ds: nothing() }
        }
        "relaxation on S² (canonical)" => {
            let ds = DVector::from_vec(vec![1.0, -0.2 * x[2], -0.2 * x[1]]);
            Parts { turn: nothing(), cometric: round(), dh: hill(x), ds }
        }
        "no Casimir on S² (canonical)" => {
            let dh = top(x);
            Parts { turn: cross(&[&state, &dh]), cometric: round(), dh, ds: hill(x) }
        }
        "relaxation on S² (ambient closure)" => {
            let lean = 0.2 * x[2];
            let form = Matrix3::new(1.0, lean, 0.0, lean, 1.5, 0.0, 0.0, 0.0, 2.0);
            let inverse = dynamic(&form.try_inverse().expect("a positive form"));
            let cometric = on_the_sphere(&inverse, &state);
            Parts { turn: nothing(), cometric, dh: top(x), ds: hill(x) }
        }
        "Nambu on S³ (canonical)" => {
            let (dh, ds) = (bumpy(x), slope(x));
            Parts { turn: cross(&[&state, &ds, &dh]), cometric: round(), dh, ds }
        }
        "Nambu on S⁵ (canonical)" => {
            let (dh, ds) = (bumpy(x), slope(x));
            let first = DVector::from_vec(vec![x[3], -0.5 * x[4], 0.0, x[0], -0.5 * x[1], 0.0]);
            let second = DVector::from_vec(vec![0.0, x[5], 1.0, 0.0, 0.0, x[1]]);
            let turn = cross(&[&state, &ds, &first, &second, &dh]);
            Parts { turn, cometric: round(), dh, ds }
        }
        "Nambu on SO(3) (canonical)"
        | "Nambu on SO(3) (left-invariant)"
        | "Nambu on SO(3) (depends on R)" => {
            let r = cube(x);
            let dh = Matrix3::new(1.0, r.m23 / 2.0, 0.0, 0.0, 2.0, r.m12 / 2.0, 0.0, 0.0, 3.0);
            let sum = 0.5 * (r.m31 + r.m32);
            let ds = Matrix3::new(0.0, 0.0, 1.0, -0.5, 0.0, 0.0, sum, sum, 0.0);
            let (dh, ds) = (on_rotations(&r, &dh), on_rotations(&r, &ds));
            let lean = vector![r.m13, r.m23, r.m33];
            let form = match problem {
                "Nambu on SO(3) (canonical)" => Matrix3::identity(),
                "Nambu on SO(3) (left-invariant)" => {
                    Matrix3::new(1.0, 0.2, 0.0, 0.2, 1.5, 0.1, 0.0, 0.1, 2.0)
                }
                _ => {
                    Matrix3::from_diagonal(&vector![1.0, 1.5, 2.0]) + lean * lean.transpose() / 2.0
                }
            };
            let turn = ds.cross(&dh) / form.determinant().sqrt();
            let cometric = dynamic(&form.try_inverse().expect("a positive form"));
            // A tenth of the friction with the metrics from closures.
            let fraction = if problem.contains("canonical") { 1.0 } else { 0.1 };
            let column = |v: Vector3<f64>| join(v.as_slice(), &[]);
            Parts { turn: column(turn), cometric, dh: column(dh), ds: column(ds * fraction) }
        }
        "area form on 2-chart (non-diagonal)" => {
            let across = 0.4 * x[0].sin();
            let [a, d] = [1.0 + x[1] * x[1], 1.0 + 0.5 * x[0] * x[0]];
            let dh = [x[0] + 0.3 * x[0] * x[0], 2.0 * x[1]];
            let turn = join(&[-dh[1], dh[0]], &[]) / (a * d - across * across).sqrt();
            // Without an entropy the cometric is not looked at.
            Parts { turn, cometric: one, dh: join(&dh, &[]), ds: nothing() }
        }
        "Nambu on 3-chart (non-diagonal)" => {
            // det(1 + λ uuᵀ) = 1 + λ|u|², (1 + λ uuᵀ)⁻¹ = 1 − λ uuᵀ/(1 + λ|u|²).
            let wave = DVector::from_vec(vec![x[1].sin(), x[2].cos(), 0.5 * x[0]]);
            let determinant = 1.0 + 0.4 * wave.norm_squared();
            let (dh, mut ds) = (bumpy(x), state);
            ds[2] += 0.3 * x[2] * x[2];
            let turn = cross(&[&ds, &dh]) / determinant.sqrt();
            // A tenth of the friction.
            ds *= 0.1;
            let cometric = one - &wave * wave.transpose() * (0.4 / determinant);
            Parts { turn, cometric, dh, ds }
        }
        "spin in a bath on S² × R (canonical)" | "spin in a bath on S² × R₊ (canonical)" => {
            let (spin, bath) = (DVector::from_column_slice(&x[..3]), x[3]);
            let mut cometric = one;
            cometric
                .view_mut((0, 0), (3, 3))
                .copy_from(&on_the_sphere(&DMatrix::identity(3, 3), &spin));
            let mut slopes = [bath.exp(), 1.0];
            if problem.contains("R₊") {
                // The metric de²/e².
                cometric[(3, 3)] = bath * bath;
                slopes = [1.0, 1.0 / bath];
            }
            let dh = top(x);
            let turn = join(cross(&[&spin, &dh]).as_slice(), &[0.0]);
            let ds = join(&[0.0; 3], &slopes[1..]);
            Parts { turn, cometric, dh: join(dh.as_slice(), &slopes[..1]), ds }
        }
        "heavy body on SO(3) × R³ (canonical)" | "relaxation on SO(3) × R³ (full closure)" => {
            let (r, p) = (cube(x), Vector3::from_column_slice(&x[9..]));
            let dh = Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.2, 0.0, 0.7);
            let ds = Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
            let (dh, ds) = (on_rotations(&r, &dh), on_rotations(&r, &ds));
            let omega = vector![p.x, p.y / 2.0, p.z / 3.0];
            let all = join(dh.as_slice(), omega.as_slice());
            let one = DMatrix::identity(6, 6);
            if problem.starts_with("heavy") {
                let turn = join(omega.as_slice(), (p.cross(&omega) - dh).as_slice());
                return Parts { turn, cometric: one, dh: all, ds: DVector::zeros(6) };
            }
            let lean = DVector::from_vec(vec![r.m13, r.m23, r.m33, 0.5, r.m31, 0.0]);
            let fraction = 0.3 / (1.0 + 0.3 * lean.norm_squared());
            let cometric = one - &lean * lean.transpose() * fraction;
            let ds = join(ds.as_slice(), (p * -0.6).as_slice());
            Parts { turn: DVector::zeros(6), cometric, dh: all, ds }
        }
        _ => panic!("{problem} has no velocity by hand"),
    }
}

/// Compares the velocity of each problem with the one by hand, at random points.
#[derive(Default)]
struct Velocities(usize);

impl Study for Velocities {
    fn visit<Y, R>(&mut self, problem: &Problem<Y>, scheme: &'static str, _: R, _: f64)
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric> + Copy,
    {
        if scheme != "exponential" {
            return;
        }
        let Problem { name, manifold, metric, system, .. } = problem;
        let label = format!("{name} on {manifold} ({metric})");
        let (mut rng, mut fastest) = (ChaCha8Rng::seed_from_u64(2024), 0.0_f64);
        for _ in 0..100 {
            let x = system.manifold().random(&mut rng);
            let centre = ChartPoint::<Y::Manifold>::centre(&x);
            let velocity = system.velocity(&centre).expect("a velocity");
            let velocity = Y::Manifold::embed(&centre, &velocity);
            let expected = by_hand(&label, &Y::Manifold::entries(&x)).velocity();
            let entries = <Y::Manifold as Space>::Velocity::LEN;
            let off = (0..entries).map(|i| (velocity[i] - expected[i]).abs()).fold(0.0, f64::max);
            assert!(
                expected.len() == entries && off <= 1e-12 * (1.0 + expected.amax()),
                "{label}: {off:e}"
            );
            fastest = fastest.max(expected.amax());
        }
        assert!(fastest > 0.1, "{label} hardly moves");
        self.0 += 1;
    }
}

/// Compares the velocity of all problems.
pub(crate) fn compare() {
    let mut velocities = Velocities::default();
    each(&mut velocities);
    assert_eq!(velocities.0, 16);
}
