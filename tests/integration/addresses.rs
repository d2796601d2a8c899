//! Every kind of endpoint, IPv4 and IPv6: who calls whom, and from where.

use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::time::Duration;

use socket2::{Domain, Socket, Type};

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";

fn has_ipv6() -> bool {
    let has = UdpSocket::bind("[::1]:0").is_ok();
    if !has {
        println!("skipped: no IPv6 here");
    }
    has
}

#[test]
fn ipv6_servers_of_udp_and_tcp_serve() {
    if !has_ipv6() {
        return;
    }
    let router = Router::start(&["udpin:[::1]:0?name=udp", "tcpin:[::1]:0?name=tcp"]);
    let mut vehicle = router.udp("udp", VEHICLE);
    let mut gcs = router.tcp("tcp", GCS);
    vehicle.send(attitude(VEHICLE, 1));
    gcs.expect(attitude(VEHICLE, 1));
    gcs.send(command_long(GCS, VEHICLE));
    vehicle.expect(command_long(GCS, VEHICLE));
}

#[test]
fn servers_at_every_ipv6_address_serve_ipv4_too() {
    if !has_ipv6() {
        return;
    }
    let router = Router::start(&["udpin:[::]:0?name=udp", "tcpin:[::]:0?name=tcp"]);
    let (udp, tcp) = (router.address("udp").port(), router.address("tcp").port());
    let by_udp = |host: &str| UdpWire::to(SocketAddr::new(host.parse().unwrap(), udp));
    let by_tcp = |host: &str| TcpWire::to(SocketAddr::new(host.parse().unwrap(), tcp));
    let mut gcs = Peer::new(by_udp("127.0.0.1"), GCS);
    let mut second = Peer::new(by_udp("::1"), GCS_2);
    let mut vehicle = Peer::new(by_tcp("127.0.0.1"), VEHICLE);
    let mut other = Peer::new(by_tcp("::1"), OTHER);
    gcs.send_mark();
    second.send_mark();
    router.wait_until_seen(GCS);
    router.wait_until_seen(GCS_2);
    router.assert_serves(&mut gcs, &mut vehicle);
    router.assert_serves(&mut gcs, &mut other);
    router.assert_serves(&mut second, &mut vehicle);
    // Peers of IPv4 are called as everybody calls them.
    router.log.wait_for(&["udp: link #", " up: 127.0.0.1:"]);
    router.log.wait_for(&["tcp: link #", " up: 127.0.0.1:"]);
}

#[test]
fn one_port_may_be_named_for_ipv4_and_ipv6_apart() {
    if !has_ipv6() {
        return;
    }
    let reserved = FreePort::new();
    let port = reserved.number();
    for all_first in [true, false] {
        let mut both = [format!("udpin:[::]:{port}?name=six"), format!("udpin:{port}?name=four")];
        if !all_first {
            both.reverse();
        }
        let router = Router::start(&[&both[0], &both[1]]);
        let mut vehicle = Peer::new(UdpWire::to(SocketAddr::from(([127, 0, 0, 1], port))), VEHICLE);
        let mut gcs = Peer::new(UdpWire::to(format!("[::1]:{port}").parse().unwrap()), GCS);
        vehicle.send_mark();
        gcs.send_mark();
        router.log.wait_for(&["four: link #", " up"]);
        router.log.wait_for(&["six: link #", " up"]);
        router.assert_serves(&mut gcs, &mut vehicle);
    }
}

#[test]
fn ipv6_clients_of_udp_and_tcp_call() {
    if !has_ipv6() {
        return;
    }
    let listener = std::net::TcpListener::bind("[::1]:0").unwrap();
    let mut gcs = Peer::new(UdpWire::awaiting(roomy_udp_socket("[::1]:0".parse().unwrap())), GCS);
    let udp = format!("udpout:{}?name=udp", gcs.wire.address());
    let tcp = format!("tcpout:{}?name=out", listener.local_addr().unwrap());
    let _router = Router::launch(&[&udp, &tcp]);
    let mut vehicle = Peer::new(TcpWire::accepted_by(&listener), VEHICLE);
    gcs.meet(&mut vehicle);
    vehicle.send(attitude(VEHICLE, 1));
    gcs.expect(attitude(VEHICLE, 1));
    vehicle.meet(&mut gcs);
}

