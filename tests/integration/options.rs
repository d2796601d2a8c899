//! Options of endpoints, as far as a peer can tell them by what it hears.

use std::time::{Duration, Instant};

use rustix::process::Signal;

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";

#[test]
fn a_secret_key_passes_between_two_endpoints_that_both_allow_it_and_nowhere_else() {
    let router = Router::start(&[
        "tcpin:127.0.0.1:0?name=wire&forward_setup_signing=true",
        "udpin:127.0.0.1:0?name=udp&forward_setup_signing=true",
        TCP,
    ]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("wire", VEHICLE);
    let mut other = router.tcp("tcp", OTHER);
    gcs.send(setup_signing(GCS, VEHICLE));
    vehicle.expect(setup_signing(GCS, VEHICLE));
    gcs.send(setup_signing(GCS, OTHER));
    other.expect_nothing_from(&mut gcs);
    gcs.send(setup_signing(GCS, Component::new(0, 0)));
    vehicle.expect(setup_signing(GCS, Component::new(0, 0)));
    other.expect_nothing_from(&mut gcs);
    other.send(setup_signing(OTHER, VEHICLE));
    vehicle.expect_nothing_from(&mut other);
}

#[test]
fn with_max_peers_those_who_are_there_stay_and_no_more_come() {
    let router = Router::start(&["udpin:127.0.0.1:0?name=udp&max_peers=2", TCP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut first = router.udp("udp", GCS);
    let mut second = router.udp("udp", GCS_2);
    let mut third = Peer::new(UdpWire::to(router.address("udp")), OTHER);
    third.send(heartbeat(OTHER));
    router.log.wait_for(&["udp: ", "refused"]);
    // Who is refused is not heard either.
    first.expect_nothing_from(&mut second);
    router.assert_serves(&mut first, &mut vehicle);
    router.assert_serves(&mut second, &mut vehicle);
}

#[test]
fn with_max_peers_one_who_hangs_up_and_calls_again_finds_its_own_place_free() {
    let router = Router::start(&["tcpin:127.0.0.1:0?name=few&max_peers=1", TCP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut vehicle = router.tcp_unnoticed("few", VEHICLE);
    for n in 0..20 {
        router.assert_serves(&mut gcs, &mut vehicle);
        // So that the router finds both at once.
        router.signal(Signal::STOP);
        vehicle.send(attitude(VEHICLE, n));
        let again = router.tcp_unnoticed("few", VEHICLE);
        drop(vehicle);
        router.signal(Signal::CONT);
        gcs.expect(attitude(VEHICLE, n));
        vehicle = again;
    }
    router.assert_serves(&mut gcs, &mut vehicle);
}

#[test]
fn with_max_peers_one_connection_too_many_is_closed() {
    let router = Router::start(&["tcpin:127.0.0.1:0?name=few&max_peers=1", TCP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut first = router.tcp("few", GCS);
    let mut second = router.tcp_unnoticed("few", GCS_2);
    assert_eq!(second.receive_to_end(), Vec::<Vec<u8>>::new());
    router.assert_serves(&mut first, &mut vehicle);
    drop(first);
    router.wait_until_lost(GCS);
    let mut third = router.tcp_unnoticed("few", GCS_2);
    router.assert_serves(&mut third, &mut vehicle);
}

#[test]
fn with_peer_timeout_a_silent_peer_is_forgotten_and_welcome_again() {
    let router = Router::start(&["udpin:127.0.0.1:0?name=udp&peer_timeout=300ms", TCP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut gcs = router.udp("udp", GCS);
    router.log.wait_for(&["udp: link #", " down: "]);
    router.wait_until_lost(GCS);
    vehicle.meet(&mut gcs);
}

#[test]
fn with_stall_timeout_a_connection_that_takes_nothing_is_closed_and_others_are_not() {
    let router = Router::start(&["tcpin:127.0.0.1:0?name=tcp&stall_timeout=300ms"]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut healthy = router.tcp("tcp", GCS);
    let stalled = Peer::new(TcpWire::narrow_to(router.address("tcp")), GCS_2);
    router.wait_for_link("tcp", &stalled.wire);
    let mut n = 0;
    eventually("the stalled connection is closed", || {
        let frames: Vec<_> = (n..n + 200).map(|n| bulk(VEHICLE, n)).collect();
        vehicle.send(frames.concat());
        healthy.expect_each(&frames);
        n += 200;
        router.log.has(&["tcp: link #", " down: "])
    });
    router.assert_serves(&mut healthy, &mut vehicle);
}

#[test]
fn with_pack_frames_that_leave_together_share_datagrams_of_whole_frames() {
    let socket = roomy_udp_socket("127.0.0.1:0".parse().unwrap());
    socket.set_read_timeout(Some(PATIENCE)).unwrap();
    let gcs = socket.local_addr().unwrap();
    let router = Router::start(&[&format!("udpout:{gcs}?name=out&pack=true&mtu=600"), TCP]);
    let mut vehicle = router.tcp_silent("tcp", VEHICLE);
    let frames: Vec<_> = (0..30).map(|n| attitude(VEHICLE, n)).collect();
    vehicle.send(frames.concat());
    let (mut received, mut datagrams, mut buffer) = (Vec::new(), 0, [0; 2000]);
    while received.len() < frames.concat().len() {
        let len = socket.recv(&mut buffer).unwrap();
        assert!(len <= 600 && len.is_multiple_of(frames[0].len()), "{len} bytes");
        received.extend_from_slice(&buffer[..len]);
        datagrams += 1;
    }
    assert_eq!(received, frames.concat());
    assert!(datagrams < frames.len(), "{datagrams} datagrams");
}

#[test]
fn with_dedup_the_second_copy_by_another_way_is_dropped() {
    let router = Router::start(&[
        "tcpin:127.0.0.1:0?name=radio&dedup=1000&group=way",
        "tcpin:127.0.0.1:0?name=mobile&dedup=1000&group=way",
        "udpin:127.0.0.1:0?name=udp",
    ]);
    let mut gcs = router.udp("udp", GCS);
    let mut by_radio = router.tcp("radio", VEHICLE);
    let mut by_mobile = router.tcp("mobile", VEHICLE);
    gcs.meet(&mut by_mobile);
    for n in 0..20 {
        let began = Instant::now();
        by_radio.send(attitude(VEHICLE, n));
        gcs.expect(attitude(VEHICLE, n));
        by_mobile.send(attitude(VEHICLE, n));
        let copies = gcs.receive_rest_from(&mut by_mobile);
        // The window is short: on a machine too busy for it, once more.
        if began.elapsed() < Duration::from_millis(800) {
            assert_eq!(copies, Vec::<Vec<u8>>::new());
            return;
        }
    }
    panic!("the machine is too busy to tell");
}

#[test]
fn nothing_is_forwarded_between_endpoints_of_one_group() {
    let router = Router::start(&[
        "tcpin:127.0.0.1:0?name=radio&group=way",
        "tcpin:127.0.0.1:0?name=mobile&group=way",
        "udpin:127.0.0.1:0?name=udp",
    ]);
    let mut gcs = router.udp("udp", GCS);
    let mut by_radio = router.tcp("radio", VEHICLE);
    let mut by_mobile = router.tcp("mobile", OTHER);
    by_radio.send(attitude(VEHICLE, 1));
    by_radio.send(command_long(VEHICLE, OTHER));
    gcs.expect(attitude(VEHICLE, 1));
    gcs.expect_nothing_from(&mut by_radio);
    by_mobile.expect_nothing_from(&mut gcs);
}
