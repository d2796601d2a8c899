//! TIMESYNC and PING: by these, components ask each other for their time and for how far they are.
//!
//! A question carries a number of the asker's, which the answer brings back. A TIMESYNC is a
//! question if its `tc1` is zero, whoever it is for. A PING is one only if it is for everybody: for
//! somebody, it is an answer (rule 31).

use super::frame::Frame;
use super::id::Component;
use super::payload::{Fields, Layout, Payload};

const PING: Layout = Layout { id: 4, crc_extra: 237 };
const TIMESYNC: Layout = Layout { id: 111, crc_extra: 34 };

/// A TIMESYNC or PING that was read.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Timing {
    /// TIMESYNC.
    Timesync {
        /// The time of whoever answers, in nanoseconds; 0 in a question.
        tc1: i64,
        /// The time of whoever asked, in nanoseconds.
        ts1: i64,
        /// Whom it is for; system 0 is everybody, and what old senders and MAVLink 1 always say
        /// (rule 29).
        target: Component,
    },
    /// PING.
    Ping {
        /// The time of whoever asked, in microseconds.
        time_us: u64,
        /// The number of the question.
        seq: u32,
        /// Whom it is for.
        target: Component,
    },
}

impl Timing {
    /// What a frame says, if it is one of these.
    pub fn read(frame: &Frame<'_>) -> Option<Self> {
        let fields = Fields(frame);
        if TIMESYNC.is_of(frame) {
            let (tc1, ts1) = (fields.i64(0), fields.i64(8));
            Some(Self::Timesync { tc1, ts1, target: fields.component(16) })
        } else if PING.is_of(frame) {
            let (time_us, seq) = (fields.u64(0), fields.u32(8));
            Some(Self::Ping { time_us, seq, target: fields.component(12) })
        } else {
            None
        }
    }

    /// A TIMESYNC; see [`Timing::Timesync`].
    pub fn timesync(tc1: i64, ts1: i64, to: Component) -> Payload {
        Payload::new(TIMESYNC.id, TIMESYNC.crc_extra, 18)
            .with(0, tc1.to_le_bytes())
            .with(8, ts1.to_le_bytes())
            .with(16, [to.system, to.component])
    }

    /// A PING; see [`Timing::Ping`].
    pub fn ping(time_us: u64, seq: u32, to: Component) -> Payload {
        Payload::new(PING.id, PING.crc_extra, 14)
            .with(0, time_us.to_le_bytes())
            .with(8, seq.to_le_bytes())
            .with(12, [to.system, to.component])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_is_read_again() {
        let (from, to) = (Component::new(1, 191), Component::new(255, 190));
        let read = |payload: Payload| {
            let mut bytes = Vec::new();
            payload.encode(from, 0, &mut bytes);
            Timing::read(&Frame::parse(&bytes).unwrap())
        };
        let timesync = Timing::Timesync { tc1: -5, ts1: 7, target: to };
        assert_eq!(read(Timing::timesync(-5, 7, to)), Some(timesync));
        let ping = Timing::Ping { time_us: 5, seq: 7, target: to };
        assert_eq!(read(Timing::ping(5, 7, to)), Some(ping));
        assert_eq!(read(Payload::new(0, 50, 9)), None);
    }
}
