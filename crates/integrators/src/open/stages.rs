//! Gauss and Radau methods for open systems.
//!
//! ```math
//! W_t = H(t', z) - H(t, z) + h \sum_i b_i \bigl( \partial_t H(t_i, X_i) - \partial_t H(t_i, z) \bigr), \qquad
//! \delta_H = H(t', x') - H(t, x) - W_t - h \sum_i b_i \langle dH(t_i, X_i), v_i \rangle
//! ```
//!
//! with `z` the middle of the step. `δ_H` is the error of a rule for an integral that vanishes with the velocity, so the
//! corrected covectors have the order of the method up to rest. `Radau` reduces the share `θ` of `z` where a stiff
//! state follows the time and `z` does not. Ports and baths are evaluated at the stages, and `W_a`
//! and `Q_b` are the sums `h Σ b_i ⟨w_{H,i}, …⟩`.
//!
//! `Radau` corrects the energy where `δ_H > 0` alone. What it loses where it damps, `−δ_H`, is heat of the bath: the balance
//! stays exact, and the entropy of the bath rises by `−δ_H/T`. Which of several baths it would be is not known, so a system has
//! one: in proportion to what friction takes at the stages, a slow bath would get most of the heat of a fast one.

use metriplectic_dynamics::exchange::{Entries as _, Exchange};
use metriplectic_dynamics::{Metriplectic, SecondLaw, VectorField, system::Point};
use metriplectic_fields::{ChartPoint, Column as _, Real, Space, Vector};

use super::balance::balanced;
use super::clock::Clock;
use super::halves::{self, Failure};
use super::state::{Booked, OpenState};
use super::system::{OpenSystem, StateOf};
use super::vector::OpenVector;
use super::view::Frozen;
use crate::collocation::dense::Within;
use crate::collocation::{
    EnergyInTime, Gauss, InTime, MOST, Radau, Stage, StageMemory, StageSolution, Tableau,
    TimedStep, control,
};
use crate::step::dense::Target;
use crate::step::failure::{Cause, Fallbacks};
use crate::step::{
    Control, Dim, Effort, Flow, Laws, LedgerErrors, MethodError, Promises, Refusal, Start,
    StepEnds, StepError, StepStart, Stepper, Taken,
};

/// The energy of an open system along a step.
struct AlongStep<'a, Y, C, X> {
    system: &'a OpenSystem<Y, C, X>,
    times: [f64; 2],
}

impl<Y, C, X> std::fmt::Debug for AlongStep<'_, Y, C, X> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("AlongStep").field("times", &self.times).finish_non_exhaustive()
    }
}

impl<Y, C, X> AlongStep<'_, Y, C, X> {
    fn size(&self) -> f64 {
        self.times[1] - self.times[0]
    }

    fn time(&self, node: f64) -> f64 {
        // The end exactly, at which a protocol may jump.
        if node >= 1.0 { self.times[1] } else { self.times[0] + node * self.size() }
    }
}

impl<Y, C, X> EnergyInTime<Y::Manifold> for AlongStep<'_, Y, C, X>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
{
    fn change(&self, [x, end]: [&Point<Y>; 2], (z, share): (&Point<Y>, f64)) -> f64 {
        let [t, later] = self.times;
        let energy = |t, x| self.system.energy(t, x);
        if C::RUNS {
            (energy(later, end) - share * energy(later, z)) - (energy(t, x) - share * energy(t, z))
        } else {
            energy(t, end) - energy(t, x)
        }
    }

    fn size(&self, [x, end]: [&Point<Y>; 2], z: &Point<Y>) -> f64 {
        if !C::RUNS {
            return 0.0;
        }
        let [t, later] = self.times;
        // A stiff state has lost the digits of the frozen one, whatever its share.
        let sizes = [(later, end), (later, z), (t, x), (t, z)];
        sizes.into_iter().map(|(t, x)| self.system.energy(t, x).abs()).sum()
    }

    fn rate(&self, node: f64, x: &Point<Y>) -> f64 {
        self.size() * self.system.power(self.time(node), x)
    }

    fn slope(&self, node: f64, x: &<Y::Manifold as Space>::Point<Real>) -> f64 {
        let t = Real::new(self.time(node), self.size(), 0.0, 0.0);
        C::in_time(self.system.closed().energy(), t, x).eps1
    }
}

/// A step of an open system.
struct Step<'a, Y: Metriplectic, C, X> {
    tableau: &'static Tableau,
    system: &'a OpenSystem<Y, C, X>,
    along: AlongStep<'a, Y, C, X>,
    systems: [Frozen<'a, Y, C, X>; MOST],
    middle: Frozen<'a, Y, C, X>,
}

