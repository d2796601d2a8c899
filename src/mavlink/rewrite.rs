//! Makes a frame of another one: signed, stripped of its signature, in the other layout, with other
//! system ids.
//!
//! Forwarded frames are never changed (rule 41) but where the user asks for it, endpoint by
//! endpoint. Whatever is made here has a new checksum; the CRC_EXTRA for that follows from the old
//! one, so that frames of unknown messages can be made anew as well.

use std::fmt;

use super::crc::{Crc, implied_extra};
use super::dialect::{Definition, Dialect, Target};
use super::encode::trimmed;
use super::frame::{
    CRC, Frame, Header, INCOMPAT_SIGNED, MAX_FRAME, SIGNATURE, STX_V1, STX_V2, V1_HEADER,
    V2_HEADER, Version,
};
use super::id::Component;
use super::signing::{Key, Timestamp};
use super::splitter::CheckedFrame;

/// System ids that change places in pairs: done twice, everything is as it was.
#[derive(Clone, PartialEq, Eq)]
pub struct SystemMap([u8; 256]);

impl SystemMap {
    /// Each pair changes places; `None` if an id is 0, or is there twice.
    pub fn new(pairs: &[(u8, u8)]) -> Option<Self> {
        let mut map = [0; 256];
        for (system, to) in (0..=255).zip(&mut map) {
            *to = system;
        }
        for (a, b) in pairs {
            let is_free = |id: u8| id != 0 && map[usize::from(id)] == id;
            if a == b || !is_free(*a) || !is_free(*b) {
                return None;
            }
            (map[usize::from(*a)], map[usize::from(*b)]) = (*b, *a);
        }
        Some(Self(map))
    }

    /// What a system id becomes.
    pub fn apply(&self, system: u8) -> u8 {
        self.0[usize::from(system)]
    }

    /// Whether a frame is other by it.
    pub fn concerns(&self, frame: &CheckedFrame<'_>) -> bool {
        let is_other = |system: u8| self.apply(system) != system;
        is_other(frame.header.source.system) || is_other(frame.target.system)
    }
}

impl fmt::Debug for SystemMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let pairs = (0..=255).zip(&self.0).filter(|(system, to)| system < *to);
        f.debug_map().entries(pairs).finish()
    }
}

/// What must be known of a message in order to make a frame of it anew.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Recipe {
    /// Message id and CRC_EXTRA.
    key: (u32, u8),
    /// Its length in MAVLink 1, if it fits in there.
    base_len: Option<u8>,
    target_at: Option<u8>,
}

/// What must be known of all messages in order to make frames of them anew.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Recipes(Vec<Recipe>);

impl Recipes {
    /// By the definitions of `dialect`.
    pub fn new(dialect: &Dialect) -> Self {
        let recipe = |it: &Definition| Recipe {
            key: (it.id.0, it.crc_extra),
            base_len: u8::try_from(it.base_len).ok(),
            target_at: match it.target {
                Target::None => None,
                Target::System(at) | Target::SystemComponent(at, _) => Some(at),
            },
        };
        let mut recipes: Vec<Recipe> = dialect.definitions().iter().map(recipe).collect();
        recipes.sort_by_key(|recipe| recipe.key);
        Self(recipes)
    }

    fn of(&self, frame: &CheckedFrame<'_>) -> Option<&Recipe> {
        let extra = extra_of(&Frame::parse(frame.bytes).ok()?)?;
        let key = (frame.header.id.0, extra);
        let at = self.0.binary_search_by_key(&key, |recipe| recipe.key).ok()?;
        self.0.get(at)
    }

    /// The length of a frame's payload in MAVLink 1, if its message is known and fits in there.
    pub fn base_len(&self, frame: &CheckedFrame<'_>) -> Option<u8> {
        self.of(frame)?.base_len
    }

    /// Where in its payload a frame names the system that it is for, if it does.
    pub fn target_at(&self, frame: &CheckedFrame<'_>) -> Option<u8> {
        self.of(frame)?.target_at
    }
}

/// Room for a frame that is made of another one.
#[derive(Clone, Debug)]
pub struct FrameBuffer([u8; MAX_FRAME]);

impl Default for FrameBuffer {
    fn default() -> Self {
        Self([0; MAX_FRAME])
    }
}

/// The CRC_EXTRA that a frame was made with; `None` if its checksum is wrong.
fn extra_of(frame: &Frame<'_>) -> Option<u8> {
    implied_extra(Crc::of(frame.checked_bytes()), frame.checksum())
}

