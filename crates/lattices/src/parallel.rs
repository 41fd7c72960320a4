//! Loops over chunks of sites, on all threads.
//!
//! The chunks have a fixed length, and their results come in their order. So the bits of a sum do not depend on
//! the number of threads.

use std::ops::Range;
use std::sync::Mutex;

#[cfg(feature = "rayon")]
use rayon::prelude::*;

/// Sites in a chunk: some ten microseconds of work, and about what fits into a cache.
pub(crate) const CHUNK: usize = 1024;

/// The results of `f` for each piece of work, in order.
pub(crate) fn each<W: Send, R: Send>(
    work: impl ExactSizeIterator<Item = W>,
    f: impl Fn(W) -> R + Sync,
) -> Vec<R> {
    // Plain loops: what iterators make of them would be compiled for every loop of every lattice.
    let mut pieces = Vec::with_capacity(work.len());
    for work in work {
        pieces.push(Mutex::new(Piece::Work(work)));
    }
    on_all_threads(pieces.len(), &|k| {
        if let Ok(mut piece) = pieces[k].lock()
            && let Piece::Work(work) = std::mem::replace(&mut *piece, Piece::Turning)
        {
            *piece = Piece::Result(f(work));
        }
    });
    let mut results = Vec::with_capacity(pieces.len());
    for piece in pieces {
        if let Ok(Piece::Result(result)) = piece.into_inner() {
            results.push(result);
        }
    }
    results
}

/// A piece of work, and then its result.
enum Piece<W, R> {
    Work(W),
    Turning,
    Result(R),
}

/// Calls `f` with each number below `count`. The closure is behind a pointer, so what rayon makes of it is compiled
/// once.
fn on_all_threads(count: usize, f: &(dyn Fn(usize) + Sync)) {
    #[cfg(feature = "rayon")]
    if count > 1 && rayon::current_num_threads() > 1 {
        return (0..count).into_par_iter().for_each(f);
    }
    (0..count).for_each(f);
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
    let work = out.chunks_mut(CHUNK * per_site).enumerate();
    each(work, |(chunk, out)| f(sites(chunk, count), out))
}

/// The results of `f` for each chunk of `count` sites.
pub(crate) fn map<R: Send>(count: usize, f: impl Fn(Range<usize>) -> R + Sync) -> Vec<R> {
    each(0..count.div_ceil(CHUNK), |chunk| f(sites(chunk, count)))
}
