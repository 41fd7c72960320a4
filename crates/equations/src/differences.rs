//! Systems whose parts are known apart, with derivatives by differences.

use crate::{
    ByCharts, Covectors, ENERGY, ENTROPY, Equations, Jet, Kind, MetricError, Model, Part, Paths,
    PointError, SecondLaw, Sizes,
};

/// A system whose bracket and friction are known apart.
///
/// [`Differences`] makes it a [`Model`], of which implicit methods take steps.
pub trait Apart: Equations {
    /// Returns whether a part is zero by construction, so that it is not asked for.
    fn is_zero(&self, part: Part) -> bool;

    /// Returns whether the bracket is to satisfy the Jacobi identity.
    fn is_poisson(&self) -> bool {
        true
    }

    /// Computes the vector `Π α`, `f(w)` or `K_w α` of a part at a state, or numbers that are not finite where it has none. It is
    /// linear in `α`, which a force does not have. A friction annihilates `w`, the covector of the energy. It may depend on that of the
    /// entropy, as on temperatures; Newton's method leaves out the derivatives along this one, and takes more iterations then.
    fn apply(&self, part: Part, t: f64, x: &[f64], w: Covectors<'_>, alpha: &[f64], v: &mut [f64]);

    /// Returns whether the space has [charts](Equations::chart) and [sizes](Equations::scales) of its own. By default it is a vector space,
    /// whose charts are translations and whose sizes are `|x_i|`, and neither is asked for.
    fn has_charts(&self) -> bool {
        false
    }

    /// Returns the paths of steps on a space that has charts, if they are known; else they are the [lines of the charts](ByCharts).
    fn paths(&self) -> Option<&dyn Paths> {
        None
    }
}

/// A system whose derivatives are formed by central differences: Hessians from differentials, and those of its parts.
///
/// Implicit methods need them for Newton's method alone, so both laws are exact, and a step differs by round-off from that with
/// derivatives by hand. It has the canonical inner product of each chart. Charts are translations, and sizes
/// `|x_i|`, unless the system [has others](Apart::has_charts). The step of a difference is relative to an entry. That of an entry which is zero is relative to
/// the distance over which it changes a law, or to the largest entry: let one entry at least have the size of the motion.
///
/// A pendulum with friction that heats a bath, `q' = p, p' = −sin q − γ p/T, u' = γ p²/T` with the temperature `T = 1 + u`:
///
/// ```
/// use metriplectic_equations::{
///     Apart, Covectors, Differences, ENERGY, ENTROPY, Equations, Part, SecondLaw, Sizes, laws,
/// };
///
/// struct Pendulum {
///     friction: f64,
/// }
///
/// impl Equations for Pendulum {
///     fn sizes(&self) -> Sizes {
///         Sizes { entries: 3, directions: 3, laws: 2 }
///     }
///
///     fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
///         values[ENERGY] = 0.5 * x[1] * x[1] - x[0].cos() + x[2];
///         values[ENTROPY] = (1.0 + x[2]).ln();
///     }
///
///     fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
///         self.values(t, x, values);
///         w.copy_from_slice(&[x[0].sin(), x[1], 1.0, 0.0, 0.0, 1.0 / (1.0 + x[2])]);
///     }
///
///     fn velocity(&self, _: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
///         let rate = self.friction / (1.0 + x[2]);
///         v.copy_from_slice(&[x[1], -x[0].sin() - rate * x[1], rate * x[1] * x[1]]);
///         Some(v[2] / (1.0 + x[2]))
///     }
///
///     fn second_law(&self) -> SecondLaw {
///         SecondLaw::Exact
///     }
/// }
///
/// impl Apart for Pendulum {
///     fn is_zero(&self, part: Part) -> bool {
///         part == Part::Gyroscopic
///     }
///
///     fn apply(&self, part: Part, _: f64, _: &[f64], w: Covectors<'_>, alpha: &[f64], v: &mut [f64]) {
///         if part == Part::Reversible {
///             return v.copy_from_slice(&[alpha[1], -alpha[0], 0.0]);
///         }
///         // K = γ b bᵀ with ⟨w, b⟩ = 0.
///         let b = [0.0, -1.0, w.energy[1] / w.energy[2]];
///         let along = self.friction * (b[1] * alpha[1] + b[2] * alpha[2]);
///         (0..3).for_each(|i| v[i] = along * b[i]);
///     }
/// }
///
/// let system = Differences(Pendulum { friction: 0.1 });
/// let (x, u) = ([0.5, 0.3, 0.2], [0.1, -0.2, 0.15]);
/// laws::equations(&system, 0.0, &x, &u)?;
/// laws::model(system.model().unwrap(), 0.0, &x, &u)?;
/// # Ok::<(), metriplectic_equations::BrokenLaw>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Differences<S>(pub S);

/// The step of a difference quotient, relative to a size: near the third root of round-off, where the errors of a central difference
/// by truncation and by round-off are equal.
const STEP: f64 = 6e-6;

/// The fraction of another size below which a size is negligible: a step of it would be lost in round-off.
const NEGLIGIBLE: f64 = 1e-6;

/// The factor between two sizes of an entry over which differences may have another number of digits.
const APART: f64 = 10.0;

/// The size of an entry, over which a difference is taken, and sizes of other orders that it may have: the entry may be passing through
/// zero, or it may be the distance over which a law bends.
#[derive(Clone, Debug)]
struct Size {
    own: f64,
    others: Vec<f64>,
}

impl Size {
    /// The first of these sizes and those that are far from it; an entry that is not negligible has no smaller size than its own.
    fn of(own: f64, known: f64, candidates: impl IntoIterator<Item = f64>) -> Self {
        let is_own = own > NEGLIGIBLE * known;
        let first = if is_own { own } else { known };
        let mut others: Vec<f64> = Vec::new();
        for size in candidates {
            let is_apart = |from: f64| size > APART * from || (!is_own && size < from / APART);
            let is_new = |from: &f64| !(from / APART..=APART * from).contains(&size);
            if size.is_finite() && size > 0.0 && is_apart(first) && others.iter().all(is_new) {
                others.push(size);
            }
        }
        Self { own: first, others }
    }
}

impl<S: Apart> Equations for Differences<S> {
    fn sizes(&self) -> Sizes {
        self.0.sizes()
    }

