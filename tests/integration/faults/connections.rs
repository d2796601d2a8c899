//! TCP connections: servers that are killed, resets within a frame, callers without number.

use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use socket2::SockRef;

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";
const UDP: &str = "udpin:127.0.0.1:0?name=udp";

#[test]
fn a_server_that_is_killed_and_started_again_is_called_again() {
    if let Some(address) = part() {
        return serve(address.parse().unwrap());
    }
    let reserved = TcpServer::down();
    let address = reserved.address().to_string();
    let router = Router::start(&[&format!("tcpout:{address}?name=out"), TCP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut before = None;
    for _ in 0..5 {
        let log = router.log.len();
        let server =
            Actor::start(a_server_that_is_killed_and_started_again_is_called_again, &address);
        router.log.wait_from(log, &["out: link #", " up"]);
        assert_eq!(gcs.receive(), heartbeat(VEHICLE));
        gcs.send(command_long(GCS, VEHICLE));
        while gcs.receive() != command_ack(VEHICLE, GCS) {}
        // With the second one there has been everything that there will be.
        before.get_or_insert_with(|| Condition::of(&router));
        drop(server);
        router.log.wait_from(log, &["out: link #", " down: "]);
        // What it said before it was killed.
        while gcs.try_receive(Duration::from_millis(50)).is_some() {}
    }
    before.unwrap().assert_restored(&router);
}

/// A server with a vehicle: acknowledges commands, and says that it is there, until it is killed.
fn serve(address: SocketAddr) {
    let mut server = TcpServer::at(address);
    server.up();
    let mut vehicle = server.accept(VEHICLE);
    loop {
        vehicle.send(heartbeat(VEHICLE));
        if vehicle.try_receive(Duration::from_millis(50)).is_some() {
            vehicle.send(command_ack(VEHICLE, GCS));
        }
    }
}

#[test]
fn connections_reset_within_a_frame_leave_nothing_of_it() {
    let mut server = TcpServer::down();
    server.up();
    let router = Router::start(&[&format!("tcpout:{}?name=out", server.address()), TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut before = None;
    for n in 0..10 {
        let log = router.log.len();
        let mut vehicle = server.accept(VEHICLE);
        let mut camera = router.tcp_unnoticed("tcp", CAMERA);
        router.assert_serves(&mut gcs, &mut vehicle);
        router.assert_serves(&mut gcs, &mut camera);
        before.get_or_insert_with(|| Condition::of(&router));
        vehicle.send(attitude(VEHICLE, n));
        vehicle.send(&bulk(VEHICLE, n)[..200]);
        camera.send(&bulk(CAMERA, n)[..9]);
        gcs.expect(attitude(VEHICLE, n));
        // What is being sent to it when it goes is lost, and nothing else.
        gcs.send(bulk(GCS, n));
        vehicle.reset();
        camera.reset();
        router.log.wait_from(log, &["out: link #", " down: "]);
        router.log.wait_from(log, &["tcp: link #", " down: "]);
        assert_eq!(gcs.try_receive(Duration::from_millis(20)), None);
    }
    let mut vehicle = server.accept(VEHICLE);
    router.assert_serves(&mut gcs, &mut vehicle);
    let mut camera = router.tcp_unnoticed("tcp", CAMERA);
    router.assert_serves(&mut gcs, &mut camera);
    before.unwrap().assert_restored(&router);
}

#[test]
fn five_thousand_callers_who_hang_up_at_once_leave_nothing_behind() {
    let router = Router::start(&[TCP, UDP]);
    let mut vehicle = router.udp("udp", VEHICLE);
    let mut gcs = router.tcp("tcp", GCS);
    call_and_hang_up(&router, 50);
    router.assert_serves(&mut gcs, &mut vehicle);
    let before = Condition::of(&router);
    for n in 0..100 {
        call_and_hang_up(&router, 50);
        // The others do not notice. (And no more callers wait than a listener lets wait.)
        vehicle.send(attitude(VEHICLE, n));
        gcs.expect(attitude(VEHICLE, n));
    }
    router.assert_serves(&mut gcs, &mut vehicle);
    before.assert_restored(&router);
    assert!(router.log.len() < 300, "{} lines", router.log.len());
}

/// Every other one resets its connection, so that the ports are not used up.
fn call_and_hang_up(router: &Router, calls: usize) {
    let address = router.address("tcp");
    for call in 0..calls {
        let stream = TcpStream::connect(address).expect("the router takes the call");
        if call % 2 == 0 {
            let socket = SockRef::from(&stream);
            socket.set_linger(Some(Duration::ZERO)).expect("no lingering");
        }
    }
}
