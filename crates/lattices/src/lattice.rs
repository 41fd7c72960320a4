//! A lattice, and its loops over sites and bonds.

mod at_sites;
mod differentials;
mod motion;

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use metriplectic_fields::{Column, Dimension, Space, Vector};
use metriplectic_manifolds::Manifold;

use crate::blocks::{self, Room, combine};
use crate::double::Double;
use crate::layout::Layout;
use crate::model::{Model, PointOf, VectorOf};
use crate::neighbours::Shared;
use crate::parallel::{self, CHUNK};
use crate::points::Points;
use crate::pool::{Buffer, Pool};
use crate::vector::{Reader, SiteVector};
pub(crate) use at_sites::{AtSites, Differentials, differentials_at};
pub(crate) use differentials::{Given, halves};
pub(crate) use motion::probed;

/// Points of a manifold at the sites of a graph, with energies of sites and bonds, an entropy of sites, and friction
/// at both; built by [`Lattice::on`].
///
/// It is a [`Flow`](metriplectic_integrators::Flow), and the explicit methods run it. Where all sites have up to 1024 variables,
/// the schemes, `Gauss` and `Radau` run it too, with Jacobians of all pairs of variables, along the lines of the charts of the sites.
pub struct Lattice<P> {
    pub(crate) parts: P,
    pub(crate) layout: Arc<Layout>,
    /// Arrays with a vector for each site.
    pub(crate) vectors: Pool<f64>,
    /// Arrays with the differentials of energy and entropy for each site.
    differentials: Pool<f64>,
    /// Arrays with a vector for each slot of the layout.
    slots: Pool<f64>,
    /// Arrays with the vectors of both laws for each slot.
    both_slots: Pool<f64>,
    /// Arrays with two numbers for each site, and with a number for each slot.
    sums: [Pool<f64>; 2],
    /// True once the differential of the entropy was seen to differ from site to site.
    entropy_differs: Arc<AtomicBool>,
    /// True once its laws were verified.
    pub(crate) verified: bool,
}

// By hand, because closures have no `Debug`.
impl<P: Model> fmt::Debug for Lattice<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Lattice")
            .field("manifold", self.parts.manifold())
            .field("sites", &self.layout.sites)
            .field("bonds", &self.layout.bonds().len())
            .finish_non_exhaustive()
    }
}

/// The dimension of a site.
pub(crate) const fn dimension<P: Model>() -> usize {
    <<P::Manifold as Space>::Dim as Dimension>::LEN
}

/// A sum over the lattice, and the sum of the sizes of its terms.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Total {
    pub(crate) sum: Double,
    pub(crate) size: f64,
}

impl Total {
    #[inline]
    pub(crate) fn add(&mut self, term: f64) {
        self.sum.add(term);
        self.size += term.abs();
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        self.sum.merge(other.sum);
        self.size += other.size;
    }
}

/// The totals of energy and entropy, and the largest sizes of the entries.
#[derive(Clone, Debug)]
pub(crate) struct Totals<V> {
    pub(crate) energy: Total,
    pub(crate) entropy: Total,
    /// `Σ |∂S x|` over the entries of all sites, for an entropy of sites alone.
    pub(crate) entropy_slope: f64,
    /// True if the differential of the entropy was seen to differ between sites.
    pub(crate) entropy_differs: bool,
    /// The totals of the conserved sums.
    pub(crate) sums: Vec<Total>,
    pub(crate) sizes: V,
}

impl<V: Column<f64>> Totals<V> {
    fn new(sums: usize) -> Self {
        let [energy, entropy] = [Total::default(); 2];
        let sums = vec![Total::default(); sums];
        let sizes = V::zero();
        Self { energy, entropy, entropy_slope: 0.0, entropy_differs: false, sums, sizes }
    }

    fn merge(mut self, other: &Self) -> Self {
        self.energy.merge(&other.energy);
        self.entropy.merge(&other.entropy);
        self.entropy_slope += other.entropy_slope;
        self.entropy_differs |= other.entropy_differs;
        self.sums.iter_mut().zip(&other.sums).for_each(|(sum, part)| sum.merge(part));
        self.sizes = larger(&self.sizes, &other.sizes);
        self
    }
}

