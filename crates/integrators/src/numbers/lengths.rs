//! Lists of numbers whose lengths are known at run time, or when this library is compiled.

use std::fmt::Debug;
use std::ops::{Deref, DerefMut, Index, IndexMut};

use crate::step::{Directions, Entries, Few, StateSpace, Values, Vector, norm};

/// A list of numbers.
pub(crate) trait List: Clone + Debug {
    /// Room for so many numbers, which are zeros. A length that is known when this library is compiled is not asked for.
    fn room(count: impl FnOnce() -> usize) -> Self;

    /// Its numbers.
    fn numbers(&self) -> &[f64];

    /// Its numbers, to be changed.
    fn numbers_mut(&mut self) -> &mut [f64];

    /// The numbers of a slice.
    #[inline]
    fn of(numbers: &[f64]) -> Self {
        let mut list = Self::room(|| numbers.len());
        list.numbers_mut().copy_from_slice(numbers);
        list
    }
}

macro_rules! list {
    ($([$($generics:tt)*] $list:ty: $count:ident => $zeros:expr, $numbers:ident, $to_change:ident;)*) => {$(
        impl<$($generics)*> List for $list {
            #[inline]
            fn room($count: impl FnOnce() -> usize) -> Self {
                $zeros
            }

            #[inline]
            fn numbers(&self) -> &[f64] {
                self.$numbers()
            }

            #[inline]
            fn numbers_mut(&mut self) -> &mut [f64] {
                self.$to_change()
            }
        }
    )*};
}

list! {
    [] Entries: count => Self::zeros(count()), as_ref, deref_mut;
    [] Directions: count => Self::zeros(count()), numbers, numbers_mut;
    [const N: usize] Few<N>: count => Self::zeros(count()), deref, deref_mut;
    [const N: usize] [f64; N]: _count => [0.0; N], as_slice, as_mut_slice;
    [const N: usize] Array<N>: _count => Self([0.0; N]), deref, deref_mut;
    [const R: usize, const C: usize] [[f64; C]; R]: _count => [[0.0; C]; R], as_flattened, as_flattened_mut;
}

/// A vector of `N` numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Array<const N: usize>([f64; N]);

impl<const N: usize> Deref for Array<N> {
    type Target = [f64];

    #[inline]
    fn deref(&self) -> &[f64] {
        &self.0
    }
}

impl<const N: usize> DerefMut for Array<N> {
    #[inline]
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.0
    }
}

impl<const N: usize> Index<usize> for Array<N> {
    type Output = f64;

    #[inline]
    fn index(&self, i: usize) -> &f64 {
        &self.0[i]
    }
}

impl<const N: usize> IndexMut<usize> for Array<N> {
    #[inline]
    fn index_mut(&mut self, i: usize) -> &mut f64 {
        &mut self.0[i]
    }
}

impl<const N: usize> Vector for Array<N> {
    #[inline]
    fn len(&self) -> usize {
        N
    }

    #[inline]
    fn get(&self, i: usize) -> f64 {
        self.0[i]
    }

    #[inline]
    fn with(&self, mut number: impl FnMut(usize) -> f64) -> Self {
        let (mut v, mut i) = ([0.0; N], 0);
        while i < N {
            v[i] = number(i);
            i += 1;
        }
        Self(v)
    }

    #[inline]
    fn zip<const K: usize>(vectors: [&Self; K], f: impl Fn([f64; K]) -> f64 + Sync) -> Self {
        let (mut v, mut i) = ([0.0; N], 0);
        while i < N {
            v[i] = f(at(vectors, i));
            i += 1;
        }
        Self(v)
    }

