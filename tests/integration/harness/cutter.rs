//! Cuts what a peer received into frames, by a reading of the protocol that is not the router's.
//!
//! The router passes on whole frames and nothing else, so this cutter forgives nothing: a byte that
//! opens no frame, or a frame whose checksum no CRC_EXTRA explains, fails the test.

use mavswitch::mavlink::{Crc, implied_extra};

/// Bytes received and not yet handed out.
#[derive(Default)]
pub(crate) struct Cutter {
    bytes: Vec<u8>,
    /// Where the next frame begins in `bytes`.
    start: usize,
}

impl Cutter {
    /// Takes what was received.
    pub(crate) fn feed(&mut self, bytes: &[u8]) {
        if self.start == self.bytes.len() {
            self.bytes.clear();
            self.start = 0;
        }
        self.bytes.extend_from_slice(bytes);
    }

    /// The next frame, once it is there to its last byte.
    pub(crate) fn next(&mut self) -> Option<Vec<u8>> {
        let rest = &self.bytes[self.start..];
        let frame = rest.get(..frame_len(rest)?)?.to_vec();
        assert_undamaged(&frame);
        self.start += frame.len();
        Some(frame)
    }

    /// Whether no bytes are left over.
    pub(crate) fn is_empty(&self) -> bool {
        self.start == self.bytes.len()
    }
}

/// The length of the frame that begins with `bytes`, once its header tells it.
fn frame_len(bytes: &[u8]) -> Option<usize> {
    match *bytes {
        [] | [0xfe | 0xfd] | [0xfd, _] => None,
        [0xfe, len, ..] => Some(8 + usize::from(len)),
        [0xfd, len, 0, ..] => Some(12 + usize::from(len)),
        [0xfd, len, 1, ..] => Some(25 + usize::from(len)),
        _ => {
            let shown = &bytes[..bytes.len().min(40)];
            panic!("the router sent bytes that open no frame: {shown:02x?}")
        }
    }
}

fn assert_undamaged(frame: &[u8]) {
    let header = if frame[0] == 0xfe { 6 } else { 10 };
    let (checked, rest) = frame[1..].split_at(header - 1 + usize::from(frame[1]));
    let received = u16::from_le_bytes([rest[0], rest[1]]);
    let explained = implied_extra(Crc::of(checked), received);
    assert!(explained.is_some(), "the router sent a damaged frame: {frame:02x?}");
}
