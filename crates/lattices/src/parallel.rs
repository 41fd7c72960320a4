//! Loops over chunks of sites, on all threads.
//!
//! The chunks have a fixed length, and their results come in their order. So the bits of a sum do not depend on
//! the number of threads.

use std::ops::Range;

#[cfg(feature = "rayon")]
use rayon::prelude::*;

/// Sites in a chunk: some ten microseconds of work, and about what fits into a cache.
pub(crate) const CHUNK: usize = 1024;

/// The results of `f` for each piece of work, in order.
pub(crate) fn each<W: Send, R: Send>(work: Vec<W>, f: impl Fn(W) -> R + Sync) -> Vec<R> {
    #[cfg(feature = "rayon")]
    if work.len() > 1 && rayon::current_num_threads() > 1 {
        return work.into_par_iter().map(&f).collect();
    }
    work.into_iter().map(f).collect()
}

/// The sites of a chunk.
pub(crate) fn sites(chunk: usize, count: usize) -> Range<usize> {
    chunk * CHUNK..count.min((chunk + 1) * CHUNK)
}

/// The results of `f` for each chunk of sites, given the sites and the part of `out` that belongs to them.
pub(crate) fn fill<T: Send, R: Send>(
    out: &mut [T],
    per_site: usize,
    f: impl Fn(Range<usize>, &mut [T]) -> R + Sync,
) -> Vec<R> {
    let count = out.len() / per_site;
    let work: Vec<_> = out.chunks_mut(CHUNK * per_site).enumerate().collect();
    each(work, |(chunk, out)| f(sites(chunk, count), out))
}

/// The results of `f` for each chunk of `count` sites.
pub(crate) fn map<R: Send>(count: usize, f: impl Fn(Range<usize>) -> R + Sync) -> Vec<R> {
    each((0..count.div_ceil(CHUNK)).collect(), |chunk| f(sites(chunk, count)))
}
