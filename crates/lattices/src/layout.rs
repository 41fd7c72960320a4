//! Sites and bonds in chunks.
//!
//! A bond belongs to the chunk of its first site. What it gives to a second site in another chunk goes into a slot
//! of its own, and is added there afterwards, in the order of the slots. So each chunk writes to its own sites
//! alone, each bond is evaluated once, and sums have one order whatever the number of threads.

use std::ops::Range;

use metriplectic_fields::Column;

use crate::graph::Graph;
use crate::parallel::{self, CHUNK};

/// The chunks of a graph.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    pub(crate) sites: usize,
    chunks: Vec<Chunk>,
    /// The bonds in the order of the chunks of their first sites.
    bonds: Vec<[u32; 2]>,
    /// The number that a bond has in the graph, unless all have kept theirs.
    numbers: Option<Vec<u32>>,
    /// What goes from slots to sites.
    arrivals: Vec<Arrival>,
    pub(crate) slots: usize,
}

/// Sites and bonds that are evaluated together.
#[derive(Clone, Debug, Default)]
struct Chunk {
    bonds: Range<usize>,
    /// The slots that its bonds write.
    slots: Range<usize>,
    /// The arrivals at its sites.
    arrivals: Range<usize>,
}

#[derive(Clone, Copy, Debug)]
struct Arrival {
    site: u32,
    slot: u32,
}

const fn chunk_of(site: u32) -> usize {
    site as usize / CHUNK
}

impl Layout {
    /// Sorts the bonds of a graph into chunks, in `O(N)`.
    pub(crate) fn new(graph: &Graph) -> Self {
        let (sites, count) = (graph.sites(), graph.sites().div_ceil(CHUNK));
        let mut chunks = vec![Chunk::default(); count];
        let starts = starts(count, graph.bonds().iter().map(|&[from, _]| chunk_of(from)));
        let sorted = graph.bonds().is_sorted_by_key(|&[from, _]| chunk_of(from));
        let (mut bonds, mut numbers) = (graph.bonds().to_vec(), None);
        if !sorted {
            let mut next = starts.clone();
            let mut order = vec![0; bonds.len()];
            for (number, &bond) in (0..).zip(graph.bonds()) {
                let place = &mut next[chunk_of(bond[0])];
                (bonds[*place], order[*place]) = (bond, number);
                *place += 1;
            }
            numbers = Some(order);
        }
        let crosses = |&[from, to]: &[u32; 2]| chunk_of(from) != chunk_of(to);
        let mut slots = 0;
        for (k, chunk) in chunks.iter_mut().enumerate() {
            chunk.bonds = starts[k]..starts[k + 1];
            let first = slots;
            slots += bonds[chunk.bonds.clone()].iter().filter(|bond| crosses(bond)).count();
            chunk.slots = first..slots;
        }
        let crossing = || bonds.iter().filter(|bond| crosses(bond)).map(|&[_, to]| to);
        let mut next = self::starts(count, crossing().map(chunk_of));
        let mut arrivals = vec![Arrival { site: 0, slot: 0 }; slots];
        for (k, chunk) in chunks.iter_mut().enumerate() {
            chunk.arrivals = next[k]..next[k + 1];
        }
        for (slot, site) in (0..).zip(crossing()) {
            let place = &mut next[chunk_of(site)];
            arrivals[*place] = Arrival { site, slot };
            *place += 1;
        }
        Self { sites, chunks, bonds, numbers, arrivals, slots }
    }

    /// The bonds, in the order in which they are evaluated.
    pub(crate) fn bonds(&self) -> &[[u32; 2]] {
        &self.bonds
    }

    /// The number that a bond has in the graph.
    pub(crate) fn number(&self, bond: usize) -> usize {
        self.numbers.as_ref().map_or(bond, |numbers| numbers[bond] as usize)
    }

