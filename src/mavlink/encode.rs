//! Makes frames: for what this program itself has to say, and for the tests of all the rest.

use super::crc::Crc;
use super::frame::{STX_V1, STX_V2, Version};
use super::id::{Component, MessageId};

/// What a new frame is to say.
#[derive(Clone, Copy, Debug)]
pub struct FrameSpec<'a> {
    /// The layout; MAVLink 1 has no ids above 255, no flags and no signature.
    pub version: Version,
    /// The sender's counter.
    pub seq: u8,
    /// The sender.
    pub source: Component,
    /// The message id.
    pub id: MessageId,
    /// The CRC_EXTRA of the message's definition.
    pub crc_extra: u8,
    /// The payload as it shall stand in the frame, at most 255 bytes; see [`trimmed`].
    pub payload: &'a [u8],
    /// The 13 bytes behind the checksum of a signed frame.
    pub signature: Option<[u8; 13]>,
}

impl<'a> FrameSpec<'a> {
    /// A MAVLink 2 frame without a signature, the first of its sender.
    pub fn new(source: Component, id: MessageId, crc_extra: u8, payload: &'a [u8]) -> Self {
        let (version, seq, signature) = (Version::V2, 0, None);
        Self { version, seq, source, id, crc_extra, payload, signature }
    }

    /// The frame by itself.
    ///
    /// # Panics
    ///
    /// As [`encode`].
    pub fn to_frame(&self) -> Vec<u8> {
        let mut frame = Vec::new();
        encode(self, &mut frame);
        frame
    }
}

/// Appends the frame to `out`.
///
/// # Panics
///
/// With a payload of more than 255 bytes.
pub fn encode(spec: &FrameSpec<'_>, out: &mut Vec<u8>) {
    let start = out.len();
    let len = u8::try_from(spec.payload.len()).expect("a payload has at most 255 bytes");
    let Component { system, component } = spec.source;
    let [a, b, c, _] = spec.id.0.to_le_bytes();
    match spec.version {
        Version::V1 => out.extend([STX_V1, len, spec.seq, system, component, a]),
        Version::V2 => {
            let incompat = u8::from(spec.signature.is_some());
            out.extend([STX_V2, len, incompat, 0, spec.seq, system, component, a, b, c]);
        }
    }
    out.extend_from_slice(spec.payload);
    let checksum = Crc::step(Crc::of(&out[start + 1..]), spec.crc_extra);
    out.extend(checksum.to_le_bytes());
    if let (Version::V2, Some(signature)) = (spec.version, spec.signature) {
        out.extend(signature);
    }
}

/// `payload` without its trailing zeros, but always with its first byte (rule 9).
pub fn trimmed(payload: &[u8]) -> &[u8] {
    let end = payload.iter().rposition(|byte| *byte != 0).map_or(1, |last| last + 1);
    &payload[..end.min(payload.len())]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heartbeat_comes_out_as_pymavlink_makes_it() {
        let mut out = Vec::new();
        let mut spec = FrameSpec {
            version: Version::V1,
            seq: 7,
            source: Component::new(255, 190),
            id: MessageId::HEARTBEAT,
            crc_extra: 50,
            payload: &[0, 0, 0, 0, 6, 8, 0, 4, 3],
            signature: None,
        };
        encode(&spec, &mut out);
        spec.version = Version::V2;
        encode(&spec, &mut out);
        let hex: String = out.iter().map(|byte| format!("{byte:02x}")).collect();
        let v1 = "fe0907ffbe00000000000608000403ce51";
        let v2 = "fd09000007ffbe0000000000000006080004037efa";
        assert_eq!(hex, format!("{v1}{v2}"));
    }

    #[test]
    fn rule_9_the_first_byte_is_never_trimmed() {
        assert_eq!(trimmed(&[0, 0, 0]), [0]);
        assert_eq!(trimmed(&[1, 0, 2, 0]), [1, 0, 2]);
        assert!(trimmed(&[]).is_empty());
    }
}
