//! The router's side of a link: what waits for it, at which pace it leaves, and what was counted.

use std::time::Duration;

use super::counters::{DropReason, LinkCounters};
use super::filter::Filter;
use super::gate::Gate;
use super::group::{GroupId, Quality};
use super::options::{Capacity, LinkOptions};
use super::pacer::Pacer;
use super::path_loss::PathLoss;
use super::queue::{Frames, Precedence, Queue, QueueLimits};
use super::queue_age::QueueAge;
use super::rate_limit::RateLimiter;
use super::time::Time;
use crate::mavlink::{CheckedFrame, MAX_FRAME, MessageId};

/// A link, as the router knows it.
pub struct Port {
    pub(super) options: LinkOptions,
    pub(super) counters: LinkCounters,
    queue: Queue,
    age: QueueAge,
    pacer: Option<Pacer>,
    filter_in: Filter,
    filter_out: Filter,
    limiter: RateLimiter,
    /// Tells it from the link that had its number before.
    pub(super) life: u8,
    pub(super) opened: Time,
    last_heard: Option<Time>,
    /// The same, but for what a radio says of itself.
    last_carried: Option<Time>,
    loss: PathLoss,
    /// What frames have to pass, if the user asks for that.
    pub(super) gate: Option<Box<Gate>>,
}

/// The longest queue of a paced link, in bytes.
const LONGEST: usize = 256 * 1_024;

/// Where RADIO_STATUS and RADIO say how much of the radio's buffer is free, in per cent.
const TXBUF: u8 = 6;

impl Port {
    pub(super) fn new(mut options: LinkOptions, life: u8, now: Time) -> Self {
        let caps = std::mem::take(&mut options.caps);
        let pacer = match options.capacity {
            Capacity::Bytes(_) => None,
            Capacity::Paced { rate, .. } => Some(Pacer::new(rate, now)),
        };
        Self {
            queue: Queue::new(limits(options.capacity, pacer.as_ref())),
            age: QueueAge::default(),
            pacer,
            filter_in: Filter::new(&options.filter_in),
            filter_out: Filter::new(&options.filter_out),
            limiter: RateLimiter::new(caps),
            counters: LinkCounters::default(),
            life,
            opened: now,
            last_heard: None,
            last_carried: None,
            loss: PathLoss::default(),
            gate: None,
            options,
        }
    }

    /// Treats the link in another way from now on; what waits and what was counted stays.
    pub(super) fn set_options(&mut self, mut options: LinkOptions, now: Time) {
        self.limiter.set_caps(std::mem::take(&mut options.caps));
        self.filter_in = Filter::new(&options.filter_in);
        self.filter_out = Filter::new(&options.filter_out);
        match options.capacity {
            Capacity::Bytes(_) => self.pacer = None,
            Capacity::Paced { rate, .. } if self.line_rate() == Some(rate) => {}
            Capacity::Paced { rate, .. } => self.pacer = Some(Pacer::new(rate, now)),
        }
        self.queue.set_limits(limits(options.capacity, self.pacer.as_ref()));
        self.options = options;
    }

    /// What the user or the line says of the pace; a radio may have lowered it.
    fn line_rate(&self) -> Option<u32> {
        self.pacer.as_ref().map(Pacer::line_rate)
    }

    /// How the link is treated, all but the caps on messages.
    pub fn options(&self) -> &LinkOptions {
        &self.options
    }

    /// Whether a frame that came from this link is taken.
    #[inline]
    pub(super) fn takes(&self, frame: &CheckedFrame<'_>) -> bool {
        self.filter_in.permits(&frame.header)
    }

    /// Queues a frame, or counts why not.
    #[inline]
    pub(super) fn offer(&mut self, frame: &CheckedFrame<'_>, precedence: Precedence, now: Time) {
        match self.refusal(frame, precedence, now) {
            Some(reason) => self.counters[reason] += 1,
            None => self.queue(frame, precedence, now),
        }
    }

