//! The end: by a signal, with everything delivered that can be, and status 0.

use std::io::Write;
use std::thread;

use rustix::process::Signal;

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";
const UDP: &str = "udpin:127.0.0.1:0?name=udp";

#[test]
fn both_signals_end_it_with_status_0() {
    for signal in [Signal::TERM, Signal::INT] {
        let router = Router::start(&[TCP, UDP]);
        let mut gcs = router.tcp("tcp", GCS);
        let _vehicle = router.udp("udp", VEHICLE);
        router.signal(signal);
        router.log.wait_for(&["stopping"]);
        gcs.receive_to_end();
        let (status, log) = router.wait_for_end();
        assert_eq!(status.code(), Some(0), "{log}");
    }
}

#[test]
fn frames_sent_right_before_the_signal_arrive() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut second = router.udp("udp", GCS_2);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let frames: Vec<_> = (0..200).map(|n| attitude(VEHICLE, n)).collect();
    vehicle.send(frames.concat());
    router.signal(Signal::TERM);
    assert_eq!(gcs.receive_to_end(), frames);
    second.expect_each(&frames);
    let (status, log) = router.wait_for_end();
    assert_eq!(status.code(), Some(0), "{log}");
}

#[test]
fn a_reader_that_does_not_read_does_not_keep_it_from_ending() {
    let router = Router::start(&[TCP, UDP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut healthy = router.tcp("tcp", GCS);
    let stalled = Peer::new(TcpWire::narrow_to(router.address("tcp")), GCS_2);
    router.wait_for_link("tcp", &stalled.wire);
    for n in 0..20_000 {
        vehicle.send(bulk(VEHICLE, n));
        if n % 200 == 199 {
            healthy.expect_each(&(n - 199..=n).map(|n| bulk(VEHICLE, n)).collect::<Vec<_>>());
        }
    }
    router.signal(Signal::TERM);
    let (status, log) = router.wait_for_end();
    assert_eq!(status.code(), Some(0), "{log}");
}

#[test]
fn a_flood_does_not_keep_it_from_ending() {
    let router = Router::start(&[TCP, UDP]);
    let mut flooder = router.tcp("tcp", OTHER).wire.stream;
    let flood = command_long(OTHER, Component::new(42, 1)).repeat(2000);
    thread::scope(|scope| {
        // Until the router is gone.
        scope.spawn(move || while flooder.write_all(&flood).is_ok() {});
        router.signal(Signal::TERM);
        let (status, log) = router.wait_for_end();
        assert_eq!(status.code(), Some(0), "{log}");
    });
}

#[test]
fn it_ends_also_while_it_waits_for_servers_and_devices() {
    let (nowhere, _kept) = blackhole();
    let refused = TcpServer::down();
    let dir = TempDir::new();
    let router = Router::launch(&[
        &format!("tcpout:{nowhere}"),
        &format!("tcpout:{}", refused.address()),
        &format!("serial:{}:57600?name=fc", dir.path("absent").display()),
        TCP,
    ]);
    router.log.wait_for(&["tcp: listening on "]);
    router.log.wait_for(&["fc: ", "waiting"]);
    router.signal(Signal::TERM);
    let (status, log) = router.wait_for_end();
    assert_eq!(status.code(), Some(0), "{log}");
}
