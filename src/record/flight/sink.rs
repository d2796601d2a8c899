//! Where a flight-stack log is written to: a file that grows, or has holes that are filled later.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use crate::mavlink::MAX_FRAME;
use crate::record::feed::{Feed, Kind, Piece};
use crate::record::flight_files::slot_bit;
use crate::record::status::Shared;

/// Where one log is written to.
pub(super) trait Sink {
    /// A log begins, with this extension; the one before ends.
    fn open(&mut self, extension: &'static str);
    /// Whether so many bytes would be taken now.
    fn has_room(&self, len: usize) -> bool;
    /// Writes bytes at their place; says whether they were taken, which they are if there is room.
    fn write(&mut self, at: u64, bytes: &[u8]) -> bool;
    /// The log ends.
    fn close(&mut self);
}

/// The way to the writer, which the logs of all vehicles share with the telemetry.
#[derive(Clone)]
pub struct FlightFeed {
    feed: Rc<RefCell<Feed>>,
    shared: Arc<Shared>,
}

/// Who opens a file or closes one is not refused: so much is kept free by all others.
const RESERVE: usize = 4 * 1024;

impl FlightFeed {
    pub(in crate::record) fn new(feed: Rc<RefCell<Feed>>, shared: Arc<Shared>) -> Self {
        Self { feed, shared }
    }

    /// Whether the log in this slot broke off, of which nothing more is written; tells it once.
    pub(super) fn take_broken(&self, slot: u8) -> bool {
        let (bit, broken) = (slot_bit(slot), &self.shared.broken);
        broken.load(Ordering::Relaxed) & bit != 0
            && broken.fetch_and(!bit, Ordering::Relaxed) & bit != 0
    }

    /// The sink of the log that has this slot.
    pub(super) fn sink(&self, slot: u8) -> FlightSink<'_> {
        FlightSink { feed: self, slot }
    }
}

impl std::fmt::Debug for FlightFeed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("FlightFeed")
    }
}

/// The sink of one log.
pub(super) struct FlightSink<'a> {
    feed: &'a FlightFeed,
    slot: u8,
}

impl FlightSink<'_> {
    fn push(&self, kind: Kind, number: u64, bytes: &[u8]) -> bool {
        self.feed.feed.borrow_mut().push(Piece { kind, number, slot: self.slot, bytes })
    }
}

impl Sink for FlightSink<'_> {
    fn open(&mut self, extension: &'static str) {
        self.push(Kind::OpenFlight, 0, extension.as_bytes());
    }

    fn has_room(&self, len: usize) -> bool {
        !self.feed.shared.is_failing.load(Ordering::Relaxed)
            && self.feed.feed.borrow().room() >= 2 * len + RESERVE
    }

    fn write(&mut self, at: u64, bytes: &[u8]) -> bool {
        let pieces = bytes.chunks(MAX_FRAME).zip(0..);
        let mut pushed = pieces
            .map(|(piece, number)| self.push(Kind::Flight, at + number * MAX_FRAME as u64, piece));
        pushed.all(|is_taken| is_taken)
    }

    fn close(&mut self) {
        self.push(Kind::EndFlight, 0, &[]);
    }
}
