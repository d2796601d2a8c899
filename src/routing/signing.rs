//! What the router knows of signing: the time that it signs with, the streams that it has heard
//! with each key, and whom the log was told of.

use super::link_set::LinkId;
use super::reminder::Reminder;
use super::router::Router;
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
    /// One for each key and member that is configured, at the place that its gates know it by.
    heard: Vec<Option<Heard>>,
    /// Whose refused frames the log was told of.
    pub(super) told: Reminder<(LinkId, Component)>,
    /// Whether the frame that is being routed was verified where it came in.
    pub(super) is_believed: bool,
}

/// The number of the streams of a key.
#[derive(Clone, Copy, Debug)]
pub(super) struct HeardId(usize);

impl Signing {
    /// The streams of a key, made if they are not there.
    pub(super) fn streams_of(&mut self, key: &Key, member: Option<u16>) -> HeardId {
        if let Some(known) = self.find(key, member) {
            return HeardId(known);
        }
        let new = Some(Heard { key: key.clone(), member, streams: Streams::default() });
        let free = self.heard.iter().position(Option::is_none);
        let at = free.unwrap_or(self.heard.len());
        if at == self.heard.len() {
            self.heard.push(None);
        }
        self.heard[at] = new;
        HeardId(at)
    }

    /// Forgets the keys that nobody has any use for, with what was heard by them: the last copy of a
    /// key may be here.
    pub(super) fn forget_keys(&mut self, is_used: impl Fn(&Key) -> bool) {
        for place in &mut self.heard {
            if place.as_ref().is_some_and(|heard| !is_used(&heard.key)) {
                *place = None;
            }
        }
    }

    fn find(&self, key: &Key, member: Option<u16>) -> Option<usize> {
        let is_it = |heard: &Heard| heard.member == member && heard.key == *key;
        self.heard.iter().position(|place| place.as_ref().is_some_and(is_it))
    }

    /// Believes a frame, or says why not.
    pub(super) fn accept(
        &mut self,
        id: HeardId,
        frame: &CheckedFrame<'_>,
        now: Time,
    ) -> Result<(), Refusal> {
        // A key is forgotten only when no gate has it any more.
        let Some(Some(heard)) = self.heard.get_mut(id.0) else {
            return Err(Refusal::WrongSignature);
        };
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
        let known = self.find(key, member).and_then(|at| self.heard[at].as_ref());
        match known {
            Some(heard) => heard.streams.would_accept(frame, key, local),
            None => Streams::EMPTY.would_accept(frame, key, local),
        }
    }
}

impl Router {
    /// Forgets the keys that no link has and that are not used otherwise, with what was heard by them.
    pub fn forget_keys(&mut self, is_used: impl Fn(&Key) -> bool) {
        let ports = &self.ports;
        let of_link = |key: &Key| {
            let mut gates = ports.iter().flatten().filter_map(|port| port.gate.as_deref());
            gates.any(|gate| gate.options.verify_key() == Some(key))
        };
        self.signing.forget_keys(|key| is_used(key) || of_link(key));
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
    fn a_key_that_nobody_uses_is_forgotten_and_the_others_keep_their_places() {
        let mut signing = Signing::default();
        let [old, kept, new] = ["old", "kept", "new"].map(Key::from_passphrase);
        let place = |signing: &mut Signing, key, member| signing.streams_of(key, member).0;
        assert_eq!(place(&mut signing, &old, None), 0);
        assert_eq!(place(&mut signing, &kept, None), 1);
        assert_eq!(place(&mut signing, &old, Some(1)), 2);
        signing.forget_keys(|key| *key == kept);
        assert!(signing.heard[0].is_none() && signing.heard[2].is_none());
        assert_eq!(place(&mut signing, &kept, None), 1);
        for (n, rotated) in (0..100).map(|n| (n, Key::from_passphrase(&n.to_string()))) {
            signing.streams_of(&rotated, None);
            assert_eq!(signing.heard.len(), 3, "after {n}");
            signing.forget_keys(|key| *key == kept);
        }
        assert_eq!(place(&mut signing, &new, None), 0);
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