impl<'a, Y, C, X> Step<'a, Y, C, X>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
{
    fn new(tableau: &'static Tableau, system: &'a OpenSystem<Y, C, X>, times: [f64; 2]) -> Self {
        let along = AlongStep { system, times };
        let systems = std::array::from_fn(|i| system.frozen(along.time(tableau.nodes[i])));
        Self { tableau, system, middle: system.frozen(along.time(0.5)), along, systems }
    }

    fn timed(&self) -> TimedStep<'_, Frozen<'a, Y, C, X>> {
        let in_time = InTime { systems: &self.systems, energy: &self.along };
        TimedStep { tableau: self.tableau, middle: &self.middle, in_time }
    }

    /// The start of the step as that of a system which does not depend on time.
    fn start<'b>(
        &'b self,
        start: &StepStart<'b, OpenSystem<Y, C, X>>,
        h: f64,
    ) -> Start<'b, Frozen<'a, Y, C, X>> {
        let OpenState { x, time, .. } = start.x;
        let invariants = start.values.invariants;
        let values = Laws {
            energy: self.system.energy(*time, x),
            entropy: self.system.closed().entropy_at(x),
            invariants,
        };
        let accumulated_error =
            Start::<Frozen<'_, Y, C, X>>::accumulated([&start.values, &start.reference]);
        Start { system: &self.middle, x, time: *time, h, values, accumulated_error }
    }

    /// Books a step that was solved.
    fn booked(
        &self,
        from: &StateOf<Y>,
        solution: &StageSolution<Frozen<'a, Y, C, X>>,
        h: f64,
    ) -> Option<StateOf<Y>> {
        let Self { system, along, .. } = self;
        let StageSolution { end, frozen: (z, share), stages, lost, .. } = solution;
        let mut parameter = share * system.frozen_work(along.times, z);
        let mut entries = X::Entries::from_index(|_| 0.0);
        for stage in stages {
            let (t, weight) = (along.time(stage.node), h * stage.weight);
            if C::RUNS {
                let power = system.power(t, &stage.x) - share * system.power(t, z);
                parameter += stage.weight * along.size() * power;
            }
            let rates =
                system.exchanged(t, &stage.x, [&stage.energy, &stage.entropy]).ok()?.entries;
            entries = X::Entries::from_index(|i| entries.get(i) + weight * rates.get(i));
        }
        if *lost < 0.0 {
            // What a step has damped is heat of the only bath.
            let &[(heat, temperature)] = system.baths(along.time(1.0)).as_slice() else {
                return None;
            };
            let mut numbers: Vec<f64> = (0..X::Entries::LEN).map(|i| entries.get(i)).collect();
            numbers[heat] += lost;
            numbers[heat + 1] -= if temperature > 0.0 { lost / temperature } else { 0.0 };
            entries = X::Entries::from_index(|i| numbers[i]);
        }
        let ledger = from.ledger.with(&Booked { parameter, entries });
        Some(OpenState { x: end.clone(), time: along.times[1], ledger })
    }

    /// The defects of the rates of the ledger at both ends of a step,
    ///
    /// ```math
    /// h \bigl( R(0) - r(t, x) \bigr), \qquad h \bigl( R(1) - r(t', x') \bigr) ,
    /// ```
    ///
    /// with the polynomial `R` of their values `r` at the stages: `O(h^{s+1})`, as those of the motion.
    fn ledger_defects(
        &self,
        [x, end]: [&StateOf<Y>; 2],
        stages: &[Stage<Frozen<'a, Y, C, X>>],
        frozen: (&Point<Y>, f64),
    ) -> Option<[Booked<X::Entries>; 2]> {
        let Self { tableau, system, along, .. } = self;
        let (z, share) = frozen;
        let power = |t: f64, x: &Point<Y>| {
            if C::RUNS { system.power(t, x) - share * system.power(t, z) } else { 0.0 }
        };
        let mut rates = Vec::with_capacity(stages.len());
        for stage in stages {
            let t = along.time(stage.node);
            let w = [&stage.energy, &stage.entropy];
            let entries = system.exchanged(t, &stage.x, w).ok()?.entries;
            rates.push(Booked { parameter: power(t, &stage.x), entries });
        }
        let defect = |node: f64, at: &StateOf<Y>| {
            let entries = system.entry_rates(at.time, &at.x, &system.covectors(at.time, &at.x))?;
            let here = Booked { parameter: power(at.time, &at.x), entries };
            let coefficients = tableau.velocity(node);
            let mut terms = vec![(-along.size(), &here)];
            terms.extend(coefficients.iter().map(|c| c * along.size()).zip(&rates));
            Some(Booked::combined(&terms))
        };
        Some([defect(0.0, x)?, defect(1.0, end)?])
    }

    /// The errors of what a step has booked. The error of its rule is of a higher order than a defect `e`: relative to what has
    /// flowed it is about `(e/s)^{(p+1)/(s+1)}`, by which steps of this method follow a tolerance.
    fn ledger_errors(
        &self,
        ends: [&StateOf<Y>; 2],
        solution: &StageSolution<Frozen<'a, Y, C, X>>,
    ) -> Option<LedgerErrors> {
        let Self { tableau, system, .. } = self;
        let StageSolution { frozen: (z, share), stages, .. } = solution;
        let defects = self.ledger_defects(ends, stages, (z, *share))?;
        let sizes = ends.map(|x| x.ledger.sizes::<X::Entries>());
        let power = f64::from(tableau.order + 1) / (tableau.stages as f64 + 1.0);
        let error = |index: usize| {
            let [first, second] = defects.each_ref().map(|defect| defect.get(index).abs());
            let [start, end] = sizes.each_ref().map(|size| size.get(index));
            let (defect, size) = (first.max(second), start.max(end));
            if defect < size { size * (defect / size).powf(power) } else { defect }
        };
        let booked =
            Booked { parameter: error(0), entries: X::Entries::from_index(|i| error(i + 1)) };
        let none = OpenVector::of(Vector::<Y::Manifold>::zero());
        system.ledger_errors(&OpenVector { booked, ..none })
    }
}

