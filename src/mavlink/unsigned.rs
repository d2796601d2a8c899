//! Frames without their signatures, for logs: what is kept for years shall hold nothing that helps
//! to find a key (rule 60).

use super::crc::{Crc, implied_extra};
use super::frame::{Frame, MAX_FRAME};

/// The flag of a signed frame, and where it stands.
const SIGNED: u8 = 0x01;
const INCOMPAT: usize = 2;

/// The frame as it would be if it had not been signed: the flag cleared, the signature left out and
/// the checksum made anew, with the CRC_EXTRA that explains the old one. Any other frame, and one
/// that no CRC_EXTRA explains, is returned as it is.
pub fn unsigned<'a>(frame: &Frame<'a>, out: &'a mut [u8; MAX_FRAME]) -> &'a [u8] {
    if !frame.header().signed {
        return frame.bytes();
    }
    let checked = frame.checked_bytes();
    let extra = implied_extra(Crc::of(checked), frame.checksum());
    let Some(extra) = extra else { return frame.bytes() };
    let end = 1 + checked.len();
    out[..end].copy_from_slice(&frame.bytes()[..end]);
    out[INCOMPAT] &= !SIGNED;
    let checksum = Crc::step(Crc::of(&out[1..end]), extra);
    out[end..end + 2].copy_from_slice(&checksum.to_le_bytes());
    &out[..end + 2]
}

#[cfg(test)]
mod tests {
    use super::super::encode::{FrameSpec, encode};
    use super::super::frame::Version;
    use super::super::id::{Component, MessageId};
    use super::*;

    fn heartbeat(version: Version, signature: Option<[u8; 13]>) -> Vec<u8> {
        let mut bytes = Vec::new();
        let spec = FrameSpec {
            version,
            seq: 7,
            source: Component::new(1, 1),
            id: MessageId::HEARTBEAT,
            crc_extra: 50,
            payload: &[1, 2, 3, 4, 5],
            signature,
        };
        encode(&spec, &mut bytes);
        bytes
    }

    #[test]
    fn rule_60_without_its_signature_a_frame_is_as_if_it_had_never_had_one() {
        let mut out = [0xa5; MAX_FRAME];
        let signed = heartbeat(Version::V2, Some([9; 13]));
        let plain = heartbeat(Version::V2, None);
        assert_eq!(unsigned(&Frame::parse(&signed).unwrap(), &mut out), plain);
    }

    #[test]
    fn what_is_not_signed_or_not_explained_stays_as_it_is() {
        let mut damaged = heartbeat(Version::V2, Some([9; 13]));
        damaged[11] ^= 0x10;
        damaged[12] ^= 0x37;
        let crc = Crc::of(Frame::parse(&damaged).unwrap().checked_bytes());
        let wrong = (0..=u16::MAX).find(|sum| implied_extra(crc, *sum).is_none()).unwrap();
        let at = damaged.len() - 15;
        damaged[at..at + 2].copy_from_slice(&wrong.to_le_bytes());
        let frames = [heartbeat(Version::V1, None), heartbeat(Version::V2, None), damaged];
        for bytes in frames {
            assert_eq!(unsigned(&Frame::parse(&bytes).unwrap(), &mut [0; MAX_FRAME]), bytes);
        }
    }
}
