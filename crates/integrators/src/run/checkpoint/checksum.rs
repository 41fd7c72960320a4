//! The checksum of a checkpoint: over the bits of its numbers, and so the same in every format.

use serde::de::value::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de, ser};

use super::saved::SavedRun;

/// A sum over words `w`: `c ← rot((c ⊕ w) m)` with an odd `m`. Each step is one to one in `c` and in `w`, so another
/// value of one word is always another sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Checksum(pub(super) u64);

impl Checksum {
    /// The sum of a run.
    pub(super) fn of(run: &SavedRun) -> Result<Self, Error> {
        let mut sum = Self(0);
        run.serialize(&mut sum)?;
        Ok(sum)
    }

    const fn put(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
    }

    fn put_bytes(&mut self, bytes: &[u8]) {
        self.put(bytes.len() as u64);
        for &byte in bytes {
            self.put(byte.into());
        }
    }
}

/// In a format for people sixteen hexadecimal digits: some of their readers make each number an `f64`.
impl Serialize for Checksum {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            serializer.collect_str(&format_args!("{:016x}", self.0))
        } else {
            serializer.serialize_u64(self.0)
        }
    }
}

impl<'de> Deserialize<'de> for Checksum {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if deserializer.is_human_readable() {
            let digits = String::deserialize(deserializer)?;
            u64::from_str_radix(&digits, 16).map(Self).map_err(de::Error::custom)
        } else {
            u64::deserialize(deserializer).map(Self)
        }
    }
}

macro_rules! words {
    ($($name:ident of $type:ty),*) => {$(
        fn $name(self, number: $type) -> Result<(), Error> {
            self.put(u64::from(number));
            Ok(())
        }
    )*};
}

macro_rules! signed_words {
    ($($name:ident of $type:ty),*) => {$(
        fn $name(self, number: $type) -> Result<(), Error> {
            self.put(i64::from(number).cast_unsigned());
            Ok(())
        }
    )*};
}

/// Takes in the numbers, the strings, the lengths of lists and the variants of enums. The names of fields are the
/// same in each file of a version.
impl Serializer for &mut Checksum {
    type Ok = ();
    type Error = Error;
    type SerializeSeq = Self;
    type SerializeTuple = Self;
    type SerializeTupleStruct = Self;
    type SerializeTupleVariant = Self;
    type SerializeMap = Self;
    type SerializeStruct = Self;
    type SerializeStructVariant = Self;

    words!(serialize_bool of bool, serialize_u8 of u8, serialize_u16 of u16, serialize_u32 of u32);
    words!(serialize_u64 of u64, serialize_char of char);
    signed_words!(serialize_i8 of i8, serialize_i16 of i16, serialize_i32 of i32, serialize_i64 of i64);

    fn serialize_f32(self, number: f32) -> Result<(), Error> {
        self.serialize_f64(number.into())
    }

    /// A number that is none has one form in a file, whatever its sign and its payload.
    fn serialize_f64(self, number: f64) -> Result<(), Error> {
        self.put(if number.is_nan() { f64::NAN.to_bits() } else { number.to_bits() });
        Ok(())
    }

    fn serialize_str(self, text: &str) -> Result<(), Error> {
        self.put_bytes(text.as_bytes());
        Ok(())
    }

    fn serialize_bytes(self, bytes: &[u8]) -> Result<(), Error> {
        self.put_bytes(bytes);
        Ok(())
    }

    fn serialize_none(self) -> Result<(), Error> {
        self.put(0);
        Ok(())
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<(), Error> {
        self.put(1);
        value.serialize(self)
    }

    fn serialize_unit(self) -> Result<(), Error> {
        Ok(())
    }

    fn serialize_unit_struct(self, _: &'static str) -> Result<(), Error> {
        Ok(())
    }

    fn serialize_unit_variant(self, _: &str, index: u32, _: &str) -> Result<(), Error> {
        self.serialize_u32(index)
    }

    fn serialize_newtype_struct<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        value: &T,
    ) -> Result<(), Error> {
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        index: u32,
        _: &'static str,
        value: &T,
    ) -> Result<(), Error> {
        self.put(index.into());
        value.serialize(self)
    }

    fn serialize_seq(self, length: Option<usize>) -> Result<Self, Error> {
        self.put(length.unwrap_or(usize::MAX) as u64);
        Ok(self)
    }

    fn serialize_tuple(self, _: usize) -> Result<Self, Error> {
        Ok(self)
    }

    fn serialize_tuple_struct(self, _: &'static str, _: usize) -> Result<Self, Error> {
        Ok(self)
    }

    fn serialize_tuple_variant(
        self,
        _: &'static str,
        index: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Self, Error> {
        self.put(index.into());
        Ok(self)
    }

    fn serialize_map(self, length: Option<usize>) -> Result<Self, Error> {
        self.serialize_seq(length)
    }

    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Self, Error> {
        Ok(self)
    }

    fn serialize_struct_variant(
        self,
        _: &'static str,
        index: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Self, Error> {
        self.put(index.into());
        Ok(self)
    }

    fn is_human_readable(&self) -> bool {
        false
    }
}

/// The parts of a composite value, one after the other.
macro_rules! parts {
    ($($trait:ident: $method:ident($($name:ty)?)),*) => {$(
        impl ser::$trait for &mut Checksum {
            type Ok = ();
            type Error = Error;

            fn $method<T: Serialize + ?Sized>(&mut self, $(_: $name,)? part: &T) -> Result<(), Error> {
                part.serialize(&mut **self)
            }

            fn end(self) -> Result<(), Error> {
                Ok(())
            }
        }
    )*};
}

parts! {
    SerializeSeq: serialize_element(),
    SerializeTuple: serialize_element(),
    SerializeTupleStruct: serialize_field(),
    SerializeTupleVariant: serialize_field(),
    SerializeStruct: serialize_field(&'static str),
    SerializeStructVariant: serialize_field(&'static str)
}

impl ser::SerializeMap for &mut Checksum {
    type Ok = ();
    type Error = Error;

    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Result<(), Error> {
        key.serialize(&mut **self)
    }

    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Error> {
        value.serialize(&mut **self)
    }

    fn end(self) -> Result<(), Error> {
        Ok(())
    }
}
