//! How a run is put down and taken up.

use std::convert::Infallible;

use super::error::{ResumeError, expect_length};
use super::saved::SavedRun;
use super::{Checkpoint, validation};
use crate::run::certificate::Certificate;
use crate::run::checked::checked_states;
use crate::run::controller::StepSize;
use crate::run::course::{Course, Said};
use crate::run::sequence::Frozen;
use crate::run::state::State;
use crate::run::steps::Steps;
use crate::run::watching::StepBefore;
use crate::step::exact::Exact;
use crate::step::{AnyFlow, Flow, Memory as _, Saved, StateSpace as _, Stepper, Vector};

fn exact(numbers: impl IntoIterator<Item = f64>) -> Vec<Exact> {
    numbers.into_iter().map(Exact).collect()
}

fn column(v: &impl Vector) -> Vec<Exact> {
    exact((0..v.len()).map(|i| v.get(i)))
}

/// The numbers of a list, as many as there are in `like`.
fn vector<V: Vector>(what: &'static str, list: &[Exact], like: &V) -> Result<V, ResumeError> {
    let numbers: Vec<f64> = list.iter().map(|number| number.0).collect();
    let (found, expected) = (list.len(), like.len());
    like.with_list(&numbers).ok_or(ResumeError::Length { what, found, expected })
}

impl<F: Flow + ?Sized, M: Stepper<F>> Steps<'_, F, M> {
    /// All that the next steps depend on, but for the system and the options of the method.
    pub fn checkpoint(&self) -> Checkpoint {
        let mut memory = Saved::default();
        self.memory.save(&mut memory);
        self.course.checkpoint(self.method.name(), memory)
    }
}

impl<'a, F: Flow, M: Stepper<F>> Steps<'a, F, M> {
    /// A run that was put down.
    pub(crate) fn resume(
        method: M,
        flow: &'a F,
        checkpoint: &Checkpoint,
    ) -> Result<Self, ResumeError> {
        let c = checkpoint.run()?;
        method.check(matches!(c.progress.step_size, StepSize::Adaptive(_)))?;
        method.serves(flow)?;
        validation::of_the_method(&c.method, method.name())?;
        let said = Said::by(&method, flow, c.progress.start);
        let course = Course::resume(flow as &AnyFlow<'a, F>, said, c)?;
        let memory = M::Memory::restore(&c.memory)?;
        Ok(Self { method, flow, memory, course })
    }
}

impl<'a, F: Flow + ?Sized> Course<'a, F> {
    /// The checkpoint of a run by this method, with this memory.
    fn checkpoint(&self, method: String, memory: Saved) -> Checkpoint {
        let State { step, time, point, energy, entropy } = &self.state;
        let velocity = self.flow.rates(point, &self.progress.largest_velocity.zero());
        let known = self.certificate.invariants.len();
        let Ok(progress) =
            self.progress.convert(|_, v| Ok::<_, Infallible>(exact(v.to_short_list())));
        let events = match &self.watching {
            Some(watching) => watching.events.last_numbers(&self.state),
            None if self.before.h == 0.0 => self.last_numbers.clone(),
            None => Vec::new(),
        };
        let run = SavedRun {
            method,
            step: *step,
            time: Exact(*time),
            point: exact(F::Space::numbers(point)),
            velocity: velocity.map_or_else(Vec::new, |v| column(&v)),
            energy: Exact(*energy),
            entropy: Exact(*entropy),
            kept_entropy: Exact(self.entropy),
            invariants: exact(self.values.invariants.as_ref()[..known].iter().copied()),
            memory,
            events,
            balance: self.certificate.clone(),
            progress,
        };
        run.into()
    }

    /// A run that was put down.
    fn resume(
        flow: &'a F,
        Said { rule, promises, noise }: Said,
        c: &SavedRun,
    ) -> Result<Self, ResumeError> {
        let entries: Vec<f64> = c.point().collect();
        let point = flow.element(&entries)?;
        let mut values = flow.laws(&point);
        let fresh = Certificate::start(flow, &point, &values, promises);
        let mut certificate = c.balance.resumed(Certificate { noise, ..fresh })?;
        if c.progress.ending.is_none() {
            certificate.checked_states = checked_states(flow, c.step);
        }
        let like = flow.sizes(&point);
        let progress = c.progress.convert(|what, list| vector(what, list, &like))?;
        expect_length("further invariants", c.invariants.len(), certificate.invariants.len())?;
        validation::of_the_system(flow, &point, c)?;
        (values.energy, values.entropy) = (c.energy.0, c.entropy.0);
        for (k, stored) in c.invariants.iter().enumerate() {
            values.invariants[k] = stored.0;
        }
        let (energy, entropy, time) = (c.energy.0, c.entropy.0, c.time.0);
        let state = State { step: c.step, time, point, energy, entropy };
        let before = StepBefore {
            state: state.clone(),
            values: values.clone(),
            entropy: c.kept_entropy.0,
            h: 0.0,
            in_parts: false,
            entropy_step: None,
        };
        Ok(Self {
            promises: certificate.promises,
            rule,
            before,
            watching: None,
            cut: None,
            frozen: Frozen::No,
            last_numbers: c.events.clone(),
            flow,
            progress,
            state,
            values,
            entropy: c.kept_entropy.0,
            certificate,
            failed: false,
        })
    }
}

impl Certificate {
    /// These figures, in a run that starts anew with the certificate `fresh`: what the system and the method say
    /// of themselves is theirs.
    fn resumed(&self, fresh: Self) -> Result<Self, ResumeError> {
        expect_length("further invariants", self.invariants.len(), fresh.invariants.len())?;
        let Self { promises, second_law, projected, evaluated, exchange, noise, .. } = fresh;
        let mut certificate =
            Self { promises, second_law, projected, evaluated, exchange, noise, ..self.clone() };
        for (balance, fresh) in certificate.invariants.iter_mut().zip(fresh.invariants) {
            balance.kind = fresh.kind;
        }
        Ok(certificate)
    }
}
