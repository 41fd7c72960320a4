//! Sites and bonds in chunks.
//!
//! A bond belongs to the chunk of its first site. What it gives to a second site in another chunk goes into a slot
//! of its own, and is added there afterwards, in the order of the slots. So each chunk writes to its own sites
//! alone, each bond is evaluated once, and sums have one order whatever the number of threads.
//!
//! A layout has a row of the chunks of a graph, its own: all of them, unless the graph is cut. Its sites are numbered from
//! 0, its own ones first, and then the ghosts: sites of other parts at which its bonds end. Slots go to other
//! parts and come from there, and are added in the order that they have in the whole.

use std::ops::Range;

use metriplectic_fields::Column;

use crate::error::LatticeError;
use crate::graph::Graph;
use crate::neighbours::{Edge, Edges, Neighbours, Node, Shared};
use crate::parallel::{self, CHUNK, Merge};

/// The chunks of a graph, or some of them.
#[derive(Debug)]
pub(crate) struct Layout {
    /// How many sites are its own.
    pub(crate) sites: usize,
    /// The numbers of its first site, its first chunk and its first bond in the graph.
    first: [usize; 3],
    /// The goals of the numbers of its sites at the cut, and the sources of those of the ghosts.
    ghosts: Edges,
    chunks: Vec<Chunk>,
    /// The bonds in the order of the chunks of their first sites.
    bonds: Vec<[u32; 2]>,
    /// The number that a bond has in the graph, unless all follow each other there.
    numbers: Option<Vec<u32>>,
    /// Pairs of a slot and the site to which its numbers are added.
    arrivals: Vec<Arrival>,
    /// The slots, with those of other parts at the end.
    pub(crate) slots: usize,
    /// Slots whose numbers are added by other parts, and slots of other parts.
    crossings: Edges,
    neighbours: Box<dyn Neighbours>,
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

/// The number of a site or of a bond: a graph has no more of them than there are.
#[expect(clippy::cast_possible_truncation, reason = "a graph with more sites or bonds is refused")]
const fn number(index: usize) -> u32 {
    index as u32
}

impl Layout {
    /// Sorts the bonds of a graph into chunks, in `O(N)`: those of the part with this number, of as
    /// many parts as there are neighbours.
    ///
    /// # Errors
    ///
    /// [`LatticeError::TooManyParts`] if there are not as many chunks.
    pub(crate) fn part(
        graph: &Graph,
        number: usize,
        neighbours: Box<dyn Neighbours>,
    ) -> Result<Self, LatticeError> {
        let (count, parts) = (graph.sites().div_ceil(CHUNK), neighbours.count());
        if parts > count {
            return Err(LatticeError::TooManyParts { parts, chunks: count });
        }
        let own = number * count / parts..(number + 1) * count / parts;
        let first = own.start * CHUNK;
        let sites = graph.sites().min(own.end * CHUNK) - first;
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
        let of = starts[own.start]..starts[own.end];
        let mut layout = Self {
            sites,
            first: [first, own.start, of.start],
            ghosts: Edges::default(),
            chunks: vec![Chunk::default(); own.len()],
            bonds: Vec::new(),
            numbers: numbers.map(|numbers| numbers[of.clone()].to_vec()),
            arrivals: Vec::new(),
            slots: 0,
            crossings: Edges::default(),
            neighbours,
        };
        for (k, chunk) in own.clone().zip(&mut layout.chunks) {
            chunk.bonds = starts[k] - of.start..starts[k + 1] - of.start;
        }
        layout.meet(&bonds, &own);
        if own.len() < count {
            layout.find_ghosts(&bonds, &own);
            bonds = bonds[of].to_vec();
            bonds.iter_mut().flatten().for_each(|site| *site = layout.local(*site));
        }
        layout.bonds = bonds;
        Ok(layout)
    }

