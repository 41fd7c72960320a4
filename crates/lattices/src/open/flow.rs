//! An open lattice as a flow.

use metriplectic_dynamics::invariants::Kind;
use metriplectic_dynamics::{ModelError, SecondLaw};
use metriplectic_integrators::explicit::{Combination, StageFlow as _, Target};
use metriplectic_integrators::open::{Ledger, OpenState};
use metriplectic_integrators::{
    Entries, EventExchange, Flow, FlowError, Laws, LedgerErrors, LedgerSummary, Listed, Recheck,
    Scales, StartError, StateSpace as _, StepError, Vector as _,
};
use metriplectic_manifolds::PointError;

use super::parts::per_energy;
use super::vector::OpenSiteVector;
use super::{OpenLattice, OpenSites, StateOf};
use crate::flow::{against_simpson, listed};
use crate::model::Model;

/// The fraction of the energy to which the errors of work and heat are relative as long as less has flowed.
const LITTLE: f64 = 1e-3;

impl<P: Model> Listed for OpenLattice<P> {
    /// A ledger without entries.
    type Layout = Ledger;

    fn layout(&self) -> &Ledger {
        &self.empty
    }

    fn read(empty: &Ledger, entries: &[f64]) -> StateOf<P> {
        let (points, rest) = entries.split_at(entries.len() - 1 - empty.numbers().len());
        OpenState { x: listed(points), time: rest[0], ledger: empty.with_numbers(&rest[1..]) }
    }

    fn at_start(&self, entries: &[f64]) -> Result<StateOf<P>, PointError> {
        match self.lattice.element(entries) {
            Err(PointError::Length { .. }) => self.element(entries),
            points => points.map(|x| self.start(x)),
        }
    }

    fn led(x: &StateOf<P>, y: StateOf<P>) -> StateOf<P> {
        x.at(y.x)
    }

    fn write(x: &StateOf<P>) -> Entries {
        OpenSites::<P::Manifold>::numbers(x).into()
    }
}

impl<P: Model> Flow for OpenLattice<P> {
    type Space = OpenSites<P::Manifold>;
    type Numbers = Vec<f64>;
    type Vector = OpenSiteVector;

    fn laws(&self, x: &StateOf<P>) -> Laws<Vec<f64>> {
        x.ledger.balanced(self.lattice.laws(&x.x))
    }

    fn term_sizes(&self, x: &StateOf<P>) -> Laws<Vec<f64>> {
        let sizes = self.lattice.term_sizes(&x.x);
        let energy = sizes.energy + x.ledger.net().abs();
        Laws { energy, entropy: sizes.entropy + x.ledger.entropy_of_baths().abs(), ..sizes }
    }

    fn entropy_round_off(&self, ends: [&StateOf<P>; 2]) -> f64 {
        let of_baths = ends.map(|x| x.ledger.entropy_of_baths().abs());
        self.lattice.entropy_round_off(ends.map(|x| &x.x))
            + 4.0 * f64::EPSILON * of_baths[0].max(of_baths[1])
    }

    fn energy_sizes(&self, ends: [&StateOf<P>; 2]) -> [f64; 2] {
        // What flows in may find a state without energy.
        let flowed = ends[1].ledger.flowed(&ends[0].ledger);
        ends.map(|x| self.term_sizes(x).energy + flowed)
    }

    fn rates(&self, x: &StateOf<P>, d: &OpenSiteVector) -> Option<OpenSiteVector> {
        let y = self.stage(x, d)?;
        let (v, _) = self.motion(&y)?;
        Some(self.stage_rates(x, (d, &y), &v))
    }

    fn sizes(&self, x: &StateOf<P>) -> OpenSiteVector {
        let mut beside = vec![0.0];
        beside.extend(x.ledger.entry_sizes());
        OpenSiteVector::new(self.lattice.sizes(&x.x), beside)
    }

    fn moved(&self, x: &StateOf<P>, d: &OpenSiteVector) -> StateOf<P> {
        self.advanced(x, &d.beside, self.lattice.moved(&x.x, &d.v))
    }

    fn displacement(&self, x: &StateOf<P>, y: &StateOf<P>) -> Option<OpenSiteVector> {
        let v = self.lattice.displacement(&x.x, &y.x)?;
        Some(OpenSiteVector::new(v, self.beside(x, y)))
    }

    fn production(&self, x: &StateOf<P>) -> Option<f64> {
        Some(self.motion(x)?.1)
    }

    fn onto(
        &self,
        y: &StateOf<P>,
        laws: &Laws<Vec<f64>>,
        entropy: Option<f64>,
    ) -> Option<StateOf<P>> {
        let laws = Laws { entropy: entropy.unwrap_or(laws.entropy), ..laws.clone() };
        let (error, _) = self.motion(y)?;
        let with_entropy = entropy.is_some();
        let error = Some(Combination { factor: 1.0, terms: &[(1.0, &error)] });
        let target = Target { laws: &laws, with_entropy, limit: None, units: None, error };
        self.project(y.clone(), &target).ok().map(|end| end.x)
    }

