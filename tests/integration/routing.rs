//! Where a frame goes (rules 27-39): to its target's links, or to all but its own.

use crate::harness::*;

const TCP_AND_UDP: [&str; 2] = ["tcpin:127.0.0.1:0?name=tcp", "udpin:127.0.0.1:0?name=udp"];

fn start() -> Router {
    Router::start(&TCP_AND_UDP)
}

#[test]
fn a_command_goes_to_its_vehicle_alone_and_the_answer_to_its_ground_station_alone() {
    let router = start();
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut other = router.tcp("tcp", OTHER);
    gcs.send(command_long(GCS, VEHICLE));
    vehicle.expect(command_long(GCS, VEHICLE));
    other.expect_nothing_from(&mut gcs);
    vehicle.send(command_ack(VEHICLE, GCS));
    gcs.expect(command_ack(VEHICLE, GCS));
    other.expect_nothing_from(&mut vehicle);
    vehicle.expect_nothing_from(&mut gcs);
}

#[test]
fn rule_33_a_broadcast_goes_to_all_but_its_sender() {
    let router = start();
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut other = router.tcp("tcp", OTHER);
    vehicle.send(attitude(VEHICLE, 1));
    gcs.expect(attitude(VEHICLE, 1));
    other.expect(attitude(VEHICLE, 1));
    vehicle.expect_nothing_from(&mut gcs);
}

#[test]
fn rule_33_who_has_never_spoken_hears_broadcasts_all_the_same() {
    let router = start();
    let mut listener = router.tcp_silent("tcp", WITNESS);
    let mut vehicle = router.udp("udp", VEHICLE);
    vehicle.send(heartbeat(VEHICLE));
    listener.expect(heartbeat(VEHICLE));
}

#[test]
fn rule_33_without_a_target_system_the_target_component_does_not_matter() {
    let router = start();
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut other = router.tcp("tcp", OTHER);
    let to_any_camera = command_long(GCS, Component::new(0, 100));
    gcs.send(&to_any_camera);
    vehicle.expect(&to_any_camera);
    other.expect(&to_any_camera);
}

#[test]
fn what_is_for_an_unknown_system_goes_nowhere() {
    let router = start();
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut other = router.udp("udp", OTHER);
    for target in [Component::new(42, 1), Component::new(42, 0)] {
        gcs.send(command_long(GCS, target));
    }
    vehicle.expect_nothing_from(&mut gcs);
    other.expect_nothing_from(&mut gcs);
}

#[test]
fn rule_36_what_is_for_a_whole_system_goes_to_every_link_of_it() {
    let router = start();
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut camera = router.udp("udp", CAMERA);
    let mut other = router.tcp("tcp", OTHER);
    let everything = Component::new(VEHICLE.system, 0);
    for frame in [param_request_list(GCS, everything), set_mode(GCS, VEHICLE.system)] {
        gcs.send(&frame);
        vehicle.expect(&frame);
        camera.expect(&frame);
    }
    other.expect_nothing_from(&mut gcs);
}

#[test]
fn rule_37_what_is_for_a_known_component_does_not_go_to_others_of_its_system() {
    let router = start();
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut camera = router.tcp("tcp", CAMERA);
    gcs.send(command_long(GCS, CAMERA));
    camera.expect(command_long(GCS, CAMERA));
    vehicle.expect_nothing_from(&mut gcs);
}

#[test]
fn rule_38_what_is_for_an_unknown_component_goes_to_every_link_of_its_system() {
    let router = start();
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut camera = router.udp("udp", CAMERA);
    let mut other = router.tcp("tcp", OTHER);
    let parachute = command_long(GCS, Component::new(VEHICLE.system, 161));
    gcs.send(&parachute);
    vehicle.expect(&parachute);
    camera.expect(&parachute);
    other.expect_nothing_from(&mut gcs);
}

