//! Checkpoints as files of JSON: compiled once, and not with each test that puts a run down.

use metriplectic_integrators::Checkpoint;

/// Writes the file of a checkpoint.
///
/// # Panics
///
/// If a number of it is not written.
pub fn written(checkpoint: &Checkpoint) -> String {
    serde_json::to_string(checkpoint).expect("a checkpoint is written")
}

/// Reads the file of a checkpoint.
///
/// # Errors
///
/// The first place in the file that belongs to no checkpoint.
pub fn read(file: &[u8]) -> Result<Checkpoint, serde_json::Error> {
    serde_json::from_slice(file)
}

/// Writes a checkpoint, and reads it.
///
/// # Panics
///
/// If it is not read.
pub fn reread(checkpoint: &Checkpoint) -> Checkpoint {
    read(written(checkpoint).as_bytes()).expect("a checkpoint that was written is read")
}
