//! What is recorded, when files begin, and which times they get, with the real writer.

use std::fs::{self, File};
use std::path::PathBuf;

use super::super::tlog::TlogReader;
use super::*;
use crate::mavlink::{Checker, Component, Dialect, FrameSpec, Input, Splitter};
use crate::record::RecordState;
use crate::test_dir::TestDir;

const LIMIT: Duration = Duration::from_secs(60);

/// A recorder, the directory it writes to, and the time.
struct Stage {
    dir: TestDir,
    recorder: Recorder,
    now: Time,
    wall: u64,
}

impl Stage {
    fn new(set: impl FnOnce(&mut RecordOptions)) -> Self {
        let dir = TestDir::new();
        let mut options =
            RecordOptions { dir: Some(dir.path().to_owned()), ..RecordOptions::default() };
        options.min_free = 0;
        set(&mut options);
        let recorder = Recorder::start(&options, Time::ZERO).unwrap();
        Self { dir, recorder, now: Time::ZERO, wall: 1_700_000_000_000_000 }
    }

    /// A turn that lasts so many microseconds, with these frames.
    fn turn(&mut self, micros: u64, frames: &[Vec<u8>]) {
        self.now = self.now + Duration::from_micros(micros);
        self.wall += micros;
        let wall = UNIX_EPOCH + Duration::from_micros(self.wall);
        self.recorder.begin_turn(wall, self.now);
        let mut checker = Checker::new(Dialect::builtin());
        for frame in frames {
            let mut buffer = [vec![0; Splitter::CARRY], frame.clone()].concat();
            let mut splitter = Splitter::new();
            let mut cutter = splitter.cut(&mut buffer, frame.len(), Input::Paused);
            self.recorder.record(&cutter.next(&mut checker).unwrap());
        }
        self.recorder.end_turn();
    }

    /// Waits until so many frames are written.
    fn until_written(&self, frames: u64) {
        let end = std::time::Instant::now() + LIMIT;
        while self.recorder.status().frames < frames {
            assert!(std::time::Instant::now() < end, "{:?}", self.recorder.status());
            thread::sleep(Duration::from_millis(5));
        }
    }

    /// Ends it, and reads what the files have: times since the start, and frames.
    fn end(self) -> Vec<Vec<(i64, Vec<u8>)>> {
        self.recorder.stop(LIMIT);
        let files = fs::read_dir(self.dir.path()).unwrap().map(|entry| entry.unwrap().path());
        let mut files: Vec<PathBuf> = files.collect();
        files.sort();
        files.iter().map(read).collect()
    }
}

fn read(file: &PathBuf) -> Vec<(i64, Vec<u8>)> {
    let mut reader = TlogReader::new(File::open(file).unwrap());
    let mut records = Vec::new();
    while let Some(record) = reader.next_record().unwrap() {
        let since = record.micros as i64 - 1_700_000_000_000_000;
        records.push((since, record.frame.bytes().to_vec()));
    }
    assert_eq!(reader.stats().skipped_bytes, 0);
    records
}

fn frame(id: u32, crc_extra: u8, payload: &[u8], signature: Option<[u8; 13]>) -> Vec<u8> {
    frame_of(Component::new(1, 1), id, crc_extra, payload, signature)
}

fn frame_of(
    source: Component,
    id: u32,
    crc_extra: u8,
    payload: &[u8],
    signature: Option<[u8; 13]>,
) -> Vec<u8> {
    let spec = FrameSpec::new(source, MessageId(id), crc_extra, payload);
    FrameSpec { signature, ..spec }.to_frame()
}

/// A heartbeat of an autopilot (3) or of a ground station (8).
fn heartbeat(autopilot: u8, base_mode: u8) -> Vec<u8> {
    heartbeat_of(Component::new(1, 1), autopilot, base_mode)
}

fn heartbeat_of(source: Component, autopilot: u8, base_mode: u8) -> Vec<u8> {
    frame_of(source, 0, 50, &[0, 0, 0, 0, 2, autopilot, base_mode, 4, 3], None)
}

fn attitude(number: u8) -> Vec<u8> {
    frame(30, 39, &[number + 1; 28], None)
}

