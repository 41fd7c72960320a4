//! Ctrl-C in a long run.

use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

static ASKED: AtomicBool = AtomicBool::new(false);
static LISTENING: Once = Once::new();

/// The status of a program that Ctrl-C has ended: 128 and the number of the signal.
const ENDED: i32 = 130;

/// Whether Ctrl-C has been pressed: a loop that asks this can stop where its file is whole. From the
/// first question on the program is no longer ended by Ctrl-C, but by a second one.
///
/// ```
/// let mut rows = 0;
/// for _ in 0..1000 {
///     rows += 1;
///     if metriplectic_studies::interrupted() {
///         break;
///     }
/// }
/// println!("{rows} rows are written");
/// ```
pub fn interrupted() -> bool {
    LISTENING.call_once(|| {
        // Where the program listens itself, or the system has no signals, Ctrl-C does what it did.
        let _ = ctrlc::set_handler(|| {
            if ASKED.swap(true, Ordering::Relaxed) {
                std::process::exit(ENDED);
            }
        });
    });
    ASKED.load(Ordering::Relaxed)
}
