//! The thermal noise of an open lattice: that of its own friction, and that of each bath.
//!
//! The first group of terms keeps the energy. A bath moves its sites at a frozen time, and the energy changes by its heat,
//! `Q = H(x') − H(x)`, so the balance holds on every path.

use std::ops::Range;
use std::sync::Arc;

use metriplectic_dynamics::exchange::Temperature;
use metriplectic_dynamics::noise::{Boltzmann, Uniform};
use metriplectic_fields::{Column, Real, Space};
use metriplectic_integrators::noise::{Drawn, Fluctuating, Landing, Noise};
use metriplectic_integrators::open::surrounded::per_energy;
use metriplectic_integrators::open::{OpenFlow, OpenState};
use metriplectic_integrators::{Flow as _, FlowError, Judged, NoiseError, Noisy, Vector as _};
use metriplectic_manifolds::Flat;

use super::parts::{Part, PartKind};
use super::{OpenLattice, OpenSiteVector, StateOf};
use crate::error::LatticeError;
use crate::gather::Gather as _;
use crate::lattice::{Lattice, differentials_at, halves};
use crate::model::{Model, PointOf, VectorOf};
use crate::noise::{Term, drift};
use crate::onsager::{Onsager, SiteState};
use crate::report::{LatticeReport, Laws};
use crate::vector::SiteVector;
use crate::verify::MOVED;

impl<P: Model<Manifold: Flat>> OpenLattice<P> {
    /// Gives the lattice and its baths the thermal noise that their friction fixes: at the temperature `T` of a bath, a term
    /// `ρ b bᵀ` has the noise `√(2 k_B T ρ) b`.
    ///
    /// Its sites lie in a flat space. The energies of bonds are allowed where the lattice has no friction of its own, which then belongs
    /// to the baths alone. [`RandomFlow`](metriplectic_integrators::RandomFlow) samples it in `O(N)`.
    pub fn with_noise(self, noise: Boltzmann) -> Noisy<Self, Uniform> {
        Noisy::new(self, Noise::of(noise))
    }
}

/// Ports and baths of a lattice with thermal noise, which its baths have too.
///
/// ```
/// use metriplectic_dynamics::noise::Boltzmann;
/// use metriplectic_dynamics::Symplectic;
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{DormandPrince5, Method, RandomFlow, Span};
/// use metriplectic_lattices::{Graph, Lattice, NoisySurroundings, Onsager, SiteState};
/// use metriplectic_manifolds::Euclidean;
/// use nalgebra::{Vector2, vector};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// // Masses on springs in water at T = 0.8.
/// let masses = Lattice::on(Graph::chain(20), Euclidean::<2>)
///     .bracket(Symplectic)
///     .energy(|x: &Vector2<Real>| (x.x * x.x + x.y * x.y) * 0.5)
///     .build()?
///     .with_noise(Boltzmann(1.0))
///     .opened()
///     .bath("water", 0.8, 0..20, |_, _: &SiteState<'_, Euclidean<2>>| {
///         [Onsager { rate: 0.5, b: vector![0.0, 1.0] }]
///     });
/// let start = masses.flow().start(masses.flow().lattice().points(|_| vector![0.0, 0.0]));
/// let run = RandomFlow(DormandPrince5).seed(1).run(&masses, start, Span::steps(0.05, 100))?;
/// let state = &run.last().point;
/// assert!(run.certificate().keeps_energy());
/// assert!((masses.flow().energy_at(state) - state.ledger.heat("water").unwrap()).abs() < 1e-13);
/// # Ok(())
/// # }
/// ```
pub trait NoisySurroundings<P: Model>: Sized {
    /// The lattice with surroundings, which have no part yet unless it has some.
    fn opened(self) -> Noisy<OpenLattice<P>, Uniform>;

    /// Adds an [energy that depends on time](OpenLattice::energy_in_time).
    fn energy_in_time(
        self,
        energy: impl Fn(Real, usize, &<P::Manifold as Space>::Point<Real>) -> Real
        + Send
        + Sync
        + 'static,
    ) -> Noisy<OpenLattice<P>, Uniform> {
        self.opened().map(|lattice| lattice.energy_in_time(energy))
    }

