//! A telemetry log that is played back: every frame of it, in its order, as it is.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::{env, iter};

use mavswitch::record::{TlogReader, write_record};
use rustix::process::Signal;

use crate::harness::*;

/// A recorded flight, if there is one here: it is not part of the repository.
fn recorded_flight() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/flight.tlog");
    let path = env::var_os("MAVSWITCH_TLOG").map_or(beside, PathBuf::from);
    path.is_file().then_some(path)
}

/// A flight of so many seconds, as it is when nothing happens.
fn dull_flight(dir: &TempDir, seconds: u32) -> PathBuf {
    let mut log = Vec::new();
    for number in 0..seconds {
        let micros = 1_700_000_000_000_000 + u64::from(number) * 1_000_000;
        write_record(&mut log, micros, &attitude(VEHICLE, number)).unwrap();
    }
    let path = dir.path("dull.tlog");
    fs::write(&path, log).unwrap();
    path
}

fn frames(log: &Path) -> Vec<Vec<u8>> {
    let mut reader = TlogReader::new(File::open(log).unwrap());
    let next = || Some(reader.next_record().unwrap()?.frame.bytes().to_vec());
    iter::from_fn(next).collect()
}

#[test]
fn a_log_arrives_byte_for_byte_as_fast_as_it_is_taken() {
    let dir = TempDir::new();
    let recorded = recorded_flight();
    if recorded.is_none() {
        println!(
            "skipped: there is no recorded flight here (MAVSWITCH_TLOG=FILE); a dull one is played back"
        );
    }
    let logs = recorded.into_iter().chain([dull_flight(&dir, 18_000)]);
    for log in logs {
        let gcs = "[endpoint.gcs]\naddress = \"tcpin:127.0.0.1:0\"\n";
        let config = dir.write("mavswitch.toml", gcs);
        let router = Router::start(&["-c", config.to_str().unwrap()]);
        let mut gcs_peer = router.tcp("gcs", WITNESS);
        let flight = format!("[endpoint.flight]\naddress = 'tlog:{}?speed=0'\n", log.display());
        dir.write("mavswitch.toml", &format!("{gcs}{flight}"));
        router.signal(Signal::HUP);
        for (number, frame) in frames(&log).iter().enumerate() {
            let received = gcs_peer.receive();
            assert!(received == *frame, "{}: frame {number} is another", log.display());
        }
        router.log.wait_for(&["flight: link #", "the log has ended"]);
        let mut other = router.tcp("gcs", GCS);
        router.assert_serves(&mut gcs_peer, &mut other);
    }
}

/// Its numbers come round again many times within a second, and each run says what the one before said.
#[test]
fn a_log_that_is_started_again_arrives_to_the_last_frame() {
    let dir = TempDir::new();
    let mut log = Vec::new();
    for number in 0..3_000_u32 {
        let micros = 1_700_000_000_000_000 + u64::from(number) * 10_000;
        let frame = heartbeat_draft(VEHICLE).seq(number as u8).build();
        write_record(&mut log, micros, &frame).unwrap();
    }
    let path = dir.path("beats.tlog");
    fs::write(&path, log).unwrap();
    let flight = format!("tlog:{}?speed=0&name=flight&enabled=false", path.display());
    let router = Router::start(&[&flight, "tcpin:127.0.0.1:0?name=gcs"]);
    let mut gcs = router.tcp("gcs", WITNESS);
    let endpoint = |order: &str| {
        let control = router.control();
        let output = run(&["endpoint", order, "flight", "--control", control.to_str().unwrap()]);
        assert!(output.status.success(), "{order}: {output:?}");
    };
    for _ in 0..3 {
        let from = router.log.len();
        endpoint("enable");
        gcs.expect_each(&frames(&path));
        router.log.wait_from(from, &["flight: link #", "the log has ended"]);
        endpoint("disable");
    }
}

#[test]
fn a_log_that_a_file_names_is_looked_for_beside_the_file() {
    let dir = TempDir::new();
    dull_flight(&dir, 10);
    let gcs = "[endpoint.gcs]\naddress = 'tcpin:127.0.0.1:0'\n";
    let flight = "[endpoint.flight]\naddress = 'tlog:dull.tlog?speed=0'\n";
    let config = dir.write("mavswitch.toml", &format!("{gcs}{flight}"));
    let router = Router::start(&["-c", config.to_str().unwrap()]);
    router.log.wait_for(&["flight: link #", "the log has ended"]);
}

#[test]
fn a_log_that_cannot_be_played_back_ends_the_start() {
    let dir = TempDir::new();
    let text = dir.write("text.tlog", "no log at all");
    let absent = dir.path("absent.tlog");
    for (path, told) in [(text, "it is no telemetry log"), (absent, "No such file or directory")] {
        let endpoint = format!("tlog:{}?name=flight", path.display());
        let output = run(&[&endpoint, "udpin:127.0.0.1:0"]);
        assert_eq!(output.status.code(), Some(2));
        let stderr = String::from_utf8(output.stderr).unwrap();
        let words = format!("mavswitch: flight: cannot play back {}: {told}", path.display());
        assert_eq!(stderr.lines().filter(|line| line.contains(&words)).count(), 1, "{stderr}");
    }
}

/// On a terminal, the log of the program goes on above the bar, and the bar goes with the replay.
#[test]
fn on_a_terminal_a_bar_shows_how_far_a_replay_is() {
    if !is_there("tmux") {
        println!("skipped: there is no tmux here");
        return;
    }
    let dir = TempDir::new();
    // Ten seconds in which it is to be seen.
    let log = dull_flight(&dir, 10_000);
    let endpoint = format!("tlog:{}?speed=1000&name=flight", log.display());
    let words = [PROGRAM, "--control", "off", &endpoint, "tcpin:127.0.0.1:0?name=gcs"];
    let line = words.map(quoted).join(" ");
    let terminal = Terminal::start(100, 20, &format!("{line}; echo status $?"));
    let screen = terminal.wait_for(" left");
    assert!(screen.lines().any(|line| line.starts_with("dull.tlog ")), "{screen}");
    let screen = terminal.wait_for("the log has ended");
    let is_line_of_log = |line: &str| line.starts_with("20") && line.contains("INFO");
    assert!(
        screen.lines().filter(|line| line.contains("flight: link #")).all(is_line_of_log),
        "{screen}"
    );
    eventually("the bar is gone", || !terminal.screen().contains("left"));
    terminal.press(&["C-c"]);
    terminal.wait_for("status 0");
}
