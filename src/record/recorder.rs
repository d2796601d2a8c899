//! The recorder: the side of the loop, which copies frames to the writer and never waits for it.
//!
//! It decides what is recorded, when a file begins and which time a frame gets; all that touches
//! files is for the writer, a thread of its own.

use std::cell::RefCell;
use std::io;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use super::arming::Arming;
use super::feed::{CAPACITY, Feed, Kind, Piece, feed};
use super::flight::FlightFeed;
use super::status::{RecordStatus, Shared};
use super::store::Store;
use super::tlog::TIMESTAMP;
use super::writer::Writer;
use crate::config::{RecordOptions, RecordWhen};
use crate::mavlink::{CheckedFrame, MessageId};
use crate::routing::Time;

/// Records what it is given; see the module.
pub struct Recorder {
    feed: Rc<RefCell<Feed>>,
    shared: Arc<Shared>,
    /// Says when the writer has ended: nothing ever comes through it.
    has_ended: Receiver<()>,
    when: RecordWhen,
    is_running: bool,
    /// Whether that was said on request, and not by the configuration.
    is_by_request: bool,
    limits: Limits,
    arming: Arming,
    clock: Clock,
    /// The log that is being written, if any.
    log: Option<Log>,
}

/// When another file begins.
struct Limits {
    size: u64,
    time: Duration,
}

/// The log that is being written: how much was handed over for it, and since when.
struct Log {
    size: u64,
    begun: Time,
}

impl Recorder {
    /// Begins to record to the directory of `options`.
    ///
    /// # Errors
    ///
    /// If no directory is named, or the system refuses a thread.
    pub fn start(options: &RecordOptions, now: Time) -> io::Result<Self> {
        let dir = options.dir.clone().ok_or(io::ErrorKind::InvalidInput)?;
        let store = Store { dir, min_free: options.min_free, max_files: options.max_files };
        let shared = Arc::<Shared>::default();
        let (mut feed, drain) = feed(CAPACITY, Arc::clone(&shared));
        let writer = Writer::new(drain, Arc::clone(&shared), store);
        let (ending, has_ended) = channel();
        let run = move || {
            // Dropped when the writer has ended, by which that shows.
            let _ending = ending;
            writer.run();
        };
        let thread = thread::Builder::new().name("record".into()).spawn(run)?;
        feed.set_writer(thread.thread().clone());
        Ok(Self {
            feed: Rc::new(RefCell::new(feed)),
            shared,
            has_ended,
            when: options.when,
            is_running: options.telemetry,
            is_by_request: false,
            limits: Limits { size: options.max_size, time: options.max_time },
            arming: Arming::new(),
            clock: Clock::new(SystemTime::now(), now),
            log: None,
        })
    }

    /// A turn of the loop begins: `wall` was read before `now`.
    pub fn begin_turn(&mut self, wall: SystemTime, now: Time) {
        self.clock.handle(wall, now);
        if self.when == RecordWhen::Armed && self.log.is_some() {
            self.arming.forget(now);
            self.end_unarmed();
        }
    }

    /// Records a frame, if it is to be: a copy goes to the writer, or is counted as lost.
    #[inline(never)]
    pub fn record(&mut self, frame: &CheckedFrame<'_>) {
        if self.when == RecordWhen::Armed && frame.header.id == MessageId::HEARTBEAT {
            self.handle_heartbeat(frame);
        }
        // Rule 60: no key is ever written to a file.
        if self.is_wanted() && frame.header.id != MessageId::SETUP_SIGNING {
            self.push(frame);
        }
    }

    fn push(&mut self, frame: &CheckedFrame<'_>) {
        let is_first = self.log.as_ref().is_none_or(|log| self.limits.end(log, self.clock.now));
        if is_first {
            self.clock.begin();
        }
        let kind = if is_first { Kind::FirstFrame } else { Kind::Frame };
        let piece = Piece { kind, number: self.clock.micros, slot: 0, bytes: frame.bytes };
        if !self.feed.borrow_mut().push(piece) {
            self.shared.overflowed.fetch_add(1, Ordering::Relaxed);
            return;
        }
        if is_first {
            self.log = Some(Log { size: 0, begun: self.clock.now });
        }
        if let Some(log) = &mut self.log {
            log.size += (TIMESTAMP + frame.bytes.len()) as u64;
        }
    }

