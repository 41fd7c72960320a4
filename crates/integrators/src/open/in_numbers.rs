//! Implicit steps of an open flow whose model is known in plain numbers: the scheme of the paper, `Gauss` and `Radau`.
//!
//! Ports and baths are a force `f(t, x, w)` of the model. A step books its work and heat from the covectors that the energy changes by,
//! so `H − W − Q` stays what it was, and the entropy grows by
//!
//! ```math
//! \Delta \Bigl( S + \sum_b S_b \Bigr) = h \sum_i b_i \Bigl( \langle w_{S,i}, K w_{S,i} \rangle + \sum_b R_b(A_i, A_i)/T_b \Bigr), \qquad
//! A_i = T_b w_{S,i} - w_{H,i} .
//! ```

use metriplectic_dynamics::SecondLaw;
use metriplectic_equations::{Equations, Model, Path, Sizes};
use metriplectic_manifolds::{Canonical, Euclidean, Retraction};

use super::balance::balanced;
use super::halves::{self, Failure};
use super::stages::NotDamped;
use super::state::OpenState;
use crate::collocation::dense::Within;
use crate::collocation::{Gauss, Radau, control};
use crate::discrete_gradient::DiscreteGradient;
use crate::implicit::{
    Collocation, DrivenMethod, DrivenStage, DrivenStart, DrivenStep, Midpoint, MidpointNumbers,
    NoImplicitSteps, StageNumbers, midpoint, refuse,
};
use crate::midpoint::Scheme;
use crate::midpoint::step::scheme_name;
use crate::numbers::AtRunTime;
use crate::step::dense::{self, Target};
use crate::step::failure::{Cause, Fallbacks};
use crate::step::{
    Control, Directions, Element, Entries, Flow, Laws, LedgerErrors, Memory, MethodError, Promises,
    Refusal, StateSpace, StepEnds, StepError, StepStart, Taken, Values,
};

/// The effect of all ports and baths, in a unit of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Exchanged {
    /// The work of each port; the heat and the entropy of each bath.
    pub entries: Vec<f64>,
    /// The entropy `Σ_b ⟨A, R A⟩/T` that is produced.
    pub production: f64,
}

/// An open flow whose states are a point with a time and a ledger, and whose model without clock and ledger is known in plain numbers.
///
/// [`OpenSteps`] are its implicit steps. Its energy does not depend on time.
pub trait OpenFlow: Flow<Space: StateSpace<Element = OpenState<Self::Point>>> {
    /// The point of a state.
    type Point: Clone;

    /// Calls `f` with the model of the points, on which the ports and the baths act as its force, the
    /// [gyroscopic part](metriplectic_equations::Part::Gyroscopic): the sum of their velocities at the time that it is asked for.
    fn with_equations<T>(&self, f: impl FnOnce(&dyn Equations) -> T) -> T;

    /// Writes a point.
    fn entries(&self, x: &Self::Point) -> Entries;

    /// Reads a point.
    fn point(&self, entries: &[f64]) -> Self::Point;

    /// The displacement by the components of a point, and by entries of the ledger at a clock that stands.
    fn direction(&self, v: &Directions, entries: &[f64]) -> Self::Vector;

    /// The laws of the model at a point, without the surroundings.
    fn laws_of_point(&self, x: &Self::Point) -> Laws<Self::Numbers>;

    /// Sums the effects of ports and baths at a time, at a point with these covectors of energy and entropy. `None` where they have
    /// no value, or a temperature is negative.
    fn exchanged(&self, t: f64, x: &[f64], w: [&[f64]; 2]) -> Option<Exchanged>;

    /// The number of baths.
    fn bath_count(&self) -> usize;

    /// The temperature of each bath at a time, with the index of its heat among the entries of the ledger.
    fn baths(&self, t: f64) -> Vec<(usize, f64)>;
}

/// An implicit method with steps of an [`OpenFlow`]: those of a [`Scheme`], of `Gauss` and of `Radau`.
///
/// A flow of your own implements [`Stepper`](crate::Stepper) for these methods by these functions, which have its names.
pub trait OpenSteps {
    /// The memory from one step to the next.
    type Memory: Memory;

    /// The name in a checkpoint.
    fn name(&self) -> String;

