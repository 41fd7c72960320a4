//! The memory of a method, which a checkpoint saves.

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

    /// Notes what a try that was refused has left in its own copy of this memory.
    fn refused(&mut self, tried: Self) {
        let _ = tried;
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

/// The numbers that a method keeps from one step to the next, in named lists.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Saved(BTreeMap<String, Vec<Exact>>);

impl Saved {
    /// Puts a list under a name.
    pub fn put(&mut self, name: &str, numbers: impl IntoIterator<Item = f64>) {
        self.0.insert(name.to_owned(), numbers.into_iter().map(Exact).collect());
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
        let Some(list) = self.0.get(name) else { return Ok(None) };
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
