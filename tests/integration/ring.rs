//! Two routers joined by two links: what goes round must not go on for ever (rule 49).

use std::collections::HashMap;
use std::time::Duration;

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";

#[test]
fn two_routers_joined_twice_make_no_storm() {
    let left = Router::start(&["udpin:127.0.0.1:0?name=one", "udpin:127.0.0.1:0?name=two", TCP]);
    let one = format!("udpout:{}?name=one", left.address("one"));
    let two = format!("udpout:{}?name=two", left.address("two"));
    let right = Router::start(&[&one, &two, TCP]);
    let mut gcs = right.tcp("tcp", GCS);
    let mut vehicle = left.tcp("tcp", VEHICLE);
    vehicle.meet(&mut gcs);
    gcs.meet(&mut vehicle);
    for n in 0..50 {
        vehicle.send(attitude(VEHICLE, n));
        gcs.send(attitude(GCS, n));
    }
    assert_no_copies(&count_copies(&mut gcs));
    assert_no_copies(&count_copies(&mut vehicle));
    // Neither do addressed frames go round.
    gcs.send(command_long(GCS, VEHICLE));
    vehicle.send(command_ack(VEHICLE, GCS));
    assert_no_copies(&count_copies(&mut gcs));
    assert_no_copies(&count_copies(&mut vehicle));
    for router in [&left, &right] {
        assert!(router.log.len() < 200, "{} lines", router.log.len());
    }
}

#[test]
fn two_routers_joined_by_a_group_lose_nothing_and_make_no_storm() {
    let left = Router::start(&[
        "udpin:127.0.0.1:0?name=one&group=pair",
        "udpin:127.0.0.1:0?name=two&group=pair",
        TCP,
    ]);
    let one = format!("udpout:{}?name=one&group=pair", left.address("one"));
    let two = format!("udpout:{}?name=two&group=pair", left.address("two"));
    let right = Router::start(&[&one, &two, TCP]);
    let mut gcs = right.tcp("tcp", GCS);
    let mut vehicle = left.tcp("tcp", VEHICLE);
    vehicle.meet(&mut gcs);
    gcs.meet(&mut vehicle);
    for n in 0..50 {
        vehicle.send(attitude(VEHICLE, n));
    }
    let copies = count_copies(&mut gcs);
    for n in 0..50 {
        let count = copies.get(&attitude(VEHICLE, n)).copied().unwrap_or_default();
        assert!((1..=2).contains(&count), "{count} copies of number {n}");
    }
}

/// Reads until it has been quiet for a while, or has been loud for too long.
fn count_copies(peer: &mut Peer<TcpWire>) -> HashMap<Vec<u8>, usize> {
    let mut copies = HashMap::new();
    let mut total = 0;
    while let Some(frame) = peer.try_receive(Duration::from_millis(500)) {
        *copies.entry(frame).or_default() += 1;
        total += 1;
        assert!(total < 10_000, "a storm");
    }
    copies
}

fn assert_no_copies(copies: &HashMap<Vec<u8>, usize>) {
    assert!(!copies.is_empty(), "nothing came");
    for (frame, count) in copies {
        assert_eq!(*count, 1, "copies of {frame:02x?}");
    }
}
