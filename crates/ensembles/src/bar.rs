//! The bar of a sweep on a terminal.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Rows that are done, the rate, the failures and the time left. Where standard error is no terminal, nothing is shown.
#[derive(Debug)]
pub(crate) struct Bar {
    bar: ProgressBar,
    failed: usize,
}

/// The bar is drawn at most so often in a second.
const RATE: u8 = 10;

impl Bar {
    pub(crate) fn new(rows: usize, known: usize, failed: usize, quiet: bool) -> Self {
        let target = if quiet {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr_with_hz(RATE)
        };
        let template = "{bar:30} {human_pos}/{human_len} rows  {per_sec}  {msg}{eta} left";
        let style = ProgressStyle::with_template(template);
        let bar = ProgressBar::with_draw_target(Some(rows as u64), target)
            .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
            .with_elapsed(Duration::ZERO)
            .with_position(known as u64);
        // What the journal had says nothing of the rate.
        bar.reset_eta();
        let bar = Self { bar, failed };
        bar.say();
        bar
    }

    pub(crate) fn add(&mut self, failed: bool) {
        if failed {
            self.failed += 1;
            self.say();
        }
        self.bar.inc(1);
    }

    fn say(&self) {
        if self.failed > 0 && !self.bar.is_hidden() {
            self.bar.set_message(format!("{} failed  ", self.failed));
        }
    }

    pub(crate) fn finish(self) {
        self.bar.finish_and_clear();
    }
}
