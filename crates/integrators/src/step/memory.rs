//! The memory of a method, which a checkpoint saves.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::ops::Range;

use super::exact::Exact;

/// The ratio of the size of a step to that of the one before, up to which a method may extrapolate. Beyond it the differences of
/// a short step are round-off, which a polynomial of degree `n` multiplies by the `n`-th power of the ratio.
/// A factor of four fails `midpoint/predictor.rs::nothing_is_extrapolated_to_a_far_longer_step`.
pub(crate) const FARTHEST: f64 = 16.0;

/// The memory of a method from one step to the next.
pub trait Memory: Clone + Debug + Default + 'static {
    /// The memory for steps of `ratio` times the size.
    #[must_use]
    fn rescaled(&self, ratio: f64) -> Self;

    /// The memory after a corner in time, across which nothing is extrapolated.
    #[must_use]
    fn restarted(&self) -> Self {
        Self::default()
    }

    /// The memory with which a step is taken again, and others beside it: without what they would extrapolate from.
    #[must_use]
    fn beside(&self) -> Self {
        self.restarted()
    }

    /// Forgets what is a function of the state reached, whose [clock](crate::Flow::clocked) was set by a rounding.
    fn clocked(&mut self) {}

    /// Takes over the room of another memory, which needs it no more. No number of a step depends on it.
    fn take_room(&mut self, from: &mut Self) {
        let _ = from;
    }

    /// Keeps the room of a memory that is given up. No number of a step depends on it.
    fn reuse(&mut self, given_up: Self) {
        let _ = given_up;
    }

    /// Notes what a try that was refused has left in its own copy of this memory.
    fn refused(&mut self, tried: Self) {
        let _ = tried;
    }

    /// The number of stages of the step taken last, by a method that chooses it from step to step.
    fn stage_count(&self) -> Option<u32> {
        None
    }

    /// The velocities of the stages of the step taken last, one stage after the other in the frame at its start, by a method
    /// that solves for them.
    fn stage_velocities(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Puts all of its numbers into a checkpoint.
    fn save(&self, saved: &mut Saved);

    /// Reads them from a checkpoint.
    ///
    /// # Errors
    ///
    /// [`RestoreError`] if a number is missing or impossible.
    fn restore(saved: &Saved) -> Result<Self, RestoreError>;
}

/// The memory of a method that has none.
impl Memory for () {
    fn rescaled(&self, _: f64) -> Self {}

    fn save(&self, _: &mut Saved) {}

    fn restore(_: &Saved) -> Result<Self, RestoreError> {
        Ok(())
    }
}

/// Lists for which there is room at first.
const LISTS: usize = 16;
/// Numbers for which there is room at first.
const NUMBERS: usize = 64;

/// The numbers that a method keeps from one step to the next, in named lists.
#[derive(Clone, Debug, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(from = "BTreeMap<String, Vec<Exact>>", into = "BTreeMap<String, Vec<Exact>>")
)]
pub struct Saved {
    /// In the order in which they were put, which says nothing. A short run ends with a checkpoint too, and a few lists
    /// cost less than a tree.
    lists: Vec<(Cow<'static, str>, Range<usize>)>,
    /// The numbers of all lists, one after the other: an array for each list would cost a short run more than its numbers.
    numbers: Vec<Exact>,
}

impl PartialEq for Saved {
    fn eq(&self, other: &Self) -> bool {
        let is_there = |(name, list): (&str, &[Exact])| other.numbers_of(name) == Some(list);
        self.lists.len() == other.lists.len() && self.named().all(is_there)
    }
}

impl From<BTreeMap<String, Vec<Exact>>> for Saved {
    fn from(lists: BTreeMap<String, Vec<Exact>>) -> Self {
        let mut saved = Self::default();
        for (name, list) in lists {
            saved.put(name, list.into_iter().map(|number| number.0));
        }
        saved
    }
}

impl From<Saved> for BTreeMap<String, Vec<Exact>> {
    fn from(saved: Saved) -> Self {
        saved.named().map(|(name, list)| (name.to_owned(), list.to_vec())).collect()
    }
}

impl Saved {
    /// Puts a list under a name.
    pub fn put(
        &mut self,
        name: impl Into<Cow<'static, str>>,
        numbers: impl IntoIterator<Item = f64>,
    ) {
        let mut numbers = numbers.into_iter();
        self.put_each(name.into(), &mut || numbers.next());
    }

    /// Puts a list whose numbers come one after another: compiled once, and not for each kind of list.
    fn put_each(&mut self, name: Cow<'static, str>, next: &mut dyn FnMut() -> Option<f64>) {
        if self.lists.is_empty() {
            self.lists.reserve(LISTS);
            self.numbers.reserve(NUMBERS);
        }
        let start = self.numbers.len();
        self.numbers.extend(std::iter::from_fn(next).map(Exact));
        let list = start..self.numbers.len();
        match self.lists.iter_mut().find(|(known, _)| *known == name) {
            Some((_, known)) => *known = list,
            None => self.lists.push((name, list)),
        }
    }

    /// The lists with their names.
    fn named(&self) -> impl Iterator<Item = (&str, &[Exact])> {
        self.lists.iter().map(|(name, list)| (name.as_ref(), &self.numbers[list.clone()]))
    }

    /// The numbers under a name.
    fn numbers_of(&self, name: &str) -> Option<&[Exact]> {
        self.named().find(|(known, _)| *known == name).map(|(_, list)| list)
    }

    /// The list under a name; `None` if it was not put.
    ///
    /// # Errors
    ///
    /// [`RestoreError`] if it has another length, or a number that is not finite.
    pub fn get(&self, name: &'static str, length: usize) -> Result<Option<Vec<f64>>, RestoreError> {
        let list = self.list(name)?;
        if let Some(list) = &list {
            let found = list.len();
            if found != length {
                return Err(RestoreError::Length { what: name, found, expected: length });
            }
        }
        Ok(list)
    }

    /// The list under a name, of any length; `None` if it was not put.
    ///
    /// # Errors
    ///
    /// [`RestoreError`] if it has a number that is not finite.
    pub fn list(&self, name: &'static str) -> Result<Option<Vec<f64>>, RestoreError> {
        let Some(list) = self.numbers_of(name) else { return Ok(None) };
        match list.iter().find(|number| !number.0.is_finite()) {
            Some(number) => Err(RestoreError::Damaged { what: name, value: number.0 }),
            None => Ok(Some(list.iter().map(|number| number.0).collect())),
        }
    }
}

/// Numbers of a checkpoint that are not those of a method.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RestoreError {
    /// A list has another length.
    #[error("the checkpoint has {found} {what}, the method {expected}")]
    Length {
        /// The name of the list.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length that it should have.
        expected: usize,
    },
    /// A number is impossible.
    #[error("the {what} of the checkpoint is {value}")]
    Damaged {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

metriplectic_equations::debug_is_the_sentence!(RestoreError);
