//! How a checkpoint is read: its version first, so that a file of another version is known as one, whatever is in it.

use std::collections::BTreeMap;

use serde::de::{Deserialize, Deserializer, Error, IgnoredAny};

use super::{Checkpoint, SavedRun, VERSION};

/// A file in a format that says where each field ends.
#[derive(serde::Deserialize)]
struct Described {
    version: u32,
    run: Option<SavedRun>,
    #[serde(flatten)]
    others: BTreeMap<String, IgnoredAny>,
}

/// A file in a format for programs.
#[derive(serde::Deserialize)]
#[serde(rename = "Checkpoint")]
struct Plain {
    version: u32,
    run: Option<SavedRun>,
}

impl<'de> Deserialize<'de> for Checkpoint {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (version, run) = if deserializer.is_human_readable() {
            let Described { version, run, others } = Described::deserialize(deserializer)?;
            match others.into_keys().next() {
                Some(name) if version == VERSION => {
                    return Err(Error::custom(format_args!("unknown field `{name}`")));
                }
                _ => (version, run),
            }
        } else {
            let Plain { version, run } = Plain::deserialize(deserializer)?;
            (version, run)
        };
        match run {
            None if version == VERSION => Err(Error::missing_field("run")),
            run => Ok(Self { version, run: run.map(Box::new) }),
        }
    }
}
