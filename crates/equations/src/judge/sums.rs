//! Sums that should vanish at a state of a run, relative to the terms that cancel in them, without a list.
//!
//! The sums of module `balance` are those of the start, where points are generic. Here a covector comes with the size
//! of its round-off.

/// The violation of a law that is taken for round-off, relative to the terms that cancel. It is a hundred times that at
/// the start: a closure may lose two digits on the way.
pub(super) const TOLERANCE: f64 = 1e-8;

/// The weight of a size of which a few `ε` are round-off.
const ROUNDING: f64 = 16.0 * f64::EPSILON / TOLERANCE;

/// A covector and the sizes of which a few `ε` are its round-off.
pub(super) type Rounded<'a> = [&'a [f64]; 2];

/// Replaces sizes that are zero by the largest one, or by 1.
pub(super) fn make_positive(sizes: &mut [f64]) {
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let other = if largest > 0.0 { largest } else { 1.0 };
    for size in sizes {
        *size = if *size > 0.0 { *size } else { other };
    }
}

/// Calls a function of sums in an instance for small sizes, or in that for any.
macro_rules! by_size {
    ($n:expr, $sum:ident($($argument:expr),*)) => {
        match $n {
            1 => $sum::<1>($($argument),*),
            2 => $sum::<2>($($argument),*),
            3 => $sum::<3>($($argument),*),
            4 => $sum::<4>($($argument),*),
            5 => $sum::<5>($($argument),*),
            6 => $sum::<6>($($argument),*),
            _ => $sum::<0>($($argument),*),
        }
    };
}

/// The number of directions, which the instance `N` knows, and that for any size, 0, does not.
#[inline(always)]
fn size<const N: usize>(units: &[f64]) -> usize {
    if N == 0 { units.len() } else { N }
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
pub(super) fn product(a: &[f64], w: Rounded<'_>, units: &[f64]) -> f64 {
    by_size!(units.len(), product_of(a, w, units))
}

#[inline(always)]
fn product_of<const N: usize>(a: &[f64], [w, rounding]: Rounded<'_>, units: &[f64]) -> f64 {
    let n = size::<N>(units);
    let (a, units, w, rounding) = (&a[..n * n], &units[..n], &w[..n], &rounding[..n]);
    let row = |i: usize| {
        let mut row = Sum::default();
        (0..n).for_each(|j| row.add(a[i * n + j] * w[j], a[i * n + j] * rounding[j]));
        row
    };
    let largest = (0..n).map(|i| row(i).terms / units[i]).fold(0.0, f64::max);
    (0..n).map(|i| row(i).beside(largest * units[i]).abs()).fold(0.0, f64::max)
}

/// Computes the relative size of `⟨α, A β⟩`.
pub(super) fn form(
    a: &[f64],
    [[alpha, of_alpha], [beta, of_beta]]: [Rounded<'_>; 2],
    units: &[f64],
) -> f64 {
    let n = units.len();
    let (mut sum, mut rate) = (Sum::default(), 0.0_f64);
    for i in 0..n {
        for j in 0..n {
            let entry = a[i * n + j];
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
pub(super) fn pairing([alpha, rounding]: Rounded<'_>, v: &[f64], units: &[f64]) -> f64 {
    let (mut sum, n) = (Sum::default(), units.len());
    (0..n).for_each(|i| sum.add(alpha[i] * v[i], rounding[i] * v[i]));
    let rate = (0..n).map(|i| (v[i] / units[i]).abs()).fold(0.0, f64::max);
    let size = (0..n).map(|i| (alpha[i] * units[i]).abs()).fold(0.0, f64::max);
    sum.beside(size * rate)
}

/// The largest entry of a tensor on covectors in the given units; 0 where it has lost its digits.
#[inline(always)]
fn largest<const N: usize>(a: &[f64], units: &[f64]) -> f64 {
    let n = size::<N>(units);
    let (a, units) = (&a[..n * n], &units[..n]);
    let (mut plain, mut scaled) = (0.0_f64, 0.0_f64);
    for i in 0..n {
        for j in 0..n {
            plain = plain.max(a[i * n + j].abs());
            scaled = scaled.max((a[i * n + j] / units[i] / units[j]).abs());
        }
    }
    if plain * f64::EPSILON > f64::MIN_POSITIVE && scaled.is_finite() { scaled } else { 0.0 }
}

/// Computes the largest relative difference of an entry from the transposed one times the `sign`.
pub(super) fn asymmetry(a: &[f64], sign: f64, units: &[f64]) -> f64 {
    by_size!(units.len(), asymmetry_of(a, sign, units))
}

#[inline(always)]
fn asymmetry_of<const N: usize>(a: &[f64], sign: f64, units: &[f64]) -> f64 {
    let n = size::<N>(units);
    let (a, units) = (&a[..n * n], &units[..n]);
    let (top, mut worst) = (largest::<N>(a, units), 0.0_f64);
    if top == 0.0 {
        return 0.0;
    }
    for i in 0..n {
        for j in 0..=i {
            let mut sum = Sum::default();
            sum.add(a[i * n + j], 0.0);
            sum.add(-sign * a[j * n + i], 0.0);
            worst = worst.max(sum.beside(top * units[i] * units[j]).abs());
        }
    }
    worst
}

/// Measures how far a symmetric tensor `k` on covectors is from positive semidefinite: the most negative pivot of
/// its `LDLᵀ` decomposition with diagonal pivoting, after a scaling to a diagonal of ones. It works in the room `a`, of
/// `n² + n` numbers.
pub(super) fn indefiniteness(k: &[f64], units: &[f64], a: &mut [f64]) -> f64 {
    by_size!(units.len(), indefiniteness_of(k, units, a))
}

#[inline(always)]
fn indefiniteness_of<const N: usize>(k: &[f64], units: &[f64], a: &mut [f64]) -> f64 {
    let n = size::<N>(units);
    let (k, units) = (&k[..n * n], &units[..n]);
    let top = largest::<N>(k, units);
    if top == 0.0 {
        return 0.0;
    }
    let hat = |i: usize, j: usize| 0.5 * (k[i * n + j] + k[j * n + i]) / units[i] / units[j] / top;
    let (a, size) = a.split_at_mut(n * n);
    let size = &mut size[..n];
    (0..n).for_each(|i| size[i] = (hat(i, i).abs() + ROUNDING).sqrt());
    for i in 0..n {
        (0..n).for_each(|j| a[i * n + j] = hat(i, j) / (size[i] * size[j]));
    }
    let mut worst = 0.0_f64;
    for p in 0..n {
        let mut pivot = p;
        for i in p..n {
            worst = worst.max(-a[i * n + i]);
            if a[i * n + i] > a[pivot * n + pivot] {
                pivot = i;
            }
        }
        exchange(a, n, p, pivot);
        if a[p * n + p] <= TOLERANCE {
            // |a_ij| ≤ √(a_ii a_jj) in a semidefinite matrix, and the diagonal is zero here.
            for i in p..n {
                for j in p..n {
                    worst = worst.max(a[i * n + j].abs());
                }
            }
            return worst;
        }
        for i in p + 1..n {
            for j in p + 1..n {
                let rank_one = a[i * n + p] * a[p * n + j] / a[p * n + p];
                a[i * n + j] -= rank_one;
            }
        }
    }
    worst
}

/// Exchanges two rows, and the columns of the same indices.
#[inline(always)]
fn exchange(a: &mut [f64], n: usize, p: usize, q: usize) {
    for k in 0..n {
        a.swap(p * n + k, q * n + k);
    }
    for k in 0..n {
        a.swap(k * n + p, k * n + q);
    }
}
