//! A scripted ArduPilot on a line that loses, repeats and reorders.

use std::collections::BTreeSet;

use super::super::message::REMOTE_LOG_BLOCK_STATUS;
use super::super::stage::{Chance, Files};
use super::*;

/// ArduPilot, its line, and us.
struct Stage {
    chance: Chance,
    loss: (u64, u64),
    repeats: u64,
    reorder: u64,
    blocks: Vec<[u8; BLOCK]>,
    /// The next block that was never sent, if it is sending.
    next: Option<usize>,
    /// Sent and not acknowledged.
    pending: BTreeSet<u32>,
    /// To be sent again.
    again: BTreeSet<u32>,
    line: Vec<(Time, Heard)>,
    dataflash: Dataflash,
    files: Files,
    now: Time,
}

impl Stage {
    fn new(seed: u64) -> Self {
        Self {
            chance: Chance::new(seed),
            loss: (0, 0),
            repeats: 0,
            reorder: 0,
            blocks: Vec::new(),
            next: None,
            pending: BTreeSet::new(),
            again: BTreeSet::new(),
            line: Vec::new(),
            dataflash: Dataflash::new(1),
            files: Files::default(),
            now: Time::ZERO,
        }
    }

    /// Another log, of so many blocks.
    fn load(&mut self, blocks: usize) -> Vec<u8> {
        let chance = &mut self.chance;
        self.blocks =
            (0..blocks).map(|_| std::array::from_fn(|_| chance.below(256) as u8)).collect();
        self.blocks.concat()
    }

    fn want(&mut self, is_wanted: bool) {
        let mut out = Vec::new();
        self.dataflash.set_wanted(is_wanted, self.now, &mut self.files, &mut out);
        self.hear(&out);
    }

    fn hear(&mut self, said: &[Said]) {
        for said in said {
            assert_eq!(said.id, REMOTE_LOG_BLOCK_STATUS);
            if self.chance.happens(self.loss.1) {
                continue;
            }
            let number = u32::from_le_bytes(said.payload[..4].try_into().unwrap());
            match (number, said.payload[6]) {
                (STOP, _) => self.restart(),
                (START, _) if self.next.is_none() => self.next = Some(0),
                (START, _) => {}
                (number, 0) if self.pending.contains(&number) => drop(self.again.insert(number)),
                (number, 1) => {
                    self.pending.remove(&number);
                    self.again.remove(&number);
                }
                _ => {}
            }
        }
    }

    /// It sends nothing and knows of nothing that it has sent.
    fn restart(&mut self) {
        self.next = None;
        self.pending.clear();
        self.again.clear();
    }

    /// Sends a block: one that was asked for, the next, or one that nobody has acknowledged.
    fn speak(&mut self) {
        let Some(next) = self.next else { return };
        let is_stuck = self.pending.len() >= 80 || next == self.blocks.len();
        let number = if let Some(number) = self.again.pop_first() {
            number
        } else if !is_stuck {
            self.next = Some(next + 1);
            next as u32
        } else if let Some(number) = self.pending.first().filter(|_| self.chance.happens(5)) {
            *number
        } else {
            return;
        };
        self.pending.insert(number);
        let heard = Heard::Block(number, self.blocks[number as usize]);
        for _ in 0..1 + u64::from(self.chance.happens(self.repeats)) {
            if !self.chance.happens(self.loss.0) {
                let delay = Duration::from_millis(1 + self.chance.below(1 + self.reorder));
                self.line.push((self.now + delay, heard.clone()));
            }
        }
    }

    fn run(&mut self, millis: u64) {
        for _ in 0..millis {
            self.now = self.now + Duration::from_millis(1);
            self.speak();
            let now = self.now;
            let line = std::mem::take(&mut self.line);
            let (due, later): (Vec<_>, Vec<_>) = line.into_iter().partition(|it| it.0 <= now);
            self.line = later;
            let mut out = Vec::new();
            for (_, heard) in due {
                self.dataflash.handle(&heard, now, &mut self.files, &mut out);
            }
            if self.dataflash.poll_timeout().is_some_and(|at| at <= now) {
                self.dataflash.handle_timeout(now, &mut self.files, &mut out);
            }
            self.hear(&out);
        }
    }

    /// Runs until everything is sent and acknowledged.
    fn run_to_end(&mut self) {
        let is_done =
            |stage: &Self| stage.next == Some(stage.blocks.len()) && stage.pending.is_empty();
        for _ in 0..2_000 {
            if is_done(self) {
                break;
            }
            self.run(50);
        }
        assert!(is_done(self), "{} blocks are not acknowledged", self.pending.len());
    }
}

