//! For the fuzzer of the router: gates of many kinds, frames that they must or must not let in, and
//! what must be true of a frame that left by one.

use std::sync::{Arc, LazyLock};

use super::{GateOptions, OldFrames, Sign, Verify};
use crate::mavlink::{
    CheckedFrame, Dialect, FrameBuffer, Header, Key, MessageId, Recipes, SystemMap, Timestamp,
    Version,
};

static KEY: LazyLock<Key> = LazyLock::new(|| Key::from_passphrase("the key of the gates"));
static OTHER_KEY: LazyLock<Key> = LazyLock::new(|| Key::from_passphrase("nobody's key"));
static RECIPES: LazyLock<Arc<Recipes>> =
    LazyLock::new(|| Arc::new(Recipes::new(&Dialect::builtin())));

/// How a frame comes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Shape {
    Plain,
    Old,
    Signed,
    WronglySigned,
    /// With a good signature that is a while old.
    SignedLate,
}

impl Shape {
    /// What the lowest bits of `choice` say, if a message with this id can have it.
    pub(super) fn of(choice: u8, id: u32) -> Self {
        match choice & 7 {
            1 | 2 if id < 256 => Self::Old,
            3 | 4 => Self::Signed,
            5 => Self::WronglySigned,
            6 => Self::SignedLate,
            _ => Self::Plain,
        }
    }

    pub(super) fn version(self) -> Version {
        if self == Self::Old { Version::V1 } else { Version::V2 }
    }

    /// The frame with the signature that it is to have.
    pub(super) fn signed(self, plain: Vec<u8>, at: Timestamp) -> Vec<u8> {
        let (key, at) = match self {
            Self::Plain | Self::Old => return plain,
            Self::Signed => (&KEY, at),
            Self::WronglySigned => (&OTHER_KEY, at),
            Self::SignedLate => (&KEY, at.minus(1_000)),
        };
        let header = Header::parse(&plain).expect("a frame");
        let (target, verified) = (header.source, true);
        let frame = CheckedFrame { bytes: &plain, header, target, verified };
        let mut buffer = FrameBuffer::default();
        let signed = buffer.sign(&frame, key, 1, at).expect("an unsigned frame of MAVLink 2");
        signed.bytes.to_vec()
    }

    /// Holds that a gate that looked at the signature came to the right verdict.
    pub(super) fn check_verdict(self, is_refused: bool) {
        match self {
            Self::Signed => assert!(!is_refused, "a good signature was refused"),
            Self::WronglySigned => assert!(is_refused, "a wrong signature was believed"),
            Self::SignedLate | Self::Plain | Self::Old => {}
        }
    }
}

/// A gate of one of many kinds; half of them ask for nothing.
pub(super) fn options(choice: u8) -> GateOptions {
    let verify = || {
        let (strip, before_sending) = (choice & 16 != 0, choice & 32 != 0);
        let allow_unsigned = vec![MessageId::RADIO_STATUS];
        Some(Verify { key: KEY.clone(), allow_unsigned, strip, before_sending })
    };
    let v1 = [OldFrames::Pass, OldFrames::Upgrade, OldFrames::Drop];
    let sign = || Some(Sign { key: KEY.clone(), v1: v1[usize::from(choice >> 6) % 3] });
    let remap = || SystemMap::new(&[(1, 2)]).map(Arc::new);
    let recipes = Some(Arc::clone(&RECIPES));
    let passes_unconverted = choice & 16 != 0;
    let plain = GateOptions { recipes, passes_unconverted, ..GateOptions::default() };
    let (old, new) = (Some(Version::V1), Some(Version::V2));
    match choice & 15 {
        1 => GateOptions { verify: verify(), ..plain },
        2 => GateOptions { sign: sign(), ..plain },
        3 => GateOptions { version: old, ..plain },
        4 => GateOptions { version: new, ..plain },
        5 => GateOptions { remap: remap(), ..plain },
        6 => GateOptions { verify: verify(), sign: sign(), remap: remap(), ..plain },
        7 => GateOptions { sign: sign(), remap: remap(), version: old, ..plain },
        8 => GateOptions { verify: verify(), sign: sign(), version: new, ..plain },
        _ => GateOptions::default(),
    }
}

/// Holds what must be true of the bytes in which a frame left by a gate.
pub(super) fn check_output(gate: &GateOptions, frame: &CheckedFrame<'_>, bytes: &[u8]) {
    let header = Header::parse(bytes).expect("a frame left");
    assert_eq!((header.id, header.seq), (frame.header.id, frame.header.seq));
    let system = |system| gate.remap.as_ref().map_or(system, |map| map.apply(system));
    assert_eq!(header.source.system, system(frame.header.source.system));
    if gate.sign.is_none() && gate.remap.is_none() && gate.version.is_none() {
        return assert_eq!(bytes, frame.bytes, "nobody asked for another");
    }
    if let Some(sign) = &gate.sign {
        let is_old = header.version == Version::V1;
        assert!(if is_old { sign.v1 == OldFrames::Pass } else { header.signed });
        // What somebody else signed is that one's matter.
        assert!(is_old || frame.header.signed || KEY.has_signed(bytes));
    }
    if let Some(version) = gate.version.filter(|_| !gate.passes_unconverted) {
        let upgraded = gate.sign.as_ref().is_some_and(|sign| sign.v1 == OldFrames::Upgrade);
        assert!(header.version == version || upgraded);
    }
}
