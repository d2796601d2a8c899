//! TCP connections that come and go: at both ends, in every way, at any time.

use std::thread;
use std::time::{Duration, Instant};

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";
const UDP: &str = "udpin:127.0.0.1:0?name=udp";

#[test]
fn ten_clients_that_call_at_the_same_time_are_all_served() {
    let router = Router::start(&[TCP, UDP]);
    let mut vehicle = router.udp("udp", VEHICLE);
    let ids = (10..20).map(|system| Component::new(system, 1));
    let mut clients: Vec<_> = ids.map(|id| router.tcp_unnoticed("tcp", id)).collect();
    for client in &mut clients {
        client.meet(&mut vehicle);
        vehicle.meet(client);
    }
    vehicle.send(attitude(VEHICLE, 1));
    for client in &mut clients {
        client.expect(attitude(VEHICLE, 1));
    }
}

#[test]
fn clients_that_leave_in_any_way_at_any_time_harm_nobody_and_leave_nothing_behind() {
    let router = Router::start(&[TCP, UDP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut gcs = router.tcp("tcp", GCS);
    let (descriptors, memory) = (router.process().descriptors(), router.process().resident_kib());
    for round in 0..400 {
        let frames: Vec<_> = (0..20).map(|n| bulk(VEHICLE, round * 20 + n)).collect();
        let guest = Component::new(100, 1 + round.to_le_bytes()[0] % 200);
        let mut client = router.tcp_unnoticed("tcp", guest);
        vehicle.send(frames[..5].concat());
        client.send(heartbeat(guest));
        vehicle.send(frames[5..10].concat());
        client.send(&bulk(guest, round)[..100]);
        leave(client, round);
        vehicle.send(frames[10..].concat());
        for frame in &frames {
            assert_eq!(&receive_from(VEHICLE, &mut gcs), frame);
        }
    }
    router.wait_for_descriptors(descriptors);
    router.assert_grown_less_than(16, memory);
    router.assert_serves(&mut gcs, &mut vehicle);
}

/// A close, a close with data unread, a half-close, a half-close to the end, or a reset.
fn leave(mut client: Peer<TcpWire>, round: u32) {
    match round % 5 {
        0 => drop(client),
        1 => drop(client.receive_some()),
        2 => client.half_close(),
        3 => {
            client.half_close();
            drop(client.receive_some());
        }
        _ => client.reset(),
    }
}

fn receive_from(source: Component, peer: &mut Peer<impl Wire>) -> Vec<u8> {
    loop {
        let frame = peer.receive();
        if source_of(&frame) == source {
            return frame;
        }
    }
}

#[test]
fn a_server_that_restarts_ten_times_is_called_again_each_time() {
    let mut server = TcpServer::down();
    server.up();
    let router = Router::launch(&[&format!("tcpout:{}?name=out", server.address()), TCP]);
    let mut gcs = router.tcp("tcp", GCS);
    for n in 0..10 {
        let mut vehicle = server.accept(VEHICLE);
        vehicle.meet(&mut gcs);
        vehicle.send(attitude(VEHICLE, n));
        gcs.expect(attitude(VEHICLE, n));
        gcs.send(command_long(GCS, VEHICLE));
        vehicle.expect(command_long(GCS, VEHICLE));
        server.go_down();
        drop(vehicle);
        server.up();
    }
    router.log.wait_for(&["out: link #", " down: "]);
}

#[test]
fn a_server_that_is_absent_at_start_is_called_until_it_is_there() {
    let mut server = TcpServer::down();
    let router = Router::launch(&[&format!("tcpout:{}?name=out", server.address()), TCP, UDP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut other = router.udp("udp", OTHER);
    router.assert_serves(&mut gcs, &mut other);
    server.up();
    let mut vehicle = server.accept(VEHICLE);
    router.assert_serves(&mut gcs, &mut vehicle);
}

#[test]
fn a_server_that_hangs_up_at_once_is_not_called_in_a_storm() {
    let mut server = TcpServer::down();
    server.up();
    let router = Router::launch(&[&format!("tcpout:{}?name=out", server.address())]);
    drop(server.accept(VEHICLE));
    // A storm would be thousands of calls; how many exactly is not what this is about.
    let end = Instant::now() + Duration::from_secs(2);
    let mut calls = 0;
    while Instant::now() < end {
        match server.try_accept(VEHICLE) {
            Some(_) => calls += 1,
            None => thread::sleep(Duration::from_millis(1)),
        }
    }
    assert!(calls < 50, "{calls} calls in two seconds");
    assert!(router.log.len() < 200, "{} lines", router.log.len());
}

#[test]
fn what_a_client_said_before_it_hung_up_is_still_delivered() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    for n in 0..50 {
        let mut vehicle = router.tcp_unnoticed("tcp", VEHICLE);
        vehicle.send(attitude(VEHICLE, n));
        vehicle.half_close();
        gcs.expect(attitude(VEHICLE, n));
    }
}

#[test]
fn with_retry_0_a_server_is_called_only_once() {
    let (absent, mut server) = (TcpServer::down(), TcpServer::down());
    server.up();
    let never = format!("tcpout:{}?name=never&retry=0", absent.address());
    let once = format!("tcpout:{}?name=once&retry=0", server.address());
    let again = format!("tcpout:{}?name=again&retry=100ms", server.address());
    let router = Router::start(&[&never, &once, &again, UDP]);
    let mut vehicle = router.udp("udp", VEHICLE);
    drop((server.accept(GCS), server.accept(GCS)));
    let mut gcs = server.accept(GCS);
    router.assert_serves(&mut gcs, &mut vehicle);
    for given_up in ["never", "once"] {
        router.log.wait_for(&[&format!("{given_up}: not tried again (retry=0)")]);
    }
    assert!(server.try_accept(GCS_2).is_none());
}
