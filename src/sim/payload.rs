//! Payloads: filled and read field by field, at the offsets of the published definitions.

use crate::mavlink::{Component, Crc, Frame, FrameSpec, MessageId, Version, encode, trimmed};

/// The longest payload that a vehicle sends, in bytes: that of AUTOPILOT_VERSION.
const LONGEST: usize = 78;

/// Which definition a payload follows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Layout {
    pub(super) id: u32,
    pub(super) crc_extra: u8,
}

impl Layout {
    /// Whether a frame was made with this definition.
    pub(super) fn is_of(self, frame: &Frame<'_>) -> bool {
        let crc = Crc::step(Crc::of(frame.checked_bytes()), self.crc_extra);
        frame.header().id == MessageId(self.id) && crc == frame.checksum()
    }
}

/// A message that is yet to get its place in the sequence.
#[derive(Clone, Copy, Debug)]
pub(super) struct Payload {
    layout: Layout,
    len: usize,
    bytes: [u8; LONGEST],
}

impl Payload {
    /// A payload of `len` bytes, all zero.
    pub(super) const fn new(id: u32, crc_extra: u8, len: usize) -> Self {
        assert!(len <= LONGEST);
        Self { layout: Layout { id, crc_extra }, len, bytes: [0; LONGEST] }
    }

    /// The same with these bytes at `offset`; fields are little endian.
    pub(super) fn with<const N: usize>(mut self, offset: usize, field: [u8; N]) -> Self {
        debug_assert!(offset + N <= self.len);
        self.bytes[offset..][..N].copy_from_slice(&field);
        self
    }

    /// Appends the frame to `out`.
    pub(super) fn encode(&self, source: Component, seq: u8, out: &mut Vec<u8>) {
        let spec = FrameSpec {
            version: Version::V2,
            seq,
            source,
            id: MessageId(self.layout.id),
            crc_extra: self.layout.crc_extra,
            payload: trimmed(&self.bytes[..self.len]),
            signature: None,
        };
        encode(&spec, out);
    }
}

/// Reads the fields of a frame; what was cut off reads as zero (rule 10).
#[derive(Clone, Copy, Debug)]
pub(super) struct Fields<'a>(pub(super) &'a Frame<'a>);

impl Fields<'_> {
    pub(super) fn bytes<const N: usize>(self, offset: u8) -> [u8; N] {
        // Payloads end before byte 255.
        std::array::from_fn(|at| self.0.payload_byte(offset.saturating_add(at as u8)))
    }

    pub(super) fn u8(self, offset: u8) -> u8 {
        self.0.payload_byte(offset)
    }

    pub(super) fn u16(self, offset: u8) -> u16 {
        u16::from_le_bytes(self.bytes(offset))
    }

    pub(super) fn i16(self, offset: u8) -> i16 {
        i16::from_le_bytes(self.bytes(offset))
    }

    pub(super) fn u32(self, offset: u8) -> u32 {
        u32::from_le_bytes(self.bytes(offset))
    }

    pub(super) fn i32(self, offset: u8) -> i32 {
        i32::from_le_bytes(self.bytes(offset))
    }

    pub(super) fn u64(self, offset: u8) -> u64 {
        u64::from_le_bytes(self.bytes(offset))
    }

    pub(super) fn i64(self, offset: u8) -> i64 {
        i64::from_le_bytes(self.bytes(offset))
    }

    pub(super) fn f32(self, offset: u8) -> f32 {
        f32::from_le_bytes(self.bytes(offset))
    }

    /// System and component side by side.
    pub(super) fn component(self, offset: u8) -> Component {
        Component::new(self.u8(offset), self.u8(offset.saturating_add(1)))
    }
}
