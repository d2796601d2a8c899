//! A peer whose process is stopped: its computer answers for it, and it reads nothing any more.

use std::net::SocketAddr;
use std::thread;
use std::time::{Duration, Instant};

use crate::harness::*;

const UDP: &str = "udpin:127.0.0.1:0?name=udp";

/// Reads whatever comes, until the router hangs up: whole frames in order.
fn read_on(router: SocketAddr) {
    let mut reader = Peer::new(TcpWire::narrow_to(router), GCS_2);
    reader.send_mark();
    let numbers = reader.receive_to_cut().into_iter().map(|frame| number_in(&frame));
    assert!(numbers.is_sorted_by(|a, b| a < b), "out of order");
}

/// Sends to both readers until the time is over; the healthy one misses nothing.
fn talk(vehicle: &mut Peer<UdpWire>, healthy: &mut Peer<UdpWire>, n: &mut u32, time: Duration) {
    let end = Instant::now() + time;
    while Instant::now() < end {
        let frames: Vec<_> = (*n..*n + 80).map(|n| bulk(VEHICLE, n)).collect();
        *n += 80;
        vehicle.send_each(&frames);
        healthy.expect_each(&frames);
        thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn a_peer_that_is_stopped_is_given_up_and_harms_nobody() {
    if let Some(address) = part() {
        return read_on(address.parse().unwrap());
    }
    let router = Router::start(&["tcpin:127.0.0.1:0?name=tcp&stall_timeout=2s", UDP]);
    let mut vehicle = router.udp("udp", VEHICLE);
    let mut healthy = router.udp("udp", GCS);
    let mut n = 0;
    talk(&mut vehicle, &mut healthy, &mut n, Duration::from_millis(200));
    let before = Condition::of(&router);
    let address = router.address("tcp").to_string();
    let reader = Actor::start(a_peer_that_is_stopped_is_given_up_and_harms_nobody, &address);
    router.wait_until_seen(GCS_2);
    talk(&mut vehicle, &mut healthy, &mut n, Duration::from_millis(200));
    reader.stop();
    let give_up = Instant::now() + PATIENCE;
    while !router.log.has(&["tcp: link #", " down: it takes nothing any more"]) {
        assert!(Instant::now() < give_up, "the stopped peer is kept");
        talk(&mut vehicle, &mut healthy, &mut n, Duration::from_millis(100));
    }
    before.assert_restored(&router);
    reader.go_on();
    reader.wait();
    router.assert_serves(&mut vehicle, &mut healthy);
}

#[test]
fn a_peer_that_is_stopped_for_less_than_its_stall_timeout_stays() {
    if let Some(address) = part() {
        return read_on(address.parse().unwrap());
    }
    let router = Router::start(&["tcpin:127.0.0.1:0?name=tcp&stall_timeout=5m", UDP]);
    let mut vehicle = router.udp("udp", VEHICLE);
    let mut healthy = router.udp("udp", GCS);
    let address = router.address("tcp").to_string();
    let reader =
        Actor::start(a_peer_that_is_stopped_for_less_than_its_stall_timeout_stays, &address);
    router.wait_until_seen(GCS_2);
    let mut n = 0;
    talk(&mut vehicle, &mut healthy, &mut n, Duration::from_millis(500));
    let before = Condition::of(&router);
    reader.stop();
    // Longer than a host that answers nothing at all is waited for.
    talk(&mut vehicle, &mut healthy, &mut n, Duration::from_secs(12));
    assert!(!router.log.has(&["tcp: link #", " down: "]), "it was given up");
    reader.go_on();
    talk(&mut vehicle, &mut healthy, &mut n, Duration::from_millis(500));
    assert!(!router.log.has(&["tcp: link #", " down: "]), "it was given up");
    before.assert_restored(&router);
    drop(router);
    reader.wait();
}
