//! A system with noise as a flow: its laws and its sizes are those of the system without.

use metriplectic_dynamics::invariants::Kind;
use metriplectic_dynamics::{ModelError, SecondLaw};
use metriplectic_equations::Evaluated;
use metriplectic_manifolds::PointError;

use super::fluctuating::Fluctuating;
use super::system::Noisy;
use crate::step::{
    Directions, Element, Entries, EventExchange, Flow, FlowError, FlowVisitor, Laws, LedgerErrors,
    LedgerSummary, Listed, Recheck, Scales, StartError, StepError, Values, Written,
};

impl<F: Fluctuating<U>, U> Flow for Noisy<F, U> {
    type Space = F::Space;
    type Numbers = F::Numbers;
    type Vector = F::Vector;

    fn room(&self, work: &mut dyn FnMut()) {
        self.flow().room(work);
    }

    fn laws(&self, x: &Element<F>) -> Laws<F::Numbers> {
        self.flow().laws(x)
    }

    fn term_sizes(&self, x: &Element<F>) -> Laws<F::Numbers> {
        self.flow().term_sizes(x)
    }

    fn rates(&self, x: &Element<F>, d: &F::Vector) -> Option<F::Vector> {
        self.flow().rates(x, d)
    }

    fn sizes(&self, x: &Element<F>) -> F::Vector {
        self.flow().sizes(x)
    }

    fn moved(&self, x: &Element<F>, d: &F::Vector) -> Element<F> {
        self.flow().moved(x, d)
    }

    fn production(&self, x: &Element<F>) -> Option<f64> {
        self.flow().production(x)
    }

    fn onto(
        &self,
        y: &Element<F>,
        laws: &Laws<F::Numbers>,
        entropy: Option<f64>,
    ) -> Option<Element<F>> {
        self.flow().onto(y, laws, entropy)
    }

    fn begin(&self, x: Element<F>, time: f64) -> Result<Element<F>, StartError> {
        self.flow().begin(x, time)
    }

    fn clocked(&self, x: &Element<F>, time: f64) -> Option<Element<F>> {
        self.flow().clocked(x, time)
    }

    fn jumped(&self, x: &Element<F>, y: Element<F>) -> Element<F> {
        self.flow().jumped(x, y)
    }

    fn with_event(&self, x: &Element<F>, event: &EventExchange) -> Option<Element<F>> {
        self.flow().with_event(x, event)
    }

    /// Noise moves each state, so none is at rest.
    fn depends_on_time(&self) -> bool {
        true
    }

    fn ledger(&self, x: &Element<F>) -> Option<LedgerSummary> {
        self.flow().ledger(x)
    }

    fn has_ledger(&self) -> bool {
        self.flow().has_ledger()
    }

    fn ledger_errors(&self, errors: &F::Vector) -> Option<LedgerErrors> {
        self.flow().ledger_errors(errors)
    }

    fn with_ledger_sizes(&self, x: &Element<F>, scales: Scales<F::Vector>) -> Scales<F::Vector> {
        self.flow().with_ledger_sizes(x, scales)
    }

    fn inspect(&self, ends: [&Element<F>; 2], of_one_size: bool) -> Result<(), StepError> {
        self.flow().inspect(ends, of_one_size)
    }

    fn element(&self, entries: &[f64]) -> Result<Element<F>, PointError> {
        self.flow().element(entries)
    }

    fn entropy_law(&self) -> SecondLaw {
        self.flow().entropy_law()
    }

    fn evaluated(&self, x: &Element<F>) -> Vec<Evaluated> {
        self.flow().evaluated(x)
    }

    fn kinds(&self) -> Vec<Kind> {
        self.flow().kinds()
    }

    fn is_projected(&self) -> bool {
        self.flow().is_projected()
    }

    fn default_friction(&self, x: &Element<F>) -> Option<f64> {
        self.flow().default_friction(x)
    }

    fn check(&self, x0: &Element<F>) -> Result<(), ModelError> {
        if self.has_certificate() {
            self.flow().check_start_alone(x0)
        } else {
            self.flow().check(x0)
        }
    }

    fn is_verified(&self) -> bool {
        self.has_certificate() || self.flow().is_verified()
    }