    /// Queues a frame that nothing speaks against; if there is no room after all, that is counted.
    #[inline]
    pub(super) fn queue(&mut self, frame: &CheckedFrame<'_>, precedence: Precedence, now: Time) {
        if self.queue.push(frame.bytes, precedence).is_ok() {
            self.limiter.count(frame.header.source, frame.header.id, now);
            self.counters.frames_out += 1;
            self.counters.bytes_out += frame.bytes.len() as u64;
        } else {
            self.counters[DropReason::QueueFull] += 1;
        }
    }

    /// Why a frame is not queued, if it is not.
    #[inline]
    pub(super) fn refusal(
        &self,
        frame: &CheckedFrame<'_>,
        precedence: Precedence,
        now: Time,
    ) -> Option<DropReason> {
        let header = &frame.header;
        if !self.filter_out.permits(header) {
            Some(DropReason::FilteredOut)
        } else if !self.queue.has_room(frame.bytes.len(), precedence) {
            Some(DropReason::QueueFull)
        } else if !self.limiter.permits(header.source, header.id, now) {
            Some(DropReason::RateCap)
        } else {
            None
        }
    }

    /// A verified frame came from this link, after so many that were lost on it.
    #[inline]
    pub(super) fn handle_heard(&mut self, id: MessageId, lost: u8, now: Time) {
        self.last_heard = Some(now);
        if !is_radio_report(id) {
            self.last_carried = Some(now);
            self.loss.hear(id, lost);
        }
    }

    /// A heartbeat was lost on this link. While nothing comes at all, that alone says enough.
    pub(super) fn handle_missed_heartbeat(&mut self, now: Time) {
        if self.quality().is_alive(now) {
            self.loss.miss_heartbeat();
        }
    }

    /// A radio on this link reports: the link is sent more or less accordingly.
    pub(super) fn handle_radio_status(&mut self, frame: &CheckedFrame<'_>, now: Time) {
        debug_assert!(is_radio_report(frame.header.id));
        if let Some(pacer) = &mut self.pacer {
            pacer.handle_radio_status(frame.payload_byte(TXBUF), now);
            self.queue.set_limits(limits(self.options.capacity, Some(pacer)));
        }
    }

    /// Changes the line rate, as when another baud rate is tried.
    pub fn set_line_rate(&mut self, bytes_per_second: u32, now: Time) {
        if let Some(pacer) = &mut self.pacer {
            *pacer = Pacer::new(bytes_per_second, now);
            self.queue.set_limits(limits(self.options.capacity, Some(pacer)));
            if let Capacity::Paced { rate, .. } = &mut self.options.capacity {
                *rate = bytes_per_second;
            }
        }
    }

    /// How many of the bytes that wait may be sent now: whole frames, and the rest of one that was
    /// begun.
    pub fn sendable(&mut self, now: Time) -> usize {
        self.age.look(self.queue.len(), now);
        match &mut self.pacer {
            None => self.queue.len(),
            Some(pacer) => {
                if pacer.forget_radio(now) {
                    self.queue.set_limits(limits(self.options.capacity, Some(pacer)));
                }
                let budget = pacer.budget(now);
                if budget == 0 { 0 } else { self.queue.whole_frames_within(budget) }
            }
        }
    }

    /// The first `count` bytes that wait, in two pieces, for a stream.
    pub fn head(&mut self, count: usize) -> (&[u8], &[u8]) {
        self.queue.head(count)
    }

