//! TIMESYNC and PING: by these, components ask each other for their time and for how far they are.
//!
//! A question carries a number of the asker's, which the answer brings back. A TIMESYNC is a
//! question if its `tc1` is zero, whoever it is for. A PING is one only if it is for everybody: for
//! somebody, it is an answer (rule 31).

use super::frame::Frame;
use super::id::{Component, MessageId};
use super::payload::{Fields, Layout, Payload};

const PING: Layout = Layout::new(4, 237);
const TIMESYNC: Layout = Layout::new(111, 34);

const EVERYBODY: Component = Component::new(0, 0);

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
    /// The definitions of both.
    pub const LAYOUTS: [Layout; 2] = [PING, TIMESYNC];

    /// Their message ids.
    pub const IDS: [MessageId; 2] = [PING.id, TIMESYNC.id];

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

    /// Whom it is for.
    pub fn target(self) -> Component {
        let (Self::Timesync { target, .. } | Self::Ping { target, .. }) = self;
        target
    }

    /// The answer, if it is a question, to the one who asked; `nanos` is the time of whoever answers.
    pub fn answer(self, asker: Component, nanos: i64) -> Option<Payload> {
        // An answer to system 0 would be for everybody, and a PING for everybody is a question.
        if asker.system == 0 {
            return None;
        }
        match self {
            // With 0 the answer would be a question.
            Self::Timesync { tc1: 0, ts1, .. } => Some(Self::timesync(nanos.max(1), ts1, asker)),
            Self::Ping { time_us, seq, target: EVERYBODY } => Some(Self::ping(time_us, seq, asker)),
            Self::Timesync { .. } | Self::Ping { .. } => None,
        }
    }

    /// A TIMESYNC; see [`Timing::Timesync`].
    pub fn timesync(tc1: i64, ts1: i64, to: Component) -> Payload {
        Payload::new(TIMESYNC, 18)
            .with(0, tc1.to_le_bytes())
            .with(8, ts1.to_le_bytes())
            .with(16, [to.system, to.component])
    }

    /// A PING; see [`Timing::Ping`].
    pub fn ping(time_us: u64, seq: u32, to: Component) -> Payload {
        Payload::new(PING, 14)
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
        assert_eq!(read(Payload::new(Layout::new(0, 50), 9)), None);
    }

    #[test]
    fn questions_are_answered_and_answers_are_not() {
        let asker = Component::new(255, 190);
        let answered = |timing: Timing, asker, nanos| timing.answer(asker, nanos).is_some();
        let question = Timing::Timesync { tc1: 0, ts1: 7, target: EVERYBODY };
        let ping = Timing::Ping { time_us: 5, seq: 7, target: EVERYBODY };
        let answer = Timing::Timesync { tc1: 9, ts1: 7, target: asker };
        let pong = Timing::Ping { time_us: 5, seq: 7, target: asker };
        let nobody = Component::new(0, 0);
        for timing in [question, ping] {
            assert!(answered(timing, asker, 9) && !answered(timing, nobody, 9), "{timing:?}");
        }
        assert!(!answered(answer, asker, 9) && !answered(pong, asker, 9));
        let mut bytes = Vec::new();
        question.answer(asker, 0).unwrap().encode(Component::new(1, 1), 0, &mut bytes);
        let read = Timing::read(&Frame::parse(&bytes).unwrap()).unwrap();
        assert_eq!(read, Timing::Timesync { tc1: 1, ts1: 7, target: asker }, "no question");
    }
}
