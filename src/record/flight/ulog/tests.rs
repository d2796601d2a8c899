//! A scripted PX4 on a line that loses, repeats and reorders.

use std::collections::VecDeque;

use super::super::message::{COMMAND_LONG, LOGGING_ACK};
use super::super::stage::{Chance, Files};
use super::*;

/// A log as PX4 makes it: a header, and messages of all sizes.
fn log(chance: &mut Chance, messages: usize) -> Vec<u8> {
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
fn messages(log: &[u8]) -> Vec<&[u8]> {
    let (mut messages, mut rest) = (Vec::new(), &log[16..]);
    while !rest.is_empty() {
        let len = 3 + usize::from(u16::from_le_bytes([rest[0], rest[1]]));
        messages.push(&rest[..len]);
        rest = &rest[len..];
    }
    messages
}

/// The log in pieces of 249 bytes; the first `acked` of them are sent until they are acknowledged.
fn pieces(log: &[u8], acked: usize) -> VecDeque<UlogPiece> {
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

/// PX4, its line, and us.
struct Stage {
    chance: Chance,
    /// How many of a hundred are lost on the way to us, and on the way back; how many are repeated.
    loss: (u64, u64),
    repeats: u64,
    /// How far behind others pieces may fall.
    reorder: u64,
    pieces: VecDeque<UlogPiece>,
    is_streaming: bool,
    waits_for: Option<(u16, Time)>,
    line: Vec<(Time, Heard)>,
    ulog: Ulog,
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
            pieces: VecDeque::new(),
            is_streaming: false,
            waits_for: None,
            line: Vec::new(),
            ulog: Ulog::new(1),
            files: Files::default(),
            now: Time::ZERO,
        }
    }

    fn want(&mut self, is_wanted: bool) {
        let mut out = Vec::new();
        self.ulog.set_wanted(is_wanted, self.now, &mut self.files, &mut out);
        self.hear(out);
    }

    /// PX4 hears what we say, if it is not lost.
    fn hear(&mut self, said: Vec<Said>) {
        for said in said {
            if self.chance.happens(self.loss.1) {
                continue;
            }
            let short = |at: usize| u16::from_le_bytes([said.payload[at], said.payload[at + 1]]);
            match said.id {
                COMMAND_LONG => {
                    self.is_streaming = short(28) == START;
                    self.send(&Heard::Answer(short(28), ACCEPTED));
                }
                LOGGING_ACK if self.waits_for.is_some_and(|(number, _)| number == short(0)) => {
                    self.waits_for = None;
                    self.pieces.pop_front();
                }
                _ => {}
            }
        }
    }

    fn send(&mut self, heard: &Heard) {
        let copies = 1 + u64::from(self.chance.happens(self.repeats));
        for _ in 0..copies {
            if !self.chance.happens(self.loss.0) {
                let delay = Duration::from_millis(1 + self.chance.below(1 + self.reorder));
                self.line.push((self.now + delay, heard.clone()));
            }
        }
    }

    /// PX4 sends the next piece, or the same again.
    fn speak(&mut self) {
        let Some(piece) = self.pieces.front().filter(|_| self.is_streaming).cloned() else {
            return;
        };
        match self.waits_for {
            Some((_, at)) if self.now < at => {}
            _ if piece.wants_ack => {
                self.waits_for = Some((piece.sequence, self.now + Duration::from_millis(50)));
                self.send(&Heard::Ulog(piece));
            }
            _ => {
                self.pieces.pop_front();
                self.send(&Heard::Ulog(piece));
            }
        }
    }

    /// So much time goes by, a millisecond at a time.
    fn run(&mut self, millis: u64) {
        for _ in 0..millis {
            self.now = self.now + Duration::from_millis(1);
            self.speak();
            let now = self.now;
            let (due, later) =
                std::mem::take(&mut self.line).into_iter().partition(|it| it.0 <= now);
            self.line = later;
            let mut out = Vec::new();
            let due: Vec<(Time, Heard)> = due;
            for (_, heard) in due {
                self.ulog.handle(heard, now, &mut self.files, &mut out);
            }
            if self.ulog.poll_timeout().is_some_and(|at| at <= now) {
                self.ulog.handle_timeout(now, &mut self.files, &mut out);
            }
            self.hear(out);
        }
    }

    /// Runs until PX4 has sent all, and a little longer.
    fn run_to_end(&mut self) {
        for _ in 0..1_000 {
            if self.pieces.is_empty() {
                break;
            }
            self.run(100);
        }
        assert!(self.pieces.is_empty(), "PX4 could not send everything");
        self.run(1_000);
    }
}

