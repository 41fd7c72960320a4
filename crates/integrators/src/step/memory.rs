//! The memory of a method, which a checkpoint saves.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Debug;

use super::exact::Exact;

/// The memory of a method from one step to the next.
pub trait Memory: Clone + Debug + Default {
    /// The memory for steps of `ratio` times the size.
    #[must_use]
    fn rescaled(&self, ratio: f64) -> Self;

    /// The memory after a corner in time, across which nothing is extrapolated.
    #[must_use]
    fn restarted(&self) -> Self {
        Self::default()
    }

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
    lists: Vec<(Cow<'static, str>, Vec<Exact>)>,
}

impl PartialEq for Saved {
    fn eq(&self, other: &Self) -> bool {
        let is_there = |(name, list): &(Cow<'static, str>, Vec<Exact>)| {
            other.place_of(name).is_some_and(|place| other.lists[place].1 == *list)
        };
        self.lists.len() == other.lists.len() && self.lists.iter().all(is_there)
    }
}

impl From<BTreeMap<String, Vec<Exact>>> for Saved {
    fn from(lists: BTreeMap<String, Vec<Exact>>) -> Self {
        Self { lists: lists.into_iter().map(|(name, list)| (name.into(), list)).collect() }
    }
}

impl From<Saved> for BTreeMap<String, Vec<Exact>> {
    fn from(saved: Saved) -> Self {
        saved.lists.into_iter().map(|(name, list)| (name.into_owned(), list)).collect()
    }
}

impl Saved {
    /// Puts a list under a name.
    pub fn put(
        &mut self,
        name: impl Into<Cow<'static, str>>,
        numbers: impl IntoIterator<Item = f64>,
    ) {
        let (name, list) = (name.into(), numbers.into_iter().map(Exact).collect());
        match self.place_of(&name) {
            Some(known) => self.lists[known].1 = list,
            None => {
                if self.lists.is_empty() {
                    self.lists.reserve(LISTS);
                }
                self.lists.push((name, list));
            }
        }
    }

    /// The place of a name in the list.
    fn place_of(&self, name: &str) -> Option<usize> {
        self.lists.iter().position(|(known, _)| known == name)
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
        let Some(place) = self.place_of(name) else { return Ok(None) };
        let list = &self.lists[place].1;
        match list.iter().find(|number| !number.0.is_finite()) {
            Some(number) => Err(RestoreError::Damaged { what: name, value: number.0 }),
            None => Ok(Some(list.iter().map(|number| number.0).collect())),
        }
    }
}

/// Numbers of a checkpoint that are not those of a method.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
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
