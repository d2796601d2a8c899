//! Which frames pass, by message and by source: lists of what is allowed and of what is blocked.

use crate::mavlink::{Component, Header, MessageId};

/// What the user wrote: an empty list of what is allowed allows everything.
#[derive(Clone, Default, PartialEq, Eq, Debug)]
pub struct FilterLists {
    /// Only these messages pass.
    pub allow_messages: Vec<MessageId>,
    /// These messages do not.
    pub block_messages: Vec<MessageId>,
    /// Only what these systems send passes.
    pub allow_systems: Vec<u8>,
    /// What these systems send does not.
    pub block_systems: Vec<u8>,
    /// Only what components with these ids send passes, whatever their system.
    pub allow_components: Vec<u8>,
    /// What components with these ids send does not.
    pub block_components: Vec<u8>,
    /// This message of this component does not.
    pub block_single: Option<(MessageId, Component)>,
}

/// The same, made for asking once a frame.
#[derive(Clone, Debug)]
pub struct Filter {
    /// Whether there is anything to ask at all.
    is_set: bool,
    messages: MessageFilter,
    systems: ByteSet,
    components: ByteSet,
    single: Option<(MessageId, Component)>,
}

/// Bits for the ids that nearly all traffic has, and a sorted list for the others.
#[derive(Clone, Debug)]
struct MessageFilter {
    common: [u64; COMMON / 64],
    /// Whether an id that is not listed passes.
    others_pass: bool,
    /// Ids from [`COMMON`] on that are treated the other way. Invariant: sorted.
    exceptions: Vec<u32>,
}

/// Ids below this have a bit.
const COMMON: usize = 512;

/// A set of bytes.
type ByteSet = [u64; 4];

impl Filter {
    /// A filter that goes by `lists`.
    pub fn new(lists: &FilterLists) -> Self {
        Self {
            is_set: *lists != FilterLists::default(),
            messages: MessageFilter::new(&lists.allow_messages, &lists.block_messages),
            systems: byte_set(&lists.allow_systems, &lists.block_systems),
            components: byte_set(&lists.allow_components, &lists.block_components),
            single: lists.block_single,
        }
    }

    /// Whether a frame passes: allowed by every list, blocked by none.
    #[inline]
    pub fn permits(&self, header: &Header) -> bool {
        !self.is_set || self.permits_listed(header)
    }

    fn permits_listed(&self, header: &Header) -> bool {
        contains(&self.systems, header.source.system)
            && contains(&self.components, header.source.component)
            && self.messages.permits(header.id)
            && self.single != Some((header.id, header.source))
    }
}

impl MessageFilter {
    fn new(allow: &[MessageId], block: &[MessageId]) -> Self {
        let passes =
            |id: &MessageId| (allow.is_empty() || allow.contains(id)) && !block.contains(id);
        let mut common = [0; COMMON / 64];
        for id in (0..COMMON).filter(|id| passes(&MessageId(*id as u32))) {
            common[id / 64] |= 1 << (id % 64);
        }
        let others_pass = allow.is_empty();
        let listed = allow.iter().chain(block).filter(|id| id.0 as usize >= COMMON);
        let mut exceptions: Vec<u32> =
            listed.filter(|id| passes(id) != others_pass).map(|id| id.0).collect();
        exceptions.sort_unstable();
        Self { common, others_pass, exceptions }
    }

    fn permits(&self, id: MessageId) -> bool {
        let number = id.0 as usize;
        match self.common.get(number / 64) {
            Some(word) => word & (1 << (number % 64)) != 0,
            None => self.others_pass != self.exceptions.binary_search(&id.0).is_ok(),
        }
    }
}

fn byte_set(allow: &[u8], block: &[u8]) -> ByteSet {
    let mut set = [0; 4];
    let passes = |byte: &u8| (allow.is_empty() || allow.contains(byte)) && !block.contains(byte);
    for byte in (0..=255).filter(passes) {
        set[usize::from(byte / 64)] |= 1 << (byte % 64);
    }
    set
}

fn contains(set: &ByteSet, byte: u8) -> bool {
    set[usize::from(byte / 64)] & (1 << (byte % 64)) != 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mavlink::Version;

    fn header(id: u32, system: u8, component: u8) -> Header {
        let source = Component::new(system, component);
        let id = MessageId(id);
        Header { version: Version::V2, len: 0, signed: false, seq: 0, source, id }
    }

    #[test]
    fn without_lists_everything_passes() {
        let filter = Filter::new(&FilterLists::default());
        assert!(filter.permits(&header(0, 1, 1)));
        assert!(filter.permits(&header(0xff_ffff, 0, 0)));
    }

    #[test]
    fn only_what_is_allowed_passes_and_what_is_blocked_does_not() {
        let ids = |ids: &[u32]| ids.iter().map(|id| MessageId(*id)).collect();
        let filter = Filter::new(&FilterLists {
            allow_messages: ids(&[0, 511, 512, 12_000]),
            block_messages: ids(&[512, 30]),
            ..FilterLists::default()
        });
        let passing = [0, 1, 30, 511, 512, 513, 12_000, 12_001];
        let passed = passing.iter().filter(|id| filter.permits(&header(**id, 1, 1)));
        assert_eq!(passed.collect::<Vec<_>>(), [&0, &511, &12_000]);
    }

    #[test]
    fn a_block_list_alone_lets_all_others_pass() {
        let block_messages = vec![MessageId(27), MessageId(12_000)];
        let filter = Filter::new(&FilterLists { block_messages, ..FilterLists::default() });
        let passes = [0, 27, 12_000, 12_001].map(|id| filter.permits(&header(id, 1, 1)));
        assert_eq!(passes, [true, false, false, true]);
    }

    #[test]
    fn one_message_of_one_component_is_blocked() {
        let block_single = Some((MessageId(0), Component::new(1, 191)));
        let filter = Filter::new(&FilterLists { block_single, ..FilterLists::default() });
        let passes = [(0, 1, 191), (4, 1, 191), (0, 1, 1), (0, 2, 191)]
            .map(|(id, system, component)| filter.permits(&header(id, system, component)));
        assert_eq!(passes, [false, true, true, true]);
    }

    #[test]
    fn systems_and_components_are_told_apart() {
        let filter = Filter::new(&FilterLists {
            allow_systems: vec![1, 2],
            block_components: vec![154],
            ..FilterLists::default()
        });
        let passes = [(1, 1), (2, 154), (3, 1), (255, 190)]
            .map(|(system, component)| filter.permits(&header(0, system, component)));
        assert_eq!(passes, [true, false, false, false]);
    }
}
