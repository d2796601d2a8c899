//! Several vehicles at once, each on a line of its own, with the real writer.

mod armings;

use std::time::{Duration, Instant};
use std::{fs, io, thread};

use super::super::message::{STOP, UlogPiece};
use super::super::stage::ardupilot::ArduPilot;
use super::super::stage::px4::{Px4, log, pieces};
use super::super::stage::{FlightStack, Line, frame, from_autopilot};
use super::*;
use crate::record::{RecordState, RecordStatus, Recorder};
use crate::test_chance::Chance;
use crate::test_dir::TestDir;

const LIMIT: Duration = Duration::from_secs(60);

/// A vehicle and the line to it.
struct Pilot {
    system: u8,
    autopilot: u8,
    vehicle: Box<dyn FlightStack>,
    line: Line,
}

impl Pilot {
    fn new(system: u8, autopilot: u8, vehicle: Box<dyn FlightStack>) -> Self {
        Self { system, autopilot, vehicle, line: Line::new(system.into()) }
    }

    fn heartbeat(&self, mode: u8) -> Vec<u8> {
        let payload = [0, 0, 0, 0, 2, self.autopilot, mode, 4, 3];
        from_autopilot(self.system, MessageId::HEARTBEAT, 50, &payload)
    }
}

/// Some vehicles, a collector, and the recorder that it belongs to.
struct Stage {
    dir: TestDir,
    recorder: Recorder,
    collector: Collector,
    pilots: Vec<Pilot>,
    now: Time,
}

impl Stage {
    fn new(pilots: Vec<Pilot>) -> Self {
        Self::recording(RecordWhen::Always, pilots)
    }

    fn recording(when: RecordWhen, pilots: Vec<Pilot>) -> Self {
        let dir = TestDir::new();
        let options = RecordOptions {
            dir: Some(dir.path().to_owned()),
            when,
            min_free: 0,
            flight_log: FlightLog::Auto,
            ..RecordOptions::default()
        };
        let recorder = Recorder::start(&options, Time::ZERO).unwrap();
        let collector = Collector::new(&options, recorder.flight_feed());
        Self { dir, recorder, collector, pilots, now: Time::ZERO }
    }

    fn hear(&mut self, bytes: &[u8]) {
        self.collector.handle_frame(&Frame::parse(bytes).unwrap(), self.now);
    }

    /// All heartbeats are heard, of vehicles that are armed.
    fn greet(&mut self) {
        self.beat(Heartbeat::ARMED);
    }

    fn beat(&mut self, mode: u8) {
        let heartbeats: Vec<_> = self.pilots.iter().map(|it| it.heartbeat(mode)).collect();
        heartbeats.iter().for_each(|heartbeat| self.hear(heartbeat));
    }

    /// What the collector has to say, and to which system.
    fn said(&mut self) -> Vec<(u8, Said)> {
        let (mut said, mut out) = (Vec::new(), Vec::new());
        while self.collector.poll_transmit(self.now, &mut out) {
            let frame = Frame::parse(&out).unwrap();
            let header = frame.header();
            let mut payload = [0; 33];
            payload[..frame.payload().len()].copy_from_slice(frame.payload());
            let len = payload.len();
            said.push((header.source.system, Said { id: header.id, crc_extra: 0, len, payload }));
            out.clear();
        }
        said
    }

    fn run(&mut self, millis: u64) {
        for _ in 0..millis {
            self.now = self.now + Duration::from_millis(1);
            for at in 0..self.pilots.len() {
                let Pilot { system, vehicle, line, .. } = &mut self.pilots[at];
                let system = *system;
                for heard in line.pass(&mut **vehicle, self.now) {
                    self.hear(&frame(system, &heard));
                }
            }
            for (system, said) in self.said() {
                let pilot = self.pilots.iter_mut().find(|pilot| pilot.system == system).unwrap();
                pilot.line.tell(&mut *pilot.vehicle, &said, self.now);
            }
            self.recorder.end_turn();
        }
    }

    fn run_to_end(&mut self) {
        for _ in 0..2_000 {
            if self.pilots.iter().all(|pilot| pilot.vehicle.is_done()) {
                break;
            }
            self.run(50);
        }
        assert!(self.pilots.iter().all(|pilot| pilot.vehicle.is_done()), "not all was sent");
        self.run(1_000);
    }

