//! A flow in plain numbers: it answers as the flow does in its types, and reads and writes numbers. So does a method of it.

use std::cell::Cell;

use metriplectic_dynamics::invariants::Kind;
use metriplectic_dynamics::{ModelError, SecondLaw};
use metriplectic_equations::Evaluated;
use metriplectic_manifolds::PointError;

use super::panicked::{Panicked, caught};
use super::plain_method::{PlainMemory, PlainMethod};
use super::{
    Control, Directions, Effort, Element, Entries, EventExchange, Excursion, Flow, FlowError, Laws,
    LedgerErrors, LedgerSummary, MethodError, NoiseSummary, PlainFlow, PlainNumbers, Promises,
    Recheck, Refusal, Scales, StartError, StepEnds, StepError, StepStart, Stepper, Taken, Values,
    Written, both, dense,
};

/// A flow in plain numbers.
pub(crate) struct InPlainNumbers<'a, F: Flow> {
    flow: &'a F,
    /// The state in which a run starts, until it has begun: its ledger may be that of another flow.
    start: Cell<Option<Element<F>>>,
}

/// Writes the laws of a flow.
pub(crate) fn written<L: AsRef<[f64]>>(
    Laws { energy, entropy, invariants }: &Laws<L>,
) -> Laws<Values> {
    Laws { energy: *energy, entropy: *entropy, invariants: Values::of(invariants.as_ref()) }
}

/// Reads the laws of a flow.
pub(crate) fn typed<F: Written>(
    Laws { energy, entropy, invariants }: &Laws<Values>,
) -> Laws<F::Numbers> {
    Laws { energy: *energy, entropy: *entropy, invariants: F::numbers(invariants) }
}

impl<'a, F: Written> InPlainNumbers<'a, F> {
    /// The flow, for a run from a state.
    pub(crate) const fn from(flow: &'a F, start: Element<F>) -> Self {
        Self { flow, start: Cell::new(Some(start)) }
    }

    #[inline]
    fn at(&self, x: &[f64]) -> Element<F> {
        F::read(self.flow.layout(), x)
    }

    fn scales(Scales { sizes, terms }: Scales<F::Vector>) -> Scales<Directions> {
        Scales { sizes: F::directions(&sizes), terms: F::directions(&terms) }
    }
}

