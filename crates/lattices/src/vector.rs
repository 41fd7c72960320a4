//! Numbers for the directions of a lattice.

use std::ops::Range;
use std::sync::Arc;

use metriplectic_fields::Column;
use metriplectic_integrators::Vector;

use crate::blocks::{self, Room, combine};
use crate::parallel::{self, CHUNK};
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
    /// The numbers of one site, for all of them.
    Same(Vec<f64>),
    Each(Arc<Buffer<f64>>),
}

impl std::fmt::Debug for Pool<f64> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Pool")
    }
}

/// Columns that are read site by site.
pub(crate) struct Reader<'a, V: Column<f64>> {
    rows: &'a [V::Row],
    /// The rows from one site to the next: none if all sites have the same one.
    step: usize,
}

impl<V: Column<f64>> Copy for Reader<'_, V> {}

impl<V: Column<f64>> Clone for Reader<'_, V> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<V: Column<f64>> Reader<'_, V> {
    #[inline(always)]
    pub(crate) fn at(&self, site: usize) -> V {
        V::of_row(&self.rows[site * self.step])
    }
}

impl SiteVector {
    /// Makes a vector with these numbers at each site.
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

    pub(crate) fn reader<V: Column<f64>>(&self) -> Reader<'_, V> {
        let (numbers, stride) = self.strided();
        Reader { rows: V::rows(numbers), step: stride.min(1) }
    }

    /// The numbers, and how many there are from one site to the next.
    fn strided(&self) -> (&[f64], usize) {
        match &self.numbers {
            Numbers::Same(numbers) => (numbers, 0),
            Numbers::Each(numbers) => (numbers, self.stride),
        }
    }

    fn filled(&self, f: &(dyn Fn(usize, &mut [f64]) + Sync)) -> Self {
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
        f: Rows<'_, K, [f64; M]>,
    ) -> [f64; M] {
        let parts = parallel::map(vectors[0].sites, |sites| Self::squares(vectors, f, sites));
        let mean = (vectors[0].stride as f64).recip();
        // Roots and products with a positive number keep the order of the sums.
        let mut norms = parts.into_iter().fold([0.0; M], both_larger);
        norms.iter_mut().for_each(|sum| *sum = (*sum * mean).sqrt());
        norms
    }

    /// The largest sums of squares of these sites.
    fn squares<const K: usize, const M: usize>(
        vectors: [&Self; K],
        f: Rows<'_, K, [f64; M]>,
        sites: Range<usize>,
    ) -> [f64; M] {
        let stride = vectors[0].stride;
        let mut largest = [0.0; M];
        let mut room = Room::of(stride, [0.0; M]);
        Self::in_blocks(vectors, sites, &mut |slices, block| {
            let out = room.items(block.len() * stride);
            f(slices, out);
            for site in out.chunks_exact(stride) {
                let mut sums = [0.0; M];
                for numbers in site {
                    sums.iter_mut().zip(numbers).for_each(|(sum, r)| *sum += r * r);
                }
                largest = both_larger(largest, sums);
            }
        });
        largest
    }

    /// Visits the sites of a range block by block, with the numbers of each vector from the block on.
    fn in_blocks<const K: usize>(vectors: [&Self; K], sites: Range<usize>, visit: Visit<'_, K>) {
        let stride = vectors[0].stride;
        let length = stride * blocks::sites_of(stride).min(sites.len());
        let mut tiles: [Room<f64>; K] = std::array::from_fn(|_| Room::of(stride, 0.0));
        let mut same = [&[][..]; K];
        for ((tile, same), v) in tiles.iter_mut().zip(&mut same).zip(vectors) {
            if let Numbers::Same(numbers) = &v.numbers {
                let tile = tile.items(length);
                for site in tile.chunks_exact_mut(stride) {
                    site.copy_from_slice(numbers);
                }
                *same = tile;
            }
        }
        for block in blocks::blocks(sites, stride) {
            let mut slices = same;
            for (slice, v) in slices.iter_mut().zip(vectors) {
                *slice = v.slice().map_or(*slice, |numbers| &numbers[block.start * stride..]);
            }
            visit(slices, block);
        }
    }

    /// A function of the numbers that vectors have at the same place.
    fn zipped<const K: usize>(vectors: [&Self; K], f: Rows<'_, K, f64>) -> Self {
        let first = vectors[0];
        let mut slices = [&[][..]; K];
        if vectors.iter().all(|v| v.slice().is_none()) {
            for (slice, v) in slices.iter_mut().zip(vectors) {
                *slice = v.strided().0;
            }
            let mut numbers = vec![0.0; first.stride];
            f(slices, &mut numbers);
            return Self::same(first.sites, numbers, &first.pool);
        }
        if vectors.iter().zip(&mut slices).all(|(v, slice)| v.slice().map(|s| *slice = s).is_some())
        {
            return first.filled(&|start, out| f(slices.map(|slice| &slice[start..]), out));
        }
        let stride = first.stride;
        first.filled(&|start, out| {
            let sites = start / stride..(start + out.len()) / stride;
            Self::in_blocks(vectors, sites, &mut |slices, block| {
                f(slices, &mut out[block.start * stride - start..block.end * stride - start]);
            });
        })
    }

    /// The root mean square of the ratios `v_i/s_i` at each site.
    fn ratios<'a>(&'a self, sizes: &'a Self) -> impl Fn(usize) -> f64 + Sync + 'a {
        let (count, mean) = (self.stride, (self.stride as f64).recip());
        let both = [self, sizes].map(Self::strided);
        move |site| {
            let [v, sizes] = both.map(|(numbers, stride)| &numbers[site * stride..][..count]);
            let ratio = |(v, s): (&f64, &f64)| if *v == 0.0 { 0.0 } else { (v / s).abs() };
            let sum = v.iter().zip(sizes).map(ratio).fold(0.0, |sum, r| sum + r * r);
            (sum * mean).sqrt()
        }
    }
}

