//! The step of a run by any method, which is compiled once for each space.

use crate::round_off::bound::{ROUNDED, breaks_first_law};
use crate::run::certificate::StepOf;
use crate::run::controller::{Pace, StepSize};
use crate::run::corners::{self, Fixed, Stop};
use crate::run::course::Course;
use crate::run::ending::Ending;
use crate::run::state::State;
use crate::run::stepping::AnyStepper;
use crate::step::dense::says_between;
use crate::step::scales::{larger, relative};
use crate::step::{
    Effort, Element, EntropyStep, Evidence, Flow, Laws, LimitingSites, Refusal, Scales, StepEnds,
    StepError, Taken, Vector as _, both,
};

/// A step of a run.
struct Advance<F: Flow + ?Sized> {
    taken: Taken<F>,
    h: f64,
    time: f64,
}

impl<F: Flow + ?Sized> Course<'_, F> {
    /// Takes one step of a run that has not ended.
    pub(super) fn take_step(&mut self, method: &mut dyn AnyStepper<F>) -> Result<(), StepError> {
        let step = self.state.step + 1;
        if self.has_sites() {
            // The state before the last step is looked at no more, and leaves its array to this one.
            self.before.state = self.state.clone();
        }
        let behind = self.leave_corner();
        let Advance { mut taken, h, time } = match &self.progress.step_size {
            &StepSize::Fixed(h) => {
                let time = self.progress.start + step as f64 * h;
                let (h, corners) = (self.left_of_a_step(h, time), &self.progress.corners);
                let size = Fixed { h, end: time };
                let taken = corners::step(method, self.from(None), size, corners)?;
                Advance { taken, h, time }
            }
            StepSize::Adaptive(controller) => self.controlled(method, controller.pace, behind)?,
        };
        if let Some(clocked) = self.flow.clocked(&taken.x, time) {
            taken.values = self.flow.laws(&clocked);
            taken.x = clocked;
            method.clocked();
        }
        if !is_finite(&taken.values) {
            let time = self.state.time;
            return Err(StepError::OutOfDomain { time, h, tried: taken.effort });
        }
        if let Some(broken) = self.broken_law(&taken, h) {
            return Err(broken);
        }
        self.check_step(&taken)?;
        let entered = StepOf { taken: &taken, h: h.abs() };
        self.certificate.enter(self.flow, &self.state.point, &self.values, entered);
        let first_at_the_edge =
            taken.evidence.stability && self.certificate.limiting_sites.stiffness.is_none();
        if step.is_power_of_two() || (first_at_the_edge && self.has_sites()) {
            self.sample(method, &taken, h);
        }
        let Taken { x, values, evidence, effort } = taken;
        (self.before.h, self.before.entropy) = (h, self.entropy);
        self.before.in_parts = effort.splits > 0;
        self.before.entropy_step = evidence.entropy_step;
        if evidence.dissipates {
            self.entropy = values.entropy;
        }
        let (energy, entropy) = (values.energy, values.entropy);
        self.before.values = std::mem::replace(&mut self.values, values);
        let next = State { step, time, point: x, energy, entropy };
        self.before.state = std::mem::replace(&mut self.state, next);
        self.check_invariants(&self.before.state)?;
        let over = match &self.progress.step_size {
            StepSize::Fixed(_) => self.progress.count.is_some_and(|count| step >= count),
            StepSize::Adaptive(controller) => {
                let left = controller.pace.end - self.state.time;
                self.progress.direction() * left <= 0.0
            }
        };
        if over {
            self.progress.ending = Some(Ending::Span);
        }
        if self.progress.judges_sizes() {
            let here = self.flow.sizes(&self.state.point);
            self.progress.scales = self.progress.scales.or(&here);
            if let Some(judged) = &mut self.progress.judged {
                judged.reached = larger(&judged.reached, &here);
            }
        }
        self.rest(!evidence.rests);
        if step.is_power_of_two() || self.progress.ending.is_some() {
            self.judge_sizes();
        }
        if self.watching.is_some() {
            self.look(method)?;
        }
        self.recheck(evidence.entropy_step == Some(EntropyStep::Held))
    }

    /// The error that names the first law, if a step has broken it.
    #[inline]
    fn broken_law(&self, taken: &Taken<F>, h: f64) -> Option<StepError> {
        let change = taken.values.energy - self.certificate.reference_energy();
        let sizes = || self.flow.energy_sizes([&self.state.point, &taken.x]);
        if !self.promises.energy {
            return None;
        }
        let size = breaks_first_law(change, taken.values.energy, sizes)?;
        Some(StepError::FirstLawBroken { time: self.state.time, h, change, size })
    }

    /// Sets the clock of the state behind the corner that it has reached, with the law of the next step. Returns the time
    /// there.
    #[inline]
    fn leave_corner(&mut self) -> Option<f64> {
        let behind = self.progress.corners.behind(self.state.time)?;
        if let Some(clocked) = self.flow.clocked(&self.state.point, behind) {
            self.values = self.flow.laws(&clocked);
            self.state.point = clocked;
        }
        Some(behind)
    }

    /// Looks at what must hold on every step. Steps of one size between corners have been looked at one by one.
    #[inline]
    fn check_step(&self, taken: &Taken<F>) -> Result<(), StepError> {
        let fixed = matches!(self.progress.step_size, StepSize::Fixed(_));
        if !self.flow.depends_on_time() || (fixed && !self.progress.corners.is_empty()) {
            return Ok(());
        }
        self.flow.inspect([&self.state.point, &taken.x], fixed)
    }

    /// Notes the local error of a step, and where it is largest, on the few whose number is a power of two and on the
    /// first one at the edge of stability.
    #[cold]
    fn sample(
        &mut self,
        method: &dyn AnyStepper<F>,
        Taken { x: end, values, .. }: &Taken<F>,
        h: f64,
    ) {
        let (flow, x) = (self.flow, &self.state.point);
        // The sizes that a step brings about count too, and the largest ones so far: an entry that has decayed to
        // round-off has no error relative to itself.
        let sizes = larger(&flow.sizes(x), &flow.sizes(end));
        self.progress.scales = self.progress.scales.or(&sizes);
        let sizes = self.progress.scales.sizes.clone();
        let norm = |error: &F::Vector| {
            // In one pass, without an array of the numbers.
            F::Vector::norm_of([error, &sizes], |[error, s]| {
                let above = (error.abs() - ROUNDED * s).max(0.0);
                if above == 0.0 { 0.0 } else { above / s }
            })
        };
        let reference = self.reference(self.entropy);
        let (values, reference) = ([&self.values, values], &reference);
        let step = StepEnds { flow, x, end, h, values, reference };
        let Some(error) = method.error(&step, &norm) else {
            if says_between(flow, x) && flow.displacement(x, end).is_none() {
                self.certificate.note_local_error(f64::INFINITY, LimitingSites::default());
            }
            return;
        };
        let sites = if self.has_sites() {
            let allowed = match &self.progress.step_size {
                StepSize::Adaptive(controller) => {
                    controller.allowed(&self.rule, &self.progress.scales, h)
                }
                StepSize::Fixed(_) => sizes.clone(),
            };
            method.limiting_sites(&step, &allowed)
        } else {
            LimitingSites::default()
        };
        self.certificate.note_local_error(error, sites);
    }

    /// Tries steps until the controller accepts one.
    #[inline(never)]
    fn controlled(
        &mut self,
        method: &mut dyn AnyStepper<F>,
        mut pace: Pace,
        behind: Option<f64>,
    ) -> Result<Advance<F>, StepError> {
        let (flow, rule, time) = (self.flow, self.rule, self.state.time);
        let relative_error = pace.relative_error(&rule);
        let mut effort = Effort::default();
        let (mut tries, mut broken) = (0, None);
        let Stop { stop, recorded: target, .. } = self.progress.corners.stop(time, pace.end);
        // After a corner a step begins a few roundings later than its state is recorded.
        let begin = behind.unwrap_or(time);
        // Along the run, times and sizes are positive.
        let direction = self.progress.direction();
        let (along, stop) = (direction * begin, direction * stop);
        let ends = self.frozen.end(self.state.step, begin, direction);
        let mut frozen = ends.map(|end| direction * end);
        if behind.is_some() {
            method.begin();
        }
        loop {
            tries += 1;
            if tries == TRIES {
                // An entry that begins to move only now has no size yet.
                let here = Scales::at(flow, &self.state.point, Some((pace.end - time).abs()));
                self.progress.scales = self.progress.scales.and(&here);
            }
            let (size, last) = match frozen {
                Some(end) => (end.min(stop) - along, end >= stop),
                None => pace.attempt(along, stop),
            };
            let h = direction * size;
            if pace.next < pace.least(&rule) && !last && frozen.is_none() {
                let (h, least) = (pace.next, pace.least(&rule));
                let too_small = StepError::TooSmall { time, h, least };
                let cause = broken.or_else(|| self.dependent(&self.state));
                return Err(cause.unwrap_or(too_small));
            }
            if along + size <= along {
                let standstill = StepError::Standstill { time, h: pace.next };
                return Err(broken.unwrap_or(standstill));
            }
            let ratio = pace.taken.map_or(1.0, |taken| size / taken);
            let start = self.from(Some(self.progress.allowed(relative_error, None, h)));
            let reference = start.reference.clone();
            let mut tried = method.attempt(start, h, ratio);
            let (mut falls, mut is_taken, mut error) = (false, false, None);
            match &mut tried {
                Ok(taken) => {
                    effort += taken.effort;
                    taken.effort = effort;
                    let has_values = is_finite(&taken.values);
                    let law = self.broken_law(taken, h).filter(|_| has_values);
                    let holds = law.is_none() && has_values;
                    broken = law.or(broken);
                    let step = Tried { taken, reference: &reference, h, relative_error };
                    let is_held = taken.evidence.entropy_step == Some(EntropyStep::Held);
                    error = if holds { self.error(method, &step) } else { None };
                    let accepted = error.filter(|error| *error <= 1.0 || frozen.is_some());
                    if holds && is_held {
                        pace.accept_held(&rule, size);
                    } else if let Some(error) = accepted {
                        pace.accept(&rule, size, error);
                        self.look_at_rest(&mut pace, taken, size);
                    }
                    is_taken = holds && (is_held || accepted.is_some());
                }
                Err(Refusal { effort: wasted, error: refused, second_law }) => {
                    effort += *wasted;
                    let refused = refused.take();
                    // An entropy that falls in a step that hardly moves the state falls in a smaller one too.
                    if let Some(
                        never @ (StepError::EntropyFalls { .. }
                        | StepError::WrongDerivative { .. }
                        | StepError::Flow { .. }),
                    ) = refused
                    {
                        return Err(never);
                    }
                    broken = refused.or(broken);
                    falls = *second_law;
                }
            }
            if is_taken && let Ok(taken) = tried {
                method.accept();
                self.progress.set_pace(pace);
                let time = if last { target } else { begin + h };
                self.frozen.note(time);
                return Ok(Advance { taken, h, time });
            }
            // A step that cannot be taken is taken in parts.
            frozen = None;
            if falls {
                pace.reject_fall(size);
                method.refuse();
                self.certificate.rejected += 1;
                self.certificate.falls_avoided += 1;
                continue;
            }
            if pace.may_jump(&rule, begin, size)
                && let Some(taken) = self.held_in_an_instant(begin + h)
            {
                pace.jumped(begin, size);
                method.restart();
                self.progress.set_pace(pace);
                let time = if last { target } else { begin + h };
                self.frozen.note(time);
                return Ok(Advance { taken: Taken { effort, ..taken }, h, time });
            }
            pace.reject(&rule, size, error);
            method.give_up();
            self.certificate.rejected += 1;
        }
    }

    /// The error of a step that was tried, in units of the one allowed.
    #[inline]
    fn error(&self, method: &dyn AnyStepper<F>, step: &Tried<'_, F>) -> Option<f64> {
        let &Tried { taken, reference, h, relative_error } = step;
        let flow = self.flow;
        let sizes = larger(&self.progress.scales.sizes, &flow.sizes(&taken.x));
        let allowed = self.progress.allowed(relative_error, Some(&sizes), h);
        let values = [&self.values, &taken.values];
        let step = StepEnds { flow, x: &self.state.point, end: &taken.x, h, values, reference };
        let norm =
            |error: &F::Vector| relative(error, &allowed).max(error.beside_relative_to(&allowed));
        method.error_of_try(&step, &norm).filter(|error| error.is_finite())
    }
}

