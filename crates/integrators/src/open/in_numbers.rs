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
use metriplectic_equations::{
    Apart, Covectors, Differences, Equations, Evaluated, Kind, Part, Path, Paths, PointError, Sizes,
};
use metriplectic_manifolds::{Canonical, Euclidean, Retraction};

use super::balance::balanced;
use super::beside::Beside;
use super::halves::{self, Failure};
use super::stages::NotDamped;
use super::state::OpenState;
use super::surrounded::{OpenFlow, PointOf};
use crate::collocation::dense::Within;
use crate::collocation::{Gauss, Radau, control};
use crate::discrete_gradient::DiscreteGradient;
use crate::implicit::{
    Collocation, DrivenMethod, DrivenStage, DrivenStart, DrivenStep, Midpoint, MidpointNumbers,
    NoImplicitSteps, StageNumbers, TimeOfStep, WorkOfTime, midpoint, refuse,
};
use crate::midpoint::Scheme;
use crate::midpoint::step::scheme_name;
use crate::numbers::AtRunTime;
use crate::step::dense::{self, Target};
use crate::step::failure::{Cause, Fallbacks};
use crate::step::{
    Control, Directions, Element, Entries, Flow, Laws, LedgerErrors, Listed, Memory, MethodError,
    Promises, Refusal, StepEnds, StepError, StepStart, Taken, Values, Vector as _,
};

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

/// Refuses a flow without implicit steps.
fn serves<F: OpenFlow>(flow: &F, path: Path) -> Result<(), NoImplicitSteps> {
    flow.serve_points(path)?;
    refuse(&Differences(Driven(flow, None)), path)
}

/// The laws that an implicit method keeps.
fn promises(flow: &impl Flow) -> Promises {
    Promises::all_laws(flow.entropy_law() == SecondLaw::Exact)
}

/// An open flow in plain numbers: its points, with ports and baths as a force, whose energy is the mean of those at two times, or where
/// there are none that at the time that it is asked for.
struct Driven<'a, F>(&'a F, Option<[f64; 2]>);

/// Writes a point.
fn written<F: OpenFlow>(x: &PointOf<F>) -> Entries {
    <F::Closed<'_> as Listed>::write(x)
}

/// Reads a point.
fn point<F: OpenFlow>(entries: &[f64]) -> PointOf<F> {
    <F::Closed<'_> as Listed>::read(&(), entries)
}

impl<F: OpenFlow> Driven<'_, F> {
    /// Asks the points at a time. A run has asked before it whether their parts are known.
    fn ask<T>(&self, t: f64, f: impl FnOnce(&dyn Apart) -> T) -> T {
        self.0.with_parts(t, f).expect("a run refuses a system without a model")
    }

    /// Fills lists at the time, or with the means of those at both times.
    fn mean<const K: usize>(
        &self,
        t: f64,
        mut to: [&mut [f64]; K],
        f: impl Fn(&dyn Apart, f64, [&mut [f64]; K]),
    ) {
        let [t, end] = self.1.unwrap_or([t; 2]);
        self.ask(t, |parts| f(parts, t, to.each_mut().map(|to| &mut **to)));
        if t.to_bits() == end.to_bits() || !self.0.has_clock() {
            return;
        }
        let mut after = to.each_ref().map(|to| to.to_vec());
        self.ask(end, |parts| f(parts, end, after.each_mut().map(|to| &mut **to)));
        for (to, after) in to.iter_mut().zip(&after) {
            to.iter_mut().zip(after).for_each(|(to, after)| *to = 0.5 * (*to + after));
        }
    }
}