#[test]
fn every_block_arrives_whatever_is_lost_repeated_or_late() {
    for seed in 0..20 {
        let mut stage = Stage::new(seed);
        (stage.loss, stage.repeats, stage.reorder) = ((20, 20), 20, 60);
        let log = stage.load(1_000);
        stage.want(true);
        stage.run_to_end();
        assert!(stage.files.contents() == [&log[..]], "seed {seed}");
        assert_eq!(stage.files.files[0].0, "bin");
    }
}

#[test]
fn a_missing_block_is_asked_for_by_its_own_number() {
    let mut stage = Stage::new(1);
    stage.want(true);
    let mut out = Vec::new();
    for number in [0, 1, 4] {
        let block = Heard::Block(number, [0; BLOCK]);
        stage.dataflash.handle(&block, stage.now, &mut stage.files, &mut out);
    }
    let told: Vec<_> = out.iter().map(|said| (said.payload[0], said.payload[6])).collect();
    assert_eq!(told, [(0, 1), (1, 1), (4, 1), (2, 0), (3, 0)]);
}

#[test]
fn a_hundred_armings_make_a_hundred_whole_logs() {
    let mut stage = Stage::new(4);
    (stage.loss, stage.repeats, stage.reorder) = ((5, 5), 5, 5);
    let mut logs = Vec::new();
    for _ in 0..100 {
        logs.push(stage.load(30));
        stage.want(true);
        stage.run_to_end();
        stage.want(false);
        stage.run(4_000);
        assert!(!stage.files.is_open);
    }
    assert!(stage.files.contents() == logs);
}

#[test]
fn a_vehicle_that_restarts_in_flight_begins_another_log() {
    let mut stage = Stage::new(8);
    let first = stage.load(1_000);
    stage.want(true);
    stage.run(300);
    stage.restart();
    let second = stage.load(400);
    stage.run(12_000);
    stage.run_to_end();
    let files = stage.files.contents();
    assert_eq!(files.len(), 2);
    assert!(first.starts_with(files[0]) && files[0].len() > 100 * BLOCK);
    assert!(files[1] == second);
}

#[test]
fn a_log_that_was_begun_for_somebody_else_is_begun_anew() {
    let mut stage = Stage::new(2);
    let log = stage.load(1_000);
    stage.next = Some(400);
    stage.want(true);
    stage.run_to_end();
    assert!(stage.files.contents() == [&log[..]]);
}

#[test]
fn what_finds_no_room_is_not_acknowledged_and_so_comes_again() {
    let mut stage = Stage::new(6);
    let log = stage.load(300);
    stage.want(true);
    stage.run(50);
    stage.files.is_full = true;
    stage.run(2_000);
    stage.files.is_full = false;
    stage.run_to_end();
    assert!(stage.files.contents() == [&log[..]]);
}

#[test]
fn a_number_that_is_far_ahead_makes_no_file_of_any_size() {
    let mut stage = Stage::new(6);
    stage.want(true);
    let mut out = Vec::new();
    for number in [0, 1_000_000, 2_000_000_000] {
        let block = Heard::Block(number, [1; BLOCK]);
        stage.dataflash.handle(&block, stage.now, &mut stage.files, &mut out);
    }
    assert_eq!(stage.files.files[0].1.len(), BLOCK);
    assert_eq!(out.len(), 1);
}

#[test]
fn of_many_missing_blocks_only_some_are_asked_for_at_once_and_all_in_turn() {
    let (mut dataflash, mut files) = (Dataflash::new(1), Files::default());
    dataflash.set_wanted(true, Time::ZERO, &mut files, &mut Vec::new());
    let block = Heard::Block(99, [7; BLOCK]);
    let mut out = Vec::new();
    dataflash.handle(&block, Time::ZERO, &mut files, &mut out);
    assert_eq!(out.len(), 1 + 16, "the block is acknowledged, and 16 of 99 are asked for");
    let mut asked = out.len() - 1;
    for round in 1..7 {
        out.clear();
        dataflash.handle_timeout(Time::from_millis(300 * round), &mut files, &mut out);
        asked += out.iter().filter(|said| **said != dataflash.status(START, true)).count();
    }
    assert_eq!(asked, 7 * 16);
    let log = dataflash.log.as_ref().unwrap();
    assert!(log.missing.values().all(|asked| *asked >= 1), "{:?}", log.missing);
}
