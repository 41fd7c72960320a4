//! Bounds of parameters.

use crate::error::FitError;
use crate::least_squares::Squares;

/// A parameter, by its name or by its place: `"friction"` or `3`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Which {
    /// The parameter of this name.
    Name(String),
    /// The parameter at this place of the list, counted from 0.
    Index(usize),
}

impl From<&str> for Which {
    fn from(name: &str) -> Self {
        Self::Name(name.to_owned())
    }
}

impl From<String> for Which {
    fn from(name: String) -> Self {
        Self::Name(name)
    }
}

impl From<usize> for Which {
    fn from(index: usize) -> Self {
        Self::Index(index)
    }
}

/// The side of an interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// The lower end.
    Lower,
    /// The upper end.
    Upper,
}

/// No bounds.
pub(crate) const WITHOUT: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// The bounds that were asked for, the last one of a parameter first.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bounds(Vec<(Which, [f64; 2])>);

impl Bounds {
    /// Sets the bounds of a parameter in place of earlier ones.
    pub(crate) fn set(&mut self, which: Which, bounds: [f64; 2]) {
        self.0.push((which, bounds));
    }

    /// The bounds of each parameter, around a guess within them.
    pub(crate) fn around(
        &self,
        known: &[&'static str],
        guess: &[f64],
    ) -> Result<Vec<[f64; 2]>, FitError> {
        let mut all = vec![WITHOUT; known.len()];
        for (which, bounds) in &self.0 {
            let index = match which {
                Which::Index(index) => Some(*index).filter(|index| *index < known.len()),
                Which::Name(name) => known.iter().position(|other| other == name),
            };
            let Some(index) = index else {
                let known = known.to_vec();
                return Err(match which {
                    Which::Name(name) => FitError::UnknownParameter { name: name.clone(), known },
                    &Which::Index(index) => FitError::UnknownIndex { index, known },
                });
            };
            let (name, [lower, upper]) = (known[index], *bounds);
            let is_interval = lower < upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY;
            if !is_interval {
                return Err(FitError::Bounds { name, lower, upper });
            }
            all[index] = *bounds;
        }
        for (index, [lower, upper]) in all.iter().copied().enumerate() {
            let (name, value) = (known[index], guess[index]);
            if [lower, upper] != WITHOUT && !(lower <= value && value <= upper) {
                return Err(FitError::OutOfBounds { name, value, lower, upper });
            }
        }
        Ok(all)
    }
}

/// The bound that holds each unknown: it is there, and the sum would fall beyond. Without a bound the lists are shorter.
pub(crate) fn held(at: &Squares, here: &[f64], bounds: &[[f64; 2]]) -> Vec<Option<Bound>> {
    let slope = |j: usize| at.jacobian.column(j).dot(&at.residuals);
    #[allow(clippy::float_cmp, reason = "a step that meets a bound ends at its bits")]
    let held = |(j, (phi, [lower, upper])): (usize, (&f64, &[f64; 2]))| {
        if phi == lower && slope(j) > 0.0 {
            Some(Bound::Lower)
        } else if phi == upper && slope(j) < 0.0 {
            Some(Bound::Upper)
        } else {
            None
        }
    };
    here.iter().zip(bounds).enumerate().map(held).collect()
}
