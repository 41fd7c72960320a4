//! The thermal noise of a lattice: one number for each term at each site and bond, by its counter.
//!
//! The closures of friction have no derivatives, so those of the kinetic drift are central differences. They are local if the
//! energy is a sum over sites.

use std::ops::Range;

use metriplectic_dynamics::noise::{Boltzmann, Uniform};
use metriplectic_fields::{Column, Dimension as _, Space};
use metriplectic_integrators::noise::{Drawn, Fluctuating, Landing, Noise};
use metriplectic_integrators::{Flow, FlowError, Judged, NoiseError, Noisy};
use metriplectic_manifolds::{Flat, Manifold};

use crate::error::LatticeError;
use crate::gather::Gather as _;
use crate::lattice::{Given, Lattice, dimension, probed};
use crate::model::{Model, PointOf, VectorOf};
use crate::onsager::Onsager;
use crate::points::Points;
use crate::report::{LatticeReport, Laws};
use crate::vector::SiteVector;
use crate::verify::MOVED;

/// The half width of a difference, in units of an entry: where its rounding is as large as its error, `ε^{1/3}`.
const WIDTH: f64 = 6e-6;
/// The part of the terms of a divergence that its differences may leave.
const DIFFERENCE: f64 = 1e-6;

impl<P: Model<Manifold: Flat>> Lattice<P> {
    /// Gives the lattice the thermal noise that its friction fixes.
    ///
    /// Its sites lie in a flat space, and its energy and its entropy are sums over sites.
    /// [`RandomFlow`](metriplectic_integrators::RandomFlow) samples it in `O(N)`.
    pub fn with_noise(self, noise: Boltzmann) -> Noisy<Self, Uniform> {
        Noisy::new(self, Noise::of(noise))
    }
}

/// A term at both ends of a bond; at a site the second end is zero.
pub(crate) type Term<P> = Onsager<[VectorOf<P>; 2]>;

/// Computes `Σ c_r b_r` of the terms of a place, with `c_r = ρ_r div b_r + ½ ⟨dρ_r, b_r⟩`. An entry that is zero has one of these
/// `sizes`.
pub(crate) fn drift<P: Model>(
    terms: impl Fn([&PointOf<P>; 2]) -> Vec<Term<P>>,
    x: [&PointOf<P>; 2],
    (ends, sizes): (usize, &VectorOf<P>),
) -> [VectorOf<P>; 2] {
    let here = terms(x);
    let mut factors = vec![0.0; here.len()];
    for end in 0..ends {
        let scales = own_or::<P>(x[end], sizes);
        for k in 0..dimension::<P>() {
            let width = WIDTH * scales[k];
            let moved = [width, -width].map(|by| {
                let y = P::Manifold::chart(x[end], &(VectorOf::<P>::basis(k) * by));
                let mut both = x;
                both[end] = &y;
                terms(both)
            });
            for (r, factor) in factors.iter_mut().enumerate() {
                let [up, down] = [0, 1].map(|side| &moved[side][r]);
                let slope = |a: f64, b: f64| (a - b) / (2.0 * width);
                *factor += here[r].rate * slope(up.b[end][k], down.b[end][k])
                    + 0.5 * slope(up.rate, down.rate) * here[r].b[end][k];
            }
        }
    }
    let mut sum = [VectorOf::<P>::zero(); 2];
    for (term, c) in here.iter().zip(factors) {
        sum[0] += term.b[0] * c;
        sum[1] += term.b[1] * c;
    }
    sum
}

/// The sizes of the entries at a site, or the given ones where they are zero.
fn own_or<P: Model>(x: &PointOf<P>, sizes: &VectorOf<P>) -> VectorOf<P> {
    let own = P::Manifold::scales(x);
    VectorOf::<P>::from_index(|k| if own[k] > 0.0 { own[k] } else { sizes[k] })
}

impl<P: Model> Lattice<P> {
    /// The sizes over which differences are taken where an entry is zero: the largest ones on the lattice. An entry that is zero
    /// at all sites has the distance over which the energy of a site changes by its value.
    pub(crate) fn sizes_of_differences(&self, x: &Points<P::Manifold>) -> VectorOf<P> {
        let largest = self.largest_sizes(x);
        let others = (0..dimension::<P>()).map(|k| largest[k]).fold(0.0, f64::max);
        let unit = if others > 0.0 { others } else { 1.0 };
        let (_, totals) = self.differentials::<true>(x);
        let mean = totals.energy.size / self.sites() as f64;
        let distance = |k: usize| {
            let y = P::Manifold::chart(&x[0], &(VectorOf::<P>::basis(k) * unit));
            let slope = |df: VectorOf<P>| df[k];
            let bend = slope(self.parts.energy(0, &y).df) - slope(self.parts.energy(0, &x[0]).df);
            let distance = (2.0 * mean * unit / bend.abs()).sqrt();
            if distance > 0.0 && distance.is_finite() { distance } else { unit }
        };
        VectorOf::<P>::from_index(|k| if largest[k] > 0.0 { largest[k] } else { distance(k) })
    }