    fn values(&self, t: f64, x: &[f64], values: &mut [f64]) {
        self.0.values(t, x, values);
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.0.differentials(t, x, values, w);
    }

    fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        self.0.velocity(t, x, v)
    }

    fn second_law(&self) -> SecondLaw {
        self.0.second_law()
    }

    fn kind(&self, invariant: usize) -> Kind {
        self.0.kind(invariant)
    }

    fn energy_depends_on_time(&self) -> bool {
        self.0.energy_depends_on_time()
    }

    fn power(&self, t: f64, x: &[f64]) -> f64 {
        self.0.power(t, x)
    }

    fn check(&self, x: &[f64]) -> Result<(), PointError> {
        self.0.check(x)
    }

    fn defect(&self, x: &[f64]) -> f64 {
        self.0.defect(x)
    }

    fn scales(&self, x: &[f64], sizes: &mut [f64]) {
        if self.0.has_charts() {
            return self.0.scales(x, sizes);
        }
        sizes.iter_mut().zip(x).for_each(|(size, x)| *size = x.abs());
    }

    fn is_vector_space(&self) -> bool {
        !self.0.has_charts()
    }

    fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]) {
        if self.0.has_charts() {
            return self.0.chart(x, q, y);
        }
        y.copy_from_slice(&moved(x, 1.0, q));
    }

    fn coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) -> bool {
        if self.0.has_charts() {
            return self.0.coordinates(x, y, q);
        }
        q.copy_from_slice(&moved(y, -1.0, x));
        q.iter().all(|q| q.is_finite())
    }

    fn stage_state(&self, x: &[f64], q: &[f64], y: &mut [f64]) -> bool {
        if self.0.has_charts() {
            return self.0.stage_state(x, q, y);
        }
        self.chart(x, q, y);
        y.iter().all(|y| y.is_finite())
    }

    fn stage_coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) {
        if self.0.has_charts() {
            return self.0.stage_coordinates(x, y, q);
        }
        let _ = self.coordinates(x, y, q);
    }

    fn stage_rates(&self, x: &[f64], q: &[f64], y: &[f64], v: &[f64], rates: &mut [f64]) {
        if self.0.has_charts() {
            return self.0.stage_rates(x, q, y, v, rates);
        }
        rates.copy_from_slice(v);
    }

    fn velocity_with(&self, t: f64, x: &[f64], w: &[f64], v: &mut [f64]) -> Option<f64> {
        self.0.velocity_with(t, x, w, v)
    }

    fn is_verified(&self) -> bool {
        self.0.is_verified()
    }

    fn model(&self) -> Option<&dyn Model> {
        Some(self)
    }
}

