//! The derivative of a step as a product: of its parts, and of what happens to its clock at corners.
//!
//! A corner stays where it is when the start of a run moves. So the columns `T` of steps near one are those at fixed times: with the
//! row `τ` of the clock and the velocity `v` at the start of such a step, at its end `v'`, at a corner with the energies `H⁻`, `H⁺`,
//! and the derivatives `J` of the parts,
//!
//! ```math
//! T_0 = T - v\,\tau, \qquad W^+ = W^- + (dH^+ - dH^-)\, T_k, \qquad T_{k+1} = J\, T_k, \qquad T' = T_n + v'\,\tau .
//! ```
//!
//! `W` is the row of the work of the time: at a corner the energy changes at a frozen state. In the limit of small steps this is the
//! saltation `T⁺ = T⁻ + (v⁺ − v⁻) τ` of a flow whose law changes at a fixed time (Aizerman and Gantmakher 1958).

use nalgebra::{DMatrix, DVector};

use super::columns::{Carried, Moved};
use super::differentiated::Differentiated;
use super::error::Unlinearised;
use super::part::{Again, Ended, Part, memory_before};
use super::pieces::{parts, through};
use super::smooth::{FlowOf, SmoothFlow as _};
use crate::run::corners::Interval;
use crate::run::last_step::LastStep;
use crate::step::{Element, Flow, Laws, Memory, Saved, StepStart, Stepper};

/// A factor of the derivative of a step.
pub(super) enum Factor<F: Flow> {
    /// The columns become those at a fixed time, by the velocity there.
    Still(DVector<f64>),
    /// The clock is set, and its work has a derivative.
    Clock { work: usize, along: DVector<f64> },
    /// The parts of a step of a size between corners.
    Parts { parts: Vec<Part<F>>, h: f64 },
    /// The columns become those at a time that moves with the start, by the velocity there.
    Moving(DVector<f64>),
}

/// The derivative of a step, factor by factor.
pub(super) struct Product<F: Flow> {
    factors: Vec<Factor<F>>,
    /// The state that it reaches.
    pub(super) end: Element<F>,
    /// The velocity behind a corner at which it ends inside the step that was taken, less that before it.
    pub(super) across: Option<DVector<f64>>,
}

impl<F: Flow> Product<F> {
    /// The step as one part, if it is one.
    pub(super) fn single(&self) -> Option<&Part<F>> {
        match self.factors.as_slice() {
            [Factor::Parts { parts, .. }] => parts.first().filter(|_| parts.len() == 1),
            _ => None,
        }
    }
}

/// The end of a step.
pub(super) enum Reach<'a, F: Flow> {
    /// At the end of the step that was taken.
    End(&'a Element<F>),
    /// At a fraction of it, and at a time.
    Inside { theta: f64, time: f64 },
}

/// A step that was taken, with the means to take others beside it.
pub(super) type Step<'a, F> = (&'a LastStep<'a, F>, Option<&'a Again<<F as Flow>::Vector>>);

/// Takes a step of a run again, or a fraction of it, for its derivative.
pub(super) fn product<D, M>(
    of: (&D, &M),
    step: Step<'_, FlowOf<D>>,
    reach: &Reach<'_, FlowOf<D>>,
) -> Result<Product<FlowOf<D>>, Unlinearised>
where
    D: Differentiated<M>,
    M: Stepper<FlowOf<D>>,
{
    let (system, last) = (of.0, step.0);
    let intervals = match *reach {
        Reach::End(_) => last.intervals(),
        Reach::Inside { theta, time } => last.intervals_up_to(theta * last.h, time),
    };
    let is_still = system.as_flow().clock().is_some() && last.is_near_corner();
    let mut taker = Taker::new(of, step, is_still)?;
    if intervals[0].behind.is_some() {
        taker.is_recorded_at(last.start.time);
    }
    if is_still {
        taker.factors.push(Factor::Still(velocity(system, &taker.x)?));
    }
    for (k, interval) in intervals.iter().enumerate() {
        let end = match *reach {
            Reach::End(end) if k + 1 == intervals.len() => Some(end),
            _ => None,
        };
        if let Some(behind) = interval.behind {
            taker.clock(behind)?;
        }
        taker.take(interval, end, k == 0)?;
    }
    let ended = intervals[intervals.len() - 1];
    if ended.is_corner {
        taker.clock(ended.recorded)?;
    }
    let across = match *reach {
        Reach::End(end) => {
            taker.x = end.clone();
            None
        }
        Reach::Inside { time, .. } => taker.across(time)?,
    };
    let Taker { mut factors, x: end, .. } = taker;
    if is_still {
        factors.push(Factor::Moving(velocity(system, &end)?));
    }
    Ok(Product { factors, end, across })
}