impl<F: Written> Flow for InPlainNumbers<'_, F> {
    type Space = PlainNumbers;
    type Numbers = Values;
    type Vector = Directions;

    fn room(&self, work: &mut dyn FnMut()) {
        self.flow.room(work);
    }

    fn laws(&self, x: &Entries) -> Laws<Values> {
        written(&self.flow.laws(&self.at(x)))
    }

    fn term_sizes(&self, x: &Entries) -> Laws<Values> {
        written(&self.flow.term_sizes(&self.at(x)))
    }

    /// Has no value where the flow panics: so a checkpoint of the states before is written.
    fn rates(&self, x: &Entries, d: &Directions) -> Option<Directions> {
        let rates = || self.flow.rates(&self.at(x), &F::vector(d));
        let rates =
            if const { F::CATCHES_PANICS } { caught(rates).ok().flatten() } else { rates() };
        rates.map(|v| F::directions(&v))
    }

    fn sizes(&self, x: &Entries) -> Directions {
        F::directions(&self.flow.sizes(&self.at(x)))
    }

    fn moved(&self, x: &Entries, d: &Directions) -> Entries {
        F::write(&self.flow.moved(&self.at(x), &F::vector(d)))
    }

    fn displacement(&self, x: &Entries, y: &Entries) -> Option<Directions> {
        self.flow.displacement(&self.at(x), &self.at(y)).map(|v| F::directions(&v))
    }

    fn production(&self, x: &Entries) -> Option<f64> {
        self.flow.production(&self.at(x))
    }

    fn onto(&self, y: &Entries, to: &Laws<Values>, entropy: Option<f64>) -> Option<Entries> {
        let (y, laws) = (self.at(y), typed::<F>(to));
        self.flow.onto(&y, &laws, entropy).map(|y| F::write(&y))
    }

    /// Begins in the state that was given in types.
    fn begin(&self, x: Entries, time: f64) -> Result<Entries, StartError> {
        let start = self.start.take().unwrap_or_else(|| self.at(&x));
        self.flow.begin(start, time).map(|x| F::write(&x))
    }

    fn clocked(&self, x: &Entries, time: f64) -> Option<Entries> {
        self.flow.clocked(&self.at(x), time).map(|x| F::write(&x))
    }

    fn jumped(&self, x: &Entries, y: Entries) -> Entries {
        F::write(&self.flow.jumped(&self.at(x), self.at(&y)))
    }

    fn with_event(&self, x: &Entries, event: &EventExchange) -> Option<Entries> {
        self.flow.with_event(&self.at(x), event).map(|x| F::write(&x))
    }

    fn depends_on_time(&self) -> bool {
        self.flow.depends_on_time()
    }

    fn ledger(&self, x: &Entries) -> Option<LedgerSummary> {
        self.flow.ledger(&self.at(x))
    }

    fn has_ledger(&self) -> bool {
        self.flow.has_ledger()
    }

    fn ledger_errors(&self, errors: &Directions) -> Option<LedgerErrors> {
        self.flow.ledger_errors(&F::vector(errors))
    }

    fn with_ledger_sizes(&self, x: &Entries, scales: Scales<Directions>) -> Scales<Directions> {
        let Scales { sizes, terms } = scales;
        let scales = Scales { sizes: F::vector(&sizes), terms: F::vector(&terms) };
        Self::scales(self.flow.with_ledger_sizes(&self.at(x), scales))
    }

    fn inspect(&self, ends: [&Entries; 2], of_one_size: bool) -> Result<(), StepError> {
        let [x, y] = both(ends, |x| self.at(x));
        self.flow.inspect([&x, &y], of_one_size)
    }

    fn element(&self, entries: &[f64]) -> Result<Entries, PointError> {
        self.flow.element(entries).map(|x| F::write(&x))
    }

    fn entropy_law(&self) -> SecondLaw {
        self.flow.entropy_law()
    }

    fn evaluated(&self, x: &Entries) -> Vec<Evaluated> {
        self.flow.evaluated(&self.at(x))
    }

    fn kinds(&self) -> Vec<Kind> {
        self.flow.kinds()
    }

    fn is_projected(&self) -> bool {
        self.flow.is_projected()
    }

    fn default_friction(&self, x: &Entries) -> Option<f64> {
        self.flow.default_friction(&self.at(x))
    }

    fn check(&self, x0: &Entries) -> Result<(), ModelError> {
        self.flow.check(&self.at(x0))
    }

    fn is_verified(&self) -> bool {
        self.flow.is_verified()
    }

    fn examine(&self, x0: &Entries) -> Result<(), FlowError> {
        self.flow.examine(&self.at(x0))
    }

    fn rechecks(&self, occasion: Recheck) -> bool {
        self.flow.rechecks(occasion)
    }

    fn recheck(&self, x: &Entries, occasion: Recheck) -> Result<(), ModelError> {
        self.flow.recheck(&self.at(x), occasion)
    }

    fn reexamine(&self, x: &Entries, occasion: Recheck) -> Result<(), FlowError> {
        self.flow.reexamine(&self.at(x), occasion)
    }

    /// A panic is an error of the flow, so the states before it are kept.
    fn verdict(&self, x: &Entries, time: f64, occasion: Recheck) -> Result<(), StepError> {
        let verdict = || self.flow.verdict(&self.at(x), time, occasion);
        if const { F::CATCHES_PANICS } {
            let error = |panicked| StepError::Flow { time, law: FlowError::new(panicked) };
            return caught(verdict).map_err(error)?;
        }
        verdict()
    }

    fn examine_end(&self, x: &Entries) -> Result<(), FlowError> {
        self.flow.examine_end(&self.at(x))
    }

    fn site_outside(&self, x: &Entries, d: &Directions) -> Option<usize> {
        self.flow.site_outside(&self.at(x), &F::vector(d))
    }

    fn defect(&self, x: &Entries) -> f64 {
        self.flow.defect(&self.at(x))
    }

    fn energy_sizes(&self, ends: [&Entries; 2]) -> [f64; 2] {
        let [x, y] = both(ends, |x| self.at(x));
        self.flow.energy_sizes([&x, &y])
    }

    fn entropy_round_off(&self, ends: [&Entries; 2]) -> f64 {
        let [x, y] = both(ends, |x| self.at(x));
        self.flow.entropy_round_off([&x, &y])
    }

    fn dependent_invariant(&self, x: &Entries) -> Option<(usize, f64)> {
        self.flow.dependent_invariant(&self.at(x))
    }

    fn reach(&self, x: &Entries, span: f64) -> Option<Scales<Directions>> {
        self.flow.reach(&self.at(x), span).map(Self::scales)
    }

    fn velocity_terms(
        &self,
        x: &Entries,
        v: &Directions,
        sizes: &Directions,
    ) -> Option<Directions> {
        self.flow
            .velocity_terms(&self.at(x), &F::vector(v), &F::vector(sizes))
            .map(|v| F::directions(&v))
    }

    fn rates_and_terms(&self, x: &Entries) -> Option<[Directions; 2]> {
        self.flow
            .rates_and_terms(&self.at(x))
            .map(|[v, terms]| [F::directions(&v), F::directions(&terms)])
    }

    fn local_error(&self, x: &Entries, end: &Entries, h: f64) -> Option<Directions> {
        self.flow.local_error(&self.at(x), &self.at(end), h).map(|v| F::directions(&v))
    }
}

