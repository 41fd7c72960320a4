//! The file of a checkpoint: the version, the checksum, the run. The version is read first, so that a file of
//! another version is known as one, whatever is in it.

use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::ser::{Error as _, Serialize, SerializeStruct as _, Serializer};

use super::checksum::Checksum;
use super::saved::SavedRun;
use super::{Checkpoint, ResumeError, VERSION};

impl Serialize for Checkpoint {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let run = self.run().map_err(S::Error::custom)?;
        let mut file = serializer.serialize_struct("Checkpoint", FIELDS.len())?;
        file.serialize_field("version", &VERSION)?;
        file.serialize_field("checksum", &Checksum::of(run).map_err(S::Error::custom)?)?;
        file.serialize_field("run", run)?;
        file.end()
    }
}

impl<'de> Deserialize<'de> for Checkpoint {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_struct("Checkpoint", FIELDS, File)
    }
}

const FIELDS: &[&str] = &["version", "checksum", "run"];

#[derive(serde::Deserialize)]
#[serde(field_identifier, rename_all = "lowercase")]
enum Field {
    Version,
    Checksum,
    Run,
    Unknown(String),
}

/// A run that stands before the version that says how it is read.
#[derive(serde::Deserialize)]
#[serde(untagged)]
enum Early {
    Run(Box<SavedRun>),
    Other(IgnoredAny),
}

impl Early {
    fn run(self) -> Option<Box<SavedRun>> {
        match self {
            Self::Run(run) => Some(run),
            Self::Other(_) => None,
        }
    }
}

struct File;

impl<'de> Visitor<'de> for File {
    type Value = Checkpoint;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a checkpoint")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Checkpoint, A::Error> {
        let (mut version, mut checksum, mut run, mut unknown) = (None, None, None, None);
        while let Some(field) = map.next_key()? {
            match field {
                Field::Version => version = Some(map.next_value()?),
                Field::Checksum => checksum = Some(map.next_value()?),
                Field::Run if version == Some(VERSION) => run = Some(map.next_value()?),
                Field::Run => run = map.next_value::<Early>()?.run(),
                Field::Unknown(name) => {
                    map.next_value::<IgnoredAny>()?;
                    unknown = Some(name);
                }
            }
        }
        let missing = A::Error::missing_field;
        match (version.ok_or_else(|| missing("version"))?, unknown) {
            (VERSION, None) => checked(
                checksum.ok_or_else(|| missing("checksum"))?,
                run.ok_or_else(|| missing("run"))?,
            ),
            (VERSION, Some(name)) => Err(A::Error::unknown_field(&name, FIELDS)),
            (found, _) => Ok(of_another_version(found)),
        }
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Checkpoint, A::Error> {
        let missing = |length| A::Error::invalid_length(length, &"a version, a checksum and a run");
        match list.next_element()?.ok_or_else(|| missing(0))? {
            VERSION => checked(
                list.next_element()?.ok_or_else(|| missing(1))?,
                list.next_element()?.ok_or_else(|| missing(2))?,
            ),
            found => {
                // A format that says where each field ends wants to have seen all of them; another one cannot skip.
                while matches!(list.next_element::<IgnoredAny>(), Ok(Some(_))) {}
                Ok(of_another_version(found))
            }
        }
    }
}

const fn of_another_version(found: u32) -> Checkpoint {
    Checkpoint(Err(ResumeError::Version { found, expected: VERSION }))
}

/// The run, if its numbers have this checksum.
fn checked<E: Error>(Checksum(stored): Checksum, run: Box<SavedRun>) -> Result<Checkpoint, E> {
    let Checksum(found) = Checksum::of(&run).map_err(E::custom)?;
    let altered = ResumeError::Altered { stored, found };
    Ok(Checkpoint(if stored == found { Ok(run) } else { Err(altered) }))
}
