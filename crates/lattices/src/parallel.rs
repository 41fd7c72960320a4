//! Loops over chunks of sites, on all threads.
//!
//! The chunks have a fixed length, and their results come in their order. [`tree`] merges them two by two, by the
//! numbers of the chunks alone. So the bits of a sum do not depend on the number of threads, or on which process has
//! summed which chunks.

use std::ops::Range;
use std::sync::Mutex;

#[cfg(feature = "rayon")]
use rayon::prelude::*;

use crate::neighbours::Node;

/// Sites in a chunk: some ten microseconds of work, and about what fits into a cache.
pub(crate) const CHUNK: usize = 1024;

/// The results of `f` for each piece of work, in order.
pub(crate) fn each<W: Send, R: Send>(
    work: impl ExactSizeIterator<Item = W>,
    f: impl Fn(W) -> R + Sync,
) -> Vec<R> {
    let mut pieces = Vec::with_capacity(work.len());
    for work in work {
        pieces.push(Mutex::new(Piece::Work(work)));
    }
    results(pieces, &f)
}

/// The results of `f` for pieces of work. The function is behind a pointer, so that this is compiled once for all functions of such
/// pieces; and it has plain loops, because what iterators make of them would be compiled for each kind of piece.
fn results<W: Send, R: Send>(
    pieces: Vec<Mutex<Piece<W, R>>>,
    f: &(dyn Fn(W) -> R + Sync),
) -> Vec<R> {
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

/// The results of all chunks in one, by a fixed binary tree: on each level the results `2k` and `2k + 1` are merged.
/// `None` without chunks.
pub(crate) fn tree<R>(parts: Vec<R>, merge: Merge<'_, R>) -> Option<R> {
    top(nodes(leaves(0, parts), merge), merge)
}

/// Merges two neighbours. Behind a pointer, so that a tree is compiled once for each kind of result.
pub(crate) type Merge<'a, R> = &'a dyn Fn(R, R) -> R;

/// The results of the chunks from `first` on.
pub(crate) fn leaves<R>(first: usize, parts: Vec<R>) -> Vec<Node<R>> {
    let leaf = |(k, sum)| Node { level: 0, index: first + k, sum };
    parts.into_iter().enumerate().map(leaf).collect()
}

/// The largest nodes of the tree that a row of nodes has.
pub(crate) fn nodes<R>(row: Vec<Node<R>>, merge: Merge<'_, R>) -> Vec<Node<R>> {
    // Before the first node without a left neighbour levels rise, and behind it they fall.
    let levels = row.len().checked_ilog2().unwrap_or(0) as usize + 1;
    let mut nodes: Vec<Node<R>> = Vec::with_capacity(2 * levels);
    for mut node in row {
        let is_left = |left: &mut Node<R>, node: &Node<R>| {
            left.level == node.level && left.index.is_multiple_of(2) && left.index + 1 == node.index
        };
        while let Some(left) = nodes.pop_if(|left| is_left(left, &node)) {
            let (level, index) = (node.level + 1, left.index / 2);
            node = Node { level, index, sum: merge(left.sum, node.sum) };
        }
        nodes.push(node);
    }
    nodes
}

/// The whole sum, from the largest nodes of all chunks.
pub(crate) fn top<R>(nodes: Vec<Node<R>>, merge: Merge<'_, R>) -> Option<R> {
    let mut nodes = nodes.into_iter().rev();
    let last = nodes.next()?.sum;
    Some(nodes.fold(last, |right, left| merge(left.sum, right)))
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
    fill_by(out, per_site, &f)
}

/// [`fill`] by a function behind a pointer.
fn fill_by<T: Send, R: Send>(
    out: &mut [T],
    per_site: usize,
    f: &(dyn Fn(Range<usize>, &mut [T]) -> R + Sync),
) -> Vec<R> {
    let count = out.len() / per_site;
    let work = out.chunks_mut(CHUNK * per_site).enumerate();
    each(work, |(chunk, out)| f(sites(chunk, count), out))
}

/// The results of `f` for each chunk of `count` sites.
pub(crate) fn map<R: Send>(count: usize, f: impl Fn(Range<usize>) -> R + Sync) -> Vec<R> {
    map_by(count, &f)
}

/// [`map`] by a function behind a pointer.
fn map_by<R: Send>(count: usize, f: &(dyn Fn(Range<usize>) -> R + Sync)) -> Vec<R> {
    each(0..count.div_ceil(CHUNK), |chunk| f(sites(chunk, count)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(parts: &[f64]) -> f64 {
        tree(parts.to_vec(), &|a, b| a + b).unwrap_or(0.0)
    }

    #[test]
    fn processes_that_own_any_rows_of_chunks_have_the_bits_of_one_process() {
        let parts: Vec<f64> = (0..100).map(|k| 1.0 / (3.0 + f64::from(k))).collect();
        let (whole, plus): (f64, Merge<'_, f64>) = (sum(&parts), &|a, b| a + b);
        for length in [1, 2, 4, 8, 16, 32, 64, 128] {
            // Where they own whole subtrees, one number is enough.
            let owned: Vec<f64> = parts.chunks(length).map(sum).collect();
            assert_eq!(sum(&owned).to_bits(), whole.to_bits(), "{length} chunks each");
        }
        for length in [1, 3, 7, 33, 34, 99, 100] {
            let owned = parts.chunks(length).enumerate().flat_map(|(k, parts)| {
                let row = nodes(leaves(k * length, parts.to_vec()), plus);
                assert!(row.len() <= 2 * (length.ilog2() as usize + 1), "{} nodes", row.len());
                row
            });
            let owned: Vec<_> = owned.collect();
            let total = top(nodes(owned, plus), plus).expect("there are chunks");
            assert_eq!(total.to_bits(), whole.to_bits(), "{length} chunks each");
        }
        // Sums of blocks that are no subtrees have other bits, and so has a sum in a row.
        let others = parts.chunks(7).map(sum).collect::<Vec<_>>();
        assert_ne!(sum(&others).to_bits(), whole.to_bits());
        assert_ne!(parts.iter().sum::<f64>().to_bits(), whole.to_bits());
        assert!(tree(Vec::new(), plus).is_none());
    }
}
