//! What is recorded of the traffic: every frame that is taken, whoever it is for, as it came.

use std::fs::{self, File};
use std::path::Path;
use std::time::{Duration, Instant};

use mavswitch::record::TlogReader;
use mavswitch::status::{RecordState, RecordStatus};
use rustix::process::Signal;

use crate::harness::*;

/// How recording is getting on, as the router tells it.
fn status(router: &Router) -> RecordStatus {
    router.status().record.expect("a recorder")
}

/// The frames of all telemetry logs in a directory, in the order of their files, without marks.
fn recorded(dir: &Path) -> Vec<Vec<u8>> {
    let mut files: Vec<_> = fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let mut frames = Vec::new();
    for file in files {
        let mut reader = TlogReader::new(File::open(file).unwrap());
        while let Some(record) = reader.next_record().unwrap() {
            frames.push(record.frame.bytes().to_vec());
        }
        assert_eq!(reader.stats().skipped_bytes, 0);
    }
    frames
}

#[test]
fn broadcasts_commands_and_answers_are_recorded_and_what_is_left_out_is_not() {
    let dir = TempDir::new();
    let records = dir.path("made/on/the/way");
    let private = "tcpin:127.0.0.1:0?name=private&record=false";
    let router = Router::start(&recording(&records, &[private]));
    let mut vehicle = router.tcp("fc", VEHICLE);
    let mut gcs = router.tcp("gcs", GCS);
    let mut private = router.tcp("private", CAMERA);
    let said = [
        attitude(VEHICLE, 1),
        attitude(GCS, 2),
        command_long(GCS, VEHICLE),
        command_ack(VEHICLE, GCS),
        // Nobody is there to hear it.
        command_long(GCS, OTHER),
    ];
    private.send(attitude(CAMERA, 7));
    vehicle.expect(attitude(CAMERA, 7));
    gcs.expect(attitude(CAMERA, 7));
    vehicle.send(&said[0]);
    gcs.expect(&said[0]);
    gcs.send(&said[1]);
    gcs.send(&said[2]);
    vehicle.expect_each(&said[1..3]);
    vehicle.send(&said[3]);
    gcs.expect(&said[3]);
    gcs.send(&said[4]);
    vehicle.expect_nothing_from(&mut gcs);
    router.signal(Signal::TERM);
    assert!(router.wait_for_end().0.success());
    let frames: Vec<_> = recorded(&records).into_iter().filter(|it| said.contains(it)).collect();
    assert_eq!(frames, said);
    assert!(!recorded(&records).contains(&attitude(CAMERA, 7)));
}

/// The disk is full: routing goes on as before, what is lost is told, and once there is room again
/// recording goes on by itself, in the same file.
#[test]
fn a_full_disk_costs_no_frame_and_recording_goes_on_when_there_is_room() {
    let test = a_full_disk_costs_no_frame_and_recording_goes_on_when_there_is_room;
    if !in_own_namespaces(test, &["mount"]) {
        return;
    }
    let dir = TempDir::new();
    let card = dir.path("card");
    fs::create_dir(&card).unwrap();
    sh(&format!("mount -t tmpfs -o size=16m tmpfs {}", card.display()));
    let filler = card.join("photos");
    fs::write(&filler, vec![1; (16 << 20) - (100 << 10)]).unwrap();
    let router = Router::start(&recording(&card, &[]));
    let mut vehicle = router.tcp("fc", VEHICLE);
    let mut gcs = router.tcp("gcs", GCS);
    let mut number = 0;
    let mut fly = |frames: u32| {
        for _ in 0..frames {
            number += 1;
            vehicle.send(attitude(VEHICLE, number));
            gcs.expect(attitude(VEHICLE, number));
        }
    };
    // Twice what there is room for.
    fly(2_500);
    router.log.wait_for(&["cannot record to", "No space left", "make room"]);
    fs::remove_file(&filler).unwrap();
    while !router.log.has(&["recording again"]) {
        fly(10);
    }
    fly(100);
    // With the marks of both, which came before the disk was full.
    eventually("all is written or lost", || {
        let told = status(&router);
        told.frames + told.lost >= u64::from(number) + 2
    });
    let told = status(&router);
    router.signal(Signal::TERM);
    assert!(router.wait_for_end().0.success());
    let frames = recorded(&card);
    let flown = |frame: &&Vec<u8>| frame.len() == attitude(VEHICLE, 1).len();
    let numbers: Vec<u32> = frames.iter().filter(flown).map(|frame| number_in(frame)).collect();
    assert!(numbers.is_sorted_by(|a, b| a < b), "not in their order");
    assert_eq!(numbers.last(), Some(&number));
    assert!(told.lost > 0, "nothing was lost");
    assert_eq!(told.frames, frames.len() as u64, "what is told to be there is there");
    let missing = u64::from(number) - numbers.len() as u64;
    assert_eq!(told.lost, missing, "what is told to be lost is missing, and nothing else");
    assert_eq!(fs::read_dir(&card).unwrap().count(), 1);
    sh(&format!("umount {}", card.display()));
}