impl Shared for (Double, f64) {
    fn list(&self) -> Vec<f64> {
        self.0.parts().into_iter().chain([self.1]).collect()
    }

    fn of_list(&self, list: &[f64]) -> Self {
        (Double::of_parts([list[0], list[1]]), list[2])
    }
}

impl<V: Column<f64>> Shared for Totals<V> {
    fn list(&self) -> Vec<f64> {
        let totals = [self.energy, self.entropy].into_iter().chain(self.sums.iter().copied());
        let numbers = totals.flat_map(|Total { sum, size }| {
            let [hi, lo] = sum.parts();
            [hi, lo, size]
        });
        let sizes = (0..V::LEN).map(|k| self.sizes[k]);
        numbers.chain(sizes).chain([self.entropy_slope]).collect()
    }

    fn of_list(&self, list: &[f64]) -> Self {
        let total =
            |k: usize| Total { sum: Double::of_parts([list[k], list[k + 1]]), size: list[k + 2] };
        let slope = list.len() - 1;
        let sizes = slope - V::LEN;
        Self {
            energy: total(0),
            entropy: total(3),
            entropy_slope: list[slope],
            entropy_differs: self.entropy_differs,
            sums: (0..self.sums.len()).map(|k| total(6 + 3 * k)).collect(),
            sizes: V::from_index(|k| list[sizes + k]),
        }
    }
}

/// The larger one of two sizes, entry by entry. One that is not a number counts for nothing, as in `f64::max`, which takes more
/// instructions.
#[inline(always)]
fn larger<V: Column<f64>>(a: &V, b: &V) -> V {
    V::from_index(|k| if b[k] > a[k] { b[k] } else { a[k] })
}

impl<P: Model> Lattice<P> {
    pub(crate) fn new(parts: P, layout: Layout) -> Self {
        let [vectors, differentials, slots, both_slots, at_sites, in_slots] =
            std::array::from_fn(|_| Pool::default());
        let sums = [at_sites, in_slots];
        let entropy_differs = Arc::new(AtomicBool::new(false));
        Self {
            parts,
            layout: Arc::new(layout),
            vectors,
            differentials,
            slots,
            both_slots,
            sums,
            entropy_differs,
            verified: false,
        }
    }

    /// The lattice with other parts on the same graph, and with the arrays of this one.
    pub(crate) fn with_parts<Q: Model<Manifold = P::Manifold>>(&self, parts: Q) -> Lattice<Q> {
        Lattice {
            parts,
            layout: Arc::clone(&self.layout),
            vectors: self.vectors.clone(),
            differentials: self.differentials.clone(),
            slots: self.slots.clone(),
            both_slots: self.both_slots.clone(),
            sums: self.sums.clone(),
            entropy_differs: Arc::clone(&self.entropy_differs),
            verified: self.verified,
        }
    }

    /// Marks the lattice as one whose laws were verified.
    pub(crate) fn with_certificate(mut self) -> Self {
        self.verified = true;
        self
    }

    /// Gives up the arrays that were used before a run and are used no more.
    pub(crate) fn clear(&self) {
        for pool in [&self.vectors, &self.differentials, &self.slots, &self.both_slots] {
            pool.clear();
        }
    }

    /// The number of sites.
    pub fn sites(&self) -> usize {
        self.layout.sites
    }

    /// A state, given by the point at each site.
    pub fn points(&self, at: impl FnMut(usize) -> PointOf<P>) -> Points<P::Manifold> {
        Points::from((0..self.sites()).map(at).collect::<Vec<_>>())
    }

    /// A vector with these numbers for each site.
    pub(crate) fn vector(&self, numbers: Buffer<f64>) -> SiteVector {
        SiteVector::each(self.sites(), dimension::<P>(), numbers)
    }

