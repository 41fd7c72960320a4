//! Numbers for the directions of a lattice.

use std::ops::Range;
use std::sync::Arc;

use metriplectic_fields::Column;
use metriplectic_integrators::Vector;

use crate::blocks::{self, Room, combine};
use crate::parallel;
use crate::pool::{Buffer, Pool};

/// A number for each direction at each site: one after the other, or the same ones at all sites.
///
/// Sizes of entries are the same at all sites, and cost no memory. Copies share their numbers until one is changed.
#[derive(Clone, Debug)]
pub struct SiteVector {
    sites: usize,
    stride: usize,
    numbers: Numbers,
    pool: Pool<f64>,
}

#[derive(Clone, Debug)]
enum Numbers {
    /// Those of one site, for all of them.
    Same(Vec<f64>),
    Each(Arc<Buffer<f64>>),
}

impl std::fmt::Debug for Pool<f64> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Pool")
    }
}

/// Numbers that are read site by site.
#[derive(Clone, Copy)]
pub(crate) struct Reader<'a> {
    numbers: &'a [f64],
    stride: usize,
}

impl Reader<'_> {
    #[inline(always)]
    pub(crate) fn at<V: Column<f64>>(&self, site: usize) -> V {
        let start = site * self.stride;
        let numbers = &self.numbers[start..start + V::LEN];
        V::from_index(|k| numbers[k])
    }
}

impl SiteVector {
    /// The same numbers at all sites.
    pub(crate) fn same(sites: usize, numbers: Vec<f64>, pool: &Pool<f64>) -> Self {
        let stride = numbers.len();
        Self { sites, stride, numbers: Numbers::Same(numbers), pool: pool.clone() }
    }

    /// `stride` numbers for each site.
    pub(crate) fn each(sites: usize, stride: usize, numbers: Buffer<f64>) -> Self {
        let pool = numbers.pool().clone();
        Self { sites, stride, numbers: Numbers::Each(Arc::new(numbers)), pool }
    }

    /// Adds a vector at one site of numbers that each site has for itself.
    pub(crate) fn add_at<V: Column<f64>>(&mut self, site: usize, more: &V) {
        if let Numbers::Each(numbers) = &mut self.numbers {
            let start = site * self.stride;
            let numbers = &mut Arc::make_mut(numbers)[start..start + V::LEN];
            for (k, number) in numbers.iter_mut().enumerate() {
                *number += more[k];
            }
        }
    }