/// Solves a step, and books it.
fn open_step<Y, C, X>(
    tableau: &'static Tableau,
    start: &StepStart<'_, OpenSystem<Y, C, X>>,
    h: f64,
    memory: &mut StageMemory<Dim<Y>>,
    fallbacks: Fallbacks,
) -> Result<Taken<OpenSystem<Y, C, X>>, Failure>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
{
    let (system, time) = (start.flow, start.x.time);
    let step = Step::new(tableau, system, [time, time + h]);
    let solution = step.timed().solve(&step.start(start, h), memory, fallbacks);
    let residual = f64::INFINITY;
    let solution = solution.map_err(|(cause, effort)| Failure { cause, residual, effort })?;
    let effort = solution.effort;
    let edge = || Failure { cause: Cause::Edge, residual, effort };
    let x = step.booked(start.x, &solution, h).ok_or_else(edge)?;
    let (x, values) = balanced(start, x, effort)?;
    let mut evidence = solution.evidence;
    evidence.dissipates |= X::BATHS > 0;
    evidence.ledger = step.ledger_errors([start.x, &x], &solution);
    Ok(Taken { x, values, evidence, effort })
}

/// The state at the fraction `θ` of a step: a step of size `θh`, guessed by the polynomial of the whole one, and moved onto
/// the balance of the run with an entropy that does not fall from one fraction to a later one.
fn between<Y, C, X>(
    within: &Within<'_, OpenSystem<Y, C, X>>,
    promises: Promises,
    memory: &StageMemory<Dim<Y>>,
) -> Option<StateOf<Y>>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
{
    let &Within { tableau, step, theta } = within;
    let system = step.flow;
    if theta <= 0.0 {
        return Some(step.x.clone());
    }
    if theta >= 1.0 {
        return Some(step.end.clone());
    }
    let (time, h) = (step.x.time, theta * step.h);
    let part = Step::new(tableau, system, [time, time + h]);
    let (values, reference) = (*step.values[0], *step.values[0]);
    let start = StepStart { flow: system, x: step.x, time, values, reference, allowed: None };
    let solution = part.timed().part(&part.start(&start, h), memory, theta)?;
    let y = part.booked(step.x, &solution, h)?;
    let entropy = promises.entropy.then(|| within.entropy(system.laws(&y).entropy));
    let line = || y.clone();
    Some(Target::new(step, promises, theta, entropy).reached_from(&y, line))
}

/// Why `Radau` does not take an open system, in the [`MethodError`] of its step.
#[derive(Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "`Radau` damps an open system without an entropy of its own and with one bath, to which it gives what it damps; take \
     `Gauss`, or an explicit method"
)]
pub struct NotDamped;

