//! Cuts the bytes of one peer into frames, and finds its feet again after damage.
//!
//! A splitter owns no buffer: it keeps the bytes of an unfinished frame (at most [`Splitter::CARRY`])
//! and puts them in front of what arrives next. A candidate that fails is left at the byte after
//! its start byte (rule 17); what stands inside it is believed only after a full check (rule 19).

use std::ops::AddAssign;

use super::checker::{Checker, Evidence, Verdict};
use super::crc::Crc;
use super::dialect::Target;
use super::frame::{Frame, FrameError, Header, MAX_FRAME, SIGNATURE, STX_V1, STX_V2};
use super::id::Component;

/// A frame that passed its check, and all that routing wants to know of it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CheckedFrame<'a> {
    /// The frame as received.
    pub bytes: &'a [u8],
    /// What its header says.
    pub header: Header,
    /// Whom it is for; system 0 is everybody, component 0 all of the system (rules 33 and 36).
    pub target: Component,
    /// Whether the check was a full one, so that routes may be learned from it (rule 24).
    pub verified: bool,
}

impl CheckedFrame<'_> {
    /// Whether it is for somebody in particular.
    pub fn is_directed(&self) -> bool {
        self.target.system != 0
    }

    /// The payload byte at `offset`, zero where it was cut off (rule 10).
    pub fn payload_byte(&self, offset: u8) -> u8 {
        // `bytes` is exactly one frame, as the splitter cut it.
        Frame::parse(self.bytes).map_or(0, |frame| frame.payload_byte(offset))
    }
}

/// What may be assumed about the bytes behind those at hand.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Input {
    /// More may follow at once: an unfinished candidate is waited for.
    Flowing,
    /// Nothing follows for now: an end of a datagram, or a pause. Complete frames inside an
    /// unfinished candidate show that it was none (rule 18); without them it is still waited for.
    Paused,
}

/// What a splitter passed over. Counts from the start of the link.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub struct SplitterStats {
    /// Bytes that belonged to no frame.
    pub skipped_bytes: u64,
    /// Candidates with a wrong checksum; those inside a failed candidate are not counted again.
    pub damaged: u64,
    /// Candidates with an unknown incompatibility flag (rule 7), likewise.
    pub incompatible: u64,
}

/// Both links together.
impl AddAssign for SplitterStats {
    fn add_assign(&mut self, other: Self) {
        self.skipped_bytes += other.skipped_bytes;
        self.damaged += other.damaged;
        self.incompatible += other.incompatible;
    }
}

/// The receiving end of one peer: a serial port, a connection, a remote address (rule 20).
#[derive(Clone, Default, Debug)]
pub struct Splitter {
    /// The unfinished end of what came so far. Invariant: at most [`Splitter::CARRY`] bytes.
    carry: Vec<u8>,
    /// How many of the bytes ahead stand inside a failed candidate.
    suspect: usize,
    /// How many of the carried bytes are already part of a frame that was handed out: the end of
    /// a signature, see [`Cutter::rewind`].
    lookback: usize,
    stats: SplitterStats,
}

impl Splitter {
    /// How many bytes may be carried from one read to the next: the end of a signature, and an
    /// unfinished frame or a whole one whose inside is not yet clear.
    pub const CARRY: usize = LOOKBACK + 2 * MAX_FRAME;

    /// A splitter that has seen nothing.
    pub fn new() -> Self {
        Self { carry: Vec::with_capacity(Self::CARRY), ..Self::default() }
    }

    /// Begins to cut what was received into `buffer[Splitter::CARRY..]`, `received` bytes of it.
    ///
    /// The first [`Splitter::CARRY`] bytes of `buffer` are the splitter's own: there it puts what
    /// it carried. All frames must be taken before the next call.
    ///
    /// # Panics
    ///
    /// If `buffer` is shorter than that.
    pub fn cut<'a>(
        &'a mut self,
        buffer: &'a mut [u8],
        received: usize,
        input: Input,
    ) -> Cutter<'a> {
        let start = Self::CARRY - self.carry.len();
        buffer[start..Self::CARRY].copy_from_slice(&self.carry);
        self.carry.clear();
        let bytes = &buffer[start..Self::CARRY + received];
        let position = self.lookback;
        Cutter { splitter: self, bytes, position, input }
    }

    /// Forgets what was carried: what comes next is somebody else's.
    pub fn forget(&mut self) {
        self.stats.skipped_bytes += (self.carry.len() - self.lookback) as u64;
        self.carry.clear();
        (self.suspect, self.lookback) = (0, 0);
    }

    /// Whether an unfinished candidate waits for more bytes.
    pub fn is_waiting(&self) -> bool {
        self.carry.len() > self.lookback
    }

    /// What was passed over so far.
    pub fn stats(&self) -> SplitterStats {
        self.stats
    }
}

/// How far back a frame may begin that a torn signature hides.
const LOOKBACK: usize = SIGNATURE;