    /// A turn of the loop is over.
    pub fn end_turn(&mut self) {
        self.feed.borrow_mut().end_turn();
    }

    /// The way of flight-stack logs to the writer.
    pub fn flight_feed(&self) -> FlightFeed {
        FlightFeed::new(Rc::clone(&self.feed), Arc::clone(&self.shared))
    }

    /// Begins or stops to record telemetry, whatever the configuration says; says whether that is a
    /// change.
    pub fn set_running(&mut self, is_running: bool) -> bool {
        let is_change = self.is_running != is_running;
        self.is_running = is_running;
        self.is_by_request |= is_change;
        if !is_running {
            self.end_log();
        }
        is_change
    }

    /// Whether telemetry is recorded, now or as soon as there is something to record.
    pub fn is_running(&self) -> bool {
        self.is_running
    }

    /// Why it writes no telemetry although nothing fails, in words; `None` while it does.
    pub fn reason(&self) -> Option<&'static str> {
        match (self.is_running, self.when) {
            (false, _) if self.is_by_request => {
                Some("by request; `mavswitch record start` goes on")
            }
            (false, _) => Some("record_telemetry is false"),
            (true, RecordWhen::Armed) if !self.arming.is_any() => Some("no vehicle is armed"),
            (true, _) if self.log.is_none() => Some("no frame has come yet"),
            (true, _) => None,
        }
    }

    /// How it is getting on.
    pub fn status(&self) -> RecordStatus {
        self.shared.status()
    }

    /// Has the writer write what waits, and ends it; waits for it until `limit` is over.
    pub fn stop(self, limit: Duration) {
        self.shared.is_ending.store(true, Ordering::Release);
        self.feed.borrow().wake();
        // It tells by hanging up.
        let _ = self.has_ended.recv_timeout(limit);
    }

    /// Whether telemetry is to be recorded now.
    fn is_wanted(&self) -> bool {
        self.is_running && (self.when == RecordWhen::Always || self.arming.is_any())
    }

    fn handle_heartbeat(&mut self, frame: &CheckedFrame<'_>) {
        self.arming.handle(frame, self.clock.now);
        self.end_unarmed();
    }

    fn end_unarmed(&mut self) {
        if !self.arming.is_any() {
            self.end_log();
        }
    }

    fn end_log(&mut self) {
        if self.log.take().is_some() {
            // Without room for it, the next file ends this one.
            let end = Piece { kind: Kind::End, number: 0, slot: 0, bytes: &[] };
            self.feed.borrow_mut().push(end);
        }
    }
}

impl Limits {
    fn end(&self, log: &Log, now: Time) -> bool {
        (self.size != 0 && log.size >= self.size)
            || (!self.time.is_zero() && now.since(log.begun) >= self.time)
    }
}

/// The time that records get: that of the wall clock, but within a file it never steps back.
///
/// When the wall clock is set forward, the time follows; when it is set back, the time goes on as
/// it was until the next file.
struct Clock {
    /// In microseconds since 1970.
    wall: u64,
    now: Time,
    micros: u64,
}

impl Clock {
    fn new(wall: SystemTime, now: Time) -> Self {
        let wall = micros(wall);
        Self { wall, now, micros: wall }
    }

    fn handle(&mut self, wall: SystemTime, now: Time) {
        let elapsed = now.since(self.now).as_micros() as u64;
        (self.wall, self.now) = (micros(wall), now);
        self.micros = self.wall.max(self.micros.saturating_add(elapsed));
    }

    /// A file begins.
    fn begin(&mut self) {
        self.micros = self.wall;
    }
}

fn micros(wall: SystemTime) -> u64 {
    wall.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_micros() as u64)
}

#[cfg(test)]
mod tests;
