//! Makes a ULog file of the pieces that arrive: in their order, each once, and whole messages only.
//!
//! Pieces that come early are held for a moment; what then is still missing is lost. Behind a gap the
//! file goes on with the first message that begins there, and a dropout message tells that something
//! is missing, as readers of ULog expect it.

use std::time::Duration;

use super::message::UlogPiece;
use super::sink::Sink;
use crate::routing::Time;

/// How a ULog file begins; a version and a time follow.
const MAGIC: [u8; 7] = [0x55, 0x4c, 0x6f, 0x67, 0x01, 0x12, 0x35];

/// The length of the file header.
const HEADER: usize = 16;

/// The length of a message header: the size of the rest, and the type.
const HEAD: usize = 3;

/// How many pieces are held that came early, and for how long.
const HELD: usize = 32;
const PATIENCE: Duration = Duration::from_millis(500);

/// The file in the making.
#[derive(Debug)]
pub(super) struct Assembler {
    /// The piece that it began with.
    beginning: Vec<u8>,
    /// The number of the piece that comes next.
    expected: u16,
    /// The beginning of a message. Invariant: shorter than the message.
    partial: Vec<u8>,
    /// Where the next message goes.
    position: u64,
    /// Whether the beginning of a message is looked for.
    is_lost: bool,
    /// Pieces that came early.
    held: Vec<UlogPiece>,
    /// Since when something is missing.
    gap_since: Option<Time>,
    /// When a piece last came in its order.
    last: Time,
    /// Pieces that are missing for good.
    pub(super) gaps: u64,
}

impl Assembler {
    /// Begins a file with its first piece, if it is one.
    pub(super) fn begin(piece: &UlogPiece, now: Time, sink: &mut dyn Sink) -> Option<Self> {
        if !is_beginning(piece) || !sink.has_room(piece.data.len()) {
            return None;
        }
        sink.open("ulg");
        sink.write(0, &piece.data[..HEADER]);
        let mut assembler = Self {
            beginning: piece.data.clone(),
            expected: piece.sequence.wrapping_add(1),
            partial: Vec::new(),
            position: HEADER as u64,
            is_lost: false,
            held: Vec::new(),
            gap_since: None,
            last: now,
            gaps: 0,
        };
        assembler.append(&piece.data[HEADER..], sink);
        Some(assembler)
    }

    /// Whether another file begins with a piece: its header has the time at which it was begun.
    pub(super) fn is_another(&self, piece: &UlogPiece) -> bool {
        is_beginning(piece) && piece.data != self.beginning
    }

    /// Takes a piece; says whether it is in safe hands. If there was no room for it, it is not.
    pub(super) fn handle(&mut self, piece: UlogPiece, now: Time, sink: &mut dyn Sink) -> bool {
        // Negative: it was there already. The other half of the circle is far ahead.
        let ahead = piece.sequence.wrapping_sub(self.expected).cast_signed();
        if ahead < 0 {
            return true;
        }
        if !sink.has_room(self.partial.len() + piece.data.len()) {
            return false;
        }
        if ahead > 0 {
            self.hold(piece, now, sink);
        } else {
            self.take(&piece, now, sink);
            self.take_held(now, sink);
        }
        true
    }

    /// How many bytes of it have been written.
    pub(super) fn written(&self) -> u64 {
        self.position
    }

    /// How many bytes wait for what is missing before them.
    pub(super) fn held(&self) -> usize {
        self.partial.len() + self.held.iter().map(|piece| piece.data.len()).sum::<usize>()
    }

    /// Gives up what is missing for too long.
    pub(super) fn handle_timeout(&mut self, now: Time, sink: &mut dyn Sink) {
        if self.poll_timeout().is_some_and(|at| at <= now) {
            self.skip_gap(now, sink);
        }
    }

    /// When something is missing for too long.
    pub(super) fn poll_timeout(&self) -> Option<Time> {
        self.gap_since.map(|since| since + PATIENCE)
    }

    /// Nothing more will come: what is held is all there is.
    pub(super) fn finish(&mut self, now: Time, sink: &mut dyn Sink) {
        while !self.held.is_empty() {
            self.skip_gap(now, sink);
        }
    }

    fn hold(&mut self, piece: UlogPiece, now: Time, sink: &mut dyn Sink) {
        if self.held.iter().any(|held| held.sequence == piece.sequence) {
            return;
        }
        self.gap_since.get_or_insert(now);
        self.held.push(piece);
        if self.held.len() > HELD {
            self.skip_gap(now, sink);
        }
    }

    /// Goes on with the next piece there is.
    fn skip_gap(&mut self, now: Time, sink: &mut dyn Sink) {
        let expected = self.expected;
        let ahead = |piece: &UlogPiece| piece.sequence.wrapping_sub(expected);
        if let Some(next) = self.held.iter().map(ahead).min() {
            self.gaps += u64::from(next);
            self.expected = expected.wrapping_add(next);
            self.is_lost = true;
            self.partial.clear();
            self.write_dropout(now, sink);
        }
        self.take_held(now, sink);
    }

    /// A message of type O: for how many milliseconds something is missing.
    fn write_dropout(&mut self, now: Time, sink: &mut dyn Sink) {
        let millis = u16::try_from(now.since(self.last).as_millis()).unwrap_or(u16::MAX);
        let [low, high] = millis.max(1).to_le_bytes();
        if sink.write(self.position, &[2, 0, b'O', low, high]) {
            self.position += 5;
        }
    }

    /// Takes the held pieces that are next.
    fn take_held(&mut self, now: Time, sink: &mut dyn Sink) {
        while let Some(at) = self.held.iter().position(|held| held.sequence == self.expected) {
            let piece = self.held.swap_remove(at);
            self.take(&piece, now, sink);
        }
        // What is missing now is another gap.
        self.gap_since = (!self.held.is_empty()).then_some(now);
        if self.held.is_empty() {
            self.held = Vec::new();
        }
    }

    /// Takes the piece that is next.
    fn take(&mut self, piece: &UlogPiece, now: Time, sink: &mut dyn Sink) {
        self.expected = self.expected.wrapping_add(1);
        self.last = now;
        let begin = match (self.is_lost, piece.first) {
            (false, _) => 0,
            (true, Some(first)) => first,
            (true, None) => return,
        };
        self.is_lost = false;
        self.append(&piece.data[begin..], sink);
    }

    /// Writes all messages that are whole now.
    fn append(&mut self, data: &[u8], sink: &mut dyn Sink) {
        self.partial.extend_from_slice(data);
        let mut end = 0;
        while let Some(len) = message_len(&self.partial[end..])
            && end + len <= self.partial.len()
        {
            end += len;
        }
        if end == 0 {
            return;
        }
        if sink.write(self.position, &self.partial[..end]) {
            self.position += end as u64;
            self.partial.drain(..end);
        } else {
            // What was to be written is overwritten by what comes next.
            self.partial.clear();
            self.is_lost = true;
        }
    }
}

fn is_beginning(piece: &UlogPiece) -> bool {
    piece.data.len() >= HEADER && piece.data.starts_with(&MAGIC)
}

/// How long the message is that begins here, if that can be told.
fn message_len(bytes: &[u8]) -> Option<usize> {
    let size = bytes.get(..HEAD)?;
    Some(HEAD + usize::from(u16::from_le_bytes([size[0], size[1]])))
}