    /// The number of the first term at a site, or of a bond after all sites. Bonds have the numbers of the graph, and not those
    /// of the chunks in which they are evaluated.
    pub(crate) fn first_term(&self, place: usize) -> usize {
        let [of_a_site, of_a_bond] = P::TERMS;
        let sites = self.sites();
        place.min(sites) * of_a_site + place.saturating_sub(sites) * of_a_bond
    }

    /// The terms at a site, from its point alone.
    fn terms_at(&self, site: usize, x: &PointOf<P>) -> Vec<Term<P>> {
        let [w, s] = [self.parts.energy(site, x).df, self.parts.entropy(site, x).df];
        let mut terms = Vec::with_capacity(P::TERMS[0]);
        self.parts.site_friction(site, x, [&w, &s], |Onsager { rate, b }| {
            terms.push(Onsager { rate, b: [b, VectorOf::<P>::zero()] });
        });
        terms
    }

    /// The terms of a bond, from the points of its sites alone.
    fn terms_of(&self, bond: usize, x: [&PointOf<P>; 2]) -> Vec<Term<P>> {
        let sites = self.layout.bonds()[bond].map(|site| site as usize);
        let at = |k: usize| {
            [self.parts.energy(sites[k], x[k]).df, self.parts.entropy(sites[k], x[k]).df]
        };
        let [[wi, si], [wj, sj]] = [at(0), at(1)];
        let mut terms = Vec::with_capacity(P::TERMS[1]);
        self.parts.bond_friction(bond, x, [[&wi, &si], [&wj, &sj]], |term| terms.push(term));
        terms
    }

    /// Adds a vector for each site and a pair of them for each bond; `None` if one is not a number.
    fn added(
        &self,
        at: impl Fn(usize) -> VectorOf<P> + Sync,
        of: impl Fn(usize) -> [VectorOf<P>; 2] + Sync,
    ) -> Option<SiteVector> {
        let mut v = self.vectors.numbers(self.sites() * dimension::<P>());
        let bonds = self.layout.bonds();
        let given = if P::BOND_FRICTION { Given::Vector } else { Given::Nothing };
        let probes = self.layout.scatter(&mut v, &mut self.slots(given), |mut part| {
            let mut probe = 0.0;
            for site in part.sites.clone() {
                let v = at(site);
                probe += probed(&v);
                part.set(site, 0, &v);
            }
            if P::BOND_FRICTION {
                for bond in part.bonds.clone() {
                    let v = of(bond);
                    probe += probed(&v[0]) + probed(&v[1]);
                    part.add(bonds[bond], &[v]);
                }
            }
            probe
        });
        probes.into_iter().all(|probe| !f64::is_nan(probe)).then(|| self.vector(v))
    }
}

impl<P: Model<Manifold: Flat>> Fluctuating<Uniform> for Lattice<P> {
    fn groups(&self) -> Vec<Range<usize>> {
        let all = 0..self.first_term(self.sites() + self.layout.bonds().len());
        vec![all]
    }

    fn noise(
        &self,
        x: &Points<P::Manifold>,
        terms: Range<usize>,
        (strength, numbers): Drawn<'_>,
    ) -> Option<SiteVector> {
        let (all, _) = self.differentials::<false>(x);
        let size = |r: usize, rate: f64| {
            if terms.contains(&r) { (strength * rate).sqrt() * numbers(r) } else { 0.0 }
        };
        let at_points = (&**x, all.reader::<P>());
        let at = |site: usize| {
            let (mut sum, mut r) = (VectorOf::<P>::zero(), self.first_term(site));
            self.site_terms(site, at_points, |_, Onsager { rate, b }| {
                sum += b * size(r, rate);
                r += 1;
            });
            sum
        };
        let of = |bond: usize| {
            let mut sum = [VectorOf::<P>::zero(); 2];
            let mut r = self.first_term(self.sites() + self.layout.number(bond));
            self.bond_terms(bond, at_points, |_, Onsager { rate, b }| {
                let size = size(r, rate);
                sum[0] += b[0] * size;
                sum[1] += b[1] * size;
                r += 1;
            });
            sum
        };
        self.added(at, of)
    }