    fn examine(&self, x0: &Element<F>) -> Result<(), FlowError> {
        if self.has_certificate() {
            self.flow().examine_start_alone(x0)?;
        } else {
            self.flow().examine(x0)?;
        }
        self.examine_law(x0).map_err(FlowError::new)
    }

    fn rechecks(&self, occasion: Recheck) -> bool {
        self.flow().rechecks(occasion)
    }

    fn recheck(&self, x: &Element<F>, occasion: Recheck) -> Result<(), ModelError> {
        self.flow().recheck(x, occasion)
    }

    /// Judges the conditions of the law, which may hold at the start alone.
    fn examine_end(&self, x: &Element<F>) -> Result<(), FlowError> {
        self.flow().examine_noise(x, self.noise()).map_err(FlowError::new)
    }

    /// Judges the conditions of the law at the end of the run too.
    fn reexamine(&self, x: &Element<F>, occasion: Recheck) -> Result<(), FlowError> {
        self.flow().reexamine(x, occasion)?;
        match occasion {
            Recheck::End => self.examine_end(x),
            Recheck::OnTheWay { .. } | Recheck::Failure { .. } => Ok(()),
        }
    }

    fn site_outside(&self, x: &Element<F>, d: &F::Vector) -> Option<usize> {
        self.flow().site_outside(x, d)
    }

    fn defect(&self, x: &Element<F>) -> f64 {
        self.flow().defect(x)
    }

    fn energy_sizes(&self, ends: [&Element<F>; 2]) -> [f64; 2] {
        self.flow().energy_sizes(ends)
    }

    fn entropy_round_off(&self, ends: [&Element<F>; 2]) -> f64 {
        self.flow().entropy_round_off(ends)
    }

    fn dependent_invariant(&self, x: &Element<F>) -> Option<(usize, f64)> {
        self.flow().dependent_invariant(x)
    }

    fn reach(&self, x: &Element<F>, span: f64) -> Option<Scales<F::Vector>> {
        self.flow().reach(x, span)
    }

    fn velocity_terms(
        &self,
        x: &Element<F>,
        v: &F::Vector,
        sizes: &F::Vector,
    ) -> Option<F::Vector> {
        self.flow().velocity_terms(x, v, sizes)
    }

    fn rates_and_terms(&self, x: &Element<F>) -> Option<[F::Vector; 2]> {
        self.flow().rates_and_terms(x)
    }

    /// As the flow without noise receives it.
    fn visit<V: FlowVisitor<Self>>(&self, visitor: V) -> V::Output {
        self.flow().visit(WithNoise { noisy: self, visitor })
    }
}

/// A visitor of a flow with noise, where the flow without it says in which way.
struct WithNoise<'a, F, U, V> {
    noisy: &'a Noisy<F, U>,
    visitor: V,
}

impl<F: Fluctuating<U>, U, V: FlowVisitor<Noisy<F, U>>> FlowVisitor<F> for WithNoise<'_, F, U, V> {
    type Output = V::Output;

    fn typed(self, _: &F) -> V::Output {
        self.visitor.typed(self.noisy)
    }

    fn written(self, _: &F) -> V::Output
    where
        F: Written,
    {
        self.visitor.written(self.noisy)
    }
}

impl<F: Fluctuating<U> + Listed, U> Listed for Noisy<F, U> {
    const CATCHES_PANICS: bool = F::CATCHES_PANICS;

    type Layout = F::Layout;

    fn layout(&self) -> &F::Layout {
        self.flow().layout()
    }

    fn read(layout: &F::Layout, entries: &[f64]) -> Element<F> {
        F::read(layout, entries)
    }

    fn at_start(&self, entries: &[f64]) -> Result<Element<F>, PointError> {
        self.flow().at_start(entries)
    }

    fn led(x: &Element<F>, y: Element<F>) -> Element<F> {
        F::led(x, y)
    }

    fn write(x: &Element<F>) -> Entries {
        F::write(x)
    }
}

impl<F: Fluctuating<U> + Written, U> Written for Noisy<F, U> {
    fn vector(directions: &Directions) -> F::Vector {
        F::vector(directions)
    }

    fn directions(v: &F::Vector) -> Directions {
        F::directions(v)
    }

    fn numbers(values: &Values) -> F::Numbers {
        F::numbers(values)
    }
}
