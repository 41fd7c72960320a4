//! Numbers for the directions of a flow, of a length that is known at compile time or not.

use std::fmt::Debug;

use metriplectic_fields::Column;

use super::both;

/// A number for each direction of a [`Flow`](crate::Flow): `Vec<f64>`, or the [`Components`] of a vector of
/// fixed length.
pub trait Vector: Clone + Debug + 'static {
    /// How many there are.
    fn len(&self) -> usize;

    /// The number of direction `i`.
    fn get(&self, i: usize) -> f64;

    /// As many numbers, given by their index.
    #[must_use]
    fn with(&self, number: impl FnMut(usize) -> f64) -> Self;

    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// As many zeros.
    #[must_use]
    #[inline]
    fn zero(&self) -> Self {
        self.with(|_| 0.0)
    }

    /// A function of each number.
    #[must_use]
    #[inline]
    fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        self.with(|i| f(self.get(i)))
    }

    /// A function of the numbers that several vectors of one length have at the same place.
    #[must_use]
    #[inline]
    fn zip<const K: usize>(vectors: [&Self; K], f: impl Fn([f64; K]) -> f64 + Sync) -> Self {
        const { assert!(K > 0, "a function of no vectors has no length") };
        vectors[0].with(|i| {
            let mut numbers = [0.0; K];
            for (number, v) in numbers.iter_mut().zip(vectors) {
                *number = v.get(i);
            }
            f(numbers)
        })
    }

    /// `h Σ_j w_j v_j` over `count > 0` vectors of one length, given with their weights by their index.
    #[must_use]
    #[inline]
    fn combination<'a>(h: f64, count: usize, term: impl Fn(usize) -> (f64, &'a Self)) -> Self
    where
        Self: 'a,
    {
        let (w, first) = term(0);
        let start = first.map(|k| w * k);
        let sum = (1..count).fold(start, |sum, j| {
            let (w, v) = term(j);
            sum.with(|i| sum.get(i) + w * v.get(i))
        });
        sum.map(|q| h * q)
    }

    /// The norm of numbers without a unit, a function of what several vectors have at the same place, as
    /// [`relative_to`](Self::relative_to) has it of ratios. A large vector needs no array for them.
    #[must_use]
    fn norm_of<const K: usize>(vectors: [&Self; K], f: impl Fn([f64; K]) -> f64 + Sync) -> f64 {
        let numbers = Self::zip(vectors, f);
        numbers.relative_to(&numbers.map(|_| 1.0))
    }

    /// Returns whether [`norm_of`](Self::norm_of) is below a bound. A large vector looks at no more of its numbers than it
    /// needs.
    #[must_use]
    fn is_norm_below<const K: usize>(
        vectors: [&Self; K],
        f: impl Fn([f64; K]) -> f64 + Sync,
        bound: f64,
    ) -> bool {
        Self::norm_of(vectors, f) < bound
    }

    /// Two such norms, in one pass where that is cheaper.
    #[must_use]
    #[inline]
    fn norms_of<const K: usize>(
        vectors: [&Self; K],
        f: impl Fn([f64; K]) -> [f64; 2] + Sync,
    ) -> [f64; 2] {
        both([0, 1], |which| Self::norm_of(vectors, |numbers| f(numbers)[which]))
    }

    /// The norm of the ratios `v_i/s_i` to the sizes `s_i`, where `0/0 = 0`; NaN if a ratio is.
    ///
    /// The default is the Euclidean norm, which bounds each ratio and which no rotation of the frame of a curved
    /// factor changes.
    #[must_use]
    fn relative_to(&self, sizes: &Self) -> f64 {
        let ratio = |i| if self.get(i) == 0.0 { 0.0 } else { (self.get(i) / sizes.get(i)).abs() };
        // Squares of 10⁻²⁰⁰ are zero; those of numbers up to 1 are not too large.
        let mut largest = 0.0;
        for i in 0..self.len() {
            if ratio(i).is_nan() {
                return f64::NAN;
            }
            largest = f64::max(largest, ratio(i));
        }
        if largest >= f64::MIN_POSITIVE && largest.is_finite() {
            let unit = largest.recip();
            let sum =
                (0..self.len()).fold(0.0, |sum, i| sum + (ratio(i) * unit) * (ratio(i) * unit));
            largest * sum.sqrt()
        } else {
            largest
        }
    }

    /// The largest of the ratios `|v_i|/s_i` of the numbers beyond [`len`](Self::len) to their sizes, of those that have one; zero
    /// without such numbers.
    #[inline]
    fn beside_relative_to(&self, sizes: &Self) -> f64 {
        let _ = sizes;
        0.0
    }

    /// The number of sites, if these are the numbers of a system of sites, one site after the other.
    #[inline]
    fn sites(&self) -> Option<usize> {
        None
    }

    /// The site with the largest norm of the ratios `v_i/s_i` to the sizes `s_i`, and the first of several; `None`
    /// without [`sites`](Self::sites), or if all ratios are zero.
    fn largest_site(&self, sizes: &Self) -> Option<usize> {
        let _ = sizes;
        None
    }

    /// The numbers in a list.
    fn to_list(&self) -> Vec<f64> {
        (0..self.len()).map(|i| self.get(i)).collect()
    }

    /// The numbers in a list for [`with_list`](Self::with_list): one for each kind if entries of a kind are equal by
    /// construction.
    fn to_short_list(&self) -> Vec<f64> {
        self.to_list()
    }

    /// How many kinds of entries there are: one for each entry, or one for each entry of a site if the sites are
    /// alike. Entry `i` is of the kind `i % kinds`.
    fn kinds(&self) -> usize {
        self.len()
    }

    /// The largest absolute value of each kind of entry, for all entries of this kind.
    #[must_use]
    fn by_kind(&self) -> Self {
        self.map(f64::abs)
    }

    /// As many numbers, given by a list with one for each entry, or one for each [kind](Self::kinds); `None` if the
    /// list has another length.
    #[must_use]
    fn with_list(&self, list: &[f64]) -> Option<Self> {
        let kinds = list.len();
        (kinds == self.len() || kinds == self.kinds()).then(|| self.with(|i| list[i % kinds]))
    }
}