    /// The numbers of the bonds in the order in which these are evaluated, unless it is theirs.
    pub(crate) fn order(&self) -> Option<&[u32]> {
        self.numbers.as_deref()
    }

    /// Sums over sites and bonds: `work` writes the numbers of the sites of its chunk, and adds those that bonds
    /// give. Its results are in the order of the chunks. Without slots bonds give nothing.
    pub(crate) fn scatter<R: Send>(
        &self,
        out: &mut [f64],
        slots: &mut [f64],
        work: impl Fn(Part<'_>) -> R + Sync,
    ) -> Vec<R> {
        let stride = out.len() / self.sites;
        let width = slots.len().checked_div(self.slots).unwrap_or(0);
        let mut rest = &mut *slots;
        let chunks = self.chunks.iter().enumerate().zip(out.chunks_mut(CHUNK * stride));
        let pieces = chunks.map(|((k, chunk), out)| {
            let own = chunk.slots.len() * width;
            let (own, after) = std::mem::take(&mut rest).split_at_mut(own);
            rest = after;
            let (bonds, sites) = (chunk.bonds.clone(), parallel::sites(k, self.sites));
            Part { sites, bonds, out, stride, slots: own, width, next: 0 }
        });
        let results = parallel::each(pieces, work);
        if width > 0 {
            let slots = &*slots;
            let pieces = self.chunks.iter().zip(out.chunks_mut(CHUNK * stride));
            parallel::each(pieces, |(chunk, out)| {
                for &Arrival { site, slot } in &self.arrivals[chunk.arrivals.clone()] {
                    let from = slot as usize * width;
                    let to = site as usize % CHUNK * stride;
                    for k in 0..width {
                        out[to + k] += slots[from + k];
                    }
                }
            });
        }
        results
    }
}

/// Where the members of each of `count` groups start, if they stand in a row.
fn starts(count: usize, groups: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut starts = vec![0; count + 1];
    for group in groups {
        starts[group + 1] += 1;
    }
    for group in 0..count {
        starts[group + 1] += starts[group];
    }
    starts
}

/// A chunk in the course of a sum.
pub(crate) struct Part<'a> {
    pub(crate) sites: Range<usize>,
    pub(crate) bonds: Range<usize>,
    out: &'a mut [f64],
    stride: usize,
    slots: &'a mut [f64],
    width: usize,
    next: usize,
}

impl Part<'_> {
    /// Writes numbers of a site of this chunk, from the number `offset` on.
    #[inline]
    pub(crate) fn set<V: Column<f64>>(&mut self, site: usize, offset: usize, v: &V) {
        let start = (site - self.sites.start) * self.stride + offset;
        let out = &mut self.out[start..start + V::LEN];
        for k in 0..V::LEN {
            out[k] = v[k];
        }
    }

    /// Adds the vectors that a bond gives to its two sites: one after the other for each law.
    #[inline]
    pub(crate) fn add<V: Column<f64>, const LAWS: usize>(
        &mut self,
        [from, to]: [u32; 2],
        laws: &[[V; 2]; LAWS],
    ) {
        let here = from as usize - self.sites.start;
        let place = (to as usize).wrapping_sub(self.sites.start);
        let start = self.next * self.width;
        let inside = place < self.sites.len();
        self.next += usize::from(!inside);
        for (law, [first, second]) in laws.iter().enumerate() {
            let offset = law * V::LEN;
            self.add_here(here, offset, first);
            if inside {
                self.add_here(place, offset, second);
            } else {
                let slot = &mut self.slots[start + offset..start + offset + V::LEN];
                for k in 0..V::LEN {
                    slot[k] = second[k];
                }
            }
        }
    }

    #[inline]
    fn add_here<V: Column<f64>>(&mut self, place: usize, offset: usize, v: &V) {
        let start = place * self.stride + offset;
        let out = &mut self.out[start..start + V::LEN];
        for k in 0..V::LEN {
            out[k] += v[k];
        }
    }
}
