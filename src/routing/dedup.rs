//! Knows frames that came before over another link (rules 49 and 50).

use std::hash::{BuildHasher, RandomState};
use std::time::Duration;

use super::link_set::LinkId;
use super::time::Time;

/// The frames of the last second, by a hash of all their bytes.
///
/// The sequence number is among the bytes, so a frame comes again only when its sender has sent 256
/// others, or when it has come by another way.
#[derive(Debug)]
pub(super) struct Dedup {
    /// Keyed by chance, so that nobody can make up a frame that passes for a copy of another.
    hasher: RandomState,
    /// By the low bits of the hash; empty until the first frame.
    slots: Vec<Option<Slot>>,
}

#[derive(Clone, Copy, Debug)]
struct Slot {
    hash: u64,
    link: LinkId,
    at: Time,
}

/// How many frames are remembered; one takes the place of another with the same low bits.
const SLOTS: usize = 8_192;

impl Dedup {
    /// A memory of nothing.
    pub(super) fn new() -> Self {
        Self { hasher: RandomState::new(), slots: Vec::new() }
    }

    /// Whether the frame came over another link within the `window`. If not, it is remembered.
    ///
    /// The same link may say a thing twice: that is no copy.
    pub(super) fn is_copy(
        &mut self,
        bytes: &[u8],
        link: LinkId,
        window: Duration,
        now: Time,
    ) -> bool {
        let hash = self.hasher.hash_one(bytes);
        if self.slots.is_empty() {
            self.slots = vec![None; SLOTS];
        }
        let slot = &mut self.slots[hash as usize % SLOTS];
        let is_copy =
            |seen: &Slot| seen.hash == hash && seen.link != link && now.since(seen.at) < window;
        if slot.as_ref().is_some_and(is_copy) {
            return true;
        }
        *slot = Some(Slot { hash, link, at: now });
        false
    }
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
        assert!(!dedup.is_copy(b"frame", radio, WINDOW, at(1_000)));
        assert!(dedup.is_copy(b"frame", modem, WINDOW, at(1_199)));
        assert!(!dedup.is_copy(b"frame", modem, WINDOW, at(1_200)), "too late to be a copy");
    }

    #[test]
    fn a_repetition_on_the_same_link_is_no_copy() {
        let (radio, _) = links();
        let mut dedup = Dedup::new();
        for _ in 0..3 {
            assert!(!dedup.is_copy(b"frame", radio, WINDOW, Time::ZERO));
        }
    }

    #[test]
    fn frames_that_differ_in_one_bit_differ() {
        let (radio, modem) = links();
        let mut dedup = Dedup::new();
        for len in 1..64 {
            for bit in 0..len * 8 {
                let mut bytes = vec![0x55; len];
                dedup.is_copy(&bytes, radio, WINDOW, Time::ZERO);
                bytes[bit / 8] ^= 1 << (bit % 8);
                assert!(!dedup.is_copy(&bytes, modem, WINDOW, Time::ZERO), "{len}, bit {bit}");
            }
        }
    }
}
