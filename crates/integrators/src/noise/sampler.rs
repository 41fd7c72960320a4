//! Methods with random numbers.

use super::error::NoiseError;
use super::fluctuating::Fluctuating;
use super::moves::Moves;
use super::numbers::{Counter, Numbers};
use super::system::Noisy;
use crate::explicit::along;
use crate::step::evidence::RESOLVED;
use crate::step::{
    Effort, Element, Excursion, Memory, MethodError, NoiseSummary, Promises, Refusal, RestoreError,
    Saved, StepEnds, StepError, StepStart, Stepper, Taken,
};

/// A way to sample a system with noise: [`RandomFlow`](super::RandomFlow) and
/// [`NinomiyaVictoir`](super::NinomiyaVictoir). Give it a seed to make a method of it.
pub trait Sampling<F: Fluctuating<U>, U>: Sized {
    /// The name in a checkpoint.
    fn name(&self) -> String;

    /// The weak order.
    fn order(&self) -> u32;

    /// Refuses a method that it cannot wrap.
    ///
    /// # Errors
    ///
    /// [`NoiseError::OrderTooLow`].
    fn check(&self) -> Result<(), NoiseError>;

    /// Refuses a flow without noise of which the method that it wraps has no steps.
    ///
    /// # Errors
    ///
    /// The error of that method.
    fn serves(&self, flow: &F) -> Result<(), MethodError> {
        let _ = flow;
        Ok(())
    }

    /// Takes a step.
    ///
    /// # Errors
    ///
    /// [`StepError`] if it cannot be taken.
    fn sample<R: Numbers>(&self, moves: &mut Moves<'_, F, U, R>) -> Result<(), StepError>;
}

/// A way to sample, with its random numbers: a [`Method`](crate::Method) for systems with noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampler<S, R = Counter> {
    sampling: S,
    numbers: R,
}

impl<S, R> Sampler<S, R> {
    /// A way to sample with numbers of your own.
    pub const fn new(sampling: S, numbers: R) -> Self {
        Self { sampling, numbers }
    }
}

impl<S> Sampler<S> {
    /// Takes another path: its numbers are independent of those of the others.
    #[must_use]
    pub fn path(self, path: u64) -> Self {
        Self { numbers: self.numbers.path(path), ..self }
    }

    /// Takes steps of size `2^doublings h` on the Brownian path of steps of size `h`, see [`Counter::coarsened`].
    #[must_use]
    pub fn coarsened(self, doublings: u32) -> Self {
        Self { numbers: self.numbers.coarsened(doublings), ..self }
    }

    /// Takes numbers of [three points](Counter::three_point).
    #[must_use]
    pub fn three_point(self) -> Self {
        Self { numbers: self.numbers.three_point(), ..self }
    }
}

/// The memory of a method with random numbers: how many steps have been drawn, of which the numbers are a function, and on how
/// many of them friction was faster than the step.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NoiseMemory {
    drawn: u64,
    unresolved: u64,
}

impl NoiseMemory {
    /// Counts a step with the rate `h|K'|` of friction.
    ///
    /// # Errors
    ///
    /// [`NoiseError::FrictionUnresolved`] if it exceeds 1 too often: rare states may be stiff and leave the law as it is.
    fn count(&mut self, rate: f64, h: f64) -> Result<(), NoiseError> {
        self.drawn += 1;
        self.unresolved += u64::from(rate > RESOLVED);
        if rate > RESOLVED && self.unresolved > FEW + self.drawn / OFTEN {
            let (below, [steps, of]) = (h / rate, [self.unresolved, self.drawn]);
            return Err(NoiseError::FrictionUnresolved { rate, below, steps, of });
        }
        Ok(())
    }
}

/// How many steps may be unresolved in any run.
/// A factor of four fails `noise/sampler.rs::few_steps_may_be_too_long_for_friction`.
const FEW: u64 = 2;
/// Beside them one of so many may be.
/// A factor of four fails `noise/sampler.rs::few_steps_may_be_too_long_for_friction`.
const OFTEN: u64 = 8;

