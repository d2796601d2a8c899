//! A scripted ArduPilot, which sends its DataFlash log in blocks.

use std::collections::BTreeSet;

use super::super::dataflash::{START, STOP};
use super::super::message::{BLOCK, Heard, REMOTE_LOG_BLOCK_STATUS, Said};
use super::FlightStack;
use crate::routing::Time;
use crate::test_chance::Chance;

/// How many blocks it has under way at once.
const WINDOW: usize = 80;

/// ArduPilot, as far as its log is concerned.
#[derive(Default)]
pub(in super::super) struct ArduPilot {
    blocks: Vec<[u8; BLOCK]>,
    /// The next block that was never sent, if it is sending.
    pub(in super::super) next: Option<usize>,
    /// Sent and not acknowledged.
    pending: BTreeSet<u32>,
    /// To be sent again.
    again: BTreeSet<u32>,
}

impl ArduPilot {
    /// Another log, of so many blocks.
    pub(in super::super) fn load(&mut self, chance: &mut Chance, blocks: usize) -> Vec<u8> {
        let block = || std::array::from_fn(|_| chance.below(256) as u8);
        self.blocks = std::iter::repeat_with(block).take(blocks).collect();
        self.blocks.concat()
    }

    /// It sends nothing and knows of nothing that it has sent.
    pub(in super::super) fn restart(&mut self) {
        self.next = None;
        self.pending.clear();
        self.again.clear();
    }
}

impl FlightStack for ArduPilot {
    fn hear(&mut self, said: &Said) -> Option<Heard> {
        assert_eq!(said.id, REMOTE_LOG_BLOCK_STATUS);
        let number = u32::from_le_bytes(said.payload[..4].try_into().unwrap());
        match (number, said.payload[6]) {
            (STOP, _) => self.restart(),
            (START, _) => drop(self.next.get_or_insert(0)),
            (number, 0) if self.pending.contains(&number) => drop(self.again.insert(number)),
            (number, 1) => {
                self.pending.remove(&number);
                self.again.remove(&number);
            }
            _ => {}
        }
        None
    }

    /// A block: one that was asked for, the next, or one that nobody has acknowledged.
    fn speak(&mut self, _: Time, chance: &mut Chance) -> Option<Heard> {
        let next = self.next?;
        let is_stuck = self.pending.len() >= WINDOW || next == self.blocks.len();
        let number = if let Some(number) = self.again.pop_first() {
            number
        } else if !is_stuck {
            self.next = Some(next + 1);
            next as u32
        } else {
            *self.pending.first().filter(|_| chance.happens(5))?
        };
        self.pending.insert(number);
        Some(Heard::Block(number, self.blocks[number as usize]))
    }

    fn is_done(&self) -> bool {
        self.next == Some(self.blocks.len()) && self.pending.is_empty()
    }
}
