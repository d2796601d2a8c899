//! What the router knows of signing: the time that it signs with, the streams that it has heard
//! with each key, and whom the log was told of.

use super::link_set::LinkId;
use super::reminder::Reminder;
use super::time::Time;
use crate::mavlink::{CheckedFrame, Component, Key, Refusal, Streams, Timestamp};

/// The time of signatures (rule 57): it goes on by itself, is put forward by better clocks, and
/// never goes back.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct SigningClock {
    /// What it showed at `since`.
    shown: Timestamp,
    since: Time,
    /// The newest timestamp that may have been used. Each is used once.
    used: Timestamp,
}

impl SigningClock {
    /// A clock that shows `shown` now, while all timestamps up to `used` may have been used before.
    pub fn new(shown: Timestamp, used: Timestamp, now: Time) -> Self {
        Self { shown, since: now, used }
    }

    /// What it shows.
    pub fn show(&self, now: Time) -> Timestamp {
        let micros = now.since(self.since).as_micros();
        self.shown.plus(u64::try_from(micros / 10).unwrap_or(u64::MAX))
    }

    /// Puts it forward to what a better clock shows; never back.
    pub fn put_forward(&mut self, to: Timestamp, now: Time) {
        if to > self.show(now) {
            (self.shown, self.since) = (to, now);
        }
    }

    /// A timestamp that nobody has used yet.
    pub fn next(&mut self, now: Time) -> Timestamp {
        self.used = self.used.plus(1).max(self.show(now));
        self.used
    }

    /// The newest timestamp that may have been used.
    pub fn used(&self) -> Timestamp {
        self.used
    }
}

/// What is known of the streams of one key.
#[derive(Debug)]
struct Heard {
    key: Key,
    /// Links of a group bring the same frames, each in its own time: so each member of a group has
    /// its own streams, and only who is in none shares those of the key.
    member: Option<u16>,
    streams: Streams,
}

/// See the module.
#[derive(Default, Debug)]
pub(super) struct Signing {
    pub(super) clock: SigningClock,
    /// One for each key and member that was ever configured.
    heard: Vec<Heard>,
    /// Whose refused frames the log was told of.
    pub(super) told: Reminder<(LinkId, Component)>,
}

/// The number of the streams of a key.
#[derive(Clone, Copy, Debug)]
pub(super) struct HeardId(usize);

impl Signing {
    /// The streams of a key, made if they are not there.
    pub(super) fn streams_of(&mut self, key: &Key, member: Option<u16>) -> HeardId {
        let known = self.find(key, member);
        HeardId(known.unwrap_or_else(|| {
            let streams = Streams::default();
            self.heard.push(Heard { key: key.clone(), member, streams });
            self.heard.len() - 1
        }))
    }

    fn find(&self, key: &Key, member: Option<u16>) -> Option<usize> {
        self.heard.iter().position(|heard| heard.member == member && heard.key == *key)
    }

    /// Believes a frame, or says why not.
    pub(super) fn accept(
        &mut self,
        id: HeardId,
        frame: &CheckedFrame<'_>,
        now: Time,
    ) -> Result<(), Refusal> {
        let heard = &mut self.heard[id.0];
        let time = heard.streams.accept(frame, &heard.key, self.clock.show(now))?;
        self.clock.put_forward(time, now);
        Ok(())
    }

    /// Whether a frame would be believed, and if not, why.
    pub(super) fn would_accept(
        &self,
        key: &Key,
        member: Option<u16>,
        frame: &CheckedFrame<'_>,
        now: Time,
    ) -> Result<(), Refusal> {
        let local = self.clock.show(now);
        match self.find(key, member) {
            Some(at) => self.heard[at].streams.would_accept(frame, key, local),
            None => Streams::default().would_accept(frame, key, local),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clock_goes_on_and_never_back() {
        let at = Time::from_millis;
        let mut clock = SigningClock::new(Timestamp::new(1_000), Timestamp::new(0), at(0));
        assert_eq!(clock.show(at(1)), Timestamp::new(1_100));
        clock.put_forward(Timestamp::new(500), at(1));
        assert_eq!(clock.show(at(1)), Timestamp::new(1_100));
        clock.put_forward(Timestamp::new(9_000), at(1));
        assert_eq!(clock.show(at(2)), Timestamp::new(9_100));
    }

    #[test]
    fn no_timestamp_is_used_twice() {
        let now = Time::from_millis(0);
        let mut clock = SigningClock::new(Timestamp::new(1_000), Timestamp::new(5_000), now);
        let used: Vec<u64> = (0..3).map(|_| clock.next(now).units()).collect();
        assert_eq!(used, [5_001, 5_002, 5_003]);
        clock.put_forward(Timestamp::new(9_000), now);
        assert_eq!((clock.next(now), clock.used()), (Timestamp::new(9_000), Timestamp::new(9_000)));
    }
}