fn counts(files: &[Vec<(i64, Vec<u8>)>]) -> Vec<usize> {
    files.iter().map(Vec::len).collect()
}

#[test]
fn every_frame_stands_in_the_file_with_the_time_of_its_turn() {
    let mut stage = Stage::new(|_| {});
    stage.turn(0, &[attitude(1), attitude(2)]);
    stage.turn(500, &[attitude(3)]);
    let expected = [(0, attitude(1)), (0, attitude(2)), (500, attitude(3))];
    assert_eq!(stage.end(), [expected.to_vec()]);
}

#[test]
fn rule_60_no_signature_and_no_key_is_recorded() {
    let mut stage = Stage::new(|_| {});
    let key = frame(256, 71, &[7; 42], None);
    let signed = frame(30, 39, &[3; 28], Some([9; 13]));
    stage.turn(0, &[signed, key, attitude(4)]);
    let frames: Vec<_> = stage.end().remove(0).into_iter().map(|(_, frame)| frame).collect();
    assert_eq!(frames, [attitude(2), attitude(4)]);
}

#[test]
fn each_arming_begins_a_file_and_a_ground_station_arms_nobody() {
    let mut stage = Stage::new(|options| options.when = RecordWhen::Armed);
    stage.turn(0, &[heartbeat(3, 0), attitude(1), heartbeat(8, 0x80), attitude(2)]);
    for _ in 0..3 {
        stage.turn(9, &[heartbeat(3, 0x80), attitude(3)]);
        stage.turn(9, &[heartbeat(8, 0), attitude(4)]);
        stage.turn(9, &[heartbeat(3, 0), attitude(5)]);
    }
    assert_eq!(counts(&stage.end()), [4, 4, 4]);
}

#[test]
fn a_companion_of_an_armed_vehicle_neither_ends_nor_begins_a_file() {
    let mut stage = Stage::new(|options| options.when = RecordWhen::Armed);
    let companion = |autopilot, mode| {
        let source = Component::new(1, 191);
        heartbeat_of(source, autopilot, mode)
    };
    stage.turn(0, &[companion(0, 0x80), attitude(1)]);
    for autopilot in [0, 3, 8] {
        stage.turn(9, &[heartbeat(3, 0x80), companion(autopilot, 0), attitude(2)]);
    }
    stage.turn(9, &[heartbeat(3, 0), companion(3, 0x80), attitude(3)]);
    // Three times the two heartbeats and the message.
    assert_eq!(counts(&stage.end()), [9]);
}

#[test]
fn who_spoke_for_a_vehicle_and_has_vanished_makes_room_for_another() {
    let mut stage = Stage::new(|options| options.when = RecordWhen::Armed);
    let autopilot = |component, mode| heartbeat_of(Component::new(1, component), 3, mode);
    stage.turn(0, &[autopilot(190, 0), attitude(1)]);
    stage.turn(59_000_000, &[autopilot(191, 0x80), attitude(2)]);
    stage.turn(1_000_000, &[autopilot(191, 0x80), attitude(3)]);
    stage.turn(9, &[autopilot(190, 0), attitude(4)]);
    assert_eq!(counts(&stage.end()), [4]);
}

#[test]
fn the_file_of_a_vehicle_that_vanishes_armed_ends_after_a_minute() {
    let mut stage = Stage::new(|options| options.when = RecordWhen::Armed);
    stage.turn(0, &[heartbeat(3, 0x80), attitude(1)]);
    stage.turn(59_000_000, &[attitude(2)]);
    stage.turn(1_000_000, &[attitude(3)]);
    stage.turn(1, &[heartbeat(3, 0x80), attitude(4)]);
    assert_eq!(counts(&stage.end()), [3, 2]);
}

#[test]
fn a_file_ends_at_its_size_and_at_its_time() {
    let mut stage = Stage::new(|options| options.max_size = 3 * 48);
    assert_eq!(attitude(0).len() + TIMESTAMP, 48);
    for number in 0..7 {
        stage.turn(1, &[attitude(number)]);
    }
    assert_eq!(counts(&stage.end()), [3, 3, 1]);
    let mut stage = Stage::new(|options| options.max_time = Duration::from_secs(1));
    for number in 0..5 {
        stage.turn(400_000, &[attitude(number)]);
    }
    assert_eq!(counts(&stage.end()), [3, 2]);
}

