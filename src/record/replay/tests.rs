//! A log of some hundred kilobytes, played back in virtual time.

use std::fs;

use super::*;
use crate::mavlink::{Component, FrameSpec, MessageId};
use crate::record::write_record;
use crate::test_dir::TestDir;

/// So many frames, one each 10 ms.
fn frames(count: u32) -> Vec<Vec<u8>> {
    let frame = |number: u32| {
        let payload = number.to_le_bytes();
        let spec = FrameSpec::new(Component::new(1, 1), MessageId(30), 39, &payload);
        FrameSpec { seq: number as u8, ..spec }.to_frame()
    };
    (1..=count).map(|number| frame(number | 1 << 24)).collect()
}

fn log(dir: &TestDir, frames: &[Vec<u8>]) -> PathBuf {
    let times = (0..).map(|number| 1_700_000_000_000_000 + number * 10_000);
    log_at(dir, frames, times)
}

fn log_at(dir: &TestDir, frames: &[Vec<u8>], times: impl Iterator<Item = u64>) -> PathBuf {
    let mut log = Vec::new();
    for (micros, frame) in times.zip(frames) {
        write_record(&mut log, micros, frame).unwrap();
    }
    let path = dir.path().join("flight.tlog");
    fs::write(&path, log).unwrap();
    path
}

/// Says what it has to say until `end`: each frame, and when. The disk may take its time.
fn play(replay: &mut Replay, now: &mut Time, end: Time) -> Vec<(Time, Vec<u8>)> {
    let mut said = Vec::new();
    let patience = std::time::Instant::now() + Duration::from_secs(60);
    while *now < end && replay.ended().is_none() {
        let mut out = Vec::new();
        if replay.poll_transmit(*now, &mut out)
            || (replay.bulk(*now).is_some() && replay.poll_bulk(*now, &mut out))
        {
            said.push((*now, out));
        } else if replay.look_at.is_some() {
            assert!(std::time::Instant::now() < patience, "the disk gives nothing");
            thread::yield_now();
        } else if let Some(at) = replay.poll_timeout() {
            *now = at;
        }
    }
    said
}

const NEVER: Time = Time::from_millis(u64::MAX / 2_000);

fn replay(path: &Path, speed: f32, is_loop: bool) -> Replay {
    Replay::start(path, ReplayOptions { speed, is_loop }).unwrap()
}

#[test]
fn each_frame_is_said_as_it_was_recorded_at_its_time() {
    let dir = TestDir::new();
    let frames = frames(10_000);
    let path = log(&dir, &frames);
    for (speed, step) in [(1.0, 10_000), (4.0, 2_500)] {
        let mut replay = replay(&path, speed, false);
        let mut now = Time::from_millis(500);
        let said = play(&mut replay, &mut now, NEVER);
        assert_eq!(replay.ended(), Some("the log has ended"));
        assert!(!replay.has_failed() && look_at_log(&path).is_ok());
        assert!(said.iter().map(|(_, frame)| frame).eq(&frames), "not the frames of the log");
        let micros = |number: u64| Time::from_micros(500_000 + number * step);
        assert!(said.iter().zip(0..).all(|((at, _), number)| *at == micros(number)));
    }
}

#[test]
fn at_full_speed_the_time_does_not_matter() {
    let dir = TestDir::new();
    let frames = frames(10_000);
    let mut replay = replay(&log(&dir, &frames), 0.0, false);
    let mut now = Time::ZERO;
    let said = play(&mut replay, &mut now, NEVER);
    assert!(said.iter().map(|(_, frame)| frame).eq(&frames), "not the frames of the log");
    assert_eq!(now, Time::ZERO);
}

#[test]
fn a_loop_begins_anew_each_second_at_most() {
    let dir = TestDir::new();
    let frames = frames(3);
    let mut replay = replay(&log(&dir, &frames), 1.0, true);
    let said = play(&mut replay, &mut Time::from_millis(1), Time::from_millis(2_500));
    let heard: Vec<usize> =
        said.iter().map(|(_, frame)| frames.iter().position(|it| it == frame).unwrap()).collect();
    assert!(heard.len() == 9 && heard.iter().zip([0, 1, 2].iter().cycle()).all(|(a, b)| a == b));
    assert!(replay.ended().is_none());
}

#[test]
fn records_that_are_not_quite_in_order_keep_the_time_of_the_log() {
    let dir = TestDir::new();
    let millis = [0, 10, 9, 19, 18, 28];
    let path =
        log_at(&dir, &frames(6), millis.into_iter().map(|at| 1_700_000_000_000_000 + at * 1_000));
    let mut now = Time::ZERO;
    let said = play(&mut replay(&path, 1.0, false), &mut now, NEVER);
    let at: Vec<Time> = said.into_iter().map(|(at, _)| at).collect();
    assert_eq!(at, [0, 10, 10, 19, 19, 28].map(Time::from_millis));
}

#[test]
fn where_the_clock_was_set_the_log_goes_on_at_once() {
    let dir = TestDir::new();
    let frames = frames(6);
    // From 1970 to the time of a satellite, and some hours back.
    let times = [5_000_000, 5_010_000, 1_700_000_000_000_000, 1_700_000_000_010_000];
    let back = [1_600_000_000_000_000, 1_600_000_000_010_000];
    let path = log_at(&dir, &frames, times.into_iter().chain(back));
    let mut replay = replay(&path, 1.0, false);
    let said = play(&mut replay, &mut Time::from_millis(1), NEVER);
    let times: Vec<Time> = said.iter().map(|(at, _)| *at).collect();
    assert_eq!(times, [1, 11, 11, 21, 21, 31].map(Time::from_millis));
}

#[test]
fn what_is_no_log_or_not_there_is_told() {
    let dir = TestDir::new();
    let path = dir.path().join("text");
    fs::write(&path, "no log at all").unwrap();
    for (path, told) in [(path, "is no telemetry log"), (dir.path().join("nothing"), "cannot read")]
    {
        assert!(look_at_log(&path).is_err());
        let mut replay = replay(&path, 1.0, true);
        assert!(play(&mut replay, &mut Time::ZERO.clone(), NEVER).is_empty());
        assert!(replay.ended().unwrap().contains(told), "{:?}", replay.ended());
        assert!(replay.has_failed());
    }
}