#[test]
fn acknowledged_pieces_all_arrive_whatever_is_lost_repeated_or_late() {
    for seed in 0..20 {
        let mut stage = Stage::new(seed);
        (stage.loss, stage.repeats, stage.reorder) = ((30, 30), 30, 80);
        let log = log(&mut stage.chance, 100);
        stage.pieces = pieces(&log, usize::MAX);
        stage.want(true);
        stage.run_to_end();
        assert!(stage.files.contents() == [&log[..]], "seed {seed}");
        assert_eq!(stage.files.files[0].0, "ulg");
    }
}

#[test]
fn pieces_that_overtake_each_other_are_put_in_order() {
    for seed in 0..20 {
        let mut stage = Stage::new(seed);
        (stage.repeats, stage.reorder) = (20, 20);
        let log = log(&mut stage.chance, 3_000);
        stage.pieces = pieces(&log, 5);
        stage.want(true);
        stage.run_to_end();
        assert!(stage.files.contents() == [&log[..]], "seed {seed}");
    }
}

#[test]
fn behind_a_gap_the_file_goes_on_with_whole_messages_and_a_dropout() {
    for seed in 0..20 {
        let mut stage = Stage::new(seed);
        let log = log(&mut stage.chance, 2_000);
        stage.pieces = pieces(&log, 5);
        stage.want(true);
        stage.run(20);
        stage.loss = (5, 0);
        stage.run_to_end();
        let (sent, written) = (messages(&log), stage.files.contents());
        let mut left = sent.iter();
        let mut dropouts = 0;
        for message in messages(written[0]) {
            match message[2] {
                b'O' => dropouts += 1,
                _ => assert!(left.any(|sent| *sent == message), "seed {seed}: never sent"),
            }
        }
        assert!(dropouts > 5, "seed {seed}: {dropouts} dropouts");
    }
}

#[test]
fn a_hundred_armings_make_a_hundred_whole_logs() {
    let mut stage = Stage::new(7);
    (stage.loss, stage.repeats, stage.reorder) = ((10, 10), 10, 5);
    let mut logs = Vec::new();
    for _ in 0..100 {
        let log = log(&mut stage.chance, 20);
        stage.pieces = pieces(&log, usize::MAX);
        stage.waits_for = None;
        logs.push(log);
        stage.want(true);
        stage.run_to_end();
        stage.want(false);
        stage.run(8_000);
        assert!(!stage.files.is_open);
    }
    assert!(stage.files.contents() == logs);
}

#[test]
fn a_vehicle_that_restarts_in_flight_begins_another_log() {
    let mut stage = Stage::new(3);
    let first = log(&mut stage.chance, 500);
    stage.pieces = pieces(&first, 5);
    stage.want(true);
    stage.run(60);
    // It is silent, and knows nothing of us.
    let second = log(&mut stage.chance, 500);
    (stage.is_streaming, stage.waits_for) = (false, None);
    stage.pieces = pieces(&second, 5);
    stage.run(10_000);
    stage.run_to_end();
    let files = stage.files.contents();
    assert_eq!(files.len(), 2);
    assert!(first.starts_with(files[0]) && !files[0].is_empty());
    assert!(files[1] == second);
}

#[test]
fn a_log_whose_beginning_is_missing_is_begun_anew_and_not_asked_for_without_end() {
    let mut stage = Stage::new(5);
    stage.want(true);
    let mut out = Vec::new();
    for sequence in 100..1_000 {
        let piece = UlogPiece { sequence, wants_ack: false, first: None, data: vec![7; 249] };
        stage.ulog.handle(Heard::Ulog(piece), stage.now, &mut stage.files, &mut out);
    }
    assert_eq!(out.len(), 2 * usize::from(STOPS));
    assert!(stage.files.files.is_empty());
}

#[test]
fn what_finds_no_room_is_not_acknowledged_and_so_comes_again() {
    let mut stage = Stage::new(9);
    let log = log(&mut stage.chance, 100);
    stage.pieces = pieces(&log, usize::MAX);
    stage.want(true);
    stage.run(20);
    stage.files.is_full = true;
    let left = stage.pieces.len();
    stage.run(3_000);
    assert!(left > 3 && stage.pieces.len() >= left - 1);
    stage.files.is_full = false;
    stage.run_to_end();
    assert!(stage.files.contents() == [&log[..]]);
}