    /// Ends it; the files with their extensions, in the order in which they were begun.
    fn end(self) -> Vec<(String, Vec<u8>)> {
        self.recorder.stop(LIMIT);
        let files = fs::read_dir(self.dir.path()).unwrap().map(|entry| entry.unwrap().path());
        let mut files: Vec<_> = files.collect();
        files.sort();
        let extension =
            |path: &std::path::Path| path.extension().unwrap().to_str().unwrap().to_owned();
        files.iter().map(|path| (extension(path), fs::read(path).unwrap())).collect()
    }
}

/// A PX4 with a log whose pieces are all acknowledged.
fn px4(system: u8, messages: usize) -> (Pilot, Vec<u8>) {
    let log = log(&mut Chance::new(system.into()), messages);
    let anew = pieces(&log, usize::MAX);
    let vehicle = Px4 { pieces: anew.clone(), anew, ..Px4::default() };
    (Pilot::new(system, PX4, Box::new(vehicle)), log)
}

/// An ArduPilot with a log of so many blocks.
fn ardupilot(system: u8, blocks: usize) -> (Pilot, Vec<u8>) {
    let mut vehicle = ArduPilot::default();
    let log = vehicle.load(&mut Chance::new(system.into()), blocks);
    (Pilot::new(system, Heartbeat::ARDUPILOT, Box::new(vehicle)), log)
}

fn on_a_bad_line(mut pilot: Pilot) -> Pilot {
    (pilot.line.loss, pilot.line.repeats, pilot.line.reorder) = ((20, 20), 20, 60);
    pilot
}

#[test]
fn two_vehicles_of_a_kind_at_once_get_a_whole_file_each() {
    let kinds = [[px4(1, 150), px4(2, 200)], [ardupilot(1, 300), ardupilot(2, 400)]];
    for (vehicles, extension) in kinds.into_iter().zip(["ulg", "bin"]) {
        let [(one, log), (other, other_log)] = vehicles;
        let mut stage = Stage::new(vec![on_a_bad_line(one), on_a_bad_line(other)]);
        stage.greet();
        stage.run_to_end();
        let files = stage.end();
        assert_eq!(files.len(), 2, "{extension}");
        assert!(files.iter().all(|file| file.0 == extension));
        for log in [log, other_log] {
            assert!(files.iter().any(|file| file.1 == log), "{extension}: a log is not there");
        }
    }
}

#[test]
fn four_vehicles_of_both_kinds_do_not_disturb_each_other() {
    let vehicles = [px4(1, 100), ardupilot(2, 200), px4(3, 150), ardupilot(4, 250)];
    let (pilots, logs): (Vec<_>, Vec<_>) = vehicles.into_iter().unzip();
    let mut stage = Stage::new(pilots.into_iter().map(on_a_bad_line).collect());
    stage.greet();
    stage.run_to_end();
    let files = stage.end();
    assert_eq!(files.len(), 4);
    for log in logs {
        assert!(files.iter().any(|file| file.1 == log), "a log is not there");
    }
}

#[test]
fn at_the_end_each_vehicle_that_sends_is_asked_to_stop_and_nothing_begins_any_more() {
    let (sending, log) = px4(1, 100);
    let mut stage = Stage::new(vec![sending, ardupilot(2, 200).0, px4(3, 1).0]);
    for at in [0, 1] {
        let heartbeat = stage.pilots[at].heartbeat(Heartbeat::ARMED);
        stage.hear(&heartbeat);
    }
    stage.run(100);
    let phases: Vec<_> = stage.collector.progress().iter().map(|it| it.phase).collect();
    assert_eq!(phases, [Phase::Running, Phase::Running]);
    stage.collector.leave(stage.now);
    let said = stage.said();
    let stop = u32::from_le_bytes(said[1].1.payload[..4].try_into().unwrap());
    assert_eq!(said.iter().map(|it| it.0).collect::<Vec<_>>(), [1, 2]);
    assert_eq!(said[0].1.payload[28..32], [STOP.to_le_bytes()[0], STOP.to_le_bytes()[1], 1, 1]);
    assert_eq!(stop, 2_147_483_645);
    stage.greet();
    let piece = UlogPiece { sequence: 900, wants_ack: true, first: None, data: vec![1; 249] };
    stage.hear(&frame(1, &Heard::Ulog(piece)));
    assert_eq!(stage.said(), []);
    let files = stage.end();
    assert_eq!(files.len(), 2);
    assert!(log.starts_with(&files[0].1) && files[0].1.len() > 1_000);
}

