//! An open lattice for explicit methods: stages with clock and ledger, and the projection of the sites alone.

use metriplectic_integrators::explicit::{Combination, Projected, ProjectionError, Target};
use metriplectic_integrators::open::OpenState;
use metriplectic_integrators::{Laws, StageFlow};

use super::parts::Exchanged;
use super::vector::OpenSiteVector;
use super::{OpenLattice, StateOf};
use crate::flow::LatticeJets;
use crate::lattice::Differentials;
use crate::model::{Model, VectorOf};
use crate::points::Points;

/// The laws of an open lattice at a state, with the differentials of those of the lattice.
#[derive(Clone, Debug)]
pub struct OpenJets<V> {
    jets: LatticeJets<V>,
    values: Laws<Vec<f64>>,
}

impl<P: Model> OpenLattice<P> {
    fn jets_at(&self, x: &StateOf<P>, jets: LatticeJets<VectorOf<P>>) -> OpenJets<VectorOf<P>> {
        OpenJets { values: x.ledger.balanced(jets.laws()), jets }
    }

    /// The velocity of all sites, with the rates of the clock and the ledger, and the production.
    pub(super) fn velocity_along(
        &self,
        t: f64,
        x: &Points<P::Manifold>,
        all: &Differentials,
    ) -> Option<(OpenSiteVector, f64)> {
        let (mut v, internal) = self.lattice.motion_along::<true>(x, all)?;
        let Exchanged { velocities, entries, production, .. } = self.exchanged(t, x, all);
        for (site, more) in velocities {
            v.add_at(site, &more);
        }
        let mut beside = Vec::with_capacity(1 + entries.len());
        beside.push(1.0);
        beside.extend(entries);
        let production = internal + production;
        let is_finite = production.is_finite() && beside.iter().all(|rate| rate.is_finite());
        is_finite.then(|| (OpenSiteVector::new(v, beside), production))
    }

    /// The state to which a displacement of the clock and the ledger leads, at these points.
    pub(super) fn advanced(
        &self,
        x: &StateOf<P>,
        beside: &[f64],
        points: Points<P::Manifold>,
    ) -> StateOf<P> {
        let (time, entries) = (x.time + beside[0], &beside[1..]);
        OpenState { x: points, time, ledger: x.ledger.with_entries(entries) }
    }

    /// The displacement of the clock and the ledger between two states.
    pub(super) fn beside(&self, x: &StateOf<P>, y: &StateOf<P>) -> Vec<f64> {
        let mut beside = vec![y.time - x.time];
        beside.extend(y.ledger.entries_since(&x.ledger));
        beside
    }
}

impl<P: Model> StageFlow for OpenLattice<P> {
    type Gradients = OpenJets<VectorOf<P>>;

    const WEIGHS_ERRORS: bool = true;

    fn gradients(&self, x: &StateOf<P>) -> Option<Self::Gradients> {
        Some(self.jets_at(x, self.lattice.gradients(&x.x)?))
    }

    fn values(&self, gradients: &Self::Gradients) -> Laws<Vec<f64>> {
        gradients.values.clone()
    }

    fn velocity(
        &self,
        x: &StateOf<P>,
        gradients: &Self::Gradients,
    ) -> Option<(OpenSiteVector, f64)> {
        self.velocity_along(x.time, &x.x, &gradients.jets.all)
    }

    fn motion(&self, x: &StateOf<P>) -> Option<(OpenSiteVector, f64)> {
        let (all, _) = self.lattice.differentials::<false>(&x.x);
        self.velocity_along(x.time, &x.x, &all)
    }

    fn stage(&self, x: &StateOf<P>, q: &OpenSiteVector) -> Option<StateOf<P>> {
        let points = self.lattice.stage(&x.x, &q.v)?;
        Some(self.advanced(x, &q.beside, points))
    }

    fn stage_rates(
        &self,
        x: &StateOf<P>,
        (q, y): (&OpenSiteVector, &StateOf<P>),
        v: &OpenSiteVector,
    ) -> OpenSiteVector {
        let rates = self.lattice.stage_rates(&x.x, (&q.v, &y.x), &v.v);
        OpenSiteVector::new(rates, v.beside.clone())
    }

    fn stage_coordinates(&self, x: &StateOf<P>, y: &StateOf<P>) -> OpenSiteVector {
        OpenSiteVector::new(self.lattice.stage_coordinates(&x.x, &y.x), self.beside(x, y))
    }

    /// Moves the sites alone. The energy of the lattice is to be the target and what has flowed in, its entropy the target less
    /// what the baths have gained.
    fn project(
        &self,
        y: StateOf<P>,
        target: &Target<'_, Self>,
    ) -> Result<Projected<Self>, ProjectionError> {
        let OpenState { x, time, ledger } = y;
        let (laws, of_baths) = (ledger.targets(target.laws), ledger.entropy_of_baths());
        let terms = target.error.into_iter().flat_map(|error| error.terms);
        let terms: Vec<_> = terms.map(|&(w, v)| (w, &v.v)).collect();
        let of_sites =
            |error: Combination<'_, _>| Combination { factor: error.factor, terms: &terms };
        let inner = Target {
            laws: &laws,
            with_entropy: target.with_entropy && P::ENTROPY,
            limit: target.limit.map(|limit| limit.map(|v: &OpenSiteVector| &v.v)),
            units: target.units.map(|v| &v.v),
            error: target.error.map(of_sites),
        };
        let Projected { x, gradients, entropy, entropy_round_off } =
            self.lattice.project(x, &inner)?;
        // Without an entropy of its own, the lattice leaves that of the baths as it is.
        let entropy = if P::ENTROPY { entropy } else { 0.0 };
        let x = OpenState { x, time, ledger };
        Ok(Projected {
            gradients: self.jets_at(&x, gradients),
            x,
            entropy: entropy + of_baths,
            entropy_round_off: entropy_round_off + 2.0 * f64::EPSILON * of_baths.abs(),
        })
    }
}