/// The names of the numbers of steps in a checkpoint.
const DRAWN: &str = "steps drawn";
const UNRESOLVED: &str = "steps with fast friction";

impl Memory for NoiseMemory {
    fn rescaled(&self, _: f64) -> Self {
        self.clone()
    }

    fn restarted(&self) -> Self {
        self.clone()
    }

    fn save(&self, saved: &mut Saved) {
        saved.put(DRAWN, [self.drawn as f64]);
        saved.put(UNRESOLVED, [self.unresolved as f64]);
    }

    fn restore(saved: &Saved) -> Result<Self, RestoreError> {
        Ok(Self { drawn: restored(saved, DRAWN)?, unresolved: restored(saved, UNRESOLVED)? })
    }
}

/// A number of steps in a checkpoint.
fn restored(saved: &Saved, what: &'static str) -> Result<u64, RestoreError> {
    let value = saved.get(what, 1)?.map_or(0.0, |list| list[0]);
    let is_count = value >= 0.0 && value.fract() == 0.0 && value <= MOST;
    if !is_count {
        return Err(RestoreError::Damaged { what, value });
    }
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "it is a whole number below 2⁵³"
    )]
    Ok(value as u64)
}

/// The largest number of steps that a number of a checkpoint counts.
const MOST: f64 = 9_007_199_254_740_992.0;

impl<F, U, S, R> Stepper<Noisy<F, U>> for Sampler<S, R>
where
    F: Fluctuating<U>,
    S: Sampling<F, U>,
    R: Numbers,
{
    type Memory = NoiseMemory;

    fn name(&self) -> String {
        format!("{}, {}", self.sampling.name(), self.numbers.name())
    }

    fn order(&self) -> u32 {
        self.sampling.order()
    }

    fn promises(&self, _: &Noisy<F, U>) -> Promises {
        Promises::all_laws(false)
    }

    fn noise(&self, system: &Noisy<F, U>) -> Option<NoiseSummary> {
        let terms = system.flow().groups().last().map_or(0, |group| group.end);
        let (k_b, weak_order) = (system.noise().k_b, self.sampling.order());
        Some(NoiseSummary { k_b, terms, weak_order, numbers: self.numbers.name() })
    }

    fn check(&self, follows_tolerance: bool) -> Result<(), MethodError> {
        if follows_tolerance {
            return Err(MethodError::new(NoiseError::NeedsFixedSteps));
        }
        self.sampling.check().map_err(MethodError::new)
    }

    fn serves(&self, system: &Noisy<F, U>) -> Result<(), MethodError> {
        self.sampling.serves(system.flow())
    }

    fn step(
        &self,
        start: &StepStart<'_, Noisy<F, U>>,
        h: f64,
        memory: &mut NoiseMemory,
    ) -> Result<Taken<Noisy<F, U>>, StepError> {
        let mut moves = Moves::from(start, h, (&self.numbers, memory.drawn));
        self.sampling.sample(&mut moves)?;
        let taken = moves.taken();
        memory.count(taken.evidence.friction, h).map_err(|error| StepError::Method {
            time: start.time,
            error: MethodError::new(error),
        })?;
        Ok(taken)
    }

    fn attempt(
        &self,
        start: &StepStart<'_, Noisy<F, U>>,
        _: f64,
        _: &mut NoiseMemory,
    ) -> Result<Taken<Noisy<F, U>>, Refusal> {
        let error = MethodError::new(NoiseError::NeedsFixedSteps);
        Err(Refusal {
            effort: Effort::default(),
            error: Some(StepError::Method { time: start.time, error }),
            second_law: false,
        })
    }

    /// None: the size of a step of noise is no error.
    fn error(
        &self,
        _: &StepEnds<'_, Noisy<F, U>>,
        _: &NoiseMemory,
        _: impl Fn(&F::Vector) -> f64,
    ) -> Option<f64> {
        None
    }

    fn on_path(
        &self,
        start: &StepStart<'_, Noisy<F, U>>,
        [h, theta]: [f64; 2],
        memory: &NoiseMemory,
    ) -> Option<Element<F>> {
        let step = memory.drawn.checked_sub(1)?;
        self.numbers.between(step, 0, 1)?;
        let mut moves = Moves::from(start, h, (&self.numbers, step)).part(theta);
        self.sampling.sample(&mut moves).ok()?;
        Some(moves.taken().x)
    }

    /// By the Brownian bridge (Baldi 1995; Gobet 2000): a function with the values `g₀`, `g₁` of one sign at the ends of a time `δ` has
    /// had the other sign in between with the probability `exp(−2 g₀ g₁/v)`, where `v = 2 k_B δ Σ_r ⟨dg, X_r⟩²` is its variance.
    fn excursion(
        &self,
        start: &StepStart<'_, Noisy<F, U>>,
        h: f64,
        memory: &NoiseMemory,
        excursion: &Excursion<'_, Element<F>>,
    ) -> Option<bool> {
        let [from, to] = excursion.fractions;
        let step = memory.drawn.checked_sub(1)?;
        // One number for all functions: a path beyond a far level is beyond a near one.
        let uniform = self.numbers.uniform(step, from.to_bits())?;
        let variance = variance(start.flow, (to - from) * h, excursion);
        let [before, after] = excursion.values;
        Some(uniform < (-2.0 * before * after / variance).exp())
    }

    /// None: the state lies on a [path](Stepper::on_path).
    fn between(
        &self,
        _: &StepEnds<'_, Noisy<F, U>>,
        _: &mut NoiseMemory,
        _: f64,
    ) -> Option<Element<F>> {
        None
    }

    fn nothing_between(&self, time: f64, _: f64) -> StepError {
        StepError::Method { time, error: MethodError::new(NoiseError::HasNoBetween) }
    }
}

