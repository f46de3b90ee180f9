//! A bar on the terminal for runs that take longer than a second.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// How long a run stays silent.
const PATIENCE: Duration = Duration::from_secs(1);

/// The bar, once it is worth showing.
pub struct Progress {
    begun: Instant,
    terminal: bool,
    what: &'static str,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// A bar that is not there yet; what it counts, such as `{len} states, {elapsed}`.
    pub fn new(what: &'static str) -> Self {
        Progress { begun: Instant::now(), terminal: std::io::stderr().is_terminal(), what, bar: None }
    }

    /// Shows how many of how many are done.
    pub fn show(&mut self, done: usize, total: usize) {
        if !self.terminal || self.begun.elapsed() < PATIENCE {
            return;
        }
        let bar = self.bar.get_or_insert_with(|| {
            let bar = ProgressBar::with_draw_target(Some(total as u64), ProgressDrawTarget::stderr());
            let style = ProgressStyle::with_template(&format!("{{bar:40}} {{pos}} of {}", self.what));
            bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
                .with_elapsed(self.begun.elapsed())
                .with_position(done as u64) // what was there before says nothing about the time to go
        });
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    }

    /// Takes the bar away.
    pub fn clear(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}