    fn drift(&self, x: &Points<P::Manifold>, _: usize, _: &Noise<Uniform>) -> Option<SiteVector> {
        let sizes = self.sizes_of_differences(x);
        let at = |site: usize| {
            drift::<P>(|[x, _]| self.terms_at(site, x), [&x[site]; 2], (1, &sizes))[0]
        };
        let of = |bond: usize| {
            let [i, j] = self.layout.bonds()[bond].map(|site| site as usize);
            drift::<P>(|both| self.terms_of(bond, both), [&x[i], &x[j]], (2, &sizes))
        };
        self.added(at, of)
    }

    fn friction(&self, x: &Points<P::Manifold>) -> Option<SiteVector> {
        let (all, _) = self.differentials::<false>(x);
        Some(self.motion_along::<false>(x, &all)?.0)
    }

    fn has_drift(&self, _: usize, _: &Noise<Uniform>) -> bool {
        true
    }

    fn landed(&self, Landing { to, laws, .. }: Landing<'_, Self>) -> Option<Points<P::Manifold>> {
        self.onto(&to, laws, None)
    }

    fn examine_start_alone(&self, x0: &Points<P::Manifold>) -> Result<(), FlowError> {
        self.examine_start(x0, true)
    }

    fn examine_noise(&self, x: &Points<P::Manifold>, _: &Noise<Uniform>) -> Result<(), NoiseError> {
        if !P::ENTROPY {
            return Err(NoiseError::NoiseAndPublished);
        }
        if P::BOND_ENERGY || P::EnergyGather::PRESENT || P::EntropyGather::PRESENT {
            return Err(NoiseError::BondsHaveEnergies);
        }
        let energy = |site: usize, y: &PointOf<P>| self.parts.energy(site, y).df;
        self.start_and_near(x).iter().try_for_each(|x| self.keep_volume(x, energy))
    }
}

impl<P: Model> Judged for Lattice<P> {
    type Broken = LatticeError;
    type Report = LatticeReport;

    fn radius() -> f64 {
        MOVED
    }

    fn verify_model(&self, x: &Points<P::Manifold>, radius: f64) -> Result<(), LatticeError> {
        self.judge(x, radius, &mut Laws::first())
    }

    fn report_model(&self, x: &Points<P::Manifold>) -> LatticeReport {
        self.report(x)
    }

    fn is_sound(report: &LatticeReport) -> bool {
        report.verdict.is_ok()
    }
}

impl<P: Model<Manifold: Flat>> Lattice<P> {
    /// The start and a state near it: the divergence of a motion may vanish at the start by a symmetry.
    pub(crate) fn start_and_near(&self, x: &Points<P::Manifold>) -> [Points<P::Manifold>; 2] {
        let sizes = self.sizes_of_differences(x);
        let (y, _) = self.near(x, &self.vector_of(|site| own_or::<P>(&x[site], &sizes)), MOVED);
        [x.clone(), y]
    }

    /// Verifies that the reversible motion of each site keeps the volume, with the differential `w` of the energy there.
    ///
    /// # Errors
    ///
    /// [`NoiseError::NotUnimodular`] if that of a site changes it.
    pub(crate) fn keep_volume(
        &self,
        x: &Points<P::Manifold>,
        w: impl Fn(usize, &PointOf<P>) -> VectorOf<P>,
    ) -> Result<(), NoiseError> {
        let sizes = self.sizes_of_differences(x);
        let keeps = |site| self.keeps_volume(site, (&x[site], &sizes), |y| w(site, y));
        (0..self.sites()).try_for_each(keeps)
    }
}

impl<P: Model> Lattice<P> {
    /// # Errors
    ///
    /// [`NoiseError::NotUnimodular`] if the reversible motion of a site changes the volume.
    fn keeps_volume(
        &self,
        site: usize,
        (x, sizes): (&PointOf<P>, &VectorOf<P>),
        w: impl Fn(&PointOf<P>) -> VectorOf<P>,
    ) -> Result<(), NoiseError> {
        let scales = own_or::<P>(x, sizes);
        let [mut divergence, mut size] = [0.0, 0.0];
        for k in 0..<P::Manifold as Space>::Dim::LEN {
            let width = WIDTH * scales[k];
            let [up, down] = [width, -width].map(|by| {
                let y = P::Manifold::chart(x, &(VectorOf::<P>::basis(k) * by));
                self.parts.reversible(&y, &w(&y), &self.parts.entropy(site, &y).df)[k]
            });
            divergence += (up - down) / (2.0 * width);
            size += up.abs().max(down.abs()) / scales[k];
        }
        if f64::abs(divergence) > DIFFERENCE * size {
            return Err(NoiseError::NotUnimodular { divergence, size });
        }
        Ok(())
    }
}