/// What to do at a candidate.
enum Step<'a> {
    Take(CheckedFrame<'a>),
    Fail(Failure),
    Wait,
}

enum Failure {
    /// A wrong checksum; so many bytes behind the start byte stand inside the candidate.
    Damaged(usize),
    /// An unknown incompatibility flag: where the candidate ends is not known.
    Incompatible,
}

/// Hands out the frames of one read.
#[derive(Debug)]
pub struct Cutter<'a> {
    splitter: &'a mut Splitter,
    bytes: &'a [u8],
    /// Where to look next. Invariant: at most `bytes.len()`, and at least the splitter's lookback.
    position: usize,
    input: Input,
}

impl<'a> Cutter<'a> {
    /// The next frame; `None` means that more bytes are needed.
    #[inline]
    pub fn next(&mut self, checker: &mut Checker) -> Option<CheckedFrame<'a>> {
        loop {
            self.skip_to_start();
            match self.step(checker) {
                Step::Take(frame) => {
                    self.advance(frame.bytes.len());
                    self.splitter.lookback = if frame.header.signed { LOOKBACK } else { 0 };
                    return Some(frame);
                }
                Step::Fail(failure) => self.fail(&failure),
                Step::Wait => {
                    if self.input == Input::Paused && self.give_up_candidate(checker) {
                        continue;
                    }
                    self.carry();
                    return None;
                }
            }
        }
    }

    fn step(&mut self, checker: &mut Checker) -> Step<'a> {
        let frame = match Frame::parse(&self.bytes[self.position..]) {
            Ok(frame) => frame,
            Err(FrameError::Incompatible) => return Step::Fail(Failure::Incompatible),
            Err(FrameError::NoStart | FrameError::Incomplete) => return Step::Wait,
        };
        let failed = Step::Fail(Failure::Damaged(frame.bytes().len() - 1));
        match checker.check(&frame) {
            Verdict::Known(target) => take(frame, target_of(&frame, target), true),
            Verdict::Confirmed => take(frame, EVERYBODY, true),
            Verdict::Unconfirmed(sighting) if self.splitter.suspect == 0 => {
                match self.look_inside(&frame, checker) {
                    Inside::NoFrame => match checker.remember(sighting) {
                        Evidence::First => take(frame, EVERYBODY, false),
                        Evidence::Second => take(frame, EVERYBODY, true),
                        Evidence::Contradiction => failed,
                    },
                    Inside::Unclear => Step::Wait,
                    Inside::Frame => failed,
                }
            }
            Verdict::Unconfirmed(_) | Verdict::Damaged => failed,
        }
    }

    /// Leaves a failed candidate at the byte after its start byte (rule 17).
    fn fail(&mut self, failure: &Failure) {
        if self.rewind() {
            return;
        }
        match *failure {
            Failure::Damaged(inside) => {
                self.count(|stats| &mut stats.damaged);
                self.skip(1);
                self.splitter.suspect = self.splitter.suspect.max(inside);
            }
            Failure::Incompatible => {
                self.count(|stats| &mut stats.incompatible);
                self.skip(1);
            }
        }
    }

    /// Goes back into the signature of the frame before, if the stream makes no sense behind it.
    ///
    /// A signature is not under the checksum: a frame that was torn inside its signature passes
    /// the check, and the start of the next frame stands where the rest should be.
    fn rewind(&mut self) -> bool {
        let lookback = std::mem::take(&mut self.splitter.lookback);
        self.position -= lookback;
        if lookback > 0 {
            self.splitter.suspect += lookback;
        }
        lookback > 0
    }

    /// Keeps what is left for the next read.
    fn carry(&mut self) {
        let rest = &self.bytes[self.position - self.splitter.lookback..];
        self.splitter.carry.extend_from_slice(rest);
        self.position = self.bytes.len();
    }

    /// Looks for a whole frame that begins inside `frame`, the candidate at the position: it would
    /// show that an unconfirmed candidate is noise that happens to have a CRC_EXTRA.
    fn look_inside(&self, frame: &Frame<'_>, checker: &Checker) -> Inside {
        let end = self.position + frame.bytes().len();
        let mut outcome = Inside::NoFrame;
        for at in self.position + 1..end {
            match whole_frame_at(self.bytes, at, checker) {
                Ok(true) => return Inside::Frame,
                Err(FrameError::Incomplete) if self.input == Input::Flowing => {
                    outcome = Inside::Unclear;
                }
                _ => {}
            }
        }
        outcome
    }

    /// Rule 18: gives up the unfinished candidate at the position if a whole frame stands behind
    /// its start byte.
    fn give_up_candidate(&mut self, checker: &Checker) -> bool {
        let first = self.position - self.splitter.lookback;
        let found = (first..self.bytes.len())
            .find(|at| whole_frame_at(self.bytes, *at, checker) == Ok(true));
        let Some(found) = found else { return false };
        self.rewind();
        self.count(|stats| &mut stats.damaged);
        let inside = self.bytes.len() - self.position;
        self.splitter.suspect = self.splitter.suspect.max(inside);
        self.skip(found - self.position);
        true
    }

    fn skip_to_start(&mut self) {
        let rest = &self.bytes[self.position..];
        let is_start = |byte: &u8| matches!(*byte, STX_V1 | STX_V2);
        let garbage = rest.iter().position(is_start).unwrap_or(rest.len());
        if garbage == 0 {
            return;
        }
        if self.rewind() {
            return self.skip_to_start();
        }
        self.skip(garbage);
    }

    fn skip(&mut self, count: usize) {
        self.splitter.stats.skipped_bytes += count as u64;
        self.splitter.lookback = 0;
        self.advance(count);
    }

    fn advance(&mut self, count: usize) {
        self.position += count;
        self.splitter.suspect = self.splitter.suspect.saturating_sub(count);
    }

    fn count(&mut self, counter: impl Fn(&mut SplitterStats) -> &mut u64) {
        if self.splitter.suspect == 0 {
            *counter(&mut self.splitter.stats) += 1;
        }
    }
}

