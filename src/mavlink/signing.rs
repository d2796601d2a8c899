//! Message signing (rules 54-58): keys, signatures, and which signed frames are to be believed.
//!
//! What is secret stays in here: a key can be used and compared, but neither shown nor read.

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use sha2::{Digest, Sha256};
use zeroize::Zeroizing;

use super::frame::SIGNATURE;
use super::id::Component;
use super::splitter::CheckedFrame;

/// How long a signing key is, in bytes.
pub const KEY_LEN: usize = 32;

/// How many streams of one key are remembered (rule 57).
pub const MAX_STREAMS: usize = 256;

/// How far a new stream may be behind: 60 s (rule 57).
const LATE: u64 = 6_000_000;

/// Seconds from 1970 to 2015, where timestamps begin (rule 54).
const EPOCH: Duration = Duration::from_secs(1_420_070_400);

/// A signing key. All copies are one place in memory, which is wiped when the last of them goes.
#[derive(Clone, PartialEq, Eq)]
pub struct Key(Arc<Zeroizing<[u8; KEY_LEN]>>);

impl Key {
    /// A key of these bytes; `None` if all are zero, which stands for no signing at all (rule 56).
    pub fn new(bytes: Zeroizing<[u8; KEY_LEN]>) -> Option<Self> {
        bytes.iter().any(|byte| *byte != 0).then(|| Self(Arc::new(bytes)))
    }

    /// The key that ground stations make of a passphrase: its SHA-256 (rule 56).
    pub fn from_passphrase(text: &str) -> Self {
        Self(Arc::new(Zeroizing::new(Sha256::digest(text.as_bytes()).into())))
    }

    /// The last six bytes of a signed frame of which these are all the others (rule 56).
    pub(super) fn proof(&self, signed: &[u8]) -> [u8; 6] {
        let mut hash = Sha256::new();
        hash.update(self.0.as_slice());
        hash.update(signed);
        let [a, b, c, d, e, f, ..]: [u8; 32] = hash.finalize().into();
        [a, b, c, d, e, f]
    }

    /// Whether a signed frame, as received, was signed with this key.
    pub fn has_signed(&self, frame: &[u8]) -> bool {
        let Some((signed, proof)) = frame.split_last_chunk::<6>() else { return false };
        // Takes as long whatever is wrong.
        let pairs = self.proof(signed).into_iter().zip(proof);
        pairs.fold(0, |wrong, (ours, theirs)| wrong | (ours ^ theirs)) == 0
    }
}

/// Nothing of what is in it.
impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Key")
    }
}

/// A signature's time: units of 10 µs since 2015-01-01 UTC, below 2^48 (rule 54).
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Debug)]
pub struct Timestamp(u64);

impl Timestamp {
    /// The last there is, in the year 2104.
    pub const MAX: Self = Self((1 << 48) - 1);

    /// So many units of 10 µs, [`Timestamp::MAX`] at most.
    pub const fn new(units: u64) -> Self {
        if units < Self::MAX.0 { Self(units) } else { Self::MAX }
    }

    /// The time of a clock that counts from 1970; before 2015 it is zero.
    pub fn from_unix(since_1970: Duration) -> Self {
        let micros = since_1970.saturating_sub(EPOCH).as_micros();
        Self::new(u64::try_from(micros / 10).unwrap_or(u64::MAX))
    }

    /// Units of 10 µs.
    pub const fn units(self) -> u64 {
        self.0
    }

    /// So many units later.
    pub const fn plus(self, units: u64) -> Self {
        Self::new(self.0.saturating_add(units))
    }

    /// So many units earlier, but not before 2015.
    pub const fn minus(self, units: u64) -> Self {
        Self(self.0.saturating_sub(units))
    }

    pub(super) fn to_bytes(self) -> [u8; 6] {
        let [a, b, c, d, e, f, _, _] = self.0.to_le_bytes();
        [a, b, c, d, e, f]
    }
}