    /// Appends a [port](OpenLattice::work).
    fn work(
        self,
        name: impl Into<Arc<str>>,
        sites: impl IntoIterator<Item = usize>,
        velocity: impl Fn(f64, usize, &PointOf<P>) -> VectorOf<P> + Send + Sync + 'static,
    ) -> Noisy<OpenLattice<P>, Uniform> {
        self.opened().map(|lattice| lattice.work(name, sites, velocity))
    }

    /// Appends a [bath](OpenLattice::bath), with the noise of its friction.
    fn bath<const R: usize>(
        self,
        name: impl Into<Arc<str>>,
        temperature: impl Temperature + Send + Sync + 'static,
        sites: impl IntoIterator<Item = usize>,
        friction: impl Fn(f64, &SiteState<'_, P::Manifold>) -> [Onsager<VectorOf<P>>; R]
        + Send
        + Sync
        + 'static,
    ) -> Noisy<OpenLattice<P>, Uniform> {
        self.opened().map(|lattice| lattice.bath(name, temperature, sites, friction))
    }
}

impl<P: Model> NoisySurroundings<P> for Noisy<Lattice<P>, Uniform> {
    fn opened(self) -> Noisy<OpenLattice<P>, Uniform> {
        self.map(Lattice::opened)
    }
}

impl<P: Model> NoisySurroundings<P> for Noisy<OpenLattice<P>, Uniform> {
    fn opened(self) -> Self {
        self
    }
}

/// A bath of an open lattice.
struct Bath<'a, P: Model> {
    part: &'a Part<P>,
    /// The number of its first term among those of the lattice and of all baths.
    first: usize,
    /// The terms at a site.
    count: usize,
}

impl<P: Model> Bath<'_, P> {
    fn terms(&self) -> Range<usize> {
        self.first..self.first + self.part.sites.len() * self.count
    }

    /// Passes the terms at a site to the visitor.
    fn each(
        &self,
        t: f64,
        x: &PointOf<P>,
        [w, s]: [&VectorOf<P>; 2],
        mut visit: impl FnMut(Onsager<VectorOf<P>>),
    ) {
        if let PartKind::Bath { contacts, .. } = &self.part.kind {
            contacts(t, &SiteState { x, w, s, data: &() }, &mut visit);
        }
    }
}

/// The differential of the energy at a site, of its point and of those at the other ends of its bonds.
struct Around<'a, P: Model> {
    lattice: &'a Lattice<P>,
    x: &'a [PointOf<P>],
    /// The bonds of each site, with the end that it is.
    bonds: Vec<Vec<(usize, usize)>>,
}

impl<'a, P: Model> Around<'a, P> {
    fn of(lattice: &'a Lattice<P>, x: &'a [PointOf<P>]) -> Self {
        let mut bonds = vec![Vec::new(); if P::BOND_ENERGY { x.len() } else { 0 }];
        let all = lattice.layout.bonds().iter().enumerate().filter(|_| P::BOND_ENERGY);
        for (bond, ends) in all {
            for (end, &site) in ends.iter().enumerate() {
                bonds[site as usize].push((bond, end));
            }
        }
        Self { lattice, x, bonds }
    }

    /// The differential where the point of the site is `y`.
    fn energy(&self, site: usize, y: &PointOf<P>) -> VectorOf<P> {
        let Self { lattice, x, bonds } = self;
        let mut w = lattice.parts.energy(site, y).df;
        for &(bond, end) in bonds.get(site).into_iter().flatten() {
            let mut pair = lattice.layout.bonds()[bond].map(|site| x[site as usize].clone());
            pair[end] = y.clone();
            w += halves::<P>(&lattice.parts.bond_energy(bond, &pair.into()).df)[end];
        }
        w
    }
}

impl<P: Model> OpenLattice<P> {
    /// The terms of the lattice itself.
    fn own_terms(&self) -> usize {
        self.lattice.first_term(self.lattice.sites() + self.lattice.layout.bonds().len())
    }