/// The start of a step in types, at its state.
fn start_in_types<'s, F: Written>(
    flow: &'s F,
    x: &'s Element<F>,
    start: &StepStart<'_, PlainFlow<'_>>,
) -> StepStart<'s, F> {
    StepStart {
        flow,
        x,
        time: start.time,
        values: typed::<F>(&start.values),
        reference: typed::<F>(&start.reference),
        allowed: start.allowed.as_ref().map(F::vector),
    }
}

/// The ends of a step in types, with the laws there.
struct EndsInTypes<F: Flow> {
    x: Element<F>,
    end: Element<F>,
    before: Laws<F::Numbers>,
    after: Laws<F::Numbers>,
    reference: Laws<F::Numbers>,
}

impl<F: Written> EndsInTypes<F> {
    fn of(flow: &F, step: &StepEnds<'_, PlainFlow<'_>>) -> Self {
        let [x, end] = both([step.x, step.end], |x| F::read(flow.layout(), x));
        let [before, after] = both(step.values, typed::<F>);
        Self { x, end, before, after, reference: typed::<F>(step.reference) }
    }

    const fn step<'s>(&'s self, flow: &'s F, h: f64) -> StepEnds<'s, F> {
        let Self { x, end, before, after, reference } = self;
        StepEnds { flow, x, end, h, values: [before, after], reference }
    }
}

/// A method that takes its steps in types, as one of flows in plain numbers.
pub(crate) struct MethodInTypes<'a, F, M> {
    pub(crate) method: M,
    pub(crate) flow: &'a F,
}

/// The error of a step in which the system has panicked.
fn error_of(start: &StepStart<'_, PlainFlow<'_>>, panicked: Panicked) -> StepError {
    StepError::Flow { time: start.time, law: FlowError::new(panicked) }
}

impl<F: Written, M: Stepper<F>> MethodInTypes<'_, F, M> {
    /// Says whether the method is one of this library without random numbers, whose answers about a path are not compiled.
    const HAS_NO_PATH: bool = M::IS_EXPLICIT || M::IS_IMPLICIT;

    #[inline]
    fn at(&self, x: &[f64]) -> Element<F> {
        F::read(self.flow.layout(), x)
    }

    #[inline]
    fn taken<'a>(Taken { x, values, evidence, effort }: Taken<F>) -> Taken<PlainFlow<'a>> {
        Taken { x: F::write(&x), values: written(&values), evidence, effort }
    }
}