/// `x + s u`.
fn moved(x: &[f64], s: f64, u: &[f64]) -> Vec<f64> {
    x.iter().zip(u).map(|(x, u)| x + s * u).collect()
}

/// `s u`.
fn scaled(s: f64, u: &[f64]) -> Vec<f64> {
    u.iter().map(|u| s * u).collect()
}

fn unit(n: usize, k: usize) -> Vec<f64> {
    (0..n).map(|i| if i == k { 1.0 } else { 0.0 }).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The central difference quotient of numbers that a function of one parameter fills. Returns the round-off of the numbers in it.
fn quotient(step: f64, to: &mut [f64], f: impl Fn(f64, &mut [f64])) -> Vec<f64> {
    let mut before = vec![0.0; to.len()];
    f(step, to);
    f(-step, &mut before);
    let pairs = to.iter_mut().zip(before);
    let quotient = |(to, before): (&mut f64, f64)| {
        let round_off = f64::EPSILON * (to.abs() + before.abs()) / (2.0 * step);
        *to = (*to - before) / (2.0 * step);
        round_off
    };
    pairs.map(quotient).collect()
}

/// The largest step along a vector that moves each entry by its [`STEP`] at most.
fn step_along(u: &[f64], sizes: &[Size]) -> f64 {
    let pairs = u.iter().zip(sizes).filter(|(u, _)| **u != 0.0);
    let most = pairs.fold(f64::INFINITY, |most, (u, size)| most.min(size.own / u.abs()));
    STEP * if most.is_finite() { most } else { 1.0 }
}

/// All laws with their differentials.
fn jets(system: &(impl Equations + ?Sized), t: f64, x: &[f64]) -> [Vec<f64>; 2] {
    let Sizes { laws, directions, .. } = system.sizes();
    let [mut values, mut w] = [laws, laws * directions].map(|count| vec![0.0; count]);
    system.differentials(t, x, &mut values, &mut w);
    [values, w]
}

/// The sizes of the entries: their own, unless they are negligible; else the distance over which energy or entropy changes by the terms
/// of the other entries; else that which the velocity covers in the median of the times in which entries change by their sizes; else the
/// largest one.
fn sizes_at(system: &(impl Equations + ?Sized), t: f64, x: &[f64]) -> Vec<Size> {
    sizes_of(system, t, x, x.iter().map(|x| x.abs()).collect())
}

/// Returns the sizes of entries with these sizes of their own.
fn sizes_of(system: &(impl Equations + ?Sized), t: f64, x: &[f64], own: Vec<f64>) -> Vec<Size> {
    let n = system.sizes().directions;
    let [_, w] = jets(system, t, x);
    let largest = own.iter().copied().fold(0.0, f64::max);
    let mut v = vec![0.0; n];
    let has_velocity = system.velocity(t, x, &mut v).is_some();
    let times = own.iter().zip(&v).filter(|(x, v)| **x > 0.0 && **v != 0.0);
    let mut times: Vec<f64> = times.map(|(x, v)| x / v.abs()).collect();
    times.sort_by(f64::total_cmp);
    let time = times.get(times.len() / 2).copied().unwrap_or(0.0);
    let by_law = |law: usize, i: usize| {
        let df = &w[law * n..][..n];
        let terms: f64 = df.iter().zip(&own).map(|(df, x)| (df * x).abs()).sum();
        terms / df[i].abs()
    };
    let by_velocity = |i: usize| if has_velocity { v[i].abs() * time } else { 0.0 };
    let size = |i: usize| {
        let candidates = [by_law(ENERGY, i), by_law(ENTROPY, i), by_velocity(i)];
        let is_known = |size: &f64| *size > 0.0 && size.is_finite();
        let others = if largest > 0.0 { largest } else { 1.0 };
        // A size of others says nothing of an entry that has one.
        let alone = if own[i] > 0.0 { own[i] } else { others };
        let known = candidates.iter().copied().find(is_known).unwrap_or(alone);
        Size::of(own[i], known, candidates)
    };
    (0..n).map(size).collect()
}

/// How often a quotient that bends is taken over a shorter distance.
const SHORTER: i32 = 6;

/// The ratio of these distances.
const NEARER: f64 = 16.0;

/// The error of a quotient, relative to it, above which it bends.
const BENT: f64 = 1e-8;

/// A matrix whose columns are quotients along each direction, with steps of these sizes. Where an entry has several, each number of its
/// column is the one that changes least if its step is doubled.
fn columns(sizes: &[Size], to: &mut [f64], f: impl Fn(&[f64], f64, &mut [f64])) {
    each_column((sizes, 0), to, f);
}

/// Computes the same columns, where a quotient that changes if its step is doubled is taken over shorter distances too: an angle that has turned many
/// times is larger than the distance over which its functions bend.
fn checked_columns(sizes: &[Size], to: &mut [f64], f: impl Fn(&[f64], f64, &mut [f64])) {
    each_column((sizes, SHORTER), to, f);
}

fn each_column(
    (sizes, shorter): (&[Size], i32),
    to: &mut [f64],
    f: impl Fn(&[f64], f64, &mut [f64]),
) {
    let n = sizes.len();
    let rows = to.len() / n.max(1);
    for (k, Size { own, others }) in sizes.iter().enumerate() {
        let e = unit(n, k);
        let over = |size: f64| {
            let mut column = vec![0.0; rows];
            let round_off = quotient(STEP * size, &mut column, |s, v| f(&e, s, v));
            (column, round_off)
        };
        let (mut best, mut round_off) = over(*own);
        if !others.is_empty() || shorter > 0 {
            let error = |column: &[f64], round_off: &[f64], size: f64| -> Vec<f64> {
                let pairs = column.iter().zip(over(2.0 * size).0).zip(round_off);
                pairs.map(|((once, twice), round_off)| (once - twice).abs() + round_off).collect()
            };
            let mut least = error(&best, &round_off, *own);
            let shorter = (1..=shorter).map(|k| own * NEARER.powi(-k));
            let all = others.iter().map(|size| (*size, false)).chain(shorter.map(|s| (s, true)));
            for (size, only_if_bent) in all {
                let is_bent = |i: usize| least[i] > BENT * best[i].abs() + 4.0 * round_off[i];
                if only_if_bent && !(0..rows).any(|i| is_bent(i) || least[i].is_nan()) {
                    break;
                }
                let (column, rounded) = over(size);
                let errors = error(&column, &rounded, size);
                for i in 0..rows {
                    if errors[i] < least[i] || least[i].is_nan() {
                        (best[i], least[i], round_off[i]) = (column[i], errors[i], rounded[i]);
                    }
                }
            }
        }
        best.iter().enumerate().for_each(|(i, column)| to[i * n + k] = *column);
    }
}

/// The derivatives of the motion of a system along its state, in a vector space.
#[derive(Clone, Debug, PartialEq)]
pub struct Slopes {
    /// The derivatives of the velocity, `n × n` numbers row by row.
    pub velocity: Vec<f64>,
    /// The derivatives of the production of entropy.
    pub production: Vec<f64>,
    /// The derivatives of the differentials of the laws, `n × n` numbers for each of them.
    pub hessians: Vec<f64>,
}

/// Computes the derivatives of the motion of a system on a vector space by central differences of all that it depends on, in `4n`
/// evaluations or, where it bends, some more. They have two thirds of the digits. `None` where the velocity has no value, there or nearby.
pub fn slopes(system: &(impl Equations + ?Sized), t: f64, x: &[f64]) -> Option<Slopes> {
    let Sizes { directions: n, laws, .. } = system.sizes();
    let sizes = sizes_at(system, t, x);
    let mut all = vec![0.0; (n + 1 + laws * n) * n];
    checked_columns(&sizes, &mut all, |e, s, to| {
        let y = moved(x, s, e);
        let (motion, w) = to.split_at_mut(n + 1);
        let (v, production) = motion.split_at_mut(n);
        production[0] = system.velocity(t, &y, v).unwrap_or(f64::NAN);
        w.copy_from_slice(&jets(system, t, &y)[1]);
    });
    let hessians = all.split_off((n + 1) * n);
    let production = all.split_off(n * n);
    let is_finite = all.iter().chain(&production).all(|slope| slope.is_finite());
    let transposed = |k: usize| k - k % (n * n) + k % n * n + k % (n * n) / n;
    let symmetric = |k: usize| 0.5 * (hessians[k] + hessians[transposed(k)]);
    let hessians = (0..hessians.len()).map(symmetric).collect();
    is_finite.then_some(Slopes { velocity: all, production, hessians })
}

impl<S: Apart> Differences<S> {
    fn n(&self) -> usize {
        self.0.sizes().directions
    }

    /// The sizes of the entries, one for each direction.
    fn sizes_at(&self, t: f64, x: &[f64]) -> Vec<Size> {
        let mut own = vec![0.0; self.n()];
        self.scales(x, &mut own);
        sizes_of(&self.0, t, x, own)
    }

    /// The columns of the derivative of `φ_y⁻¹ ∘ φ_x` at `q`, one after another.
    fn turn_all(&self, y: &[f64], x: &[f64], q: &[f64]) -> Vec<f64> {
        let (n, by_charts) = (self.n(), ByCharts(self));
        let mut columns = vec![0.0; n * n];
        self.0.paths().unwrap_or(&by_charts).turn_all(y, x, q, &mut columns);
        columns
    }

    /// All laws with their differentials at `φ_x(q)`, in the chart at `x`.
    fn jets_at(&self, t: f64, x: &[f64], q: &[f64]) -> [Vec<f64>; 2] {
        if !self.0.has_charts() {
            return jets(&self.0, t, &moved(x, 1.0, q));
        }
        let mut y = vec![0.0; x.len()];
        self.0.chart(x, q, &mut y);
        let ([values, w], n) = (jets(&self.0, t, &y), self.n());
        let columns = self.turn_all(&y, x, q);
        let along = |df: &[f64]| columns.chunks_exact(n).map(|e| dot(df, e)).collect::<Vec<_>>();
        [values, w.chunks_exact(n).flat_map(along).collect()]
    }

    /// The vector of a part at `φ_x(q)`, with covectors and the vector in the chart at `x`.
    fn part_at(
        &self,
        (part, t): (Part, f64),
        (x, q): (&[f64], &[f64]),
        w: Covectors<'_>,
        alpha: &[f64],
        v: &mut [f64],
    ) {
        if !self.0.has_charts() {
            return self.0.apply(part, t, &moved(x, 1.0, q), w, alpha, v);
        }
        let (n, mut y) = (self.n(), vec![0.0; x.len()]);
        self.0.chart(x, q, &mut y);
        let columns = self.turn_all(x, &y, &vec![0.0; n]);
        let there = |w: &[f64]| columns.chunks_exact(n).map(|e| dot(w, e)).collect::<Vec<_>>();
        let [energy, entropy, alpha] = [w.energy, w.entropy, alpha].map(there);
        let w = Covectors { energy: &energy, entropy: &entropy };
        let mut here = vec![0.0; n];
        self.0.apply(part, t, &y, w, &alpha, &mut here);
        v.fill(0.0);
        for (e, a) in columns.chunks_exact(n).zip(here) {
            v.iter_mut().zip(e).for_each(|(v, e)| *v += a * e);
        }
    }

    /// The sizes of the components of a covector in units of these sizes of the entries.
    fn covector_sizes(w: &[f64], sizes: &[Size]) -> Vec<Size> {
        let terms: f64 = w.iter().zip(sizes).map(|(w, size)| (w * size.own).abs()).sum();
        let size = |(w, size): (&f64, &Size)| match (w.abs(), terms / size.own) {
            (own, shared) if shared > 0.0 => Size::of(own, shared, [shared]),
            (own, _) => Size { own: if own > 0.0 { own } else { 1.0 }, others: Vec::new() },
        };
        w.iter().zip(sizes).map(size).collect()
    }

    /// The vector of a part at `φ_x(q)`; an error where it has none.
    fn vector(
        &self,
        (part, t): (Part, f64),
        (x, q): (&[f64], &[f64]),
        w: Covectors<'_>,
        alpha: &[f64],
        v: &mut [f64],
    ) -> Result<(), MetricError> {
        if self.0.is_zero(part) {
            v.fill(0.0);
            return Ok(());
        }
        if q.iter().all(|q| *q == 0.0) {
            self.0.apply(part, t, x, w, alpha, v);
        } else {
            self.part_at((part, t), (x, q), w, alpha, v);
        }
        let bad = v.iter().find(|v| !v.is_finite());
        let quantity = "a velocity of a part";
        bad.map_or(Ok(()), |&value| Err(MetricError::NotFinite { quantity, value }))
    }
}

impl<S: Apart> Model for Differences<S> {
    fn is_zero(&self, part: Part) -> bool {
        self.0.is_zero(part)
    }

    fn is_poisson(&self) -> bool {
        self.0.is_poisson()
    }

    fn has_canonical_metric(&self) -> bool {
        true
    }

    fn has_derivatives_by_differences(&self) -> bool {
        true
    }

    fn paths(&self) -> Option<&dyn Paths> {
        self.0.paths()
    }

    fn value(&self, law: usize, t: f64, x: &[f64]) -> f64 {
        let mut values = vec![0.0; self.0.sizes().laws];
        self.0.values(t, x, &mut values);
        values[law]
    }

    fn along(&self, law: usize, t: f64, x: &[f64], [u, v]: [&[f64]; 2]) -> [f64; 4] {
        let mut df = vec![0.0; u.len()];
        let value = self.jet(law, t, x, &mut df);
        let step = step_along(u, &self.sizes_at(t, x));
        let mut change = df.clone();
        quotient(step, &mut change, |s, df| self.differential_at(law, t, x, &scaled(s, u), df));
        [value, dot(&df, u), dot(&df, v), dot(&change, v)]
    }

    fn jet(&self, law: usize, t: f64, x: &[f64], df: &mut [f64]) -> f64 {
        let [values, w] = jets(&self.0, t, x);
        let n = df.len();
        df.copy_from_slice(&w[law * n..][..n]);
        values[law]
    }

    fn hessian(&self, law: usize, t: f64, x: &[f64], df: &mut [f64], hf: &mut [f64]) -> f64 {
        let n = df.len();
        let mut bend = vec![0.0; n * n];
        columns(&self.sizes_at(t, x), &mut bend, |e, s, df| {
            self.differential_at(law, t, x, &scaled(s, e), df);
        });
        for k in 0..n * n {
            hf[k] = 0.5 * (bend[k] + bend[k % n * n + k / n]);
        }
        self.jet(law, t, x, df)
    }

    fn differential_at(&self, law: usize, t: f64, x: &[f64], q: &[f64], df: &mut [f64]) {
        let n = df.len();
        df.copy_from_slice(&self.jets_at(t, x, q)[1][law * n..][..n]);
    }

    fn independence(&self, t: f64, x: &[f64], fractions: &mut [f64]) {
        if fractions.is_empty() {
            return;
        }
        let (n, [_, w], sizes) = (self.n(), jets(&self.0, t, x), self.sizes_at(t, x));
        let in_units =
            |law: usize| -> Vec<f64> { (0..n).map(|i| w[law * n + i] * sizes[i].own).collect() };
        let mut before: Vec<Vec<f64>> = Vec::new();
        let mut push = |law: usize| {
            let whole = in_units(law);
            let mut rest = whole.clone();
            // The second pass removes the rounding error of the first.
            for _ in 0..2 {
                for normal in &before {
                    let c = dot(normal, &rest);
                    rest.iter_mut().zip(normal).for_each(|(rest, normal)| *rest -= c * normal);
                }
            }
            let [size, left] = [dot(&whole, &whole).sqrt(), dot(&rest, &rest).sqrt()];
            if left > 0.0 {
                before.push(rest.iter().map(|rest| rest / left).collect());
            }
            if size > 0.0 { left / size } else { 0.0 }
        };
        if self.second_law() == SecondLaw::Exact {
            push(ENTROPY);
        }
        push(ENERGY);
        for (k, fraction) in fractions.iter_mut().enumerate() {
            *fraction = push(ENTROPY + 1 + k);
        }
    }

    fn metric(&self, _: &[f64], _: &[f64], g: &mut [f64]) {
        let n = self.n();
        (0..n * n).for_each(|k| g[k] = if k % (n + 1) == 0 { 1.0 } else { 0.0 });
    }

    fn check_metric(&self, _: &[f64], _: bool) -> Result<(), MetricError> {
        Ok(())
    }

    fn metric_slopes(&self, _: &[f64], _: &mut [f64]) -> bool {
        false
    }

    fn flat(&self, _: &[f64], d: &[f64], w: &mut [f64]) -> Result<(), MetricError> {
        w.copy_from_slice(d);
        Ok(())
    }

    fn tensor(
        &self,
        part: Part,
        t: f64,
        x: &[f64],
        w: Covectors<'_>,
        tensor: &mut [f64],
    ) -> Result<(), MetricError> {
        let n = self.n();
        let (mut column, nothing) = (vec![0.0; n], vec![0.0; n]);
        for k in 0..n {
            self.vector((part, t), (x, &nothing), w, &unit(n, k), &mut column)?;
            (0..n).for_each(|i| tensor[i * n + k] = column[i]);
        }
        Ok(())
    }

    fn apply(
        &self,
        part: Part,
        t: f64,
        place: (&[f64], &[f64]),
        w: Covectors<'_>,
        alpha: &[f64],
        v: &mut [f64],
    ) -> Result<(), MetricError> {
        self.vector((part, t), place, w, alpha, v)
    }

    fn linearise(
        &self,
        part: Part,
        t: f64,
        x: &[f64],
        w: Covectors<'_>,
        alpha: &[f64],
        jet: &mut Jet<'_>,
    ) -> Result<(), MetricError> {
        self.vector((part, t), (x, &vec![0.0; self.n()]), w, alpha, jet.value)?;
        if self.0.is_zero(part) {
            [&mut *jet.along_x, &mut *jet.along_w, &mut *jet.tensor]
                .into_iter()
                .for_each(|matrix| matrix.fill(0.0));
            return Ok(());
        }
        let sizes = self.sizes_at(t, x);
        columns(&sizes, jet.along_x, |e, s, v| {
            self.part_at((part, t), (x, &scaled(s, e)), w, alpha, v);
        });
        let along = |energy: bool, to: &mut [f64]| {
            let covector = if energy { w.energy } else { w.entropy };
            columns(&Self::covector_sizes(covector, &sizes), to, |e, s, v| {
                let moved = &moved(covector, s, e)[..];
                let w = if energy {
                    Covectors { energy: moved, ..w }
                } else {
                    Covectors { entropy: moved, ..w }
                };
                self.0.apply(part, t, x, w, alpha, v);
            });
        };
        along(part == Part::Irreversible, jet.along_w);
        if part == Part::Gyroscopic {
            along(true, jet.tensor);
            return Ok(());
        }
        self.tensor(part, t, x, w, jet.tensor)
    }

    fn friction_along_entropy(
        &self,
        t: f64,
        x: &[f64],
        w: Covectors<'_>,
        alpha: &[f64],
        slope: &mut [f64],
    ) -> Result<bool, MetricError> {
        let part = Part::Irreversible;
        if self.0.is_zero(part) {
            return Ok(false);
        }
        let sizes = Self::covector_sizes(w.entropy, &self.sizes_at(t, x));
        columns(&sizes, slope, |e, s, v| {
            let entropy = &moved(w.entropy, s, e)[..];
            self.0.apply(part, t, x, Covectors { entropy, ..w }, alpha, v);
        });
        Ok(true)
    }

    fn bracket_slope(
        &self,
        t: f64,
        x: &[f64],
        along: [&[f64]; 2],
        entropy: &[f64],
        slope: &mut [f64],
    ) -> Result<(), MetricError> {
        let n = self.n();
        let mut column = vec![0.0; n];
        for k in 0..n {
            self.bracket_slope_of(t, x, along, entropy, &unit(n, k), &mut column)?;
            (0..n).for_each(|i| slope[i * n + k] = column[i]);
        }
        Ok(())
    }

    fn bracket_slope_of(
        &self,
        t: f64,
        x: &[f64],
        [u, ds]: [&[f64]; 2],
        entropy: &[f64],
        alpha: &[f64],
        slope: &mut [f64],
    ) -> Result<(), MetricError> {
        if self.0.is_zero(Part::Reversible) {
            slope.fill(0.0);
            return Ok(());
        }
        let step = step_along(u, &self.sizes_at(t, x));
        quotient(step, slope, |s, v| {
            let moved_entropy = moved(entropy, s, ds);
            // A bracket depends on no covector of the energy.
            let w = Covectors { energy: &moved_entropy, entropy: &moved_entropy };
            self.part_at((Part::Reversible, t), (x, &scaled(s, u)), w, alpha, v);
        });
        Ok(())
    }

    fn generator(&self, _: usize, _: &[f64], _: &mut [f64], _: &mut [f64]) -> bool {
        false
    }

    fn action(&self, _: usize, x: &[f64], _: f64, y: &mut [f64], tangent: &mut [f64]) {
        y.copy_from_slice(x);
        self.metric(x, x, tangent);
    }
}