    pub(crate) fn reader(&self) -> Reader<'_> {
        match &self.numbers {
            Numbers::Same(numbers) => Reader { numbers, stride: 0 },
            Numbers::Each(numbers) => Reader { numbers, stride: self.stride },
        }
    }

    fn filled(&self, f: impl Fn(usize, &mut [f64]) + Sync) -> Self {
        let mut numbers = self.pool.numbers(self.sites * self.stride);
        parallel::fill(&mut numbers, self.stride, |sites, out| f(sites.start * self.stride, out));
        Self::each(self.sites, self.stride, numbers)
    }

    fn slice(&self) -> Option<&[f64]> {
        match &self.numbers {
            Numbers::Same(_) => None,
            Numbers::Each(numbers) => Some(numbers),
        }
    }

    /// The terms of a combination. A vector that is the same at all sites adds nothing but itself, and is rare: `None`.
    pub(crate) fn terms<'a>(
        count: usize,
        term: impl Fn(usize) -> (f64, &'a Self),
    ) -> Option<Vec<(f64, &'a [f64])>> {
        (0..count).map(|j| Some((term(j).0, term(j).1.slice()?))).collect()
    }

    /// For each function of the numbers that vectors have at the same place, the root mean square over a site, and the
    /// largest site.
    fn norms<const K: usize, const M: usize>(
        vectors: [&Self; K],
        f: impl Fn([f64; K]) -> [f64; M] + Sync,
    ) -> [f64; M] {
        let stride = vectors[0].stride;
        let mean = (stride as f64).recip();
        let of = |sites: Range<usize>| {
            let mut largest = [0.0; M];
            let mut tiles: [Room; K] = std::array::from_fn(|_| Room::of(stride));
            let mut rooms: [Room; M] = std::array::from_fn(|_| Room::of(stride));
            let length = stride * blocks::sites_of(stride).min(sites.len());
            let tiles: [&[f64]; K] = {
                let mut slices = [&[][..]; K];
                for ((tile, slice), v) in tiles.iter_mut().zip(&mut slices).zip(vectors) {
                    if let Numbers::Same(numbers) = &v.numbers {
                        let tile = tile.numbers(length);
                        for site in tile.chunks_exact_mut(stride) {
                            site.copy_from_slice(numbers);
                        }
                        *slice = tile;
                    }
                }
                slices
            };
            for block in blocks::blocks(sites, stride) {
                let (start, count) = (block.start * stride, block.len() * stride);
                let mut slices = tiles;
                for (slice, v) in slices.iter_mut().zip(vectors) {
                    *slice = match v.slice() {
                        Some(numbers) => &numbers[start..start + count],
                        None => &slice[..count],
                    };
                }
                let mut out = rooms.each_mut().map(|room| room.numbers(count));
                for i in 0..count {
                    let numbers = f(slices.map(|slice| slice[i]));
                    for (out, number) in out.iter_mut().zip(numbers) {
                        out[i] = number;
                    }
                }
                for (largest, out) in largest.iter_mut().zip(out) {
                    for site in out.chunks_exact(stride) {
                        let sum = site.iter().fold(0.0, |sum, r| sum + r * r);
                        *largest = larger(*largest, (sum * mean).sqrt());
                    }
                }
            }
            largest
        };
        let merge = |mut most: [f64; M], part: [f64; M]| {
            most.iter_mut().zip(part).for_each(|(most, part)| *most = larger(*most, part));
            most
        };
        parallel::map(vectors[0].sites, of).into_iter().fold([0.0; M], merge)
    }

    /// The root mean square of the ratios `v_i/s_i` at each site.
    fn ratios<'a>(&'a self, sizes: &'a Self) -> impl Fn(usize) -> f64 + Sync + 'a {
        let (count, mean) = (self.stride, (self.stride as f64).recip());
        let [v, sizes] = [self, sizes].map(Self::reader);
        move |site| {
            let [v, sizes] = [v, sizes].map(|reader| {
                let start = site * reader.stride;
                &reader.numbers[start..start + count]
            });
            let ratio = |(v, s): (&f64, &f64)| if *v == 0.0 { 0.0 } else { (v / s).abs() };
            let sum = v.iter().zip(sizes).map(ratio).fold(0.0, |sum, r| sum + r * r);
            (sum * mean).sqrt()
        }
    }
}

/// The larger number, or NaN if one is.
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if a >= b || a.is_nan() { a } else { b }
}

impl Vector for SiteVector {
    fn len(&self) -> usize {
        self.sites * self.stride
    }

    #[inline]
    fn get(&self, i: usize) -> f64 {
        match &self.numbers {
            Numbers::Same(numbers) => numbers[i % self.stride],
            Numbers::Each(numbers) => numbers[i],
        }
    }

    fn with(&self, mut number: impl FnMut(usize) -> f64) -> Self {
        let mut numbers = self.pool.numbers(self.len());
        for (i, out) in numbers.iter_mut().enumerate() {
            *out = number(i);
        }
        Self::each(self.sites, self.stride, numbers)
    }

    fn zero(&self) -> Self {
        Self::same(self.sites, vec![0.0; self.stride], &self.pool)
    }

    fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        match &self.numbers {
            Numbers::Same(numbers) => {
                Self::same(self.sites, numbers.iter().map(|&x| f(x)).collect(), &self.pool)
            }
            Numbers::Each(numbers) => self.with(|i| f(numbers[i])),
        }
    }

    fn zip<const K: usize>(vectors: [&Self; K], f: impl Fn([f64; K]) -> f64 + Sync) -> Self {
        let first = vectors[0];
        if vectors.iter().all(|v| v.slice().is_none()) {
            let numbers = (0..first.stride).map(|k| f(vectors.map(|v| v.get(k))));
            return Self::same(first.sites, numbers.collect(), &first.pool);
        }
        let mut slices = [&[][..]; K];
        if vectors.iter().zip(&mut slices).all(|(v, slice)| v.slice().map(|s| *slice = s).is_some())
        {
            return first.filled(|start, out| {
                let slices = slices.map(|slice| &slice[start..start + out.len()]);
                for (i, out) in out.iter_mut().enumerate() {
                    *out = f(slices.map(|slice| slice[i]));
                }
            });
        }
        let (readers, stride) = (vectors.map(Self::reader), first.stride);
        first.filled(|start, out| {
            for (site, out) in (start / stride..).zip(out.chunks_exact_mut(stride)) {
                for (k, out) in out.iter_mut().enumerate() {
                    *out = f(readers.map(|reader| reader.numbers[site * reader.stride + k]));
                }
            }
        })
    }

    fn combination<'a>(h: f64, count: usize, term: impl Fn(usize) -> (f64, &'a Self)) -> Self
    where
        Self: 'a,
    {
        let first = term(0).1;
        let Some(terms) = Self::terms(count, &term) else {
            let w = term(0).0;
            let start = Self::zip([first], |[k]| w * k);
            let add = |sum, j| {
                let (w, v) = term(j);
                Self::zip([&sum, v], |[sum, v]| sum + w * v)
            };
            return Self::zip([&(1..count).fold(start, add)], |[sum]| h * sum);
        };
        first.filled(|start, out| combine(out, start, h, &terms))
    }

    /// The largest site, and the root mean square over the directions of a site. A mean over the sites would allow
    /// a pulse an error that grows with the length of the lattice around it.
    fn relative_to(&self, sizes: &Self) -> f64 {
        let ratio = |[v, s]: [f64; 2]| if v == 0.0 { 0.0 } else { (v / s).abs() };
        Self::norm_of([self, sizes], ratio)
    }

    fn norm_of<const K: usize>(vectors: [&Self; K], f: impl Fn([f64; K]) -> f64 + Sync) -> f64 {
        let [norm] = Self::norms(vectors, |numbers| [f(numbers)]);
        norm
    }

    fn norms_of<const K: usize>(
        vectors: [&Self; K],
        f: impl Fn([f64; K]) -> [f64; 2] + Sync,
    ) -> [f64; 2] {
        Self::norms(vectors, f)
    }

    fn sites(&self) -> Option<usize> {
        Some(self.sites)
    }

    fn largest_site(&self, sizes: &Self) -> Option<usize> {
        let ahead = |best: Ranked, next: Ranked| if next.ratio > best.ratio { next } else { best };
        let none = Ranked { ratio: 0.0, site: None };
        let ratio = self.ratios(sizes);
        let ranked = |site| Ranked { ratio: ratio(site), site: Some(site) };
        let of = |range: Range<usize>| range.map(ranked).fold(none, ahead);
        parallel::map(self.sites, of).into_iter().fold(none, ahead).site
    }

    fn to_short_list(&self) -> Vec<f64> {
        match &self.numbers {
            Numbers::Same(numbers) => numbers.clone(),
            Numbers::Each(_) => self.to_list(),
        }
    }

    fn kinds(&self) -> usize {
        self.stride
    }

    fn by_kind(&self) -> Self {
        let Some(numbers) = self.slice() else { return self.map(f64::abs) };
        let largest = |mut most: Vec<f64>, numbers: &[f64]| {
            for (most, number) in most.iter_mut().zip(numbers) {
                *most = larger(*most, number.abs());
            }
            most
        };
        let zeros = || vec![0.0; self.stride];
        let of = |sites: Range<usize>| {
            let numbers = &numbers[sites.start * self.stride..sites.end * self.stride];
            numbers.chunks_exact(self.stride).fold(zeros(), largest)
        };
        let parts = parallel::map(self.sites, of).into_iter();
        let numbers = parts.fold(zeros(), |most, part| largest(most, &part));
        Self::same(self.sites, numbers, &self.pool)
    }

    fn with_list(&self, list: &[f64]) -> Option<Self> {
        if list.len() == self.stride {
            return Some(Self::same(self.sites, list.to_vec(), &self.pool));
        }
        (list.len() == self.len()).then(|| self.with(|i| list[i]))
    }
}

/// A site, and the norm of the ratios there.
#[derive(Clone, Copy)]
struct Ranked {
    ratio: f64,
    site: Option<usize>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn a_norm_without_an_array_has_the_bits_of_one_with_it() {
        let (sites, stride, mut random) = (3000, 3, Random::new(5));
        let pool = Pool::default();
        let v = SiteVector::same(sites, vec![0.0; stride], &pool).with(|_| random.next());
        let w = v.with(|i| if i % 7 == 0 { v.get(i) } else { random.next() });
        let sizes = SiteVector::same(sites, vec![0.5, 2.0, 1e-3], &pool);
        let ratio = |[v, w, size]: [f64; 3]| (v - w) / size;
        let numbers = SiteVector::zip([&v, &w, &sizes], ratio);
        let norm = numbers.relative_to(&numbers.map(|_| 1.0));
        assert!(norm > 0.0);
        assert_eq!(SiteVector::norm_of([&v, &w, &sizes], ratio).to_bits(), norm.to_bits());
        let lost = SiteVector::norm_of([&v, &w], |[v, w]| if v - w == 0.0 { f64::NAN } else { v });
        assert!(lost.is_nan());
    }
}
