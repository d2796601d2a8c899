//! How long to wait before the next try: twice as long each time, up to a limit.

use std::time::Duration;

/// Waits from 100 ms to 2 s, or to another limit.
#[derive(Clone, Copy, Debug)]
pub struct Backoff {
    next: Duration,
    longest: Duration,
}

const FIRST: Duration = Duration::from_millis(100);
const LONGEST: Duration = Duration::from_secs(2);

impl Backoff {
    /// Before the first failure.
    pub const fn new() -> Self {
        Self::up_to(LONGEST)
    }

    /// Before the first failure, with a limit of its own.
    pub const fn up_to(longest: Duration) -> Self {
        Self { next: FIRST, longest }
    }

    /// How long to wait after one more failure.
    pub fn next_delay(&mut self) -> Duration {
        let delay = self.next.min(self.longest);
        self.next = (delay * 2).min(self.longest);
        delay
    }

    /// It worked: the next failure is a first one again.
    pub fn reset(&mut self) {
        self.next = FIRST;
    }
}

impl Default for Backoff {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wait_doubles_up_to_two_seconds_and_starts_over() {
        let mut backoff = Backoff::new();
        let waits: Vec<u128> = (0..7).map(|_| backoff.next_delay().as_millis()).collect();
        assert_eq!(waits, [100, 200, 400, 800, 1_600, 2_000, 2_000]);
        backoff.reset();
        assert_eq!(backoff.next_delay(), FIRST);
    }

    #[test]
    fn a_limit_of_its_own_holds_after_a_reset_too() {
        let mut backoff = Backoff::up_to(Duration::from_millis(250));
        for _ in 0..2 {
            let waits: Vec<u128> = (0..3).map(|_| backoff.next_delay().as_millis()).collect();
            assert_eq!(waits, [100, 200, 250]);
            backoff.reset();
        }
    }
}