#[test]
fn recording_is_stopped_started_and_looked_at_while_frames_flow() {
    let dir = TempDir::new();
    let records = dir.path("records");
    let router = Router::start(&recording(&records, &[]));
    let mut vehicle = router.tcp("fc", VEHICLE);
    let mut gcs = router.tcp("gcs", GCS);
    let ask = |words: &[&str]| {
        let output = router.ask(words);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let state = || {
        let status: serde_json::Value = serde_json::from_str(&ask(&["status", "--json"])).unwrap();
        status["record"]["state"].as_str().unwrap().to_owned()
    };
    let mut fly = |number: u32| {
        vehicle.send(attitude(VEHICLE, number));
        gcs.expect(attitude(VEHICLE, number));
    };
    fly(1);
    eventually("it records", || state() == "recording");
    ask(&["record", "stop"]);
    assert_eq!(state(), "stopped");
    fly(2);
    ask(&["record", "start"]);
    fly(3);
    router.signal(Signal::TERM);
    assert!(router.wait_for_end().0.success());
    let flown = [1, 2, 3].map(|number| attitude(VEHICLE, number));
    let frames: Vec<_> = recorded(&records).into_iter().filter(|it| flown.contains(it)).collect();
    assert_eq!(frames, [flown[0].clone(), flown[2].clone()]);
    assert_eq!(fs::read_dir(&records).unwrap().count(), 2);
}

/// A disk that stands still: frames go on as before, what finds no room on its way to the disk is
/// counted and shown, and recording goes on by itself.
#[test]
fn a_disk_that_stands_still_costs_no_frame_and_recording_goes_on_when_it_works_again() {
    if !can_delay() {
        return;
    }
    let dir = TempDir::new();
    let records = dir.path("records");
    let router = Router::start_stuck("fdatasync", 3, 5, &recording(&records, &[]));
    let mut vehicle = router.tcp("fc", VEHICLE);
    let mut gcs = router.tcp("gcs", GCS);
    let mut number = 0;
    let mut fly = |number: &mut u32, count: u32| {
        let frames: Vec<_> = (*number..*number + count).map(|n| bulk(VEHICLE, n)).collect();
        *number += count;
        vehicle.send_each(&frames);
        gcs.expect_each(&frames);
    };
    while status(&router).lost == 0 {
        fly(&mut number, 500);
    }
    // The marks of both were recorded too, before anything was lost.
    eventually("all that waits is written", || {
        let status = status(&router);
        status.frames + status.lost > u64::from(number) && status.state == RecordState::Recording
    });
    let text = router.told(&["status"]);
    let told = status(&router);
    let row = text.lines().skip_while(|line| !line.starts_with("RECORD")).nth(1);
    let cells: Vec<&str> = row.expect("a table of records").split_whitespace().collect();
    assert_eq!(cells[2], told.lost.to_string(), "{text}");
    let before = told.frames;
    fly(&mut number, 100);
    eventually("what came since is written", || status(&router).frames >= before + 100);
    let told = status(&router);
    router.signal(Signal::TERM);
    assert!(router.wait_for_end().0.success());
    let frames = recorded(&records);
    assert_eq!(frames.len() as u64, told.frames);
    let numbers = frames.iter().filter(|it| it.len() == bulk(VEHICLE, 1).len());
    let numbers: Vec<u32> = numbers.map(|frame| number_in(frame)).collect();
    assert!(numbers.is_sorted_by(|a, b| a < b), "not in their order");
    assert_eq!(numbers.len() as u64 + told.lost, u64::from(number));
    assert_eq!(numbers.last(), Some(&(number - 1)));
}

#[test]
fn a_reload_does_not_wait_for_a_disk_that_stands_still() {
    /// In seconds: far longer than a reload takes.
    const STUCK: u32 = 12;
    if !can_delay() {
        return;
    }
    let dir = TempDir::new();
    let general = |name: &str| {
        let path = dir.path(name);
        let general = format!("record = '{}'\nrecord_min_free = 0\n", path.display());
        let endpoints = ["fc", "gcs"].map(|name| endpoint(name, "tcpin:127.0.0.1:0", ""));
        dir.write("mavswitch.toml", &(general + &endpoints.concat()));
        path
    };
    let records = general("one");
    let config = dir.path("mavswitch.toml");
    let arguments = ["-c", config.to_str().unwrap()];
    let router = Router::start_stuck("fdatasync", 1, STUCK, &arguments);
    let mut vehicle = router.tcp("fc", VEHICLE);
    let mut gcs = router.tcp("gcs", GCS);
    router.assert_serves(&mut vehicle, &mut gcs);
    let size = |path: std::path::PathBuf| fs::metadata(path).map_or(0, |data| data.len());
    let is_written = || {
        let mut files = fs::read_dir(&records).into_iter().flatten();
        files.any(|file| size(file.unwrap().path()) > 0)
    };
    eventually("the writer has something to put on the disk", is_written);
    let started = Instant::now();
    let other = general("two");
    router.signal(Signal::HUP);
    router.log.wait_for(&["recording anew"]);
    router.assert_serves(&mut vehicle, &mut gcs);
    eventually("it records elsewhere", || other.exists());
    assert!(started.elapsed() < Duration::from_secs(STUCK.into()), "it has waited for the disk");
}

#[test]
fn what_is_told_of_a_record_is_what_is_in_its_file() {
    let dir = TempDir::new();
    let records = dir.path("records");
    let router = Router::start(&recording(&records, &[]));
    assert_eq!(status(&router).reason.as_deref(), Some("no frame has come yet"));
    let mut vehicle = router.tcp("fc", VEHICLE);
    let mut gcs = router.tcp("gcs", GCS);
    for number in 0..100 {
        vehicle.send(attitude(VEHICLE, number));
        gcs.expect(attitude(VEHICLE, number));
    }
    let file = || records.read_dir().unwrap().next().unwrap().unwrap().path();
    // With the marks of both.
    eventually("all of it is written", || status(&router).frames >= 102);
    let told = status(&router);
    assert_eq!(told.frames, recorded(&records).len() as u64);
    let size = fs::metadata(file()).unwrap().len();
    assert_eq!((told.bytes, told.file_bytes, told.files, told.lost), (size, size, 1, 0));
    assert_eq!((told.state, told.reason, told.error), (RecordState::Recording, None, None));
    assert_eq!(told.file.as_deref(), file().to_str());
}