/// The velocity of a state, and that of its clock.
fn velocity<D: Differentiated<M>, M: Stepper<FlowOf<D>>>(
    system: &D,
    x: &Element<FlowOf<D>>,
) -> Result<DVector<f64>, Unlinearised> {
    system.velocity_at(x).ok_or(Unlinearised::Singular)
}

/// A step that is taken again, from corner to corner.
struct Taker<'a, D: Differentiated<M>, M: Stepper<FlowOf<D>>> {
    of: (&'a D, &'a M),
    step: Step<'a, FlowOf<D>>,
    is_still: bool,
    factors: Vec<Factor<FlowOf<D>>>,
    x: Element<FlowOf<D>>,
    time: f64,
    /// The laws at the state.
    values: Laws<<FlowOf<D> as Flow>::Numbers>,
    reference: Laws<<FlowOf<D> as Flow>::Numbers>,
    memory: M::Memory,
}

impl<'a, D: Differentiated<M>, M: Stepper<FlowOf<D>>> Taker<'a, D, M> {
    fn new(
        of: (&'a D, &'a M),
        step: Step<'a, FlowOf<D>>,
        is_still: bool,
    ) -> Result<Self, Unlinearised> {
        let memory = memory_before::<FlowOf<D>, M>(step.1)?;
        let StepStart { x, time, ref values, ref reference, .. } = step.0.start;
        let (values, reference) = (values.clone(), reference.clone());
        Ok(Self {
            of,
            step,
            is_still,
            factors: Vec::with_capacity(1),
            x: x.clone(),
            time,
            values,
            reference,
            memory,
        })
    }

    /// Sets the clock back to that of the state which the run has recorded.
    fn is_recorded_at(&mut self, time: f64) {
        if let Some(clocked) = self.of.0.as_flow().clocked(&self.x, time) {
            self.x = clocked;
        }
    }

    /// Sets the clock across a corner, at a frozen state.
    fn clock(&mut self, time: f64) -> Result<(), Unlinearised> {
        let system = self.of.0;
        let flow = system.as_flow();
        self.time = time;
        let Some(clocked) = flow.clocked(&self.x, time) else { return Ok(()) };
        let sizes = self.step.1.map(|again| &again.sizes);
        system.check_corner([&self.x, &clocked], sizes, self.step.0.h)?;
        if let Some((work, _)) = flow.power_of_time(&clocked) {
            let along = system.wide_rows(&clocked).energy - system.wide_rows(&self.x).energy;
            self.factors.push(Factor::Clock { work, along });
        }
        self.values = flow.laws(&clocked);
        self.x = clocked;
        Ok(())
    }

    /// Takes a step up to a corner, or to the end of the step that was taken if it is given.
    fn take(
        &mut self,
        &Interval { h, recorded, is_corner, .. }: &Interval,
        end: Option<&Element<FlowOf<D>>>,
        is_first: bool,
    ) -> Result<(), Unlinearised> {
        let (system, method) = self.of;
        let (last, again) = self.step;
        let (flow, is_still) = (system.as_flow(), self.is_still);
        if !is_first {
            self.memory = self.memory.restarted();
        }
        let again = again.map(|again| {
            let memory = if is_first { again.memory.clone() } else { saved(&self.memory) };
            Again { memory, is_still, ..again.clone() }
        });
        let again = again.as_ref();
        // The clock of the state that was recorded is at the corner, and the step ends before it.
        let before = |end: &Element<FlowOf<D>>| {
            if is_corner { flow.clocked(end, self.time + h) } else { None }
        };
        let end = end.map(|end| before(end).unwrap_or_else(|| end.clone()));
        let (values, reference) = (self.values.clone(), self.reference.clone());
        let (x, time, allowed) = (&self.x, self.time, last.start.allowed.clone());
        let start = StepStart { flow, x, time, values, reference, allowed };
        let whole = end.as_ref().filter(|_| is_first);
        let (mut parts, reached) = if let Some(end) = whole {
            let ended = Ended { h, ..Ended::of_run(end, last) }.with_again(again, last.h);
            (parts(method, &start, &ended)?, end.clone())
        } else {
            let taken = method.step(&start, h, &mut self.memory);
            let taken = taken.map_err(|_| Unlinearised::Singular)?;
            let ended = Ended::new(&taken, h, &self.memory).with_again(again, last.h);
            let parts = parts(method, &start, &ended)?;
            if taken.evidence.dissipates {
                self.reference.entropy = taken.values.entropy;
            }
            self.values = taken.values;
            (parts, taken.x)
        };
        if let (Some(end), Some(last)) = (end, parts.last_mut()) {
            last.end = end;
        }
        self.factors.push(Factor::Parts { parts, h });
        (self.x, self.time) = (reached, recorded);
        Ok(())
    }

