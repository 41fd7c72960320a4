//! A step that ends at an event, where the state jumps.

use crate::round_off::bound::of_a_law;
use crate::run::certificate::JumpOf;
use crate::run::controller::StepSize;
use crate::run::course::Course;
use crate::run::ending::Ending;
use crate::run::event::Restart;
use crate::run::jump::{Jump, JumpOn};
use crate::run::state::State;
use crate::run::watching::{StepBefore, Watching};
use crate::step::{
    Element, EventExchange, Flow, JumpError, Laws, StateSpace as _, StepError, Vector as _, both,
};

/// Where a jump leads.
struct Landing<F: Flow + ?Sized> {
    x: Element<F>,
    values: Laws<F::Numbers>,
    exchange: EventExchange,
    /// The rise of the entropy of the system and its surroundings.
    rise: f64,
    /// Whether the exchange is in the ledger of the state.
    is_booked: bool,
}

impl<F: Flow + ?Sized> Course<'_, F> {
    /// The size of a step of one size up to `end`: what a jump has left of it.
    #[inline]
    pub(super) fn left_of_a_step(&self, h: f64, end: f64) -> f64 {
        let State { step, time, .. } = self.state;
        let off = time - (self.progress.start + step as f64 * h);
        if off.abs() > 0.0 { end - time } else { h }
    }

    /// Ends the last step at the event that was found last, and lets the state jump.
    ///
    /// # Errors
    ///
    /// [`StepError::Jump`]; the state is then the one at which the step started.
    #[cold]
    #[inline(never)]
    pub(super) fn jump(
        &mut self,
        watching: &mut Watching<F::Space>,
        with_it: &[(usize, bool)],
    ) -> Result<(), StepError> {
        let Some(mut event) = watching.found.pop() else { return Ok(()) };
        let Some(map) = watching.events.jump(event.index) else { return Ok(()) };
        let before = self.flow.laws(&event.state.point);
        let landing = self.landing(&map, &event.state, &before).map_err(|error| {
            let (time, event) = (event.state.time, event.name.clone());
            StepError::Jump { time, event, error }
        })?;
        let Landing { x, values, exchange, rise, is_booked } = landing;
        let jump = JumpOf {
            name: &event.name,
            x: &x,
            h: event.state.time - self.before.state.time,
            values: [&self.before.values, &before, &values],
            exchange: &exchange,
            rise,
            is_booked,
        };
        self.certificate.enter_jump(self.flow, &jump);
        let (h, time) = (self.before.h, event.state.time);
        // A step of one size goes on up to the end that it would have had.
        let fixed = matches!(self.progress.step_size, StepSize::Fixed(_));
        let is_whole = !fixed || time >= self.state.time;
        let step = self.before.state.step + usize::from(is_whole);
        let (energy, entropy) = (values.energy, values.entropy);
        let after: State<F::Space> = State { step, time, point: x, energy, entropy };
        let velocity = self.flow.rates(&after.point, &self.flow.sizes(&after.point).zero());
        let ahead = |later: f64| -> Element<F> {
            match &velocity {
                Some(v) => self.flow.moved(&after.point, &v.map(|v| later * v)),
                None => after.point.clone(),
            }
        };
        let restart = Restart { state: &after, ahead: &ahead, h };
        watching.events.after_jump(&event, with_it, &restart);
        self.last_numbers = watching.events.last_numbers(&after);
        event.jump = Some(Jump { after: after.clone(), exchange });
        watching.found.push(event);
        self.entropy = entropy;
        let restarted = StepBefore {
            state: after.clone(),
            values: values.clone(),
            entropy,
            h: 0.0,
            in_parts: false,
            entropy_step: None,
        };
        self.cut = Some(std::mem::replace(&mut self.before, restarted));
        (self.state, self.values) = (after, values);
        let over = match &self.progress.step_size {
            StepSize::Fixed(_) => self.progress.count.is_some_and(|count| step >= count),
            StepSize::Adaptive(controller) => time >= controller.pace.end,
        };
        if over {
            self.progress.ending = Some(Ending::Span);
            if watching.replaces_steps() {
                watching.queue.push_back(self.state.clone());
            }
        }
        Ok(())
    }

    /// Takes back a step that goes beyond an event at which the state cannot jump.
    #[cold]
    pub(super) fn take_back(&mut self) {
        self.state = self.before.state.clone();
        self.values = self.before.values.clone();
        self.entropy = self.before.entropy;
        self.progress.ending = None;
        if let Some(watching) = &mut self.watching {
            watching.events.take_back();
        }
    }

    /// Where a jump leads from a state with these laws.
    fn landing(
        &self,
        map: &JumpOn<F::Space>,
        state: &State<F::Space>,
        before: &Laws<F::Numbers>,
    ) -> Result<Landing<F>, JumpError> {
        let flow = self.flow;
        let x = flow.jumped(&state.point, map.to(state));
        let entries = F::Space::numbers(&x);
        flow.element(&entries).map_err(JumpError::NoPoint)?;
        let values = flow.laws(&x);
        if !(values.energy.is_finite() && values.entropy.is_finite()) {
            return Err(JumpError::OutOfDomain { entries });
        }
        let ends = [&state.point, &x];
        let sizes = both(ends, |x| flow.term_sizes(x));
        for index in 0..self.certificate.invariants.len() {
            let of = |laws: &Laws<F::Numbers>| laws.invariants.as_ref()[index];
            let change = of(&values) - of(before);
            let round_off = of_a_law(of(&sizes[0]).max(of(&sizes[1])));
            if self.promises.invariants && (change.is_nan() || change.abs() > round_off) {
                return Err(JumpError::BreaksInvariant { index, change });
            }
        }
        let exchange = map.exchange(values.energy - before.energy);
        let rise = (values.entropy - before.entropy) + exchange.entropy;
        // The heat is a difference of energies, with their round-off.
        let of_heat = map.temperature.map_or(0.0, |temperature| {
            4.0 * f64::EPSILON * sizes[0].energy.max(sizes[1].energy) / temperature
        });
        if rise < 0.0 && !map.lowers && -rise > flow.entropy_round_off(ends) + of_heat {
            return Err(JumpError::LowersEntropy { fall: -rise });
        }
        match flow.with_event(&x, &exchange) {
            Some(x) => {
                let values = flow.laws(&x);
                Ok(Landing { x, values, exchange, rise, is_booked: true })
            }
            None => Ok(Landing { x, values, exchange, rise, is_booked: false }),
        }
    }
}