/// Why a frame is not believed.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Refusal {
    /// It is not signed.
    Unsigned,
    /// It was signed with another key, or damaged since.
    WrongSignature,
    /// It is not newer than the last of its stream.
    Replayed,
    /// It begins a stream, and is more than 60 s behind.
    TooOld,
    /// It begins a stream, and there are [`MAX_STREAMS`] that may yet go on.
    TooManyStreams,
}

/// Which part of a signed frame says what about the stream that it belongs to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Stream {
    source: Component,
    link: u8,
    last: Timestamp,
}

impl Stream {
    /// The stream of a signed frame as it is with that frame.
    fn of(frame: &CheckedFrame<'_>) -> Option<Self> {
        if !frame.header.signed {
            return None;
        }
        let (_, signature) = frame.bytes.split_last_chunk::<SIGNATURE>()?;
        let [link, a, b, c, d, e, f, ..] = *signature;
        let last = Timestamp(u64::from_le_bytes([a, b, c, d, e, f, 0, 0]));
        Some(Self { source: frame.header.source, link, last })
    }

    fn is_same(&self, other: &Self) -> bool {
        (self.source, self.link) == (other.source, other.link)
    }
}

/// The streams that were heard with one key, and how far each of them is (rule 57).
///
/// Invariant: no stream is there twice, and there are at most [`MAX_STREAMS`].
#[derive(Clone, Debug)]
pub struct Streams(Vec<Stream>);

impl Default for Streams {
    fn default() -> Self {
        Self(Vec::with_capacity(MAX_STREAMS))
    }
}

impl Streams {
    /// None; without room for any.
    pub const EMPTY: Self = Self(Vec::new());

    /// Believes a frame, or says why not; `local` is the time of now. Tells the time of the frame,
    /// by which `local` may have to rise.
    ///
    /// # Errors
    ///
    /// See [`Refusal`]; what was refused changes nothing.
    pub fn accept(
        &mut self,
        frame: &CheckedFrame<'_>,
        key: &Key,
        local: Timestamp,
    ) -> Result<Timestamp, Refusal> {
        let (new, place) = self.judge(frame, key, local)?;
        match place {
            Some(place) => self.0[place] = new,
            None => self.0.push(new),
        }
        Ok(new.last)
    }

    /// Whether [`Streams::accept`] would believe a frame.
    ///
    /// # Errors
    ///
    /// Why not.
    pub fn would_accept(
        &self,
        frame: &CheckedFrame<'_>,
        key: &Key,
        local: Timestamp,
    ) -> Result<(), Refusal> {
        self.judge(frame, key, local).map(drop)
    }

    /// The stream of a frame that is to be believed, and the place that it takes; `None`: a new one.
    fn judge(
        &self,
        frame: &CheckedFrame<'_>,
        key: &Key,
        local: Timestamp,
    ) -> Result<(Stream, Option<usize>), Refusal> {
        let new = Stream::of(frame).ok_or(Refusal::Unsigned)?;
        // Before anything is made of the timestamp: else a forged one could end a stream.
        if !key.has_signed(frame.bytes) {
            return Err(Refusal::WrongSignature);
        }
        if let Some(known) = self.0.iter().position(|known| known.is_same(&new)) {
            let is_newer = new.last > self.0[known].last;
            return if is_newer { Ok((new, Some(known))) } else { Err(Refusal::Replayed) };
        }
        if new.last.plus(LATE) < local {
            return Err(Refusal::TooOld);
        }
        if self.0.len() < MAX_STREAMS {
            return Ok((new, None));
        }
        // Whatever was recorded of a stream that is too old to begin anew cannot be replayed either.
        let over = self.0.iter().position(|known| known.last.plus(LATE) < local);
        over.map(|over| (new, Some(over))).ok_or(Refusal::TooManyStreams)
    }
}

