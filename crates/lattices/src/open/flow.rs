//! An open lattice as a flow.

use metriplectic_dynamics::ModelError;
use metriplectic_equations::{Apart, Path};
use metriplectic_fields::{Column as _, Real, ScalarField, Space as _};
use metriplectic_integrators::open::{Exchanged, Ledger, OpenFlow, compare_with_values, open_flow};
use metriplectic_integrators::{Flow as _, FlowError, NoImplicitSteps};
use metriplectic_manifolds::Manifold;

use super::in_time::{self, AtTime};
use super::parts::Exchanged as OfParts;
use super::{OpenLattice, StateOf};
use crate::dense::Dense;
use crate::flow::LatticeJets;
use crate::lattice::Lattice;
use crate::model::{Model, VectorOf};
use crate::points::{Points, Sites};
use crate::vector::SiteVector;

/// How many sites have the rate of their energy in time compared with its values.
const COMPARED: usize = 16;

impl<P: Model> OpenFlow for OpenLattice<P> {
    type Points = Sites<P::Manifold>;
    type Velocity = SiteVector;
    type Gradients = LatticeJets<VectorOf<P>>;
    type Closed<'a>
        = Lattice<AtTime<'a, P>>
    where
        Self: 'a;

    fn at(&self, t: f64) -> Lattice<AtTime<'_, P>> {
        self.at(t)
    }

    fn with_parts<T>(&self, t: f64, f: impl FnOnce(&dyn Apart) -> T) -> Option<T> {
        Some(f(&Dense(&self.at(t))))
    }

    fn serve_points(&self, _: Path) -> Result<(), NoImplicitSteps> {
        Ok(())
    }

    fn empty(&self) -> &Ledger {
        &self.empty
    }

    fn has_clock(&self) -> bool {
        !self.fields.is_empty()
    }

    fn power(&self, t: f64, x: &Points<P::Manifold>) -> f64 {
        in_time::sum::<P>(&self.fields, x, |field, site, x| {
            field(Real::new(t, 1.0, 0.0, 0.0), site, x).eps1
        })
    }

    /// The work of the energies that depend on time alone, so that it has the digits of these.
    fn frozen_work(&self, [t, end]: [f64; 2], x: &Points<P::Manifold>) -> f64 {
        let [t, end] = [t, end].map(Real::from);
        in_time::sum::<P>(&self.fields, x, |field, site, x| {
            field(end, site, x).re - field(t, site, x).re
        })
    }

    fn velocity_of(
        &self,
        t: f64,
        x: &Points<P::Manifold>,
        gradients: Option<&LatticeJets<VectorOf<P>>>,
    ) -> Option<(SiteVector, Exchanged)> {
        let lattice = self.at(t);
        let formed = gradients.is_none().then(|| lattice.differentials::<false>(x).0);
        let all = gradients.map_or(formed.as_ref(), |jets| Some(&jets.all))?;
        let (mut v, internal) = lattice.motion_along::<true>(x, all)?;
        let OfParts { velocities, entries, production, .. } = self.exchanged(t, x, all);
        for (site, more) in velocities {
            v.add_at(site, &more);
        }
        Some((v, Exchanged { entries, production: internal + production }))
    }

    fn exchanged(
        &self,
        t: f64,
        x: &[f64],
        w: [&[f64]; 2],
        force: Option<&mut [f64]>,
    ) -> Option<Exchanged> {
        if self.temperatures(t).iter().any(|temperature| *temperature < 0.0) {
            return None;
        }
        let OfParts { velocities, entries, production, .. } = self.exchanged_in_a_step(t, x, w);
        if let Some(force) = force {
            self.add_to(force, &velocities);
        }
        let is_finite = production.is_finite() && entries.iter().all(|rate| rate.is_finite());
        is_finite.then_some(Exchanged { entries, production })
    }

    fn temperatures(&self, t: f64) -> Vec<f64> {
        self.parts.iter().filter_map(|part| part.temperature(t)).collect()
    }

    fn has_cold_bath(&self) -> bool {
        self.parts.iter().any(|part| part.is_bath() && part.is_cold())
    }

    fn was_verified(&self) -> bool {
        self.verified || self.lattice.is_verified()
    }

    fn check_points(&self, _: &StateOf<P>) -> Result<(), ModelError> {
        Ok(())
    }

    fn examine_points(&self, x0: &StateOf<P>) -> Result<(), FlowError> {
        self.at(x0.time).examine_start(&x0.x, self.was_verified())
    }

    fn check_exchange(&self, x: &StateOf<P>) -> Result<(), ModelError> {
        self.look_at_parts(x)
    }

    /// At sites that are spread over the lattice.
    fn check_clock(&self, state: &StateOf<P>) -> Result<(), ModelError> {
        if state.x.len() != self.lattice.sites() {
            return Ok(());
        }
        let stride = self.lattice.sites().div_ceil(COMPARED).max(1);
        for site in (0..self.lattice.sites()).step_by(stride) {
            let (x, scales) = (&state.x[site], P::Manifold::scales(&state.x[site]));
            for field in &self.fields {
                let at = |t: Real| field(t, site, &P::Manifold::constant(x));
                let terms = |t: f64| {
                    let energy = |x: &_| field(Real::from(t), site, x);
                    let jet = ScalarField::<P::Manifold>::jet1(&energy, x);
                    jet.value.abs() + jet.df.abs().dot(&scales)
                };
                let rate = at(Real::new(state.time, 1.0, 0.0, 0.0)).eps1;
                let values = |t: f64| at(Real::from(t)).re;
                let point = || P::Manifold::entries(x);
                compare_with_values(state.time, rate, values, terms, point)?;
            }
        }
        Ok(())
    }
}

open_flow! {
    [P: Model] OpenLattice<P>: Lattice<P>,
    weighs errors: true, catches panics: false
}
