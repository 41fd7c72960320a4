//! States and vectors in plain numbers, without an allocation where they are few.

use std::ops::{Deref, DerefMut, Index, IndexMut};

use super::Vector;
use super::vector::norm;

/// A list of numbers, of which up to `N` stand in it and more of them in an array of their own.
#[derive(Clone, Debug)]
pub(crate) enum Few<const N: usize> {
    Here(usize, [f64; N]),
    There(Vec<f64>),
}

impl<const N: usize> Few<N> {
    /// So many zeros.
    #[inline(always)]
    pub(crate) fn zeros(count: usize) -> Self {
        if count <= N { Self::Here(count, [0.0; N]) } else { Self::There(vec![0.0; count]) }
    }

    #[inline(always)]
    pub(crate) fn of(numbers: &[f64]) -> Self {
        let mut few = Self::zeros(numbers.len());
        few.copy_from_slice(numbers);
        few
    }
}

impl<const N: usize> Deref for Few<N> {
    type Target = [f64];

    #[inline(always)]
    fn deref(&self) -> &[f64] {
        match self {
            Self::Here(count, numbers) => &numbers[..*count],
            Self::There(numbers) => numbers,
        }
    }
}

impl<const N: usize> DerefMut for Few<N> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f64] {
        match self {
            Self::Here(count, numbers) => &mut numbers[..*count],
            Self::There(numbers) => numbers,
        }
    }
}

impl<const N: usize> PartialEq for Few<N> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

/// The entries of a state: a slice of numbers, made of an array or of a `Vec`.
///
/// ```
/// use metriplectic_integrators::Entries;
/// let x = Entries::from([0.4, -1.0, 0.3]);
/// assert!(x == vec![0.4, -1.0, 0.3] && x[1] == -1.0 && x.len() == 3);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Entries(Few<12>);

impl Entries {
    /// So many zeros.
    #[inline]
    pub(crate) fn zeros(count: usize) -> Self {
        Self(Few::zeros(count))
    }
}

impl Deref for Entries {
    type Target = [f64];

    #[inline]
    fn deref(&self) -> &[f64] {
        &self.0
    }
}

impl DerefMut for Entries {
    #[inline]
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.0
    }
}

impl<'a> IntoIterator for &'a Entries {
    type Item = &'a f64;
    type IntoIter = std::slice::Iter<'a, f64>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl From<&[f64]> for Entries {
    #[inline]
    fn from(entries: &[f64]) -> Self {
        Self(Few::of(entries))
    }
}

impl From<Vec<f64>> for Entries {
    fn from(entries: Vec<f64>) -> Self {
        if entries.len() > 12 { Self(Few::There(entries)) } else { Self::from(entries.as_slice()) }
    }
}

impl<const N: usize> From<[f64; N]> for Entries {
    fn from(entries: [f64; N]) -> Self {
        Self::from(entries.as_slice())
    }
}

impl From<Entries> for Vec<f64> {
    fn from(entries: Entries) -> Self {
        entries.to_vec()
    }
}

impl AsRef<[f64]> for Entries {
    fn as_ref(&self) -> &[f64] {
        self
    }
}

impl PartialEq<[f64]> for Entries {
    fn eq(&self, other: &[f64]) -> bool {
        **self == *other
    }
}

impl PartialEq<Vec<f64>> for Entries {
    fn eq(&self, other: &Vec<f64>) -> bool {
        **self == **other
    }
}

impl<const N: usize> PartialEq<[f64; N]> for Entries {
    fn eq(&self, other: &[f64; N]) -> bool {
        **self == *other
    }
}

impl FromIterator<f64> for Entries {
    fn from_iter<I: IntoIterator<Item = f64>>(entries: I) -> Self {
        entries.into_iter().collect::<Vec<f64>>().into()
    }
}

/// A number for each further invariant.
#[derive(Clone, Debug, PartialEq)]
pub struct Values(Few<2>);

impl Values {
    /// The numbers of a slice.
    #[inline]
    pub fn of(numbers: &[f64]) -> Self {
        Self(Few::of(numbers))
    }
}

impl AsRef<[f64]> for Values {
    #[inline]
    fn as_ref(&self) -> &[f64] {
        &self.0
    }
}

impl Index<usize> for Values {
    type Output = f64;

    #[inline]
    fn index(&self, index: usize) -> &f64 {
        &self.0[index]
    }
}

impl IndexMut<usize> for Values {
    #[inline]
    fn index_mut(&mut self, index: usize) -> &mut f64 {
        &mut self.0[index]
    }
}

/// A vector of which the number of its numbers is known at run time alone. Those of a ledger stand beside the others, at its
/// end.
#[derive(Clone, Debug, PartialEq)]
pub struct Directions {
    all: Few<8>,
    beside: usize,
}

impl Directions {
    /// So many zeros.
    #[inline]
    pub(crate) fn zeros(count: usize) -> Self {
        Self::beside(count, 0)
    }

    /// So many zeros, with so many of a ledger among them.
    #[inline]
    pub(crate) fn beside(count: usize, beside: usize) -> Self {
        Self { all: Few::zeros(count), beside }
    }

    /// The numbers of a slice.
    #[inline]
    pub fn of(numbers: &[f64]) -> Self {
        Self { all: Few::of(numbers), beside: 0 }
    }