    /// The order of convergence.
    fn order(&self) -> u32;

    /// How steps follow a tolerance.
    fn control(&self) -> Control {
        Control::of_order(self.order())
    }

    /// Returns whether the method damps.
    fn damps(&self) -> bool {
        false
    }

    /// Refuses a flow of which the method has no steps.
    ///
    /// # Errors
    ///
    /// [`NoImplicitSteps`], or [`NotDamped`] by `Radau`.
    fn serves<F: OpenFlow>(&self, flow: &F) -> Result<(), MethodError>;

    /// Takes a step of size `h`, in halves if needed.
    ///
    /// # Errors
    ///
    /// [`StepError`] if it cannot be taken.
    fn step<F: OpenFlow>(
        &self,
        start: &StepStart<'_, F>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<F>, StepError>;

    /// Tries a step of size `h` once.
    ///
    /// # Errors
    ///
    /// The refusal of the step.
    fn attempt<F: OpenFlow>(
        &self,
        start: &StepStart<'_, F>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<F>, Refusal>;

    /// The error of a step by a norm.
    fn error<F: OpenFlow>(
        &self,
        step: &StepEnds<'_, F>,
        memory: &Self::Memory,
        norm: impl Fn(&F::Vector) -> f64,
    ) -> Option<f64> {
        let _ = memory;
        Some(norm(&step.flow.local_error(step.x, step.end, step.h)?))
    }

    /// The state at the fraction `θ` of a step that was taken.
    fn between<F: OpenFlow>(
        &self,
        step: &StepEnds<'_, F>,
        memory: &mut Self::Memory,
        theta: f64,
    ) -> Option<Element<F>> {
        let _ = memory;
        dense::between(step, promises(step.flow), theta)
    }
}

/// The laws that an implicit method keeps.
fn promises(flow: &impl Flow) -> Promises {
    Promises::all_laws(flow.entropy_law() == SecondLaw::Exact)
}

/// The model of a flow. A run has asked before it whether there is one.
fn model(equations: &dyn Equations) -> &dyn Model {
    equations.model().expect("a run refuses a system without a model")
}

/// Calls `f` with the start of a step of size `h`, which takes back these errors of earlier steps.
fn driven<F: OpenFlow, T>(
    (flow, x, h): (&F, &Element<F>, f64),
    accumulated_error: Option<Laws<Values>>,
    f: impl FnOnce(&DrivenStart<'_>) -> T,
) -> T {
    let values = in_values(&flow.laws_of_point(&x.x));
    let (times, x) = ([x.time, x.time + h], &flow.entries(&x.x));
    flow.with_equations(|equations| {
        f(&DrivenStart { model: model(equations), x, times, h, values, accumulated_error })
    })
}

/// Writes laws.
fn in_values<N: AsRef<[f64]>>(laws: &Laws<N>) -> Laws<Values> {
    let &Laws { energy, entropy, ref invariants } = laws;
    Laws { energy, entropy, invariants: Values::of(invariants.as_ref()) }
}

/// The round-off that earlier steps have left of the balance.
fn accumulated<F: OpenFlow>(start: &StepStart<'_, F>) -> Laws<Values> {
    crate::implicit::accumulated::<AtRunTime>([
        &in_values(&start.values),
        &in_values(&start.reference),
    ])
}

/// Books the stages of a step of size `h`, with what it has lost: the end, and the entropy that the exchange has produced.
fn booked<F: OpenFlow>(
    flow: &F,
    from: &Element<F>,
    step: &DrivenStep,
    h: f64,
) -> Option<(Element<F>, f64)> {
    let time = from.time + h;
    let (mut entries, mut production) = (Vec::new(), 0.0);
    for DrivenStage { time, weight, x, w: [energy, entropy] } in &step.stages {
        let rates = flow.exchanged(*time, x, [energy.numbers(), entropy.numbers()])?;
        entries.resize(rates.entries.len(), 0.0);
        let weight = h * weight;
        entries.iter_mut().zip(&rates.entries).for_each(|(sum, rate)| *sum += weight * rate);
        production += weight * rates.production;
    }
    if step.lost < 0.0 {
        // What a step has damped is heat of the only bath.
        let &[(heat, temperature)] = flow.baths(time).as_slice() else { return None };
        entries[heat] += step.lost;
        entries[heat + 1] -= if temperature > 0.0 { step.lost / temperature } else { 0.0 };
    }
    let ledger = from.ledger.with_entries(&entries);
    Some((OpenState { x: flow.point(&step.end), time, ledger }, production))
}

/// Solves a step, and books it.
fn open_step<M: DrivenMethod, F: OpenFlow>(
    method: &M,
    start: &StepStart<'_, F>,
    h: f64,
    memory: &mut M::Memory,
    fallbacks: Fallbacks,
) -> Result<(Taken<F>, DrivenStep), Failure> {
    let flow = start.flow;
    let from = (flow, start.x, h);
    let solved =
        driven(from, Some(accumulated(start)), |from| method.solve(from, memory, fallbacks));
    let solved = solved.map_err(|(cause, residual, effort)| Failure { cause, residual, effort })?;
    let effort = solved.effort;
    let edge = || Failure { cause: Cause::Edge, residual: f64::INFINITY, effort };
    let booked = booked(flow, start.x, &solved, h);
    let (x, production) = booked.ok_or_else(edge)?;
    if flow.defect(&x).is_infinite() {
        return Err(edge());
    }
    let (x, values) = balanced(start, x, effort)?;
    let mut evidence = solved.evidence;
    // The entropy changes where heat flows, too.
    evidence.dissipates |= production != 0.0;
    evidence.rests = false;
    Ok((Taken { x, values, evidence, effort }, solved))
}

/// The entries that are booked at a state in a unit of time.
fn rates<F: OpenFlow>(flow: &F, at: &Element<F>) -> Option<Vec<f64>> {
    let x = flow.entries(&at.x);
    let (n, w) = flow.with_equations(|equations| {
        let Sizes { laws, directions: n, .. } = equations.sizes();
        let (mut values, mut w) = (vec![0.0; laws], vec![0.0; laws * n]);
        equations.differentials(at.time, x.as_ref(), &mut values, &mut w);
        (n, w)
    });
    Some(flow.exchanged(at.time, &x, [&w[..n], &w[n..2 * n]])?.entries)
}

/// The errors of the entries of a ledger.
fn ledger_errors<F: OpenFlow>(flow: &F, errors: &[f64]) -> Option<LedgerErrors> {
    let nothing = Directions::zeros(flow.with_equations(|equations| equations.sizes().directions));
    flow.ledger_errors(&flow.direction(&nothing, errors))
}

/// The errors of what a step of the midpoint rule has booked: a third of the difference from the trapezoidal rule.
fn against_trapezoid<F: OpenFlow>(
    flow: &F,
    [x, end]: [&Element<F>; 2],
    h: f64,
) -> Option<LedgerErrors> {
    let (first, last) = (rates(flow, x)?, rates(flow, end)?);
    let booked = end.ledger.entries_since(&x.ledger);
    let rule = first.iter().zip(&last).map(|(first, last)| 0.5 * h * (first + last));
    let errors: Vec<f64> = booked.iter().zip(rule).map(|(sum, rule)| (sum - rule) / 3.0).collect();
    ledger_errors(flow, &errors)
}

impl<R, W> OpenSteps for Scheme<R, W>
where
    R: Retraction<Euclidean<1>, Canonical>,
    W: DiscreteGradient,
{
    type Memory = MidpointNumbers<AtRunTime>;

    fn name(&self) -> String {
        scheme_name::<R, W>()
    }

    fn order(&self) -> u32 {
        2
    }

    fn serves<F: OpenFlow>(&self, flow: &F) -> Result<(), MethodError> {
        let line = midpoint(self).line.ok_or(NoImplicitSteps::Scheme).map_err(MethodError::new)?;
        flow.with_equations(|system| refuse(system, line.path)).map_err(MethodError::new)
    }

    fn step<F: OpenFlow>(
        &self,
        start: &StepStart<'_, F>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<F>, StepError> {
        let method = midpoint(self);
        let mut whole = true;
        halves::take(start, h, self.splits, &mut |start, h, fallbacks| {
            if !std::mem::replace(&mut whole, false) {
                *memory = MidpointNumbers::default();
            }
            of_midpoint(&method, start, h, memory, fallbacks)
        })
    }

    fn attempt<F: OpenFlow>(
        &self,
        start: &StepStart<'_, F>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<F>, Refusal> {
        of_midpoint(&midpoint(self), start, h, memory, Fallbacks::FirstTries)
            .map_err(|failure| failure.into_refusal(start.time, h))
    }
}

/// A step of the midpoint scheme, with the errors of its entries.
fn of_midpoint<F: OpenFlow>(
    method: &Midpoint,
    start: &StepStart<'_, F>,
    h: f64,
    memory: &mut MidpointNumbers<AtRunTime>,
    fallbacks: Fallbacks,
) -> Result<Taken<F>, Failure> {
    let (mut taken, _) = open_step(method, start, h, memory, fallbacks)?;
    taken.evidence.ledger = against_trapezoid(start.flow, [start.x, &taken.x], h);
    Ok(taken)
}

/// The defects of the rates of the ledger at both ends of a step, `h (R(0) − r(t, x))` and `h (R(1) − r(t', x'))` with the polynomial
/// `R` of their values `r` at the stages.
fn ledger_defects<F: OpenFlow>(
    method: &Collocation,
    flow: &F,
    ends: [&Element<F>; 2],
    stages: &[DrivenStage],
) -> Option<[Vec<f64>; 2]> {
    let h = ends[1].time - ends[0].time;
    let at_stage = |DrivenStage { time, x, w: [energy, entropy], .. }: &DrivenStage| {
        Some(flow.exchanged(*time, x, [energy.numbers(), entropy.numbers()])?.entries)
    };
    let at_stages = stages.iter().map(at_stage).collect::<Option<Vec<_>>>()?;
    let defect = |node: f64, at: &Element<F>| {
        let coefficients = method.tableau.velocity(node);
        let mut defect = rates(flow, at)?;
        for (i, defect) in defect.iter_mut().enumerate() {
            let along = coefficients.iter().zip(&at_stages).map(|(c, rates)| c * rates[i]);
            *defect = h * (along.sum::<f64>() - *defect);
        }
        Some(defect)
    };
    Some([defect(0.0, ends[0])?, defect(1.0, ends[1])?])
}

/// The errors of what a step with stages has booked: relative to what has flowed about `(e/s)^{(p+1)/(s+1)}` for a defect `e`, by
/// which steps of this method follow a tolerance.
fn errors_of_stages<F: OpenFlow>(
    method: &Collocation,
    flow: &F,
    ends: [&Element<F>; 2],
    stages: &[DrivenStage],
) -> Option<LedgerErrors> {
    let [first, second] = ledger_defects(method, flow, ends, stages)?;
    let [start, end] = ends.map(|x| x.ledger.entry_sizes());
    let power = f64::from(method.tableau.order + 1) / (method.tableau.stages as f64 + 1.0);
    let error = |i: usize| {
        let defect = first[i].abs().max(second[i].abs());
        let size = start[i].max(end[i]);
        if defect < size { size * (defect / size).powf(power) } else { defect }
    };
    let errors: Vec<f64> = (0..first.len()).map(error).collect();
    ledger_errors(flow, &errors)
}

/// A step with stages, with the errors of its entries.
fn of_stages<F: OpenFlow>(
    method: &Collocation,
    start: &StepStart<'_, F>,
    h: f64,
    memory: &mut StageNumbers<AtRunTime>,
    fallbacks: Fallbacks,
) -> Result<Taken<F>, Failure> {
    let (mut taken, DrivenStep { stages, .. }) = open_step(method, start, h, memory, fallbacks)?;
    taken.evidence.ledger = errors_of_stages(method, start.flow, [start.x, &taken.x], &stages);
    Ok(taken)
}

/// Refuses a flow in which a method that damps would not know where its heat goes.
fn damps<F: OpenFlow>(method: &Collocation, flow: &F) -> Result<(), MethodError> {
    if !method.tableau.one_sided {
        return Ok(());
    }
    let has_entropy =
        flow.with_equations(|equations| equations.second_law() != SecondLaw::NoEntropy);
    let baths = flow.bath_count();
    if has_entropy || baths != 1 { Err(MethodError::new(NotDamped)) } else { Ok(()) }
}

/// The error of a step with stages: the larger one of the defects at its ends.
fn error_of_stages<F: OpenFlow>(
    method: &Collocation,
    &StepEnds { flow, x, end, h, .. }: &StepEnds<'_, F>,
    memory: &StageNumbers<AtRunTime>,
    norm: impl Fn(&F::Vector) -> f64,
) -> Option<f64> {
    let (defects, stages) = driven((flow, x, h), None, |start| {
        let defects = method.driven_defects(start, &flow.entries(&end.x), memory)?;
        Some((defects, method.driven_stages(start, memory)?))
    })?;
    let of_ledger = ledger_defects(method, flow, [x, end], &stages)?;
    let [first, second] = [0, 1].map(|i| norm(&flow.direction(&defects[i], &of_ledger[i])));
    Some(first.max(second))
}

/// The state at the fraction `θ` of a step with stages: a step of size `θh`, guessed by the polynomial of the whole one, and moved onto
/// the balance of the run with an entropy that does not fall from one fraction to a later one.
fn between_stages<F: OpenFlow>(
    method: &Collocation,
    step: &StepEnds<'_, F>,
    memory: &StageNumbers<AtRunTime>,
    theta: f64,
) -> Option<Element<F>> {
    if theta <= 0.0 {
        return Some(step.x.clone());
    }
    if theta >= 1.0 {
        return Some(step.end.clone());
    }
    let (flow, h) = (step.flow, theta * step.h);
    let part =
        driven((flow, step.x, h), None, |start| method.part_of_driven(start, memory, theta))?;
    let (y, _) = booked(flow, step.x, &part, h)?;
    let promises = promises(flow);
    let within = Within { tableau: method.tableau, step, theta };
    let entropy = promises.entropy.then(|| within.entropy(flow.laws(&y).entropy));
    let line = || y.clone();
    Some(Target::new(step, promises, theta, entropy).reached_from(&y, line))
}

macro_rules! of_stages {
    ($($name:ident),*) => {$(
        impl<const S: usize> OpenSteps for $name<S> {
            type Memory = StageNumbers<AtRunTime>;

            fn name(&self) -> String {
                format!("{}::<{S}>", stringify!($name))
            }

            fn order(&self) -> u32 {
                Self::tableau().order
            }

            fn control(&self) -> Control {
                control(Self::tableau())
            }

            fn damps(&self) -> bool {
                Self::tableau().one_sided
            }

            fn serves<F: OpenFlow>(&self, flow: &F) -> Result<(), MethodError> {
                flow.with_equations(|system| refuse(system, Path::Chart))
                    .map_err(MethodError::new)?;
                damps(&Self::in_numbers(), flow)
            }

            fn step<F: OpenFlow>(
                &self,
                start: &StepStart<'_, F>,
                h: f64,
                memory: &mut Self::Memory,
            ) -> Result<Taken<F>, StepError> {
                let (method, splits) = (Self::in_numbers(), Self::SPLITS.min(Gauss::<1>::SPLITS));
                let mut whole = true;
                halves::take(start, h, splits, &mut |start, h, fallbacks| {
                    if !std::mem::replace(&mut whole, false) {
                        *memory = StageNumbers::default();
                    }
                    of_stages(&method, start, h, memory, fallbacks)
                })
            }

            fn attempt<F: OpenFlow>(
                &self,
                start: &StepStart<'_, F>,
                h: f64,
                memory: &mut Self::Memory,
            ) -> Result<Taken<F>, Refusal> {
                of_stages(&Self::in_numbers(), start, h, memory, Fallbacks::FirstTries)
                    .map_err(|failure| failure.into_refusal(start.time, h))
            }

            fn error<F: OpenFlow>(
                &self,
                step: &StepEnds<'_, F>,
                memory: &Self::Memory,
                norm: impl Fn(&F::Vector) -> f64,
            ) -> Option<f64> {
                error_of_stages(&Self::in_numbers(), step, memory, norm)
            }

            fn between<F: OpenFlow>(
                &self,
                step: &StepEnds<'_, F>,
                memory: &mut Self::Memory,
                theta: f64,
            ) -> Option<Element<F>> {
                between_stages(&Self::in_numbers(), step, memory, theta)
            }
        }
    )*};
}

of_stages!(Gauss, Radau);
