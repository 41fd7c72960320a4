//! Runs of flows in plain numbers: compiled with this library, and not with each system.

use metriplectic_equations::Equations;

use crate::compiled;
use crate::numbers::{Answered, Beside, FromEquations, InTypes};
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
    Compiled, Element, Entries, Flow, FlowError, FlowVisitor, PlainFlow, PlainMethod, PlainNumbers,
    Stepper, Written, in_room,
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
        self.in_numbers(flow, |method, x0, schedule| {
            let in_numbers = InPlainNumbers::from(flow, x0);
            let run = || run(method, (&in_numbers, Entries::zeros(0)), schedule);
            if const { F::CATCHES_PANICS } {
                caught(run).unwrap_or_else(|panicked| Err(FlowError::new(panicked).into()))
            } else {
                run()
            }
        })
    }

    fn answered(self, flow: &F, system: &dyn Equations) -> Self::Output
    where
        F: Written,
    {
        // A constant, so that the method is not compiled in types beside.
        if const { M::IS_EXPLICIT && F::HAS_EXPLICIT || M::IS_IMPLICIT && F::HAS_IMPLICIT } {
            let Self { method, x0, schedule } = self;
            let (method, asked) = (method.compiled(), (system, &InTypes(flow) as &dyn Beside));
            let schedule = in_numbers(schedule, flow);
            return read::<F>(flow, run_compiled(method, asked, F::write(&x0), schedule));
        }
        self.in_numbers(flow, |method, x0, schedule| {
            run_answered(method, (system, &InTypes(flow)), F::write(&x0), schedule)
        })
    }

    fn own(self, flow: &F, system: &dyn Equations) -> Self::Output
    where
        F: Written,
    {
        // A constant, so that an explicit method is not compiled with each system.
        if const { M::IS_EXPLICIT } {
            let Self { method, x0, schedule } = self;
            let schedule = in_numbers(schedule, flow);
            return read::<F>(flow, run_own(method.compiled(), system, F::write(&x0), schedule));
        }
        self.written(flow)
    }
}

impl<F: Written, M: Stepper<F>> Whole<F, M> {
    /// Runs the method in plain numbers, and reads what comes out in the types of the flow.
    fn in_numbers(
        self,
        flow: &F,
        run: impl FnOnce(&dyn PlainMethod, Element<F>, Schedule) -> Outcome,
    ) -> Result<Trajectory<F::Space>, RunError<F::Space>> {
        let Self { method, x0, schedule } = self;
        let schedule = in_numbers(schedule, flow);
        read::<F>(flow, run(&MethodInTypes { method, flow }, x0, schedule))
    }
}

/// Writes the events of a schedule.
fn in_numbers<F: Written>(mut schedule: Schedule, flow: &F) -> Schedule {
    for request in &mut schedule.watch.events {
        *request = request.in_numbers(flow);
    }
    schedule
}

/// The outcome of a run in plain numbers.
type Outcome = Result<Trajectory<PlainNumbers>, RunError<PlainNumbers>>;

/// Reads the outcome of a run in the types of a flow.
fn read<F: Written>(
    flow: &F,
    outcome: Outcome,
) -> Result<Trajectory<F::Space>, RunError<F::Space>> {
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

/// Runs a system of which nearly all is asked by its equations.
fn run_answered(
    method: &dyn PlainMethod,
    (system, beside): (&dyn Equations, &dyn Beside),
    x0: Entries,
    schedule: Schedule,
) -> Outcome {
    run(method, (&Answered { numbers: FromEquations(system), beside }, x0), schedule)
}

/// Runs a system of one's own by an explicit method. It may panic.
fn run_own(
    method: Option<Compiled>,
    system: &dyn Equations,
    x0: Entries,
    schedule: Schedule,
) -> Outcome {
    let method = method.and_then(compiled::explicit).expect("a constant says that it is explicit");
    let flow = &FromEquations(system);
    let in_numbers = InPlainNumbers::from(flow, x0);
    let start = (&in_numbers as &PlainFlow<'_>, Entries::zeros(0));
    let run = || run(&MethodInTypes { method, flow }, start, schedule);
    caught(run).unwrap_or_else(|panicked| Err(FlowError::new(panicked).into()))
}

/// Runs a system by a method that is compiled with the library.
fn run_compiled(
    method: Option<Compiled>,
    (system, beside): (&dyn Equations, &dyn Beside),
    x0: Entries,
    schedule: Schedule,
) -> Outcome {
    let flow = Answered { numbers: FromEquations(system), beside };
    let run = |method: &dyn PlainMethod| run(method, (&flow, x0), schedule);
    let done = method.and_then(|method| compiled::with_method(method, &flow, run));
    done.expect("the constants say that there is an instance")
}

impl State<PlainNumbers> {
    fn read<F: Written>(self, layout: &F::Layout) -> State<F::Space> {
        let Self { step, time, point, energy, entropy } = self;
        State { step, time, point: F::read(layout, &point), energy, entropy }
    }
}

impl Event<PlainNumbers> {
    fn read<F: Written>(self, layout: &F::Layout) -> Event<F::Space> {
        let Self { name, index, rises, state, jump } = self;
        let jump =
            jump.map(|Jump { after, exchange }| Jump { after: after.read::<F>(layout), exchange });
        Event { name, index, rises, state: state.read::<F>(layout), jump }
    }
}

impl Trajectory<PlainNumbers> {
    fn read<F: Written>(self, layout: &F::Layout) -> Trajectory<F::Space> {
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
    fn read<F: Written>(self, layout: &F::Layout) -> RunError<F::Space> {
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
