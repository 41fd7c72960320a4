//! The memory of explicit methods.

use super::creep;
use super::spectrum::Spectrum;
use super::stage::Here;
use super::tableau::STAGES;
use crate::step::{Flow, Memory, RestoreError, Saved, Vector};

/// The memory of [`DormandPrince8`](crate::DormandPrince8) and the other explicit methods from one step
/// to the next: the sum of the entropy that was produced, and what is known at the state reached.
#[derive(Clone, Debug)]
pub struct ExplicitMemory<V> {
    /// The entropy that the steps aim at; `None` before the first step.
    pub(super) entropy: Option<Produced>,
    /// How often in a row the entropy would have fallen.
    pub(super) falls: u32,
    /// Steps taken, which say when the energy is [looked at](super::creep); no number of a step depends on it.
    pub(super) taken: u32,
    /// The digits that rounding has lost of the position, as displacements (Kahan 1965).
    pub(super) lost: Option<V>,
    /// The lost digits as they were read from a checkpoint.
    pub(super) read: Vec<f64>,
    /// The velocity at the state reached, a function of this state alone.
    pub(super) here: Option<Here<V>>,
    /// The round-off of the entropy there, if the flow tells.
    pub(super) round_off: Option<f64>,
    /// The step taken last.
    pub(super) last: Option<Box<LastStep<V>>>,
    /// A step before it, whose room the next one takes.
    pub(super) room: Option<Box<LastStep<V>>>,
    /// The spectral radius of the equation of motion, if the method needs it.
    pub(super) spectrum: Option<Spectrum<V>>,
}

/// The memory of an explicit method for a flow.
pub(super) type MemoryOf<F> = ExplicitMemory<<F as Flow>::Vector>;

/// The sum of what was produced, with compensation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Produced {
    /// The sum.
    pub(super) sum: f64,
    /// The digits of the sum that rounding has lost.
    pub(super) lost: f64,
    /// The largest entropy of a state so far.
    pub(super) largest: f64,
}

impl Produced {
    /// From a state with this entropy.
    pub(super) const fn from(entropy: f64) -> Self {
        Self { sum: entropy, lost: 0.0, largest: entropy }
    }

    /// The sum with one more rise, by the algorithm of Kahan (1965).
    #[must_use]
    pub(super) fn plus(self, rise: f64) -> Self {
        let rise = rise + self.lost;
        let sum = self.sum + rise;
        Self { sum, lost: rise - (sum - self.sum), ..self }
    }
}

/// A step, for its error and its dense output.
#[derive(Clone, Debug)]
pub(super) struct LastStep<V> {
    /// The rates of the stages in the chart at its start, and their entropy production.
    pub(super) stages: [Here<V>; STAGES],
    /// The stages that are known.
    pub(super) known: usize,
    /// The coordinates of the last stage before the end, until the stability of the step is known.
    pub(super) before: V,
    /// Whether the step was at the edge of the region of stability.
    pub(super) at_the_edge: bool,
    /// The coordinates of its end.
    pub(super) end: V,
    /// The rise of the entropy.
    pub(super) rise: f64,
    /// The number of stages, if the method chooses it.
    pub(super) count: Option<u32>,
}

impl<V: Vector> LastStep<V> {
    /// Room for a step; `like` has the length of a velocity.
    pub(super) fn empty(like: &V) -> Self {
        let zero = like.zero();
        let stages = Here::at_rest(&zero);
        let (before, end) = (zero.clone(), zero);
        Self { stages, known: 0, before, at_the_edge: false, end, rise: 0.0, count: None }
    }
}

impl<V> Default for ExplicitMemory<V> {
    fn default() -> Self {
        Self {
            entropy: None,
            falls: 0,
            taken: 0,
            lost: None,
            read: Vec::new(),
            here: None,
            round_off: None,
            last: None,
            room: None,
            spectrum: None,
        }
    }
}

