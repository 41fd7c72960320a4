//! One row of a sweep, as its closure sees it.

use std::fmt;
use std::ops::Index;
use std::sync::Arc;

use crate::draw::{Draw, OF_THE_ROW};

/// A row of a sweep: its number and its parameters by name.
pub struct Row {
    number: usize,
    names: Arc<[String]>,
    values: Box<[f64]>,
    seed: u64,
    #[cfg(feature = "serde")]
    pub(crate) long: Option<crate::long::LongRow>,
}

impl Row {
    pub(crate) const fn new(
        number: usize,
        names: Arc<[String]>,
        values: Box<[f64]>,
        seed: u64,
    ) -> Self {
        Self {
            number,
            names,
            values,
            seed,
            #[cfg(feature = "serde")]
            long: None,
        }
    }

    /// The number of the row, from 0.
    #[must_use]
    pub const fn number(&self) -> usize {
        self.number
    }

    /// The parameter of this name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<f64> {
        self.names.iter().position(|other| other == name).map(|k| self.values[k])
    }

    /// The parameters in the order of the plan.
    #[must_use]
    pub const fn values(&self) -> &[f64] {
        &self.values
    }

    /// Random numbers for the closure, from the seed and the number of the row alone. Each call begins the same stream.
    #[must_use]
    pub fn draw(&self) -> Draw {
        Draw::of(self.seed, OF_THE_ROW, self.number)
    }
}

/// The parameter of this name; [`Row::get`] does not panic.
///
/// # Panics
///
/// If there is none, which makes the row a failed one.
impl Index<&str> for Row {
    type Output = f64;

    fn index(&self, name: &str) -> &f64 {
        let at = self.names.iter().position(|other| other == name);
        match at {
            Some(k) => &self.values[k],
            None => panic!("the row has no parameter {name:?}; it has {}", self.names.join(", ")),
        }
    }
}

impl fmt::Debug for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parameters = self.names.iter().zip(&self.values);
        write!(f, "Row {} ", self.number)?;
        f.debug_map().entries(parameters).finish()
    }
}
