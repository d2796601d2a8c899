//! Payloads: filled and read field by field, at the offsets of the published definitions. For what
//! this program itself says and understands.

use super::crc::Crc;
use super::encode::{FrameSpec, encode, trimmed};
use super::frame::Frame;
use super::id::{Component, MessageId};

/// The longest payload that is said here, in bytes: that of AUTOPILOT_VERSION.
const LONGEST: usize = 78;

/// Which definition a payload follows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Layout {
    /// The message id.
    pub id: MessageId,
    /// With the id, what tells this definition from all others (rule 16).
    pub crc_extra: u8,
}

impl Layout {
    /// The definition with this message id and CRC_EXTRA.
    pub const fn new(id: u32, crc_extra: u8) -> Self {
        Self { id: MessageId(id), crc_extra }
    }

    /// Whether a frame was made with this definition.
    pub fn is_of(self, frame: &Frame<'_>) -> bool {
        let crc = Crc::step(Crc::of(frame.checked_bytes()), self.crc_extra);
        frame.header().id == self.id && crc == frame.checksum()
    }
}

/// A message that is yet to get its place in the sequence.
#[derive(Clone, Copy, Debug)]
pub struct Payload {
    layout: Layout,
    len: usize,
    bytes: [u8; LONGEST],
}

impl Payload {
    /// A payload of `len` bytes, all zero.
    ///
    /// # Panics
    ///
    /// With more than 78 bytes.
    pub const fn new(layout: Layout, len: usize) -> Self {
        assert!(len <= LONGEST);
        Self { layout, len, bytes: [0; LONGEST] }
    }

    /// The same with these bytes at `offset`; fields are little endian.
    ///
    /// # Panics
    ///
    /// If they do not end within the payload.
    pub fn with<const N: usize>(mut self, offset: usize, field: [u8; N]) -> Self {
        self.bytes[..self.len][offset..][..N].copy_from_slice(&field);
        self
    }

    /// Appends the frame to `out`.
    pub fn encode(&self, source: Component, seq: u8, out: &mut Vec<u8>) {
        let Layout { id, crc_extra } = self.layout;
        let payload = trimmed(&self.bytes[..self.len]);
        encode(&FrameSpec { seq, ..FrameSpec::new(source, id, crc_extra, payload) }, out);
    }
}

/// Reads the fields of a frame; what was cut off reads as zero (rule 10).
#[derive(Clone, Copy, Debug)]
pub struct Fields<'a>(pub &'a Frame<'a>);

impl Fields<'_> {
    /// So many bytes at `offset`.
    pub fn bytes<const N: usize>(self, offset: u8) -> [u8; N] {
        // Payloads end before byte 255.
        std::array::from_fn(|at| self.0.payload_byte(offset.saturating_add(at as u8)))
    }

    /// The u8 at `offset`.
    pub fn u8(self, offset: u8) -> u8 {
        self.0.payload_byte(offset)
    }

    /// The u16 at `offset`.
    pub fn u16(self, offset: u8) -> u16 {
        u16::from_le_bytes(self.bytes(offset))
    }

    /// The i16 at `offset`.
    pub fn i16(self, offset: u8) -> i16 {
        i16::from_le_bytes(self.bytes(offset))
    }

    /// The u32 at `offset`.
    pub fn u32(self, offset: u8) -> u32 {
        u32::from_le_bytes(self.bytes(offset))
    }

    /// The i32 at `offset`.
    pub fn i32(self, offset: u8) -> i32 {
        i32::from_le_bytes(self.bytes(offset))
    }

    /// The u64 at `offset`.
    pub fn u64(self, offset: u8) -> u64 {
        u64::from_le_bytes(self.bytes(offset))
    }

    /// The i64 at `offset`.
    pub fn i64(self, offset: u8) -> i64 {
        i64::from_le_bytes(self.bytes(offset))
    }

    /// The f32 at `offset`.
    pub fn f32(self, offset: u8) -> f32 {
        f32::from_le_bytes(self.bytes(offset))
    }

    /// System and component side by side.
    pub fn component(self, offset: u8) -> Component {
        Component::new(self.u8(offset), self.u8(offset.saturating_add(1)))
    }
}
