//! What is forwarded arrives byte for byte, whatever it is (rules 4-14, 41, 53).

use crate::harness::*;

const TCP_AND_UDP: [&str; 2] = ["tcpin:127.0.0.1:0?name=tcp", "udpin:127.0.0.1:0?name=udp"];

#[test]
fn every_shape_of_frame_goes_unchanged_from_udp_to_tcp() {
    let router = Router::start(&TCP_AND_UDP);
    let mut gcs = router.tcp("tcp", GCS);
    let mut vehicle = router.udp("udp", VEHICLE);
    vehicle.send_each(&every_shape(VEHICLE));
    gcs.expect_each(&every_shape(VEHICLE));
    gcs.expect_nothing_from(&mut vehicle);
}

#[test]
fn every_shape_of_frame_goes_unchanged_from_tcp_to_udp_one_frame_a_datagram() {
    let router = Router::start(&TCP_AND_UDP);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    vehicle.send(every_shape(VEHICLE).concat());
    gcs.expect_each(&every_shape(VEHICLE));
    gcs.expect_nothing_from(&mut vehicle);
}

#[test]
fn every_message_ever_published_goes_unchanged_in_every_version() {
    let router = Router::start(&TCP_AND_UDP);
    let mut gcs = router.tcp("tcp", GCS);
    let mut vehicle = router.udp("udp", VEHICLE);
    let mut sent = 0;
    for row in include_str!("../../src/mavlink/messages.tsv").lines().skip(1) {
        let frames = broadcasts_of(row);
        vehicle.send_each(&frames);
        gcs.expect_each(&frames);
        sent += frames.len();
    }
    assert!(sent > 765 * 2, "only {sent} frames were tried");
}

/// One row of the message table as MAVLink 1, MAVLink 2, untrimmed and signed; with no target.
fn broadcasts_of(row: &str) -> Vec<Vec<u8>> {
    let fields: Vec<&str> = row.split('\t').collect();
    let number = |field: usize| -> i32 { fields[field].parse().unwrap() };
    let (id, extra) = (number(0).try_into().unwrap(), number(1).try_into().unwrap());
    let len = usize::try_from(number(3)).unwrap().min(255);
    if id == 256 {
        return Vec::new(); // SETUP_SIGNING is not forwarded.
    }
    let mut payload = vec![0xa5; len];
    for target in [number(5), number(6)] {
        if let Some(byte) = usize::try_from(target).ok().and_then(|at| payload.get_mut(at)) {
            *byte = 0;
        }
    }
    if len > 40 {
        payload[len - 1] = 0; // Something to trim, in long ones.
    }
    let draft = Draft::new(VEHICLE, Message { id, extra, len }, payload);
    let mut drafts = vec![draft.clone(), draft.clone().untrimmed(), draft.clone().signed()];
    drafts.extend((id < 256).then(|| draft.v1()));
    drafts.iter().map(Draft::build).collect()
}

/// One row of the vectors: frames made by others, with what is in them.
struct Vector {
    number: u32,
    source: Component,
    frame: Vec<u8>,
}

fn vectors() -> Vec<Vector> {
    let rows = include_str!("../data/vectors.tsv").lines().skip(1);
    rows.map(|row| {
        let fields: Vec<&str> = row.split('\t').collect();
        let source = Component::new(fields[4].parse().unwrap(), fields[5].parse().unwrap());
        let number = fields[0].parse().unwrap();
        Vector { number, source, frame: from_hex(fields[10]) }
    })
    .collect()
}

fn from_hex(text: &str) -> Vec<u8> {
    let pairs = text.as_bytes().chunks(2).map(|pair| std::str::from_utf8(pair).unwrap());
    pairs.map(|pair| u8::from_str_radix(pair, 16).unwrap()).collect()
}

/// Rule 7: the layout of 25 is unknown. Rule 47: 21 carries a secret key.
fn may_pass(vector: &Vector) -> bool {
    vector.number != 25 && vector.number != 21
}

#[test]
fn the_vectors_of_a_ground_station_arrive_at_the_vehicles_but_21_and_25() {
    let router = Router::start(&TCP_AND_UDP);
    let mut vehicles = router.tcp("tcp", VEHICLE);
    vehicles.send(heartbeat(Component::new(3, 1)));
    router.wait_until_seen(Component::new(3, 1));
    let mut gcs = router.udp("udp", GCS);
    for vector in vectors().iter().filter(|vector| vector.source == GCS) {
        gcs.send(&vector.frame);
        if may_pass(vector) {
            vehicles.expect(&vector.frame);
        } else {
            vehicles.expect_nothing_from(&mut gcs);
        }
    }
    vehicles.expect_nothing_from(&mut gcs);
}

#[test]
fn the_vectors_of_vehicles_and_radios_arrive_at_the_ground_station() {
    let router = Router::start(&TCP_AND_UDP);
    let mut gcs = router.tcp("tcp", GCS);
    let mut vehicle = router.udp("udp", VEHICLE);
    let of_vehicles: Vec<_> = vectors().into_iter().filter(|vector| vector.source != GCS).collect();
    assert!(of_vehicles.iter().all(may_pass) && of_vehicles.len() == 7);
    for vector in &of_vehicles {
        vehicle.send(&vector.frame);
        gcs.expect(&vector.frame);
    }
    gcs.expect_nothing_from(&mut vehicle);
}

#[test]
fn rule_42_broadcast_and_addressed_frames_keep_their_order() {
    let router = Router::start(&TCP_AND_UDP);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut gcs = router.udp("udp", GCS);
    let mut frames = Vec::new();
    for n in 0..100 {
        frames.extend([attitude(GCS, n), command_long(GCS, VEHICLE), bulk(GCS, n)]);
    }
    gcs.send_each(&frames);
    vehicle.expect_each(&frames);
}

#[test]
fn a_router_says_nothing_by_itself() {
    let router = Router::start(&TCP_AND_UDP);
    let mut gcs = router.tcp("tcp", GCS);
    let mut vehicle = router.udp("udp", VEHICLE);
    vehicle.send(heartbeat(VEHICLE));
    gcs.expect(heartbeat(VEHICLE));
    gcs.send(heartbeat(GCS));
    vehicle.expect(heartbeat(GCS));
    vehicle.expect_nothing_from(&mut gcs);
    gcs.expect_nothing_from(&mut vehicle);
}