#[test]
fn udpout_calls_first_and_hears_the_answer() {
    let mut gcs = Peer::awaiting(GCS);
    let udp = format!("udpout:{}?name=out", gcs.wire.address());
    let router = Router::start(&[&udp, TCP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    vehicle.send_each(&every_shape(VEHICLE));
    gcs.expect_each(&every_shape(VEHICLE));
    assert_eq!(gcs.wire.last_sender().port(), router.sends_from("out").port());
    gcs.send(command_long(GCS, VEHICLE));
    vehicle.expect(command_long(GCS, VEHICLE));
    vehicle.send(command_ack(VEHICLE, GCS));
    gcs.expect(command_ack(VEHICLE, GCS));
}

#[test]
fn udpout_sends_from_the_address_it_is_bound_to() {
    let mut gcs = Peer::awaiting(GCS);
    let udp = format!("udpout:{}?name=out&bind=127.0.0.2:0", gcs.wire.address());
    let router = Router::start(&[&udp, TCP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    vehicle.send(heartbeat(VEHICLE));
    gcs.expect(heartbeat(VEHICLE));
    assert_eq!(gcs.wire.last_sender(), router.sends_from("out"));
    assert_eq!(gcs.wire.last_sender().ip(), Ipv4Addr::new(127, 0, 0, 2));
    gcs.send(heartbeat(GCS));
    vehicle.expect(heartbeat(GCS));
}

#[test]
fn udpout_hears_nobody_else_and_says_so() {
    let gcs = Peer::awaiting(GCS);
    let router = Router::start(&[&format!("udpout:{}?name=out", gcs.wire.address()), TCP]);
    let port = router.sends_from("out").port();
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let other = roomy_udp_socket("127.0.0.2:0".parse().unwrap());
    let mut other = Peer::new(UdpWire::between(other, ([127, 0, 0, 1], port).into()), GCS_2);
    other.send(heartbeat(GCS_2));
    let words = ["WARN", "out: 127.0.0.2:", " refused: it hears 127.0.0.1 alone, to whom it sends"];
    router.log.wait_for(&words);
    let mut witness = router.tcp("tcp", WITNESS);
    witness.send(heartbeat(WITNESS));
    vehicle.expect(heartbeat(WITNESS));
}

#[test]
fn udpout_goes_on_when_nobody_is_there_and_is_heard_when_somebody_comes() {
    let reserved = FreePort::new();
    let address = reserved.here().parse().unwrap();
    let router = Router::start(&[&format!("udpout:{address}?name=out"), TCP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut witness = router.tcp("tcp", WITNESS);
    for n in 0..50 {
        vehicle.send(attitude(VEHICLE, n));
        witness.expect(attitude(VEHICLE, n));
    }
    let mut gcs = Peer::new(UdpWire::awaiting(roomy_udp_socket(address)), GCS);
    gcs.meet(&mut vehicle);
    vehicle.meet(&mut gcs);
}

#[test]
fn udpbcast_sends_to_all_and_hears_the_answer() {
    let any = roomy_udp_socket("0.0.0.0:0".parse().unwrap());
    let port = any.local_addr().unwrap().port();
    let probe = UdpSocket::bind("127.0.0.1:0").unwrap();
    probe.set_broadcast(true).unwrap();
    if probe.send_to(b"?", ("127.255.255.255", port)).is_err() || !hears(&any) {
        println!("skipped: no broadcast on the loopback network here");
        return;
    }
    let udp = format!("udpbcast:127.255.255.255:{port}?name=cast");
    let router = Router::start(&[&udp, TCP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut gcs = Peer::new(UdpWire::awaiting(any), GCS);
    vehicle.send(attitude(VEHICLE, 1));
    gcs.expect(attitude(VEHICLE, 1));
    gcs.send(heartbeat(GCS));
    vehicle.expect(heartbeat(GCS));
    gcs.send(command_long(GCS, VEHICLE));
    vehicle.expect(command_long(GCS, VEHICLE));
    vehicle.send(command_ack(VEHICLE, GCS));
    gcs.expect(command_ack(VEHICLE, GCS));
    vehicle.expect_nothing_from(&mut gcs);
}

#[test]
fn mcast_speaks_to_a_group_and_hears_it_once_and_not_itself() {
    let group = Ipv4Addr::new(239, 255, 145, 50);
    let member = group_member(group);
    let port = member.local_addr().unwrap().port();
    let sender = UdpSocket::bind("0.0.0.0:0").unwrap();
    let works = sender.send_to(b"?", (group, port)).is_ok() && hears(&member);
    if !works {
        println!("skipped: no multicast here");
        return;
    }
    let router = Router::start(&[&format!("mcast:{group}:{port}?name=swarm"), TCP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut listener = Peer::new(UdpWire::awaiting(member), VEHICLE);
    let to_group = |frame: &[u8]| {
        sender.send_to(frame, (group, port)).unwrap();
    };
    gcs.send(attitude(GCS, 1));
    listener.expect(attitude(GCS, 1));
    to_group(&attitude(VEHICLE, 2));
    gcs.expect(attitude(VEHICLE, 2));
    listener.expect(attitude(VEHICLE, 2));
    gcs.send(command_long(GCS, VEHICLE));
    listener.expect(command_long(GCS, VEHICLE));
    to_group(&command_ack(VEHICLE, GCS));
    gcs.expect(command_ack(VEHICLE, GCS));
    listener.expect(command_ack(VEHICLE, GCS));
    // A mark that has come to the group and back would be an echo.
    let mut witness = router.tcp("tcp", WITNESS);
    gcs.meet(&mut witness);
    listener.expect_nothing_from(&mut gcs);
    gcs.expect_nothing_from(&mut witness);
}

/// A member of the group, at a port that it shares with the router.
fn group_member(group: Ipv4Addr) -> UdpSocket {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, None).unwrap();
    socket.set_reuse_address(true).unwrap();
    let any: SocketAddr = "0.0.0.0:0".parse().unwrap();
    socket.bind(&any.into()).unwrap();
    let joined = socket.join_multicast_v4(&group, &Ipv4Addr::UNSPECIFIED);
    if let Err(error) = joined {
        println!("cannot join {group}: {error}");
    }
    socket.into()
}

/// Whether the test message arrives.
fn hears(socket: &UdpSocket) -> bool {
    socket.set_read_timeout(Some(Duration::from_secs(2))).unwrap();
    socket.recv_from(&mut [0; 16]).is_ok()
}

#[test]
fn the_spellings_of_other_programs_are_understood() {
    let spellings = [
        "udp:127.0.0.1:0?name=a",
        "udpin://127.0.0.1:0?name=b",
        "udps:127.0.0.1:0?name=c",
        "udpserver://127.0.0.1:0?name=d",
        "tcpin://127.0.0.1:0?name=e",
        "tcps:127.0.0.1:0?name=f",
        "tcpserver://127.0.0.1:0?name=g",
    ];
    let router = Router::start(&spellings);
    let mut vehicle = router.udp("a", VEHICLE);
    for name in ["b", "c", "d"] {
        vehicle.meet(&mut router.udp(name, GCS));
    }
    for name in ["e", "f", "g"] {
        vehicle.meet(&mut router.tcp(name, GCS));
    }
}

#[test]
fn without_a_name_an_endpoint_is_called_by_its_address() {
    let server = TcpServer::down();
    let router = Router::launch(&[&format!("tcpout:{}", server.address()), "udpin://127.0.0.1:0"]);
    router.log.wait_for(&["udpin:127.0.0.1:0: listening on 127.0.0.1:"]);
    let mut server = server;
    server.up();
    drop(server.accept(VEHICLE));
    router.log.wait_for(&[&format!("tcpout:{}: link #", server.address()), " up: "]);
}
