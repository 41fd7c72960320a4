//! The flows of which a step is composed.

use std::ops::Range;

use super::error::NoiseError;
use super::fluctuating::{Fluctuating, Landing};
use super::levy::levy;
use super::numbers::Numbers;
use super::system::Noisy;
use crate::explicit::along;
use crate::step::failure::HALVES;
use crate::step::{
    Effort, Element, Evidence, Laws, MethodError, StepError, StepStart, Stepper, Taken, Vector as _,
};

/// The least way of the noise, in units of the entries, along which the derivative of friction is measured.
const LEAST: f64 = 1e-6;

/// A step on its way.
#[derive(Debug)]
pub struct Moves<'a, F: Fluctuating<U>, U, R> {
    system: &'a Noisy<F, U>,
    numbers: &'a R,
    step: u64,
    /// The fraction of the step at which it ends, if it is a part of a whole one.
    part: Option<f64>,
    time: f64,
    h: f64,
    reference: &'a Laws<F::Numbers>,
    x: Element<F>,
    evidence: Evidence,
    effort: Effort,
}

impl<'a, F: Fluctuating<U>, U, R: Numbers> Moves<'a, F, U, R> {
    pub(super) fn from(
        start: &'a StepStart<'_, Noisy<F, U>>,
        h: f64,
        (numbers, step): (&'a R, u64),
    ) -> Self {
        Self {
            system: start.flow,
            numbers,
            step,
            part: None,
            time: start.time,
            h,
            reference: &start.reference,
            x: start.x.clone(),
            evidence: Evidence { rests: false, ..Evidence::default() },
            effort: Effort::default(),
        }
    }

    /// The first part of a step of size `h`, up to the fraction `θ`, on the same path.
    pub(super) fn part(self, theta: f64) -> Self {
        Self { h: theta * self.h, part: Some(theta), ..self }
    }

    /// The number of a term; not a number where the path is not known.
    fn number(&self, term: usize) -> f64 {
        match self.part {
            None => self.numbers.number(self.step, term),
            Some(theta) => levy(self.numbers, (self.step, term), theta).unwrap_or(f64::NAN),
        }
    }

    /// The terms of each group.
    pub(super) fn groups(&self) -> Vec<Range<usize>> {
        self.system.flow().groups()
    }

    /// Whether the coin of this step says so.
    pub(super) fn is_backward(&self) -> bool {
        self.numbers.is_backward(self.step)
    }

    fn failed(&self, error: NoiseError) -> StepError {
        StepError::Method { time: self.time, error: MethodError::new(error) }
    }

    /// `A` for a fraction of the step: the motion without noise, from this fraction on.
    pub(super) fn deterministic<M: Stepper<F>>(
        &mut self,
        method: &M,
        [from, fraction]: [f64; 2],
    ) -> Result<(), StepError> {
        let flow = self.system.flow();
        let (h, time) = (fraction * self.h, self.time + from * self.h);
        let values = flow.laws(&self.x);
        let reference = Laws { entropy: values.entropy, ..self.reference.clone() };
        let start = StepStart { flow, x: &self.x, time, values, reference, allowed: None };
        let Taken { x, evidence, effort, .. } =
            method.step(&start, h, &mut M::Memory::default())?;
        self.x = x;
        self.effort += effort;
        let rate = evidence.friction / fraction;
        if evidence.stability && effort.splits > 0 {
            return Err(self.failed(NoiseError::StabilityUnresolved));
        }
        let evidence = Evidence { friction: rate, rests: false, entropy_step: None, ..evidence };
        self.evidence = self.evidence.and(evidence);
        Ok(())
    }

    /// `D` for a fraction of the step, over all groups, or in the opposite order.
    pub(super) fn drift(&mut self, fraction: f64, is_backward: bool) -> Result<(), StepError> {
        let mut groups: Vec<usize> = (0..self.system.flow().groups().len()).collect();
        if is_backward {
            groups.reverse();
        }
        for group in groups {
            if self.system.flow().has_drift(group, self.system.noise()) {
                self.drift_of(group, fraction)?;
            }
        }
        Ok(())
    }

    fn drift_of(&mut self, group: usize, fraction: f64) -> Result<(), StepError> {
        let (flow, noise) = (self.system.flow(), self.system.noise());
        let drift = |x: &Element<F>| flow.drift(x, group, noise);
        let none = || self.failed(NoiseError::DriftUnresolved);
        let first = drift(&self.x).ok_or_else(none)?;
        // From a state without drift the flow goes nowhere.
        if (0..first.len()).all(|i| first.get(i) == 0.0) {
            return Ok(());
        }
        let s = fraction * self.h * noise.k_b;
        self.x = self.followed(group, s, &drift).ok_or_else(none)?;
        Ok(())
    }

    /// Follows noise fields, and measures `h|K'|` between the ends of their way: explicit methods have no Jacobian that
    /// would say it, and noise moves the state where friction acts.
    pub(super) fn fluctuate(
        &mut self,
        flows: impl FnOnce(&mut Self) -> Result<(), StepError>,
    ) -> Result<(), StepError> {
        let from = self.x.clone();
        flows(self)?;
        let rate = self.friction_from(&from).unwrap_or(0.0);
        self.evidence.friction = self.evidence.friction.max(rate);
        Ok(())
    }

    /// `h |K dS(y) − K dS(x)| / |y − x|` from a state `x` to this one, in units of the entries.
    fn friction_from(&self, x: &Element<F>) -> Option<f64> {
        let (flow, y, h) = (self.system.flow(), &self.x, self.h);
        let [at_x, at_y] = [flow.friction(x)?, flow.friction(y)?];
        let q = flow.stage_coordinates(x, y);
        let sizes = flow.sizes(x);
        let distance = q.relative_to(&sizes);
        let [at_x, at_y] =
            [flow.stage_rates(x, (&q.zero(), x), &at_x), flow.stage_rates(x, (&q, y), &at_y)];
        let change = F::Vector::zip([&at_y, &at_x], |[y, x]| h * (y - x));
        // Where noise hardly moves the state, the change is round-off.
        (distance > LEAST).then(|| change.relative_to(&sizes) / distance)
    }

    /// The flow of one noise field, or of the sum of several of a group, for the times `√(2 k_B h) ξ_r`.
    pub(super) fn noise(&mut self, group: usize, terms: Range<usize>) -> Result<(), StepError> {
        let flow = self.system.flow();
        let numbers: Vec<f64> = terms.clone().map(|r| self.number(r)).collect();
        if numbers.iter().all(|xi| *xi == 0.0) {
            return Ok(());
        }
        // One square root, so that another unit by a power of two gives the same digits.
        let strength = 2.0 * self.system.noise().k_b * self.h;
        let xi = |r: usize| numbers[r - terms.start];
        let field = |x: &Element<F>| flow.noise(x, terms.clone(), (strength, &xi));
        let end = self.followed(group, 1.0, &field);
        self.x = end.ok_or_else(|| {
            let reach =
                field(&self.x).map_or(f64::INFINITY, |v| v.relative_to(&flow.sizes(&self.x)));
            let parts = 1 << HALVES;
            self.failed(NoiseError::Unresolved { term: terms.start, parts, reach })
        })?;
        Ok(())
    }

    /// Follows a field, in halves where this leads out of a chart.
    fn followed(
        &self,
        group: usize,
        s: f64,
        field: &impl Fn(&Element<F>) -> Option<F::Vector>,
    ) -> Option<Element<F>> {
        let once = |x: &Element<F>, s: f64| {
            let to = along(self.system.flow(), x, s, field)?;
            let landing = Landing { group, from: x, to, laws: self.reference };
            self.system.flow().landed(landing)
        };
        halved(&once, &self.x, s, HALVES)
    }

    pub(super) fn taken(self) -> Taken<Noisy<F, U>> {
        let values = self.system.flow().laws(&self.x);
        Taken { x: self.x, values, evidence: self.evidence, effort: self.effort }
    }
}

/// A flow for the time `s`, or twice for half of it.
fn halved<X>(once: &impl Fn(&X, f64) -> Option<X>, x: &X, s: f64, left: u32) -> Option<X> {
    once(x, s).or_else(|| {
        let left = left.checked_sub(1)?;
        let middle = halved(once, x, 0.5 * s, left)?;
        halved(once, &middle, 0.5 * s, left)
    })
}