    /// Gives each bond between two chunks a slot, and says what is added where, in the order of all bonds.
    fn meet(&mut self, bonds: &[[u32; 2]], own: &Range<usize>) {
        let chunks = |&[from, to]: &[u32; 2]| [from, to].map(chunk_of);
        let all = || bonds.iter().filter(|bond| chunks(bond)[0] != chunks(bond)[1]);
        let mut slots = 0;
        for bond in all() {
            let from = chunks(bond)[0];
            if own.contains(&from) {
                let chunk = &mut self.chunks[from - own.start].slots;
                chunk.start = if chunk.end == 0 { slots } else { chunk.start };
                slots += 1;
                chunk.end = slots;
            }
        }
        let mut last = 0;
        for chunk in &mut self.chunks {
            // Chunks without slots are empty ranges between the others.
            chunk.slots = if chunk.slots.end == 0 { last..last } else { chunk.slots.clone() };
            last = chunk.slots.end;
        }
        let inside = |bond: &&[u32; 2]| own.contains(&chunks(bond)[1]);
        let mut next =
            starts(own.len(), all().filter(inside).map(|bond| chunks(bond)[1] - own.start));
        for (k, chunk) in self.chunks.iter_mut().enumerate() {
            chunk.arrivals = next[k]..next[k + 1];
        }
        self.arrivals = vec![Arrival { site: 0, slot: 0 }; next[own.len()]];
        let (mut here, mut elsewhere) = (0, number(slots));
        for (name, bond) in (0..).zip(all()) {
            let [from, to] = chunks(bond).map(|chunk| own.contains(&chunk));
            let place = if from { &mut here } else { &mut elsewhere };
            if to {
                let next = &mut next[chunks(bond)[1] - own.start];
                let site = bond[1] - number(self.first[0]);
                self.arrivals[*next] = Arrival { site, slot: *place };
                *next += 1;
            }
            let edge = Edge { place: *place, name };
            match [from, to] {
                [true, false] => self.crossings.sent.push(edge),
                [false, true] => self.crossings.received.push(edge),
                _ => {}
            }
            *place += u32::from(from || to);
        }
        self.slots = elsewhere as usize;
    }

    /// Finds the sites of other parts at which own bonds end, and the own sites at which bonds of other parts end.
    fn find_ghosts(&mut self, bonds: &[[u32; 2]], own: &Range<usize>) {
        let mut ends = [Vec::new(), Vec::new()];
        for &[from, to] in bonds {
            let [from, inside] = [from, to].map(|site| own.contains(&chunk_of(site)));
            if from != inside {
                ends[usize::from(from)].push(to);
            }
        }
        for ends in &mut ends {
            ends.sort_unstable();
            ends.dedup();
        }
        let [border, ghosts] = ends;
        let first = number(self.first[0]);
        let here = border.into_iter().map(|name| Edge { place: name - first, name });
        let there = (number(self.sites)..).zip(ghosts).map(|(place, name)| Edge { place, name });
        self.ghosts = Edges { sent: here.collect(), received: there.collect() };
    }

    /// The number here of a site of the graph that is its own or a ghost.
    fn local(&self, site: u32) -> u32 {
        let own = site.wrapping_sub(number(self.first[0]));
        let ghosts = &self.ghosts.received;
        match ghosts.binary_search_by_key(&site, |ghost| ghost.name) {
            Ok(ghost) => ghosts[ghost].place,
            Err(_) => own,
        }
    }

    /// The numbers of its own sites in the graph.
    pub(crate) fn sites_of_graph(&self) -> Range<usize> {
        self.first[0]..self.first[0] + self.sites
    }

    /// The numbers of its bonds in the graph, if they follow each other there.
    pub(crate) fn bonds_of_graph(&self) -> Range<usize> {
        self.first[2]..self.first[2] + self.bonds.len()
    }

    /// The numbers of the ghosts in the graph.
    #[cfg(test)]
    pub(crate) fn ghosts(&self) -> impl Iterator<Item = u32> {
        self.ghosts.received.iter().map(|ghost| ghost.name)
    }

    /// The number of its own sites and of the ghosts.
    pub(crate) fn reach(&self) -> usize {
        self.sites + self.ghosts.received.len()
    }

    /// Fills the numbers of the ghosts.
    pub(crate) fn fill_ghosts(&self, numbers: &mut [f64]) {
        self.neighbours.exchange(&self.ghosts, numbers.len() / self.reach(), numbers);
    }

    /// The results of the chunks of all parts in one, by the tree of the whole graph.
    pub(crate) fn sum<R: Shared>(&self, parts: Vec<R>, merge: impl Fn(R, R) -> R) -> Option<R> {
        self.sum_by(parts, &merge)
    }