    /// The baths, in their order.
    fn all_baths(&self) -> Vec<Bath<'_, P>> {
        let mut first = self.own_terms();
        let baths = self.parts.iter().filter_map(|part| match part.kind {
            PartKind::Port(_) => None,
            PartKind::Bath { terms: count, .. } => {
                let bath = Bath { part, first, count };
                first = bath.terms().end;
                Some(bath)
            }
        });
        baths.collect()
    }

    /// A direction of the sites alone, if it is finite.
    fn of_sites(&self, v: SiteVector) -> Option<OpenSiteVector> {
        let mut beside = vec![0.0];
        beside.extend(self.empty.entry_sizes());
        let v = OpenSiteVector { v, beside };
        (0..v.len()).all(|i| v.get(i).is_finite()).then_some(v)
    }

    /// The sum of a vector for each site of a bath.
    fn summed<'a>(
        &'a self,
        bath: &Bath<'a, P>,
        mut at: impl FnMut(usize, usize) -> VectorOf<P>,
    ) -> SiteVector {
        let mut v = self.lattice.vector_of(|_| VectorOf::<P>::zero());
        for (k, &site) in bath.part.sites.iter().enumerate() {
            v.add_at(site, &at(k, site));
        }
        v
    }

    /// Computes `Σ a_r √(κ T ρ_r) b_r` over some terms of a bath.
    fn bath_noise(
        &self,
        x: &StateOf<P>,
        bath: &Bath<'_, P>,
        (terms, (strength, numbers)): (Range<usize>, Drawn<'_>),
    ) -> SiteVector {
        let (all, _) = self.at(x.time).differentials::<false>(&x.x);
        let strength = strength * bath.part.temperature(x.time).unwrap_or(0.0);
        self.summed(bath, |k, site| {
            let (mut sum, mut r) = (VectorOf::<P>::zero(), bath.first + k * bath.count);
            let [w, s] = differentials_at::<P>(&all, site);
            bath.each(x.time, &x.x[site], [&w, &s], |Onsager { rate, b }| {
                if terms.contains(&r) {
                    sum += b * ((strength * rate).sqrt() * numbers(r));
                }
                r += 1;
            });
            sum
        })
    }

    /// Computes `T Σ c_r b_r` of a bath.
    fn bath_drift(&self, x: &StateOf<P>, bath: &Bath<'_, P>) -> SiteVector {
        let lattice = self.at(x.time);
        let sizes = lattice.sizes_of_differences(&x.x);
        let around = Around::of(&lattice, &x.x);
        let temperature = bath.part.temperature(x.time).unwrap_or(0.0);
        self.summed(bath, |_, site| {
            let terms = |[y, _]: [&PointOf<P>; 2]| {
                let (w, s) = (around.energy(site, y), self.lattice.parts.entropy(site, y).df);
                let mut terms: Vec<Term<P>> = Vec::with_capacity(bath.count);
                bath.each(x.time, y, [&w, &s], |Onsager { rate, b }| {
                    // The rate of a bath is in the unit of 1/T.
                    let rate = rate * temperature;
                    terms.push(Onsager { rate, b: [b, VectorOf::<P>::zero()] });
                });
                terms
            };
            drift::<P>(terms, [&x.x[site]; 2], (1, &sizes))[0]
        })
    }
}

impl<P: Model<Manifold: Flat>> Fluctuating<Uniform> for OpenLattice<P> {
    fn groups(&self) -> Vec<Range<usize>> {
        let own = std::iter::once(0..self.own_terms());
        own.chain(self.all_baths().iter().map(Bath::terms)).collect()
    }

    fn noise(
        &self,
        x: &StateOf<P>,
        terms: Range<usize>,
        drawn: Drawn<'_>,
    ) -> Option<OpenSiteVector> {
        let baths = self.all_baths();
        let v = match baths.iter().find(|bath| bath.terms().contains(&terms.start)) {
            Some(bath) => self.bath_noise(x, bath, (terms, drawn)),
            None if self.own_terms() == 0 => self.lattice.vector_of(|_| VectorOf::<P>::zero()),
            None => self.at(x.time).noise(&x.x, terms, drawn)?,
        };
        self.of_sites(v)
    }

