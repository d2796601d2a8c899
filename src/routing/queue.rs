//! A link's transmit queue: whole frames or nothing, first in first out, bounded.
//!
//! Frames stand in the ring as they go on the wire, one behind the other; their own headers tell
//! where each ends. Frames are refused when they arrive, never taken out of the middle: out of
//! order they would look like loss to a ground station and like a replay to a signature check.

use ringbuf::LocalRb;
use ringbuf::storage::Heap;
use ringbuf::traits::Observer;

use crate::mavlink::{MAX_FRAME, frame_len_of};

/// The queue has no room for this frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Full;

/// Which frames are refused first when a link is congested.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Precedence {
    /// Broadcast telemetry: the next one replaces it soon.
    Routine,
    /// Directed frames, and answers that name nobody: only this one will do.
    Immediate,
    /// Heartbeats and acknowledgements: few, and everything else hangs on them.
    Flash,
}

/// How much may wait in a queue, in bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct QueueLimits {
    /// For routine frames: what is above is kept free for the others.
    pub routine: usize,
    /// For immediate frames, likewise.
    pub immediate: usize,
    /// For all frames.
    pub total: usize,
}

impl QueueLimits {
    /// Room for `total` bytes, a part of it for those who need it more; at least for three of the
    /// longest frames in all.
    pub fn with_total(total: usize) -> Self {
        let total = total.max(3 * MAX_FRAME);
        Self { routine: total * 6 / 10, immediate: total * 9 / 10, total }
    }
}

/// The transmit queue of one link.
pub struct Queue {
    ring: LocalRb<Heap<u8>>,
    limits: QueueLimits,
    /// How much of the frame at the front is yet to be sent, if a part of it has been.
    torn: usize,
}

impl Queue {
    /// An empty queue.
    ///
    /// # Panics
    ///
    /// If `limits.total` is zero.
    pub fn new(limits: QueueLimits) -> Self {
        Self { ring: LocalRb::new(limits.total), limits, torn: 0 }
    }

    /// Whether a frame of this length fits in.
    #[inline]
    pub fn has_room(&self, len: usize, precedence: Precedence) -> bool {
        let limit = match precedence {
            Precedence::Routine => self.limits.routine,
            Precedence::Immediate => self.limits.immediate,
            Precedence::Flash => self.limits.total,
        };
        self.len() + len <= limit
    }

    /// Takes a frame in, whole.
    ///
    /// # Errors
    ///
    /// [`Full`] if it would pass the limit of its precedence; the queue is then as it was.
    #[inline]
    pub fn push(&mut self, frame: &[u8], precedence: Precedence) -> Result<(), Full> {
        if !self.has_room(frame.len(), precedence) {
            return Err(Full);
        }
        self.ring.push_slice(frame);
        Ok(())
    }

    /// How many bytes wait.
    #[inline]
    pub fn len(&self) -> usize {
        self.ring.occupied_len()
    }

    /// Whether nothing waits.
    pub fn is_empty(&self) -> bool {
        self.ring.is_empty()
    }

    /// Whether it is time to send, if that is possible at all: routine frames may soon be refused.
    #[inline]
    pub fn is_filling(&self) -> bool {
        self.len() > self.limits.routine / 2
    }

    /// Everything that waits, in two pieces, for a stream.
    pub fn as_slices(&mut self) -> (&[u8], &[u8]) {
        self.ring.as_slices()
    }

    /// The first `count` bytes that wait, in two pieces.
    pub fn head(&mut self, count: usize) -> (&[u8], &[u8]) {
        let (first, second) = self.ring.as_slices();
        let from_first = count.min(first.len());
        let from_second = (count - from_first).min(second.len());
        (&first[..from_first], &second[..from_second])
    }

    /// How many bytes to send if a frame may begin only within the first `budget` bytes.
    pub fn whole_frames_within(&mut self, budget: usize) -> usize {
        if budget >= self.len() {
            return self.len();
        }
        let mut end = self.torn;
        let mut frames = self.frames();
        while end < budget
            && let Some((first, second)) = frames.next()
        {
            end += first.len() + second.len();
        }
        end
    }

    /// How much may wait.
    pub fn limits(&self) -> QueueLimits {
        self.limits
    }

