//! A scripted PX4 on a line that loses, repeats and reorders.

use super::super::stage::Stage;
use super::super::stage::px4::{Px4, log, messages, pieces};
use super::*;

fn stage(seed: u64) -> Stage<Px4, Ulog> {
    Stage::new(seed, Px4::default(), Ulog::new(1))
}

#[test]
fn acknowledged_pieces_all_arrive_whatever_is_lost_repeated_or_late() {
    for seed in 0..20 {
        let mut stage = stage(seed);
        (stage.line.loss, stage.line.repeats, stage.line.reorder) = ((30, 30), 30, 80);
        let log = log(&mut stage.line.chance, 100);
        stage.vehicle.pieces = pieces(&log, usize::MAX);
        stage.want(true);
        stage.run_to_end();
        stage.run(1_000);
        assert!(stage.files.contents() == [&log[..]], "seed {seed}");
        assert_eq!(stage.files.files[0].0, "ulg");
    }
}

#[test]
fn a_log_that_another_client_begins_anew_gets_a_file_of_its_own() {
    let mut stage = stage(3);
    stage.want(true);
    stage.run(20);
    let mut logs = [200, 150].map(|messages| log(&mut stage.line.chance, messages));
    // When it was begun, in microseconds.
    (logs[0][8], logs[1][8]) = (1, 2);
    let [first, second] = logs.each_ref().map(|log| pieces(log, usize::MAX));
    let hear = |stage: &mut Stage<Px4, Ulog>, piece: &UlogPiece| {
        let said = stage.handle(Heard::Ulog(piece.clone()));
        assert_eq!(said, [Said::logging_ack(1, piece.sequence)]);
    };
    first.iter().for_each(|piece| hear(&mut stage, piece));
    // Its beginning once more is no other log.
    hear(&mut stage, &first[0]);
    assert_eq!(stage.files.files.len(), 1);
    stage.files.is_full = true;
    assert_eq!(stage.handle(Heard::Ulog(second[0].clone())), []);
    stage.files.is_full = false;
    second.iter().for_each(|piece| hear(&mut stage, piece));
    assert!(stage.files.contents() == [&logs[0][..], &logs[1][..]]);
}

#[test]
fn pieces_that_overtake_each_other_are_put_in_order() {
    for seed in 0..20 {
        let mut stage = stage(seed);
        (stage.line.repeats, stage.line.reorder) = (20, 20);
        let log = log(&mut stage.line.chance, 3_000);
        stage.vehicle.pieces = pieces(&log, 5);
        stage.want(true);
        stage.run_to_end();
        stage.run(1_000);
        assert!(stage.files.contents() == [&log[..]], "seed {seed}");
    }
}

#[test]
fn behind_a_gap_the_file_goes_on_with_whole_messages_and_a_dropout() {
    for seed in 0..20 {
        let mut stage = stage(seed);
        let log = log(&mut stage.line.chance, 2_000);
        stage.vehicle.pieces = pieces(&log, 5);
        stage.want(true);
        stage.run(20);
        stage.line.loss = (5, 0);
        stage.run_to_end();
        stage.run(1_000);
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
    let mut stage = stage(7);
    (stage.line.loss, stage.line.repeats, stage.line.reorder) = ((10, 10), 10, 5);
    let mut logs = Vec::new();
    for _ in 0..100 {
        let log = log(&mut stage.line.chance, 20);
        stage.vehicle.pieces = pieces(&log, usize::MAX);
        stage.vehicle.waits_for = None;
        logs.push(log);
        stage.want(true);
        stage.run_to_end();
        stage.run(1_000);
        stage.want(false);
        stage.run(8_000);
        assert!(!stage.files.is_open);
    }
    assert!(stage.files.contents() == logs);
}

#[test]
fn a_vehicle_that_restarts_in_flight_begins_another_log() {
    let mut stage = stage(3);
    let first = log(&mut stage.line.chance, 500);
    stage.vehicle.pieces = pieces(&first, 5);
    stage.want(true);
    stage.run(60);
    // It is silent, and knows nothing of us.
    let second = log(&mut stage.line.chance, 500);
    (stage.vehicle.is_streaming, stage.vehicle.waits_for) = (false, None);
    stage.vehicle.pieces = pieces(&second, 5);
    stage.run(10_000);
    stage.run_to_end();
    stage.run(1_000);
    let files = stage.files.contents();
    assert_eq!(files.len(), 2);
    assert!(first.starts_with(files[0]) && !files[0].is_empty());
    assert!(files[1] == second);
}

#[test]
fn a_log_whose_beginning_is_missing_is_begun_anew_and_not_asked_for_without_end() {
    let mut stage = stage(5);
    stage.want(true);
    let mut out = Vec::new();
    for sequence in 100..1_000 {
        let piece = UlogPiece { sequence, wants_ack: false, first: None, data: vec![7; 249] };
        out.extend(stage.handle(Heard::Ulog(piece)));
    }
    assert_eq!(out.len(), 2 * usize::from(STOPS));
    assert!(stage.files.files.is_empty());
}

#[test]
fn what_finds_no_room_is_not_acknowledged_and_so_comes_again() {
    let mut stage = stage(9);
    let log = log(&mut stage.line.chance, 100);
    stage.vehicle.pieces = pieces(&log, usize::MAX);
    stage.want(true);
    stage.run(20);
    stage.files.is_full = true;
    let left = stage.vehicle.pieces.len();
    stage.run(3_000);
    assert!(left > 3 && stage.vehicle.pieces.len() >= left - 1);
    stage.files.is_full = false;
    stage.run_to_end();
    stage.run(1_000);
    assert!(stage.files.contents() == [&log[..]]);
}

/// A stream that somebody else began, a damaged file on the vehicle's card: what does not begin as a
/// ULog does makes no file.
#[test]
fn a_first_piece_with_a_wrong_magic_makes_no_file_and_is_asked_for_anew() {
    let mut stage = stage(4);
    let log = log(&mut stage.line.chance, 50);
    for at in 0..7 {
        stage.want(true);
        let mut piece = pieces(&log, usize::MAX)[0].clone();
        piece.data[at] ^= 1;
        let said = stage.handle(Heard::Ulog(piece));
        assert_eq!(said, [Said::command(1, STOP), Said::command(1, START)], "byte {at}");
        assert!(stage.files.files.is_empty(), "byte {at}");
        stage.act(Session::leave);
    }
    // Too short for a header.
    stage.want(true);
    let mut piece = pieces(&log, usize::MAX)[0].clone();
    piece.data.truncate(15);
    stage.handle(Heard::Ulog(piece));
    assert!(stage.files.files.is_empty());
    // It is streaming, as it was asked to.
    stage.vehicle.pieces = pieces(&log, usize::MAX);
    stage.run_to_end();
    stage.run(2_000);
    assert!(stage.files.contents() == [&log[..]], "the one that begins right is taken");
}
