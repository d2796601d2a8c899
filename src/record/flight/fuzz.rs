//! For a fuzzer: whatever a vehicle sends as its log, what is written is a log, and nothing grows
//! without limit.

use std::time::Duration;

use super::dataflash::Dataflash;
use super::message::{
    BLOCK, Heard, LOGGER, LOGGING_DATA, LOGGING_DATA_ACKED, REMOTE_LOG_DATA_BLOCK, Said,
};
use super::session::{Session, Turn};
use super::sink::Sink;
use super::ulog::Ulog;
use crate::mavlink::{Component, Frame, FrameSpec, MessageId};
use crate::routing::Time;

/// What a vehicle may send: message ids with their CRC_EXTRA, and where in each stands whom it is for.
const MESSAGES: [(MessageId, u8, usize); 4] = [
    (MessageId::COMMAND_ACK, 143, 8),
    (LOGGING_DATA, 193, 2),
    (LOGGING_DATA_ACKED, 35, 2),
    (REMOTE_LOG_DATA_BLOCK, 159, 4),
];

/// The most that may be said at once: an acknowledgement and 16 blocks that are asked for, and a log
/// that is asked for anew.
const SAID: usize = 20;

/// The most that a session may hold back, in bytes: pieces that came early, and a part of the longest
/// message.
const HELD: usize = 96 * 1024;

/// Plays `data` to a session: its first byte chooses the flight stack; then come steps of a byte
/// that says what happens, and one of how long that takes. What is sent has a length and a payload.
///
/// # Panics
///
/// If something is written that is no log, more is said or held back than should be, or a time is
/// told that has passed.
pub fn fuzz_flight(data: &[u8]) {
    let [stack, steps @ ..] = data else { return };
    let (mut session, mut file): (Box<dyn Session>, _) = match stack % 2 {
        0 => (Box::new(Ulog::new(1)), File { is_ulog: true, ..File::default() }),
        _ => (Box::new(Dataflash::new(1)), File::default()),
    };
    let (mut now, mut steps) = (Time::ZERO, steps);
    while let [what, wait, rest @ ..] = steps {
        now = now + Duration::from_millis(10 * u64::from(*wait));
        let mut out = Vec::new();
        if session.poll_timeout().is_some_and(|at| at <= now) {
            let mut turn = Turn { now, sink: &mut file, out: &mut out };
            session.handle_timeout(&mut turn);
            assert!(session.poll_timeout().is_none_or(|at| at > now), "it never rests");
        }
        steps = step(&mut *session, *what, rest, &mut file, now, &mut out);
        assert!(out.len() <= 2 * SAID, "{} messages at once", out.len());
        assert!(session.held() <= HELD, "{} bytes are held", session.held());
    }
    let mut out = Vec::new();
    session.leave(&mut Turn { now, sink: &mut file, out: &mut out });
    assert!(!file.is_open && session.poll_timeout().is_none());
}

/// Does one thing; what is left of the steps.
fn step<'a>(
    session: &mut dyn Session,
    what: u8,
    rest: &'a [u8],
    file: &mut File,
    now: Time,
    out: &mut Vec<Said>,
) -> &'a [u8] {
    let place = usize::from(what % 8);
    if let (Some(message), [len, payload @ ..]) = (MESSAGES.get(place), rest) {
        let (payload, rest) = payload.split_at(usize::from(*len).min(payload.len()));
        let heard = heard(*message, payload);
        file.last = None;
        if let Some(heard) = heard {
            if let Heard::Block(number, bytes) = &heard {
                file.last = Some((u64::from(*number) * BLOCK as u64, *bytes));
            }
            session.handle(heard, &mut Turn { now, sink: file, out });
        }
        return rest;
    }
    file.is_full ^= place == 6;
    let turn = &mut Turn { now, sink: file, out };
    match place {
        4 => session.set_wanted(what & 0x80 != 0, turn),
        5 => session.handle_reboot(turn),
        7 => session.leave(turn),
        _ => {}
    }
    rest
}

/// What is heard of a message, which is for us.
fn heard((id, crc_extra, to): (MessageId, u8, usize), payload: &[u8]) -> Option<Heard> {
    let mut whole = payload.to_vec();
    whole.resize(payload.len().max(to + 2), 0);
    whole[to..to + 2].copy_from_slice(&[1, LOGGER]);
    let spec = FrameSpec::new(Component::new(1, 1), id, crc_extra, &whole);
    Heard::read(&Frame::parse(&spec.to_frame()).ok()?)
}

/// What was written, as far as it has to be known.
#[derive(Default)]
struct File {
    is_ulog: bool,
    is_open: bool,
    is_full: bool,
    /// How much of a ULog was written.
    len: u64,
    /// The block that is just heard, and where it belongs.
    last: Option<(u64, [u8; BLOCK])>,
}

impl File {
    /// A header, and then whole messages, one behind the other.
    fn assert_ulog(&self, at: u64, bytes: &[u8]) {
        assert_eq!(at, self.len, "a ULog has no holes");
        if at == 0 {
            assert!(bytes.starts_with(b"ULog") && bytes.len() == 16, "no header of a ULog");
            return;
        }
        let mut rest = bytes;
        while let [low, high, tail @ ..] = rest {
            let len = 1 + usize::from(u16::from_le_bytes([*low, *high]));
            assert!(len <= tail.len(), "no whole message");
            rest = &tail[len..];
        }
        assert!(rest.is_empty(), "no whole message");
    }
}

impl Sink for File {
    fn open(&mut self, extension: &'static str) {
        assert!(!self.is_open, "a log is open already");
        assert_eq!(extension == "ulg", self.is_ulog);
        (self.is_open, self.len) = (true, 0);
    }

    fn has_room(&self, _: usize) -> bool {
        !self.is_full
    }

    fn write(&mut self, at: u64, bytes: &[u8]) -> bool {
        assert!(self.is_open, "written to a log that is closed");
        if self.is_ulog {
            self.assert_ulog(at, bytes);
            self.len += bytes.len() as u64;
        } else {
            let is_heard = self.last.is_some_and(|last| last.0 == at && last.1 == bytes);
            assert!(is_heard, "no block that was sent");
        }
        true
    }

    fn close(&mut self) {
        assert!(self.is_open, "no log is open");
        self.is_open = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_chance::Chance;

    /// A step that sends this piece of a ULog, or this block.
    fn sent(what: u8, head: &[u8], data: &[u8]) -> Vec<u8> {
        [&[what, 1, (head.len() + data.len()) as u8], head, data].concat()
    }

    #[test]
    fn exercise_fuzz_flight() {
        fuzz_flight(&[]);
        let header = [&b"ULog\x01\x12\x35"[..], &[0; 9]].concat();
        for stack in 0..2 {
            for seed in 0..300 {
                let mut chance = Chance::new(seed);
                let mut data = vec![stack, 0x84, 1];
                data.extend(sent(2, &[0, 0, 1, 155, 16, 0], &header));
                for _ in 0..200 {
                    let what = chance.below(64) as u8;
                    let number = chance.below(40) as u8;
                    let noise: Vec<u8> =
                        (0..chance.below(200)).map(|_| chance.below(8) as u8).collect();
                    let head = match what % 8 {
                        1 | 2 => vec![number, 0, 1, 155, noise.len() as u8, 0],
                        3 => vec![number, 0, 0, 0, 1, 155],
                        _ => Vec::new(),
                    };
                    match what % 8 {
                        0..=3 => data.extend(sent(what, &head, &noise)),
                        _ => data.extend([what | number << 7, number]),
                    }
                }
                fuzz_flight(&data);
            }
        }
    }
}
