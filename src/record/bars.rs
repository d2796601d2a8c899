//! Progress bars on a terminal, beside a log that may go to the same terminal.
//!
//! Only threads that may wait draw here: a terminal can be stopped.

use std::sync::OnceLock;
use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

/// How often a bar is drawn at most, and how often its time is at least.
const HZ: u8 = 10;
const TICK: Duration = Duration::from_secs(1);

/// What a bar looks like.
const LOOK: &str = "{prefix}{bar:30} {percent:>3} %  {bytes} of {total_bytes}, {eta} left";

/// The bars of a program that has a log, once it wants any.
static BESIDE_LOG: OnceLock<MultiProgress> = OnceLock::new();

/// From now on replays show how far they are, on standard error; all that is written there goes
/// through [`beside_bars`].
pub fn show_bars() {
    let target = ProgressDrawTarget::stderr_with_hz(HZ);
    BESIDE_LOG.get_or_init(|| MultiProgress::with_draw_target(target));
}

/// Whether [`show_bars`] was called.
pub(super) fn are_shown() -> bool {
    BESIDE_LOG.get().is_some()
}

/// Writes something to standard error without bars in its way.
pub fn beside_bars<R>(write: impl FnOnce() -> R) -> R {
    match BESIDE_LOG.get() {
        Some(bars) => bars.suspend(write),
        None => write(),
    }
}

/// Takes all bars away: the program is about to end.
pub fn hide_bars() {
    if let Some(bars) = BESIDE_LOG.get() {
        // On a terminal that is gone there is nothing to take away.
        let _ = bars.clear();
        bars.set_draw_target(ProgressDrawTarget::hidden());
    }
}

/// A bar of so many bytes beside the log; it is drawn when it is moved.
pub(super) fn bar_beside_log(total: u64) -> Option<ProgressBar> {
    let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::hidden());
    Some(styled(BESIDE_LOG.get()?.add(bar)))
}

/// A bar of so many bytes that has standard error for itself.
pub(super) fn lone_bar(total: u64) -> ProgressBar {
    let target = ProgressDrawTarget::stderr_with_hz(HZ);
    let bar = styled(ProgressBar::with_draw_target(Some(total), target));
    bar.enable_steady_tick(TICK);
    bar
}

fn styled(bar: ProgressBar) -> ProgressBar {
    match ProgressStyle::with_template(LOOK) {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}