/// Runs until a vehicle has sent everything and a file of this content is there.
fn run_until_whole(stage: &mut Stage, log: &[u8]) {
    let end = Instant::now() + LIMIT;
    let is_whole = |file: io::Result<fs::DirEntry>| {
        file.is_ok_and(|file| fs::read(file.path()).is_ok_and(|bytes| bytes == log))
    };
    while !fs::read_dir(stage.dir.path()).is_ok_and(|mut files| files.any(is_whole)) {
        assert!(Instant::now() < end, "{:?}", stage.recorder.status());
        stage.run(20);
        thread::sleep(Duration::from_millis(5));
    }
}

/// Runs until the recorder is in such a state.
fn run_until(stage: &mut Stage, is_so: impl Fn(&RecordStatus) -> bool) {
    let end = Instant::now() + LIMIT;
    while !is_so(&stage.recorder.status()) {
        assert!(Instant::now() < end, "{:?}", stage.recorder.status());
        stage.run(1);
        thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_disk_that_was_away_gets_a_whole_log_once_it_is_back() {
    for (vehicle, log) in [px4(1, 300), ardupilot(1, 400)] {
        let mut stage = Stage::new(vec![vehicle]);
        fs::remove_dir(stage.dir.path()).unwrap();
        fs::write(stage.dir.path(), "").unwrap();
        stage.greet();
        run_until(&mut stage, |status| status.state == RecordState::Failing);
        fs::remove_file(stage.dir.path()).unwrap();
        run_until_whole(&mut stage, &log);
        run_until(&mut stage, |status| status.state == RecordState::Recording);
        stage.recorder.stop(LIMIT);
    }
}

#[test]
fn a_recorder_that_has_failed_goes_on_although_nothing_comes() {
    let (vehicle, _) = ardupilot(1, 10);
    let mut stage = Stage::new(vec![vehicle]);
    fs::remove_dir(stage.dir.path()).unwrap();
    fs::write(stage.dir.path(), "").unwrap();
    stage.greet();
    run_until(&mut stage, |status| status.state == RecordState::Failing);
    stage.pilots.clear();
    stage.collector = Collector::new(&RecordOptions::default(), stage.recorder.flight_feed());
    fs::remove_file(stage.dir.path()).unwrap();
    run_until(&mut stage, |status| status.state == RecordState::Waiting);
    assert_eq!(stage.recorder.status().error, None);
    stage.recorder.stop(LIMIT);
}

#[test]
fn a_log_whose_file_vanishes_is_asked_for_anew() {
    for (vehicle, log) in [px4(1, 2_000), ardupilot(1, 2_000)] {
        let mut stage = Stage::new(vec![vehicle]);
        stage.greet();
        run_until(&mut stage, |status| status.files == 1 && status.bytes > 100 * 200);
        fs::remove_dir_all(stage.dir.path()).unwrap();
        // That it has vanished shows when more is written.
        run_until(&mut stage, |status| status.flight_files.is_empty());
        run_until_whole(&mut stage, &log);
        let files = stage.end();
        assert!(files.len() == 1 && files[0].1 == log);
    }
}

#[test]
fn how_far_each_log_is_can_be_asked() {
    let (vehicle, log) = ardupilot(7, 20);
    let mut stage = Stage::new(vec![vehicle]);
    assert_eq!(stage.collector.progress(), []);
    stage.greet();
    let asking = FlightProgress { system: 7, slot: 0, phase: Phase::Asking, bytes: 0, missing: 0 };
    assert_eq!(stage.collector.progress(), [asking]);
    stage.run_to_end();
    let running = FlightProgress { phase: Phase::Running, bytes: log.len() as u64, ..asking };
    assert_eq!(stage.collector.progress(), [running]);
    // Ten blocks further on than the last.
    stage.hear(&frame(7, &Heard::Block(30, [1; 200])));
    let bytes = 31 * 200;
    assert_eq!(stage.collector.progress(), [FlightProgress { bytes, missing: 10, ..running }]);
}