    /// The totals of energy and entropy alone.
    pub(crate) fn totals(&self, x: &[PointOf<P>]) -> [Total; 2] {
        let (_, totals) = self.differentials::<true>(x);
        [totals.energy, totals.entropy]
    }

    /// The largest size of each entry.
    pub(crate) fn largest_sizes(&self, x: &[PointOf<P>]) -> VectorOf<P> {
        let of = |sites: std::ops::Range<usize>| {
            let zero = VectorOf::<P>::zero();
            x[sites].iter().fold(zero, |most, x| larger(&most, &P::Manifold::scales(x)))
        };
        let zero = VectorOf::<P>::zero();
        parallel::map(self.sites(), of).iter().fold(zero, |a, b| larger(&a, b))
    }

    /// The points `f(x_i, q_i)`; `None` if one of them is `None`.
    pub(crate) fn moved_by(
        &self,
        x: &Points<P::Manifold>,
        q: Reader<'_, VectorOf<P>>,
        f: impl Fn(&PointOf<P>, &Vector<P::Manifold>) -> Option<PointOf<P>> + Sync,
    ) -> Option<Points<P::Manifold>> {
        let mut y = x.like();
        let all = parallel::fill(&mut y, 1, |sites, y| {
            sites.zip(y).all(|(site, y)| match f(&x[site], &q.at(site)) {
                Some(end) => {
                    *y = end;
                    true
                }
                None => false,
            })
        });
        all.into_iter().all(|inside| inside).then_some(y)
    }

    /// The points `ψ_x(q)` of a stage at `q = h Σ_j w_j v_j`, in one pass, and `q` if it is to be kept; `None` if one of
    /// them is outside.
    pub(crate) fn stage_at(
        &self,
        x: &Points<P::Manifold>,
        h: f64,
        terms: &[(f64, &[f64])],
        keep: bool,
    ) -> Option<(Points<P::Manifold>, Option<SiteVector>)> {
        let (n, manifold) = (dimension::<P>(), self.parts.manifold());
        let (x, mut y) = (&**x, x.like());
        let mut kept = if keep {
            self.vectors.numbers(self.sites() * n)
        } else {
            self.vectors.adopt(Vec::new())
        };
        let mut rest = &mut *kept;
        let work = y.chunks_mut(CHUNK).enumerate().map(|(chunk, y)| {
            let own = if keep { y.len() * n } else { 0 };
            let (own, after) = std::mem::take(&mut rest).split_at_mut(own);
            rest = after;
            (chunk * CHUNK, y, own)
        });
        let inside = parallel::each(work, |(first, y, kept)| {
            let mut room = Room::of(n, 0.0);
            let mut inside = true;
            for block in blocks::blocks(0..y.len(), n) {
                let numbers = block.start * n..block.end * n;
                let q = if keep { &mut kept[numbers] } else { room.items(numbers.len()) };
                let site = first + block.start;
                combine(q, site * n, h, terms);
                let points = x[site..site + block.len()].iter().zip(&mut y[block]);
                for ((x, y), q) in points.zip(q.chunks_exact(n)) {
                    let q = VectorOf::<P>::from_index(|k| q[k]);
                    inside &= P::Manifold::is_stage(&q);
                    *y = P::Manifold::stage(x, &q);
                    inside &= manifold.is_inside(y);
                }
            }
            inside
        });
        let inside = inside.into_iter().all(|inside| inside);
        inside.then(|| (y, keep.then(|| self.vector(kept))))
    }

    /// A vector for each site.
    pub(crate) fn vector_of(&self, f: impl Fn(usize) -> VectorOf<P> + Sync) -> SiteVector {
        let n = dimension::<P>();
        let mut numbers = self.vectors.numbers(self.sites() * n);
        parallel::fill(&mut numbers, n, |sites, out| {
            for (site, out) in sites.zip(out.chunks_exact_mut(n)) {
                let v = f(site);
                for (k, out) in out.iter_mut().enumerate() {
                    *out = v[k];
                }
            }
        });
        self.vector(numbers)
    }
}
