//! Serial drivers that do not answer, whatever they are asked: nobody else waits for them.

use std::time::{Duration, Instant};

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";

/// How long a driver takes that is stuck, in seconds: far longer than all the rest of a test.
const STUCK: u32 = 15;

#[test]
fn a_driver_that_takes_its_time_to_open_a_port_keeps_nobody_waiting() {
    if !can_delay() {
        return;
    }
    let pty = Pty::new();
    let fc = format!("serial:{}:57600?name=fc", pty.device());
    let router = Router::start_delayed("?open,openat", pty.device(), 6, &[&fc, TCP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut other = router.tcp("tcp", OTHER);
    router.assert_serves(&mut gcs, &mut other);
    assert!(!router.log.has(&["fc: link #", " up"]), "they had to wait for the driver");
    router.log.wait_for(&["fc: ", "takes long"]);
    let mut vehicle = router.serial("fc", pty, VEHICLE);
    router.assert_serves(&mut gcs, &mut vehicle);
}

#[test]
fn a_driver_that_does_not_close_its_port_keeps_nobody_waiting() {
    if !can_delay() {
        return;
    }
    let (gone, stays) = (Pty::new(), Pty::new());
    let fc = format!("serial:{}:57600?name=fc", gone.device());
    let radio = format!("serial:{}:57600?name=radio", stays.device());
    let router = Router::start_delayed("close", gone.device(), STUCK, &[&fc, &radio, TCP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut other = router.serial("radio", stays, OTHER);
    let vehicle = router.serial("fc", gone, VEHICLE);
    let started = Instant::now();
    drop(vehicle);
    router.log.wait_for(&["fc: link #", " down: "]);
    router.assert_serves(&mut gcs, &mut other);
    let waited = started.elapsed();
    assert!(waited < Duration::from_secs(STUCK.into()), "they had to wait for the driver");
}
