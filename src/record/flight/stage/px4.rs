//! A scripted PX4, which streams a ULog.

use std::collections::VecDeque;
use std::time::Duration;

use super::super::message::{COMMAND_LONG, Heard, LOGGING_ACK, START, Said, UlogPiece};
use super::FlightStack;
use crate::routing::Time;
use crate::test_chance::Chance;

/// A log as PX4 makes it: a header, and messages of all sizes.
pub(in super::super) fn log(chance: &mut Chance, messages: usize) -> Vec<u8> {
    let mut log = vec![0x55, 0x4c, 0x6f, 0x67, 0x01, 0x12, 0x35, 1, 0, 0, 0, 0, 0, 0, 0, 0];
    for _ in 0..messages {
        let size = if chance.happens(3) { 600 } else { chance.below(120) as u16 };
        log.extend(size.to_le_bytes());
        log.push(b'D');
        log.extend((0..size).map(|at| at as u8));
    }
    log
}

/// The messages of a log that is whole.
pub(in super::super) fn messages(log: &[u8]) -> Vec<&[u8]> {
    let (mut messages, mut rest) = (Vec::new(), &log[16..]);
    while !rest.is_empty() {
        let len = 3 + usize::from(u16::from_le_bytes([rest[0], rest[1]]));
        messages.push(&rest[..len]);
        rest = &rest[len..];
    }
    messages
}

/// The log in pieces of 249 bytes; the first `acked` of them are sent until they are acknowledged.
pub(in super::super) fn pieces(log: &[u8], acked: usize) -> VecDeque<UlogPiece> {
    let mut starts = vec![0];
    let mut at = 16;
    for message in messages(log) {
        starts.push(at);
        at += message.len();
    }
    let piece = |(number, data): (usize, &[u8])| {
        let begin = number * 249;
        let first = starts.iter().find(|start| **start >= begin).map(|start| start - begin);
        UlogPiece {
            sequence: number as u16,
            wants_ack: number < acked,
            first: first.filter(|first| *first < data.len()),
            data: data.to_vec(),
        }
    };
    log.chunks(249).enumerate().map(piece).collect()
}

/// MAV_RESULT_ACCEPTED.
const ACCEPTED: u8 = 0;

/// PX4, as far as its log is concerned.
#[derive(Default)]
pub(in super::super) struct Px4 {
    /// What is still to be sent.
    pub(in super::super) pieces: VecDeque<UlogPiece>,
    pub(in super::super) is_streaming: bool,
    /// What it sends from the beginning each time it is asked to start, if it is to.
    pub(in super::super) anew: VecDeque<UlogPiece>,
    /// The piece whose acknowledgement is waited for, and until when.
    pub(in super::super) waits_for: Option<(u16, Time)>,
}

impl FlightStack for Px4 {
    fn hear(&mut self, said: &Said) -> Option<Heard> {
        let short = |at: usize| u16::from_le_bytes([said.payload[at], said.payload[at + 1]]);
        match said.id {
            COMMAND_LONG => {
                let is_start = short(28) == START;
                if is_start && !self.is_streaming && !self.anew.is_empty() {
                    (self.pieces, self.waits_for) = (self.anew.clone(), None);
                }
                self.is_streaming = is_start;
                return Some(Heard::Answer(short(28), ACCEPTED));
            }
            LOGGING_ACK if self.waits_for.is_some_and(|(number, _)| number == short(0)) => {
                self.waits_for = None;
                self.pieces.pop_front();
            }
            _ => {}
        }
        None
    }

    /// The next piece, or the same again.
    fn speak(&mut self, now: Time, _: &mut Chance) -> Option<Heard> {
        let piece = self.pieces.front().filter(|_| self.is_streaming).cloned()?;
        match self.waits_for {
            Some((_, at)) if now < at => return None,
            _ if piece.wants_ack => {
                self.waits_for = Some((piece.sequence, now + Duration::from_millis(50)));
            }
            _ => drop(self.pieces.pop_front()),
        }
        Some(Heard::Ulog(piece))
    }

    fn is_done(&self) -> bool {
        self.pieces.is_empty()
    }
}