    fn drift(
        &self,
        x: &StateOf<P>,
        group: usize,
        noise: &Noise<Uniform>,
    ) -> Option<OpenSiteVector> {
        let v = match group.checked_sub(1) {
            None => self.at(x.time).drift(&x.x, 0, noise)?,
            Some(bath) => self.bath_drift(x, self.all_baths().get(bath)?),
        };
        self.of_sites(v)
    }

    fn friction(&self, x: &StateOf<P>) -> Option<OpenSiteVector> {
        let (all, _) = self.at(x.time).differentials::<false>(&x.x);
        let (mut v, _) = self.at(x.time).motion_along::<false>(&x.x, &all)?;
        for part in self.parts.iter().filter(|part| part.is_bath()) {
            let temperature = part.temperature(x.time).unwrap_or(0.0);
            for &site in &part.sites {
                let [w, s] = differentials_at::<P>(&all, site);
                let at = part.at_site((x.time, temperature), site, &x.x[site], [&w, &s]);
                v.add_at(site, &at.v);
            }
        }
        self.of_sites(v)
    }

    fn has_drift(&self, group: usize, _: &Noise<Uniform>) -> bool {
        group > 0 || self.own_terms() > 0
    }

    fn landed(&self, landing: Landing<'_, Self>) -> Option<StateOf<P>> {
        let Landing { group, from, to, laws } = landing;
        let (time, ledger) = (from.time, &from.ledger);
        let Some(bath) = group.checked_sub(1) else {
            return self.onto(&OpenState { x: to.x, time, ledger: ledger.clone() }, laws, None);
        };
        let heat = self.energy_at(&to) - self.energy_at(from);
        if !heat.is_finite() {
            return None;
        }
        let (column, temperature) = *self.baths(time).get(bath)?;
        let mut entries = vec![0.0; self.empty.entry_sizes().len()];
        entries[column + 1] = heat;
        entries[column + 2] = -heat * per_energy(temperature);
        Some(OpenState { x: to.x, time, ledger: ledger.with_entries(&entries) })
    }

    fn examine_start_alone(&self, x0: &StateOf<P>) -> Result<(), FlowError> {
        self.at(x0.time).examine_start(&x0.x, true)
    }

    fn examine_noise(&self, x: &StateOf<P>, noise: &Noise<Uniform>) -> Result<(), NoiseError> {
        let baths = self.all_baths();
        if self.own_terms() > 0 {
            // Its own friction is that of a lattice without surroundings.
            self.at(x.time).examine_noise(&x.x, noise)?;
        }
        if P::EnergyGather::PRESENT || P::EntropyGather::PRESENT {
            return Err(NoiseError::BondsHaveEnergies);
        }
        if P::SUMS > 0 && !baths.is_empty() {
            return Err(NoiseError::InvariantsInABath);
        }
        if self.own_terms() > 0 {
            return Ok(());
        }
        let lattice = self.at(x.time);
        lattice.start_and_near(&x.x).iter().try_for_each(|x| {
            let around = Around::of(&lattice, x);
            lattice.keep_volume(x, |site, y| around.energy(site, y))
        })
    }
}

impl<P: Model> Judged for OpenLattice<P> {
    type Broken = LatticeError;
    type Report = LatticeReport;

    fn radius() -> f64 {
        MOVED
    }

    fn verify_model(&self, x: &StateOf<P>, radius: f64) -> Result<(), LatticeError> {
        self.at(x.time).judge(&x.x, radius, &mut Laws::first())?;
        self.verify_parts(x)
    }

    fn report_model(&self, x: &StateOf<P>) -> LatticeReport {
        self.report(x)
    }

    fn is_sound(report: &LatticeReport) -> bool {
        report.verdict.is_ok()
    }
}
