//! What is kept of the time of signatures, and what a loop makes of it.

use super::*;
use crate::config::{EndpointConfig, General};
use crate::daemon::settings::settle;
use crate::daemon::stage::daemon;
use crate::mavlink::{Dialect, Key};
use crate::test_dir::TestDir;

const NOW: Timestamp = Timestamp::new(37_000_000_000_000);

#[test]
fn a_clock_that_is_set_back_repeats_no_timestamp() {
    let mut clock = begin(None, NOW, Time::ZERO);
    let written = kept(&clock, Time::ZERO);
    let before = clock.next(Time::from_millis(59_000));
    assert!(before > NOW && before <= NOW.plus(AHEAD));
    // Without any word of what was used since, and in 1970.
    let mut clock = begin(Some(written), Timestamp::default(), Time::ZERO);
    assert!(clock.next(Time::ZERO) > before);
    assert_eq!(clock.show(Time::ZERO), NOW, "what is received is held against the older time");
}

#[test]
fn a_time_over_a_day_ahead_of_a_clock_that_was_set_is_told_with_its_file() {
    let path = Path::new("/var/lib/mavswitch/signing-time");
    let ahead = |units| Kept { used: NOW, shown: NOW.plus(units) };
    assert_eq!(doubt(path, ahead(DOUBTFUL - 1), NOW), None);
    assert_eq!(doubt(path, ahead(DOUBTFUL), Timestamp::default()), None);
    let text = doubt(path, ahead(3 * DOUBTFUL), NOW).unwrap();
    assert!(text.contains("/var/lib/mavswitch/signing-time is 3 days ahead"), "{text}");
}

#[test]
fn what_is_written_is_read() {
    let dir = TestDir::new();
    let path = dir.path().join("signing-time");
    assert_eq!(read(&path), Ok(None));
    let kept = Kept { used: NOW, shown: NOW.minus(5) };
    assert!(keep(&path, kept));
    assert_eq!(read(&path), Ok(Some(kept)));
    fs::write(&path, "37 none").unwrap();
    assert!(read(&path).unwrap_err().contains("not what was written there"));
    assert!(!keep(&path.join("no-directory"), kept));
}

#[test]
fn a_reload_that_is_the_first_to_sign_goes_by_what_was_read_at_the_start() {
    let dir = TestDir::new();
    let mut daemon = daemon(General::default(), Vec::new());
    // What the start has found; by now the disk is gone.
    let kept = Kept { used: wall().plus(DOUBTFUL), shown: wall().plus(DOUBTFUL) };
    let path = Some(dir.path().join("gone").join(FILE));
    daemon.signing_time.found = Found { path, kept: Some(kept), problem: None };
    let mut endpoint: EndpointConfig = "udpout:127.0.0.1:9?sign=radio".parse().unwrap();
    endpoint.options.sign.as_mut().unwrap().key = Some(Key::from_passphrase("radio"));
    daemon.change_all(settle(vec![endpoint], &Dialect::builtin()).unwrap());
    assert!(daemon.router.signing_clock().show(daemon.now) >= kept.shown);
    assert!(daemon.signing_time.found.path.is_none());
}