#[test]
fn rule_38_with_strict_what_is_for_an_unknown_component_goes_nowhere() {
    let router = Router::start(&["--strict", TCP_AND_UDP[0], TCP_AND_UDP[1]]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    gcs.send(command_long(GCS, Component::new(VEHICLE.system, 161)));
    vehicle.expect_nothing_from(&mut gcs);
    gcs.send(command_long(GCS, VEHICLE));
    vehicle.expect(command_long(GCS, VEHICLE));
}

#[test]
fn rule_34_two_ground_stations_at_one_udp_port_each_get_only_their_own() {
    let router = start();
    let mut first = router.udp("udp", GCS);
    let mut second = router.udp("udp", GCS_2);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    for _ in 0..3 {
        vehicle.send(command_ack(VEHICLE, GCS));
        first.expect(command_ack(VEHICLE, GCS));
        second.expect_nothing_from(&mut vehicle);
        vehicle.send(command_ack(VEHICLE, GCS_2));
        second.expect(command_ack(VEHICLE, GCS_2));
        first.expect_nothing_from(&mut vehicle);
    }
    vehicle.send(attitude(VEHICLE, 1));
    first.expect(attitude(VEHICLE, 1));
    second.expect(attitude(VEHICLE, 1));
}

#[test]
fn rule_34_two_peers_of_one_udp_port_hear_each_other() {
    let router = start();
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.udp("udp", VEHICLE);
    vehicle.send(attitude(VEHICLE, 1));
    gcs.expect(attitude(VEHICLE, 1));
    gcs.send(command_long(GCS, VEHICLE));
    vehicle.expect(command_long(GCS, VEHICLE));
}

#[test]
fn a_component_on_two_links_gets_its_frames_on_both() {
    let router = start();
    let mut gcs = router.udp("udp", GCS);
    let mut by_radio = router.tcp("tcp", VEHICLE).deaf_to_own_id();
    let mut by_mobile = router.tcp("tcp", VEHICLE).deaf_to_own_id();
    gcs.meet(&mut by_mobile);
    gcs.send(command_long(GCS, VEHICLE));
    by_radio.expect(command_long(GCS, VEHICLE));
    by_mobile.expect(command_long(GCS, VEHICLE));
}

#[test]
fn rule_39_what_is_known_only_on_its_own_link_goes_nowhere() {
    let router = start();
    let mut vehicle = router.tcp("tcp", VEHICLE);
    vehicle.send(heartbeat(CAMERA));
    router.wait_until_seen(CAMERA);
    let mut gcs = router.udp("udp", GCS);
    for target in [CAMERA, VEHICLE, Component::new(VEHICLE.system, 0)] {
        vehicle.send(command_long(VEHICLE, target));
    }
    gcs.expect_nothing_from(&mut vehicle);
    vehicle.expect_nothing_from(&mut gcs);
}

#[test]
fn rule_29_an_acknowledgement_of_mavlink_1_has_no_target_and_goes_to_all() {
    let router = start();
    let mut first = router.udp("udp", GCS);
    let mut second = router.tcp("tcp", GCS_2);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    vehicle.send(command_ack_v1(VEHICLE));
    first.expect(command_ack_v1(VEHICLE));
    second.expect(command_ack_v1(VEHICLE));
}

#[test]
fn rule_10_a_target_that_was_trimmed_away_is_zero_in_every_length() {
    let router = start();
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut other = router.tcp("tcp", OTHER);
    for len in 1..=COMMAND_LONG.len {
        let shorter = Message { len, ..COMMAND_LONG };
        let mut payload = vec![0x55; len];
        // From byte 30 on there is a target system, and from 31 on a component.
        payload.iter_mut().skip(30).for_each(|byte| *byte = VEHICLE.system);
        let frame = Draft::new(GCS, shorter, payload).build();
        gcs.send(&frame);
        vehicle.expect(&frame);
        if len <= 30 {
            other.expect(&frame);
        }
    }
    other.expect_nothing_from(&mut gcs);
}

#[test]
fn rule_49_what_was_just_heard_from_a_source_on_a_link_is_not_sent_back_there() {
    let router = start();
    let mut gcs = router.udp("udp", GCS);
    let mut by_radio = router.tcp("tcp", VEHICLE);
    let mut by_mobile = router.tcp("tcp", VEHICLE);
    // The rule holds for some seconds: on a machine too busy for that, once more.
    for n in 0..20 {
        let began = std::time::Instant::now();
        gcs.receive_rest_from(&mut by_mobile);
        by_radio.send(attitude(VEHICLE, n));
        gcs.expect(attitude(VEHICLE, n));
        let echoes = by_mobile.receive_rest_from(&mut gcs);
        if began.elapsed().as_secs() < 4 {
            assert_eq!(echoes, Vec::<Vec<u8>>::new());
            return;
        }
    }
    panic!("the machine is too busy to tell");
}

#[test]
fn rule_49_a_source_that_has_fallen_silent_on_a_link_is_heard_there_again() {
    let router = start();
    let mut gcs = router.udp("udp", GCS);
    let mut by_radio = router.tcp("tcp", VEHICLE);
    let mut by_mobile = router.tcp("tcp", VEHICLE);
    gcs.receive_rest_from(&mut by_mobile);
    // Some seconds after that:
    by_mobile.meet(&mut by_radio);
}
