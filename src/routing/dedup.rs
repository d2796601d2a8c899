//! Knows frames that came before over another link (rules 49 and 50).

use std::hash::{BuildHasher, RandomState};
use std::time::Duration;

use super::link_set::LinkId;
use super::time::Time;

/// The frames of the last seconds, by a hash of all their bytes.
///
/// The sequence number is among the bytes, so a frame comes again only when its sender has sent 256
/// others, or when it has come by another way.
#[derive(Debug)]
pub(super) struct Dedup {
    /// Keyed by chance, so that nobody can make up a frame that passes for a copy of another.
    hasher: RandomState,
    /// By the low bits of the hash; empty until the first frame.
    buckets: Vec<[Option<Seen>; WAYS]>,
}

#[derive(Clone, Copy, Debug)]
struct Seen {
    hash: u64,
    link: LinkId,
    at: Time,
}

/// Which frames are copies.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum CopyFrom {
    /// Those that came over another link: the same one may say a thing twice.
    OtherLinks,
    /// Those that came over the same link: what goes round a ring comes in by the same way again.
    SameLink,
}

/// How many frames are remembered: in each bucket the last ones with the same low bits.
const BUCKETS: usize = 1_024;
const WAYS: usize = 8;

impl Dedup {
    /// A memory of nothing.
    pub(super) fn new() -> Self {
        Self { hasher: RandomState::new(), buckets: Vec::new() }
    }

    /// Whether the frame has come within the `window` already. If not, it is remembered.
    pub(super) fn is_copy(
        &mut self,
        bytes: &[u8],
        link: LinkId,
        from: CopyFrom,
        window: Duration,
        now: Time,
    ) -> bool {
        let hash = self.hasher.hash_one(bytes);
        if self.buckets.is_empty() {
            self.buckets = vec![[None; WAYS]; BUCKETS];
        }
        let bucket = &mut self.buckets[hash as usize % BUCKETS];
        let known = bucket.iter_mut().find(|seen| seen.is_some_and(|seen| seen.hash == hash));
        let is_copy = |seen: &Seen| {
            let is_same = seen.link == link;
            is_same == (from == CopyFrom::SameLink) && now.since(seen.at) < window
        };
        let place = match known {
            Some(Some(seen)) if is_copy(seen) => return true,
            Some(place) => place,
            None => oldest(bucket),
        };
        *place = Some(Seen { hash, link, at: now });
        false
    }
}

/// The place of a bucket that is free, or was filled first.
fn oldest(bucket: &mut [Option<Seen>; WAYS]) -> &mut Option<Seen> {
    let at = (0..WAYS).min_by_key(|at| bucket[*at].map(|seen| seen.at)).unwrap_or(0);
    &mut bucket[at]
}

impl Default for Dedup {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: Duration = Duration::from_millis(200);

    fn links() -> (LinkId, LinkId) {
        (LinkId::new(1).unwrap(), LinkId::new(2).unwrap())
    }

    #[test]
    fn rule_49_a_copy_by_another_link_within_the_window_is_known() {
        let (radio, modem) = links();
        let mut dedup = Dedup::new();
        let at = Time::from_millis;
        assert!(!dedup.is_copy(b"frame", radio, CopyFrom::OtherLinks, WINDOW, at(1_000)));
        assert!(dedup.is_copy(b"frame", modem, CopyFrom::OtherLinks, WINDOW, at(1_199)));
        assert!(
            !dedup.is_copy(b"frame", modem, CopyFrom::OtherLinks, WINDOW, at(1_200)),
            "too late to be a copy"
        );
    }

    #[test]
    fn a_repetition_on_the_same_link_is_no_copy() {
        let (radio, _) = links();
        let mut dedup = Dedup::new();
        for _ in 0..3 {
            assert!(!dedup.is_copy(b"frame", radio, CopyFrom::OtherLinks, WINDOW, Time::ZERO));
        }
    }

    #[test]
    fn frames_that_differ_in_one_bit_differ() {
        let (radio, modem) = links();
        let mut dedup = Dedup::new();
        for len in 1..64 {
            for bit in 0..len * 8 {
                let mut bytes = vec![0x55; len];
                dedup.is_copy(&bytes, radio, CopyFrom::OtherLinks, WINDOW, Time::ZERO);
                bytes[bit / 8] ^= 1 << (bit % 8);
                assert!(
                    !dedup.is_copy(&bytes, modem, CopyFrom::OtherLinks, WINDOW, Time::ZERO),
                    "{len}, bit {bit}"
                );
            }
        }
    }
}
