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

/// A flight of five hours, as it is when nothing happens.
fn dull_flight(dir: &TempDir) -> PathBuf {
    let mut log = Vec::new();
    for number in 0..18_000_u32 {
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
    let logs = recorded_flight().into_iter().chain([dull_flight(&dir)]);
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
