//! Remembers the frames of the last seconds: over which link each came first (rules 49 and 50).

use std::hash::BuildHasher;
use std::time::Duration;

use foldhash::quality::RandomState;

use super::link_set::LinkId;
use super::time::Time;

/// The last frames, by a hash of all their bytes.
///
/// The sequence number is among the bytes, so a frame comes again only when its sender has sent 256
/// others, when its sender counts nothing, or when it has come by another way.
#[derive(Debug)]
pub(super) struct Dedup {
    /// Keyed by chance, so that nobody can make up a frame that passes for a copy of another.
    hasher: RandomState,
    /// By the low bits of the hash; empty until the first frame.
    buckets: Vec<Bucket>,
}

/// A frame that is remembered.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// The high bits of its hash; 0: nothing is remembered here.
    tag: u32,
    /// In milliseconds. It turns over after 49 days, which nothing stays for that has a successor.
    at: u32,
    /// Over which link it came first: that number, in that life.
    link: LinkId,
    life: u8,
    /// Whether the first link is on probation, and whether it has come again since.
    flags: u8,
}

/// A link for as long as it lives: its number is given again when it is gone.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Origin {
    pub(super) link: LinkId,
    /// Differs from that of the link that had the number before.
    pub(super) life: u8,
}

/// In `Seen::flags`.
const PROBATION: u8 = 1;
const NOTED: u8 = 2;

/// What fits into a line of the processor's cache; the oldest makes room.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Bucket {
    seen: [Seen; WAYS],
    /// Where the next one goes.
    next: u32,
}

/// In each bucket are the last ones with the same low bits.
const BUCKETS: usize = 4_096;
const WAYS: usize = 5;

/// How many frames are remembered in all.
pub const REMEMBERED: usize = BUCKETS * WAYS;

const _: () = assert!(size_of::<Bucket>() == 64);

impl Dedup {
    /// A memory of nothing.
    pub(super) fn new() -> Self {
        Self { hasher: RandomState::default(), buckets: Vec::new() }
    }

    /// What is remembered of a frame. If nothing is, it is remembered from now on.
    #[inline]
    pub(super) fn recall(&mut self, bytes: &[u8], from: Origin, now: Time) -> Option<&mut Seen> {
        let hash = self.hasher.hash_one(bytes);
        if self.buckets.is_empty() {
            self.buckets = vec![Bucket::EMPTY; BUCKETS];
        }
        let bucket = &mut self.buckets[hash as usize % BUCKETS];
        let tag = (hash >> 32) as u32 | 1;
        if let Some(place) = bucket.seen.iter().position(|seen| seen.tag == tag) {
            return Some(&mut bucket.seen[place]);
        }
        let place = bucket.next as usize % WAYS;
        bucket.next = place as u32 + 1;
        let Origin { link, life } = from;
        bucket.seen[place] = Seen { tag, at: millis(now), link, life, flags: 0 };
        None
    }
}

impl Bucket {
    const EMPTY: Self = {
        let nothing = Seen { tag: 0, at: 0, link: LinkId::ZERO, life: 0, flags: 0 };
        Self { seen: [nothing; WAYS], next: 0 }
    };
}

impl Seen {
    /// Over which link it came first.
    pub(super) fn first(&self) -> Origin {
        Origin { link: self.link, life: self.life }
    }

    /// How long ago it came over that link.
    pub(super) fn age(&self, now: Time) -> Duration {
        Duration::from_millis(millis(now).wrapping_sub(self.at).into())
    }

    /// It has come over this link now as if it had never come before.
    pub(super) fn renew(&mut self, from: Origin, now: Time) {
        (self.link, self.life) = (from.link, from.life);
        (self.at, self.flags) = (millis(now), 0);
    }

    /// This link takes the place of the one that was first, on probation: it may have gone round.
    pub(super) fn take_over(&mut self, from: Origin, now: Time) {
        self.renew(from, now);
        self.flags = PROBATION;
    }

    /// Whether the first link has taken the place of another.
    pub(super) fn is_on_probation(&self) -> bool {
        self.flags & PROBATION != 0
    }

    /// Whether it has come again on probation, and was dropped for that.
    pub(super) fn was_noted(&self) -> bool {
        self.flags & NOTED != 0
    }

    /// It has come again on probation, and is dropped.
    pub(super) fn note(&mut self) {
        self.flags |= NOTED;
    }
}

fn millis(time: Time) -> u32 {
    (time.as_micros() / 1_000) as u32
}

impl Default for Dedup {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn links() -> [Origin; 2] {
        [1, 2].map(|link| Origin { link: LinkId::new(link).unwrap(), life: 0 })
    }

    #[test]
    fn a_frame_is_known_with_its_first_link_and_its_age() {
        let [radio, modem] = links();
        let mut dedup = Dedup::new();
        let at = Time::from_millis;
        assert!(dedup.recall(b"frame", radio, at(1_000)).is_none());
        let seen = dedup.recall(b"frame", modem, at(1_199)).unwrap();
        assert_eq!((seen.first(), seen.age(at(1_199)).as_millis()), (radio, 199));
        seen.renew(modem, at(1_500));
        let seen = dedup.recall(b"frame", radio, at(1_501)).unwrap();
        assert_eq!((seen.first(), seen.age(at(1_501)).as_millis()), (modem, 1));
    }

    #[test]
    fn who_takes_the_place_of_the_first_is_on_probation_until_it_is_renewed() {
        let [radio, modem] = links();
        let mut dedup = Dedup::new();
        dedup.recall(b"frame", radio, Time::ZERO);
        let seen = dedup.recall(b"frame", modem, Time::ZERO).unwrap();
        assert!(!seen.is_on_probation());
        seen.take_over(modem, Time::ZERO);
        assert_eq!((seen.first(), seen.is_on_probation(), seen.was_noted()), (modem, true, false));
        seen.note();
        assert_eq!((seen.is_on_probation(), seen.was_noted()), (true, true));
        seen.renew(modem, Time::ZERO);
        assert_eq!((seen.is_on_probation(), seen.was_noted()), (false, false));
    }

    #[test]
    fn frames_that_differ_in_one_bit_differ() {
        let [radio, modem] = links();
        let mut dedup = Dedup::new();
        for len in 1..64 {
            for bit in 0..len * 8 {
                let mut bytes = vec![0x55; len];
                dedup.recall(&bytes, radio, Time::ZERO);
                bytes[bit / 8] ^= 1 << (bit % 8);
                let known = dedup.recall(&bytes, modem, Time::ZERO);
                assert!(known.is_none_or(|seen| seen.first() == modem), "{len}, bit {bit}");
                bytes[0] ^= 0xff;
            }
        }
    }

    #[test]
    fn the_last_thousands_are_remembered_and_no_more() {
        let [radio, _] = links();
        let mut dedup = Dedup::new();
        let mut known = |from: u32, to: u32| {
            let frames = (from..to).map(u32::to_le_bytes);
            frames.filter(|bytes| dedup.recall(bytes, radio, Time::ZERO).is_some()).count()
        };
        assert_eq!(known(0, 1_000), 0);
        assert!(known(0, 1_000) >= 999, "a thousand");
        assert_eq!(known(1_000, 200_000), 0);
        assert_eq!(known(0, 1_000), 0, "long ago");
    }
}
