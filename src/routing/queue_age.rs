//! How long the oldest bytes of a queue have waited, without a time for each frame.
//!
//! Now and then the end of the queue is marked, with the time. When all before the mark has been
//! sent, what is left came later: so the age is never told too low, and too high by at most the time
//! that the queue once took from end to end.

use std::time::Duration;

use super::time::Time;

/// The age of a queue.
#[derive(Clone, Copy, Default, Debug)]
pub(super) struct QueueAge {
    /// What waits came at this time or later; `None`: nothing waits.
    oldest: Option<Time>,
    /// How many bytes wait before the mark, and when it was set.
    mark: Option<(usize, Time)>,
}

impl QueueAge {
    /// Looks at a queue of `len` bytes, which has got something since, or was looked at, or is empty.
    #[inline]
    pub(super) fn look(&mut self, len: usize, now: Time) {
        if len == 0 {
            *self = Self::default();
        } else {
            self.oldest.get_or_insert(now);
            self.mark.get_or_insert((len, now));
        }
    }

    /// The first `count` bytes have left, and `rest` are left.
    #[inline]
    pub(super) fn consume(&mut self, count: usize, rest: usize) {
        match &mut self.mark {
            _ if rest == 0 => *self = Self::default(),
            Some((ahead, _)) if *ahead > count => *ahead -= count,
            mark => {
                if let Some((_, at)) = mark.take() {
                    self.oldest = Some(at);
                }
            }
        }
    }

    /// How long the oldest byte has waited, at most.
    pub(super) fn get(self, now: Time) -> Duration {
        self.oldest.map_or(Duration::ZERO, |oldest| now.since(oldest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn at(ms: u64) -> Time {
        Time::from_millis(ms)
    }

    #[test]
    fn what_is_sent_at_once_has_no_age() {
        let mut age = QueueAge::default();
        age.look(100, at(5));
        age.consume(100, 0);
        assert_eq!(age.get(at(900)), Duration::ZERO);
    }

    #[test]
    fn what_waits_is_as_old_as_it_is() {
        let mut age = QueueAge::default();
        age.look(100, at(5));
        age.look(200, at(10));
        assert_eq!(age.get(at(25)), Duration::from_millis(20));
    }

    #[test]
    fn a_queue_that_is_never_empty_is_no_older_than_twice_its_length_in_time() {
        let mut age = QueueAge::default();
        // 10 bytes come and go each millisecond, and 1,000 wait: each waits for 100 ms.
        age.look(1_000, at(0));
        for ms in 1..10_000 {
            age.look(1_010, at(ms));
            age.consume(10, 1_000);
            let told = age.get(at(ms)).as_millis();
            assert!(told <= 202, "{told} ms at {ms}");
            assert!(ms < 100 || told >= 99, "{told} ms at {ms}");
        }
    }
}
