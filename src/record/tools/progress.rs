//! How far a tool is, on a terminal: nowhere else is anything shown.

use indicatif::ProgressBar;

use crate::record::bars;

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
        Self { bar: bars::lone_bar(total), unshown: 0 }
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