#[test]
fn a_clock_that_is_set_back_and_forth_leaves_the_times_of_a_file_in_order() {
    let mut stage = Stage::new(|options| options.max_size = 6 * 48);
    for (number, jump) in
        [0, -3_600_000_000, 0, 7_200_000_000, -9_000_000_000, 0, 0].iter().enumerate()
    {
        stage.wall = stage.wall.strict_add_signed(*jump);
        stage.turn(1_000, &[attitude(number as u8)]);
    }
    let files = stage.end();
    let times: Vec<Vec<i64>> =
        files.iter().map(|file| file.iter().map(|record| record.0).collect()).collect();
    // It follows a clock that is set forward, and one that is set back from the next file on.
    let forward = 3_600_000_000;
    let first = vec![1_000, 2_000, 3_000, forward + 4_000, forward + 5_000, forward + 6_000];
    assert_eq!(times, [first, vec![-5_400_000_000 + 7_000]]);
}

#[test]
fn a_stop_ends_the_file_and_a_start_begins_another() {
    let mut stage = Stage::new(|_| {});
    stage.turn(0, &[attitude(1)]);
    assert!(stage.recorder.set_running(false));
    stage.turn(1, &[attitude(2)]);
    assert!(!stage.recorder.set_running(false));
    assert!(stage.recorder.set_running(true));
    stage.turn(1, &[attitude(3)]);
    assert_eq!(counts(&stage.end()), [1, 1]);
}

#[test]
fn a_directory_that_vanishes_is_made_again_and_recording_goes_on() {
    let mut stage = Stage::new(|options| {
        options.dir = options.dir.as_ref().map(|dir| dir.join("card"));
    });
    stage.turn(0, &[attitude(1)]);
    stage.until_written(1);
    let card = stage.dir.path().join("card");
    fs::remove_dir_all(&card).unwrap();
    // That it has vanished shows when something is written.
    let mut number = 0;
    while !card.exists() {
        number += 1;
        stage.turn(1, &[attitude(2)]);
        thread::sleep(Duration::from_millis(20));
        assert!(number < 3_000, "{:?}", stage.recorder.status());
    }
    stage.turn(1, &[attitude(3)]);
    let path = stage.recorder.status().file;
    stage.recorder.stop(LIMIT);
    let file = path.filter(|path| path.exists());
    let file = file.unwrap_or_else(|| fs::read_dir(&card).unwrap().next().unwrap().unwrap().path());
    assert_eq!(read(&file).last().unwrap().1, attitude(3));
}

#[test]
fn what_cannot_be_written_is_counted_and_recording_resumes_by_itself() {
    let mut stage = Stage::new(|options| {
        options.dir = options.dir.as_ref().map(|dir| dir.join("card"));
    });
    let card = stage.dir.path().join("card");
    // A file in the place of the directory: nothing can be made in it.
    fs::write(&card, "").unwrap();
    let mut sent = 0;
    while stage.recorder.status().lost == 0 {
        sent += 1;
        stage.turn(1, &[attitude(1)]);
        thread::sleep(Duration::from_millis(5));
        assert!(sent < 3_000, "{:?}", stage.recorder.status());
    }
    let status = stage.recorder.status();
    assert_eq!((status.state, status.frames), (RecordState::Failing, 0));
    assert!(status.error.is_some());
    fs::remove_file(&card).unwrap();
    while stage.recorder.status().frames == 0 {
        sent += 1;
        stage.turn(1, &[attitude(2)]);
        thread::sleep(Duration::from_millis(5));
        assert!(sent < 10_000, "{:?}", stage.recorder.status());
    }
    assert_eq!(stage.recorder.status().state, RecordState::Recording);
    let shared = Arc::clone(&stage.recorder.shared);
    stage.recorder.stop(LIMIT);
    let status = shared.status();
    assert_eq!(status.frames + status.lost, sent);
}
