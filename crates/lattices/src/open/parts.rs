//! Ports and baths at sites, and what flows through them.

use std::sync::Arc;

use metriplectic_dynamics::exchange::Temperature;
use metriplectic_fields::Column;
use metriplectic_integrators::open::surrounded::per_energy;

use super::OpenLattice;
use crate::double::Double;
use crate::lattice::{Differentials, differentials_at};
use crate::model::{Model, PointOf, VectorOf};
use crate::onsager::{Onsager, SiteState};
use crate::parallel;

/// A visitor of the terms of a friction.
pub(super) type Visit<'a, P> = dyn FnMut(Onsager<VectorOf<P>>) + 'a;
/// The terms of the friction of a bath at a site.
pub(super) type Contacts<P> =
    dyn Fn(f64, &SiteState<'_, <P as Model>::Manifold>, &mut Visit<'_, P>) + Send + Sync;
/// The velocity of a port at a site.
pub(super) type Velocity<P> = dyn Fn(f64, usize, &PointOf<P>) -> VectorOf<P> + Send + Sync;

pub(super) enum PartKind<P: Model> {
    Port(Box<Velocity<P>>),
    Bath {
        temperature: Box<dyn Temperature + Send + Sync>,
        contacts: Box<Contacts<P>>,
        /// How many terms there are at a site.
        terms: usize,
    },
}

/// A port or a bath.
pub(super) struct Part<P: Model> {
    pub(super) name: Arc<str>,
    pub(super) sites: Vec<usize>,
    pub(super) kind: PartKind<P>,
}

/// The effect of a part at a site.
pub(super) struct AtSite<V> {
    pub(super) v: V,
    /// The work or the heat in a unit of time.
    pub(super) power: f64,
    /// The entropy `⟨A, R A⟩/T` that is produced.
    pub(super) production: f64,
    /// The least rate of the friction.
    pub(super) least_rate: f64,
}

/// The effects of all parts at a state, in a unit of time.
pub(super) struct Exchanged<V> {
    pub(super) velocities: Vec<(usize, V)>,
    /// The number of velocities before those of each part.
    pub(super) firsts: Vec<usize>,
    /// The work of each port, the heat and the entropy of each bath.
    pub(super) entries: Vec<f64>,
    pub(super) production: f64,
}

impl<P: Model> Part<P> {
    pub(super) const fn is_bath(&self) -> bool {
        matches!(self.kind, PartKind::Bath { .. })
    }

    /// The temperature of a bath.
    pub(super) fn temperature(&self, t: f64) -> Option<f64> {
        match &self.kind {
            PartKind::Port(_) => None,
            PartKind::Bath { temperature, .. } => Some(temperature.at(t)),
        }
    }

    pub(super) fn at_site(
        &self,
        (t, temperature): (f64, f64),
        site: usize,
        x: &PointOf<P>,
        [w, s]: [&VectorOf<P>; 2],
    ) -> AtSite<VectorOf<P>> {
        match &self.kind {
            PartKind::Port(velocity) => {
                let v = velocity(t, site, x);
                AtSite { power: w.dot(&v), v, production: 0.0, least_rate: 0.0 }
            }
            PartKind::Bath { contacts, .. } => {
                let a = *s * temperature - *w;
                let (mut v, mut least_rate) = (VectorOf::<P>::zero(), f64::INFINITY);
                contacts(t, &SiteState { x, w, s, data: &() }, &mut |Onsager { rate, b }| {
                    v += b * (rate * b.dot(&a));
                    least_rate = if rate < least_rate || rate.is_nan() { rate } else { least_rate };
                });
                let per_energy = per_energy(temperature);
                AtSite { power: w.dot(&v), production: a.dot(&v) * per_energy, v, least_rate }
            }
        }
    }
}

impl<P: Model> OpenLattice<P> {
    /// Sums the effects of ports and baths at these points, with the differentials of energy and entropy there.
    pub(super) fn exchanged(
        &self,
        t: f64,
        x: &[PointOf<P>],
        all: &Differentials,
    ) -> Exchanged<VectorOf<P>> {
        self.exchanged_with(t, x, |site| differentials_at::<P>(all, site))
    }

    /// Sums them with these covectors of energy and entropy at a site.
    pub(super) fn exchanged_with(
        &self,
        t: f64,
        x: &[PointOf<P>],
        covectors: impl Fn(usize) -> [VectorOf<P>; 2] + Sync,
    ) -> Exchanged<VectorOf<P>> {
        let mut exchanged = Exchanged {
            velocities: Vec::new(),
            firsts: Vec::new(),
            entries: Vec::new(),
            production: 0.0,
        };
        for part in &self.parts {
            exchanged.firsts.push(exchanged.velocities.len());
            let temperature = part.temperature(t).unwrap_or(0.0);
            let chunks = parallel::map(part.sites.len(), |range| {
                let (mut power, mut production) = (Double::default(), Double::default());
                let mut velocities = Vec::with_capacity(range.len());
                for &site in &part.sites[range] {
                    let [w, s] = covectors(site);
                    let at = part.at_site((t, temperature), site, &x[site], [&w, &s]);
                    power.add(at.power);
                    production.add(at.production);
                    velocities.push((site, at.v));
                }
                (power, production, velocities)
            });
            let mut sums = Vec::with_capacity(chunks.len());
            for (power, production, velocities) in chunks {
                sums.push((power, production));
                exchanged.velocities.extend(velocities);
            }
            let sum = parallel::tree(sums, &|mut a, b| {
                a.0.merge(b.0);
                a.1.merge(b.1);
                a
            });
            let (power, production) = sum.unwrap_or_default();
            exchanged.entries.push(power.value());
            if part.is_bath() {
                exchanged.entries.push(-power.value() * per_energy(temperature));
                exchanged.production += production.value();
            }
        }
        exchanged
    }
}
