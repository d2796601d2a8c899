//! Network interfaces that are not there yet, that go away, and that are too slow.

use std::net::{SocketAddr, TcpListener, UdpSocket};
use std::time::Duration;

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";

/// An endpoint at the near end of the cable, and how to be its peer at the far end.
type Way = (&'static str, fn(&FarNetwork, Component) -> Peer<UdpWire>);

const SENDER: Way = ("udpout:10.99.0.2:14550", at_14550);
const SENDER_ON_DEVICE: Way = ("udpout:10.99.0.2:14550?dev=near", at_14550);
const SERVER: Way = ("udpin:0.0.0.0:14551", to_14551);
const SERVER_AT_ADDRESS: Way = ("udpin:10.99.0.1:14553", to_14553);
const SERVER_ON_DEVICE: Way = ("udpin:0.0.0.0:14551?dev=near", to_14551);
const MULTICAST: Way = ("mcast:239.255.145.50:14552", in_group);
const MULTICAST_ON_DEVICE: Way = ("mcast:239.255.145.50:14552?dev=near", in_group);

fn at_14550(far: &FarNetwork, me: Component) -> Peer<UdpWire> {
    let socket = far.make(|| roomy_udp_socket("0.0.0.0:14550".parse().unwrap()));
    Peer::new(UdpWire::awaiting(socket), me)
}

fn to_14551(far: &FarNetwork, me: Component) -> Peer<UdpWire> {
    to_port(far, me, 14551)
}

fn to_14553(far: &FarNetwork, me: Component) -> Peer<UdpWire> {
    to_port(far, me, 14553)
}

fn to_port(far: &FarNetwork, me: Component, port: u16) -> Peer<UdpWire> {
    let socket = far.make(|| roomy_udp_socket("0.0.0.0:0".parse().unwrap()));
    let router = format!("{NEAR}:{port}").parse().unwrap();
    Peer::new(UdpWire::between(socket, router), me)
}

fn in_group(far: &FarNetwork, me: Component) -> Peer<UdpWire> {
    let group: SocketAddr = "239.255.145.50:14552".parse().unwrap();
    let interface = FAR.parse().unwrap();
    let socket = far.make(|| {
        let socket = UdpSocket::bind("0.0.0.0:14552").unwrap();
        socket.join_multicast_v4(&"239.255.145.50".parse().unwrap(), &interface).unwrap();
        socket.set_multicast_loop_v4(false).unwrap();
        let options = socket2::SockRef::from(&socket);
        options.set_multicast_if_v4(&interface).unwrap();
        socket
    });
    Peer::new(UdpWire::between(socket, group), me)
}

/// The interface goes and comes back, twice; whoever is there is heard again.
fn goes_and_comes_back(ways: &[Way]) {
    let far = FarNetwork::new();
    let endpoints: Vec<&str> = ways.iter().map(|(endpoint, _)| *endpoint).collect();
    let router = Router::start(&[&endpoints[..], &[TCP]].concat());
    let mut gcs = router.tcp("tcp", GCS);
    let mut other = router.tcp("tcp", OTHER);
    let mut before = None;
    for _ in 0..2 {
        meet_all(&router, &far, ways, &mut gcs);
        before.get_or_insert_with(|| Condition::of(&router));
        far.pull();
        // Nobody is there now; the others work on, and the log does not fill.
        for n in 0..200 {
            gcs.send(attitude(GCS, n));
            other.expect(attitude(GCS, n));
        }
        router.assert_serves(&mut gcs, &mut other);
        assert_rests(router.process());
        far.plug();
    }
    meet_all(&router, &far, ways, &mut gcs);
    before.unwrap().assert_restored(&router);
    assert!(router.log.len() < 150, "{} lines", router.log.len());
}

/// Somebody new at the far end of each way speaks with the ground station.
fn meet_all(router: &Router, far: &FarNetwork, ways: &[Way], gcs: &mut Peer<TcpWire>) {
    for ((_, peer), component) in ways.iter().zip(1..) {
        let mut vehicle = peer(far, Component::new(10, component));
        open_both_ways(gcs, &mut vehicle);
        router.assert_serves(gcs, &mut vehicle);
    }
}

/// Of these two, either may be unable to speak before it has been spoken to.
fn open_both_ways(gcs: &mut Peer<TcpWire>, vehicle: &mut Peer<UdpWire>) {
    if vehicle.wire.may_speak_first() {
        gcs.meet(vehicle);
    } else {
        vehicle.meet(gcs);
    }
}

#[test]
fn datagrams_flow_again_when_their_interface_is_back() {
    let test = datagrams_flow_again_when_their_interface_is_back;
    if in_own_namespaces(test, FarNetwork::TOOLS) {
        goes_and_comes_back(&[SENDER, SERVER, SERVER_AT_ADDRESS]);
    }
}

#[test]
fn datagrams_of_endpoints_on_a_device_flow_again_when_that_is_back() {
    let test = datagrams_of_endpoints_on_a_device_flow_again_when_that_is_back;
    if in_own_namespaces(test, FarNetwork::TOOLS) {
        goes_and_comes_back(&[SENDER_ON_DEVICE, SERVER_ON_DEVICE, MULTICAST_ON_DEVICE]);
    }
}

#[test]
fn a_multicast_group_is_heard_again_when_its_interface_is_back() {
    let test = a_multicast_group_is_heard_again_when_its_interface_is_back;
    if in_own_namespaces(test, FarNetwork::TOOLS) {
        goes_and_comes_back(&[MULTICAST]);
    }
}

#[test]
fn endpoints_whose_interface_comes_after_the_router_wait_for_it() {
    let test = endpoints_whose_interface_comes_after_the_router_wait_for_it;
    if !in_own_namespaces(test, FarNetwork::TOOLS) {
        return;
    }
    let plain = [SENDER, SERVER_AT_ADDRESS, MULTICAST];
    let on_device = [SENDER_ON_DEVICE, SERVER_ON_DEVICE, MULTICAST_ON_DEVICE];
    let ways = [plain, on_device].concat();
    for (endpoint, peer) in ways {
        let far = FarNetwork::new();
        far.pull();
        let router = Router::start(&[endpoint, TCP]);
        let mut gcs = router.tcp("tcp", GCS);
        let mut other = router.tcp("tcp", OTHER);
        router.assert_serves(&mut gcs, &mut other);
        far.plug();
        let mut vehicle = peer(&far, VEHICLE);
        open_both_ways(&mut gcs, &mut vehicle);
        router.assert_serves(&mut gcs, &mut vehicle);
    }
}

#[test]
fn connections_over_a_lost_interface_are_given_up_and_made_again() {
    let test = connections_over_a_lost_interface_are_given_up_and_made_again;
    if !in_own_namespaces(test, FarNetwork::TOOLS) {
        return;
    }
    let far = FarNetwork::new();
    let listener = far.make(|| TcpListener::bind("0.0.0.0:5760").unwrap());
    let endpoints = [
        "tcpout:10.99.0.2:5760?name=out&stall_timeout=4s",
        "tcpin:0.0.0.0:5761?name=in&stall_timeout=4s",
    ];
    let router = Router::start(&[endpoints[0], endpoints[1], TCP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut other = router.tcp("tcp", OTHER);
    let mut vehicle = Peer::new(TcpWire::accepted_by(&listener), VEHICLE);
    let mut camera = Peer::new(call_5761(&far), CAMERA);
    router.assert_serves(&mut gcs, &mut vehicle);
    router.assert_serves(&mut gcs, &mut camera);
    let before = Condition::of(&router);
    far.pull();
    gcs.send(heartbeat(GCS));
    router.log.wait_for(&["out: link #", " down: "]);
    router.log.wait_for(&["in: link #", " down: "]);
    router.assert_serves(&mut gcs, &mut other);
    far.plug();
    let mut vehicle = Peer::new(TcpWire::accepted_by(&listener), VEHICLE);
    router.assert_serves(&mut gcs, &mut vehicle);
    let mut camera = Peer::new(call_5761(&far), CAMERA);
    router.assert_serves(&mut gcs, &mut camera);
    before.assert_restored(&router);
}

fn call_5761(far: &FarNetwork) -> TcpWire {
    far.make(|| TcpWire::to(format!("{NEAR}:5761").parse().unwrap()))
}

#[test]
fn a_listener_on_a_device_takes_calls_again_when_that_is_back() {
    let test = a_listener_on_a_device_takes_calls_again_when_that_is_back;
    if !in_own_namespaces(test, FarNetwork::TOOLS) {
        return;
    }
    let far = FarNetwork::new();
    let router = Router::start(&["tcpin:0.0.0.0:5761?name=in&dev=near", TCP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut camera = Peer::new(call_5761(&far), CAMERA);
    router.assert_serves(&mut gcs, &mut camera);
    far.pull();
    far.plug();
    let router_at: SocketAddr = format!("{NEAR}:5761").parse().unwrap();
    let call = || far.make(|| std::net::TcpStream::connect(router_at).is_ok());
    eventually("the router takes calls", call);
    let mut camera = Peer::new(call_5761(&far), CAMERA);
    router.assert_serves(&mut gcs, &mut camera);
}

#[test]
fn a_multicast_group_on_a_device_needs_no_route() {
    if !in_own_namespaces(a_multicast_group_on_a_device_needs_no_route, FarNetwork::TOOLS) {
        return;
    }
    let far = FarNetwork::new();
    sh("ip route delete 224.0.0.0/4 dev near");
    let (endpoint, peer) = MULTICAST_ON_DEVICE;
    let router = Router::start(&[endpoint, TCP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut vehicle = peer(&far, VEHICLE);
    router.assert_serves(&mut gcs, &mut vehicle);
}

#[test]
fn a_network_that_takes_no_more_datagrams_for_now_is_waited_for() {
    let test = a_network_that_takes_no_more_datagrams_for_now_is_waited_for;
    if !in_own_namespaces(test, &["nsenter", "tc"]) {
        return;
    }
    let far = FarNetwork::new();
    sh("tc qdisc add dev near root tbf rate 1mbit burst 3000 limit 10000000");
    let router = Router::start(&[SENDER.0, TCP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut near_gcs = router.tcp("tcp", OTHER);
    let mut gcs = at_14550(&far, GCS);
    router.assert_serves(&mut gcs, &mut vehicle);
    let before = Condition::of(&router);
    let frames: Vec<_> = (0..8_000).map(|n| attitude(VEHICLE, n)).collect();
    for some in frames.chunks(100) {
        vehicle.send(some.concat());
        near_gcs.expect_each(some);
    }
    // What fits is sent as the network lets it, the rest was refused; in order, and whole.
    let mut received = Vec::new();
    while let Some(frame) = gcs.try_receive(Duration::from_secs(1)) {
        received.push(number_in(&frame));
    }
    assert!(received.is_sorted_by(|a, b| a < b), "out of order: {received:?}");
    assert!((500..8_000).contains(&received.len()), "{} frames of 8000", received.len());
    router.assert_serves(&mut gcs, &mut vehicle);
    before.assert_restored(&router);
}
