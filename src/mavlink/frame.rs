//! One frame, MAVLink 1 or 2: its layout, and a view of its bytes that cannot panic.

use super::id::{Component, MessageId};

/// The first byte of a MAVLink 1 frame (rule 1).
pub const STX_V1: u8 = 0xfe;
/// The first byte of a MAVLink 2 frame (rule 1).
pub const STX_V2: u8 = 0xfd;
/// The longest frame: MAVLink 2 with 255 bytes of payload and a signature (rule 3).
pub const MAX_FRAME: usize = V2_HEADER + 255 + CRC + SIGNATURE;

pub(super) const V1_HEADER: usize = 6;
pub(super) const V2_HEADER: usize = 10;
pub(super) const CRC: usize = 2;
/// Bytes behind the checksum of a signed frame (rule 54).
pub const SIGNATURE: usize = 13;

/// The one incompatibility flag there is: the frame ends with a signature (rule 7).
pub(super) const INCOMPAT_SIGNED: u8 = 0x01;

/// Which of the two frame layouts.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Version {
    /// MAVLink 1: 8-bit message ids, 8..=263 bytes.
    V1,
    /// MAVLink 2: 24-bit message ids, 12..=280 bytes.
    V2,
}

/// What the header of a frame says.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Header {
    /// The layout.
    pub version: Version,
    /// Payload length in bytes.
    pub len: u8,
    /// Whether 13 bytes of signature follow the checksum (rule 54).
    pub signed: bool,
    /// The sender's counter: plus one a frame, per component and channel (rule 51).
    pub seq: u8,
    /// Who made the frame.
    pub source: Component,
    /// What it is.
    pub id: MessageId,
}

/// Why bytes are no frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FrameError {
    /// The first byte opens no frame.
    NoStart,
    /// It may become one: more bytes are needed.
    Incomplete,
    /// An incompatibility flag that this program does not know: its layout cannot be known (rule 7).
    Incompatible,
}

impl Header {
    /// Reads the header at the start of `bytes` (rules 2, 3 and 7).
    ///
    /// # Errors
    ///
    /// See [`FrameError`].
    pub fn parse(bytes: &[u8]) -> Result<Self, FrameError> {
        match *bytes {
            [STX_V1, len, seq, system, component, id, ..] => Ok(Self {
                version: Version::V1,
                len,
                signed: false,
                seq,
                source: Component::new(system, component),
                id: MessageId(u32::from(id)),
            }),
            [STX_V2, len, incompat, _, seq, system, component, a, b, c, ..] => {
                if incompat & !INCOMPAT_SIGNED != 0 {
                    return Err(FrameError::Incompatible);
                }
                Ok(Self {
                    version: Version::V2,
                    len,
                    signed: incompat & INCOMPAT_SIGNED != 0,
                    seq,
                    source: Component::new(system, component),
                    id: MessageId(u32::from_le_bytes([a, b, c, 0])),
                })
            }
            // Told as early as it is known, so that a false start holds back as little as it can.
            [STX_V2, _, incompat, ..] if incompat & !INCOMPAT_SIGNED != 0 => {
                Err(FrameError::Incompatible)
            }
            [] | [STX_V1 | STX_V2, ..] => Err(FrameError::Incomplete),
            _ => Err(FrameError::NoStart),
        }
    }

    /// The length of the whole frame in bytes, 8..=280.
    pub fn frame_len(&self) -> usize {
        let signature = if self.signed { SIGNATURE } else { 0 };
        self.payload_start() + usize::from(self.len) + CRC + signature
    }

    fn payload_start(&self) -> usize {
        match self.version {
            Version::V1 => V1_HEADER,
            Version::V2 => V2_HEADER,
        }
    }
}

/// A view of exactly one frame. Its checksum may be wrong; its length is right.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Frame<'a> {
    header: Header,
    /// Invariant: `header.frame_len()` long.
    bytes: &'a [u8],
}

impl<'a> Frame<'a> {
    /// The frame at the start of `bytes`; what stands behind it does not matter.
    ///
    /// # Errors
    ///
    /// See [`FrameError`].
    pub fn parse(bytes: &'a [u8]) -> Result<Self, FrameError> {
        let header = Header::parse(bytes)?;
        let bytes = bytes.get(..header.frame_len()).ok_or(FrameError::Incomplete)?;
        Ok(Self { header, bytes })
    }

    /// What the header says.
    pub fn header(&self) -> Header {
        self.header
    }

    /// The frame as received, start byte to the last.
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// The payload as received, trailing zeros cut or not (rule 9).
    pub fn payload(&self) -> &'a [u8] {
        &self.bytes[self.header.payload_start()..self.checksum_start()]
    }

    /// The payload byte at `offset`; what was cut from the end reads as zero (rule 10).
    pub fn payload_byte(&self, offset: u8) -> u8 {
        if offset < self.header.len {
            self.bytes[self.header.payload_start() + usize::from(offset)]
        } else {
            0
        }
    }

    /// Everything under the checksum but CRC_EXTRA: header without start byte, and payload.
    pub fn checked_bytes(&self) -> &'a [u8] {
        &self.bytes[1..self.checksum_start()]
    }

    /// The checksum as received.
    pub fn checksum(&self) -> u16 {
        let at = self.checksum_start();
        u16::from_le_bytes([self.bytes[at], self.bytes[at + 1]])
    }

    fn checksum_start(&self) -> usize {
        self.header.payload_start() + usize::from(self.header.len)
    }
}

/// The length of the frame whose header begins with these three bytes, without another look.
///
/// For bytes that are known to begin a frame, as those of a transmit queue are.
pub fn frame_len_of(start: u8, len: u8, incompat: u8) -> usize {
    match start {
        STX_V1 => V1_HEADER + usize::from(len) + CRC,
        _ if incompat & INCOMPAT_SIGNED != 0 => V2_HEADER + usize::from(len) + CRC + SIGNATURE,
        _ => V2_HEADER + usize::from(len) + CRC,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_2_and_3_the_lengths_of_frames() {
        let v1 = Header::parse(&[STX_V1, 0, 7, 1, 2, 3]).unwrap();
        assert_eq!(v1.frame_len(), 8);
        let v2 = Header::parse(&[STX_V2, 255, 1, 0, 7, 1, 2, 3, 0, 1]).unwrap();
        assert_eq!(v2.frame_len(), MAX_FRAME);
        assert_eq!(v2.id, MessageId(0x01_0003));
        assert_eq!(v2.source, Component::new(1, 2));
        for (header, incompat) in [(v1, 0), (v2, 1)] {
            let start = if header.version == Version::V1 { STX_V1 } else { STX_V2 };
            assert_eq!(frame_len_of(start, header.len, incompat), header.frame_len());
        }
    }

    #[test]
    fn rule_7_an_unknown_incompatibility_flag_is_told_at_once() {
        assert_eq!(Header::parse(&[STX_V2, 9, 2]), Err(FrameError::Incompatible));
        assert_eq!(Header::parse(&[STX_V2, 9, 1]), Err(FrameError::Incomplete));
    }

    #[test]
    fn any_bytes_are_parsed_without_panic() {
        for start in [STX_V1, STX_V2, 0x55] {
            for filled in 0..MAX_FRAME {
                let bytes = vec![start; filled];
                if let Ok(frame) = Frame::parse(&bytes) {
                    let _ = (frame.payload(), frame.checksum(), frame.checked_bytes());
                }
            }
        }
    }
}
