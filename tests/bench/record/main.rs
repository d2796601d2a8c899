//! What recording costs, and that it costs no frame.
//!
//! `cargo bench --bench record` prints the processor time of a recorded frame, on the loop and on
//! the writer; whether 1,000,000 frames at 20,000 a second are all recorded on the disk of the build
//! directory; and how late frames are that are routed while the disk is full, or stands still.
//! `cargo bench --bench record -- latency` prints the last of these alone.

#![allow(clippy::unwrap_used)]

mod latency;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};
use std::{env, fs, process, thread};

use mavswitch::config::RecordOptions;
use mavswitch::mavlink::{CheckedFrame, Component, Frame, FrameSpec, MessageId};
use mavswitch::record::{Recorder, TlogReader};
use mavswitch::routing::Time;
use rustix::time::{ClockId, clock_gettime};

/// How many frames are recorded, and how many a second where that is paced.
const FRAMES: u64 = 1_000_000;
const RATE: u64 = 20_000;

/// How many frames a turn of the loop has at that rate, one turn each millisecond.
const A_TURN: u64 = RATE / 1_000;

fn main() {
    // `cargo test --all-targets` runs this too, and wants no figures.
    if !env::args().any(|argument| argument == "--bench") {
        return;
    }
    if !env::args().any(|argument| argument == "latency") {
        record("as fast as it goes", None);
        record("20,000 frames a second", Some(Duration::from_millis(1)));
    }
    latency::compare();
}

fn directory(name: &str) -> PathBuf {
    let name = format!("record-{name}-{}", process::id());
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    // One that was killed leaves its directory behind, and numbers of processes come again.
    let _ = fs::remove_dir_all(&dir);
    fs::create_dir_all(&dir).unwrap();
    dir
}

/// An ATTITUDE of 40 bytes with this number.
fn attitude(number: u64) -> Vec<u8> {
    let mut payload = [1; 28];
    payload[..8].copy_from_slice(&number.to_le_bytes());
    let spec = FrameSpec::new(Component::new(1, 1), MessageId(30), 39, &payload);
    FrameSpec { seq: number as u8, ..spec }.to_frame()
}

fn cpu(clock: ClockId) -> Duration {
    let time = clock_gettime(clock);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

/// Records [`FRAMES`], a turn each `pace`, and counts what is in the files.
fn record(name: &str, pace: Option<Duration>) {
    let dir = directory("cost");
    let options = RecordOptions { dir: Some(dir.clone()), min_free: 0, ..RecordOptions::default() };
    let mut recorder = Recorder::start(&options, Time::ZERO).unwrap();
    let bytes = attitude(1);
    let header = Frame::parse(&bytes).unwrap().header();
    let target = Component::new(0, 0);
    let frame = CheckedFrame { bytes: &bytes, header, target, verified: true };
    let start = Instant::now();
    let (all, own) = (cpu(ClockId::ProcessCPUTime), cpu(ClockId::ThreadCPUTime));
    let mut in_loop = Duration::ZERO;
    for turn in 0..FRAMES / A_TURN {
        let before = cpu(ClockId::ThreadCPUTime);
        recorder.begin_turn(SystemTime::now(), Time::from_millis(turn));
        (0..A_TURN).for_each(|_| recorder.record(&frame));
        recorder.end_turn();
        in_loop += cpu(ClockId::ThreadCPUTime) - before;
        match pace {
            Some(pace) => {
                let due = start + pace * turn as u32;
                thread::sleep(due.saturating_duration_since(Instant::now()));
            }
            // A loop that never waits fills any ring: here the writer sets the pace.
            None if turn % 1_000 == 0 => thread::sleep(Duration::from_millis(20)),
            None => {}
        }
    }
    let own = cpu(ClockId::ThreadCPUTime) - own;
    let status = recorder.status();
    recorder.stop(Duration::from_secs(60));
    let writer = cpu(ClockId::ProcessCPUTime) - all - own;
    let ns = |time: Duration| time.as_nanos() as u64 / FRAMES;
    println!(
        "{name}: {} ns a frame on the loop, {} ns on the writer; {} of {FRAMES} recorded, {} lost, in {:.1} s",
        ns(in_loop),
        ns(writer),
        count(&dir),
        status.lost,
        start.elapsed().as_secs_f64(),
    );
    let _ = fs::remove_dir_all(dir);
}

/// How many records there are in all files.
fn count(dir: &Path) -> u64 {
    let files = fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().path());
    let counts = files.map(|file| {
        let mut reader = TlogReader::new(fs::File::open(file).unwrap());
        while reader.next_record().unwrap().is_some() {}
        reader.stats().records
    });
    counts.sum()
}
