//! Idle costs nothing: with links of every kind up and nobody speaking, the router sleeps.

use std::thread;
use std::time::Duration;

use crate::harness::*;

/// How long it is watched.
const WATCHED: Duration = Duration::from_secs(10);

/// How long after the last frame everything that a frame brings about is over.
const SETTLED: Duration = Duration::from_millis(500);

#[test]
fn a_router_with_links_of_every_kind_and_no_traffic_sleeps() {
    let pty = Pty::new();
    let mut server = TcpServer::down();
    server.up();
    let station = Peer::<UdpWire>::awaiting(GCS_2);
    // For what nobody is to hear.
    let (nobody, alone) = (FreePort::new(), FreePort::new());
    let router = Router::start(&[
        &format!("serial:{}:57600?name=serial", pty.device()),
        "tcpin:127.0.0.1:0?name=tcp&dev=lo",
        &format!("tcpout:{}?name=call", server.address()),
        "udpin:127.0.0.1:0?name=udp&dev=lo",
        &format!("udpout:{}?name=send&dev=lo", station.wire.address()),
        &format!("udpbcast:127.255.255.255:{}?name=all&bind=127.0.0.1", nobody.number()),
        &format!("mcast:239.255.145.50:{}?name=group&dev=lo&ttl=0", alone.number()),
        "udpin:127.0.0.1:0?name=one&group=way",
        "udpin:127.0.0.1:0?name=two&group=way&path=best&dedup=100",
    ]);
    let mut called = server.accept(OTHER);
    called.send_mark();
    let mut vehicle = router.serial("serial", pty, VEHICLE);
    let mut gcs = router.tcp("tcp", GCS);
    let _camera = router.udp("udp", CAMERA);
    let _one = router.udp("one", Component::new(3, 1));
    let _two = router.udp("two", Component::new(4, 1));
    router.assert_serves(&mut gcs, &mut vehicle);
    router.assert_serves(&mut called, &mut vehicle);
    thread::sleep(SETTLED);
    let process = router.process();
    let before = (process.wakeups(), process.processor_time());
    thread::sleep(WATCHED);
    let wakeups = process.wakeups() - before.0;
    let used = process.processor_time() - before.1;
    println!("{wakeups} wake-ups and {used:?} of processor time in {WATCHED:?} without traffic");
    assert!(wakeups <= WATCHED.as_secs(), "{wakeups} wake-ups in {WATCHED:?}");
    router.assert_serves(&mut gcs, &mut vehicle);
}