impl FrameBuffer {
    /// The frame, signed; `None` if it is MAVLink 1, or signed already (rules 54 and 56).
    pub fn sign<'a>(
        &'a mut self,
        frame: &CheckedFrame<'_>,
        key: &Key,
        link: u8,
        timestamp: Timestamp,
    ) -> Option<CheckedFrame<'a>> {
        if frame.header.version != Version::V2 || frame.header.signed {
            return None;
        }
        let old = Frame::parse(frame.bytes).ok()?;
        let extra = extra_of(&old)?;
        let end = self.copy_checked(&old);
        self.0[2] |= INCOMPAT_SIGNED;
        let signature = self.close(end, extra);
        let all = signature + SIGNATURE;
        self.0[signature] = link;
        self.0[signature + 1..signature + 7].copy_from_slice(&timestamp.to_bytes());
        let proof = key.proof(&self.0[..all - 6]);
        self.0[all - 6..all].copy_from_slice(&proof);
        self.like(frame, all)
    }

    /// The frame without its signature; `None` if it has none.
    pub fn strip<'a>(&'a mut self, frame: &CheckedFrame<'_>) -> Option<CheckedFrame<'a>> {
        if !frame.header.signed {
            return None;
        }
        let old = Frame::parse(frame.bytes).ok()?;
        let extra = extra_of(&old)?;
        let end = self.copy_checked(&old);
        self.0[2] &= !INCOMPAT_SIGNED;
        let len = self.close(end, extra);
        self.like(frame, len)
    }

    /// The frame as MAVLink 2, trailing zeros cut (rules 9 and 61); `None` if it is that already.
    pub fn upgrade<'a>(&'a mut self, frame: &CheckedFrame<'_>) -> Option<CheckedFrame<'a>> {
        if frame.header.version != Version::V1 {
            return None;
        }
        let old = Frame::parse(frame.bytes).ok()?;
        let extra = extra_of(&old)?;
        let payload = trimmed(old.payload());
        let Header { seq, source, id, .. } = frame.header;
        // At most the 255 bytes of the payload that it had.
        let len = payload.len() as u8;
        let header =
            [STX_V2, len, 0, 0, seq, source.system, source.component, id.0.to_le_bytes()[0], 0, 0];
        self.0[..V2_HEADER].copy_from_slice(&header);
        let end = V2_HEADER + payload.len();
        self.0[V2_HEADER..end].copy_from_slice(payload);
        let len = self.close(end, extra);
        self.like(frame, len)
    }

    /// The frame as MAVLink 1, with its `base_len` bytes of payload: what was cut is zero again, and
    /// extension fields and signature are lost (rule 61). `None` if it is that already, or if its id
    /// takes more than 8 bits.
    pub fn downgrade<'a>(
        &'a mut self,
        frame: &CheckedFrame<'_>,
        base_len: u8,
    ) -> Option<CheckedFrame<'a>> {
        let Header { version, seq, source, id, .. } = frame.header;
        let id = u8::try_from(id.0).ok().filter(|_| version == Version::V2)?;
        let old = Frame::parse(frame.bytes).ok()?;
        let extra = extra_of(&old)?;
        let header = [STX_V1, base_len, seq, source.system, source.component, id];
        self.0[..V1_HEADER].copy_from_slice(&header);
        let end = V1_HEADER + usize::from(base_len);
        let payload = &mut self.0[V1_HEADER..end];
        let kept = old.payload().len().min(payload.len());
        payload[..kept].copy_from_slice(&old.payload()[..kept]);
        payload[kept..].fill(0);
        let len = self.close(end, extra);
        self.like(frame, len)
    }

    /// The frame with other system ids, as its source and, at this offset of its payload, as its
    /// target; `None` if it is signed.
    pub fn remap<'a>(
        &'a mut self,
        frame: &CheckedFrame<'_>,
        map: &SystemMap,
        target_at: Option<u8>,
    ) -> Option<CheckedFrame<'a>> {
        if frame.header.signed {
            return None;
        }
        let old = Frame::parse(frame.bytes).ok()?;
        let extra = extra_of(&old)?;
        let end = self.copy_checked(&old);
        let (source, payload) = match frame.header.version {
            Version::V1 => (3, V1_HEADER),
            Version::V2 => (5, V2_HEADER),
        };
        self.0[source] = map.apply(self.0[source]);
        // What was cut off is zero, and stays that.
        if let Some(target) = target_at.filter(|at| *at < frame.header.len) {
            let target = &mut self.0[payload + usize::from(target)];
            *target = map.apply(*target);
        }
        let len = self.close(end, extra);
        let target = Component::new(map.apply(frame.target.system), frame.target.component);
        Some(CheckedFrame { target, ..self.like(frame, len)? })
    }

    /// Copies what stands under the checksum, and the start byte; says where it ends.
    fn copy_checked(&mut self, frame: &Frame<'_>) -> usize {
        let end = 1 + frame.checked_bytes().len();
        self.0[..end].copy_from_slice(&frame.bytes()[..end]);
        end
    }

    /// Puts the checksum at `end`; says where that ends.
    fn close(&mut self, end: usize, extra: u8) -> usize {
        let checksum = Crc::step(Crc::of(&self.0[1..end]), extra);
        self.0[end..end + CRC].copy_from_slice(&checksum.to_le_bytes());
        end + CRC
    }

    /// The first `len` bytes as a frame for the same target as another one.
    fn like(&self, frame: &CheckedFrame<'_>, len: usize) -> Option<CheckedFrame<'_>> {
        let bytes = &self.0[..len];
        let header = Header::parse(bytes).ok()?;
        debug_assert_eq!(header.frame_len(), len);
        Some(CheckedFrame { bytes, header, ..*frame })
    }
}

