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
    let [down, up] =
        [VEHICLE, GCS].map(|from| (0..50).map(|n| attitude(from, n)).collect::<Vec<_>>());
    vehicle.send_each(&down);
    gcs.send_each(&up);
    assert_no_copies(&count_copies(&mut gcs, &down));
    assert_no_copies(&count_copies(&mut vehicle, &up));
    // Neither do addressed frames go round.
    let (command, ack) = (command_long(GCS, VEHICLE), command_ack(VEHICLE, GCS));
    gcs.send(&command);
    vehicle.send(&ack);
    assert_no_copies(&count_copies(&mut gcs, &[ack]));
    assert_no_copies(&count_copies(&mut vehicle, &[command]));
    for router in [&left, &right] {
        assert!(router.log.len() < 200, "{} lines", router.log.len());
    }
}

#[test]
fn two_routers_joined_by_a_group_lose_nothing_and_double_nothing() {
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
    let frames: Vec<_> = (0..50).map(|n| attitude(VEHICLE, n)).collect();
    vehicle.send_each(&frames);
    let copies = count_copies(&mut gcs, &frames);
    for (n, frame) in frames.iter().enumerate() {
        assert_eq!(copies[frame], 1, "copies of number {n}");
    }
}

/// Reads until all of `expected` have come and it has been quiet for a while, or has been loud for
/// too long.
fn count_copies(peer: &mut Peer<TcpWire>, expected: &[Vec<u8>]) -> HashMap<Vec<u8>, usize> {
    let mut copies = HashMap::new();
    let mut total = 0;
    loop {
        let is_all = expected.iter().all(|frame| copies.contains_key(frame));
        let patience = if is_all { Duration::from_millis(500) } else { PATIENCE };
        let Some(frame) = peer.try_receive(patience) else {
            assert!(is_all, "of {} frames, {} came", expected.len(), copies.len());
            return copies;
        };
        *copies.entry(frame).or_default() += 1;
        total += 1;
        assert!(total < 10_000, "a storm");
    }
}

fn assert_no_copies(copies: &HashMap<Vec<u8>, usize>) {
    for (frame, count) in copies {
        assert_eq!(*count, 1, "copies of {frame:02x?}");
    }
}
