//! Ctrl-C and the signals of a scheduler while a sweep runs.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, Once, PoisonError};

static ASKED: AtomicBool = AtomicBool::new(false);
static RUNNING: AtomicUsize = AtomicUsize::new(0);
static LISTENING: Once = Once::new();
/// Files that a process removes before the second signal ends it.
static LEFT: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// The status of a program that Ctrl-C has ended: 128 and the number of the signal.
const ENDED: i32 = 130;

/// A sweep that runs. Meanwhile the first signal asks it to stop, and the second ends the program.
#[derive(Debug)]
pub(crate) struct Listening(());

impl Listening {
    pub(crate) fn begin() -> Self {
        if RUNNING.fetch_add(1, Ordering::SeqCst) == 0 {
            ASKED.store(false, Ordering::SeqCst);
        }
        LISTENING.call_once(|| {
            // Where the program listens itself, a signal does what it did.
            let _ = ctrlc::set_handler(|| {
                let idle = RUNNING.load(Ordering::SeqCst) == 0;
                if ASKED.swap(true, Ordering::SeqCst) || idle {
                    for path in &*LEFT.lock().unwrap_or_else(PoisonError::into_inner) {
                        let _ = std::fs::remove_file(path);
                    }
                    std::process::exit(ENDED);
                }
            });
        });
        Self(())
    }
}

impl Drop for Listening {
    fn drop(&mut self) {
        RUNNING.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Whether a signal has asked the sweep to stop.
pub(crate) fn asked() -> bool {
    ASKED.load(Ordering::Relaxed)
}

/// Says that a file is to be removed where a second signal ends the program.
pub(crate) fn leaves(path: &Path) {
    LEFT.lock().unwrap_or_else(PoisonError::into_inner).push(path.to_owned());
}

/// Says that a file is no longer there.
pub(crate) fn has_left(path: &Path) {
    LEFT.lock().unwrap_or_else(PoisonError::into_inner).retain(|other| other != path);
}
