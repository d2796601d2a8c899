//! Doing something at set times, and knowing how late one was oneself: only a machine that lets the
//! test itself run in time may judge how fast the router is.

use std::thread;
use std::time::{Duration, Instant};

/// Times at an even distance, and how late each was kept.
pub(crate) struct Schedule {
    next: Instant,
    interval: Duration,
    pub(crate) lateness: Lateness,
}

impl Schedule {
    /// The first time is now.
    pub(crate) fn every(interval: Duration) -> Self {
        Self { next: Instant::now(), interval, lateness: Lateness::default() }
    }

    /// Sleeps until the next of them. Those that were missed are not made up for.
    pub(crate) fn wait(&mut self) {
        self.next += self.interval;
        thread::sleep(self.next.saturating_duration_since(Instant::now()));
        let late = self.next.elapsed();
        self.lateness.0.push(late);
        if late > self.interval {
            self.next = Instant::now();
        }
    }
}

/// How late somebody was, each time.
#[derive(Default, Clone)]
pub(crate) struct Lateness(Vec<Duration>);

impl Lateness {
    /// Sleeps, and notes how much too long that was.
    pub(crate) fn sleep(&mut self, time: Duration) {
        let due = Instant::now() + time;
        thread::sleep(time);
        self.0.push(due.elapsed());
    }

    /// With what somebody else has noted.
    pub(crate) fn and(mut self, other: Self) -> Self {
        self.0.extend(other.0);
        self
    }

    /// What 99 of 100 were not later than.
    pub(crate) fn p99(&self) -> Duration {
        quantile(&self.0, 0.99)
    }
}

/// The value that this part of `values` does not exceed; zero if there are none.
pub(crate) fn quantile(values: &[Duration], part: f64) -> Duration {
    let mut sorted = values.to_vec();
    sorted.sort_unstable();
    let last = sorted.len().saturating_sub(1);
    // As many values as any test has are exact in a double.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss)]
    let at = (last as f64 * part).round() as usize;
    sorted.get(at).copied().unwrap_or_default()
}

/// Milliseconds, for people.
pub(crate) fn millis(time: Duration) -> f64 {
    time.as_secs_f64() * 1_000.0
}
