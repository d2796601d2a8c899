//! Serial ports: the plug that is pulled, the device with another name, the wrong baud rate.

use std::fs;
use std::os::unix::fs::symlink;
use std::time::{Duration, Instant};

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";

/// A name that leads to a terminal, as those below /dev/serial/by-id do.
struct ById {
    dir: TempDir,
}

impl ById {
    fn new() -> Self {
        Self { dir: TempDir::new() }
    }

    fn endpoint(&self, bauds: &str) -> String {
        format!("serial:{}:{bauds}?name=fc", self.dir.path("fc").display())
    }

    /// From now on the name leads to this terminal; there is no moment without the name.
    fn point_to(&self, pty: &Pty) {
        symlink(&pty.path, self.dir.path("next")).unwrap();
        fs::rename(self.dir.path("next"), self.dir.path("fc")).unwrap();
    }

    fn unplug(&self) {
        fs::remove_file(self.dir.path("fc")).unwrap();
    }
}

/// Whoever is behind the terminal speaks again, once the router has found it.
fn come_up(router: &Router, pty: Pty, gcs: &mut Peer<TcpWire>) -> Peer<PtyWire> {
    let mut vehicle = Peer::new(pty.wire, VEHICLE);
    router.assert_serves(gcs, &mut vehicle);
    gcs.send(command_long(GCS, VEHICLE));
    vehicle.expect(command_long(GCS, VEHICLE));
    vehicle.send(command_ack(VEHICLE, GCS));
    gcs.expect(command_ack(VEHICLE, GCS));
    vehicle
}

#[test]
fn a_port_that_hangs_up_and_returns_ten_times_in_a_row_costs_nothing() {
    let (by_id, first) = (ById::new(), Pty::new());
    by_id.point_to(&first);
    let router = Router::start(&[&by_id.endpoint("57600"), TCP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut vehicle = come_up(&router, first, &mut gcs);
    let mut before = Condition::of(&router);
    for round in 0..10 {
        // In the middle of a frame, and with something on its way to it.
        gcs.send(command_long(GCS, VEHICLE));
        vehicle.send(&attitude(VEHICLE, round)[..17]);
        by_id.unplug();
        drop(vehicle);
        let next = Pty::new();
        by_id.point_to(&next);
        vehicle = come_up(&router, next, &mut gcs);
        if round == 0 {
            // Once everything has been done once, nothing more is needed to do it again.
            before = Condition::of(&router);
        }
    }
    before.assert_restored(&router);
}

#[test]
fn a_device_that_comes_back_under_another_name_is_found_by_its_id() {
    let (by_id, first) = (ById::new(), Pty::new());
    by_id.point_to(&first);
    let router = Router::start(&[&by_id.endpoint("57600"), TCP]);
    let mut gcs = router.tcp("tcp", GCS);
    let vehicle = come_up(&router, first, &mut gcs);
    let before = Condition::of(&router);
    // Both are there for a moment, as when the device resets before the old node is gone.
    let second = Pty::new();
    by_id.point_to(&second);
    drop(vehicle);
    let _vehicle = come_up(&router, second, &mut gcs);
    before.assert_restored(&router);
}

#[test]
fn of_two_baud_rates_the_one_with_frames_is_found_and_kept() {
    let (by_id, pty) = (ById::new(), Pty::new());
    by_id.point_to(&pty);
    let router = Router::start(&[&by_id.endpoint("921600,57600"), TCP]);
    let mut gcs = router.tcp("tcp", GCS);
    let before = Condition::of(&router);
    let mut vehicle = Peer::new(pty.wire, VEHICLE);
    speak_at(57_600, &mut vehicle, &mut gcs);
    router.log.wait_for(&["fc: frames at 57600 baud"]);
    // It is silent for longer than a rate is tried, and is still heard.
    std::thread::sleep(Duration::from_secs(3));
    assert_eq!(vehicle.wire.baud(), 57_600, "the rate was given up");
    router.assert_serves(&mut gcs, &mut vehicle);
    before.assert_restored(&router);
    // When it comes back, it is asked at that rate first.
    let next = Pty::new();
    by_id.point_to(&next);
    drop(vehicle);
    let vehicle = come_up(&router, next, &mut gcs);
    assert_eq!(vehicle.wire.baud(), 57_600, "the rate was forgotten");
}

/// A heartbeat five times a second until `gcs` hears it, in garbage as long as the port is at
/// another rate.
fn speak_at(baud: u32, vehicle: &mut Peer<PtyWire>, gcs: &mut Peer<TcpWire>) {
    let give_up = Instant::now() + PATIENCE;
    let mut noise = Noise::new(57_600);
    loop {
        assert!(Instant::now() < give_up, "the right rate is never tried");
        let at = vehicle.wire.baud();
        if at == baud {
            vehicle.send(heartbeat(VEHICLE));
        } else {
            // A slow sender's bits, sampled fast, make many bytes of nothing.
            vehicle.send(noise.bytes(200));
        }
        if let Some(frame) = gcs.try_receive(Duration::from_millis(200)) {
            assert_eq!(at, baud, "garbage was taken for a frame");
            assert_eq!(frame, heartbeat(VEHICLE));
            return;
        }
    }
}
