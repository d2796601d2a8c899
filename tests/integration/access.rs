//! Who may be a peer of a server, by the address it comes from.

use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, TcpStream, UdpSocket};

use mavswitch::control::Request;
use socket2::{Domain, Socket, Type};

use crate::harness::*;

/// Another address of this computer.
const ELSEWHERE: Ipv4Addr = Ipv4Addr::new(127, 0, 0, 2);

/// Where a server at any address is for peers of IPv4.
fn ipv4(router: &Router, endpoint: &str) -> SocketAddr {
    SocketAddr::from((Ipv4Addr::LOCALHOST, router.address(endpoint).port()))
}

/// Somebody who sends from there.
fn udp_from(local: Ipv4Addr, to: SocketAddr, me: Component) -> Peer<UdpWire> {
    let socket = UdpSocket::bind((local, 0)).expect("an address of this computer");
    Peer::new(UdpWire::between(socket, to), me)
}

/// Somebody who connects from there.
fn tcp_from(local: Ipv4Addr, to: SocketAddr, me: Component) -> Peer<TcpWire> {
    let socket = Socket::new(Domain::IPV4, Type::STREAM, None).expect("a socket");
    socket.bind(&SocketAddr::from((local, 0)).into()).expect("an address of this computer");
    socket.connect(&to.into()).expect("a connection");
    Peer::new(TcpWire { stream: TcpStream::from(socket) }, me)
}

/// How often somebody was refused for its address.
fn refused(router: &Router, name: &str) -> u64 {
    router.endpoint(name).refused_peers.get("outside").copied().unwrap_or(0)
}

#[test]
fn a_udp_server_listens_to_nobody_outside_its_networks() {
    let router = Router::start(&["udpin:[::]:0?name=udp&allow_from=127.0.0.1,fd00::/8"]);
    let at = ipv4(&router, "udp");
    // Over a socket of IPv6 its address looks like one of IPv6, and is none.
    let mut vehicle = udp_from(Ipv4Addr::LOCALHOST, at, VEHICLE);
    vehicle.send_mark();
    router.wait_until_seen(VEHICLE);
    let mut inside = udp_from(Ipv4Addr::LOCALHOST, at, GCS);
    vehicle.meet(&mut inside);

    // Each from a port of its own.
    for _ in 0..3 {
        udp_from(ELSEWHERE, at, OTHER).send(heartbeat(OTHER));
    }
    let local = SocketAddr::from((Ipv6Addr::LOCALHOST, at.port()));
    Peer::new(UdpWire::to(local), GCS_2).send(heartbeat(GCS_2));
    eventually("four refusals", || refused(&router, "udp") == 4);
    inside.expect_nothing_from(&mut vehicle);
    assert_eq!(router.endpoint("udp").links.len(), 2);
    // All that was to be told before this is in the log with it.
    udp_from(Ipv4Addr::LOCALHOST, at, WITNESS).send_mark();
    router.wait_until_seen(WITNESS);
    let text = router.log.text();
    let lines = text.matches("refused: its address is not in allow_from").count();
    assert_eq!(lines, 2, "once for each address, whatever the port:\n{text}");
}

#[test]
fn a_tcp_server_hangs_up_on_everybody_outside_its_networks() {
    let router = Router::start(&["tcpin:127.0.0.1:0?name=tcp&allow_from=127.0.0.1"]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut stranger = tcp_from(ELSEWHERE, router.address("tcp"), OTHER);
    assert_eq!(stranger.receive_to_end(), Vec::<Vec<u8>>::new());
    let mut again = tcp_from(ELSEWHERE, router.address("tcp"), OTHER);
    again.receive_to_end();
    assert_eq!(refused(&router, "tcp"), 2);
    let mut gcs = router.tcp("tcp", GCS);
    assert_eq!(router.log.text().matches("is not in allow_from").count(), 1, "once a minute");
    router.assert_serves(&mut gcs, &mut vehicle);
}

#[test]
fn who_is_outside_from_now_on_is_sent_away_and_the_others_stay() {
    let router = Router::start(&["udpin:127.0.0.1:0?name=udp", "tcpin:127.0.0.1:0?name=tcp"]);
    let (udp, tcp) = (router.address("udp"), router.address("tcp"));
    let mut vehicle = router.udp("udp", VEHICLE);
    let mut gcs = router.tcp("tcp", GCS);
    let mut far_udp = udp_from(ELSEWHERE, udp, OTHER);
    let mut far_tcp = tcp_from(ELSEWHERE, tcp, GCS_2);
    vehicle.meet(&mut far_udp);
    far_udp.meet(&mut vehicle);
    vehicle.meet(&mut far_tcp);

    let change = |endpoint: String| {
        router.client().ask(Request::EndpointChange { endpoint }).expect("a change");
    };
    change("udpin:127.0.0.1:0?name=udp&allow_from=127.0.0.1".to_owned());
    change("tcpin:127.0.0.1:0?name=tcp&allow_from=127.0.0.1".to_owned());
    far_tcp.receive_to_end();
    router.log.wait_for(&["udp: link #", "down: its address is not in allow_from any more"]);
    router.assert_serves(&mut gcs, &mut vehicle);
    far_udp.send(heartbeat(OTHER));
    eventually("a refusal", || refused(&router, "udp") == 1);

    // And when it is let in again, it comes back.
    change("udpin:127.0.0.1:0?name=udp&allow_from=127.0.0.0/8".to_owned());
    gcs.meet(&mut far_udp);
}
