//! What a method saves.

use std::collections::BTreeMap;

use super::{Exact, ResumeError};

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
    /// [`ResumeError`] if it has another length, or a number that is not finite.
    pub fn get(&self, name: &'static str, length: usize) -> Result<Option<Vec<f64>>, ResumeError> {
        let list = self.list(name)?;
        if let Some(list) = &list {
            super::expect_length(name, list.len(), length)?;
        }
        Ok(list)
    }

    /// The list under a name, of any length; `None` if it was not put.
    ///
    /// # Errors
    ///
    /// [`ResumeError`] if it has a number that is not finite.
    pub fn list(&self, name: &'static str) -> Result<Option<Vec<f64>>, ResumeError> {
        let Some(list) = self.0.get(name) else { return Ok(None) };
        match list.iter().find(|number| !number.0.is_finite()) {
            Some(number) => Err(ResumeError::Damaged { what: name, value: number.0 }),
            None => Ok(Some(list.iter().map(|number| number.0).collect())),
        }
    }
}
