//! Directions of an open flow whose number is known at run time: those of its points, with the clock and what is booked beside them.

use crate::round_off::bound::SUMMED;
use crate::step::Vector;

/// A displacement or a rate of an open flow: the numbers of its points, which alone count in norms, and those of the clock
/// and of the ledger beyond [`len`](Vector::len). A combination of rates integrates all of them.
#[derive(Clone, Debug)]
pub struct Beside<V> {
    /// The numbers of the points.
    pub v: V,
    /// The time, the work of the time in the energy, and what ports and baths book.
    pub beside: Vec<f64>,
}

impl<V: Vector> Vector for Beside<V> {
    fn len(&self) -> usize {
        self.v.len()
    }

    #[inline]
    fn get(&self, i: usize) -> f64 {
        match i.checked_sub(self.v.len()) {
            None => self.v.get(i),
            Some(i) => self.beside[i],
        }
    }

    fn with(&self, mut number: impl FnMut(usize) -> f64) -> Self {
        let length = self.v.len();
        let v = self.v.with(&mut number);
        Self { v, beside: (0..self.beside.len()).map(|i| number(length + i)).collect() }
    }

    fn zero(&self) -> Self {
        Self { v: self.v.zero(), beside: vec![0.0; self.beside.len()] }
    }

    fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        Self { beside: self.beside.iter().map(|&x| f(x)).collect(), v: self.v.map(f) }
    }

    fn zip<const K: usize>(vectors: [&Self; K], f: impl Fn([f64; K]) -> f64 + Sync) -> Self {
        let count = vectors[0].beside.len();
        let beside = (0..count).map(|i| f(vectors.map(|v| v.beside[i]))).collect();
        Self { v: V::zip(vectors.map(|v| &v.v), f), beside }
    }

    fn combination<'a>(h: f64, count: usize, term: impl Fn(usize) -> (f64, &'a Self)) -> Self
    where
        Self: 'a,
    {
        let beside = (0..term(0).1.beside.len()).map(|i| {
            let of = |j: usize| term(j).0 * term(j).1.beside[i];
            let sum = (1..count).fold(of(0), |sum, j| sum + of(j));
            // The rows of a tableau have entries of tens, whose rounding would set the clock of a stage beyond the end.
            let size = || (0..count).fold(0.0, |size, j| size + of(j).abs());
            let is_end = i == 0 && (sum - 1.0).abs() <= SUMMED * size();
            h * if is_end { 1.0 } else { sum }
        });
        let beside = beside.collect();
        let v = V::combination(h, count, |j| {
            let (w, v) = term(j);
            (w, &v.v)
        });
        Self { v, beside }
    }

    fn relative_to(&self, sizes: &Self) -> f64 {
        self.v.relative_to(&sizes.v)
    }

    fn norm_of<const K: usize>(vectors: [&Self; K], f: impl Fn([f64; K]) -> f64 + Sync) -> f64 {
        V::norm_of(vectors.map(|v| &v.v), f)
    }

    fn norms_of<const K: usize>(
        vectors: [&Self; K],
        f: impl Fn([f64; K]) -> [f64; 2] + Sync,
    ) -> [f64; 2] {
        V::norms_of(vectors.map(|v| &v.v), f)
    }

    fn beside_relative_to(&self, sizes: &Self) -> f64 {
        // The clock has no size, nor has an entry in which nothing flows.
        let sized = self.beside.iter().zip(&sizes.beside).filter(|(_, size)| **size > 0.0);
        sized.fold(0.0, |most, (number, size)| {
            let ratio = (number / size).abs();
            if ratio.is_nan() || ratio > most { ratio } else { most }
        })
    }

    fn sites(&self) -> Option<usize> {
        self.v.sites()
    }

    fn largest_site(&self, sizes: &Self) -> Option<usize> {
        self.v.largest_site(&sizes.v)
    }

    fn to_list(&self) -> Vec<f64> {
        let mut list = self.v.to_list();
        list.extend(&self.beside);
        list
    }

    /// The short list of the points, then the clock and the ledger; the whole list if this one has the length of a list of the points.
    fn to_short_list(&self) -> Vec<f64> {
        let mut list = self.v.to_short_list();
        list.extend(&self.beside);
        if list.len() == self.v.len() { self.to_list() } else { list }
    }

    fn kinds(&self) -> usize {
        self.v.kinds()
    }

    fn by_kind(&self) -> Self {
        Self { v: self.v.by_kind(), beside: self.beside.clone() }
    }

    fn with_list(&self, list: &[f64]) -> Option<Self> {
        let (length, count) = (self.v.len(), self.beside.len());
        let of_points = [length, self.v.kinds()];
        let split = list.len().checked_sub(count).filter(|split| of_points.contains(split));
        match split {
            Some(split) if !of_points.contains(&list.len()) => {
                let (v, beside) = list.split_at(split);
                Some(Self { v: self.v.with_list(v)?, beside: beside.to_vec() })
            }
            _ => Some(Self { v: self.v.with_list(list)?, beside: vec![0.0; count] }),
        }
    }
}
