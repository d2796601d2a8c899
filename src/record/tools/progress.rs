//! How far a tool is, on a terminal: nowhere else is anything shown.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// How often it is drawn.
const HZ: u8 = 10;

/// What the bar looks like.
const LOOK: &str = "{bar:30} {percent:>3} %  {bytes} of {total_bytes}, {eta} left";

/// A progress bar on standard error, if that is a terminal.
pub(super) struct Progress {
    bar: ProgressBar,
    /// Bytes not yet shown.
    unshown: u64,
}

/// The bar is moved each time so many bytes were read.
const STEP: u64 = 64 * 1024;

impl Progress {
    /// Of so many bytes.
    pub(super) fn new(total: u64) -> Self {
        let target = ProgressDrawTarget::stderr_with_hz(HZ);
        let bar = ProgressBar::with_draw_target(Some(total), target);
        if let Ok(style) = ProgressStyle::with_template(LOOK) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_secs(1));
        Self { bar, unshown: 0 }
    }

    /// So many bytes more were read.
    pub(super) fn add(&mut self, bytes: u64) {
        self.unshown += bytes;
        if self.unshown >= STEP {
            self.bar.inc(std::mem::take(&mut self.unshown));
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