impl<F: OpenFlow> Equations for Driven<'_, F> {
    fn sizes(&self) -> Sizes {
        self.ask(0.0, |parts| parts.sizes())
    }

    fn values(&self, t: f64, x: &[f64], values: &mut [f64]) {
        self.mean(t, [values], |parts, t, [values]| parts.values(t, x, values));
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.mean(t, [values, w], |parts, t, [values, w]| parts.differentials(t, x, values, w));
    }

    fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        let (velocity, exchanged) = self.0.velocity_of(t, &point::<F>(x), None)?;
        v.copy_from_slice(&velocity.to_list());
        Some(exchanged.production)
    }

    fn second_law(&self) -> SecondLaw {
        self.ask(0.0, |parts| parts.second_law())
    }

    fn evaluated(&self, x: &[f64]) -> Vec<Evaluated> {
        self.ask(0.0, |parts| parts.evaluated(x))
    }

    fn kind(&self, invariant: usize) -> Kind {
        self.ask(0.0, |parts| parts.kind(invariant))
    }

    fn check(&self, x: &[f64]) -> Result<(), PointError> {
        self.ask(0.0, |parts| parts.check(x))
    }

    fn defect(&self, x: &[f64]) -> f64 {
        self.ask(0.0, |parts| parts.defect(x))
    }

    fn scales(&self, x: &[f64], sizes: &mut [f64]) {
        self.ask(0.0, |parts| parts.scales(x, sizes));
    }

    fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]) {
        self.ask(0.0, |parts| parts.chart(x, q, y));
    }

    fn coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) -> bool {
        self.ask(0.0, |parts| parts.coordinates(x, y, q))
    }
}

impl<F: OpenFlow> Apart for Driven<'_, F> {
    fn has_charts(&self) -> bool {
        self.ask(0.0, |parts| parts.has_charts())
    }

    fn paths(&self) -> Option<&dyn Paths> {
        self.ask(0.0, |parts| parts.paths().is_some()).then_some(self)
    }

    fn is_zero(&self, part: Part) -> bool {
        let is_zero = self.ask(0.0, |parts| parts.is_zero(part));
        is_zero && !(part == Part::Gyroscopic && self.0.empty().has_entries())
    }

    fn is_poisson(&self) -> bool {
        self.ask(0.0, |parts| parts.is_poisson())
    }

    fn apply(&self, part: Part, t: f64, x: &[f64], w: Covectors<'_>, alpha: &[f64], v: &mut [f64]) {
        self.ask(t, |parts| {
            if parts.is_zero(part) { v.fill(0.0) } else { parts.apply(part, t, x, w, alpha, v) }
        });
        if part == Part::Gyroscopic
            && self.0.exchanged(t, x, [w.energy, w.entropy], Some(&mut *v)).is_none()
        {
            v.fill(f64::NAN);
        }
    }
}

impl<F: OpenFlow> Driven<'_, F> {
    /// Asks the paths of the points.
    fn along<T>(&self, f: impl FnOnce(&dyn Paths) -> T) -> T {
        self.ask(0.0, |parts| f(parts.paths().expect("the points have paths")))
    }
}

metriplectic_equations::follows_paths! {
    /// The paths of the points, which do not depend on time.
    [F: OpenFlow] Driven<'_, F>: along
}

/// The work of the time in a step of an open flow.
struct InStep<'a, F>(&'a F, [f64; 2]);

impl<F: OpenFlow> WorkOfTime for InStep<'_, F> {
    fn frozen(&self, x: &[f64]) -> f64 {
        self.0.frozen_work(self.1, &point::<F>(x))
    }

    fn power(&self, t: f64, x: &[f64]) -> f64 {
        self.0.power(t, &point::<F>(x))
    }
}