impl<F: Written, M: Stepper<F>> PlainMethod for MethodInTypes<'_, F, M> {
    fn name(&self) -> String {
        self.method.name()
    }

    fn order(&self) -> u32 {
        self.method.order()
    }

    fn control(&self) -> Control {
        self.method.control()
    }

    fn damps(&self) -> bool {
        self.method.damps()
    }

    fn memory(&self) -> PlainMemory {
        PlainMemory::new(self.method.memory())
    }

    fn promises(&self, _: &PlainFlow<'_>) -> Promises {
        self.method.promises(self.flow)
    }

    fn noise(&self, _: &PlainFlow<'_>) -> Option<NoiseSummary> {
        self.method.noise(self.flow)
    }

    fn nothing_between(&self, time: f64, h: f64) -> StepError {
        self.method.nothing_between(time, h)
    }

    fn on_path(
        &self,
        start: &StepStart<'_, PlainFlow<'_>>,
        sizes: [f64; 2],
        memory: &PlainMemory,
    ) -> Option<Entries> {
        if const { Self::HAS_NO_PATH } {
            return None;
        }
        let inside = || {
            let x = self.at(start.x);
            let start = start_in_types(self.flow, &x, start);
            self.method.on_path(&start, sizes, memory.after_a_step()?)
        };
        let inside =
            if const { F::CATCHES_PANICS } { caught(inside).ok().flatten() } else { inside() };
        inside.map(|x| F::write(&x))
    }

    fn excursion(
        &self,
        start: &StepStart<'_, PlainFlow<'_>>,
        h: f64,
        memory: &PlainMemory,
        &Excursion { from, fractions, values, function }: &Excursion<'_, Entries>,
    ) -> Option<bool> {
        if const { Self::HAS_NO_PATH } {
            return None;
        }
        let drawn = || {
            let function = |x: &Element<F>| function(&F::write(x));
            let (from, function) = (&self.at(from), &function);
            let excursion = Excursion { from, fractions, values, function };
            let x = self.at(start.x);
            let start = start_in_types(self.flow, &x, start);
            self.method.excursion(&start, h, memory.after_a_step()?, &excursion)
        };
        if const { F::CATCHES_PANICS } { caught(drawn).ok().flatten() } else { drawn() }
    }

    fn check(&self, follows_tolerance: bool) -> Result<(), MethodError> {
        self.method.check(follows_tolerance)?;
        self.method.serves(self.flow)
    }

    fn step<'a>(
        &self,
        start: &StepStart<'_, PlainFlow<'a>>,
        h: f64,
        memory: &mut PlainMemory,
    ) -> Result<Taken<PlainFlow<'a>>, StepError> {
        let step = |memory: &mut PlainMemory| {
            let x = self.at(start.x);
            self.method.step(&start_in_types(self.flow, &x, start), h, memory.of())
        };
        if const { !F::CATCHES_PANICS } {
            return step(memory).map(Self::taken);
        }
        let before = memory.clone();
        match caught(|| step(memory)) {
            Ok(taken) => taken.map(Self::taken),
            Err(panicked) => {
                // A part of the step may have been taken.
                *memory = before;
                Err(error_of(start, panicked))
            }
        }
    }

    fn attempt<'a>(
        &self,
        start: &StepStart<'_, PlainFlow<'a>>,
        h: f64,
        memory: &mut PlainMemory,
    ) -> Result<Taken<PlainFlow<'a>>, Refusal> {
        let mut attempt = || {
            let x = self.at(start.x);
            self.method.attempt(&start_in_types(self.flow, &x, start), h, memory.of())
        };
        if const { !F::CATCHES_PANICS } {
            return attempt().map(Self::taken);
        }
        let refused = |panicked| Refusal {
            effort: Effort::default(),
            error: Some(error_of(start, panicked)),
            second_law: false,
        };
        caught(attempt).unwrap_or_else(|panicked| Err(refused(panicked))).map(Self::taken)
    }

    fn error(
        &self,
        step: &StepEnds<'_, PlainFlow<'_>>,
        memory: &PlainMemory,
        norm: &dyn Fn(&Directions) -> f64,
    ) -> Option<f64> {
        let error = || {
            let (memory, ends) = (memory.after_a_step()?, EndsInTypes::of(self.flow, step));
            let norm = |error: &F::Vector| norm(&F::directions(error));
            self.method.error(&ends.step(self.flow, step.h), memory, norm)
        };
        if const { F::CATCHES_PANICS } { caught(error).ok().flatten() } else { error() }
    }

    fn between(
        &self,
        step: &StepEnds<'_, PlainFlow<'_>>,
        memory: &mut PlainMemory,
        theta: f64,
    ) -> Option<Entries> {
        // A constant, so that the state is formed in plain numbers where it can be.
        if const { M::HAS_DEFAULT_BETWEEN && !F::CATCHES_PANICS } {
            return dense::between_in_numbers(step, self.method.promises(self.flow), theta);
        }
        let mut inside = || {
            let ends = EndsInTypes::of(self.flow, step);
            self.method.between(&ends.step(self.flow, step.h), memory.of(), theta)
        };
        let inside =
            if const { F::CATCHES_PANICS } { caught(inside).ok().flatten() } else { inside() };
        inside.map(|x| F::write(&x))
    }
}
