//! Host names that mean nothing yet, and names that come to mean something else.

use std::net::{IpAddr, SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

use mavswitch::control::Request;

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";

#[test]
fn names_that_mean_nothing_yet_are_asked_for_until_they_do() {
    let test = names_that_mean_nothing_yet_are_asked_for_until_they_do;
    if !in_own_namespaces(test, &["mount"]) {
        return;
    }
    let names = Names::none();
    let mut server = TcpServer::at("127.0.0.7:5760".parse().unwrap());
    server.up();
    let mut ground = awaiting("127.0.0.7:14550", GCS);
    let out = ["tcpout:base.example:5760?name=call", "udpout:base.example:14550?name=send"];
    let router = Router::start(&[out[0], out[1], TCP]);
    router.log.wait_for(&["call: cannot resolve base.example: ", "waiting"]);
    router.log.wait_for(&["send: cannot resolve base.example: ", "waiting"]);
    let mut camera = router.tcp("tcp", CAMERA);
    let mut other = router.tcp("tcp", OTHER);
    router.assert_serves(&mut camera, &mut other);
    let before = Condition::of(&router);
    // Asking again and again costs nothing.
    std::thread::sleep(Duration::from_secs(2));
    router.assert_serves(&mut camera, &mut other);
    before.assert_restored(&router);
    names.set("base.example", "127.0.0.7");
    let mut vehicle = server.accept(VEHICLE);
    router.assert_serves(&mut camera, &mut vehicle);
    ground.meet(&mut camera);
    router.assert_serves(&mut ground, &mut vehicle);
    assert_rests(router.process());
}

fn awaiting(address: &str, me: Component) -> Peer<UdpWire> {
    let address: SocketAddr = address.parse().unwrap();
    Peer::new(UdpWire::awaiting(roomy_udp_socket(address)), me)
}

#[test]
fn a_server_that_has_moved_is_called_where_its_name_now_leads() {
    if !in_own_namespaces(a_server_that_has_moved_is_called_where_its_name_now_leads, &["mount"]) {
        return;
    }
    let names = Names::none();
    names.set("fc.example", "127.0.0.7");
    let mut server = TcpServer::at("127.0.0.7:5760".parse().unwrap());
    server.up();
    let router = Router::start(&["tcpout:fc.example:5760?name=call", TCP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut vehicle = server.accept(VEHICLE);
    router.assert_serves(&mut gcs, &mut vehicle);
    let before = Condition::of(&router);
    let mut moved = TcpServer::at("127.0.0.8:5760".parse().unwrap());
    moved.up();
    names.set("fc.example", "127.0.0.8");
    server.go_down();
    drop(vehicle);
    let mut vehicle = moved.accept(VEHICLE);
    router.assert_serves(&mut gcs, &mut vehicle);
    before.assert_restored(&router);
}

#[test]
fn a_ground_station_that_has_moved_is_sent_to_where_its_name_now_leads() {
    let test = a_ground_station_that_has_moved_is_sent_to_where_its_name_now_leads;
    if !in_own_namespaces(test, &["mount"]) {
        return;
    }
    is_sent_to_where_its_name_leads("127.0.0.8");
}

/// Has a ground station that was at 127.0.0.7 move to another address.
fn is_sent_to_where_its_name_leads(to: &str) {
    let names = Names::none();
    names.set("gcs.example", "127.0.0.7");
    let router = Router::start(&["udpout:gcs.example:14550?name=send", TCP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut gcs = awaiting("127.0.0.7:14550", GCS);
    gcs.meet(&mut vehicle);
    vehicle.meet(&mut gcs);
    names.set("gcs.example", to);
    // Where it was, datagrams are refused from now on.
    drop(gcs);
    let to: IpAddr = to.parse().unwrap();
    let moved = UdpSocket::bind((to, 14550)).unwrap();
    moved.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
    let moved_at = Instant::now();
    while moved.recv(&mut [0; 300]).is_err() {
        // It is asked for every 30 s, and 2 s after a refusal.
        assert!(moved_at.elapsed() < Duration::from_secs(20), "it still goes where it went");
        vehicle.send(heartbeat(VEHICLE));
    }
}

#[test]
fn of_several_addresses_the_first_is_meant_again_each_time() {
    if !in_own_namespaces(of_several_addresses_the_first_is_meant_again_each_time, &["mount"]) {
        return;
    }
    let names = Names::none();
    names.set_all("gcs.example", &["127.0.0.7", "127.0.0.8"]);
    let router = Router::start(&["udpout:gcs.example:14550?name=send", TCP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut gcs = awaiting("127.0.0.7:14550", GCS);
    let elsewhere = roomy_udp_socket("127.0.0.8:14550".parse().unwrap());
    gcs.meet(&mut vehicle);
    let mut client = router.client();
    client.ask(Request::EndpointDisable { name: "send".into() }).unwrap();
    client.ask(Request::EndpointEnable { name: "send".into() }).unwrap();
    gcs.meet(&mut vehicle);
    elsewhere.set_nonblocking(true).unwrap();
    assert!(elsewhere.recv(&mut [0; 300]).is_err(), "nobody has ever moved");
}

#[test]
fn a_ground_station_that_has_only_an_address_of_the_other_kind_now_is_sent_to_there() {
    let test = a_ground_station_that_has_only_an_address_of_the_other_kind_now_is_sent_to_there;
    if !in_own_namespaces(test, &["mount"]) {
        return;
    }
    is_sent_to_where_its_name_leads("::1");
}