/// Signs, checks and bends whatever frame the bytes can be made into.
///
/// # Fuzzing
///
/// Asserts that what was signed verifies with its key alone, that each change to it is noticed, and
/// that without its signature it is what it was.
pub fn fuzz_signing(data: &[u8]) {
    use super::encode::{FrameSpec, encode};
    use super::{FrameBuffer, Header, MessageId, Version};
    let Some((&[seq, system, component, extra, link, a, b, c, t, at], payload)) =
        data.split_first_chunk::<10>()
    else {
        return;
    };
    let (source, id) = (Component::new(system, component), u32::from_le_bytes([a, b, c, 0]));
    let payload = &payload[..payload.len().min(255)];
    let mut plain = Vec::new();
    let version = if t % 4 == 0 { Version::V1 } else { Version::V2 };
    let (id, crc_extra, signature) = (MessageId(id), extra, None);
    encode(&FrameSpec { version, seq, source, id, crc_extra, payload, signature }, &mut plain);
    let header = Header::parse(&plain).expect("a frame was encoded");
    let frame = CheckedFrame { bytes: &plain, header, target: source, verified: true };
    let (key, other) = (Key::from_passphrase("a"), Key::from_passphrase("b"));
    let (mut upgraded, mut signed, mut stripped) =
        <(FrameBuffer, FrameBuffer, FrameBuffer)>::default();
    let frame = upgraded.upgrade(&frame).unwrap_or(frame);
    let time = Timestamp::new(u64::from(t) << 32);
    let signed = signed.sign(&frame, &key, link, time).expect("an unsigned frame of MAVLink 2");
    let mut streams = Streams::default();
    assert_eq!(streams.would_accept(&signed, &key, time), Ok(()));
    assert_eq!(streams.would_accept(&signed, &other, time), Err(Refusal::WrongSignature));
    assert_eq!(streams.accept(&signed, &other, time), Err(Refusal::WrongSignature));
    assert_eq!(streams.accept(&signed, &key, time), Ok(time));
    assert_eq!(streams.accept(&signed, &key, time), Err(Refusal::Replayed));
    assert_eq!(stripped.strip(&signed), Some(frame));
    let mut bent = signed.bytes.to_vec();
    let place = usize::from(at) % bent.len();
    bent[place] ^= link | 1;
    assert!(!key.has_signed(&bent));
}

#[cfg(test)]
mod tests {
    use super::super::{FrameBuffer, FrameSpec, Header, MessageId, Version, encode};
    use super::*;

    const NOW: Timestamp = Timestamp::new(1_000_000_000);

    /// A signed HEARTBEAT.
    fn signed(system: u8, link: u8, at: Timestamp, key: &Key) -> Vec<u8> {
        let mut plain = Vec::new();
        let (version, seq, source) = (Version::V2, 0, Component::new(system, 1));
        let (id, crc_extra, payload, signature) = (MessageId::HEARTBEAT, 50, &[4; 9], None);
        let spec = FrameSpec { version, seq, source, id, crc_extra, payload, signature };
        encode(&spec, &mut plain);
        let mut buffer = FrameBuffer::default();
        buffer.sign(&checked(&plain), key, link, at).unwrap().bytes.to_vec()
    }

