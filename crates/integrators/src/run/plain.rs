//! Runs of flows in plain numbers: compiled with this library, and not with each system.

use metriplectic_equations::Equations;

use crate::compiled;
use crate::implicit::NoImplicitSteps;
use crate::numbers::{Answered, FromEquations, InTypes};
use crate::run::error::RunError;
use crate::run::event::Event;
use crate::run::jump::Jump;
use crate::run::schedule::Schedule;
use crate::run::state::State;
use crate::run::steps::Steps;
use crate::run::trajectory::Trajectory;
use crate::step::in_plain::{InPlainNumbers, MethodInTypes};
use crate::step::panicked::caught;
use crate::step::{
    Compiled, Element, Entries, Flow, FlowError, FlowVisitor, Listed, MethodError, PlainFlow,
    PlainMethod, PlainNumbers, StateSpace, Stepper, Written, in_room,
};

/// A run of a method over a schedule, in the types of a flow or in plain numbers.
pub(super) struct Whole<F: Flow, M> {
    pub(super) method: M,
    pub(super) x0: Element<F>,
    pub(super) schedule: Schedule,
}

impl<F: Flow, M: Stepper<F>> FlowVisitor<F> for Whole<F, M> {
    type Output = Result<Trajectory<F::Space>, RunError<F::Space>>;

    fn typed(self, flow: &F) -> Self::Output {
        let Self { method, x0, schedule } = self;
        in_room(flow, || Steps::start(method, flow, x0, schedule)?.run())
    }

    fn written(self, flow: &F) -> Self::Output
    where
        F: Written,
    {
        read::<F>(flow, self.in_numbers(flow).written(flow))
    }

    fn answered(self, flow: &F, system: &dyn Equations) -> Self::Output
    where
        F: Written,
    {
        read::<F>(flow, self.in_numbers(flow).answered(flow, system))
    }

    fn own(self, flow: &F, system: &dyn Equations) -> Self::Output
    where
        F: Written,
    {
        read::<F>(flow, self.in_numbers(flow).own(flow, system))
    }
}

impl<F: Flow, M: Stepper<F>> Whole<F, M> {
    fn in_numbers(self, flow: &F) -> WholeInNumbers<F, M>
    where
        F: Written,
    {
        let Self { method, x0, schedule } = self;
        WholeInNumbers { method, x0, schedule: in_numbers(schedule, flow) }
    }
}

/// A run whose events are asked and whose states come out in plain numbers.
pub(super) struct WholeInNumbers<F: Flow, M> {
    pub(super) method: M,
    pub(super) x0: Element<F>,
    pub(super) schedule: Schedule,
}

impl<F: Listed, M: Stepper<F>> FlowVisitor<F> for WholeInNumbers<F, M> {
    type Output = Outcome;

    /// Runs in types, and writes what comes out.
    fn typed(self, flow: &F) -> Outcome {
        let Self { method, x0, mut schedule } = self;
        for request in &mut schedule.watch.events {
            *request = request.in_types(flow);
        }
        let run = || {
            let done = in_room(flow, || Steps::start(method, flow, x0, schedule)?.run());
            match done {
                Ok(run) => Ok(run.written::<F>()),
                Err(error) => Err(error.written::<F>()),
            }
        };
        if const { F::CATCHES_PANICS } { without_panics(run) } else { run() }
    }

