//! Damaged frames and unknown ones (rules 7, 21-26): what may pass, and what may teach.

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";
const UDP: &str = "udpin:127.0.0.1:0?name=udp";

/// Another system that lives at a link of somebody else.
const HIDDEN: Component = Component::new(5, 1);

#[test]
fn rule_21_a_damaged_frame_is_neither_forwarded_nor_learned_from() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    for frame in [heartbeat(HIDDEN), command_long(HIDDEN, GCS), attitude(HIDDEN, 4)] {
        vehicle.send(corrupted(&frame));
        gcs.expect_nothing_from(&mut vehicle);
    }
    gcs.send(command_long(GCS, HIDDEN));
    vehicle.expect_nothing_from(&mut gcs);
}

#[test]
fn rule_21_every_single_damaged_byte_is_noticed() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.udp("udp", VEHICLE);
    let whole = attitude(VEHICLE, 0x0102_0304);
    // From the payload on: before it, other lengths and other ids have rules of their own.
    for position in 10..whole.len() {
        let mut damaged = whole.clone();
        damaged[position] ^= 0x10;
        vehicle.send(damaged);
    }
    gcs.expect_nothing_from(&mut vehicle);
}

#[test]
fn a_stranger_at_a_udp_port_is_admitted_by_a_good_frame_and_not_by_a_damaged_one() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.tcp("tcp", GCS);
    let mut vehicle = router.udp("udp", VEHICLE);
    let mut stranger = Peer::new(UdpWire::to(router.address("udp")), OTHER);
    stranger.send(corrupted(&heartbeat(OTHER)));
    gcs.expect_nothing_from(&mut vehicle);
    gcs.send(heartbeat(GCS));
    vehicle.expect(heartbeat(GCS));
    stranger.send(heartbeat(OTHER));
    vehicle.expect(heartbeat(OTHER));
    gcs.expect(heartbeat(OTHER));
    // It hears what was said after it came in, and nothing from before.
    stranger.expect_nothing_from(&mut gcs);
}

#[test]
fn rule_22_unknown_messages_go_to_everybody_else() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut other = router.tcp("tcp", OTHER);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    for n in 0..5 {
        vehicle.send(unknown(VEHICLE, n));
        gcs.expect(unknown(VEHICLE, n));
        other.expect(unknown(VEHICLE, n));
    }
    vehicle.expect_nothing_from(&mut gcs);
}

#[test]
fn rule_23_an_unknown_message_that_no_definition_can_explain_is_dropped_at_once() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    vehicle.send(corrupted(&unknown(VEHICLE, 1)));
    gcs.expect_nothing_from(&mut vehicle);
}

#[test]
fn rule_23_once_two_unknown_messages_agree_a_third_must_agree_with_them() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.udp("udp", VEHICLE);
    for n in 0..2 {
        vehicle.send(unknown(VEHICLE, n));
        gcs.expect(unknown(VEHICLE, n));
    }
    vehicle.send(as_if_defined_otherwise(2));
    gcs.expect_nothing_from(&mut vehicle);
    vehicle.send(unknown(VEHICLE, 3));
    gcs.expect(unknown(VEHICLE, 3));
}

/// An unknown message whose damage looks like another CRC_EXTRA.
fn as_if_defined_otherwise(n: u8) -> Vec<u8> {
    let message = Message { extra: UNKNOWN.extra ^ 0x5a, ..UNKNOWN };
    Draft::new(VEHICLE, message, [n, 0, 0, 1]).build()
}

#[test]
fn rule_24_nothing_is_learned_from_an_unknown_message_before_a_second_agrees() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    vehicle.send(unknown(HIDDEN, 1));
    gcs.expect(unknown(HIDDEN, 1));
    gcs.send(command_long(GCS, HIDDEN));
    vehicle.expect_nothing_from(&mut gcs);
    for n in 2..4 {
        vehicle.send(unknown(HIDDEN, n));
        gcs.expect(unknown(HIDDEN, n));
    }
    gcs.send(command_long(GCS, HIDDEN));
    vehicle.expect(command_long(GCS, HIDDEN));
}

#[test]
fn rule_26_a_known_message_with_a_foreign_definition_passes_from_the_second_time_on() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut other = router.tcp("tcp", OTHER);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let foreign = |n: u8| {
        let message = Message { extra: 1, ..ATTITUDE };
        Draft::new(VEHICLE, message, [n, 0, 0, 1]).seq(n).build()
    };
    vehicle.send(foreign(1));
    gcs.expect_nothing_from(&mut vehicle);
    for n in 3..6 {
        vehicle.send(foreign(n));
    }
    // Whether the second itself passes or only opens the way is not what this is about.
    let received = gcs.receive_rest_from(&mut vehicle);
    assert!(received.ends_with(&[foreign(4), foreign(5)]), "{received:02x?}");
    assert_eq!(other.receive_rest_from(&mut vehicle), received);
}

#[test]
fn rule_7_a_frame_with_an_unknown_incompatibility_flag_is_dropped_and_the_next_is_not() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut incompatible = heartbeat(VEHICLE);
    incompatible[2] = 0x02;
    vehicle.send([incompatible, attitude(VEHICLE, 1)].concat());
    gcs.expect(attitude(VEHICLE, 1));
    gcs.expect_nothing_from(&mut vehicle);
}

#[test]
fn rule_47_a_secret_key_is_not_passed_on_whatever_its_target() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    for to in [VEHICLE, Component::new(0, 0)] {
        gcs.send(setup_signing(GCS, to));
        vehicle.expect_nothing_from(&mut gcs);
    }
}

#[test]
fn rule_46_the_report_of_a_radio_is_forwarded() {
    let router = Router::start(&[TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    for radio_status in
        [Message { id: 109, extra: 185, len: 9 }, Message { id: 166, extra: 21, len: 9 }]
    {
        let radio = Component::new(51, 68);
        let report = Draft::new(radio, radio_status, [0, 0, 0, 0, 200, 190, 100, 30, 31]).v1();
        vehicle.send(report.build());
        gcs.expect(report.build());
    }
}