/// Computes the variance `2 k_B δ Σ_r ⟨dg, X_r⟩²` that the noise of a time `δ` gives to a function, by differences over a part of the way
/// of each noise field. A field that leaves the domain there does not count.
fn variance<F: Fluctuating<U>, U>(
    system: &Noisy<F, U>,
    time: f64,
    &Excursion { from, function, .. }: &Excursion<'_, Element<F>>,
) -> f64 {
    let (flow, strength) = (system.flow(), 2.0 * system.noise().k_b * time);
    let terms = flow.groups().into_iter().flatten();
    let slopes = terms.map(|r| {
        let field = |x: &Element<F>| flow.noise(x, r..r + 1, (strength, &|_| 1.0));
        let [up, down] = [WAY, -WAY].map(|s| along(flow, from, s, field).map(|x| function(&x)));
        up.zip(down).map_or(0.0, |(up, down)| (up - down) / (2.0 * WAY))
    });
    slopes.filter(|slope| slope.is_finite()).map(|slope| slope * slope).sum()
}

/// The part of the way of a noise field in a step over which a function is differentiated.
const WAY: f64 = 1.0 / 16.0;

#[cfg(test)]
mod tests {
    use super::NoiseMemory;

    /// Whether a run goes on in which one of so many steps has the rate `h|K'|`.
    fn goes_on(rate: f64, one_of: u32) -> bool {
        let mut memory = NoiseMemory::default();
        (1..=400).all(|k| memory.count(if k % one_of == 0 { rate } else { 0.0 }, 0.1).is_ok())
    }

    #[test]
    fn few_steps_may_be_too_long_for_friction() {
        assert!(goes_on(2.0, 10) && !goes_on(2.0, 5));
        // A step that is as long as friction asks for is not too long.
        assert!(goes_on(0.9, 1) && !goes_on(2.0, 1));
        let mut memory = NoiseMemory::default();
        let rates = [2.0; 4].map(|rate| memory.count(rate, 0.1).is_ok());
        assert_eq!(rates, [true, true, false, false]);
    }
}
