//! Numbers that are saved with all of their bits.

/// A number that keeps its bits in every format.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Exact(pub(crate) f64);

impl PartialEq for Exact {
    fn eq(&self, other: &Self) -> bool {
        self.0.to_bits() == other.0.to_bits()
    }
}

#[cfg(feature = "serde")]
pub(crate) use form::{ExactForm, deserialize, serialize};

/// The form in a file: in formats for people a string with the digits, in others the number.
#[cfg(feature = "serde")]
mod form {
    use serde::de::{Deserialize, Deserializer, Error, Unexpected, Visitor};
    use serde::{Serialize, Serializer};

    use super::Exact;

    /// A type whose numbers keep their bits in a file. Its fields in a saved type are `serde(with = "exact")`.
    pub(crate) trait ExactForm: Sized {
        fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error>;
        fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error>;
    }

    pub(crate) fn serialize<T: ExactForm, S: Serializer>(
        value: &T,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        value.write(serializer)
    }

    pub(crate) fn deserialize<'de, T: ExactForm, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<T, D::Error> {
        T::read(deserializer)
    }

    /// Serde's own lists and options of a type with an exact form.
    struct Element<T>(T);

    impl<T: ExactForm> Serialize for Element<&T> {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            self.0.write(serializer)
        }
    }

    impl<'de, T: ExactForm> Deserialize<'de> for Element<T> {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            T::read(deserializer).map(Self)
        }
    }

    impl<T: ExactForm> ExactForm for Option<T> {
        fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            self.as_ref().map(Element).serialize(serializer)
        }

        fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            Ok(Option::<Element<T>>::deserialize(deserializer)?.map(|element| element.0))
        }
    }

    impl<T: ExactForm> ExactForm for Vec<T> {
        fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            serializer.collect_seq(self.iter().map(Element))
        }

        fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            let list = Vec::<Element<T>>::deserialize(deserializer)?;
            Ok(list.into_iter().map(|element| element.0).collect())
        }
    }

    impl ExactForm for [f64; 2] {
        fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            self.map(Exact).serialize(serializer)
        }

        fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            Ok(<[Exact; 2]>::deserialize(deserializer)?.map(|number| number.0))
        }
    }

    impl ExactForm for f64 {
        fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            if serializer.is_human_readable() {
                serializer.collect_str(&format_args!("{self:?}"))
            } else {
                serializer.serialize_f64(*self)
            }
        }

        fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            if deserializer.is_human_readable() {
                deserializer.deserialize_str(Digits)
            } else {
                Self::deserialize(deserializer)
            }
        }
    }

    struct Digits;

    impl Visitor<'_> for Digits {
        type Value = f64;

        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str("the digits of a number in a string, such as \"0.1\"")
        }

        fn visit_str<E: Error>(self, digits: &str) -> Result<f64, E> {
            digits.parse().map_err(|_| E::invalid_value(Unexpected::Str(digits), &self))
        }
    }

    impl Serialize for Exact {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            self.0.write(serializer)
        }
    }

    impl<'de> Deserialize<'de> for Exact {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            f64::read(deserializer).map(Self)
        }
    }
}
