//! Sums that should vanish at a state of a run, relative to the terms that cancel in them, without a list.
//!
//! The sums of module `balance` are those of the start, where points are generic. Here a covector comes with the size
//! of its round-off.

use metriplectic_fields::{Column, Square};

/// The violation of a law that is taken for round-off, relative to the terms that cancel. It is a hundred times that at
/// the start: a closure may lose two digits on the way.
pub(super) const TOLERANCE: f64 = 1e-8;

/// The weight of a size of which a few `ε` are round-off.
const ROUNDING: f64 = 16.0 * f64::EPSILON / TOLERANCE;

/// A covector and the sizes of which a few `ε` are its round-off.
type Rounded<'a, V> = [&'a V; 2];

/// Replaces sizes that are zero by the largest one, or by 1.
pub(super) fn positive<V: Column<f64>>(sizes: V) -> V {
    let largest = (0..V::LEN).map(|i| sizes[i]).fold(0.0, f64::max);
    let other = if largest > 0.0 { largest } else { 1.0 };
    V::from_index(|i| if sizes[i] > 0.0 { sizes[i] } else { other })
}

/// A sum and the sizes of its terms.
#[derive(Clone, Copy, Default)]
struct Sum {
    sum: f64,
    terms: f64,
}

impl Sum {
    fn add(&mut self, term: f64, rounding: f64) {
        self.sum += term;
        self.terms += term.abs() + ROUNDING * rounding.abs();
    }

    /// The sum relative to its terms, beside which `size` may be rounded.
    fn beside(self, size: f64) -> f64 {
        // The least normal number is below every term that is not lost.
        self.sum / (self.terms + ROUNDING * size + f64::MIN_POSITIVE)
    }
}

/// Computes the largest relative size of a row of `A w`.
pub(super) fn product<A: Square<f64>>(
    a: &A,
    [w, rounding]: Rounded<'_, A::Column>,
    units: &A::Column,
) -> f64 {
    let n = A::Column::LEN;
    let row = |i: usize| {
        let mut row = Sum::default();
        (0..n).for_each(|j| row.add(a[(i, j)] * w[j], a[(i, j)] * rounding[j]));
        row
    };
    let largest = (0..n).map(|i| row(i).terms / units[i]).fold(0.0, f64::max);
    (0..n).map(|i| row(i).beside(largest * units[i]).abs()).fold(0.0, f64::max)
}

/// Computes the relative size of `⟨α, A β⟩`.
pub(super) fn form<A: Square<f64>>(
    a: &A,
    [[alpha, of_alpha], [beta, of_beta]]: [Rounded<'_, A::Column>; 2],
    units: &A::Column,
) -> f64 {
    let n = A::Column::LEN;
    let (mut sum, mut rate) = (Sum::default(), 0.0_f64);
    for i in 0..n {
        for j in 0..n {
            let entry = a[(i, j)];
            let rounding =
                (alpha[i] * entry * of_beta[j]).abs() + (of_alpha[i] * entry * beta[j]).abs();
            sum.add(alpha[i] * entry * beta[j], rounding);
            rate = rate.max((entry * beta[j] / units[i]).abs());
        }
    }
    let size = (0..n).map(|i| (alpha[i] * units[i]).abs()).fold(0.0, f64::max);
    sum.beside(size * rate).abs()
}

/// Computes the relative size of `⟨α, v⟩`, with its sign.
pub(super) fn pairing<V: Column<f64>>([alpha, rounding]: Rounded<'_, V>, v: &V, units: &V) -> f64 {
    let mut sum = Sum::default();
    (0..V::LEN).for_each(|i| sum.add(alpha[i] * v[i], rounding[i] * v[i]));
    let rate = (0..V::LEN).map(|i| (v[i] / units[i]).abs()).fold(0.0, f64::max);
    let size = (0..V::LEN).map(|i| (alpha[i] * units[i]).abs()).fold(0.0, f64::max);
    sum.beside(size * rate)
}

/// The largest entry of a tensor on covectors in the given units; 0 where it has lost its digits.
fn largest<A: Square<f64>>(a: &A, units: &A::Column) -> f64 {
    let (mut plain, mut scaled) = (0.0_f64, 0.0_f64);
    for i in 0..A::Column::LEN {
        for j in 0..A::Column::LEN {
            plain = plain.max(a[(i, j)].abs());
            scaled = scaled.max((a[(i, j)] / units[i] / units[j]).abs());
        }
    }
    if plain * f64::EPSILON > f64::MIN_POSITIVE && scaled.is_finite() { scaled } else { 0.0 }
}

/// Computes the largest relative difference of an entry from the transposed one times the `sign`.
pub(super) fn asymmetry<A: Square<f64>>(a: &A, sign: f64, units: &A::Column) -> f64 {
    let (top, mut worst) = (largest(a, units), 0.0_f64);
    if top == 0.0 {
        return 0.0;
    }
    for i in 0..A::Column::LEN {
        for j in 0..=i {
            let mut sum = Sum::default();
            sum.add(a[(i, j)], 0.0);
            sum.add(-sign * a[(j, i)], 0.0);
            worst = worst.max(sum.beside(top * units[i] * units[j]).abs());
        }
    }
    worst
}

/// Measures how far a symmetric tensor on covectors is from positive semidefinite: the most negative pivot of
/// its `LDLᵀ` decomposition with diagonal pivoting, after a scaling to a diagonal of ones.
pub(super) fn indefiniteness<A: Square<f64>>(k: &A, units: &A::Column) -> f64 {
    let (n, top) = (A::Column::LEN, largest(k, units));
    if top == 0.0 {
        return 0.0;
    }
    let hat = |i: usize, j: usize| 0.5 * (k[(i, j)] + k[(j, i)]) / units[i] / units[j] / top;
    let size = A::Column::from_index(|i| (hat(i, i).abs() + ROUNDING).sqrt());
    let mut a = A::from_entries(|i, j| hat(i, j) / (size[i] * size[j]));
    let mut worst = 0.0_f64;
    for p in 0..n {
        let mut pivot = p;
        for i in p..n {
            worst = worst.max(-a[(i, i)]);
            if a[(i, i)] > a[(pivot, pivot)] {
                pivot = i;
            }
        }
        exchange(&mut a, p, pivot);
        if a[(p, p)] <= TOLERANCE {
            // |a_ij| ≤ √(a_ii a_jj) in a semidefinite matrix, and the diagonal is zero here.
            for i in p..n {
                for j in p..n {
                    worst = worst.max(a[(i, j)].abs());
                }
            }
            return worst;
        }
        for i in p + 1..n {
            for j in p + 1..n {
                let rank_one = a[(i, p)] * a[(p, j)] / a[(p, p)];
                a[(i, j)] -= rank_one;
            }
        }
    }
    worst
}

/// Exchanges two rows, and the columns of the same indices.
fn exchange<A: Square<f64>>(a: &mut A, p: usize, q: usize) {
    for k in 0..A::Column::LEN {
        (a[(p, k)], a[(q, k)]) = (a[(q, k)], a[(p, k)]);
    }
    for k in 0..A::Column::LEN {
        (a[(k, p)], a[(k, q)]) = (a[(k, q)], a[(k, p)]);
    }
}