metriplectic_equations::debug_is_the_sentence!(NotDamped);

/// Accepts a system that a method which damps can take: what it damps is heat of its only bath.
fn damps<Y, C, X>(
    tableau: &'static Tableau,
    start: &StepStart<'_, OpenSystem<Y, C, X>>,
) -> Result<(), StepError>
where
    Y: Metriplectic,
    C: Clock<Y::Manifold, Y::Energy>,
    X: Exchange<Y::Manifold, Y::Metric>,
{
    let isothermal = start.flow.closed().second_law() == SecondLaw::NoEntropy && X::BATHS == 1;
    if !tableau.one_sided || isothermal {
        return Ok(());
    }
    Err(StepError::Method { time: start.time, error: MethodError::new(NotDamped) })
}

macro_rules! open_stages {
    ($name:ident) => {
        impl<Y, C, X, const S: usize> Stepper<OpenSystem<Y, C, X>> for $name<S>
        where
            Y: Metriplectic,
            C: Clock<Y::Manifold, Y::Energy>,
            X: Exchange<Y::Manifold, Y::Metric>,
        {
            type Memory = StageMemory<Dim<Y>>;

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

            fn promises(&self, system: &OpenSystem<Y, C, X>) -> Promises {
                Promises::all_laws(system.entropy_law() == SecondLaw::Exact)
            }

            fn step(
                &self,
                start: &StepStart<'_, OpenSystem<Y, C, X>>,
                h: f64,
                memory: &mut Self::Memory,
            ) -> Result<Taken<OpenSystem<Y, C, X>>, StepError> {
                damps(Self::tableau(), start)?;
                let mut whole = true;
                halves::take(
                    start,
                    h,
                    Self::SPLITS.min(Gauss::<1>::SPLITS),
                    &mut |start, h, fallbacks| {
                        if !std::mem::replace(&mut whole, false) {
                            *memory = StageMemory::default();
                        }
                        open_step(Self::tableau(), start, h, memory, fallbacks)
                    },
                )
            }

            fn attempt(
                &self,
                start: &StepStart<'_, OpenSystem<Y, C, X>>,
                h: f64,
                memory: &mut Self::Memory,
            ) -> Result<Taken<OpenSystem<Y, C, X>>, Refusal> {
                if let Err(error) = damps(Self::tableau(), start) {
                    return Err(Refusal {
                        effort: Effort::default(),
                        error: Some(error),
                        second_law: false,
                    });
                }
                open_step(Self::tableau(), start, h, memory, Fallbacks::FirstTries)
                    .map_err(|failure| failure.into_refusal(start.time, h))
            }

            fn error(
                &self,
                step: &StepEnds<'_, OpenSystem<Y, C, X>>,
                memory: &Self::Memory,
                norm: impl Fn(&<OpenSystem<Y, C, X> as Flow>::Vector) -> f64,
            ) -> Option<f64> {
                let (system, time, h) = (step.flow, step.x.time, step.h);
                let whole = Step::new(Self::tableau(), system, [time, time + h]);
                let (values, reference) = (*step.values[0], *step.values[0]);
                let start =
                    StepStart { flow: system, x: step.x, time, values, reference, allowed: None };
                let velocity = |t: f64, x: &Point<Y>| {
                    let zero = Vector::<Y::Manifold>::zero();
                    VectorField::velocity(
                        &system.frozen(t),
                        &ChartPoint { base: x.clone(), q: zero },
                    )
                    .ok()
                };
                let velocities = [velocity(time, &step.x.x)?, velocity(time + h, &step.end.x)?];
                let start = whole.start(&start, h);
                let timed = whole.timed();
                let defects = timed.defects(&start, memory, &step.end.x, velocities)?;
                let (stages, (z, share)) = timed.stages(&start, memory)?;
                let booked = whole.ledger_defects([step.x, step.end], &stages, (&z, share))?;
                let [first, second] = [0, 1]
                    .map(|end| OpenVector { booked: booked[end], ..OpenVector::of(defects[end]) });
                Some(norm(&first).max(norm(&second)))
            }

            fn between(
                &self,
                step: &StepEnds<'_, OpenSystem<Y, C, X>>,
                memory: &mut Self::Memory,
                theta: f64,
            ) -> Option<StateOf<Y>> {
                let promises = Stepper::<OpenSystem<Y, C, X>>::promises(self, step.flow);
                between(&Within { tableau: Self::tableau(), step, theta }, promises, memory)
            }
        }
    };
}

open_stages!(Gauss);
open_stages!(Radau);
