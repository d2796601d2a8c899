//! How many frames of each message came from each component: a table of fixed size, one step a frame.

use crate::mavlink::{CheckedFrame, Component, MessageId};

/// How many pairs of component and message are counted. Real systems have a few hundred.
pub const MAX_TALLIES: usize = 2_048;

/// How far from its place an entry may stand; one for which there is no room is not counted.
const REACH: usize = 8;

/// What came of a message from a component.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Tally {
    /// Who sent it.
    pub source: Component,
    /// Which message.
    pub id: MessageId,
    /// How many came; copies count as well.
    pub frames: u64,
    /// Their bytes.
    pub bytes: u64,
}

/// The table.
pub(super) struct Tallies(Box<[Entry; MAX_TALLIES]>);

#[derive(Clone, Copy, Default)]
struct Entry {
    /// [`key`]; 0: free.
    key: u64,
    frames: u64,
    bytes: u64,
}

impl Tallies {
    pub(super) fn new() -> Self {
        Self(Box::new([Entry::default(); MAX_TALLIES]))
    }

    /// Counts a frame. Only one that passed a full check makes an entry: what is made up out of
    /// noise shall not fill the table.
    #[inline]
    pub(super) fn count(&mut self, frame: &CheckedFrame<'_>) {
        let key = key(frame.header.source, frame.header.id);
        let place = place(key);
        let entry = &mut self.0[place % MAX_TALLIES];
        if entry.key == key {
            entry.frames += 1;
            entry.bytes += frame.bytes.len() as u64;
        } else {
            self.count_elsewhere(key, place, frame);
        }
    }

    #[inline(never)]
    fn count_elsewhere(&mut self, key: u64, place: usize, frame: &CheckedFrame<'_>) {
        for step in 0..REACH {
            let entry = &mut self.0[(place + step) % MAX_TALLIES];
            if entry.key == key || entry.key == 0 && frame.verified {
                entry.key = key;
                entry.frames += 1;
                entry.bytes += frame.bytes.len() as u64;
                return;
            }
        }
    }

    /// All that were counted, in no order.
    pub(super) fn iter(&self) -> impl Iterator<Item = Tally> {
        self.0.iter().filter(|entry| entry.key != 0).map(|entry| Tally {
            source: Component::new((entry.key >> 32) as u8, (entry.key >> 24) as u8),
            id: MessageId(entry.key as u32 & 0xff_ffff),
            frames: entry.frames,
            bytes: entry.bytes,
        })
    }
}

/// Source and message in one number, which is not 0.
#[inline]
fn key(source: Component, id: MessageId) -> u64 {
    let source = u64::from(source.system) << 8 | u64::from(source.component);
    1 << 40 | source << 24 | u64::from(id.0)
}

/// The upper bits of a product depend on all bits of its factors.
#[inline]
fn place(key: u64) -> usize {
    (key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (64 - MAX_TALLIES.trailing_zeros())) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mavlink::{Header, Version};

    fn frame(system: u8, id: u32, verified: bool) -> CheckedFrame<'static> {
        let source = Component::new(system, 1);
        let id = MessageId(id);
        let header = Header { version: Version::V2, len: 8, signed: false, seq: 0, source, id };
        CheckedFrame { bytes: &[0; 20], header, target: Component::new(0, 0), verified }
    }

    #[test]
    fn each_message_of_each_component_is_counted_for_itself() {
        let mut tallies = Tallies::new();
        for (system, id) in [(1, 0), (1, 30), (2, 30), (1, 30), (0, 0), (255, 0xff_ffff)] {
            tallies.count(&frame(system, id, true));
        }
        let mut all: Vec<_> =
            tallies.iter().map(|it| (it.source.system, it.id.0, it.frames, it.bytes)).collect();
        all.sort_unstable();
        let expected =
            [(0, 0, 1, 20), (1, 0, 1, 20), (1, 30, 2, 40), (2, 30, 1, 20), (255, 0xff_ffff, 1, 20)];
        assert_eq!(all, expected);
    }

    #[test]
    fn what_was_never_checked_in_full_makes_no_entry() {
        let mut tallies = Tallies::new();
        tallies.count(&frame(1, 7, false));
        assert_eq!(tallies.iter().count(), 0);
        tallies.count(&frame(1, 7, true));
        tallies.count(&frame(1, 7, false));
        assert_eq!(tallies.iter().map(|it| it.frames).sum::<u64>(), 2);
    }

    #[test]
    fn a_full_table_counts_what_it_has_and_nothing_else() {
        let mut tallies = Tallies::new();
        for id in 0..100_000 {
            tallies.count(&frame(1, id, true));
        }
        let before: Vec<Tally> = tallies.iter().collect();
        assert!(before.len() > MAX_TALLIES * 9 / 10 && before.len() <= MAX_TALLIES);
        tallies.count(&frame(1, before[0].id.0, true));
        assert_eq!(tallies.iter().next().map(|it| it.frames), Some(2));
    }
}
