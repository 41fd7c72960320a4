//! Numbers that are saved with all of their bits.

use std::collections::BTreeMap;

use super::ResumeError;

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

/// A number that keeps its bits in every format.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Exact(pub(crate) f64);

impl PartialEq for Exact {
    fn eq(&self, other: &Self) -> bool {
        self.0.to_bits() == other.0.to_bits()
    }
}

#[cfg(feature = "serde")]
impl serde::Serialize for Exact {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            serializer.collect_str(&format_args!("{:?}", self.0))
        } else {
            serializer.serialize_f64(self.0)
        }
    }
}

#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for Exact {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Digits;
        impl serde::de::Visitor<'_> for Digits {
            type Value = f64;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("the digits of a number in a string, such as \"0.1\"")
            }

            fn visit_str<E: serde::de::Error>(self, digits: &str) -> Result<f64, E> {
                digits
                    .parse()
                    .map_err(|_| E::invalid_value(serde::de::Unexpected::Str(digits), &self))
            }
        }
        if deserializer.is_human_readable() {
            deserializer.deserialize_str(Digits).map(Self)
        } else {
            f64::deserialize(deserializer).map(Self)
        }
    }
}
