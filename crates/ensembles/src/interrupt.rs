//! Ctrl-C and the signals of a scheduler while a sweep runs.

use std::sync::Once;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

static ASKED: AtomicBool = AtomicBool::new(false);
static RUNNING: AtomicUsize = AtomicUsize::new(0);
static LISTENING: Once = Once::new();

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