    fn element(&self, entries: &[f64]) -> Result<StateOf<P>, PointError> {
        let beside = 1 + self.empty.numbers().len();
        let Some(length) = entries.len().checked_sub(beside) else {
            return Err(PointError::Length { found: entries.len(), expected: beside });
        };
        let (points, rest) = entries.split_at(length);
        let x = self.lattice.element(points)?;
        Ok(OpenState { x, time: rest[0], ledger: self.empty.with_numbers(&rest[1..]) })
    }

    fn begin(&self, x: StateOf<P>, time: f64) -> Result<StateOf<P>, StartError> {
        x.begun(time, &self.empty)
    }

    fn clocked(&self, x: &StateOf<P>, time: f64) -> Option<StateOf<P>> {
        // The energy of a lattice does not depend on time, so no work is done by the clock.
        (x.time.to_bits() != time.to_bits()).then(|| OpenState { time, ..x.clone() })
    }

    fn jumped(&self, x: &StateOf<P>, y: StateOf<P>) -> StateOf<P> {
        x.at(y.x)
    }

    fn with_event(&self, x: &StateOf<P>, event: &EventExchange) -> Option<StateOf<P>> {
        Some(OpenState { ledger: x.ledger.with_event(event), ..x.clone() })
    }

    fn depends_on_time(&self) -> bool {
        true
    }

    fn ledger(&self, x: &StateOf<P>) -> Option<LedgerSummary> {
        Some(x.ledger.summarised(None, self.entropy_at(x)))
    }

    fn has_ledger(&self) -> bool {
        true
    }

    fn ledger_errors(&self, errors: &OpenSiteVector) -> Option<LedgerErrors> {
        Some(self.empty.errors_by_kind(&errors.beside[1..]))
    }

    fn with_ledger_sizes(
        &self,
        x: &StateOf<P>,
        mut scales: Scales<OpenSiteVector>,
    ) -> Scales<OpenSiteVector> {
        let energy = LITTLE * self.lattice.term_sizes(&x.x).energy;
        let mut known = vec![0.0];
        for part in &self.parts {
            known.push(energy);
            known.extend(part.temperature(x.time).map(|t| energy * per_energy(t)));
        }
        for (size, known) in scales.sizes.beside.iter_mut().zip(known) {
            *size = size.max(known);
        }
        scales
    }

    fn inspect(&self, ends: [&StateOf<P>; 2], _: bool) -> Result<(), StepError> {
        let time = ends[1].time;
        self.look_at_parts(ends[1]).map_err(|law| StepError::Model { time, law: Box::new(law) })
    }

    fn entropy_law(&self) -> SecondLaw {
        let baths = || self.parts.iter().filter(|part| part.is_bath());
        match self.lattice.entropy_law() {
            _ if baths().any(|part| part.is_cold()) => SecondLaw::Published,
            SecondLaw::NoEntropy if baths().next().is_some() => SecondLaw::Exact,
            law => law,
        }
    }

    fn kinds(&self) -> Vec<Kind> {
        self.lattice.kinds()
    }

    fn check(&self, x0: &StateOf<P>) -> Result<(), ModelError> {
        self.look_at_parts(x0)
    }

    fn examine(&self, x0: &StateOf<P>) -> Result<(), FlowError> {
        self.lattice.examine_start(&x0.x, self.is_verified())
    }

    fn is_verified(&self) -> bool {
        self.verified || self.lattice.is_verified()
    }

    fn rechecks(&self, occasion: Recheck) -> bool {
        self.lattice.rechecks(occasion)
    }

    fn reexamine(&self, x: &StateOf<P>, occasion: Recheck) -> Result<(), FlowError> {
        self.lattice.reexamine(&x.x, occasion)
    }

    fn site_outside(&self, x: &StateOf<P>, d: &OpenSiteVector) -> Option<usize> {
        self.lattice.site_outside(&x.x, &d.v)
    }

    fn defect(&self, x: &StateOf<P>) -> f64 {
        self.lattice.defect(&x.x)
    }

    fn velocity_terms(
        &self,
        x: &StateOf<P>,
        v: &OpenSiteVector,
        sizes: &OpenSiteVector,
    ) -> Option<OpenSiteVector> {
        let terms = self.lattice.velocity_terms(&x.x, &v.v, &sizes.v)?;
        Some(OpenSiteVector::new(terms, v.zero().beside))
    }

    fn local_error(&self, x: &StateOf<P>, end: &StateOf<P>, h: f64) -> Option<OpenSiteVector> {
        against_simpson(self, x, end, h)
    }
}
