//! Caps chosen messages: at most so many a second of each source on a link.

use std::time::Duration;

use super::time::Time;
use crate::mavlink::{Component, MessageId};

/// A cap on one message.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct RateCap {
    /// Which message.
    pub id: MessageId,
    /// The time between two of them: 1 ms to 1,000 s.
    pub interval: Duration,
}

/// The caps of a link, and what they have let through.
#[derive(Clone, Default, Debug)]
pub(super) struct RateLimiter {
    caps: Vec<RateCap>,
    /// When the next frame of a source and message may pass. Invariant: at most [`MAX_ENTRIES`].
    next: Vec<(Component, MessageId, Time)>,
}

/// How many pairs of source and message are remembered; one more takes the place of the one whose
/// turn came longest ago, which may then pass early once.
const MAX_ENTRIES: usize = 256;

impl RateLimiter {
    /// A limiter with these caps.
    pub(super) fn new(caps: Vec<RateCap>) -> Self {
        let entries = if caps.is_empty() { 0 } else { MAX_ENTRIES };
        Self { caps, next: Vec::with_capacity(entries) }
    }

    /// Limits by other caps from now on. What was let through counts by the new ones too.
    pub(super) fn set_caps(&mut self, caps: Vec<RateCap>) {
        if !caps.is_empty() {
            self.next.reserve_exact(MAX_ENTRIES - self.next.len());
        }
        let interval = |id| caps.iter().find(|cap| cap.id == id).map(|cap| cap.interval);
        let old = std::mem::take(&mut self.caps);
        self.next.retain_mut(|(_, id, next)| {
            let before = old.iter().find(|cap| cap.id == *id).map(|cap| cap.interval);
            let (Some(now), Some(before)) = (interval(*id), before) else { return false };
            *next = *next - before + now;
            true
        });
        self.caps = caps;
    }

    /// Whether a frame may pass now.
    #[inline]
    pub(super) fn permits(&self, source: Component, id: MessageId, now: Time) -> bool {
        self.interval(id).is_none() || self.is_due(source, id, now)
    }

    /// A frame has passed, as it may.
    #[inline]
    pub(super) fn count(&mut self, source: Component, id: MessageId, now: Time) {
        if let Some(interval) = self.interval(id) {
            self.count_capped(source, id, interval, now);
        }
    }

    #[inline]
    fn interval(&self, id: MessageId) -> Option<Duration> {
        self.caps.iter().find(|cap| cap.id == id).map(|cap| cap.interval)
    }

    fn is_due(&self, source: Component, id: MessageId, now: Time) -> bool {
        let mut entries = self.next.iter();
        entries.find(|entry| (entry.0, entry.1) == (source, id)).is_none_or(|entry| now >= entry.2)
    }

    fn count_capped(&mut self, source: Component, id: MessageId, interval: Duration, now: Time) {
        let same = |entry: &&mut (Component, MessageId, Time)| (entry.0, entry.1) == (source, id);
        if let Some((_, _, next)) = self.next.iter_mut().find(same) {
            // Counted from when it was due, so that the mean comes out right; but not from long
            // ago, so that nothing is saved up.
            *next = (*next).max(now - interval) + interval;
            return;
        }
        if self.next.len() == MAX_ENTRIES {
            // Whoever has not sent for longest makes room.
            let oldest = (0..MAX_ENTRIES).min_by_key(|at| self.next[*at].2).unwrap_or(0);
            self.next.swap_remove(oldest);
        }
        self.next.push((source, id, now + interval));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ATTITUDE: MessageId = MessageId(30);

    fn limiter(interval_ms: u64) -> RateLimiter {
        let interval = Duration::from_millis(interval_ms);
        RateLimiter::new(vec![RateCap { id: ATTITUDE, interval }])
    }

    /// Whether a frame passes; if so, it is counted.
    fn pass(limiter: &mut RateLimiter, source: Component, id: MessageId, now: Time) -> bool {
        let passes = limiter.permits(source, id, now);
        if passes {
            limiter.count(source, id, now);
        }
        passes
    }

    #[test]
    fn fifty_a_second_become_two() {
        let mut limiter = limiter(500);
        let at = |millis| Time::from_millis(millis);
        let source = Component::new(1, 1);
        let passed = (0..500).filter(|n| pass(&mut limiter, source, ATTITUDE, at(n * 20))).count();
        assert_eq!(passed, 20, "in ten seconds");
    }

    #[test]
    fn each_source_counts_for_itself_and_other_messages_pass() {
        let mut limiter = limiter(500);
        for system in 1..=200 {
            assert!(pass(&mut limiter, Component::new(system, 1), ATTITUDE, Time::ZERO));
            assert!(!pass(&mut limiter, Component::new(system, 1), ATTITUDE, Time::ZERO));
            assert!(pass(&mut limiter, Component::new(system, 1), MessageId(0), Time::ZERO));
        }
    }

    #[test]
    fn what_is_remembered_is_bounded() {
        let mut limiter = limiter(500);
        for number in 0..60_000_u16 {
            let [system, component] = number.to_be_bytes();
            pass(&mut limiter, Component::new(system, component), ATTITUDE, Time::ZERO);
        }
        assert_eq!(limiter.next.len(), MAX_ENTRIES);
    }
}