/// The larger numbers of two rows.
fn both_larger<const M: usize>(mut most: [f64; M], part: [f64; M]) -> [f64; M] {
    most.iter_mut().zip(part).for_each(|(most, part)| *most = larger(*most, part));
    most
}

/// A function of the numbers that `K` vectors have at the same place, for a row of places. It is behind a pointer, so that what is
/// done with all sites is compiled once, and not with each function.
type Rows<'a, const K: usize, R> = &'a (dyn Fn([&[f64]; K], &mut [R]) + Sync);

/// A visitor of blocks of sites, with the numbers that `K` vectors have from the block on.
type Visit<'a, const K: usize> = &'a mut dyn FnMut([&[f64]; K], Range<usize>);

/// Writes a function of numbers that stand at the same place. The places it writes to are none of those it reads, which the
/// compiler knows of arguments alone. Loops over indices, of which the compiler makes less than of iterators.
#[inline(always)]
fn each<const K: usize, R>(mut rows: [&[f64]; K], out: &mut [R], f: impl Fn([f64; K]) -> R) {
    let (count, mut k) = (out.len(), 0);
    while k < K {
        rows[k] = &rows[k][..count];
        k += 1;
    }
    for (i, out) in out.iter_mut().enumerate() {
        let (mut numbers, mut k) = ([0.0; K], 0);
        while k < K {
            numbers[k] = rows[k][i];
            k += 1;
        }
        *out = f(numbers);
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
                let mut numbers = numbers.clone();
                numbers.iter_mut().for_each(|x| *x = f(*x));
                Self::same(self.sites, numbers, &self.pool)
            }
            Numbers::Each(numbers) => self.with(|i| f(numbers[i])),
        }
    }

    fn zip<const K: usize>(vectors: [&Self; K], f: impl Fn([f64; K]) -> f64 + Sync) -> Self {
        Self::zipped(vectors, &|rows, out| each(rows, out, &f))
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
        first.filled(&|start, out| combine(out, start, h, &terms))
    }

    /// The largest site, and the root mean square over the directions of a site. A mean over the sites would allow
    /// a pulse an error that grows with the length of the lattice around it.
    fn relative_to(&self, sizes: &Self) -> f64 {
        let ratio = |[v, s]: [f64; 2]| if v == 0.0 { 0.0 } else { (v / s).abs() };
        Self::norm_of([self, sizes], ratio)
    }

    fn norm_of<const K: usize>(vectors: [&Self; K], f: impl Fn([f64; K]) -> f64 + Sync) -> f64 {
        let [norm] = Self::norms(vectors, &|rows, out| each(rows, out, |numbers| [f(numbers)]));
        norm
    }

    fn is_norm_below<const K: usize>(
        vectors: [&Self; K],
        f: impl Fn([f64; K]) -> f64 + Sync,
        bound: f64,
    ) -> bool {
        let sites = vectors[0].sites;
        let mean = (vectors[0].stride as f64).recip();
        (0..sites.div_ceil(CHUNK)).all(|chunk| {
            let sites = parallel::sites(chunk, sites);
            let row = |rows: [&[f64]; K], out: &mut [[f64; 1]]| {
                each(rows, out, |numbers| [f(numbers)]);
            };
            let [sum] = Self::squares(vectors, &row, sites);
            (sum * mean).sqrt() < bound
        })
    }

    fn norms_of<const K: usize>(
        vectors: [&Self; K],
        f: impl Fn([f64; K]) -> [f64; 2] + Sync,
    ) -> [f64; 2] {
        Self::norms(vectors, &|rows, out| each(rows, out, &f))
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
    use crate::random::{Random, Use};

    #[test]
    fn a_norm_without_an_array_has_the_bits_of_one_with_it() {
        let (sites, stride, random) = (3000, 3, Random::new(Use::Start));
        let pool = Pool::default();
        let v = SiteVector::same(sites, vec![0.0; stride], &pool).with(|i| random.of_entry(i));
        let w = v.with(|i| if i % 7 == 0 { v.get(i) } else { random.of_entry(v.len() + i) });
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
