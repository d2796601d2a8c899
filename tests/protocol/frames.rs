//! Frames and streams for the tests of the pure layers, and a generator of pseudo-random numbers.

use mavswitch::mavlink::{
    CheckedFrame, Checker, Component, Dialect, FrameSpec, Header, Input, MessageId, Splitter,
    Version, encode,
};

/// One frame, without signature.
pub(crate) fn frame(
    version: Version,
    seq: u8,
    source: Component,
    key: (u32, u8),
    payload: &[u8],
) -> Vec<u8> {
    let (id, crc_extra) = key;
    let id = MessageId(id);
    let mut out = Vec::new();
    encode(&FrameSpec { version, seq, source, id, crc_extra, payload, signature: None }, &mut out);
    out
}

/// The same with thirteen bytes of signature, which a router does not look at.
pub(crate) fn signed(seq: u8, source: Component, key: (u32, u8), payload: &[u8]) -> Vec<u8> {
    let (id, crc_extra) = key;
    let mut out = Vec::new();
    let spec = FrameSpec {
        version: Version::V2,
        seq,
        source,
        id: MessageId(id),
        crc_extra,
        payload,
        signature: Some([seq; 13]),
    };
    encode(&spec, &mut out);
    out
}

/// A frame as a test remembers it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Taken {
    pub(crate) bytes: Vec<u8>,
    pub(crate) header: Header,
    pub(crate) target: Component,
    pub(crate) verified: bool,
}

/// A peer's bytes on their way through a splitter.
pub(crate) struct Receiver {
    pub(crate) checker: Checker,
    pub(crate) splitter: Splitter,
    buffer: Vec<u8>,
}

impl Receiver {
    pub(crate) fn new() -> Self {
        let checker = Checker::new(Dialect::builtin());
        let buffer = vec![0xa5; Splitter::CARRY + 65_536];
        Self { checker, splitter: Splitter::new(), buffer }
    }

    /// Hands out the frames of `bytes` as they are cut.
    pub(crate) fn each(
        &mut self,
        bytes: &[u8],
        input: Input,
        mut f: impl FnMut(&CheckedFrame<'_>),
    ) {
        self.buffer[Splitter::CARRY..][..bytes.len()].copy_from_slice(bytes);
        let mut cutter = self.splitter.cut(&mut self.buffer, bytes.len(), input);
        while let Some(frame) = cutter.next(&mut self.checker) {
            f(&frame);
        }
    }

    pub(crate) fn receive(&mut self, bytes: &[u8], input: Input) -> Vec<Taken> {
        let mut taken = Vec::new();
        self.each(bytes, input, |frame| {
            taken.push(Taken {
                bytes: frame.bytes.to_vec(),
                header: frame.header,
                target: frame.target,
                verified: frame.verified,
            });
        });
        taken
    }

    /// A whole stream in one piece, and then the silence behind it.
    pub(crate) fn receive_all(&mut self, bytes: &[u8]) -> Vec<Vec<u8>> {
        let mut taken = Vec::new();
        for chunk in bytes.chunks(65_536) {
            taken.extend(self.receive(chunk, Input::Flowing));
        }
        taken.extend(self.receive(&[], Input::Paused));
        taken.into_iter().map(|frame| frame.bytes).collect()
    }
}

/// xorshift64*: small, seeded, the same everywhere.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    pub(crate) fn below(&mut self, limit: usize) -> usize {
        (self.next() >> 33) as usize % limit
    }

    pub(crate) fn byte(&mut self) -> u8 {
        (self.next() >> 56) as u8
    }

    pub(crate) fn bytes(&mut self, count: usize) -> Vec<u8> {
        (0..count).map(|_| self.byte()).collect()
    }
}

/// A telemetry stream as vehicles send it: `count` frames of several kinds, versions and sources.
pub(crate) fn telemetry(count: usize, random: &mut Random) -> Vec<Vec<u8>> {
    // HEARTBEAT, ATTITUDE, GLOBAL_POSITION_INT, FILE_TRANSFER_PROTOCOL, COMMAND_LONG.
    let kinds = [(0, 50, 9), (30, 39, 28), (33, 104, 28), (110, 84, 254), (76, 152, 33)];
    let mut frames = Vec::new();
    for number in 0..count {
        let (id, crc_extra, len) = kinds[random.below(kinds.len())];
        let source = Component::new(1 + random.below(3) as u8, 1);
        let payload = random.bytes(len);
        let seq = number as u8;
        frames.push(match random.below(3) {
            0 => frame(Version::V1, seq, source, (id, crc_extra), &payload),
            1 => frame(Version::V2, seq, source, (id, crc_extra), &payload),
            _ => signed(seq, source, (id, crc_extra), &payload),
        });
    }
    frames
}