/// Whether a whole frame begins inside an unconfirmed one.
enum Inside {
    NoFrame,
    Frame,
    /// It may: bytes are missing.
    Unclear,
}

/// Whether a frame that passes a full check begins at `at`.
fn whole_frame_at(bytes: &[u8], at: usize, checker: &Checker) -> Result<bool, FrameError> {
    let frame = Frame::parse(&bytes[at..])?;
    Ok(matches!(checker.check(&frame), Verdict::Known(_) | Verdict::Confirmed))
}

#[inline]
fn take<'a>(frame: Frame<'a>, target: Component, verified: bool) -> Step<'a> {
    let (bytes, header) = (frame.bytes(), frame.header());
    Step::Take(CheckedFrame { bytes, header, target, verified })
}

/// Reads the target; what was cut off reads as zero (rule 10).
fn target_of(frame: &Frame<'_>, target: Target) -> Component {
    match target {
        Target::None => EVERYBODY,
        Target::System(system) => Component::new(frame.payload_byte(system), 0),
        Target::SystemComponent(system, component) => {
            Component::new(frame.payload_byte(system), frame.payload_byte(component))
        }
    }
}

/// The target of a frame that names none.
const EVERYBODY: Component = Component::new(0, 0);

/// Feeds any bytes in any pieces; the first byte of `data` chooses the size of the pieces.
///
/// # Fuzzing
///
/// Asserts that every frame stands in the input, that nothing is lost from the count, and that no
/// more than [`Splitter::CARRY`] bytes are kept.
pub fn fuzz_splitter(data: &[u8]) {
    let Some((size, stream)) = data.split_first() else {
        return;
    };
    let mut checker = Checker::new(super::Dialect::builtin());
    let mut splitter = Splitter::new();
    let mut buffer = [0xa5; Splitter::CARRY + 256];
    let mut taken = 0;
    for chunk in stream.chunks(usize::from(*size).max(1)) {
        buffer[Splitter::CARRY..][..chunk.len()].copy_from_slice(chunk);
        let input = if chunk.len() % 2 == 0 { Input::Flowing } else { Input::Paused };
        let mut cutter = splitter.cut(&mut buffer, chunk.len(), input);
        while let Some(frame) = cutter.next(&mut checker) {
            assert_eq!(frame.bytes.len(), frame.header.frame_len());
            taken += frame.bytes.len();
        }
        assert!(splitter.carry.len() <= Splitter::CARRY);
    }
    let skipped = splitter.stats().skipped_bytes as usize;
    // A byte may be counted twice: as the end of a signature and in the frame that was found there.
    assert!(taken + skipped + splitter.carry.len() >= stream.len());
}

/// The same with the checksum of whatever could be a frame put right first, which no fuzzer would
/// find by itself.
pub fn fuzz_splitter_with_checksums(data: &[u8]) {
    let mut data = data.to_vec();
    let dialect = super::Dialect::builtin();
    let mut at = 1;
    while at < data.len() {
        let Ok(frame) = Frame::parse(&data[at..]) else {
            at += 1;
            continue;
        };
        let extra = dialect.by_id(frame.header().id).map_or(0, |known| known.crc_extra);
        let checksum = Crc::step(Crc::of(frame.checked_bytes()), extra).to_le_bytes();
        let (end, next) = (1 + frame.checked_bytes().len(), at + frame.bytes().len());
        data[at + end..][..2].copy_from_slice(&checksum);
        at = next;
    }
    fuzz_splitter(&data);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exercise_fuzz_splitter() {
        for size in [0, 1, 2, 7, 255] {
            for byte in [0x00, STX_V1, STX_V2, 0xff] {
                let mut data = vec![byte; 4_000];
                data[0] = size;
                fuzz_splitter(&data);
                fuzz_splitter_with_checksums(&data);
            }
        }
        fuzz_splitter(&[]);
    }
}