    #[inline(always)]
    fn combination<'a>(h: f64, count: usize, term: impl Fn(usize) -> (f64, &'a Self)) -> Self {
        let (mut sum, mut j) = ([0.0; N], 0);
        while j < count {
            let ((w, v), mut i) = (term(j), 0);
            while i < N {
                sum[i] = if j == 0 { w * v.0[i] } else { sum[i] + w * v.0[i] };
                i += 1;
            }
            j += 1;
        }
        Self(sum).map(|sum| h * sum)
    }

    /// Gives the bits of the default, and takes each ratio once.
    #[inline]
    fn relative_to(&self, sizes: &Self) -> f64 {
        let ratio = |[v, size]: [f64; 2]| if v == 0.0 { 0.0 } else { (v / size).abs() };
        let ratios = Self::zip([self, sizes], ratio);
        norm(N, |i| ratios.0[i])
    }

    /// Gives the bits of the default, which divides by one.
    #[inline]
    fn norm_of<const K: usize>(vectors: [&Self; K], f: impl Fn([f64; K]) -> f64 + Sync) -> f64 {
        let numbers = Self::zip(vectors, |numbers| f(numbers).abs());
        norm(N, |i| numbers.0[i])
    }

    /// Gives the bits of the default, and takes each pair of numbers once.
    #[inline]
    fn norms_of<const K: usize>(
        vectors: [&Self; K],
        f: impl Fn([f64; K]) -> [f64; 2] + Sync,
    ) -> [f64; 2] {
        let (mut first, mut second, mut i) = ([0.0; N], [0.0; N], 0);
        while i < N {
            let [a, b] = f(at(vectors, i));
            (first[i], second[i]) = (a.abs(), b.abs());
            i += 1;
        }
        [norm(N, |i| first[i]), norm(N, |i| second[i])]
    }
}

/// The numbers that vectors have at one place. A loop over indices, of which the compiler makes less than of iterators.
#[inline(always)]
fn at<const N: usize, const K: usize>(vectors: [&Array<N>; K], i: usize) -> [f64; K] {
    let (mut numbers, mut k) = ([0.0; K], 0);
    while k < K {
        numbers[k] = vectors[k].0[i];
        k += 1;
    }
    numbers
}

/// The lists of a flow.
pub(crate) trait Lengths: Debug + 'static {
    /// The entries of a state.
    type State: List + PartialEq;
    /// A number for each direction.
    type Vector: Vector + List + IndexMut<usize, Output = f64>;
    /// Numbers for each pair of directions, row by row.
    type Matrix: List;
    /// A number for each further invariant.
    type Invariants: AsRef<[f64]> + IndexMut<usize, Output = f64> + Clone + Debug;
    /// A number for each law.
    type Values: List;
    /// A covector for each law, one after another.
    type Rows: List;

    /// Says whether there may be further invariants.
    const HAS_INVARIANTS: bool;

    /// Says whether a system of these lengths lives on a vector space with the canonical metric.
    const IS_FLAT: bool = false;

    /// The number of directions, of which there are `count` if it is not known.
    fn directions(count: usize) -> usize;

    /// The numbers of a slice.
    fn invariants(numbers: &[f64]) -> Self::Invariants;
}

/// Known at run time.
#[derive(Clone, Copy, Debug)]
pub struct AtRunTime;

impl Lengths for AtRunTime {
    type State = Entries;
    type Vector = Directions;
    type Matrix = Few<16>;
    type Invariants = Values;
    type Values = Few<3>;
    type Rows = Few<16>;

    const HAS_INVARIANTS: bool = true;

    #[inline]
    fn directions(count: usize) -> usize {
        count
    }

    #[inline]
    fn invariants(numbers: &[f64]) -> Values {
        Values::of(numbers)
    }
}

/// States that are arrays of `E` numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Arrays<const E: usize>;

impl<const E: usize> StateSpace for Arrays<E> {
    type Element = [f64; E];

    fn numbers(x: &[f64; E]) -> Vec<f64> {
        x.to_vec()
    }
}

/// Known when this library is compiled: `N` directions, `E` entries, and no further invariant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known<const N: usize, const E: usize>;

impl<const N: usize, const E: usize> Lengths for Known<N, E> {
    type State = [f64; E];
    type Vector = Array<N>;
    type Matrix = [[f64; N]; N];
    type Invariants = [f64; 0];
    type Values = [f64; 2];
    type Rows = [[f64; N]; 2];

    const HAS_INVARIANTS: bool = false;

    const IS_FLAT: bool = N == E;

    #[inline]
    fn directions(_: usize) -> usize {
        N
    }

    #[inline]
    fn invariants(_: &[f64]) -> [f64; 0] {
        []
    }
}