/// A step that was tried.
struct Tried<'a, F: Flow + ?Sized> {
    taken: &'a Taken<F>,
    reference: &'a Laws<F::Numbers>,
    h: f64,
    relative_error: f64,
}

impl<F: Flow + ?Sized> Course<'_, F> {
    /// The step to a time so near that a jump of the law of motion between the two has no place in it: the state stays, and
    /// what the energy changes by is work of the time. `None` where states have no clock.
    #[cold]
    fn held_in_an_instant(&self, time: f64) -> Option<Taken<F>> {
        let x = self.flow.clocked(&self.state.point, time)?;
        let values = self.flow.laws(&x);
        let (evidence, effort) = (Evidence::default(), Effort::default());
        is_finite(&values).then_some(Taken { x, values, evidence, effort })
    }

    /// Bounds the next step where a system takes the time, and nothing has changed the motion in this one: what moves the state
    /// later would be stepped over.
    #[inline]
    fn look_at_rest(&mut self, pace: &mut Pace, taken: &Taken<F>, h: f64) {
        let longest = pace.longest_at_rest(&self.rule);
        if !self.flow.depends_on_time() || pace.next.max(h) < longest {
            return;
        }
        let relative_error = pace.relative_error(&self.rule);
        let allowed = self.progress.allowed(relative_error, None, h);
        let ends = [&self.state.point, &taken.x];
        if moves_on(self.flow, ends, &allowed, h) {
            pace.next = pace.next.min(longest);
            self.certificate.note_rest(h);
        }
    }
}

/// Returns whether the velocity is the same at both ends of a step of size `h`, but for what the error allows.
fn moves_on<F: Flow + ?Sized>(
    flow: &F,
    ends: [&Element<F>; 2],
    allowed: &F::Vector,
    h: f64,
) -> bool {
    let zero = allowed.zero();
    let [Some(start), Some(end)] = both(ends, |x| flow.rates(x, &zero)) else { return false };
    (0..zero.len()).all(|i| h * (end.get(i) - start.get(i)).abs() <= allowed.get(i))
}

/// Returns whether the laws are numbers: a method without an equation to solve may step over the edge of a domain.
fn is_finite<L>(laws: &Laws<L>) -> bool {
    laws.energy.is_finite() && laws.entropy.is_finite()
}

/// Steps that are tried before the sizes of the entries are estimated anew.
const TRIES: usize = 3;
