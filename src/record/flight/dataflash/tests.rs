//! A scripted ArduPilot on a line that loses, repeats and reorders.

use super::super::stage::Stage;
use super::super::stage::ardupilot::ArduPilot;
use super::*;

fn stage(seed: u64) -> Stage<ArduPilot, Dataflash> {
    Stage::new(seed, ArduPilot::default(), Dataflash::new(1))
}

#[test]
fn every_block_arrives_whatever_is_lost_repeated_or_late() {
    for seed in 0..20 {
        let mut stage = stage(seed);
        (stage.line.loss, stage.line.repeats, stage.line.reorder) = ((20, 20), 20, 60);
        let log = stage.vehicle.load(&mut stage.line.chance, 1_000);
        stage.want(true);
        stage.run_to_end();
        assert!(stage.files.contents() == [&log[..]], "seed {seed}");
        assert_eq!(stage.files.files[0].0, "bin");
    }
}

#[test]
fn without_room_no_log_begins_and_its_first_block_is_not_acknowledged() {
    let mut stage = stage(2);
    stage.want(true);
    stage.files.is_full = true;
    assert_eq!(stage.handle(Heard::Block(0, [0; BLOCK])), []);
    assert!(stage.files.files.is_empty());
}

#[test]
fn a_missing_block_is_asked_for_by_its_own_number() {
    let mut stage = stage(1);
    stage.want(true);
    let mut out = Vec::new();
    for number in [0, 1, 4] {
        let block = Heard::Block(number, [0; BLOCK]);
        out.extend(stage.handle(block));
    }
    let told: Vec<_> = out.iter().map(|said| (said.payload[0], said.payload[6])).collect();
    assert_eq!(told, [(0, 1), (1, 1), (4, 1), (2, 0), (3, 0)]);
}

#[test]
fn a_hundred_armings_make_a_hundred_whole_logs() {
    let mut stage = stage(4);
    (stage.line.loss, stage.line.repeats, stage.line.reorder) = ((5, 5), 5, 5);
    let mut logs = Vec::new();
    for _ in 0..100 {
        logs.push(stage.vehicle.load(&mut stage.line.chance, 30));
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
    let mut stage = stage(8);
    let first = stage.vehicle.load(&mut stage.line.chance, 1_000);
    stage.want(true);
    stage.run(300);
    stage.vehicle.restart();
    let second = stage.vehicle.load(&mut stage.line.chance, 400);
    stage.run(12_000);
    stage.run_to_end();
    let files = stage.files.contents();
    assert_eq!(files.len(), 2);
    assert!(first.starts_with(files[0]) && files[0].len() > 100 * BLOCK);
    assert!(files[1] == second);
}

#[test]
fn a_log_that_was_begun_for_somebody_else_is_begun_anew() {
    let mut stage = stage(2);
    let log = stage.vehicle.load(&mut stage.line.chance, 1_000);
    stage.vehicle.next = Some(400);
    stage.want(true);
    stage.run_to_end();
    assert!(stage.files.contents() == [&log[..]]);
}

#[test]
fn what_finds_no_room_is_not_acknowledged_and_so_comes_again() {
    let mut stage = stage(6);
    let log = stage.vehicle.load(&mut stage.line.chance, 300);
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
    let mut stage = stage(6);
    stage.want(true);
    let mut out = Vec::new();
    for number in [0, 1_000_000, 2_000_000_000] {
        let block = Heard::Block(number, [1; BLOCK]);
        out.extend(stage.handle(block));
    }
    assert_eq!(stage.files.files[0].1.len(), BLOCK);
    assert_eq!(out.len(), 1);
}

#[test]
fn of_many_missing_blocks_only_some_are_asked_for_at_once_and_all_in_turn() {
    let mut stage = stage(0);
    stage.want(true);
    let out = stage.handle(Heard::Block(99, [7; BLOCK]));
    assert_eq!(out.len(), 1 + 16, "the block is acknowledged, and 16 of 99 are asked for");
    let mut asked = out.len() - 1;
    for round in 1..7 {
        stage.now = Time::from_millis(300 * round);
        let out = stage.act(Session::handle_timeout);
        asked += out.iter().filter(|said| **said != stage.session.status(START, true)).count();
    }
    assert_eq!(asked, 7 * 16);
    let log = stage.session.log.as_ref().unwrap();
    assert!(log.missing.values().all(|asked| *asked >= 1), "{:?}", log.missing);
}
