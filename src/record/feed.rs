//! From the loop to the writer: a bounded ring of pieces, and when the writer is woken.
//!
//! The loop only copies, and never waits: a piece that finds no room is refused. The writer is woken
//! once when something comes while it sleeps, and when half of the ring is full; in between it looks
//! by itself each second. So a flood costs a wake-up a second or a few, and silence costs none.

use std::sync::Arc;
use std::sync::atomic::{Ordering, fence};
use std::thread::Thread;

use ringbuf::traits::{Consumer, Observer, Producer, Split};
use ringbuf::{HeapCons, HeapProd, HeapRb};

use super::status::Shared;
use crate::mavlink::MAX_FRAME;

/// How much may wait for the writer, in bytes: at 20,000 frames a second, the traffic of two seconds.
pub const CAPACITY: usize = 4 * 1024 * 1024;

/// Before each piece: its kind, a number that means what the kind says, its slot and its length.
const HEAD: usize = 12;

/// The longest piece: a frame.
const MAX_PIECE: usize = MAX_FRAME;

/// What a piece is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    /// A frame for the telemetry log; the number is its time.
    Frame,
    /// The same, and a new file begins with it.
    FirstFrame,
    /// The telemetry log ends.
    End,
    /// A flight-stack log begins in this slot; the bytes are its extension.
    OpenFlight,
    /// Bytes of the flight-stack log in this slot; the number is where in the file they stand.
    Flight,
    /// The flight-stack log in this slot ends.
    EndFlight,
}

const KINDS: [Kind; 6] =
    [Kind::Frame, Kind::FirstFrame, Kind::End, Kind::OpenFlight, Kind::Flight, Kind::EndFlight];

/// One piece.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Piece<'a> {
    pub(super) kind: Kind,
    /// Below 2^56.
    pub(super) number: u64,
    pub(super) slot: u8,
    /// At most [`MAX_FRAME`] bytes.
    pub(super) bytes: &'a [u8],
}

/// The end of the loop.
pub(super) struct Feed {
    ring: HeapProd<u8>,
    shared: Arc<Shared>,
    writer: Option<Thread>,
    is_touched: bool,
}

/// The end of the writer.
pub(super) struct Drain {
    ring: HeapCons<u8>,
    buffer: [u8; MAX_PIECE],
}

/// A ring of so many bytes, and both its ends.
pub(super) fn feed(capacity: usize, shared: Arc<Shared>) -> (Feed, Drain) {
    let (producer, consumer) = HeapRb::new(capacity).split();
    let feed = Feed { ring: producer, shared, writer: None, is_touched: false };
    (feed, Drain { ring: consumer, buffer: [0; MAX_PIECE] })
}

impl Feed {
    /// Who is to be woken.
    pub(super) fn set_writer(&mut self, writer: Thread) {
        self.writer = Some(writer);
    }

    /// Hands a piece over, if there is room for it.
    pub(super) fn push(&mut self, piece: Piece<'_>) -> bool {
        let len = piece.bytes.len();
        if len > MAX_PIECE || self.ring.vacant_len() < HEAD + len {
            return false;
        }
        let mut whole = [0; HEAD + MAX_PIECE];
        whole[..8].copy_from_slice(&piece.number.to_le_bytes());
        whole[7] = piece.kind as u8;
        whole[8] = piece.slot;
        // At most `MAX_PIECE`.
        whole[10..HEAD].copy_from_slice(&(len as u16).to_le_bytes());
        whole[HEAD..HEAD + len].copy_from_slice(piece.bytes);
        self.ring.push_slice(&whole[..HEAD + len]);
        self.is_touched = true;
        true
    }

    /// How many bytes find room now, with what goes before each piece.
    pub(super) fn room(&self) -> usize {
        self.ring.vacant_len()
    }

    /// A turn of the loop is over: wakes the writer if it sleeps or has much to do.
    pub(super) fn end_turn(&mut self) {
        if std::mem::take(&mut self.is_touched) {
            // Either the writer sees the piece before it falls asleep, or this sees that it sleeps.
            fence(Ordering::SeqCst);
            let is_much = self.ring.occupied_len() > self.ring.capacity().get() / 2;
            if is_much || self.shared.is_asleep.load(Ordering::Relaxed) {
                self.wake();
            }
        }
    }

    /// Wakes the writer.
    pub(super) fn wake(&self) {
        self.shared.is_asleep.store(false, Ordering::Relaxed);
        if let Some(writer) = &self.writer {
            writer.unpark();
        }
    }
}

impl Drain {
    /// The next piece.
    pub(super) fn next_piece(&mut self) -> Option<Piece<'_>> {
        let mut head = [0; HEAD];
        if self.ring.pop_slice(&mut head) < HEAD {
            return None;
        }
        let len = usize::from(u16::from_le_bytes([head[10], head[11]]));
        // It came in one with its head.
        self.ring.pop_slice(&mut self.buffer[..len]);
        let kind = *KINDS.get(usize::from(head[7]))?;
        let slot = head[8];
        head[7] = 0;
        let number = head.iter().take(8).rev().fold(0, |sum, byte| sum << 8 | u64::from(*byte));
        Some(Piece { kind, number, slot, bytes: &self.buffer[..len] })
    }

    /// Whether nothing waits.
    pub(super) fn is_empty(&self) -> bool {
        self.ring.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(number: u64, bytes: &[u8]) -> Piece<'_> {
        Piece { kind: Kind::Flight, number, slot: 3, bytes }
    }

    #[test]
    fn pieces_come_out_as_they_went_in_round_and_round() {
        let (mut feed, mut drain) = feed(700, Arc::default());
        for number in 0..1_000 {
            let bytes = [number as u8; MAX_PIECE];
            let len = number as usize * 7 % (MAX_PIECE + 1);
            assert!(feed.push(piece(number, &bytes[..len])));
            assert_eq!(drain.next_piece(), Some(piece(number, &bytes[..len])));
        }
        assert!(drain.is_empty());
        assert_eq!(drain.next_piece(), None);
    }

    #[test]
    fn what_finds_no_room_is_refused_whole() {
        let (mut feed, mut drain) = feed(100, Arc::default());
        assert!(feed.push(piece((1 << 56) - 1, &[1; 60])));
        assert!(!feed.push(piece(2, &[2; 60])));
        assert!(feed.push(piece(3, &[3; 10])));
        assert_eq!(drain.next_piece(), Some(piece((1 << 56) - 1, &[1; 60])));
        assert_eq!(drain.next_piece(), Some(piece(3, &[3; 10])));
        assert_eq!(drain.next_piece(), None);
    }
}
