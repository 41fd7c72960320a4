//! The laws of the surroundings of a lattice.

use std::sync::Arc;

use metriplectic_dynamics::ModelError;
use metriplectic_fields::Column;
use metriplectic_manifolds::Manifold;

use super::parts::{AtSite, Part};
use super::{OpenLattice, StateOf};
use crate::lattice::{Differentials, differentials_at};
use crate::model::{Model, VectorOf};

/// The slope of a law along a velocity, relative to its terms, that is no round-off.
const BROKEN: f64 = 1e-8;

impl<P: Model> Part<P> {
    /// Returns whether it is a bath that takes energy alone.
    pub(super) fn is_cold(&self) -> bool {
        matches!(&self.kind, super::PartKind::Bath { temperature, .. } if temperature.is_zero())
    }
}

/// A slope of a law, and the sizes of its terms.
#[derive(Clone, Copy, Default)]
struct Slope {
    sum: f64,
    terms: f64,
}

impl Slope {
    fn add<M: Manifold>(
        &mut self,
        law: &metriplectic_fields::Vector<M>,
        v: &metriplectic_fields::Vector<M>,
    ) {
        self.sum += law.dot(v);
        self.terms += M::pairing_size(law, v);
    }

    fn size(self) -> f64 {
        // Numbers without digits are zeros.
        let least = f64::MIN_POSITIVE / f64::EPSILON;
        if self.sum.abs() <= least { 0.0 } else { self.sum.abs() / self.terms }
    }
}

impl<P: Model> OpenLattice<P> {
    /// Checks at a state that sites exist, that ports carry no entropy, that ports and baths keep the conserved sums, that no
    /// temperature is negative, and that no friction has a negative rate.
    pub(super) fn look_at_parts(&self, state: &StateOf<P>) -> Result<(), ModelError> {
        if self.parts.is_empty() {
            return Ok(());
        }
        let (all, _) = self.lattice.differentials::<false>(&state.x);
        self.parts.iter().try_for_each(|part| self.look_at_part(part, state, &all))
    }

    fn look_at_part(
        &self,
        part: &Part<P>,
        state: &StateOf<P>,
        all: &Differentials,
    ) -> Result<(), ModelError> {
        let time = state.time;
        let entries = |site: usize| P::Manifold::entries(&state.x[site]);
        let named = |site: usize| -> Arc<str> { format!("{} at site {site}", part.name).into() };
        let temperature = part.temperature(time);
        if let Some(temperature) = temperature
            && !(temperature >= 0.0 && temperature.is_finite())
        {
            let bath = Arc::clone(&part.name);
            return Err(ModelError::BathNotPositive { bath, temperature, time });
        }
        let mut sums = vec![Slope::default(); P::SUMS];
        for &site in &part.sites {
            if site >= self.lattice.sites() {
                let (part, point) = (named(site), Vec::new());
                return Err(ModelError::ExchangeNotFinite { part, time, point });
            }
            let x = &state.x[site];
            let [w, s] = differentials_at::<P>(all, site);
            let AtSite { v, least_rate, .. } =
                part.at_site((time, temperature.unwrap_or(0.0)), site, x, [&w, &s]);
            if least_rate < 0.0 || least_rate.is_nan() {
                let (bath, rate) = (named(site), least_rate);
                return Err(ModelError::FrictionNotPositive { bath, rate, time });
            }
            if !v.is_finite() {
                let (part, point) = (named(site), entries(site));
                return Err(ModelError::ExchangeNotFinite { part, time, point });
            }
            let mut carried = Slope::default();
            carried.add::<P::Manifold>(&s, &v);
            let size = carried.size();
            if temperature.is_none() && size > BROKEN {
                let (port, point) = (named(site), entries(site));
                return Err(ModelError::WorkCarriesEntropy { port, time, point, size });
            }
            for (k, sum) in sums.iter_mut().enumerate() {
                let law: VectorOf<P> = self.lattice.parts.sum(k, site, x).df;
                sum.add::<P::Manifold>(&law, &v);
            }
        }
        match sums.iter().position(|sum| sum.size() > BROKEN) {
            Some(index) => {
                let (part, size, point) = (Arc::clone(&part.name), sums[index].size(), Vec::new());
                Err(ModelError::PortBreaksInvariant { part, index, time, point, size })
            }
            None => Ok(()),
        }
    }
}