#[cfg(test)]
mod tests {
    use super::super::encode::{FrameSpec, encode};
    use super::super::id::MessageId;
    use super::super::{Checker, Verdict};
    use super::*;

    const VEHICLE: Component = Component::new(1, 1);

    fn bytes(version: Version, payload: &[u8]) -> Vec<u8> {
        let (id, crc_extra) = (MessageId::COMMAND_ACK, 143);
        let mut out = Vec::new();
        let (seq, source, signature) = (9, VEHICLE, None);
        encode(&FrameSpec { version, seq, source, id, crc_extra, payload, signature }, &mut out);
        out
    }

    fn checked(bytes: &[u8]) -> CheckedFrame<'_> {
        let header = Header::parse(bytes).unwrap();
        CheckedFrame { bytes, header, target: Component::new(255, 190), verified: true }
    }

    fn assert_whole(frame: &CheckedFrame<'_>) {
        let verdict = Checker::new(Dialect::builtin()).check(&Frame::parse(frame.bytes).unwrap());
        assert!(matches!(verdict, Verdict::Known(_)), "{verdict:?}");
        assert_eq!(frame.target, Component::new(255, 190));
    }

    #[test]
    fn a_frame_that_was_signed_and_stripped_is_the_same_again() {
        let key = Key::from_passphrase("gateway");
        let plain = bytes(Version::V2, &[1, 2, 3, 0, 0, 0, 0, 0, 255, 190]);
        let (mut first, mut second) = Default::default();
        let signed =
            FrameBuffer::sign(&mut first, &checked(&plain), &key, 7, Timestamp::new(99)).unwrap();
        assert_whole(&signed);
        assert!(signed.header.signed && key.has_signed(signed.bytes));
        let stripped = FrameBuffer::strip(&mut second, &signed).unwrap();
        assert_eq!(stripped, checked(&plain));
    }

    #[test]
    fn rule_61_an_old_frame_becomes_a_new_one_without_trailing_zeros() {
        let mut buffer = FrameBuffer::default();
        let old = bytes(Version::V1, &[1, 2, 0]);
        let new = buffer.upgrade(&checked(&old)).unwrap();
        assert_whole(&new);
        assert_eq!(new.bytes, bytes(Version::V2, &[1, 2]));
    }

    #[test]
    fn rule_61_a_new_frame_becomes_an_old_one_of_full_length() {
        let recipes = Recipes::new(&Dialect::builtin());
        let mut buffer = FrameBuffer::default();
        let new = bytes(Version::V2, &[1, 2, 3, 4, 5, 6]);
        let base_len = recipes.base_len(&checked(&new)).unwrap();
        let old = buffer.downgrade(&checked(&new), base_len).unwrap();
        assert_whole(&old);
        assert_eq!(old.bytes, bytes(Version::V1, &[1, 2, 3]), "extensions are lost");
    }

    #[test]
    fn ids_there_and_back_are_the_same_frame() {
        let map = SystemMap::new(&[(1, 7), (255, 3)]).unwrap();
        let recipes = Recipes::new(&Dialect::builtin());
        for version in [Version::V1, Version::V2] {
            let plain = bytes(version, &[1, 2, 3, 0, 0, 0, 0, 0, 255, 190]);
            let frame = checked(&plain);
            let (mut there, mut back) = <(FrameBuffer, FrameBuffer)>::default();
            let there = there.remap(&frame, &map, recipes.target_at(&frame)).unwrap();
            assert_eq!(there.header.source, Component::new(7, 1));
            assert_eq!(there.target, Component::new(3, 190));
            let start = plain.len() - 2 - 10;
            assert_eq!(there.bytes[start..plain.len() - 2], [1, 2, 3, 0, 0, 0, 0, 0, 3, 190]);
            assert_eq!(back.remap(&there, &map, recipes.target_at(&there)), Some(frame));
        }
    }

    #[test]
    fn each_id_changes_its_place_once() {
        assert!(SystemMap::new(&[(1, 7), (2, 8)]).is_some());
        for pairs in [&[(1, 1)][..], &[(0, 1)], &[(1, 0)], &[(1, 7), (7, 8)], &[(1, 7), (2, 7)]] {
            assert!(SystemMap::new(pairs).is_none(), "{pairs:?}");
        }
    }

    #[test]
    fn what_cannot_be_made_is_not_made() {
        let mut buffer = FrameBuffer::default();
        let key = Key::from_passphrase("gateway");
        let (old, mut new) = (bytes(Version::V1, &[1]), bytes(Version::V2, &[1]));
        assert!(buffer.sign(&checked(&old), &key, 1, Timestamp::new(1)).is_none());
        assert!(buffer.strip(&checked(&new)).is_none());
        assert!(buffer.upgrade(&checked(&new)).is_none());
        let checksum = new.len() - 1;
        for bit in 0..8 {
            new[checksum] ^= 1 << bit;
            // Another CRC_EXTRA may explain it; nothing panics.
            let _ = buffer.sign(&checked(&new), &key, 1, Timestamp::new(1));
        }
    }
}