    /// The velocity behind the corner at a time, less that before it; `None` if there is no corner.
    fn across(&self, time: f64) -> Result<Option<DVector<f64>>, Unlinearised> {
        let system = self.of.0;
        let Some(around) = self.step.0.around_corner(time).filter(|_| self.is_still) else {
            return Ok(None);
        };
        let at = |time: f64| {
            let clocked = system.as_flow().clocked(&self.x, time);
            velocity(system, clocked.as_ref().unwrap_or(&self.x))
        };
        let [before, behind] = around.map(at);
        Ok(Some(behind? - before?))
    }
}

/// The numbers of a memory with which a step is taken again.
fn saved(memory: &impl Memory) -> Saved {
    let mut saved = Saved::default();
    memory.beside().save(&mut saved);
    saved
}

/// The derivatives at the end of a step from those at its start.
pub(super) fn propagate<D, M>(
    (system, method): (&D, &M),
    product: &Product<FlowOf<D>>,
    carried: &Carried,
) -> Result<Moved, Unlinearised>
where
    D: Differentiated<M>,
    M: Stepper<FlowOf<D>>,
{
    let flow = system.as_flow();
    let mut moved = Moved { carried: carried.clone(), along_h: DVector::zeros(flow.directions()) };
    let mut late = DMatrix::zeros(1, carried.t.ncols());
    for factor in &product.factors {
        let t = &mut moved.carried.t;
        match factor {
            Factor::Still(v) => {
                if let Some(clock) = flow.clock() {
                    late = t.rows(clock, 1).into_owned();
                }
                *t -= whole(v, t.nrows()) * &late;
            }
            Factor::Clock { work, along } => {
                let booked = t.tr_mul(along).transpose();
                let mut row = t.row_mut(*work);
                row += booked;
            }
            Factor::Parts { parts, h } => {
                moved = through((system, method), (parts, *h), &moved.carried)?;
            }
            Factor::Moving(v) => *t += whole(v, t.nrows()) * &late,
        }
    }
    Ok(moved)
}

/// The costate at the start of a step from that at its end.
pub(super) fn pull_back<D, M>(
    (system, method): (&D, &M),
    product: &Product<FlowOf<D>>,
    mut costate: DVector<f64>,
) -> Result<DVector<f64>, Unlinearised>
where
    D: Differentiated<M>,
    M: Stepper<FlowOf<D>>,
{
    let clock = system.as_flow().clock();
    let mut along_late = 0.0;
    for factor in product.factors.iter().rev() {
        match factor {
            Factor::Moving(v) => {
                along_late = whole(v, costate.len()).dot(&costate);
                if let Some(clock) = clock {
                    costate[clock] = 0.0;
                }
            }
            Factor::Clock { work, along } => costate += along * costate[*work],
            Factor::Parts { parts, .. } => {
                for part in parts.iter().rev() {
                    costate = system.pull_back(method, part, &costate)?;
                }
            }
            Factor::Still(v) => {
                if let Some(clock) = clock {
                    costate[clock] = 0.0;
                    costate[clock] = along_late - whole(v, costate.len()).dot(&costate);
                }
            }
        }
    }
    Ok(costate)
}

/// A velocity in all directions: nothing moves the parameters.
fn whole(v: &DVector<f64>, all: usize) -> DVector<f64> {
    v.clone().resize_vertically(all, 0.0)
}
