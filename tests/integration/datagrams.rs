//! Frames and datagrams: several in one, one over several, and neighbours that do it wrong.

use std::time::{Duration, Instant};

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";
const UDP: &str = "udpin:127.0.0.1:0?name=udp";

/// Sends the frames as one datagram and expects them all, at UDP and at TCP.
fn all_of_one_datagram_arrive(frames: &[Vec<u8>]) {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut second = router.tcp("tcp", GCS_2);
    let mut vehicle = router.udp("udp", VEHICLE);
    let datagram = frames.concat();
    assert!(datagram.len() <= 65_507, "no datagram is that long");
    vehicle.send(datagram);
    second.expect_each(frames);
    gcs.expect_each(frames);
    gcs.expect_nothing_from(&mut vehicle);
}

#[test]
fn five_heartbeats_of_one_datagram_arrive() {
    all_of_one_datagram_arrive(&vec![heartbeat(VEHICLE); 5]);
}

#[test]
fn fifty_heartbeats_of_one_datagram_arrive() {
    all_of_one_datagram_arrive(&vec![heartbeat(VEHICLE); 50]);
}

#[test]
fn six_file_transfer_frames_of_one_datagram_longer_than_a_packet_arrive() {
    let everybody = Component::new(0, 0);
    let frames: Vec<_> = (0..6).map(|n| ftp_full_of_start_bytes(VEHICLE, everybody, n)).collect();
    assert!(frames.concat().len() > 1500);
    all_of_one_datagram_arrive(&frames);
}

#[test]
fn frames_of_every_shape_in_one_datagram_arrive() {
    all_of_one_datagram_arrive(&every_shape(VEHICLE));
}

#[test]
fn sixty_thousand_bytes_of_frames_in_one_datagram_arrive() {
    let frames: Vec<_> = (0..225).map(|n| bulk(VEHICLE, n)).collect();
    assert!(frames.concat().len() > 60_000);
    all_of_one_datagram_arrive(&frames);
}

#[test]
fn rule_20_a_frame_in_datagrams_of_one_byte_each_arrives() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut vehicle = router.udp("udp", VEHICLE);
    for frame in [heartbeat(VEHICLE), heartbeat_draft(VEHICLE).v1().signed().build()] {
        // A long silence within a frame may end it: on a machine that pauses here, once more.
        for attempt in 1.. {
            let began = Instant::now();
            vehicle.send_bytewise(&frame);
            let quick = began.elapsed() < Duration::from_millis(20);
            let received = gcs.receive_rest_from(&mut vehicle);
            if received == [frame.clone()] {
                break;
            }
            assert!(received.is_empty() && !quick && attempt < 50, "{received:02x?}");
        }
    }
}

#[test]
fn rule_20_a_frame_over_two_datagrams_arrives_between_those_of_a_neighbour() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut vehicle = router.udp("udp", VEHICLE);
    let mut other = router.udp("udp", OTHER);
    let frame = bulk(VEHICLE, 1);
    for cut in [1, 5, 100, 266] {
        vehicle.send(&frame[..cut]);
        other.send(attitude(OTHER, 1));
        gcs.expect(attitude(OTHER, 1));
        vehicle.send(&frame[cut..]);
        gcs.expect(&frame);
    }
}

#[test]
fn a_truncated_frame_of_one_peer_does_not_eat_those_of_another() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut broken = router.udp("udp", OTHER);
    let mut vehicle = router.udp("udp", VEHICLE);
    for cut in [1, 3, 9, 10, 60, 266] {
        broken.send(&bulk(OTHER, 1)[..cut]);
        let frames: Vec<_> = (0..5).map(|n| attitude(VEHICLE, n)).collect();
        vehicle.send_each(&frames);
        gcs.expect_each(&frames);
    }
    gcs.expect_nothing_from(&mut vehicle);
}

#[test]
fn a_datagram_that_ends_within_a_frame_does_no_harm_to_other_peers() {
    let router = Router::start(&[TCP, UDP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut first = router.udp("udp", GCS);
    let mut broken = router.udp("udp", GCS_2);
    for n in 0..5 {
        let whole = attitude(GCS_2, n);
        broken.send([&whole[..], &bulk(GCS_2, n)[..40]].concat());
        vehicle.expect(&whole);
        first.expect(&whole);
        vehicle.send(attitude(VEHICLE, n));
        first.expect(attitude(VEHICLE, n));
        broken.expect(attitude(VEHICLE, n));
    }
}

#[test]
fn a_damaged_frame_does_not_hold_back_the_rest_of_its_datagram() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.udp("udp", VEHICLE);
    let good: Vec<_> = (0..3).map(|n| attitude(VEHICLE, n)).collect();
    vehicle.send([corrupted(&heartbeat(VEHICLE)), good.concat()].concat());
    gcs.expect_each(&good);
    gcs.expect_nothing_from(&mut vehicle);
}

#[test]
fn what_the_system_does_not_send_is_counted_as_that_and_not_as_sent() {
    // Only a socket that broadcasts may send there.
    let router = Router::start(&["udpout:255.255.255.255:9?name=nowhere&pack=true", UDP]);
    let mut vehicle = router.udp("udp", VEHICLE);
    let frames: Vec<_> = (0..5).map(|n| attitude(VEHICLE, n)).collect();
    vehicle.send(frames.concat());
    router.log.wait_for(&["nowhere: cannot send to 255.255.255.255:9"]);
    let mut client = router.client();
    eventually("all are counted", || {
        let snapshot = client.status().expect("an answer");
        let of = |name| snapshot.endpoints.iter().find(|it| it.name == name).expect("an endpoint");
        let heard = of("udp").links[0].counters.frames_in;
        let counters = &of("nowhere").links[0].counters;
        assert_eq!((counters.frames_out, counters.bytes_out), (0, 0));
        heard > 5 && counters.refused.get("unsendable") == Some(&heard)
    });
}
