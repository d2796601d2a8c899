//! Makes a frame of another one: signed, stripped of its signature, in the other layout.
//!
//! Forwarded frames are never changed (rule 41) but where the user asks for it, endpoint by
//! endpoint. Whatever is made here has a new checksum; the CRC_EXTRA for that follows from the old
//! one, so that frames of unknown messages can be made anew as well.

use super::crc::{Crc, implied_extra};
use super::encode::trimmed;
use super::frame::{
    CRC, Frame, Header, INCOMPAT_SIGNED, MAX_FRAME, SIGNATURE, STX_V2, V2_HEADER, Version,
};
use super::signing::{Key, Timestamp};
use super::splitter::CheckedFrame;

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
    use super::super::id::{Component, MessageId};
    use super::super::{Checker, Dialect, Verdict};
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
