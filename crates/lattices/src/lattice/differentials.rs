//! The differentials of energy and entropy, and their totals.

use std::sync::atomic::Ordering;

use metriplectic_fields::{Column, Jet1, Vector};
use metriplectic_manifolds::{Manifold, Product, Times};
use nalgebra::SVector;

use super::at_sites::width;
use super::{Differentials, Lattice, Total, Totals, dimension, larger};
use crate::gather::Gather;
use crate::model::{Model, PairManifold, PointOf, VectorOf};
use crate::parallel;
use crate::pool::Buffer;

/// The conserved sums up to which a loop over sites keeps their totals in registers.
const FEW: usize = 4;

/// Numbers that a bond gives to each of its sites.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Given {
    Nothing,
    /// A vector.
    Vector,
    /// A differential of the energy and one of the entropy.
    BothLaws,
}

impl Given {
    /// Says what it gives to the differentials of the laws.
    const fn by_functions<P: Model>() -> Self {
        if P::EntropyGather::PRESENT {
            Self::BothLaws
        } else if P::BOND_ENERGY || P::EnergyGather::PRESENT {
            Self::Vector
        } else {
            Self::Nothing
        }
    }
}

/// Adds the differential of `g(x, ρ)` along `x` at a site, and returns the value.
#[inline]
fn embed<M: Manifold + Times<M>, G: Gather<M>>(
    gather: &G,
    x: &M::Point<f64>,
    sums: &[f64],
    site: usize,
    df: &mut Vector<M>,
) -> f64 {
    if !G::PRESENT {
        return 0.0;
    }
    let Jet1 { value, df: more } = gather.embedded(x, sums[2 * site]).jet;
    *df += more;
    value
}

/// Adds the differential `(λ_i + λ_j) ∂φ` of what a bond gives to the sums of its sites.
#[inline]
fn spread<M: Manifold + Times<M>, G: Gather<M>>(
    gather: &G,
    pair: &(M::Point<f64>, M::Point<f64>),
    sums: &[f64],
    ends: [u32; 2],
    df: &mut Vector<Product<M, M>>,
) {
    if G::PRESENT {
        let sum = |site: u32| sums[2 * site as usize + 1];
        *df += gather.weight(pair).df * (sum(ends[0]) + sum(ends[1]));
    }
}

/// The points of a bond.
#[inline]
fn pair_at<T: Clone>(x: &[T], [i, j]: [u32; 2]) -> (T, T) {
    (x[i as usize].clone(), x[j as usize].clone())
}

/// The parts of a differential on a bond that belong to its two sites.
#[inline]
pub(crate) fn halves<P: Model>(df: &Vector<PairManifold<P>>) -> [VectorOf<P>; 2] {
    let n = dimension::<P>();
    let half = |start| VectorOf::<P>::from_index(|k| df[start + k]);
    [half(0), half(n)]
}

/// Returns whether two vectors have equal bits.
#[inline]
fn has_bits_of<V: Column<f64>>(a: &V, b: &V) -> bool {
    let mut differ = 0;
    for k in 0..V::LEN {
        differ |= a[k].to_bits() ^ b[k].to_bits();
    }
    differ == 0
}

impl<P: Model> Lattice<P> {
    /// A place for what bonds give to other chunks.
    pub(crate) fn slots(&self, given: Given) -> Buffer<f64> {
        let (pool, laws) = match given {
            Given::Nothing => return self.slots.adopt(Vec::new()),
            Given::Vector => (&self.slots, 1),
            Given::BothLaws => (&self.both_slots, 2),
        };
        pool.numbers(laws * self.layout.slots * dimension::<P>())
    }

    /// For each site the sum `ρ_i` over its bonds, and `λ_i = ∂g/∂ρ`; empty where nothing is gathered.
    pub(crate) fn gathered<G: Gather<P::Manifold>>(
        &self,
        gather: &G,
        x: &[PointOf<P>],
    ) -> Buffer<f64> {
        let [at_sites, in_slots] = &self.sums;
        if !G::PRESENT {
            return at_sites.adopt(Vec::new());
        }
        let mut all = at_sites.numbers(2 * self.layout.reach());
        let sums = &mut all[..2 * self.sites()];
        let bonds = self.layout.bonds();
        self.layout.scatter(sums, &mut in_slots.numbers(self.layout.slots), |mut part| {
            for site in part.sites.clone() {
                part.set(site, 0, &SVector::<f64, 1>::zero());
                part.set(site, 1, &SVector::<f64, 1>::zero());
            }
            for bond in part.bonds.clone() {
                let ends = bonds[bond];
                let pair = pair_at(x, ends);
                let phi = SVector::<f64, 1>::from_index(|_| gather.weight(&pair).value);
                part.add(ends, &[[phi, phi]]);
            }
        });
        parallel::fill(sums, 2, |sites, sums| {
            for (site, sum) in sites.zip(sums.chunks_exact_mut(2)) {
                sum[1] = gather.embedded(&x[site], sum[0]).along_rho;
            }
        });
        self.layout.fill_ghosts(&mut all);
        all
    }