/// The room of a step, unless its vectors have arrays of their own, which then serve nobody.
fn room_of<V: Vector>(last: Option<Box<LastStep<V>>>) -> Option<Box<LastStep<V>>> {
    last.filter(|last| last.end.sites().is_none())
}

impl<V: Vector> ExplicitMemory<V> {
    /// The room of the step taken last, or of the one before it.
    pub(super) fn take_own_room(&mut self) -> Option<Box<LastStep<V>>> {
        let last = room_of(self.last.take());
        last.or_else(|| self.room.take())
    }
}

impl<V: Vector> Memory for ExplicitMemory<V> {
    fn stage_count(&self) -> Option<u32> {
        self.last.as_ref()?.count
    }

    fn rescaled(&self, _: f64) -> Self {
        let Self { entropy, falls, taken, lost, read, here, round_off, spectrum, .. } = self;
        let spectrum = spectrum.clone();
        let (lost, read, here) = (lost.clone(), read.clone(), here.clone());
        Self {
            entropy: *entropy,
            falls: *falls,
            taken: *taken,
            lost,
            read,
            here,
            round_off: *round_off,
            last: None,
            room: None,
            spectrum,
        }
    }

    /// The number of stages depends on the spectral radius, which is found every so many steps.
    fn beside(&self) -> Self {
        Self { spectrum: self.spectrum.clone(), ..Self::default() }
    }

    fn clocked(&mut self) {
        (self.here, self.round_off) = (None, None);
    }

    fn take_room(&mut self, from: &mut Self) {
        self.room = from.room.take();
    }

    fn reuse(&mut self, mut given_up: Self) {
        self.room = given_up.take_own_room();
    }

    fn refused(&mut self, tried: Self) {
        self.falls = tried.falls;
        // Known before the step was tried.
        self.here = self.here.take().or(tried.here);
        self.round_off = self.round_off.or(tried.round_off);
        self.room = tried.room.or_else(|| room_of(tried.last));
    }

    /// Leaves out the velocity at the state, which is evaluated anew with the same bits.
    fn save(&self, saved: &mut Saved) {
        if let Some(Produced { sum, lost, largest }) = self.entropy {
            saved.put("entropy produced", [sum, lost, largest, f64::from(self.falls)]);
        }
        saved.put("steps taken", [f64::from(self.taken % creep::PATIENCE)]);
        if let Some(lost) = &self.lost {
            saved.put("compensation", lost.to_list());
        } else if !self.read.is_empty() {
            saved.put("compensation", self.read.iter().copied());
        }
        if let Some(Spectrum { radius, age, direction, read }) = &self.spectrum {
            saved.put("spectral radius", [*radius, f64::from(*age)]);
            let direction = direction.as_ref().map_or_else(|| read.clone(), Vector::to_list);
            saved.put("spectral direction", direction);
        }
    }

    fn restore(saved: &Saved) -> Result<Self, RestoreError> {
        let read = saved.list("compensation")?.unwrap_or_default();
        let mut memory = Self { read, ..Self::default() };
        if let Some(numbers) = saved.get("steps taken", 1)? {
            let taken = (0..creep::PATIENCE).find(|&taken| f64::from(taken) >= numbers[0]);
            memory.taken = taken.unwrap_or(0);
        }
        if let Some(numbers) = saved.get("entropy produced", 4)? {
            let [sum, lost, largest] = [0, 1, 2].map(|k| numbers[k]);
            memory.entropy = Some(Produced { sum, lost, largest });
            // At most a few: a step is held after five.
            memory.falls =
                (0..u32::from(u8::MAX)).find(|&k| f64::from(k) >= numbers[3]).unwrap_or(0);
        }
        if let Some(numbers) = saved.get("spectral radius", 2)? {
            let age = (0..u32::from(u8::MAX)).find(|&k| f64::from(k) >= numbers[1]);
            let read = saved.list("spectral direction")?.unwrap_or_default();
            let (radius, age) = (numbers[0], age.unwrap_or(u32::from(u8::MAX)));
            memory.spectrum = Some(Spectrum { radius, age, direction: None, read });
        }
        Ok(memory)
    }
}