    /// So many numbers, given by their index.
    #[inline]
    pub(crate) fn from_index(count: usize, number: impl FnMut(usize) -> f64) -> Self {
        Self::zeros(count).with(number)
    }

    /// All numbers.
    #[inline]
    pub fn numbers(&self) -> &[f64] {
        &self.all
    }

    /// All numbers, to be changed.
    #[inline]
    pub fn numbers_mut(&mut self) -> &mut [f64] {
        &mut self.all
    }

    /// The norm of numbers that are not negative.
    #[inline]
    fn norm(&self) -> f64 {
        let numbers = &self.all[..self.len()];
        norm(numbers.len(), |i| numbers[i])
    }
}

impl Index<usize> for Directions {
    type Output = f64;

    #[inline]
    fn index(&self, i: usize) -> &f64 {
        &self.all[i]
    }
}

impl IndexMut<usize> for Directions {
    #[inline]
    fn index_mut(&mut self, i: usize) -> &mut f64 {
        &mut self.all[i]
    }
}

/// The arrays of vectors, if their numbers stand in them, and how many there are.
#[inline(always)]
fn here<const K: usize>(vectors: [&Directions; K]) -> Option<(usize, [&[f64; 8]; K])> {
    let mut arrays = [&[0.0; 8]; K];
    let mut all = 8;
    for (array, v) in arrays.iter_mut().zip(vectors) {
        let Few::Here(count, numbers) = &v.all else { return None };
        (*array, all) = (numbers, all.min(*count));
    }
    Some((all, arrays))
}

/// The numbers that vectors have at one place.
#[inline(always)]
fn at<V: ?Sized + Index<usize, Output = f64>, const K: usize>(
    vectors: [&V; K],
    i: usize,
) -> [f64; K] {
    let mut numbers = [0.0; K];
    for (number, v) in numbers.iter_mut().zip(vectors) {
        *number = v[i];
    }
    numbers
}

impl Vector for Directions {
    #[inline]
    fn len(&self) -> usize {
        self.all.len() - self.beside
    }

    #[inline]
    fn get(&self, i: usize) -> f64 {
        self.all[i]
    }

    #[inline]
    fn with(&self, mut number: impl FnMut(usize) -> f64) -> Self {
        let mut v = Self::beside(self.all.len(), self.beside);
        v.all.iter_mut().enumerate().for_each(|(i, to)| *to = number(i));
        v
    }

    #[inline]
    fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        let mut v = self.clone();
        v.all.iter_mut().for_each(|number| *number = f(*number));
        v
    }

    #[inline]
    fn zip<const K: usize>(vectors: [&Self; K], f: impl Fn([f64; K]) -> f64 + Sync) -> Self {
        const { assert!(K > 0, "a function of no vectors has no length") };
        if let Some((count, arrays)) = here(vectors) {
            let mut numbers = [0.0; 8];
            for (i, number) in numbers[..count].iter_mut().enumerate() {
                *number = f(at(arrays, i));
            }
            return Self { all: Few::Here(count, numbers), beside: vectors[0].beside };
        }
        vectors[0].with(|i| f(at(vectors.each_ref().map(|v| &*v.all), i)))
    }

    /// Gives the bits of the default, and takes each ratio once.
    #[inline]
    fn relative_to(&self, sizes: &Self) -> f64 {
        let ratio = |[v, size]: [f64; 2]| if v == 0.0 { 0.0 } else { (v / size).abs() };
        Self::zip([self, sizes], ratio).norm()
    }

    /// Gives the bits of the default, which divides by one.
    #[inline]
    fn norm_of<const K: usize>(vectors: [&Self; K], f: impl Fn([f64; K]) -> f64 + Sync) -> f64 {
        Self::zip(vectors, |numbers| f(numbers).abs()).norm()
    }

    /// Leaves out what has no size: a clock, and an entry in which nothing flows.
    #[inline]
    fn beside_relative_to(&self, sizes: &Self) -> f64 {
        let pairs = self.all.iter().zip(&*sizes.all).skip(self.len());
        let ratios = pairs.filter(|(_, size)| **size > 0.0).map(|(v, size)| (v / size).abs());
        ratios.fold(0.0, |most, ratio| if ratio.is_nan() || ratio > most { ratio } else { most })
    }

    fn to_list(&self) -> Vec<f64> {
        self.all.to_vec()
    }

    /// Takes the numbers of a ledger for zeros where they are left out.
    fn with_list(&self, list: &[f64]) -> Option<Self> {
        let known = [self.len(), self.all.len()].contains(&list.len());
        known.then(|| self.with(|i| list.get(i).copied().unwrap_or(0.0)))
    }

    /// Gives the bits of the default, and makes one row.
    #[inline]
    fn combination<'a>(h: f64, count: usize, term: impl Fn(usize) -> (f64, &'a Self)) -> Self {
        let (w, first) = term(0);
        let mut sum = first.map(|k| w * k);
        for j in 1..count {
            let (w, v) = term(j);
            sum.all.iter_mut().zip(&*v.all).for_each(|(sum, v)| *sum += w * v);
        }
        sum.all.iter_mut().for_each(|sum| *sum *= h);
        sum
    }
}