    /// Changes how much may wait. What waits already stays, also where that is more.
    pub fn set_limits(&mut self, limits: QueueLimits) {
        self.limits = limits;
        if limits.total > self.ring.capacity().get() {
            let mut ring = LocalRb::new(limits.total);
            let (first, second) = self.ring.as_slices();
            ring.push_slice(first);
            ring.push_slice(second);
            self.ring = ring;
        }
    }

    /// The frames that wait, each in two pieces (the second mostly empty), for datagrams.
    ///
    /// A frame of which a part has been sent is left out.
    pub fn frames(&mut self) -> Frames<'_> {
        let (first, second) = self.ring.as_slices();
        let mut frames = Frames { first, second };
        frames.cut(self.torn);
        frames
    }

    /// Takes out the first `count` bytes: they were sent.
    ///
    /// # Panics
    ///
    /// If there are not so many.
    pub fn consume(&mut self, count: usize) {
        assert!(count <= self.len(), "more was sent than waited");
        self.torn = self.rest_after(count);
        self.ring.skip(count);
    }

    /// How much of a frame remains when the first `count` bytes are gone.
    fn rest_after(&mut self, count: usize) -> usize {
        if count == self.len() {
            return 0;
        }
        let mut end = self.torn;
        let mut frames = self.frames();
        while end < count {
            // Not yet at `count`, so not at the end: there is one more.
            let Some((first, second)) = frames.next() else {
                break;
            };
            end += first.len() + second.len();
        }
        end - count
    }
}

/// Frames joined to datagrams; see [`Frames::packed`].
#[derive(Clone, Copy, Debug)]
pub struct Packed<'a> {
    frames: Frames<'a>,
    longest: usize,
}

impl<'a> Iterator for Packed<'a> {
    type Item = (&'a [u8], &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let mut ahead = self.frames;
        let len = |(first, second): (&[u8], &[u8])| first.len() + second.len();
        let mut end = len(ahead.next()?);
        while let Some(more) = ahead.next().map(len)
            && end + more <= self.longest
        {
            end += more;
        }
        Some(self.frames.cut(end))
    }
}

/// Walks over the frames of a queue.
#[derive(Clone, Copy, Debug)]
pub struct Frames<'a> {
    first: &'a [u8],
    second: &'a [u8],
}

impl<'a> Frames<'a> {
    /// Joins frames that follow each other to datagrams of at most `longest` bytes; a frame that is
    /// longer goes alone.
    pub fn packed(self, longest: usize) -> Packed<'a> {
        Packed { frames: self, longest }
    }

    fn cut(&mut self, len: usize) -> (&'a [u8], &'a [u8]) {
        let from_first = len.min(self.first.len());
        let (head, rest) = self.first.split_at(from_first);
        let (tail, second) = self.second.split_at(len - from_first);
        (self.first, self.second) =
            if rest.is_empty() { (second, &second[..0]) } else { (rest, second) };
        // A frame may begin in the second piece only.
        if head.is_empty() { (tail, &[]) } else { (head, tail) }
    }

    fn byte(&self, at: usize) -> Option<u8> {
        let beyond = || self.second.get(at.wrapping_sub(self.first.len()));
        self.first.get(at).or_else(beyond).copied()
    }
}

impl<'a> Iterator for Frames<'a> {
    type Item = (&'a [u8], &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let len = frame_len_of(self.byte(0)?, self.byte(1)?, self.byte(2)?);
        Some(self.cut(len))
    }
}

