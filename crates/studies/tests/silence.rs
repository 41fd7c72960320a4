//! What a run prints: nothing of its progress where nobody watches.

use std::{
    env,
    process::{Command, Stdio},
    thread,
    time::Duration,
};

use metriplectic_studies::Progress;

/// Set in the run that is listened to.
const LISTENED: &str = "METRIPLECTIC_STUDIES_LISTENED";

/// Runs itself with standard error piped for longer than the bar waits. The test harness writes to
/// standard output, so that anything on standard error is the bar.
#[test]
fn a_pipe_hears_nothing_of_the_progress() -> Result<(), Box<dyn std::error::Error>> {
    if env::var_os(LISTENED).is_some() {
        let mut progress = Progress::over(12);
        for _ in 0..12 {
            thread::sleep(Duration::from_millis(100));
            progress.step();
        }
        return Ok(());
    }
    let heard = Command::new(env::current_exe()?)
        .args(["a_pipe_hears_nothing_of_the_progress", "--exact", "--nocapture"])
        .env(LISTENED, "yes")
        .stderr(Stdio::piped())
        .output()?;
    assert!(heard.status.success());
    assert_eq!(String::from_utf8(heard.stderr)?, "");
    Ok(())
}