    fn checked(bytes: &[u8]) -> CheckedFrame<'_> {
        let header = Header::parse(bytes).unwrap();
        CheckedFrame { bytes, header, target: Component::new(0, 0), verified: true }
    }

    fn key() -> Key {
        Key::from_passphrase("the key of this vehicle")
    }

    /// What becomes of a frame of 1/1 with link id 1 at this time.
    fn accept(streams: &mut Streams, at: Timestamp) -> Result<Timestamp, Refusal> {
        streams.accept(&checked(&signed(1, 1, at, &key())), &key(), NOW)
    }

    #[test]
    fn rule_56_the_passphrase_is_hashed_once() {
        let mut hash = Zeroizing::new([0; 32]);
        hash.copy_from_slice(&Sha256::digest(b"secret"));
        assert!(Key::new(hash) == Some(Key::from_passphrase("secret")));
        assert!(Key::new(Zeroizing::new([0; 32])).is_none());
    }

    #[test]
    fn a_key_is_never_shown() {
        assert_eq!(format!("{:?}", Key::from_passphrase("secret")), "Key");
    }

    #[test]
    fn rule_54_time_is_counted_from_2015() {
        assert_eq!(Timestamp::from_unix(Duration::from_secs(100)), Timestamp::new(0));
        assert_eq!(Timestamp::from_unix(EPOCH + Duration::from_secs(1)), Timestamp::new(100_000));
        assert_eq!(Timestamp::from_unix(Duration::MAX), Timestamp::MAX);
        assert_eq!(Timestamp::MAX.plus(1), Timestamp::MAX);
    }

    #[test]
    fn rule_57_a_stream_only_goes_forward() {
        let mut streams = Streams::default();
        assert_eq!(accept(&mut streams, NOW), Ok(NOW));
        assert_eq!(accept(&mut streams, NOW), Err(Refusal::Replayed));
        assert_eq!(accept(&mut streams, NOW.minus(1)), Err(Refusal::Replayed));
        assert_eq!(accept(&mut streams, NOW.plus(1)), Ok(NOW.plus(1)));
        for (system, link) in [(2, 1), (1, 2)] {
            let other = signed(system, link, NOW, &key());
            assert_eq!(streams.accept(&checked(&other), &key(), NOW), Ok(NOW));
        }
    }

    #[test]
    fn rule_57_a_stream_begins_at_most_60_s_behind() {
        let mut streams = Streams::default();
        assert_eq!(accept(&mut streams, NOW.minus(LATE + 1)), Err(Refusal::TooOld));
        assert_eq!(accept(&mut streams, NOW.minus(LATE)), Ok(NOW.minus(LATE)));
    }

    #[test]
    fn a_forged_frame_does_not_end_a_stream() {
        let mut streams = Streams::default();
        assert_eq!(accept(&mut streams, NOW), Ok(NOW));
        let forged = signed(1, 1, Timestamp::MAX, &Key::from_passphrase("another"));
        let outcome = streams.accept(&checked(&forged), &key(), NOW);
        assert_eq!(outcome, Err(Refusal::WrongSignature));
        assert_eq!(accept(&mut streams, NOW.plus(1)), Ok(NOW.plus(1)));
    }

    #[test]
    fn streams_are_bounded_and_only_those_too_old_to_be_replayed_make_room() {
        let mut streams = Streams::default();
        for number in 0..=MAX_STREAMS {
            let [link, system] = (number as u16).to_le_bytes();
            let frame = signed(system + 1, link, NOW, &key());
            let expected =
                if number < MAX_STREAMS { Ok(NOW) } else { Err(Refusal::TooManyStreams) };
            assert_eq!(
                streams.would_accept(&checked(&frame), &key(), NOW),
                expected.map(|_| ()),
                "{number}"
            );
            assert_eq!(streams.accept(&checked(&frame), &key(), NOW), expected);
        }
        let later = NOW.plus(LATE + 1);
        let frame = signed(99, 0, later, &key());
        assert_eq!(streams.accept(&checked(&frame), &key(), later), Ok(later));
        // Of the one that made room nothing old is believed.
        let replay = signed(1, 0, NOW, &key());
        assert_eq!(streams.accept(&checked(&replay), &key(), later), Err(Refusal::TooOld));
        assert_eq!(streams.0.len(), MAX_STREAMS);
    }

    #[test]
    fn exercise_fuzz_signing() {
        let mut state = 7_u32;
        for len in 0..600 {
            let mut byte = || {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 24) as u8
            };
            fuzz_signing(&(0..len).map(|_| byte()).collect::<Vec<_>>());
        }
    }
}
