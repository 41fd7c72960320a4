//! Sums that should vanish, relative to the terms that should cancel in them.
//!
//! The entries of a state may have different units, so the norm of a vector has no meaning. A sum
//! `Σ_j A_ij w_j` is compared with `Σ_j |A_ij||w_j|`, row by row, in which every term has one unit.

pub(super) use super::numbers::worse;
use super::table::{Row, Table, pairs, zeros};
use smallvec::SmallVec;

/// The violation of a law that is taken for round-off, relative to the terms that cancel. Models contain
/// transcendental functions, so it is far above `ε`. It is far below any mistake.
pub(crate) const TOLERANCE: f64 = 1e-10;

/// The weight of the largest terms of all rows in the size of a row. A row that is only the rounding of other
/// rows, a few `ε` of them, satisfies its law.
pub(crate) const ROUNDING: f64 = 16.0 * f64::EPSILON / TOLERANCE;

/// A sum that should vanish, and the sum of the absolute values of its terms.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Balance {
    sum: f64,
    terms: f64,
}

impl Balance {
    /// Adds a term.
    pub(crate) fn add(&mut self, term: f64) {
        self.sum += term;
        self.terms += term.abs();
    }

    /// The sum.
    pub(crate) const fn sum(&self) -> f64 {
        self.sum
    }

    /// The sum of the absolute values.
    pub(crate) const fn terms(&self) -> f64 {
        self.terms
    }

    /// Returns the sum as a violation, with a size added to its terms.
    pub(crate) fn beside(self, size: f64) -> Violation {
        Violation { size: self.sum.abs(), terms: self.terms + size }
    }

    /// Returns the sum relative to its terms, where rounding may be `ε` of the `largest` terms elsewhere.
    pub(crate) fn relative(self, largest: f64) -> f64 {
        self.beside(ROUNDING * largest).relative()
    }
}

/// The size of what should vanish, and of the terms that should cancel in it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Violation {
    /// The size of what should vanish.
    pub size: f64,
    /// The size of the terms that should cancel in it.
    pub terms: f64,
}

impl Violation {
    /// Returns the size relative to the terms, and 0 if the size is 0.
    pub(crate) fn relative(&self) -> f64 {
        if self.size == 0.0 { 0.0 } else { self.size / self.terms }
    }

    /// Returns the violation that is larger relative to its terms.
    pub(crate) fn or_worse(self, other: Self) -> Self {
        let (old, new) = (self.relative(), other.relative());
        if new > old || new.is_nan() { other } else { self }
    }
}

impl Extend<f64> for Balance {
    fn extend<I: IntoIterator<Item = f64>>(&mut self, terms: I) {
        terms.into_iter().for_each(|term| self.add(term));
    }
}

impl FromIterator<f64> for Balance {
    fn from_iter<I: IntoIterator<Item = f64>>(terms: I) -> Self {
        let mut balance = Self::default();
        balance.extend(terms);
        balance
    }
}

/// The largest relative size of a row of `A w`, in chart coordinates of the sizes `units`.
pub(crate) fn product(a: &Table, w: &[f64], units: &[f64]) -> f64 {
    product_rounded(a, None, w, units)
}

/// The largest relative size of a row of `A w`, where the entries of `A` have the given `rounding`.
pub(super) fn product_rounded(
    a: &Table,
    rounding: Option<&Table>,
    w: &[f64],
    units: &[f64],
) -> f64 {
    let n = w.len();
    let rates = Table::from_entries(n, |i, j| (a[(i, j)] * w[j] / units[i]).abs());
    let largest = largest_in_blocks(a, &rates);
    let row = |i| (0..n).map(|j| a[(i, j)] * w[j]).collect::<Balance>();
    let rounded = |i| {
        let terms = |rounding: &Table| (0..n).map(|j| rounding[(i, j)] * w[j].abs()).sum::<f64>();
        rounding.map_or(0.0, terms) / TOLERANCE
    };
    let size = |i: usize| ROUNDING * units[i] * largest[i] + rounded(i);
    (0..n).map(|i| row(i).beside(size(i)).relative()).fold(0.0, worse)
}

/// For each index the largest size of an entry in its block: the rows and columns that entries of `a` which
/// are not zero connect it with. Rounding comes only from these.
fn largest_in_blocks(a: &Table, sizes: &Table) -> Row {
    let n = a.len();
    let mut block: SmallVec<[usize; 8]> = (0..n).collect();
    for (i, j) in pairs(n).filter(|&ij| a[ij] != 0.0) {
        let (kept, joined) = (block[i], block[j]);
        if kept != joined {
            block.iter_mut().filter(|b| **b == joined).for_each(|b| *b = kept);
        }
    }
    let mut largest = zeros(n);
    for (i, j) in pairs(n) {
        largest[block[i]] = worse(largest[block[i]], sizes[(i, j)]);
    }
    block.into_iter().map(|b| largest[b]).collect()
}