    /// The frames that wait, for datagrams.
    pub fn frames(&mut self) -> Frames<'_> {
        self.queue.frames()
    }

    /// Takes out the first `count` bytes: they were sent.
    ///
    /// # Panics
    ///
    /// If there are not so many.
    pub fn consume(&mut self, count: usize) {
        self.queue.consume(count);
        self.age.consume(count, self.queue.len());
        if let Some(pacer) = &mut self.pacer {
            pacer.consume(count);
        }
    }

    /// Takes out the first `count` bytes, whole frames: they cannot be sent. They are counted as that,
    /// and no longer as sent.
    ///
    /// # Panics
    ///
    /// If there are not so many.
    pub fn lose(&mut self, count: usize) {
        let mut seen = 0;
        let is_lost = |(first, second): &(&[u8], &[u8])| {
            seen += first.len() + second.len();
            seen <= count
        };
        let frames = self.queue.frames().take_while(is_lost).count() as u64;
        self.consume(count);
        self.counters[DropReason::Unsendable] += frames;
        self.counters.frames_out = self.counters.frames_out.saturating_sub(frames);
        self.counters.bytes_out = self.counters.bytes_out.saturating_sub(count as u64);
    }

    /// Whether a frame of any length would be taken now.
    pub fn has_room(&self, precedence: Precedence) -> bool {
        self.queue.has_room(MAX_FRAME, precedence)
    }

    /// Whether a frame of this length would be taken now.
    pub(super) fn has_room_for(&self, len: usize, precedence: Precedence) -> bool {
        self.queue.has_room(len, precedence)
    }

    /// How many bytes wait.
    pub fn backlog(&self) -> usize {
        self.queue.len()
    }

    /// How long the oldest of them has waited, at most; it may be half of that where the queue is
    /// never empty.
    pub fn queue_age(&self, now: Time) -> Duration {
        self.age.get(now)
    }

    /// How many bytes may wait.
    pub fn queue_limit(&self) -> usize {
        self.queue.limits().total
    }

    /// Whether it is time to send, before the turn is over.
    #[inline]
    pub(super) fn is_filling(&self) -> bool {
        self.pacer.is_none() && self.queue.is_filling()
    }

    /// The group of links that lead the same way.
    pub(super) fn group(&self) -> Option<GroupId> {
        self.options.membership.map(|membership| membership.group)
    }

    /// Whether what came over another link before shows the way to its source all the same.
    pub(super) fn learns_of_copies(&self) -> bool {
        self.options.membership.is_some() || self.options.dedup.is_none()
    }

    /// When the pace lets more leave; `None` if nothing waits, or if there is no pace.
    pub fn ready_at(&self, now: Time) -> Option<Time> {
        let pacer = self.pacer.as_ref()?;
        (!self.queue.is_empty()).then(|| pacer.ready_at(now))
    }

    /// The pace, in bytes a second.
    pub fn rate(&self) -> Option<u32> {
        self.pacer.as_ref().map(Pacer::rate)
    }

    /// What was counted.
    pub fn counters(&self) -> &LinkCounters {
        &self.counters
    }

    /// How good the link is.
    pub fn quality(&self) -> Quality {
        let backlog = self.queue.len() * 1_024 / self.queue.limits().total;
        Quality {
            last_heard: self.last_heard,
            last_carried: self.last_carried,
            loss: self.loss.get(),
            backlog: backlog as u32,
        }
    }
}

/// Whether a radio says this of itself to whoever it is plugged into, also with nobody at the far end
/// (rule 46).
pub(super) fn is_radio_report(id: MessageId) -> bool {
    matches!(id, MessageId::RADIO_STATUS | MessageId::RADIO)
}

/// How much may wait, at the pace of now.
fn limits(capacity: Capacity, pacer: Option<&Pacer>) -> QueueLimits {
    let bytes = match (capacity, pacer) {
        (Capacity::Paced { queue_time, .. }, Some(pacer)) => {
            let bytes = u64::from(pacer.rate()) * queue_time.as_millis() as u64 / 1_000;
            usize::try_from(bytes).map_or(LONGEST, |bytes| bytes.min(LONGEST))
        }
        (Capacity::Paced { .. }, None) => 0,
        (Capacity::Bytes(bytes), _) => bytes,
    };
    QueueLimits::with_total(bytes)
}