    /// The differentials `w = dh + Σ ∂h₂` and `ds` at each site, with what they gather, and the totals if `TOTALS`. The
    /// points of ghosts stand behind the own ones, and so do their differentials, as far as bonds ask for them.
    pub(crate) fn differentials<const TOTALS: bool>(
        &self,
        x: &[PointOf<P>],
    ) -> (Differentials, Totals<VectorOf<P>>) {
        // Parts of a lattice would have to agree on what they exchange.
        let may_be_same = P::ENTROPY
            && !P::EntropyGather::PRESENT
            && self.layout.is_whole()
            && !self.entropy_differs.load(Ordering::Relaxed);
        if may_be_same && let Some(first) = x.first() {
            let df = self.parts.entropy(0, first).df;
            let (all, totals, differs) = self.differentials_with::<TOTALS>(x, Some(&df));
            if !differs {
                return (all, totals);
            }
            self.entropy_differs.store(true, Ordering::Relaxed);
            // Those of the other width serve nobody any more.
            self.differentials.clear();
        }
        let (all, totals, _) = self.differentials_with::<TOTALS>(x, None);
        (all, totals)
    }

    /// The differentials with `same` for the one of the entropy at all sites, and whether it differs at a site; without it,
    /// each site has its own.
    fn differentials_with<const TOTALS: bool>(
        &self,
        x: &[PointOf<P>],
        same: Option<&VectorOf<P>>,
    ) -> (Differentials, Totals<VectorOf<P>>, bool) {
        let (n, width) = (dimension::<P>(), width::<P>(same.is_some()));
        let mut all = self.differentials.numbers(self.layout.reach() * width);
        let own = &mut all[..self.sites() * width];
        let bonds = self.layout.bonds();
        let gathers = self.parts.gathers();
        let energy_sums = self.gathered(&gathers.energy, x);
        let entropy_sums = self.gathered(&gathers.entropy, x);
        let [energy_sums, entropy_sums] = [&*energy_sums, &*entropy_sums];
        let given = Given::by_functions::<P>();
        let totals = self.layout.scatter(own, &mut self.slots(given), |mut part| {
            let mut totals = Totals::new(if TOTALS { P::SUMS } else { 0 });
            // Numbers of their own stay in registers.
            let [mut in_energy, mut in_entropy] = [Total::default(); 2];
            let (mut slope, mut sizes) = (0.0, VectorOf::<P>::zero());
            let mut sums = [Total::default(); FEW];
            for site in part.sites.clone() {
                let point = &x[site];
                let mut energy = self.parts.energy(site, point);
                let gathered = embed(&gathers.energy, point, energy_sums, site, &mut energy.df);
                part.set(site, 0, &energy.df);
                let scales =
                    if TOTALS { P::Manifold::scales(point) } else { VectorOf::<P>::zero() };
                if TOTALS {
                    if P::EnergyGather::PRESENT {
                        in_energy.add(gathered);
                    }
                    in_energy.add(energy.value);
                    sizes = larger(&sizes, &scales);
                    let sums =
                        if P::SUMS <= FEW { &mut sums[..P::SUMS] } else { &mut *totals.sums };
                    for (k, sum) in sums.iter_mut().enumerate() {
                        sum.add(self.parts.sum(k, site, point).value);
                    }
                }
                if P::ENTROPY {
                    let mut entropy = self.parts.entropy(site, point);
                    let gathered =
                        embed(&gathers.entropy, point, entropy_sums, site, &mut entropy.df);
                    match same {
                        Some(same) => totals.entropy_differs |= !has_bits_of(&entropy.df, same),
                        None => part.set(site, 1, &entropy.df),
                    }
                    if TOTALS {
                        if P::EntropyGather::PRESENT {
                            in_entropy.add(gathered);
                        }
                        in_entropy.add(entropy.value);
                        if !P::EntropyGather::PRESENT {
                            slope += entropy.df.abs().dot(&scales);
                        }
                    }
                }
            }
            if TOTALS && P::SUMS <= FEW {
                totals.sums.copy_from_slice(&sums[..P::SUMS]);
            }
            let none = given == Given::Nothing || totals.entropy_differs;
            for bond in if none { 0..0 } else { part.bonds.clone() } {
                let ends = bonds[bond];
                let pair = pair_at(x, ends);
                let mut jet = self.parts.bond_energy(bond, &pair);
                spread(&gathers.energy, &pair, energy_sums, ends, &mut jet.df);
                let energy = halves::<P>(&jet.df);
                if P::EntropyGather::PRESENT {
                    let mut ds = Vector::<PairManifold<P>>::zero();
                    spread(&gathers.entropy, &pair, entropy_sums, ends, &mut ds);
                    part.add(ends, &[energy, halves::<P>(&ds)]);
                } else {
                    part.add(ends, &[energy]);
                }
                if TOTALS {
                    in_energy.add(jet.value);
                }
            }
            Totals { energy: in_energy, entropy: in_entropy, entropy_slope: slope, sizes, ..totals }
        });
        let differs = totals.iter().any(|part| part.entropy_differs);
        if P::BOND_FRICTION {
            self.layout.fill_ghosts(&mut all);
        }
        let totals = if TOTALS { self.layout.sum(totals, |a, b| a.merge(&b)) } else { None };
        let totals = totals.unwrap_or_else(|| Totals::new(P::SUMS));
        let entropy = same.map(|df| (0..n).map(|k| df[k]).collect());
        (Differentials { numbers: all, entropy }, totals, differs)
    }
}