    /// [`sum`](Self::sum) by a function behind a pointer.
    fn sum_by<R: Shared>(&self, parts: Vec<R>, merge: Merge<'_, R>) -> Option<R> {
        if self.neighbours.count() == 1 {
            return parallel::tree(parts, merge);
        }
        let nodes = parallel::nodes(parallel::leaves(self.first[1], parts), merge);
        let listed = nodes.iter().map(|Node { level, index, sum }| Node {
            level: *level,
            index: *index,
            sum: sum.list(),
        });
        let all = self.neighbours.gather(listed.collect());
        let form = &nodes.first()?.sum;
        let all: Vec<_> = all
            .into_iter()
            .map(|Node { level, index, sum }| Node { level, index, sum: form.of_list(&sum) })
            .collect();
        parallel::top(parallel::nodes(all, merge), merge)
    }

    /// Returns whether it has all of the graph.
    pub(crate) fn is_whole(&self) -> bool {
        self.neighbours.count() == 1
    }

    /// The bonds, in the order in which they are evaluated.
    pub(crate) fn bonds(&self) -> &[[u32; 2]] {
        &self.bonds
    }

    /// The number that its first site has in the graph.
    pub(crate) const fn first_site(&self) -> usize {
        self.first[0]
    }

    /// The number that a bond has in the graph.
    pub(crate) fn number(&self, bond: usize) -> usize {
        self.numbers.as_ref().map_or(self.first[2] + bond, |numbers| numbers[bond] as usize)
    }

    /// The numbers of the bonds in the order in which these are evaluated, unless it is theirs.
    pub(crate) fn order(&self) -> Option<&[u32]> {
        self.numbers.as_deref()
    }

    /// Sums over sites and bonds: `work` writes the numbers of the sites of its chunk, and adds those that bonds
    /// give. Its results are in the order of the chunks. Without slots bonds give nothing.
    pub(crate) fn scatter<V: Column<f64>, R: Send>(
        &self,
        out: &mut [f64],
        slots: &mut [f64],
        work: impl Fn(Part<'_, V>) -> R + Sync,
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
            let [out, slots] = [out, own].map(V::rows_mut);
            Part { sites, bonds, out, rows: stride / V::LEN, slots, next: 0 }
        });
        let results = parallel::each(pieces, work);
        self.neighbours.exchange(&self.crossings, width, slots);
        if width > 0 {
            self.add_arrivals(out, stride, slots, width);
        }
        results
    }

    /// Adds to the numbers of the sites, `stride` at each, those that bonds give them, `width` in a slot.
    fn add_arrivals(&self, out: &mut [f64], stride: usize, slots: &[f64], width: usize) {
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
}

/// Finds the start of each of `count` groups whose members stand in a row.
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

/// A chunk in the course of a sum, with numbers that are read and written in rows.
pub(crate) struct Part<'a, V: Column<f64>> {
    pub(crate) sites: Range<usize>,
    pub(crate) bonds: Range<usize>,
    out: &'a mut [V::Row],
    /// The rows of a site.
    rows: usize,
    slots: &'a mut [V::Row],
    next: usize,
}

impl<V: Column<f64>> Part<'_, V> {
    /// Writes one of the rows of a site of this chunk.
    #[inline(always)]
    pub(crate) fn set(&mut self, site: usize, row: usize, v: &V) {
        v.write(&mut self.out[(site - self.sites.start) * self.rows + row]);
    }

    /// Adds the vectors that a bond gives to its two sites: one after the other for each law.
    #[inline(always)]
    pub(crate) fn add<const LAWS: usize>(&mut self, ends: [u32; 2], laws: &[[V; 2]; LAWS]) {
        let [here, place] = ends.map(|site| (site as usize).wrapping_sub(self.sites.start));
        let inside = place < self.sites.len();
        for (law, [first, second]) in laws.iter().enumerate() {
            add_to(&mut self.out[here * self.rows + law], first);
            if inside {
                add_to(&mut self.out[place * self.rows + law], second);
            } else {
                second.write(&mut self.slots[self.next]);
                self.next += 1;
            }
        }
    }
}

#[inline(always)]
fn add_to<V: Column<f64>>(row: &mut V::Row, v: &V) {
    for (k, number) in row.as_mut().iter_mut().enumerate() {
        *number += v[k];
    }
}
