//! The file of a checkpoint with one digit changed.

use metriplectic::integrators::{Element, Flow, Schedule};
use metriplectic::prelude::*;
use metriplectic_studies::checkpoints;

/// Puts a run down after three steps, and changes each digit of its file to each other one: none of these files is
/// resumed, unless it has other digits of the same numbers.
pub(crate) fn refuses_changed_digits<F: Flow, M: Method<F> + Clone>(
    method: M,
    flow: &F,
    x0: Element<F>,
    course: impl Into<Schedule>,
) {
    let mut steps = method.clone().steps(flow, x0, course).expect("the model keeps its laws");
    for _ in 0..3 {
        steps.advance().expect("it is solved");
    }
    let checkpoint = steps.checkpoint();
    let text = checkpoints::written(&checkpoint);
    let (mut refused, mut same) = (0, 0);
    for at in (0..text.len()).filter(|&at| text.as_bytes()[at].is_ascii_digit()) {
        for digit in (b'0'..=b'9').filter(|&digit| digit != text.as_bytes()[at]) {
            let mut bytes = text.clone().into_bytes();
            bytes[at] = digit;
            let read = checkpoints::read(&bytes).ok();
            match read.filter(|read| method.clone().resume(flow, read).is_ok()) {
                None => refused += 1,
                Some(read) => {
                    assert_eq!(
                        read,
                        checkpoint,
                        "{} of {text}",
                        String::from_utf8_lossy(&bytes[at..])
                    );
                    same += 1;
                }
            }
        }
    }
    println!(
        "{}: {refused} changed digits are refused, {same} are of the same number",
        checkpoint.method()
    );
    assert!(refused > 1000 && same < refused / 100);
}