impl Vector for Vec<f64> {
    fn len(&self) -> usize {
        self.len()
    }

    fn get(&self, i: usize) -> f64 {
        self[i]
    }

    fn with(&self, number: impl FnMut(usize) -> f64) -> Self {
        (0..self.len()).map(number).collect()
    }
}

/// The components of a vector of fixed length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Components<V>(pub V);

impl<V: Column<f64>> Vector for Components<V> {
    #[inline]
    fn len(&self) -> usize {
        V::LEN
    }

    #[inline]
    fn get(&self, i: usize) -> f64 {
        self.0[i]
    }

    #[inline]
    fn with(&self, number: impl FnMut(usize) -> f64) -> Self {
        Self(V::from_index(number))
    }

    #[inline]
    fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        Self(V::from_index(|i| f(self.0[i])))
    }

    #[inline]
    fn zip<const K: usize>(vectors: [&Self; K], f: impl Fn([f64; K]) -> f64 + Sync) -> Self {
        Self(V::from_index(|i| f(at(vectors, i))))
    }

    #[inline(always)]
    fn combination<'a>(h: f64, count: usize, term: impl Fn(usize) -> (f64, &'a Self)) -> Self
    where
        Self: 'a,
    {
        let (w, first) = term(0);
        let mut sum = first.0 * w;
        for j in 1..count {
            let (w, v) = term(j);
            sum += v.0 * w;
        }
        Self(sum * h)
    }

    /// Gives the bits of the default, and takes each ratio once.
    #[inline]
    fn relative_to(&self, sizes: &Self) -> f64 {
        let ratio = |i| if self.0[i] == 0.0 { 0.0 } else { (self.0[i] / sizes.0[i]).abs() };
        let ratios = V::from_index(ratio);
        norm(V::LEN, |i| ratios[i])
    }

    /// Gives the bits of the default, which divides by one.
    #[inline]
    fn norm_of<const K: usize>(vectors: [&Self; K], f: impl Fn([f64; K]) -> f64 + Sync) -> f64 {
        let numbers = V::from_index(|i| f(at(vectors, i)).abs());
        norm(V::LEN, |i| numbers[i])
    }

    /// Gives the bits of the default, and takes each pair of numbers once.
    #[inline]
    fn norms_of<const K: usize>(
        vectors: [&Self; K],
        f: impl Fn([f64; K]) -> [f64; 2] + Sync,
    ) -> [f64; 2] {
        let (mut first, mut second) = (V::zero(), V::zero());
        for i in 0..V::LEN {
            let [a, b] = f(at(vectors, i));
            (first[i], second[i]) = (a.abs(), b.abs());
        }
        [norm(V::LEN, |i| first[i]), norm(V::LEN, |i| second[i])]
    }
}

/// The numbers that vectors have at one place. A loop, because the compiler calls the closure of `array::map`.
#[inline(always)]
fn at<V: Column<f64>, const K: usize>(vectors: [&Components<V>; K], i: usize) -> [f64; K] {
    let mut numbers = [0.0; K];
    for (number, v) in numbers.iter_mut().zip(vectors) {
        *number = v.0[i];
    }
    numbers
}

/// The Euclidean norm of so many numbers that are not negative; NaN if one is.
#[inline(always)]
pub(crate) fn norm(count: usize, number: impl Fn(usize) -> f64) -> f64 {
    let (mut largest, mut check) = (0.0, 0.0);
    for i in 0..count {
        check += number(i);
        largest = f64::max(largest, number(i));
    }
    if check.is_nan() {
        return f64::NAN;
    }
    if largest >= f64::MIN_POSITIVE && largest.is_finite() {
        let unit = largest.recip();
        let mut sum = 0.0;
        for i in 0..count {
            sum += (number(i) * unit) * (number(i) * unit);
        }
        largest * sum.sqrt()
    } else {
        largest
    }
}