/// The relative size of the number `⟨α, A β⟩`.
pub(crate) fn form(a: &Table, alpha: &[f64], beta: &[f64], units: &[f64]) -> f64 {
    let n = a.len();
    let rate = pairs(n).map(|(i, j)| (a[(i, j)] * beta[j] / units[i]).abs()).fold(0.0, f64::max);
    let size = (0..n).map(|i| (alpha[i] * units[i]).abs()).fold(0.0, f64::max);
    let terms = pairs(n).map(|(i, j)| alpha[i] * a[(i, j)] * beta[j]);
    terms.collect::<Balance>().relative(size * rate)
}

/// The relative size of the number `⟨α, v⟩`.
pub(crate) fn pairing(alpha: &[f64], v: &[f64], units: &[f64]) -> f64 {
    let n = v.len();
    let rate = (0..n).map(|i| (v[i] / units[i]).abs()).fold(0.0, f64::max);
    let size = (0..n).map(|i| (alpha[i] * units[i]).abs()).fold(0.0, f64::max);
    (0..n).map(|i| alpha[i] * v[i]).collect::<Balance>().relative(size * rate)
}

/// The sizes of the entries of a tensor on covectors in the given units.
fn scaled(a: &Table, units: &[f64]) -> Table {
    Table::from_entries(a.len(), |i, j| (a[(i, j)] / units[i] / units[j]).abs())
}

/// The largest entry of a tensor on covectors in the given units.
pub(crate) fn largest(a: &Table, units: &[f64]) -> f64 {
    scaled(a, units).max_abs()
}

/// The largest relative difference of an entry of a tensor from the transposed one times the `sign`. Beside
/// the two entries, `√(A_ii A_jj)` and the `rounding` of the largest entry are what they are relative to.
pub(crate) fn asymmetry(a: &Table, sign: f64, units: &[f64], rounding: f64) -> Violation {
    let top = largest_in_blocks(a, &scaled(a, units));
    let root = |i: usize| if sign > 0.0 { a[(i, i)].abs().sqrt() } else { 0.0 };
    let violation = |(i, j): (usize, usize)| {
        let balance: Balance = [a[(i, j)], -sign * a[(j, i)]].into_iter().collect();
        let size = rounding * top[i] * units[i] * units[j];
        balance.beside(root(i) * root(j) + size)
    };
    pairs(a.len()).map(violation).fold(Violation::default(), Violation::or_worse)
}

/// Measures how far a symmetric tensor on covectors is from positive semidefinite: the most negative pivot of
/// its `LDLᵀ` decomposition with diagonal pivoting, after a scaling to a diagonal of ones.
///
/// The scaling `K_ij / √(K_ii K_jj)` removes all units. Rows that are round-off of others keep
/// entries below the tolerance.
pub(crate) fn indefiniteness(k: &Table, units: &[f64]) -> f64 {
    let n = k.len();
    let top = largest_in_blocks(k, &scaled(k, units));
    if !top.iter().all(|top| top.is_finite()) {
        return f64::NAN;
    }
    let hat = Table::from_entries(n, |i, j| {
        let entry = 0.5 * (k[(i, j)] + k[(j, i)]);
        if entry == 0.0 { 0.0 } else { entry / units[i] / units[j] / top[i] }
    });
    let diagonal: Row = (0..n).map(|i| hat[(i, i)].abs() + ROUNDING).collect();
    let mut a = Table::from_entries(n, |i, j| hat[(i, j)] / (diagonal[i] * diagonal[j]).sqrt());
    let mut left: SmallVec<[usize; 8]> = (0..n).collect();
    let mut negative = 0.0_f64;
    while let Some(&p) = left.iter().max_by(|&&i, &&j| a[(i, i)].total_cmp(&a[(j, j)])) {
        negative = left.iter().map(|&i| -a[(i, i)]).fold(negative, f64::max);
        if a[(p, p)] <= TOLERANCE {
            // |a_ij| ≤ √(a_ii a_jj) in a semidefinite matrix, and the diagonal is zero here.
            let violation = |&i: &usize| left.iter().map(|&j| a[(i, j)].abs()).fold(0.0, f64::max);
            return left.iter().map(violation).fold(negative, f64::max);
        }
        left.retain(|i| *i != p);
        for &i in &left {
            for &j in &left {
                let rank_one = a[(i, p)] * a[(p, j)] / a[(p, p)];
                a[(i, j)] -= rank_one;
            }
        }
    }
    negative
}