/// Calls `f` with the start of a step of size `h`, which takes back these errors of earlier steps; with the mean of the energies at both
/// ends for a midpoint scheme.
fn driven<F: OpenFlow, T>(
    (flow, x, h): (&F, &Element<F>, f64),
    has_mean_energy: bool,
    accumulated_error: Option<Laws<Values>>,
    f: impl FnOnce(&DrivenStart<'_>) -> T,
) -> T {
    let (times, entries) = ([x.time, x.time + h], &written::<F>(&x.x));
    let mut values = in_values(&flow.at(x.time).laws(&x.x));
    if has_mean_energy && flow.has_clock() {
        values.energy = 0.5 * (values.energy + flow.at(times[1]).laws(&x.x).energy);
    }
    let work = InStep(flow, times);
    f(&DrivenStart {
        model: &Differences(Driven(flow, has_mean_energy.then_some(times))),
        x: entries,
        times: TimeOfStep(times),
        clock: flow.has_clock().then_some(&work),
        h,
        values,
        accumulated_error,
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
    let (mut entries, mut production) = (vec![step.work_of_time], 0.0);
    for DrivenStage { time, weight, x, w: [energy, entropy] } in &step.stages {
        let rates = flow.exchanged(*time, x, [energy.numbers(), entropy.numbers()], None)?;
        entries.resize(1 + rates.entries.len(), 0.0);
        let (weight, sums) = (h * weight, entries[1..].iter_mut());
        sums.zip(&rates.entries).for_each(|(sum, rate)| *sum += weight * rate);
        production += weight * rates.production;
    }
    if step.lost < 0.0 {
        // What a step has damped is heat of the only bath.
        let &[(heat, temperature)] = flow.baths(time).as_slice() else { return None };
        entries[heat + 1] += step.lost;
        entries[heat + 2] -= if temperature > 0.0 { step.lost / temperature } else { 0.0 };
    }
    let ledger = from.ledger.with_entries(&entries);
    Some((OpenState { x: point::<F>(&step.end), time, ledger }, production))
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
    let (from, accumulated) = ((flow, start.x, h), Some(accumulated(start)));
    let solved =
        driven(from, M::HAS_MEAN_ENERGY, accumulated, |from| method.solve(from, memory, fallbacks));
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

/// A frozen point of the work of the time, with its share.
type FrozenPoint<F> = (PointOf<F>, f64);

/// The entries that are booked at a place in a unit of time: the work of the time beside that of a frozen point, then those of ports and
/// baths with these covectors.
fn rates_with<F: OpenFlow>(
    flow: &F,
    t: f64,
    (x, entries): (&PointOf<F>, &[f64]),
    w: [&[f64]; 2],
    (z, share): &FrozenPoint<F>,
) -> Option<Vec<f64>> {
    let by_time = if flow.has_clock() { flow.power(t, x) - share * flow.power(t, z) } else { 0.0 };
    let mut rates = vec![by_time];
    rates.extend(flow.exchanged(t, entries, w, None)?.entries);
    Some(rates)
}

/// The entries that are booked at a state in a unit of time.
fn rates<F: OpenFlow>(flow: &F, at: &Element<F>, frozen: &FrozenPoint<F>) -> Option<Vec<f64>> {
    let x = written::<F>(&at.x);
    let (n, w) = flow.with_parts(at.time, |parts| {
        let Sizes { laws, directions: n, .. } = parts.sizes();
        let (mut values, mut w) = (vec![0.0; laws], vec![0.0; laws * n]);
        parts.differentials(at.time, &x, &mut values, &mut w);
        (n, w)
    })?;
    rates_with(flow, at.time, (&at.x, &x), [&w[..n], &w[n..2 * n]], frozen)
}

/// The errors of the entries of a ledger.
fn ledger_errors<F: OpenFlow>(flow: &F, at: &Element<F>, errors: &[f64]) -> Option<LedgerErrors> {
    flow.ledger_errors(&direction(flow, at, None, errors))
}

/// The displacement by these numbers of a point, or none of them, and by entries of the ledger at a clock that stands.
fn direction<F: OpenFlow>(
    flow: &F,
    at: &Element<F>,
    v: Option<&Directions>,
    entries: &[f64],
) -> Beside<F::Velocity> {
    let mut beside = vec![0.0];
    beside.extend(entries);
    let zero = flow.at(at.time).sizes(&at.x).zero();
    Beside { v: v.map_or_else(|| zero.clone(), |v| zero.with(|i| v[i])), beside }
}

/// The errors of what a step of the midpoint rule has booked: a third of the difference from the trapezoidal rule.
fn against_trapezoid<F: OpenFlow>(
    flow: &F,
    [x, end]: [&Element<F>; 2],
    h: f64,
) -> Option<LedgerErrors> {
    let frozen = (x.x.clone(), 1.0);
    let (first, last) = (rates(flow, x, &frozen)?, rates(flow, end, &frozen)?);
    let mut booked = end.ledger.entries_since(&x.ledger);
    booked[0] -= flow.frozen_work([x.time, end.time], &x.x);
    let rule = first.iter().zip(&last).map(|(first, last)| 0.5 * h * (first + last));
    let errors: Vec<f64> = booked.iter().zip(rule).map(|(sum, rule)| (sum - rule) / 3.0).collect();
    ledger_errors(flow, x, &errors)
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
        let known = midpoint(self).line.ok_or(NoImplicitSteps::Scheme);
        known.and_then(|line| serves(flow, line.path)).map_err(MethodError::new)
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
    frozen: &(Entries, f64),
) -> Option<[Vec<f64>; 2]> {
    let h = ends[1].time - ends[0].time;
    let frozen = &(point::<F>(&frozen.0), frozen.1);
    let at_stage = |DrivenStage { time, x, w: [energy, entropy], .. }: &DrivenStage| {
        let w = [energy.numbers(), entropy.numbers()];
        rates_with(flow, *time, (&point::<F>(x), x), w, frozen)
    };
    let at_stages = stages.iter().map(at_stage).collect::<Option<Vec<_>>>()?;
    let defect = |node: f64, at: &Element<F>| {
        let coefficients = method.tableau.velocity(node);
        let mut defect = rates(flow, at, frozen)?;
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
    DrivenStep { stages, frozen, .. }: &DrivenStep,
) -> Option<LedgerErrors> {
    let [first, second] = ledger_defects(method, flow, ends, stages, frozen)?;
    let [start, end] = ends.map(|x| x.ledger.entry_sizes());
    let power = f64::from(method.tableau.order + 1) / (method.tableau.stages as f64 + 1.0);
    let error = |i: usize| {
        let defect = first[i].abs().max(second[i].abs());
        let size = start[i].max(end[i]);
        if defect < size { size * (defect / size).powf(power) } else { defect }
    };
    let errors: Vec<f64> = (0..first.len()).map(error).collect();
    ledger_errors(flow, ends[0], &errors)
}

/// A step with stages, with the errors of its entries.
fn of_stages<F: OpenFlow>(
    method: &Collocation,
    start: &StepStart<'_, F>,
    h: f64,
    memory: &mut StageNumbers<AtRunTime>,
    fallbacks: Fallbacks,
) -> Result<Taken<F>, Failure> {
    let (mut taken, step) = open_step(method, start, h, memory, fallbacks)?;
    taken.evidence.ledger = errors_of_stages(method, start.flow, [start.x, &taken.x], &step);
    Ok(taken)
}

/// Refuses a flow in which a method that damps would not know where its heat goes.
fn damps<F: OpenFlow>(method: &Collocation, flow: &F) -> Result<(), MethodError> {
    if !method.tableau.one_sided {
        return Ok(());
    }
    let has_entropy = flow.at(0.0).entropy_law() != SecondLaw::NoEntropy;
    if has_entropy || flow.empty().heats().count() != 1 {
        Err(MethodError::new(NotDamped))
    } else {
        Ok(())
    }
}

/// The error of a step with stages: the larger one of the defects at its ends.
fn error_of_stages<F: OpenFlow>(
    method: &Collocation,
    &StepEnds { flow, x, end, h, .. }: &StepEnds<'_, F>,
    memory: &StageNumbers<AtRunTime>,
    norm: impl Fn(&F::Vector) -> f64,
) -> Option<f64> {
    let (defects, (stages, frozen)) = driven((flow, x, h), false, None, |start| {
        let defects = method.driven_defects(start, &written::<F>(&end.x), memory)?;
        Some((defects, method.driven_stages(start, memory)?))
    })?;
    let of_ledger = ledger_defects(method, flow, [x, end], &stages, &frozen)?;
    let [first, second] =
        [0, 1].map(|i| norm(&direction(flow, x, Some(&defects[i]), &of_ledger[i])));
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
    let part = driven((flow, step.x, h), false, None, |start| {
        method.part_of_driven(start, memory, theta)
    })?;
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
                serves(flow, Path::Chart).map_err(MethodError::new)?;
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