    fn written(self, flow: &F) -> Outcome
    where
        F: Written,
    {
        let Self { method, x0, schedule } = self;
        let in_numbers = InPlainNumbers::from(flow, x0);
        let start = (&in_numbers as &PlainFlow<'_>, Entries::zeros(0));
        let run = || run(&MethodInTypes { method, flow }, start, schedule);
        if const { F::CATCHES_PANICS } { without_panics(run) } else { run() }
    }

    fn answered(self, flow: &F, system: &dyn Equations) -> Outcome
    where
        F: Written,
    {
        let Self { method, x0, schedule } = self;
        let (x0, beside) = (F::write(&x0), InTypes(flow));
        let answered = &Answered::of(system, &beside);
        // A constant, so that the method is not compiled in types beside.
        if const { M::IS_EXPLICIT && F::HAS_EXPLICIT || M::IS_IMPLICIT && F::HAS_IMPLICIT } {
            return run_compiled(method.compiled(), answered, x0, schedule);
        }
        run(&MethodInTypes { method, flow }, (answered, x0), schedule)
    }

    fn own(self, flow: &F, system: &dyn Equations) -> Outcome
    where
        F: Written,
    {
        // A constant, so that the method is not compiled with each system.
        if const { M::IS_EXPLICIT || M::IS_IMPLICIT } {
            let Self { method, x0, schedule } = self;
            return run_own(method.compiled(), system, F::write(&x0), schedule);
        }
        self.written(flow)
    }
}

/// Writes the events of a schedule.
fn in_numbers<F: Listed>(mut schedule: Schedule, flow: &F) -> Schedule {
    for request in &mut schedule.watch.events {
        *request = request.in_numbers(flow);
    }
    schedule
}

/// The outcome of a run in plain numbers.
pub(super) type Outcome = Result<Trajectory<PlainNumbers>, RunError<PlainNumbers>>;

/// Reads the outcome of a run in the types of a flow.
fn read<F: Listed>(flow: &F, outcome: Outcome) -> Result<Trajectory<F::Space>, RunError<F::Space>> {
    match outcome {
        Ok(run) => Ok(run.read::<F>(flow.layout())),
        Err(error) => Err(error.read::<F>(flow.layout())),
    }
}

/// Runs a flow in plain numbers.
fn run(
    method: &dyn PlainMethod,
    (flow, x0): (&PlainFlow<'_>, Entries),
    schedule: Schedule,
) -> Outcome {
    in_room(flow, || Steps::start_any(method, (flow, flow), x0, schedule)?.run())
}

/// Runs a system of one's own, which may panic.
fn run_own(
    method: Option<Compiled>,
    system: &dyn Equations,
    x0: Entries,
    schedule: Schedule,
) -> Outcome {
    let flow = &FromEquations(system);
    let in_numbers = InPlainNumbers::from(flow, x0);
    let start = (&in_numbers as &PlainFlow<'_>, Entries::zeros(0));
    let run = |method: &dyn PlainMethod| without_panics(|| run(method, start, schedule));
    let done = method.and_then(|method| compiled::with_own(method, flow, run));
    done.unwrap_or_else(|| Err(MethodError::new(NoImplicitSteps::Scheme).into()))
}

/// Runs a system by a method that is compiled with the library.
fn run_compiled(
    method: Option<Compiled>,
    flow: &Answered<'_>,
    x0: Entries,
    schedule: Schedule,
) -> Outcome {
    let run = |method: &dyn PlainMethod| run(method, (flow, x0), schedule);
    let done = method.and_then(|method| compiled::with_method(method, flow, run));
    done.expect("the constants say that there is an instance")
}

/// The outcome of a run, or the panic in it as its error.
pub(super) fn without_panics(run: impl FnOnce() -> Outcome) -> Outcome {
    caught(run).unwrap_or_else(|panicked| Err(FlowError::new(panicked).into()))
}

impl State<PlainNumbers> {
    fn read<F: Listed>(self, layout: &F::Layout) -> State<F::Space> {
        let Self { step, time, point, energy, entropy } = self;
        State { step, time, point: F::read(layout, &point), energy, entropy }
    }
}

impl Event<PlainNumbers> {
    fn read<F: Listed>(self, layout: &F::Layout) -> Event<F::Space> {
        let Self { name, index, rises, state, jump } = self;
        let jump =
            jump.map(|Jump { after, exchange }| Jump { after: after.read::<F>(layout), exchange });
        Event { name, index, rises, state: state.read::<F>(layout), jump }
    }
}

impl Trajectory<PlainNumbers> {
    fn read<F: Listed>(self, layout: &F::Layout) -> Trajectory<F::Space> {
        let Self { states, events, certificate, ending, checkpoint } = self;
        // Into an array of its own: in the one of the plain states it would leave a hole in the memory behind each run.
        let mut typed = Vec::with_capacity(states.len());
        typed.extend(states.into_iter().map(|state| state.read::<F>(layout)));
        let states = typed;
        let mut typed = Vec::with_capacity(events.len());
        typed.extend(events.into_iter().map(|event| event.read::<F>(layout)));
        let events = typed;
        Trajectory { states, events, certificate, ending, checkpoint }
    }
}

impl RunError<PlainNumbers> {
    fn read<F: Listed>(self, layout: &F::Layout) -> RunError<F::Space> {
        match self {
            Self::Model(error) => RunError::Model(error),
            Self::Flow(error) => RunError::Flow(error),
            Self::Method(error) => RunError::Method(error),
            Self::Span(error) => RunError::Span(error),
            Self::Start(error) => RunError::Start(error),
            Self::Step { cause, trajectory } => {
                RunError::Step { cause, trajectory: Box::new(trajectory.read::<F>(layout)) }
            }
        }
    }
}

/// Writes what a run in the types of a flow has left.
impl<M: StateSpace> State<M> {
    fn written<F: Listed<Space = M>>(self) -> State<PlainNumbers> {
        let Self { step, time, point, energy, entropy } = self;
        State { step, time, point: F::write(&point), energy, entropy }
    }
}

impl<M: StateSpace> Event<M> {
    fn written<F: Listed<Space = M>>(self) -> Event<PlainNumbers> {
        let Self { name, index, rises, state, jump } = self;
        let jump =
            jump.map(|Jump { after, exchange }| Jump { after: after.written::<F>(), exchange });
        Event { name, index, rises, state: state.written::<F>(), jump }
    }
}

impl<M: StateSpace> Trajectory<M> {
    fn written<F: Listed<Space = M>>(self) -> Trajectory<PlainNumbers> {
        let Self { states, events, certificate, ending, checkpoint } = self;
        let states = states.into_iter().map(State::written::<F>).collect();
        let events = events.into_iter().map(Event::written::<F>).collect();
        Trajectory { states, events, certificate, ending, checkpoint }
    }
}

impl<M: StateSpace> RunError<M> {
    fn written<F: Listed<Space = M>>(self) -> RunError<PlainNumbers> {
        match self {
            Self::Model(error) => RunError::Model(error),
            Self::Flow(error) => RunError::Flow(error),
            Self::Method(error) => RunError::Method(error),
            Self::Span(error) => RunError::Span(error),
            Self::Start(error) => RunError::Start(error),
            Self::Step { cause, trajectory } => {
                RunError::Step { cause, trajectory: Box::new(trajectory.written::<F>()) }
            }
        }
    }
}