/// Pushes and consumes as `data` says, beside a plain vector that does the same.
///
/// # Fuzzing
///
/// Asserts that the bytes come out as they went in, and that frames are whole.
pub fn fuzz_queue(data: &[u8]) {
    let mut queue = Queue::new(QueueLimits::with_total(0));
    let mut model: Vec<Vec<u8>> = Vec::new();
    let mut sent = 0;
    for (step, operation) in data.chunks_exact(2).enumerate() {
        if operation[0] % 2 == 0 {
            let mut frame = vec![step as u8; usize::from(operation[1]) + 12];
            frame[..3].copy_from_slice(&[crate::mavlink::STX_V2, operation[1], 0]);
            let fits = queue.push(&frame, Precedence::Flash).is_ok();
            assert_eq!(fits, model.concat().len() - sent + frame.len() <= queue.limits.total);
            model.extend(fits.then_some(frame));
        } else {
            let count = usize::from(operation[1]) * 8 % (queue.len() + 1);
            queue.consume(count);
            sent += count;
            while model.first().is_some_and(|frame| frame.len() <= sent) {
                sent -= model.remove(0).len();
            }
        }
        let (first, second) = queue.as_slices();
        assert_eq!([first, second].concat(), model.concat()[sent..]);
        let frames: Vec<Vec<u8>> = queue.frames().map(|(a, b)| [a, b].concat()).collect();
        assert_eq!(frames, model[usize::from(sent > 0)..]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(len: u8) -> Vec<u8> {
        let mut frame = vec![len; usize::from(len) + 12];
        frame[..3].copy_from_slice(&[crate::mavlink::STX_V2, len, 0]);
        frame
    }

    #[test]
    fn rule_43_a_frame_goes_in_whole_or_not_at_all() {
        let mut queue = Queue::new(QueueLimits { routine: 60, immediate: 80, total: 100 });
        assert_eq!(queue.push(&frame(38), Precedence::Routine), Ok(()));
        assert_eq!(queue.push(&frame(0), Precedence::Routine), Err(Full));
        assert_eq!(queue.push(&frame(3), Precedence::Immediate), Ok(()));
        assert_eq!(queue.push(&frame(10), Precedence::Immediate), Err(Full));
        assert_eq!(queue.push(&frame(23), Precedence::Flash), Ok(()));
        assert_eq!(queue.push(&frame(0), Precedence::Flash), Err(Full));
        assert_eq!(queue.len(), 100);
    }

    #[test]
    fn a_queue_that_is_made_longer_keeps_what_waits() {
        let mut queue = Queue::new(QueueLimits { routine: 30, immediate: 30, total: 30 });
        queue.push(&frame(8), Precedence::Immediate).unwrap();
        queue.consume(20);
        queue.push(&frame(8), Precedence::Immediate).unwrap();
        queue.consume(5);
        queue.set_limits(QueueLimits { routine: 100, immediate: 100, total: 100 });
        queue.push(&frame(20), Precedence::Immediate).unwrap();
        let (first, second) = queue.as_slices();
        assert_eq!([first, second].concat(), [&frame(8)[5..], &frame(20)].concat());
        assert_eq!(queue.frames().count(), 1);
    }

    #[test]
    fn a_budget_lets_whole_frames_begin() {
        let mut queue = Queue::new(QueueLimits::with_total(0));
        for _ in 0..3 {
            queue.push(&frame(8), Precedence::Routine).unwrap();
        }
        let sendable = [0, 1, 20, 21, 40, 41, 99].map(|budget| queue.whole_frames_within(budget));
        assert_eq!(sendable, [0, 20, 20, 40, 40, 60, 60]);
        queue.consume(5);
        assert_eq!(queue.whole_frames_within(1), 15, "the rest of the torn one");
        assert_eq!(queue.head(15).0.len(), 15);
    }

    #[test]
    fn frames_are_packed_into_datagrams() {
        let mut queue = Queue::new(QueueLimits::with_total(0));
        for len in [8, 8, 8, 200, 8] {
            queue.push(&frame(len), Precedence::Routine).unwrap();
        }
        let packed = queue.frames().packed(45).map(|(a, b)| a.len() + b.len());
        assert_eq!(packed.collect::<Vec<_>>(), [40, 20, 212, 20]);
    }

    #[test]
    fn after_a_short_write_the_rest_of_the_frame_comes_first() {
        let mut queue = Queue::new(QueueLimits::with_total(0));
        queue.push(&frame(10), Precedence::Routine).unwrap();
        queue.push(&frame(20), Precedence::Routine).unwrap();
        queue.consume(5);
        assert_eq!(queue.as_slices().0[..17], frame(10)[5..]);
        assert_eq!(queue.frames().count(), 1);
        queue.consume(17);
        assert_eq!(queue.frames().count(), 1);
        queue.consume(32);
        assert!(queue.is_empty());
    }

    #[test]
    fn exercise_fuzz_queue() {
        let mut state = 1_u32;
        let operations: Vec<u8> = (0..8_000)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 24) as u8
            })
            .collect();
        fuzz_queue(&operations);
    }
}
